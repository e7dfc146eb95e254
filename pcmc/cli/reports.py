"""What the commands print about a designed roof."""

from __future__ import annotations

from ..certificate.balance import strained_junction
from ..certificate.tables import lean_texts
from ..contact.pinching import standing_part
from ..design.outcome import values_text
from ..project import Outcome

FAR = 10.0  # degrees: walls that lean less are not reported
UPRIGHT = 'a divider with upright = true keeps its wall in its plane, a target "lean" limits it'


def report(outcome: Outcome, *, verdict: bool = True) -> None:
    """Print how the solver ended, the targets and parameters, the verdict, and the files written."""
    before = "solved before (--no-cache solves it again)"
    detail = _advised(outcome.certificate.detail, outcome)
    message = _advised(outcome.solved.message, outcome)
    if verdict and detail:
        message = message.removesuffix(f"; {detail}")  # it follows the verdict
    print(f"{outcome.surface.m} triangles; {before if outcome.cached else message}")
    if outcome.accurate is not None:
        print(outcome.accurate.text(outcome.units))
    if outcome.design is not None:
        print(f"targets {outcome.design.text(outcome.units)}")
        if outcome.design.met:  # otherwise the message has the values
            tables = (outcome.design.targets, outcome.design.parameters)
            print(", with ".join(values_text(table, outcome.units) for table in tables))
    for note in outcome.notes:
        print(note)
    if verdict and outcome.units:
        print(outcome.units.sentence)
    if verdict and len(rooms := outcome.certificate.rooms):
        unit = outcome.units.behind("pressure")
        held = [
            f"{room!r} {pressure:.6g}{unit}"
            for room, pressure in zip(rooms["room"], rooms["pressure"], strict=True)
        ]
        print(f"pressures that keep the volumes: {', '.join(held)}")
    if verdict:
        print(outcome.certificate.verdict.value)
        if detail:
            print(detail)
        if outcome.whole is not None and outcome.solved.certificate.index is not None:
            whole = outcome.whole
            print(f"the whole roof, {whole.surface.m} triangles: {whole.certificate.verdict.value}")
        leaning = lean_texts(outcome.certificate.leaning, FAR)
        if leaning and outcome.certificate.certified:
            print(f"walls lean from the vertical: {', '.join(leaning)}; {UPRIGHT}")
    if outcome.advice:
        print("\n  ".join(outcome.advice))
    if outcome.files:
        print(f"written: {', '.join(map(str, outcome.files))}")


def _advised(text: str, outcome: Outcome) -> str:
    """A text without its own remedy for a junction where there is advice: that one was tried."""
    if not outcome.advice:
        return text
    surface = outcome.surface
    strained = strained_junction(surface, standing_part(surface).walls.pinchable)
    return text if strained is None else text.replace(strained.hint, "")
