"""What the commands print about a designed roof: how it ended, its mesh check and its margins."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from ..certificate.tables import lean_texts
from ..project import MOST_CHECKED, Outcome
from .progress import working

FAR = 10.0  # degrees: walls that lean less are not reported
UPRIGHT = 'a divider with upright = true keeps its wall in its plane, a target "lean" limits it'


def report(outcome: Outcome, *, verdict: bool = True) -> None:
    """Print how the solver ended, the targets and parameters, the verdict, and the files written."""
    certificate, units = outcome.certificate, outcome.units
    message, detail = outcome.ending
    if verdict and detail:
        message = message.removesuffix(f"; {detail}")  # it follows the verdict
    before = "solved before (--no-cache solves it again)"
    print(f"{outcome.surface.m} triangles; {before if outcome.cached else message}")
    if outcome.accurate is not None:
        print(outcome.accurate.text(units))
    if outcome.design is not None:
        print(f"targets {outcome.design.text(units)}")
        if outcome.design.met:  # otherwise the message has the values
            print(outcome.values_found)
    for note in outcome.notes:
        print(note)
    if verdict:
        if units:
            print(units.sentence)
        if len(rooms := certificate.rooms):
            pressures = zip(rooms["room"], rooms["pressure"], strict=True)
            held = [f"{room!r} {pressure:.6g}{units.behind('pressure')}" for room, pressure in pressures]
            print(f"pressures that keep the volumes: {', '.join(held)}")
        print(certificate.verdict.value)
        if detail:
            print(detail)
        if (whole := outcome.whole) is not None and outcome.solved.certificate.index is not None:
            print(f"the whole roof, {whole.surface.m} triangles: {whole.certificate.verdict.value}")
        leaning = lean_texts(certificate.leaning, FAR)
        if leaning and certificate.certified:
            print(f"walls lean from the vertical: {', '.join(leaning)}; {UPRIGHT}")
    if outcome.under_load is not None:
        print(outcome.under_load)
    if outcome.advice:
        print("\n  ".join(outcome.advice))
    if outcome.files:
        print(f"written: {', '.join(map(str, outcome.files))}")


def mesh_check(roof: Outcome, wanted: bool | None = None, *, brief: bool = False) -> None:
    """Check the mesh of a roof at rest, if that is wanted; print why not, or, with ``brief``, the result."""
    if not roof.wants_mesh_check(wanted):
        if roof.certificate.index is not None and roof.mesh_check_wanted(wanted) is None:
            print(f"mesh check left out above {MOST_CHECKED} triangles; --mesh-check does it")
        return
    sys.stdout.flush()
    with working() as progress:
        check = roof.check_mesh(progress)
    if check is None:  # the surface and its files are good without it
        print(f"no mesh check: {roof.mesh_failure}")
    elif brief:
        print(f"\n{check.brief(roof.units)}")


def margins(roof: Outcome, wanted: Sequence[str] = ()) -> None:
    """Find and print the margins wanted; of a certified roof also those that its project asks for."""
    own = roof.project.margin if roof.project is not None and roof.certified else ()
    sys.stdout.flush()
    for what in dict.fromkeys([*wanted, *own]):
        with working() as progress:
            found = roof.margin(what, progress)
        print(f"margin: {found.text(roof.units)}")
