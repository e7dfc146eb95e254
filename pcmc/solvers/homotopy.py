"""Homotopies: from an easier surface at rest along the branch of equilibria to the one asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ..base.arrays import Bools, Floats
from ..base.errors import NoBranch
from ..base.tolerances import HOMOTOPY_END, SOUND
from ..certificate.balance import hardly_balanced, load_name, load_ratio
from ..certificate.diagnosis import held_groups
from ..certificate.proof import Attempt
from ..forces.functional import gradient
from ..surface import Surface
from . import solve_once
from .continuation import BoundaryMotion, Branch, Direction, Ending
from .continuation.branch import follow_until
from .result import Callback, Progress, Result, Status, unless_stopped
from .starts import low_start

BACK = 0.03  # of the farthest value: how far behind a turn a way down may open, and the branch is followed
MIN_QUALITY = 0.3  # of triangles along a branch, below which vertices are redistributed
LOADS = (0.5, 0.2, 0.05, 0.01)  # of the loads, or of what the boundary carries, at which to begin
DISTANCES = (0.5, 0.25, 0.1, 0.03)  # of the distance between held curves, at which to begin
STRONGER = 1.3  # of the load: at least so much the equal tensions could carry
RAISED = (1.0, 1.6)  # times these tensions, tried in turn
WALLS = (1.0, 0.6)  # of the equal tension: the most that a wall has at the start, tried in turn
FLAT = 1e-6  # of the size: curves whose middles are nearer to each other are not moved


class HomotopyStart(NamedTuple):
    """An easier surface, and the parameter of the branch from it; ``share`` of what is asked for it has."""

    surface: Surface
    parameter: Direction | BoundaryMotion | None  # None where it is the surface asked for
    share: float


@dataclass(frozen=True, eq=False)
class Homotopy:
    """Starts, tried in turn until one is at rest, and how the branch is followed from there.

    ``way`` is as in Attempt, ``note`` a sentence with the start's ``share``, ``unit`` the share of what is
    asked for at λ = 1, ``options`` those of the first solve, ``back`` as in ``classify_end``.
    """

    way: str
    note: str
    asked: Surface
    starts: Iterable[HomotopyStart]
    unit: float = 1.0
    options: Mapping[str, Any] = field(default_factory=lambda: {"levels": 0, "target": "minimum"})
    steps: int = 80
    smallest: float = 1e-4
    back: float | None = None


@dataclass(eq=False)
class LimitReached(Exception):
    """A solve of the search has taken as many steps as it may; ``result`` is its end."""

    result: Result


@dataclass
class Solves:
    """Solves and branches in a row, with the same ``options``; one callback counts their steps on.

    The results have the history ``before`` all of them, and count the steps and evaluations from its start.
    """

    callback: Callback | None
    options: Mapping[str, Any]
    before: Sequence[Mapping[str, Any]] = ()
    steps: int = 0
    evaluations: int = 0

    def solve(self, surface: Surface, **changes: Any) -> Result:
        """Solve from one start; KeyboardInterrupt if stopped, LimitReached at the limit asked for."""
        before = self.steps

        def count(progress: Progress) -> None:
            self._show(progress.surface, {**progress.row, "iteration": before + progress.iteration})

        result = solve_once(surface, "newton", count, **{**self.options, **changes})
        self.steps = before + len(result.rows)
        self.evaluations += result.evaluations
        unless_stopped(result)
        rows = [{**row, "iteration": before + row["iteration"]} for row in result.rows]
        steps, evaluations = self.steps - 1, self.evaluations
        result = replace(result, rows=[*self.before, *rows], iterations=steps, evaluations=evaluations)
        if result.status is Status.ITERATION_LIMIT and "iterations" in self.options:
            raise LimitReached(result)
        return result

    def follow(
        self, surface: Surface, parameter: Direction | BoundaryMotion, homotopy: Homotopy
    ) -> Branch | None:
        """A branch until it arrives or turns, in no more steps than a solve may take; None if none starts.

        KeyboardInterrupt if it was stopped.
        """

        def count(progress: Progress) -> None:
            square = float((gradient(progress.surface()) ** 2).sum())
            row = {**progress.row, "iteration": self.steps, "step": "branch", "gradient_squared": square}
            self.steps += 1
            self._show(progress.surface, row)

        try:
            branch = follow_until(
                has_turned(homotopy.back),
                count,
                surface,
                parameter,
                1.0 / homotopy.unit,
                min_quality=MIN_QUALITY,
                steps=min(homotopy.steps, self.options.get("iterations", homotopy.steps)),
                smallest=homotopy.smallest,
            )
        except NoBranch:
            return None
        self.evaluations += int(branch.points.iterations.sum())
        return branch

    def _show(self, surface: Callable[[], Surface], row: Mapping[str, Any]) -> None:
        if self.callback is not None:
            self.callback(Progress(row["iteration"], surface, row))


def attempt(homotopy: Homotopy, solves: Solves) -> tuple[Surface, str] | Attempt:
    """Follow a homotopy to the surface asked for: a surface to solve from and a note, or how it ended."""
    way = homotopy.way
    for start in homotopy.starts:
        result = solves.solve(start.surface, **homotopy.options)
        if result.converged:
            break
    else:
        return Attempt(way, "no start")
    note = homotopy.note.format(share=start.share)
    if start.parameter is None:
        return result.surface, note
    branch = solves.follow(result.surface, start.parameter, homotopy)
    if branch is None:
        return Attempt(way, "no start")
    end = classify_end(branch, homotopy.back)
    if end.kind == "reached":
        return homotopy.asked.moved(branch.last.vertices), note
    rates = start.parameter.tensions if isinstance(start.parameter, Direction) else {}
    at = tuple((p.name, p.tension + end.farthest * rates.get(p.name, 0.0)) for p in start.surface.patches)
    tensions = tuple((name, tension) for name, tension in at if tension > 0.0) if rates else ()
    return Attempt(way, end.kind, end.farthest * homotopy.unit, start.share, tensions)


class BranchEnd(NamedTuple):
    """How a branch ends: "reached", "fold", or "lost"; its largest parameter, and the triangles there."""

    kind: str
    farthest: float
    quality: float


def has_turned(back: float | None) -> Callable[[Progress], bool]:
    """Whether a branch has turned back at the next point, or its triangles are poor; as ``classify_end``."""
    farthest = 0.0

    def over(progress: Progress) -> bool:
        nonlocal farthest
        farthest = max(farthest, progress.row["parameter"])
        slack = BACK * farthest if back is None else back
        return progress.row["parameter"] < farthest - slack or progress.row["quality"] < HOMOTOPY_END

    return over


def classify_end(branch: Branch, back: float | None = None) -> BranchEnd:
    """How a branch ends that was followed towards larger values.

    It folds where the parameter turns for good, with sound triangles and an eigenvalue that changes its sign
    within ``back`` of the turn, by default 0.03 of the farthest value: otherwise the mesh may be what turns.
    """
    points, folds = branch.points, branch.folds.parameter
    if branch.ending is Ending.REACHED:
        return BranchEnd("reached", float(points.parameter.iloc[-1]), float(points.quality.iloc[-1]))
    farthest = float(max(points.parameter.max(), folds.max()))
    quality = float(points.quality.iloc[int(points.parameter.argmax())])
    opened = branch.events[branch.events.kind == "index"].parameter
    turned = len(folds) and folds.max() >= points.parameter.max()
    slack = BACK * farthest if back is None else back
    folded = turned and quality > SOUND and (farthest - opened <= slack).any()
    return BranchEnd("fold" if folded else "lost", farthest, quality)


def further_ways(start: Surface, pinchable: Bools) -> Iterator[Surface | Homotopy]:
    """The low start, and the homotopies that apply in the order of their cost."""
    low = low_start(start)
    if low is None:
        return
    pressed = low.net_pressures.any()
    loaded = pressed or low.weights.any()
    if low.rooms or loaded:
        yield low
    if low.rooms:  # their pressures are not given, and no homotopy begins at others
        return
    if loaded:
        yield raise_loads(low)
    if pressed and not hardly_balanced(start, pinchable):
        yield from filter(None, [relax_tensions(low)])
    yield from filter(None, [continue_in_distance(start, low)])


def raise_loads(low: Surface) -> Homotopy:
    """All net pressures and weights grow in proportion, from the highest of a few loads with a minimum.

    What grows is p - s, so the snow comes with the pressure.
    """
    none = {patch.name: 0.0 for patch in low.patches}
    pressures = {patch.name: patch.net_pressure for patch in low.patches if patch.net_pressure != 0.0}
    weights = {patch.name: patch.weight for patch in low.patches if patch.weight != 0.0}
    load, carried = load_name(low), min(1.0, 1.0 / max(load_ratio(low), 1e-300))
    # λ is the load over what the boundary carries, so that a fold is near 1 however weak the patches
    direction = Direction(
        pressures={name: carried * p for name, p in pressures.items()},
        weights={name: carried * w for name, w in weights.items()},
    )

    def start(share: float) -> HomotopyStart:
        net = none | {name: share * p for name, p in pressures.items()}
        heavy = {name: share * w for name, w in weights.items()}
        return HomotopyStart(low.retensioned(None, net, weights=heavy, snows=none), direction, share)

    starts = (start(share * carried) for share in LOADS)
    return Homotopy(load, f"by raising the {load} from {{share:.3g}} of it", low, starts, carried)


def relax_tensions(low: Surface) -> Homotopy | None:
    """From equal tensions of all patches under pressure to those asked for; None for one such patch alone."""
    asked = {patch.name: patch.tension for patch in low.patches if patch.tension > 0.0}
    pressed = {patch.name: patch.tension for patch in low.patches if not patch.auxiliary}
    if len(pressed) < 2:
        return None
    strongest = max(pressed.values())
    ratio = load_ratio(low.retensioned(dict.fromkeys(pressed, strongest)))
    needed = strongest * max(1.0, STRONGER * ratio)

    def start(raised: float, most: float) -> HomotopyStart:
        equal = raised * needed
        given = {name: equal if name in pressed else min(t, most * equal) for name, t in asked.items()}
        change = {name: asked[name] - given[name] for name in asked if asked[name] != given[name]}
        direction = Direction(change, relative=True) if change else None
        return HomotopyStart(low.retensioned(given), direction, 0.0)

    starts = (start(raised, most) for raised, most in product(RAISED, WALLS))
    note = "along the branch from equal tensions"
    return Homotopy("tensions", note, low, starts, 1.0, {"levels": 0}, 40, 3e-4, BACK)


def continue_in_distance(surface: Surface, low: Surface) -> Homotopy | None:
    """The distances between the held curves grow in proportion to the surface's, along one line.

    It is the line along which their middles lie most apart, or that across Π where the surface slides there.
    None without two curves to be moved apart, or where the end of a junction or cable slides along one. The
    other vertices that slide so are held meanwhile, which changes no shape.
    """
    for _, mask in surface.on_line:
        if (mask & surface.topology.on_junction).any() or mask[surface.cable_edges.ends].any():
            return None
    slides = surface.on_line and not surface.on_planes
    clamped = surface.rebuilt(fixed=surface.fixed, on_line=()) if slides else surface
    groups, lengths = held_groups(clamped)
    fixed = np.isfinite(lengths)
    X, plane = clamped.vertices, clamped.plane
    held = (groups >= 0) & clamped.fixed
    if len(lengths) < 2 or not fixed.any() or (clamped.fixed & ~held).any() or clamped.on_planes:
        return None
    centres = np.array([X[groups == number].mean(axis=0) for number in range(len(lengths))])
    if clamped.on_plane.any():
        line, middle = np.array(plane.normal), np.array(plane.point)
        apart = np.where(fixed, (centres - middle) @ line, 0.0)
    else:
        middle = centres.mean(axis=0)
        line = np.linalg.svd(centres - middle)[2][0]
        apart = (centres - middle) @ line
    if np.ptp(apart) < FLAT * clamped.size:
        return None
    along = apart[groups[held]]  # how far the curve of each held vertex is from ``middle``, which stays

    def boundary(share: float) -> Floats:
        return np.asarray(X[held] + ((share - 1.0) * along)[:, None] * line)

    def start(share: float, shape: Floats) -> HomotopyStart:
        places = shape + ((share - 1.0) * ((shape - middle) @ line))[:, None] * line
        places[held] = boundary(share)
        return HomotopyStart(clamped.moved(places), BoundaryMotion(boundary, start=share), share)

    starts = (start(share, shape) for share, shape in product(DISTANCES, (surface.vertices, low.vertices)))
    return Homotopy("distance", "by moving the held curves apart", surface, starts)
