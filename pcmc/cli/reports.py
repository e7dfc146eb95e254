"""What the commands print about a designed roof, and their progress on a terminal that can redraw a line."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path
from typing import Any

from ..certificate.tables import lean_texts
from ..plan.lines import SNAP, is_straight
from ..project.advising import Changed, firmer
from ..project.outcome import MOST_CHECKED, Outcome
from . import NOT_CERTIFIED, OK

FAR = 10.0  # degrees: walls that lean less are not reported


def report(outcome: Outcome, *, verdict: bool = True) -> None:
    """Print how the solver ended, the targets and parameters, the verdict, and the files written."""
    certificate, units = outcome.certificate, outcome.units
    message, detail = outcome.ending
    if verdict and detail:
        message = message.removesuffix(f"; {detail}")  # it follows the verdict
    before = "solved before (--no-cache solves it again)"
    extent = f", {certificate.part}" if certificate.part else ""
    print(f"{outcome.surface.m} triangles{extent}; {before if outcome.cached else message}")
    if outcome.accurate is not None:
        print(outcome.accurate.text(units))
    if outcome.design is not None:
        print(f"targets {outcome.design.text(units)}")
        if outcome.design.met:  # otherwise the message has the values
            print(outcome.design.values(outcome.units))
    for note in outcome.remarks:
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
        leaning = lean_texts(certificate.leaning, outcome.surface.size, FAR)
        if leaning and certificate.certified:
            print(f"walls lean from the vertical: {', '.join(leaning)}; {_against_lean(outcome)}")
        if certificate.certified and outcome.shown.certificate.cuts_itself:
            print(f"not to be built as it is: {outcome.shown.certificate.cuts_itself}")
    if outcome.under_load is not None:
        print(outcome.under_load.text() if verdict else outcome.under_load)
    if outcome.advice:
        print("\n  ".join(outcome.advice))
    ended(outcome.good, outcome.files)


def _against_lean(outcome: Outcome) -> str:
    """What limits the lean of the walls that lean far; only a straight divider can hold its wall upright."""
    limit = 'a target "lean" limits it'
    plan = None if outcome.project is None else outcome.project.plan
    if plan is None:
        return limit

    table = outcome.certificate.leaning
    far = set(table["wall"][table["lean"] >= FAR])
    dividers = {d.name: d.curve.local(plan.plane) for d in plan.dividers if d.name in far}
    straight = [repr(name) for name, curve in dividers.items() if is_straight(curve, SNAP * plan.edge_length)]
    upright = f"upright = true under divider {' or '.join(straight)} keeps its wall in its plane, "
    return f"{upright if straight else ''}{limit}"


def mesh_check(
    roof: Outcome,
    wanted: bool | None = None,
    shown: str = "",
    changed: Changed | None = None,
    meshes: int | None = None,
) -> None:
    """Check the mesh of a roof at rest, if that is wanted, and look for advice; print why not, or what is
    to be ``shown``, "brief" or "text", and what to type."""
    if not roof.wants_mesh_check(wanted):
        asked, at_rest = roof.mesh_check_wanted(wanted), roof.certificate.index is not None
        if at_rest and asked is None:
            print(f"mesh check left out above {MOST_CHECKED} triangles; --mesh-check does it")
        elif asked and not at_rest:
            print("no mesh check: the surface is not at rest")
        return
    print(end="", flush=True)
    with working() as progress:
        check = roof.check_mesh(progress, meshes)
    if check is None:  # the surface and its files are good without it
        print(f"no mesh check: {roof.mesh_failure}")
        return
    if shown:
        print(f"\n{getattr(check, shown)(roof.units)}", flush=True)
    with working() as progress:
        if not check.advice and (advice := firmer(roof, changed, progress)):
            print(advice)


def margins(roof: Outcome, wanted: Sequence[str] = ()) -> None:
    """Find and print the margins wanted; of a certified roof also those that its project asks for."""
    own = roof.project.margin if roof.project is not None and roof.certified else ()
    print(end="", flush=True)
    for what in dict.fromkeys([*wanted, *own]):
        with working() as progress:
            found = roof.margin(what, progress)
        print(f"margin: {found.text(roof.units)}")


def ended(good: bool, written: Iterable[Path] = ()) -> int:
    """Print the files written; return the exit code of a roof that is ``good`` or not."""
    if names := ", ".join(map(str, written)):
        print(f"written: {names}")
    return OK if good else NOT_CERTIFIED


@contextmanager
def working() -> Iterator[Callable[[str], None]]:
    """A function that shows the name of the current step."""
    if not _live():
        yield lambda step: None
        return
    from rich import progress
    from rich.console import Console

    step = progress.TextColumn("{task.description}", markup=False)
    columns = (progress.BarColumn(20), progress.TimeElapsedColumn(), step)
    with progress.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)
        yield lambda step: bar.update(task, description=step)


@contextmanager
def sweeping(console: Any = None) -> Iterator[Callable[[Any], None] | None]:
    """A function of a sweep's Progress that draws cases, time left and verdicts; None without a terminal."""
    if console is None and not _live():
        yield None
        return
    from rich import progress
    from rich.console import Console
    from rich.table import Column

    rest = Column(ratio=1, no_wrap=True, overflow="ellipsis")
    columns = (
        progress.BarColumn(20),
        progress.MofNCompleteColumn(table_column=Column(no_wrap=True, min_width=9)),
        progress.TextColumn("{task.fields[left]} left", table_column=Column(min_width=12)),
        progress.TextColumn("{task.description}", markup=False, table_column=rest),
    )
    with progress.Progress(*columns, console=console or Console(stderr=True), expand=True) as bar:
        task = bar.add_task("", total=None, left="?")

        def draw(state: Any) -> None:
            counts = sorted(state.counts.items(), key=lambda item: (-item[1], item[0]))
            text = " · ".join(f"{verdict} {count}" for verdict, count in counts)
            left = timedelta(seconds=round(state.seconds_left))
            bar.update(task, total=state.total, completed=state.done, left=str(left), description=text)

        yield draw


def _live() -> bool:
    return sys.stderr is not None and sys.stderr.isatty() and os.environ.get("TERM") != "dumb"
