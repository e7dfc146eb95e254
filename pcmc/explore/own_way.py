"""Settling with the help of a project: where following leads nowhere, its own walls or start shape may."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from .. import project as projects
from ..base.errors import MissingExtra, PcmcError
from ..project import AccuracyWanted
from ..project.values import with_values
from ..solvers.result import Result
from ..surface import Surface
from .following import AT_REST, Reached, reach, until

FIRST_ATTEMPTS = 4  # of following, before the project's own walls are tried
START_SECONDS = 6.0  # time limit of solving from the start shape
Stop = Callable[[], bool]


@dataclass(frozen=True, eq=False)
class OwnWay:
    """What a project does where following does not reach the values asked for.

    Attributes
    ----------
    path, data : of the project; without data the surface is followed only.
    given : (wall, tension) as the project gave them; a wall with another tension was moved on the page.
    """

    path: Path = Path()
    data: Mapping[str, Any] = field(default_factory=dict)
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
    ) -> tuple[Reached, str, OwnWay]:
        """Follow to ``asked``; else with the project's walls, in small steps, and from its start shape.

        Following ends at the time ``end`` of the monotonic clock. Returns where it ended; a note, empty where
        following led to the values, else what did, or why the project's own way does not; and the own way for
        the next time.
        """
        late = until(stop, end)
        way = reach(here, asked, late, attempts=FIRST_ATTEMPTS if self.data else 100, **options)
        if way.failed is None or stop() or not self.data:
            return way, "", self
        moved = {name for name, tension in _walls(asked) if (name, tension) not in self.given}
        start, note = None, ""
        try:
            project, start = self.start(asked, moved)
        except (PcmcError, MissingExtra) as error:
            note = f"the project's own way to these values: {error}"
        if start is not None and (new := _walls(start) - _walls(asked)):
            balanced = reach(here, asked.retensioned(dict(new)), late, attempts=FIRST_ATTEMPTS, **options)
            if balanced.certificate is not None and balanced.failed is None:
                tensions = ", ".join(f"{name} {tension:g}" for name, tension in sorted(new))
                note = f"walls balanced beside the new tensions: {tensions}"
                return balanced, note, replace(self, given=self.given | new)
        rest = reach(way.surface, asked, late, **options)
        rest = replace(rest, certificate=rest.certificate or way.certificate)
        if rest.failed is None or start is None or stop():
            return rest, "" if rest.failed is None else note, self
        report("from the start shape")
        try:
            result = solved_start_shape(project, start, stop)
        except (PcmcError, MissingExtra) as error:
            return rest, f"from the start shape of the project: {error}", self
        finally:
            report("")
        if result is None:
            return rest, "", self
        note = "solved from the start shape of the project; the last surface led to none"
        given = {wall for wall in _walls(start) if wall[0] not in moved}
        found = Reached(result.surface, result.certificate, None)
        return found, note, replace(self, given=self.given | given)

    def start(self, asked: Surface, moved: Collection[str] = ()) -> tuple[projects.Project, Surface]:
        """The project with the values of a surface, and its start shape.

        Walls have the tensions that the project gives them beside the new tensions of its patches; those in
        ``moved`` have the surface's. Errors as ``with_values``.
        """
        left = {("tensions", name) for name, _ in _walls(asked) if name not in moved}
        return with_values(self.path, self.data, asked, left)[1:]


def _walls(surface: Surface) -> frozenset[tuple[str, float]]:
    return frozenset((patch.name, patch.tension) for patch in surface.patches if patch.wall)


def solved_start_shape(project: projects.Project, start: Surface, stop: Stop) -> Result | None:
    """A start shape solved and remeshed as its project asks for, without targets; None where that fails."""
    stop = until(stop, time.monotonic() + START_SECONDS)

    def check(_: str) -> None:
        if stop():
            raise TimeoutError

    try:
        plain = replace(project, targets=(), wanted=AccuracyWanted(), search=False)
        result = projects.solve_project(plain, start, check).solved
    except TimeoutError:
        return None
    return result if result.certificate.verdict in AT_REST else None
