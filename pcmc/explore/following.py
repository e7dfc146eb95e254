"""Following values: from a surface at rest to the one with other tensions, in as many steps as needed."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import Floats
from ..certificate import Certificate, Verdict
from ..project.values import single_points, values_of
from ..solvers import solve
from ..solvers.result import Progress, Result
from ..surface import Surface
from ..surface.values import KINDS, all_values

AT_REST = (Verdict.STABLE, Verdict.NEUTRAL, Verdict.SADDLE)
SMALLEST_STEP = 1.0 / 64.0  # part of the way; settling takes no smaller step
Values = Mapping[str, Mapping[str, Any]]  # numbers by kind and name; and points, each [x, y, z]


def until(stop: Callable[[], bool], end: float) -> Callable[[], bool]:
    """True when ``stop`` is, or when the monotonic clock has passed ``end``."""
    return lambda: stop() or time.monotonic() > end


def attempt(surface: Surface, stop: Callable[[], bool], **options: Any) -> Result:
    """Solve, and end early when ``stop`` becomes true."""

    def check(_: Progress) -> None:
        if stop():
            raise StopIteration

    return solve(surface, callback=check, **options)


@dataclass(frozen=True, eq=False)
class Reached:
    """The last surface at rest on the way to other values, and the failed attempt after it, if any.

    ``certificate`` is the surface's, without modes; None if there was no step at all.
    """

    surface: Surface
    certificate: Certificate | None
    failed: Certificate | None


def reach(
    start: Surface, asked: Surface, stop: Callable[[], bool], attempts: int = 100, **options: Any
) -> Reached:
    """Follow the equilibrium from ``start`` to the values of ``asked``; a step that fails is halved."""
    here, certificate, done, step = start, None, 0.0, 1.0
    failed = None
    for _ in range(attempts):
        ahead = min(1.0, done + step)
        aim = between(start, asked, ahead).moved(_with_points(here, start, asked, ahead))
        result = attempt(aim, stop, target="stationary", **options)
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
    """The surface with other values, kinds as in ``values_of``; walls follow the pressures of their rooms."""
    given = {kind: dict(values.get(kind) or {}) for kind in KINDS}
    changed, points = surface.retensioned(**given), values.get("points") or {}
    known = dict(zip(values_of(surface)["points"], single_points(surface).tolist(), strict=True))
    X = surface.vertices.copy()
    for name, place in points.items():
        X[known[validate.choice("point", name, tuple(known))]] = place
    return changed if np.array_equal(X, surface.vertices) else changed.moved(X)
