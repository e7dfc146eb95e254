"""Meshes that are fine where the error comes from, until the quantities wanted are accurate.

A round solves the surface, checks its mesh, and shares out the error among the triangles (``estimator``).
A triangle of edge length h has a share η ∝ h⁴ where the surface is smooth, and the sum of all shares is
least, for N triangles, where all are equal: h_new = h (η̄ / η)^(1/4) with √η̄ = Σ √η / N. MMG makes the
mesh, and the next round begins. Beside a corner a share falls more slowly with h: far above the mean the
exponent is 1/2. At a corner where the surface is like r^λ, equal shares lead to edges
h ∝ r^(1 - λ/2), and to an error ∝ 1 / N, as for a smooth surface: order 2 in 1/√N.
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from ..base import validate
from ..base.errors import MissingExtra, OptionError
from ..base.interrupts import stop_requested
from ..base.units import NO_UNITS, Units
from ..certificate.quantities import dimension_of
from ..meshing.held_curves import onto_held_curves
from ..meshing.refinement import Projection
from ..meshing.remeshing import remesh
from ..solvers import solve, solve_once
from ..solvers.result import Result, Status
from ..surface import Surface, expect_surface
from ..surface.geometry import face_areas
from ..surface.lagrange import expect_flat
from .estimator import GROWTH, Goal, error_shares, evenness, size_field
from .mesh_check import BOUNDARIES, MeshCheck, check_mesh, row_name, vertex_numbers, with_bar

TRIANGLES = 50_000  # of the mesh returned, by default at most
ROUNDS = 12
PATIENCE = 3  # rounds in turn without a limit in sight
LEAST, MOST = 1.5, 3.0  # times as many triangles from round to round
SPARE = 1.3  # times the triangles foreseen, so that fewer rounds are needed
WORTHWHILE = 0.8  # of the limit of triangles: from here on a further round gains little
ACCURACY_OF = ("mesh", "limit")
QUANTITIES = (
    *("height", "area", "volume", "energy", "reaction", "thrust"),
    *("reaction per length", "lowest eigenvalue"),
)
Accuracy = Mapping[str, float] | str


class AccuracyStatus(Enum):
    """How a search for an accuracy ended. The value is a sentence.

    >>> AccuracyStatus.TRIANGLES.value
    'accuracy not reached within the limit of triangles'
    """

    REACHED = "accuracy reached"
    NO_LIMIT = "accuracy out of reach: there is no limit as the mesh gets finer"
    CURVES = "accuracy out of reach: the curves of the boundary are not known so well"
    TRIANGLES = "accuracy not reached within the limit of triangles"
    ROUNDS = "accuracy not reached: further rounds do not help"
    NOT_AT_REST = "accuracy not reached: the solver finds no equilibrium"
    STOPPED = "accuracy not reached: stopped on request"


End = tuple[AccuracyStatus, str]
"""How a search ends, and why."""


@dataclass(frozen=True, eq=False)
class AccurateResult:
    """The end of a search for an accuracy. Every value describes exactly ``surface``.

    Attributes
    ----------
    status : how the search ended.
    result : of the solve that gave ``surface``.
    check : the mesh check of ``surface``; None if no equilibrium was found.
    values : the rows of the mesh check for the quantities wanted, with the ``accuracy`` wanted.
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

    def __repr__(self) -> str:
        """How the search ended, above the surface it reached."""
        return f"{self.message}\n{self.surface!r}"

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
        """``text`` without units."""
        return self.text()

    def text(self, units: Units = NO_UNITS) -> str:
        """A sentence, and each quantity with its bar on this mesh and in the limit."""
        parts = ["; ".join(filter(None, (self.status.value, self.detail))) + f" ({self.surface.m} triangles)"]
        for row in self.values.to_dict("records"):
            unit = units.behind(dimension_of(row["quantity"]))
            on_mesh = with_bar(row["value"], row["error"], unit)
            limit = with_bar(row["limit"], row["limit_error"], unit)
            name, wanted = row_name(row["quantity"], row["of"]), f"wanted ± {row['accuracy']:g}{unit}"
            parts.append(f"{name} {on_mesh} on this mesh, {limit} in the limit, {wanted}")
        return "; ".join(parts)


def solve_to_accuracy(
    surface: Surface,
    accuracy: Accuracy,
    *,
    accuracy_of: str = "mesh",
    boundary: str | Projection = "smooth",
    corners: npt.ArrayLike = (),
    most_triangles: int = TRIANGLES,
    callback: Callable[[Mapping[str, Any]], None] | None = None,
    **options: Any,
) -> AccurateResult:
    """Solve on meshes that get finer where the error comes from, until the error bars are small enough.

    Start from a coarse mesh: remeshing keeps the vertices of boundaries and junctions. The error bars
    are those of ``check_mesh``.

    Parameters
    ----------
    accuracy : the error bar wanted, by quantity, in its unit: ``{"height": 1e-3}`` or ``"height=1e-3"``.
        Quantities are those of the mesh check: height, area, volume, energy, reaction, thrust, reaction
        per length, lowest eigenvalue; with a patch, as in ``"height of north"``, that patch's alone.
    accuracy_of : ``"mesh"``, the value on the mesh returned is to be so accurate; ``"limit"``, the
        extrapolated value is, which needs far fewer triangles.
    boundary, corners : as in ``check_mesh``: where new vertices of a held boundary or held line go. The
        smooth curves are those through the vertices of the first mesh.
    most_triangles : the most that the mesh returned may have; the check solves on 16 times as many.
    callback : called after each round with a row of numbers. StopIteration in it, or Ctrl-C, ends the
        search with the best surface so far.
    options : of ``pcmc.solve``.

    Raises
    ------
    OptionError : for an unknown quantity, with the nearest known one, or an accuracy that is not positive.
    MissingExtra : without the library mmgpy.

    Examples
    --------
    >>> from pcmc.plan import Plan
    >>> roof = Plan([[0, 0], [4, 0], [4, 3], [0, 3]], tension=4.0, edge_length=1.0).surface()
    >>> fine = solve_to_accuracy(roof, "height=0.02")
    >>> fine.status.name, bool(fine.values.error[0] <= 0.02), fine.surface.m < 500
    ('REACHED', True, True)
    """
    wanted = accuracies(accuracy)
    validate.choice("accuracy_of", accuracy_of, ACCURACY_OF)
    validate.integer("most_triangles", most_triangles, least=1)
    expect_surface(surface)
    expect_flat(surface, "solve_to_accuracy")
    check_places(wanted, surface)
    if importlib.util.find_spec("mmgpy") is None:
        raise MissingExtra("mmgpy", "remesh")
    project = boundary if callable(boundary) else None
    known = vertex_numbers(corners, surface.n) if project is None else None
    if project is None and validate.choice("boundary", boundary, BOUNDARIES) == "smooth":
        project = onto_held_curves(surface, corners=known)
    given = {"boundary": boundary, "corners": corners}
    return _Search(wanted, accuracy_of, given, project, most_triangles, callback, options).run(surface)


def accuracies(given: Any) -> dict[str, float]:
    """The accuracy (> 0) by the name of a quantity, from a mapping or a text; OptionError for another.

    >>> accuracies("height=1e-3, area of north=0.01")
    {'height': 0.001, 'area of north': 0.01}
    >>> accuracies({"hight": 1e-3})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: unknown quantity 'hight'; did you mean 'height'? Known: height, ...
    """
    wanted: dict[Any, Any] = dict(given) if isinstance(given, Mapping) else {}
    for part in given.split(",") if isinstance(given, str) else ():
        name, sign, value = part.rpartition("=")
        if name.strip() in wanted:
            text = f"accuracy: {name.strip()} is given twice; keep one"
            raise OptionError(text, what="accuracy", found=name.strip())
        try:
            wanted[name.strip()] = validate.parsed(value)
        except ValueError:
            sign = ""
        if not sign or not name.strip():
            validate.refuse("accuracy", part.strip(), "QUANTITY=NUMBER, such as height=1e-3")
    if not wanted:
        expected = "a table such as {'height': 1e-3}, or a text such as 'height=1e-3'"
        validate.refuse("accuracy", given, expected)
    for name in map(str, wanted):
        validate.choice("quantity", name.partition(" of ")[0], QUANTITIES)
    return {str(k): validate.number("accuracy", v, above=0.0, where=str(k)) for k, v in wanted.items()}


def check_places(wanted: Mapping[str, float], surface: Surface) -> None:
    """Refuse a quantity of a patch that the surface does not have, or of a line between such patches."""
    patches = {patch.name for patch in surface.patches}
    for name in wanted:
        _, of, place = name.partition(" of ")
        line = place.partition(" near ")[0].removesuffix(", inside")
        if of and line not in patches:
            for patch in line.split(" | "):
                surface.patch_index(patch)


def goals_in(table: pd.DataFrame, wanted: Mapping[str, float]) -> dict[Goal, float]:
    """The accuracy of each row of a mesh check's table that is asked for.

    A quantity alone stands for that of the whole surface, and where there is none, as for heights, for those
    of all patches. With a patch it stands for all curves of that patch, too.
    """
    goals: dict[Goal, float] = {}
    for name, accuracy in wanted.items():
        quantity, _, patch = name.partition(" of ")
        rows = [str(of) for of in table["of"][table["quantity"] == quantity]]
        if patch:
            rows = [of for of in rows if patch in (of, of.partition(" near ")[0])]
        elif "" in rows:
            rows = [""]
        if not rows:
            message = f"accuracy: the surface has no {name}; print(pcmc.check_mesh(...)) shows what it has"
            raise OptionError(message, what="accuracy", found=name)
        goals |= dict.fromkeys(((quantity, of) for of in rows), accuracy)
    return goals


class _Round(NamedTuple):
    """A surface at rest, its check, and the quantities wanted with their bars."""

    result: Result
    check: MeshCheck
    goals: Mapping[Goal, float]
    values: pd.DataFrame
    excess: float  # the largest error bar over its accuracy
    record: Mapping[str, Any]  # the numbers for the history


@dataclass(eq=False)
class _Search:
    """The rounds of a search for an accuracy, and the first solve."""

    wanted: Mapping[str, float]
    accuracy_of: str
    given: Mapping[str, Any]
    project: Projection | None
    most_triangles: int
    callback: Callable[[Mapping[str, Any]], None] | None
    options: Mapping[str, Any]
    rounds: list[_Round] = field(default_factory=list)

    def run(self, surface: Surface) -> AccurateResult:
        """Rounds until one of the ends."""
        first = result = solve(surface, **self.options)
        status, detail = AccuracyStatus.ROUNDS, f"after {ROUNDS} rounds"
        try:
            for _ in range(ROUNDS):
                ended: End | None = None
                if result.status is Status.STOPPED:
                    ended = AccuracyStatus.STOPPED, ""
                elif not result.converged:
                    text = f"on {result.surface.m} triangles: {result.message}"
                    ended = AccuracyStatus.NOT_AT_REST, text
                if ended := ended or self._ended(self._round(result)):
                    status, detail = ended
                    break
                result = self._next(self.rounds[-1])
        except (StopIteration, KeyboardInterrupt) as error:
            stop_requested(error)
            status, detail = AccuracyStatus.STOPPED, ""
        if not self.rounds:
            return AccurateResult(status, first, None, pd.DataFrame(), pd.DataFrame(), (), detail)
        last, surfaces = self.rounds[-1], tuple(r.result.surface for r in self.rounds)
        rows = [r.values.assign(round=k, **r.record) for k, r in enumerate(self.rounds, 1)]
        history = pd.concat(rows, ignore_index=True)
        return AccurateResult(status, last.result, last.check, last.values, history, surfaces, detail)

    def _round(self, result: Result) -> _Round:
        """Check the mesh of a surface at rest; bars have what the first mesh's curves leave in doubt, too."""
        first = self.rounds[0].check if self.rounds else None
        given = self.given if first is None else {"boundary": self.project or "polygon"}
        check = check_mesh(result, **given)
        goals, doubts = goals_in(check.table, self.wanted), dict[str, float]()  # the largest by quantity
        for (quantity, _), doubt in (first.curve_doubts if first else {}).items():
            doubts[quantity] = max(doubt, doubts.get(quantity, 0.0))
        names = list(zip(check.table["quantity"], check.table["of"], strict=True))
        rows = check.table.iloc[[names.index(goal) for goal in goals]].reset_index(drop=True)
        values = rows.assign(accuracy=list(goals.values()))
        values[["error", "limit_error"]] += np.array([[doubts.get(quantity, 0.0)] for quantity, _ in goals])
        bar = values["error" if self.accuracy_of == "mesh" else "limit_error"]
        excess = float((bar / values["accuracy"]).max())
        record = {"triangles": result.surface.m, "verdict": check.verdict.name.lower()}
        self.rounds.append(_Round(result, check, goals, values, excess, record))
        if self.callback is not None:
            self.callback({"round": len(self.rounds), **record, "excess": excess})
        return self.rounds[-1]

    def _ended(self, here: _Round) -> End | None:
        """The end of the search, if this is the last round."""
        if here.excess <= 1.0 and here.check.persists:
            return AccuracyStatus.REACHED, ""
        for goal, accuracy in here.goals.items():
            if (doubt := self.rounds[0].check.curve_doubts.get(goal, 0.0)) > accuracy:
                text = f"the first mesh has only points of them, and the {row_name(*goal)} may be {doubt:.2g}"
                hint = "draw them in a plan, start from more points, or give boundary= a function"
                return AccuracyStatus.CURVES, f"{text} off for that; {hint}"
        limits = [r.check.persists and math.isfinite(r.excess) for r in self.rounds[-PATIENCE:]]
        if len(limits) == PATIENCE and not any(limits):
            rows = here.values[~np.isfinite(here.values["error"])]
            names = ", ".join(map(row_name, rows["quantity"], rows["of"]))
            why = "; ".join(filter(None, (here.check.detail, here.check.advice)))
            settle = f"the values of {names} do not settle from mesh to mesh"
            return AccuracyStatus.NO_LIMIT, settle if here.check.persists else why
        m = here.result.surface.m
        if m < WORTHWHILE * self.most_triangles:
            return None
        known = math.isfinite(here.excess)
        needed = f"about {m * here.excess:.2g} are needed" if known else "the error is not known"
        hint = f"raise most_triangles= (now {self.most_triangles}), or ask for less accuracy"
        if self.accuracy_of == "mesh":
            hint += ", or for that of the limit alone (accuracy_of='limit')"
        return AccuracyStatus.TRIANGLES, f"{needed}; {hint}"

    def _next(self, here: _Round) -> Result:
        """The surface on a mesh with equal shares of the error; if it does not come to rest there, on the
        check's finer mesh.

        With equal shares N triangles have the error (Σ √η)² / N, the m triangles here have Σ η.
        """
        surface, finer = here.result.surface, here.check.surfaces[1:2]
        if finer:
            shares = error_shares(surface, finer[0], here.goals)
        else:  # no finer mesh has this surface: finer everywhere
            shares = face_areas(surface.vertices[surface.faces]) ** 2
        factor = SPARE * evenness(shares) * here.excess if math.isfinite(here.excess) else MOST
        triangles = min(float(np.clip(factor, LEAST, MOST)) * surface.m, self.most_triangles)
        sizes = size_field(surface, shares, triangles)
        result = solve_once(remesh(surface, sizes, growth=GROWTH, project=self.project), **self.options)
        if result.converged or result.status is Status.STOPPED or not finer:
            return result
        return solve_once(finer[0], **self.options) if finer[0].m <= self.most_triangles else result
