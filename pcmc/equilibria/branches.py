"""Branches of equilibria in a parameter, and the equilibria on them at its present value."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from ..accuracy.varied import Varied
from ..base import validate
from ..base.errors import NoBranch
from ..base.tolerances import HOMOTOPY_END
from ..solvers.continuation import BoundaryMotion, Branch, Direction, Ending, follow
from ..solvers.result import Progress
from ..surface import Surface

Span = tuple[float, float]
AROUND = 0.5  # of the present value: how far below and above it branches are followed
FROM_ZERO = 4.0  # the same, of what is 0 now, in the unit of ``margin``
STEPS = 80  # of a branch in each direction
FIRST = 0.05  # step of a branch
LARGEST = (0.15, 0.03, 0.006)  # steps at most; the next where one is too long
PLACE = ["arclength", "parameter"]  # of points and events
SWITCHED = 1e-6  # of the span: nearer to its present value, a switched branch has not left it


@dataclass(frozen=True, eq=False)
class TracedParameter:
    """A parameter λ of a surface: its name, its value there, and between which values it is followed."""

    name: str
    parameter: Direction | BoundaryMotion
    value: float
    span: Span

    @classmethod
    def of(cls, surface: Surface, what: Any, span: Span | None) -> TracedParameter:
        """That of a name as of ``margin``, a Direction, or a BoundaryMotion."""
        name, parameter = "parameter", what
        if isinstance(what, str):
            varied = Varied.of(surface, what)
            name, parameter = varied.what, varied.direction
        elif isinstance(what, BoundaryMotion):
            name = "boundary"
        elif not isinstance(what, Direction):
            expected = "a name such as 'pressure' or 'tension of roof', a Direction or a BoundaryMotion"
            validate.refuse("along", what, expected)
        value = parameter.line(surface).value
        reach = AROUND * abs(value) or FROM_ZERO
        low, high = span or (value - reach, value + reach)
        if not low < value < high:
            validate.refuse("span", (low, high), f"numbers below and above the present value {value:g}")
        return cls(name, parameter, value, (low, high))

    def halves(self, surface: Surface, watch: Callable[[Progress], None]) -> tuple[Branch, Branch]:
        """The branch through a surface, each way to the end of the span; NoBranch if none starts there."""
        return self._half(surface, -1.0, watch), self._half(surface, 1.0, watch)

    def early_end(self, branch: Branch) -> tuple[float, str] | None:
        """Where and why a branch ends within the span; None if it leads out of it."""
        value = float(branch.points.parameter.iloc[-1])
        if not self.span[0] <= value <= self.span[1]:
            return None
        why = {Ending.STEPS: f"after {STEPS} steps", Ending.LOST: f"as {branch.detail}"}
        return value, why.get(branch.ending, "as triangles collapse")

    def _half(self, surface: Surface, sign: float, watch: Callable[[Progress], None]) -> Branch:
        """One way; again in short steps where contact and index change on one, which hides a bifurcation."""
        for largest in LARGEST:
            step, within = sign * min(FIRST, largest), self._within(watch)
            branch = follow(surface, self.parameter, step=step, largest=largest, steps=STEPS, callback=within)
            events = self._ended(branch).events
            contacts = events.arclength[events.kind == "contact"]
            if not events.arclength[events.kind == "index"].isin(contacts).any():
                break
        return branch

    def leaving(self, branch: Branch, row: int, watch: Callable[[Progress], None]) -> list[Branch]:
        """The two branches that leave one at a bifurcation, from there on; OptionError if none is found."""
        event, found = branch.events.loc[row], []
        for one in map(self._ended, branch.switch(row, steps=STEPS, callback=self._within(watch))):
            known = {name: event[name] for name in one.points.columns.intersection(event.index)}
            first = one.points[:1].assign(**known | {"arclength": -FIRST, "slope": 0.0})
            surfaces = {0: branch.event_surfaces[row]} | {k + 1: s for k, s in one.surfaces.items()}
            points = pd.concat([first, one.points], ignore_index=True)
            found.append(replace(one, points=points, surfaces=surfaces))
        return found

    def _ended(self, branch: Branch) -> Branch:
        """A branch that ended by itself; KeyboardInterrupt where it was stopped."""
        if branch.ending is Ending.STOPPED and not self._over(branch.points.iloc[-1]):
            raise KeyboardInterrupt
        return branch

    def _over(self, row: Any) -> bool:
        """Whether a branch ends with a point: outside the span, or where triangles are poor."""
        return not self.span[0] <= row["parameter"] <= self.span[1] or row["quality"] < HOMOTOPY_END

    def _within(self, watch: Callable[[Progress], None]) -> Callable[[Progress], None]:
        def callback(progress: Progress) -> None:
            watch(progress)
            if self._over(progress.row):
                raise StopIteration

        return callback

    def crossings(self, branch: Branch) -> Iterator[tuple[Surface | str, str]]:
        """The equilibria on a branch at the present value, or why one was not reached; and where that is.

        The place is "" except beside a bifurcation: the first point of a branch may be far from that, and the
        way back may lead onto the branch that was left.
        """
        every = np.concatenate([branch.points[PLACE], branch.folds[PLACE]])  # a step may turn on its way
        off, least = every[:, 1] - self.value, SWITCHED * (self.span[1] - self.span[0])
        slopes, last = branch.points.slope.to_numpy(), len(branch.points)
        for i, j in pairwise(np.argsort(every[:, 0], kind="stable").tolist()):
            if off[i] * off[j] < 0.0 and abs(off[i] - off[j]) > least:
                rows = [k for k in (i, j) if k < last]
                regular = [k for k in rows if slopes[k] != 0.0]  # a bifurcation is singular
                there = self._reached(branch, sorted(regular, key=lambda k: abs(off[k])))
                beside = f"{every[i, 1]:.4g} and was first met at {every[j, 1]:.4g}"
                yield there, beside if regular != rows else ""

    def _reached(self, branch: Branch, rows: Sequence[int]) -> Surface | str:
        """The surface at the present value, from the first of some points that leads there; or why none."""
        reason = "no regular point of the branch is beside it"
        for row in rows:
            try:
                way = branch.resume(row, self.value)
            except NoBranch as error:
                reason = str(error)
                continue
            if way.ending is Ending.REACHED:
                return way.last
            if way.ending is Ending.STOPPED:
                raise KeyboardInterrupt
            reason = way.message
        return reason


def join_branches(back: Branch, forth: Branch) -> Branch:
    """Two branches from one surface as one, the first backwards."""
    last = len(back.points) - 1
    points = back.points.assign(arclength=-back.points.arclength, slope=-back.points.slope)[::-1]
    swapped = {"index_before": back.events.index_after, "index_after": back.events.index_before}
    events = back.events.assign(arclength=-back.events.arclength, **swapped)[::-1]
    surfaces = {last - row: surface for row, surface in back.surfaces.items()}
    at_events = {len(events) - 1 - row: surface for row, surface in back.event_surfaces.items()}
    frames = [frame for frame in (events, forth.events) if len(frame)] or [events]
    return replace(
        forth,
        points=pd.concat([points, forth.points[1:]], ignore_index=True),
        events=pd.concat(frames, ignore_index=True),
        surfaces=surfaces | {last + row: surface for row, surface in forth.surfaces.items()},
        event_surfaces=at_events | {len(events) + row: s for row, s in forth.event_surfaces.items()},
    )
