"""Meshes that are fine where the error comes from, until the quantities wanted are accurate.

A round solves the surface, checks its mesh, and shares out the error among the triangles (``estimator``).
A triangle of edge length h has a share η ∝ h⁴ where the surface is smooth, and the sum of all shares is
least, for N triangles, where all are equal: h_new = h (η̄ / η)^(1/4) with √η̄ = Σ √η / N. MMG makes the
mesh, and the next round begins. At a corner where the surface is like r^λ, equal shares lead to edges
h ∝ r^(1 - λ/2), and to an error ∝ 1 / N, as for a smooth surface: order 2 in 1/√N.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
import pandas as pd

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import MissingExtra, SurfaceError
from ..meshing.held_curves import onto_held_curves
from ..meshing.remeshing import remesh
from ..meshing.sizes import limit_growth, triangles_for
from ..solvers import solve
from ..solvers.result import Result, Status
from ..surface import Surface
from ..surface.geometry import face_areas
from .estimator import Goal, error_shares
from .goals import Accuracy, accuracies, check_places, goals_in
from .mesh_check import MeshCheck, check_mesh
from .persistence import MeshVerdict

TRIANGLES = 50_000  # of the mesh returned, by default at most
ROUNDS = 12
GROWTH = 1.5  # of neighbouring edges
FINER, COARSER = 0.25, 3.0  # times the edge length, in one round
LEAST, MOST = 1.5, 3.0  # times as many triangles from round to round
SPARE = 1.3  # times the triangles foreseen, so that fewer rounds are needed
FLOOR = 1e-12  # of the largest share: a share below counts as that much
WORTHWHILE = 0.8  # of the limit of triangles: from here on a further round gains little
VALUES = ("mesh", "limit")


class AccuracyStatus(Enum):
    """How a search for an accuracy ended. The value is a sentence."""

    REACHED = "accuracy reached"
    NO_LIMIT = "accuracy out of reach: there is no limit as the mesh gets finer"
    TRIANGLES = "accuracy not reached within the limit of triangles"
    ROUNDS = "accuracy not reached: further rounds do not help"
    NOT_AT_REST = "accuracy not reached: the solver finds no equilibrium"
    STOPPED = "accuracy not reached: stopped on request"


@dataclass(frozen=True, eq=False)
class AccurateResult:
    """The end of a search for an accuracy. Every value describes exactly ``surface``.

    Attributes
    ----------
    status : how the search ended.
    result : of the solve that gave ``surface``.
    check : the mesh check of ``surface``; None if no equilibrium was found.
    values : a row per quantity wanted: ``quantity``, ``of``, ``value``, ``error``, ``limit``,
        ``limit_error`` and ``order`` as in a mesh check, and the ``accuracy`` wanted.
    history : a row per round and quantity: the columns of ``values``, ``round``, ``triangles``, ``verdict``.
    surfaces : at rest, of each round.
    detail : why the accuracy is not reached; empty if it is.
    """

    status: AccuracyStatus
    result: Result
    check: MeshCheck | None
    values: pd.DataFrame
    history: pd.DataFrame
    surfaces: tuple[Surface, ...]
    detail: str = ""

    @property
    def reached(self) -> bool:
        """Whether every quantity is as accurate as wanted."""
        return self.status is AccuracyStatus.REACHED

    @property
    def surface(self) -> Surface:
        """The surface with the accurate quantities, or the best one so far."""
        return self.result.surface

    @property
    def message(self) -> str:
        """A sentence, and each quantity with its bar on this mesh and in the limit."""
        head = "; ".join(filter(None, (self.status.value, self.detail)))
        parts = [
            f"{_name((row.quantity, row.of))} {row.value:.6g} ± {row.error:.2g} on this mesh,"
            f" {row.limit:.8g} ± {row.limit_error:.2g} in the limit, wanted ± {row.accuracy:g}"
            for row in self.values.itertuples()
        ]
        return "; ".join([f"{head} ({self.surface.m} triangles)", *parts])


def solve_to_accuracy(
    surface: Surface,
    accuracy: Accuracy,
    *,
    value: str = "mesh",
    most_triangles: int = TRIANGLES,
    callback: Callable[[Mapping[str, Any]], None] | None = None,
    **options: Any,
) -> AccurateResult:
    """Solve on meshes that get finer where the error comes from, until the error bars are small enough.

    Start from a coarse mesh: remeshing keeps the vertices of boundaries and junctions. The error bars
    are those of ``check_mesh``. New vertices of held boundaries lie on smooth curves through the old ones.

    Parameters
    ----------
    surface : the surface to start from.
    accuracy : the error bar wanted, by quantity, in its unit: ``{"height": 1e-3}`` or ``"height=1e-3"``.
        Quantities are those of the mesh check: height, area, volume, energy, reaction, thrust, reaction
        per length, lowest eigenvalue; with a patch, as in ``"height of north"``, that patch's alone.
    value : ``"mesh"``, the value on the mesh returned is to be so accurate; ``"limit"``, the
        extrapolated value is, which needs far fewer triangles.
    most_triangles : the most that the mesh returned may have; the check solves on 16 times as many.
    callback : called after each round with a row of numbers. StopIteration in it, or Ctrl-C, ends the
        search with the best surface so far.
    options : of ``pcmc.solve``.

    Raises
    ------
    OptionError
        For an unknown quantity, with the nearest known one, or an accuracy that is not positive.
    MissingExtra
        Without the library mmgpy.

    Examples
    --------
    >>> from pcmc.plan import Plan
    >>> roof = Plan([[0, 0], [4, 0], [4, 3], [0, 3]], tension=4.0, edge_length=1.0).surface()
    >>> fine = solve_to_accuracy(roof, "height=0.02")
    >>> fine.status.name, bool(fine.values.error[0] <= 0.02), fine.surface.m < 500
    ('REACHED', True, True)
    """
    wanted = accuracies(accuracy)
    validate.choice("value", value, VALUES)
    validate.integer("most_triangles", most_triangles, least=1)
    if not isinstance(surface, Surface):
        validate.refuse("surface", type(surface).__name__, "a Surface", error=SurfaceError)
    check_places(wanted, surface)
    _require_mmg()
    return _Search(wanted, value, most_triangles, callback, options).run(surface)


def size_field(surface: Surface, shares: Floats, triangles: float, growth: float = GROWTH) -> Floats:
    """(n,) edge lengths for a mesh of so many triangles whose shares in the error are all equal.

    Parameters
    ----------
    shares : (m,) ≥ 0, of the triangles in the error.
    triangles : how many the new mesh has, about.

    Examples
    --------
    >>> from pcmc import Patch
    >>> square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]],
    ...                  [0, 0], [Patch("floor", 1.0)], fixed=range(4))
    >>> size_field(square, np.array([1.0, 1.0]), 20).round(3).tolist()
    [0.34, 0.34, 0.34, 0.34]
    """
    F, areas = surface.faces, face_areas(surface.vertices[surface.faces])
    root = np.sqrt(np.maximum(shares, FLOOR * shares.max(initial=0.0)))
    mean = root.sum() / triangles
    factor = np.clip(np.sqrt(mean / np.where(root > 0.0, root, mean or 1.0)), FINER, COARSER)
    length = np.sqrt(areas * 4.0 / math.sqrt(3.0)) * factor
    count = np.maximum(np.bincount(F.ravel(), minlength=surface.n), 1)
    wanted = np.exp(np.bincount(F.ravel(), np.repeat(np.log(length), 3), surface.n) / count)
    for _ in range(6):  # limits to growth make edges shorter and triangles more
        size = limit_growth(surface.vertices, surface.topology.edges, wanted, growth)
        wanted *= math.sqrt(triangles_for(areas, size[F].mean(axis=1)) / triangles)
    return limit_growth(surface.vertices, surface.topology.edges, wanted, growth)


@dataclass(frozen=True, eq=False)
class _Round:
    """A surface at rest, its check, and the rows of the quantities wanted."""

    result: Result
    check: MeshCheck
    values: pd.DataFrame

    def excess(self, value: str) -> float:
        """The largest error bar over its accuracy."""
        bar = self.values["error" if value == "mesh" else "limit_error"]
        return float((bar / self.values["accuracy"]).max())


class _Search:
    """The rounds of a search for an accuracy."""

    def __init__(
        self,
        wanted: Mapping[str, float],
        value: str,
        most_triangles: int,
        callback: Callable[[Mapping[str, Any]], None] | None,
        options: Mapping[str, Any],
    ) -> None:
        self.wanted, self.value, self.most, self.options = wanted, value, most_triangles, options
        self.callback = callback
        self.rounds: list[_Round] = []
        self.last: Result | None = None

    def run(self, surface: Surface) -> AccurateResult:
        """All rounds."""
        try:
            status, detail = self._rounds(surface)
        except (StopIteration, KeyboardInterrupt):
            if self.last is None:
                raise
            status, detail = AccuracyStatus.STOPPED, ""
        return self._end(status, detail)

    def _rounds(self, surface: Surface) -> tuple[AccuracyStatus, str]:
        project = onto_held_curves(surface)
        for _ in range(ROUNDS):
            result = solve(surface, **self.options)
            self.last = self.last or result
            if result.status is Status.STOPPED:
                raise StopIteration
            if not result.converged:
                return AccuracyStatus.NOT_AT_REST, f"on {surface.m} triangles: {result.message}"
            check = check_mesh(result, boundary=project)
            goals = goals_in(check.table, self.wanted)
            here = _Round(result, check, _values(check, goals))
            self.rounds.append(here)
            self._report(here)
            if here.excess(self.value) <= 1.0 and check.persists:
                return AccuracyStatus.REACHED, ""
            if ended := self._hopeless():
                return ended
            shares = _shares(check, goals)
            triangles = self._next(here, shares)
            size = size_field(result.surface, shares, triangles)
            surface = remesh(result.surface, size, growth=GROWTH, project=project)
        return AccuracyStatus.ROUNDS, f"after {ROUNDS} rounds"

    def _next(self, here: _Round, shares: Floats) -> float:
        """How many triangles the next mesh is to have.

        With equal shares N triangles have the error (Σ √η)² / N, here it is Σ η.
        """
        m = here.result.surface.m
        evenness = float(np.sqrt(shares).sum() ** 2 / (m * shares.sum())) if shares.any() else 1.0
        foreseen = SPARE * m * evenness * here.excess(self.value)
        factor = float(np.clip(foreseen / m, LEAST, MOST)) if math.isfinite(foreseen) else MOST
        return min(factor * m, self.most)

    def _hopeless(self) -> tuple[AccuracyStatus, str] | None:
        """The end where a further round does not help, and why."""
        here = self.rounds[-1]
        m, check = here.result.surface.m, here.check
        settled = [
            r.check.verdict is MeshVerdict.PERSISTS and math.isfinite(r.excess(self.value))
            for r in self.rounds
        ]
        if not any(settled[-3:]) and len(settled) >= 3:
            if check.persists:
                bars = here.values[~np.isfinite(here.values["error"])]
                names = ", ".join(_name((row.quantity, row.of)) for row in bars.itertuples())
                return AccuracyStatus.NO_LIMIT, f"{names} on three meshes in turn"
            return AccuracyStatus.NO_LIMIT, "; ".join(filter(None, (check.detail, check.advice)))
        if m >= WORTHWHILE * self.most:
            needed = m * here.excess(self.value)
            about = f"about {needed:.0f} are needed" if math.isfinite(needed) else "its error is not known"
            hint = f"{about}; raise most_triangles= (now {self.most}), or ask for less accuracy"
            return AccuracyStatus.TRIANGLES, hint
        return None

    def _report(self, here: _Round) -> None:
        if self.callback is not None:
            verdict = here.check.verdict.name.lower()
            self.callback(
                {
                    "round": len(self.rounds),
                    "triangles": here.result.surface.m,
                    "verdict": verdict,
                    "excess": here.excess(self.value),
                }
            )

    def _end(self, status: AccuracyStatus, detail: str) -> AccurateResult:
        """The last round, or the first solve if there is none."""
        history = [
            here.values.assign(
                round=k + 1, triangles=here.result.surface.m, verdict=here.check.verdict.name.lower()
            )
            for k, here in enumerate(self.rounds)
        ]
        rows = pd.concat(history, ignore_index=True) if history else pd.DataFrame()
        surfaces = tuple(here.result.surface for here in self.rounds)
        if self.rounds:
            best = self.rounds[-1]
            return AccurateResult(status, best.result, best.check, best.values, rows, surfaces, detail)
        if self.last is None:
            raise AssertionError
        return AccurateResult(status, self.last, None, pd.DataFrame(), rows, surfaces, detail)


def _values(check: MeshCheck, goals: Mapping[Goal, float]) -> pd.DataFrame:
    """The rows of the quantities wanted, and their accuracy."""
    names = list(zip(check.table["quantity"], check.table["of"], strict=True))
    rows = check.table.iloc[[names.index(goal) for goal in goals]].reset_index(drop=True)
    return rows.assign(accuracy=list(goals.values()))


def _shares(check: MeshCheck, goals: Mapping[Goal, float]) -> Floats:
    """The triangles' shares in the error, of the goals that are not yet reached most of all."""
    if len(check.surfaces) < 2:  # a finer mesh has no such surface: finer everywhere
        return np.asarray(face_areas(check.surfaces[0].vertices[check.surfaces[0].faces]) ** 2)
    return error_shares(check.surfaces[0], check.surfaces[1], goals)


def _name(goal: Goal) -> str:
    quantity, of = goal
    return f"{quantity} of {of}" if of else quantity


def _require_mmg() -> None:
    try:
        import mmgpy  # noqa: F401
    except ImportError:
        raise MissingExtra("mmgpy", "remesh") from None
