"""What the commands print about a designed roof."""

from __future__ import annotations

import pandas as pd

from ..base.units import Units
from ..certificate.balance import strained_junction
from ..certificate.leaning import lean_texts
from ..contact.pinching import standing_part
from ..project import Outcome

UNIT_OF = dict.fromkeys(("apex", "height", "sag"), "length")
UNIT_OF |= {"reaction": "tension", "weight": "pressure", "lean": "angle"}
"""The unit of quantities and parameters; others are named as their units."""

FAR = 10.0  # degrees: walls that lean less are not reported
UPRIGHT = 'a divider with upright = true keeps its wall in its plane, a target "lean" limits it'


def report(outcome: Outcome, *, verdict: bool = True) -> None:
    """Print how the solver ended, the targets and parameters, the verdict, and the files written."""
    before = "solved before (--no-cache solves it again)"
    detail = _advised(outcome.certificate.detail, outcome)
    message = _advised(outcome.result.message, outcome)
    if verdict and detail:
        message = message.removesuffix(f"; {detail}")  # it follows the verdict
    print(f"{outcome.surface.m} triangles; {before if outcome.cached else message}")
    if outcome.accurate is not None:
        print(outcome.accurate.message)
    if outcome.design is not None:
        print(f"targets {outcome.design.message}")
        if outcome.design.met:  # otherwise the message has the values
            tables = (outcome.design.targets["value"], outcome.design.parameters["value"])
            print(", with ".join(_values(table, outcome.units) for table in tables))
    for note in outcome.notes:
        print(note)
    if verdict and outcome.units:
        print(outcome.units.sentence)
    if verdict and len(rooms := outcome.certificate.rooms):
        unit = f" {outcome.units.pressure}" if outcome.units else ""
        held = [
            f"{room!r} {pressure:.6g}{unit}"
            for room, pressure in zip(rooms["room"], rooms["pressure"], strict=True)
        ]
        print(f"pressures that keep the volumes: {', '.join(held)}")
    if verdict:
        print(outcome.certificate.verdict.value)
        if detail:
            print(detail)
        if outcome.whole is not None:
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


def _values(values: pd.Series, units: Units) -> str:
    """Targets or parameters, such as "apex of roof 1.2 m"; the first word of a label is the quantity."""
    shown = []
    for label, value in values.items():
        quantity = "force" if str(label).startswith("tension of cable ") else str(label).split()[0]
        unit = f" {getattr(units, UNIT_OF.get(quantity, quantity))}" if units else ""
        shown.append(f"{label} {value:.6g}{unit}")
    return ", ".join(shown)
