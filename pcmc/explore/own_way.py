"""Settling with the help of a project: where following leads nowhere, its own walls or start shape may."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from .. import project as projects
from ..base.errors import MissingExtra, PcmcError
from ..project.accuracy import AccuracyWanted
from ..solvers.result import Result
from ..surface import Surface
from .following import AT_REST, Reached, reach, until, values_of, wanted

FIRST_ATTEMPTS = 4  # of following, before the project's own walls are tried
START_SECONDS = 6.0  # time limit of solving from the start shape
Stop = Callable[[], bool]


@dataclass(frozen=True, eq=False)
class Settled:
    """How settling ended.

    ``note`` is empty where following led to the values; else it names what did. ``own_way`` is for the next
    time.
    """

    reached: Reached
    note: str
    own_way: OwnWay


@dataclass(frozen=True, eq=False)
class OwnWay:
    """What a project does where following does not reach the values asked for.

    Attributes
    ----------
    path : of the project; None for a surface without one, which is followed only.
    given : (wall, tension) as the project gave them; a wall with another tension was moved on the page.
    """

    path: Path | None = None
    given: frozenset[tuple[str, float]] = frozenset()

    def giving(self, surface: Surface) -> OwnWay:
        """The same, with the walls of another surface of the project."""
        return replace(self, given=self.given | _walls(surface))

    def settle(
        self,
        here: Surface,
        asked: Surface,
        stop: Stop,
        end: float,
        report: Callable[[str], None],
        **options: Any,
    ) -> Settled:
        """Follow to ``asked``; else with the project's walls, in small steps, and from its start shape.

        Following ends at the time ``end`` of the monotonic clock.
        """
        late = until(stop, end)
        if self.path is None:
            return Settled(reach(here, asked, late, **options), "", self)
        way = reach(here, asked, late, attempts=FIRST_ATTEMPTS, **options)
        if way.failed is None or stop():
            return Settled(way, "", self)
        moved = {name for name, tension in _walls(asked) if (name, tension) not in self.given}
        start = own_start(self.path, asked, moved)
        if start is not None and (new := _walls(start) - _walls(asked)):
            balanced = reach(here, asked.retensioned(dict(new)), late, attempts=FIRST_ATTEMPTS, **options)
            if balanced.certificate is not None and balanced.failed is None:
                tensions = ", ".join(f"{name} {tension:g}" for name, tension in sorted(new))
                note = f"walls balanced beside the new tensions: {tensions}"
                return Settled(balanced, note, replace(self, given=self.given | new))
        rest = reach(way.surface, asked, late, **options)
        rest = replace(rest, certificate=rest.certificate or way.certificate)
        if rest.failed is None or start is None or stop():
            return Settled(rest, "", self)
        report("from the start shape")
        result = solved_own_way(self.path, start, stop)
        report("")
        if result is None:
            return Settled(rest, "", self)
        note = "solved from the start shape of the project; the last surface led to none"
        given = {wall for wall in _walls(start) if wall[0] not in moved}
        return Settled(
            Reached(result.surface, result.certificate, None), note, replace(self, given=self.given | given)
        )


def _walls(surface: Surface) -> frozenset[tuple[str, float]]:
    return frozenset((patch.name, patch.tension) for patch in surface.patches if patch.wall)


def own_start(path: Path, asked: Surface, moved: Collection[str] = ()) -> Surface | None:
    """The start shape of a project with the values of a surface; None where the project has none for them.

    Walls have the tensions that the project gives them beside the new tensions of its patches; those in
    ``moved`` have the surface's.
    """
    values = values_of(asked)
    walls = {name for name, _ in _walls(asked)} - set(moved)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # they were shown when the project was opened
            text, data = projects.read_data(path)
            patches = data.setdefault("plan", {}).setdefault("patches", {})
            if not isinstance(patches, dict):
                return None
            for patch, wall in zip(asked.patches, asked.walls.tolist(), strict=True):
                if not wall:
                    patches.setdefault(patch.name, {})["tension"] = patch.tension
            start = projects.surface_of(projects.project_of(path, text, data))
        kept = {name: tension for name, tension in values["tensions"].items() if name not in walls}
        return wanted(start, {**values, "tensions": kept})
    except (PcmcError, MissingExtra):  # such as for a file that holds another plan by now
        return None


def solved_own_way(path: Path, start: Surface, stop: Stop) -> Result | None:
    """A start shape solved and remeshed as its project asks for, without targets; None where that fails."""
    stop = until(stop, time.monotonic() + START_SECONDS)

    def check(_: str) -> None:
        if stop():
            raise TimeoutError

    try:
        plain = replace(projects.load(path), targets=(), wanted=AccuracyWanted(), search=False)
        result = projects.solve_project(plain, start, check).solved
    except (PcmcError, MissingExtra, TimeoutError):
        return None
    return result if result.certificate.verdict in AT_REST else None
