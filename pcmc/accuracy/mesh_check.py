"""The mesh check: the same surface on finer meshes, with an error bar for everything read from it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from ..base import validate
from ..base.arrays import Ints
from ..base.errors import OptionError, SurfaceError
from ..base.units import NO_UNITS, Units
from ..certificate import certify
from ..certificate.quantities import dimension_of
from ..meshing.held_curves import doubted_midpoints, held_corners, smooth_midpoints
from ..meshing.quality import edge_lengths
from ..meshing.refinement import Projection, refine
from ..solvers import solve_once
from ..solvers.result import Callback, Result, unless_stopped
from ..surface import Surface
from ..surface.lagrange import expect_flat
from ..surface.pieces import two_digits
from .extrapolation import extrapolate
from .persistence import MeshVerdict, compared, lost, shape_order
from .quantities import Key, Reading, readings

MOST = 4_000_000  # triangles of the finest mesh, by default
STEPS = 60  # of the solver on each finer mesh: it starts near
BOUNDARIES = ("smooth", "polygon")
CURVES = 8.0 / 3.0  # times what doubtful curves change on the next mesh: 4/3 on all finer ones, times 2


@dataclass(frozen=True, eq=False)
class MeshCheck:
    """How far a surface at rest depends on its mesh. ``print`` shows the table.

    Error bars are estimates from these meshes, no bounds: the study ``coverage`` counts how often they hold.

    Attributes
    ----------
    verdict, detail : the verdict, and its reason.
    place : (x, y, z) of the place that the reason names; None where it names none.
    advice : what to type to get a surface that does not depend on its mesh; empty where nothing is known.
    table : a row per quantity: ``quantity``, ``of``, its name and the patch or boundary it belongs to, empty
        for the whole; ``value`` on this mesh and ``error``, its bar, how far the limit may be from it;
        ``limit``, the value as edges go to zero, and ``limit_error``, its bar; ``order``, the observed p of
        error ∝ h^p, h the edge length. Both bars are 0 where the value is given, as volumes of rooms may be.
        Without a limit in sight ``limit`` is NaN and the bars are infinite. ``order`` is NaN for what is
        the same on all meshes, to rounding, and for what swings.
    surfaces : on each mesh at rest, the one given first; a solve that failed is left out.
    curve_doubts : by quantity and ``of``, what of both bars is there as curves of the boundary are guesses.
    other_curves : the surfaces with other guesses, refined once, from which that is known.
    """

    verdict: MeshVerdict
    detail: str
    place: tuple[float, ...] | None
    advice: str
    table: pd.DataFrame
    surfaces: tuple[Surface, ...]
    curve_doubts: Mapping[tuple[str, str], float]
    other_curves: tuple[Surface, ...] = ()

    @property
    def persists(self) -> bool:
        """Whether finer meshes have the same surface."""
        return self.verdict is MeshVerdict.PERSISTS

    def row(self, quantity: str, of: str = "") -> pd.Series[Any]:
        """The row of one quantity.

        Raises
        ------
        OptionError : the table has no such row.
        """
        known = list(map(row_name, self.table["quantity"], self.table["of"]))
        return self.table.iloc[known.index(validate.choice("quantity", row_name(quantity, of), known))]

    def numbers(self) -> dict[str, Any]:
        """The verdict, and bar, limit, its bar and order of the quantities of the whole surface, for tables.

        The height is that of the highest patch. Keys are such as ``height_error`` and ``volume_limit``.
        """
        found: dict[str, Any] = {"mesh_verdict": self.verdict.name.lower().replace("_", " ")}
        found["mesh_detail"] = self.detail
        heights = self.table[self.table["quantity"] == "height"].nlargest(1, "value")
        for row in pd.concat([heights, self.table[self.table["of"] == ""]]).to_dict("records"):
            for column in ("error", "limit", "limit_error", "order"):
                found[f"{row['quantity']}_{column}".replace(" ", "_")] = float(row[column])
        return found

    def brief(self, units: Units = NO_UNITS) -> str:
        """The verdict, its reason, and the bars of heights, of rooms and of the whole surface."""
        main = self.table[(self.table.of == "") | self.table.quantity.isin(["height", "pressure"])]
        return f"{self._head()}\n{_text_table(main, units)}"

    def text(self, units: Units = NO_UNITS) -> str:
        """The verdict, its reason and the table, with the units of its numbers if they are given."""
        return f"{self._head()}\n\n{_text_table(self.table, units)}"

    __repr__ = text

    def _head(self) -> str:
        return "\n".join(filter(None, (self.verdict.value, self.detail, self.advice)))


def check_mesh(
    surface: Surface | Result,
    meshes: int = 3,
    *,
    boundary: str | Projection = "smooth",
    corners: npt.ArrayLike = (),
    callback: Callback | None = None,
    most_triangles: int = MOST,
) -> MeshCheck:
    """Solve a surface at rest again on finer meshes, and compare.

    Each finer mesh has every triangle of the last one cut into four. The solver starts on it from the last
    surface and looks for the stationary point near it: a saddle is followed as a saddle. What a designer
    reads gets an error bar; see ``MeshCheck``. The index, the shape and the contact of walls with Π decide
    the verdict.

    Parameters
    ----------
    surface : at rest, or the result of a solver that converged.
    meshes : how many in all, ≥ 2; the finest has 4^(meshes - 1) times as many triangles. With 2 there is no
        observed order, and order 2 is taken with a wide bar; more than 3 make the limit sharper.
    boundary : where new vertices of a held boundary or held line go: ``"smooth"``, on smooth curves
        through the old ones, which turn by up to 40° at a vertex (straight lines stay straight); where
        they turn by a little more, beside other turns, the bars also count that there may be no corner;
        ``"polygon"``, on the straight edges; or a function (k,3) → (k,3) that puts points of the edges
        on the exact curve. Vertices that slide on Π stay on it.
    corners : vertices (k,) at which held curves have corners for sure, also where they turn by less.
    callback : called with a ``Progress`` after each step of the solver. StopIteration in it, or Ctrl-C, ends
        the check with KeyboardInterrupt.
    most_triangles : of the finest mesh.

    Raises
    ------
    OptionError : for a value that is not allowed, or more than ``most_triangles``.
    SurfaceError : if the surface is not at rest.

    Examples
    --------
    >>> from pcmc import Patch, solve
    >>> angle = 2 * np.pi * np.arange(12) / 12
    >>> rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> disc = Surface([[0, 0, 0.5], *rim], [[0, k + 1, (k + 1) % 12 + 1] for k in range(12)], [0] * 12,
    ...                [Patch("cap", 0.6)], fixed=range(1, 13))
    >>> check = check_mesh(solve_once(disc))
    >>> check.verdict.name, [s.m for s in check.surfaces]
    ('PERSISTS', [12, 48, 192])
    >>> row, exact = check.row("volume"), 0.9239415226
    >>> bool(abs(row.value - exact) <= row.error), bool(abs(row.limit - exact) <= row.limit_error)
    (True, True)
    """
    validate.integer("meshes", meshes, least=2)
    if not callable(boundary):
        validate.choice("boundary", boundary, BOUNDARIES)
    first = surface.surface if isinstance(surface, Result) else surface
    if not isinstance(first, Surface):
        validate.refuse("surface", type(first).__name__, "a Surface or a Result", error=SurfaceError)
    expect_flat(first, "check_mesh")
    validate.integer("most_triangles", most_triangles)
    known = vertex_numbers(corners, first.n)
    sharp = np.union1d(known, held_corners(first))
    finest = first.m * 4 ** (meshes - 1)
    if finest > most_triangles:
        text = f"the finest of {meshes} meshes would have {finest} triangles, more than most_triangles ="
        text += f" {most_triangles}; ask for fewer meshes, or raise most_triangles="
        raise OptionError(text, what="meshes", found=finest, expected=most_triangles)
    certificate = surface.certificate if isinstance(surface, Result) else certify(surface)
    if certificate.index is None:
        message = f"check_mesh needs a surface at rest; solve it first ({certificate.verdict.value}"
        message += f"; {certificate.detail})" if certificate.detail else ")"
        raise SurfaceError(message, what="surface", found=certificate.residual)
    solved = partial(_solved, callback=callback, stable=certificate.index == 0)
    surfaces, certificates, finding, order = [first], [certificate], None, None
    for _ in range(meshes - 1):
        start = _refined(surfaces[-1], boundary, sharp)
        result = solved(start)
        if not result.converged or result.certificate.index is None:
            finding, order = lost(start, result), -np.inf
            break
        surfaces.append(result.surface)
        certificates.append(result.certificate)
    if finding is None or len(surfaces) > 1:
        other = compared(surfaces, certificates)
        finding = other if finding is None or other.verdict is MeshVerdict.CHANGES else finding
    if finding.verdict is MeshVerdict.CHANGES and not finding.advice:
        finer = two_digits(0.5 * float(edge_lengths(first).mean()))
        advice = f"take finer triangles: edge_length = {finer:g} in [plan], or pcmc remesh"
        finding = finding._replace(advice=f"{advice} --edge-length {finer:g}")
    found = [readings(s, c, first.n) for s, c in zip(surfaces, certificates, strict=True)]
    doubted = doubted_midpoints(first, corners=known) if boundary == "smooth" and len(found) > 1 else ()
    others = [solved(refine(first, 1, lambda _, places=places: places)) for places in doubted]
    doubts = _curve_doubts(first, others, found)
    table = _table(found, shape_order(surfaces) if order is None else order, doubts)
    return MeshCheck(*finding, table, tuple(surfaces), doubts, tuple(other.surface for other in others))


def vertex_numbers(corners: npt.ArrayLike, n: int) -> Ints:
    """The numbers (k,) of the corners, checked."""
    try:
        numbers = np.asarray(corners)
    except ValueError:  # of rows of several lengths
        numbers = np.array([""])
    whole = numbers.size == 0 or (numbers.ndim == 1 and np.issubdtype(numbers.dtype, np.integer))
    if not whole or (numbers.size and not (numbers.min() >= 0 and numbers.max() < n)):
        validate.refuse("corners", corners, f"whole numbers of vertices, 0..{n - 1}")
    return numbers.astype(np.int64)


def _refined(surface: Surface, boundary: str | Projection, corners: Ints) -> Surface:
    if boundary == "smooth":
        return refine(surface, 1, lambda _: smooth_midpoints(surface, corners=corners))
    return refine(surface, 1, boundary if callable(boundary) else None)


def _solved(start: Surface, callback: Callback | None, stable: bool) -> Result:
    """The surface on a finer mesh, at rest nearby; a ``stable`` one may be so only downhill."""
    results = list[Result]()
    for target in ("stationary", "minimum") if stable else ("stationary",):
        result = solve_once(start, "newton", callback, target=target, iterations=STEPS)
        results.append(unless_stopped(result))
        if results[-1].converged:
            return results[-1]
    return results[0]


def _curve_doubts(
    first: Surface, others: Sequence[Result], found: Sequence[dict[Key, Reading]]
) -> dict[tuple[str, str], float]:
    """How far limits may be off as curves are guesses: the next mesh is solved with other guesses, too."""
    doubts: dict[tuple[str, str], float] = {}
    for other in others:
        there = readings(other.surface, other.certificate, first.n) if other.converged else {}
        for key, reading in found[0].items():
            known, name = key in there and key in found[1], (reading.quantity, reading.of)
            more = CURVES * abs(found[1][key].estimate - there[key].estimate) if known else math.inf
            doubts[name] = doubts.get(name, 0.0) + more
    return doubts


def _table(
    found: Sequence[dict[Key, Reading]], order: float, doubts: Mapping[tuple[str, str], float]
) -> pd.DataFrame:
    """Values, limits, bars and orders; NaN for a quantity that a finer mesh does not have."""
    none = Reading("", "", math.nan, math.nan, math.nan)
    rows = [[one.get(key, none) for key in found[0]] for one in found]
    estimates = np.array([[reading.estimate for reading in row] for row in rows])
    rounding = np.nanmax(np.array([[reading.rounding for reading in row] for row in rows]), axis=0)
    value = np.array([reading.value for reading in rows[0]])
    doubt = np.array([doubts.get((reading.quantity, reading.of), 0.0) for reading in rows[0]])
    result = extrapolate(estimates, rounding, value, shape_order=order, doubt=doubt)
    table = pd.DataFrame([(one.quantity, one.of) for one in rows[0]], columns=["quantity", "of"])
    table = table.assign(value=value, error=result.error, limit=result.limit)
    return table.assign(limit_error=result.limit_error, order=result.order)


def row_name(quantity: str, of: str) -> str:
    """What a row is called: "area of north", or "energy" of the whole."""
    return f"{quantity} of {of}" if of else quantity


def _text_table(table: pd.DataFrame, units: Units) -> str:
    """Lines with as many digits as the bars let stand."""
    lines = table[["quantity", "of"]].copy()
    lines["on this mesh"] = list(map(with_bar, table.value, table.error))
    lines["limit"] = list(map(with_bar, table.limit, table.limit_error))
    if units:
        lines["unit"] = [units.behind(dimension_of(quantity)).strip() for quantity in table.quantity]
    lines["order"] = ["-" if math.isnan(p) else f"{p:.1f}" for p in table.order]
    return lines.to_string(index=False)


def with_bar(value: float, bar: float, unit: str = "") -> str:
    """A value and its bar, with two digits of the bar, and what follows them; without a bar it is given.

    >>> with_bar(2.71828, 0.0123), with_bar(1234.5, 45.0), with_bar(2.0, math.inf), with_bar(2.0, 1e-12)
    ('2.718 ± 0.012', '1234 ± 45', '2 ± unknown', '2 ± 1e-12')
    >>> with_bar(2.71828, 0.0123, " m"), with_bar(1.7, 0.0, " m³"), with_bar(2.0, math.inf, " m")
    ('2.718 ± 0.012 m', '1.7 m³ (given)', '2 m ± unknown')
    """
    if math.isnan(value):
        return "none in sight"
    if bar == 0.0:
        return f"{value:.8g}{unit} (given)"
    if not math.isfinite(bar):
        return f"{value:.4g}{unit} ± unknown"
    if bar <= 1e-9 * abs(value):
        return f"{value:.8g} ± {bar:.0e}{unit}"
    digits = 1 - math.floor(math.log10(bar))
    if not -6 <= digits <= 9:
        return f"{value:.4g} ± {bar:.2g}{unit}"
    shown = max(digits, 0)
    return f"{round(value, digits):.{shown}f} ± {round(bar, digits):.{shown}f}{unit}"
