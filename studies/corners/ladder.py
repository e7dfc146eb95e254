"""One surface on meshes that are finer and finer at the ends of its junctions: does it have a limit?

Level k halves the edges within r 2^-k of the ends; the solver goes on from the level before, and where it
fails, once more from the initial shape on a mesh of that level. The bottoms of the walls slide on Π
("sliding"); they are held where they are drawn ("held"); or they slide, and the ends slide along a straight
or round outline, with no force left along it ("natural").

Near an end on a straight boundary the crest's height over Π is, along its length s from the end,

    u = A s - c s log(1/s),    c = α_w / (π α),

the wall's pull on a quarter plane of tension α on each side. The crest moves sideways like a
string of tension α_w u: from its end, which the mesh holds, its compliance is
∫ ds / (α_w u) = log(A / (A - c log(1/h))) / (α_w c). So with the edge length h the end's hold, the inverse
of this, falls like 1/log(1/h), and it is gone at h = exp(-A/c), where the junction comes to rest on Π.
``rise`` measures A and c, ``loss`` the eigenvalue that the hold keeps up.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import curve_fit

from pcmc import Certificate, Circle, Line, Surface
from pcmc.base.arrays import Floats, Ints
from pcmc.base.errors import SurfaceError
from pcmc.meshing.local_refinement import refine_near
from pcmc.meshing.quality import edge_lengths
from pcmc.meshing.refinement import refine
from pcmc.solvers import solve_once
from pcmc.solvers.result import Result
from pcmc.surface.geometry import angles

Projection = Callable[[Floats], Floats]
PERSISTS, SADDLE, TURNS, LOST, SINKS, NONE = CATEGORIES = (
    "has a limit: a minimum",
    "has a limit: a saddle",
    "held by the mesh: a saddle in the limit",
    "held by the mesh: no limit found",
    "comes down on its held bottom",
    "not found on the first mesh",
)
SUNK = 1e-3  # quality of a wall's triangles at which its junction has come down on its bottom
JUMP = (  # columns of ``halved``
    "level", "anew", "slid", "energy_before", "energy", "energy_before_halved", "energy_halved",
    "step_before", "step", "step_halved", "mesh_error", "polygon_step_before", "polygon_step",
    "status_before_halved", "status_halved",
)  # fmt: skip
JUMP_NUMBERS = tuple(column for column in JUMP if not column.startswith("status"))
LEAST_FIT = 4  # levels
NEAR_REST = 0.2  # of log(1/h): closer to where the junction rests the law has no use
LEAST_STEP = 1e-6  # of the energy: a smaller step is not looked into
ITERATIONS = 60  # of the solver on a mesh; from the level before it takes 5
CONFIDENCE = 0.95
STRAIGHT = 1e-9  # of the size: how far points may be from a line or circle that they lie on


def ends(surface: Surface) -> Ints:
    """The fixed vertices of roofs where junctions end."""
    roof = np.zeros(surface.n, dtype=bool)
    roof[surface.faces[~surface.walls[surface.patch_of_face]]] = True
    curves = [curve.vertices[[0, -1]] for curve in surface.topology.junctions if not curve.closed]
    last = np.unique(np.concatenate(curves))
    return last[(surface.fixed & surface.topology.on_boundary & roof)[last]]


def hold_bottoms(surface: Surface) -> Surface:
    """The same surface with every sliding vertex fixed."""
    fixed = surface.fixed | surface.on_plane
    args = surface.vertices, surface.faces, surface.patch_of_face, surface.patches
    return Surface(*args, fixed=fixed, plane=surface.plane)


def free_ends(surface: Surface) -> Surface:
    """The same surface with its ends sliding along the outline, where that is straight or one circle.

    The outline's other vertices on the same straight side, or on the circle, slide too, and make room.
    """
    topo, X = surface.topology, surface.vertices
    outline = topo.edges[topo.boundary_edge & surface.fixed[topo.edges].all(axis=1)]
    rim = _circle_through(X[np.unique(outline)])
    if rim is not None:
        return replace(surface, on_line=((rim, np.isin(np.arange(surface.n), outline)),))
    lines = []
    for vertex in ends(surface):
        if abs(opening(surface, int(vertex)) - 180.0) > 1e-6:
            continue
        beside = outline[(outline == vertex).any(axis=1)].sum(axis=1) - vertex
        line = Line(tuple(X[vertex]), tuple(X[beside[1]] - X[beside[0]]))
        side = np.unique(outline[(line.distance(X[outline]) < STRAIGHT * surface.size).all(axis=1)])
        place = line.place(X[side])
        inner = side[(place > place.min()) & (place < place.max())]
        lines.append((line, np.isin(np.arange(surface.n), inner)))
    return replace(surface, on_line=tuple(lines))


def _circle_through(points: Floats) -> Circle | None:
    """The circle that points (k,3) lie on, if there is one.

    >>> _circle_through(np.array([[2.0, 0, 0], [1, 1, 0], [0, 0, 0], [1, -1, 0]]))
    Circle(centre=(1.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0), radius=1.0)
    """
    a = points[0]
    b = points[np.linalg.norm(points - a, axis=1).argmax()]
    normals = np.cross(points - a, b - a)
    third = int(np.linalg.norm(normals, axis=1).argmax())
    u, v, normal = b - a, points[third] - a, normals[third]
    if len(points) < 4 or not np.linalg.norm(normal) > STRAIGHT * (u @ u):
        return None
    normal = normal if normal[np.abs(normal).argmax()] > 0.0 else -normal
    w = np.cross(u, v)
    centre = a + np.cross(w, (u @ u) * v - (v @ v) * u) / (-2.0 * (w @ w))
    circle = Circle(tuple(centre.tolist()), tuple(normal.tolist()), float(np.linalg.norm(a - centre)))
    return circle if circle.distance(points).max() <= STRAIGHT * circle.radius else None


SUPPORTS: dict[str, Callable[[Surface], Surface]] = {
    "sliding": lambda surface: surface,
    "held": hold_bottoms,
    "natural": free_ends,
}


def climb(
    surface: Surface, levels: int, radius: float, support: str, project: Projection | None = None
) -> tuple[list[dict[str, Any]], list[Surface]]:
    """A row per level as long as there is an equilibrium; the initial surface, and at rest on each level.

    ``radius`` is what the first refinement reaches; ``project`` puts new boundary vertices in place. ``anew``
    says that a level is solved from the initial shape, ``slid`` how far the vertices of the initial mesh are
    from where they were on the level before.
    """
    vertices = ends(surface)
    places = surface.vertices[vertices]
    shape, rows, reached = surface, [], [surface]
    for level in range(levels + 1):
        result, is_anew = _solved(shape, support), False
        if not result.converged and level:
            anew = refine_near(surface, places, level, radius, project)
            again = _solved(anew, support)
            is_anew = again.converged
            shape, result = (anew, again) if is_anew else (shape, result)
        certificate = result.certify(modes=1) if result.converged else result.certificate
        at_end = np.isin(result.surface.topology.edges, vertices).any(axis=1)
        rows.append(
            {
                "level": level,
                "edge_length": float(np.median(edge_lengths(shape)[at_end])),
                "triangles": shape.m,
                "status": result.status.name.lower(),
                "anew": is_anew,
                "slid": _slid(reached[-1], result.surface, surface.n) if level else math.nan,
                **_findings(certificate, result.surface),
            }
        )
        if not result.converged:
            break
        reached.append(result.surface)
        if level < levels:
            try:
                shape = refine_near(
                    shape.moved(result.surface.vertices), places, 1, radius * 0.5**level, project
                )
            except SurfaceError:  # a wall without height cannot be cut
                shape = refine_near(surface, places, level + 1, radius, project)
    return rows, reached


def _slid(before: Surface, now: Surface, vertices: int) -> float:
    """The largest distance between the places of the first ``vertices`` vertices."""
    moved = now.vertices[:vertices] - before.vertices[:vertices]
    return float(np.linalg.norm(moved, axis=1).max())


def halved(
    rows: Sequence[Mapping[str, Any]],
    reached: Sequence[Surface],
    support: str,
    project: Projection | None = None,
) -> list[dict[str, Any]]:
    """The largest step of the energy that is larger than the step before, on finer meshes, too.

    A row, or none: the energies on both levels, and on the same meshes with every triangle cut into four. If
    the step is another shape's, it stays; if only the vertices lie elsewhere, it goes with h², as the error
    of the energy does, which ``mesh_error`` estimates (Richardson).
    """
    energies = [row["energy"] for row in rows if row["status"] == "converged"]
    steps = np.abs(np.diff(energies))
    growing = 1 + np.flatnonzero(steps[1:] > steps[:-1])
    growing = growing[steps[growing] > LEAST_STEP * abs(energies[-1])]
    if not len(growing):
        return []
    level = int(growing[np.argmax(steps[growing])]) + 1
    fine = [_solved_finer(reached[k + 1], support, project) for k in (level - 1, level)]
    energy, finer = energies[level - 1 : level + 1], [found for found, _ in fine]
    return [
        {
            "level": level,
            "anew": rows[level]["anew"],
            "slid": rows[level]["slid"],
            "energy_before": energy[0],
            "energy": energy[1],
            "energy_before_halved": finer[0],
            "energy_halved": finer[1],
            "step_before": energies[level - 1] - energies[level - 2],
            "step": energy[1] - energy[0],
            "step_halved": finer[1] - finer[0],
            "mesh_error": (energy[1] - finer[1]) * 4.0 / 3.0,
            "status_before_halved": fine[0][1],
            "status_halved": fine[1][1],
        }
    ]


def polygon_steps(surface: Surface, level: int, radius: float, support: str) -> dict[str, float]:
    """The step of the energy to a level, and the one before, with the outline left as the polygon it is.

    Where new vertices go on a round outline the surface gets larger, and its energy with it or against it;
    here it does not. NaN where a level is not reached.
    """
    rows, _ = climb(surface, level, radius, support)
    energies = [row["energy"] if row["status"] == "converged" else math.nan for row in rows]
    before, step = np.diff(energies + [math.nan] * (level + 1 - len(energies)))[-2:]
    return {"polygon_step_before": float(before), "polygon_step": float(step)}


def _solved_finer(surface: Surface, support: str, project: Projection | None) -> tuple[float, str]:
    """The energy with every triangle cut into four, and how the solver ended."""
    try:
        finer = refine(surface, 1, project)
    except SurfaceError:  # walls have come down to nothing
        return math.nan, "cannot be cut"
    result = _solved(finer, support)
    return result.energy, result.status.name.lower()


def _solved(shape: Surface, support: str) -> Result:
    start = SUPPORTS[support](shape)
    return solve_once(start, "newton", target="stationary", iterations=ITERATIONS)


def _findings(certificate: Certificate, surface: Surface) -> dict[str, Any]:
    walls = [patch.auxiliary for patch in surface.patches]
    return {
        "index": -1 if certificate.index is None else certificate.index,
        "eigenvalue": float(certificate.eigenvalues[0]) if len(certificate.eigenvalues) else math.nan,
        "height": float(surface.plane.height(surface.vertices).max()),
        "energy": certificate.energy,
        "pinched": len(certificate.pinched),
        "quality": certificate.quality,
        "walls_quality": float(certificate.patches.quality[walls].min()),
    }


def label(rows: Sequence[dict[str, Any]], levels: int, support: str) -> str:
    """Which of ``CATEGORIES`` the rows of ``climb`` are.

    >>> row = {"status": "converged", "index": 0, "walls_quality": 0.5}
    >>> label([row, row | {"index": 1}], 1, "sliding")
    'held by the mesh: a saddle in the limit'
    """
    last = rows[-1]
    if last["status"] != "converged":
        if support == "held" and last["walls_quality"] < SUNK:
            return SINKS
        return LOST if len(rows) > 1 else NONE
    assert len(rows) == levels + 1
    if last["index"] == 0:
        return PERSISTS
    return TURNS if rows[0]["index"] == 0 else SADDLE


def opening(surface: Surface, vertex: int) -> float:
    """The angle of the outline at a vertex in plan, through the inside, degrees.

    >>> from generators import two_squares
    >>> square = two_squares(4)
    >>> [round(opening(square, v), 6) for v in ends(square)]
    [180.0, 180.0]
    """
    roof = ~surface.walls[surface.patch_of_face]
    faces = surface.faces[roof]
    flat = surface.plane.to_local(surface.vertices)[:, :2]
    return float(angles(flat[faces])[faces == vertex].sum())


def loss(rows: Sequence[Mapping[Any, Any]], rest: float = 0.0) -> dict[str, float]:
    """The law λ = λ∞ + B K of the lowest eigenvalue against the edge length h at the end; see ``law``.

    ``limit`` λ∞ ± ``limit_margin``, ``loss`` B ± ``loss_margin`` (95 %, of the scatter about the law) and
    ``shift`` ℓ, from the levels on which nothing rests on Π but the first two, ``fitted`` many; NaN where
    these are fewer than five. ``rest`` is the distance from the end at which the junction comes to rest.
    """
    from scipy.stats import t  # here, as it takes a third of a second that few runs need

    last = -math.log(rest) if rest > 0.0 else math.inf
    free = [row for row in rows if row["status"] == "converged" and row["pinched"] == 0][2:]
    free = [row for row in free if -math.log(row["edge_length"]) < last - NEAR_REST]
    none = dict.fromkeys(("limit", "limit_margin", "loss", "loss_margin", "shift"), math.nan)
    if len(free) < 5:
        return {"fitted": len(free), "last": last, **none}
    depth = -np.log([row["edge_length"] for row in free])
    values = np.array([row["eigenvalue"] for row in free])
    span = np.ptp(values) or 1.0
    scaled, covariance = curve_fit(
        partial(law, last=last),
        depth,
        (values - values[-1]) / span,
        (0.0, 1.0, 1.0 - depth.min()),
        bounds=((-np.inf, -np.inf, 1e-3 - depth.min()), np.inf),
    )
    margins = t.ppf(0.5 + 0.5 * CONFIDENCE, len(free) - 3) * np.sqrt(np.diag(covariance)) * span
    limit, amount = values[-1] + span * scaled[0], span * scaled[1]
    found = (limit, margins[0], amount, margins[1], scaled[2])
    return {"fitted": len(free), "last": last, **dict(zip(none, map(float, found), strict=True))}


def law(depth: Floats, limit: float, amount: float, shift: float, last: float = math.inf) -> Floats:
    """λ∞ + B K at depths d = log(1/h): K = 1 / log((D + ℓ) / (D - d)), or 1 / (d + ℓ) for infinite D.

    D, ``last``, is the depth at which the junction rests; ℓ is the logarithm of the length over which the
    end holds.
    """
    if math.isinf(last):
        return np.asarray(limit + amount / (depth + shift))
    return np.asarray(limit + amount / np.log((last + shift) / (last - depth)))


def fit(x: Floats, y: Floats) -> tuple[float, float]:
    """Least-squares slope of y over x and half the width of its 95 % confidence interval.

    >>> fit(np.arange(4.0), 2.0 * np.arange(4.0))
    (2.0, 0.0)
    """
    from scipy.stats import linregress, t

    line = linregress(x, y)
    return float(line.slope), float(t.ppf(0.5 + 0.5 * CONFIDENCE, len(x) - 2) * line.stderr)


def crest(surface: Surface, vertex: int) -> tuple[Floats, Floats]:
    """Along the junction from its end: (k,) distances of the edges' middles, (k,) their rises dz/ds."""
    for curve in surface.topology.junctions:
        if not curve.closed and vertex in curve.vertices[[0, -1]]:
            line = curve.vertices if curve.vertices[0] == vertex else curve.vertices[::-1]
            local = surface.plane.to_local(surface.vertices[line])
            along = np.linalg.norm(local[:, :2] - local[0, :2], axis=1)
            return 0.5 * (along[1:] + along[:-1]), np.diff(local[:, 2]) / np.diff(along)
    raise ValueError(f"no junction ends at vertex {vertex}")


def rise(surface: Surface, vertex: int, least: float, most: float) -> dict[str, float]:
    """c and A of dz/ds = A + c - c log(1/s), from edges at distances least ≤ s ≤ most from the end.

    ``c`` ± ``c_margin`` (95 %); ``rest``: the distance exp(-A/c) from which on the junction lies on Π.
    """
    s, slope = crest(surface, vertex)
    used = (s >= least) & (s <= most)
    if used.sum() < LEAST_FIT:
        return dict.fromkeys(("c", "c_margin", "rest"), math.nan)
    c, margin = fit(np.log(s[used]), slope[used])
    A = float((slope[used] - c * np.log(s[used])).mean()) - c
    return {"c": c, "c_margin": margin, "rest": math.exp(-A / c) if c > 0.0 else 0.0}
