"""Following values: from a surface at rest to the one with other values, in as many steps as needed.

Where following leads nowhere, the walls or the start shape of the surface's project may.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import project as projects
from ..base import validate
from ..base.arrays import Floats
from ..base.errors import MissingExtra, PcmcError
from ..certificate import Certificate, Verdict
from ..project.outcome import OnStep
from ..project.values import changeable_values, data_with_values, single_points
from ..solvers import solve_once
from ..solvers.result import Progress, Result
from ..surface import Surface
from ..surface.values import KINDS, all_values

AT_REST = (Verdict.STABLE, Verdict.NEUTRAL, Verdict.SADDLE)
SMALLEST_STEP = 1.0 / 64.0  # part of the way; settling takes no smaller step
FIRST_ATTEMPTS = 4  # of following, before the project's own walls are tried
START_SECONDS = 6.0  # time limit of solving from the start shape
Values = Mapping[str, Mapping[str, Any]]  # numbers by kind and name; and points, each [x, y, z]
Stop = Callable[[], bool]


def until(stop: Stop, seconds: float) -> Stop:
    """True when ``stop`` is, or when so many seconds have passed."""
    end = time.monotonic() + seconds
    return lambda: stop() or time.monotonic() > end


def solve_until(surface: Surface, stop: Stop, **options: Any) -> Result:
    """Solve, and end early when ``stop`` becomes true."""

    def check(_: Progress) -> None:
        if stop():
            raise StopIteration

    return solve_once(surface, callback=check, **options)


class Reached(NamedTuple):
    """The last surface at rest on the way to other values, and the failed attempt after it, if any."""

    surface: Surface
    certificate: Certificate | None  # of the surface, without modes; None if there was no step at all
    failed: Certificate | None


def reach(start: Surface, asked: Surface, stop: Stop, attempts: int = 100, **options: Any) -> Reached:
    """Follow the equilibrium from ``start`` to the values of ``asked``; a step that fails is halved."""
    here, certificate, failed, done, step = start, None, None, 0.0, 1.0
    for _ in range(attempts):
        ahead = min(1.0, done + step)
        aim = between(start, asked, ahead).moved(_with_points(here, start, asked, ahead))
        result = solve_until(aim, stop, target="stationary", **options)
        ended = result.certify(modes=0)
        if ended.verdict in AT_REST:
            here, certificate, done, step = result.surface, ended, ahead, 2.0 * step
            if done == 1.0:
                return Reached(here, certificate, None)
        else:
            failed = ended if ahead == 1.0 or failed is None else failed
            step = 0.5 * (ahead - done)
        if step < SMALLEST_STEP or stop():
            break
    return Reached(here, certificate, failed)


def _with_points(here: Surface, start: Surface, asked: Surface, part: float) -> Floats:
    """(n,3) the vertices of ``here``, its single points moved a part of the way with what is near them."""
    points, X = single_points(start), here.vertices
    there = (1.0 - part) * start.vertices[points] + part * asked.vertices[points]
    for point, step in zip(points.tolist(), there - X[points], strict=True):
        if step.any():
            away = np.linalg.norm(X - here.vertices[point], axis=1)
            others = away[here.held & (away > 0.0)]
            near = np.clip(1.0 - away / (others.min() if len(others) else away.max()), 0.0, 1.0)
            near[here.held] = 0.0
            near[point] = 1.0
            X = X + near[:, None] ** 2 * step
    return X


def between(start: Surface, end: Surface, part: float) -> Surface:
    """``start`` with its values moved a part of the way to those of ``end``."""
    here, there = all_values(start), all_values(end)
    if part < 1.0:  # at the end to the last digit
        for kind, values in there.items():
            changed = {k: value for k, value in values.items() if value != here[kind][k]}
            there[kind] = values | {k: (1.0 - part) * here[kind][k] + part * v for k, v in changed.items()}
    return start.retensioned(walls=[p.name for p in end.patches if p.wall], **there)


def wanted(surface: Surface, values: Values) -> Surface:
    """The surface with other values, by kind and name; walls follow the pressures of their rooms."""
    given: dict[str, Any] = {kind: values.get(kind) for kind in KINDS}
    changed, points = surface.retensioned(**given), values.get("points") or {}
    known = dict(zip(changeable_values(surface)["points"], single_points(surface).tolist(), strict=True))
    X = surface.vertices.copy()
    for name, place in points.items():
        X[known[validate.choice("point", name, tuple(known))]] = validate.triple(f"point {name!r}", place)
    return changed if np.array_equal(X, surface.vertices) else changed.moved(X)


@dataclass(frozen=True, eq=False)
class ProjectFallback:
    """What a project does where following does not reach the values asked for."""

    path: Path = Path()
    data: Mapping[str, Any] = field(default_factory=dict)  # of the project; without it only following
    given: frozenset[tuple[str, float]] = frozenset()  # (wall, tension) of the project: others were moved

    def with_walls(self, surface: Surface) -> ProjectFallback:
        """The same, with the walls of another surface of the project."""
        return replace(self, given=self.given | _walls(surface))

    def settle(
        self, here: Surface, asked: Surface, stop: Stop, seconds: float, progress: OnStep, **options: Any
    ) -> tuple[Reached, str, ProjectFallback]:
        """Follow to ``asked``; else with the project's walls, in small steps, and from its start shape.

        Following ends after these ``seconds``. Returns where it ended; a note, unless following led there:
        what did, or why the project does not; and the fallback for the next time.
        """
        late = until(stop, seconds)
        way = reach(here, asked, late, attempts=FIRST_ATTEMPTS if self.data else 100, **options)
        if way.failed is None or stop() or not self.data:
            return way, "", self
        moved = {name for name, tension in _walls(asked) if (name, tension) not in self.given}
        left = {("tensions", name) for name, _ in _walls(asked) if name not in moved}  # to the project
        start, note = None, ""
        try:
            project, start = data_with_values(self.path, self.data, asked, left)[1:]
        except (PcmcError, MissingExtra) as error:
            note = f"the project's own way to these values: {error}"
        if start is not None and (new := _walls(start) - _walls(asked)):
            balanced = reach(here, asked.retensioned(dict(new)), late, attempts=FIRST_ATTEMPTS, **options)
            if balanced.certificate is not None and balanced.failed is None:
                tensions = ", ".join(f"{name} {tension:g}" for name, tension in sorted(new))
                note = f"walls balanced beside the new tensions: {tensions}"
                return balanced, note, replace(self, given=self.given | new)
        rest = reach(way.surface, asked, late, **options)
        rest = rest._replace(certificate=rest.certificate or way.certificate)
        if rest.failed is None or start is None or stop():
            return rest, "" if rest.failed is None else note, self
        progress("from the start shape")
        try:
            result = solved_start_shape(project, start, stop)
        except (PcmcError, MissingExtra) as error:
            return rest, f"from the start shape of the project: {error}", self
        finally:
            progress("")
        if result is None:
            return rest, "", self
        note = "solved from the start shape of the project; the last surface led to none"
        given = {wall for wall in _walls(start) if wall[0] not in moved}
        found = Reached(result.surface, result.certificate, None)
        return found, note, replace(self, given=self.given | given)


def _walls(surface: Surface) -> frozenset[tuple[str, float]]:
    return frozenset((patch.name, patch.tension) for patch in surface.patches if patch.wall)


def solved_start_shape(project: projects.Project, start: Surface, stop: Stop) -> Result | None:
    """A start shape solved and remeshed as its project asks for, without targets; None where that fails."""
    stop = until(stop, START_SECONDS)

    def check(_: str) -> None:
        if stop():
            raise TimeoutError

    try:
        plain = replace(project, targets=(), wanted=projects.AccuracyWanted(), search=False)
        result = projects.solve_project(plain, start, check).solved
    except TimeoutError:
        return None
    return result if result.certificate.verdict in AT_REST else None
