"""Where the error of a quantity comes from, triangle by triangle, and the sizes that make all shares equal.

A surface at rest on a mesh is compared with the surface at rest on the mesh's 1→4 refinement. The
interpolation error along edge e = (a, b) is what the finer mesh adds to it,

    d_e = x_e - (x_a + x_b) / 2,

with x_e the vertex on e. A quantity q responds to forces by its dual field z, H z = ∂q/∂X with H the second
variation of E in the motion space, and has an interpolation error d_e(z) of its own. Then the mesh changes
q by about the energy product of the two errors, plus what the held vertices contribute that move
to a curved boundary:

    η_e = k_e |d_e| |d_e(z)| + |(∂q/∂X - H z) · d_e| at held vertices,   k_e = √3 Σ α over the triangles at e

k_e is the stiffness of a vertex in the middle of two equilateral triangles. The energy is its own dual:
η_e = ½ k_e |d_e|² + |∇E · d_e|. Becker and Rannacher 2001 weight a residual by the dual in this way.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from math import sqrt

import numpy as np

from ..base.arrays import Floats
from ..certificate.forces import Forces
from ..certificate.measures import MEASURES, largest_pull, pull_slopes
from ..certificate.supports import line_shares
from ..forces.functional import energy_and_gradient
from ..meshing.curve_cutting import limit_growth, triangles_for
from ..stability.equilibrium import Equilibrium
from ..stability.factorisation import SingularMatrix
from ..stability.modes import lowest
from ..surface import Surface
from ..surface.geometry import face_areas, segment_lengths, vertex_sums
from ..surface.supports import apply_supports
from .quantities import summit

GROWTH = 1.5  # of neighbouring edges
FINER, COARSER = 0.1, 3.0  # times the edge length, in one round
SINGULAR = 2.0  # times the wanted root of a share: above, the share falls more slowly than h⁴
FLOOR = 1e-12  # of the largest share: a share below counts as that much
STEP = 1e-5  # of the size: length of the steps that differences of ∇E are taken over

Goal = tuple[str, str]
"""A quantity and the patch or boundary it belongs to, as in a mesh check; "" for the whole."""


def error_shares(coarse: Surface, fine: Surface, goals: Mapping[Goal, float]) -> Floats:
    """(m,) the share of each coarse triangle in the errors of quantities, each in units of its accuracy.

    Parameters
    ----------
    coarse : a surface at rest.
    fine : its 1→4 refinement, at rest as well.
    goals : the accuracy wanted of each quantity. Several are added up.

    Examples
    --------
    On the cap all triangles are alike, and so are their shares in the energy's error:

    >>> from generators import spherical_cap
    >>> from pcmc import solve
    >>> from pcmc.meshing.refinement import refine
    >>> cap = solve(spherical_cap(0.5)).surface
    >>> shares = error_shares(cap, solve(refine(cap)).surface, {("energy", ""): 1e-3})
    >>> len(shares) == cap.m, bool(shares.min() > 0.02 * shares.max())
    (True, True)
    """
    topo, shares = coarse.topology, zip(_edge_shares(coarse, fine, goals), goals.values(), strict=True)
    total = sum((share / accuracy for share, accuracy in shares), np.zeros(len(topo.edges)))
    faces = np.bincount(topo.edge_of_face.ravel(), minlength=len(total))
    return np.asarray((total / np.maximum(faces, 1))[topo.edge_of_face].sum(axis=1))


def evenness(shares: Floats) -> float:
    """(Σ √η)² / (m Σ η): the error of a mesh with as many triangles and equal shares, over that of this one.

    >>> evenness(np.array([1.0, 1.0])), evenness(np.array([1.0, 0.0]))
    (1.0, 0.5)
    """
    total = float(shares.sum())
    return float(np.sqrt(shares).sum() ** 2 / (len(shares) * total)) if total > 0.0 else 1.0


def size_field(surface: Surface, shares: Floats, triangles: float) -> Floats:
    """(n,) edge lengths for a mesh of about so many triangles whose shares (m,) ≥ 0 in the error are equal.

    >>> from pcmc import Patch
    >>> square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]],
    ...                  [0, 0], [Patch("floor", 1.0)], fixed=range(4))
    >>> size_field(square, np.array([1.0, 1.0]), 20).round(3).tolist()
    [0.34, 0.34, 0.34, 0.34]
    """
    F, areas = surface.faces, face_areas(surface.vertices[surface.faces])
    root = np.sqrt(np.maximum(shares, FLOOR * shares.max(initial=0.0)))
    excess = root * triangles / root.sum() if root.any() else np.ones(surface.m)
    factor = excess**-0.5 * np.maximum(1.0, excess / SINGULAR) ** -0.5
    length = np.sqrt(areas * 4.0 / sqrt(3.0)) * np.clip(factor, FINER, COARSER)
    log, count = vertex_sums(np.column_stack([np.log(length), np.ones(surface.m)]), F, surface.n).T
    wanted = np.exp(log / np.maximum(count, 1.0))
    for _ in range(6):  # limits to growth make edges shorter and triangles more
        size = limit_growth(surface.vertices, surface.topology.edges, wanted, GROWTH)
        wanted *= sqrt(triangles_for(areas, size[F].mean(axis=1)).sum() / triangles)
    return limit_growth(surface.vertices, surface.topology.edges, wanted, GROWTH)


def _edge_shares(coarse: Surface, fine: Surface, goals: Iterable[Goal]) -> Iterator[Floats]:
    """(e,) the share of each coarse edge in the error of each quantity."""
    at, system = Equilibrium.of(fine), None
    with suppress(SingularMatrix):  # without duals all have the shares of the energy
        system = at.factorised()
    tension = np.repeat(coarse.tensions[coarse.patch_of_face], 3)
    stiffness = np.bincount(coarse.topology.edge_of_face.ravel(), tension, len(coarse.topology.edges))
    held = np.where(fine.fixed[:, None], _interpolation_error(coarse, at.X), 0.0)

    def missing(field: Floats) -> Floats:
        """(e,) the size of the interpolation error of a field of motions, in the motion space."""
        return np.linalg.norm(at.space.project(_interpolation_error(coarse, field))[coarse.n :], axis=1)

    def at_held(force: Floats) -> Floats:
        """(e,) the work of a force (n,3) along the errors at held vertices."""
        return np.asarray(np.abs(np.einsum("nd,nd->n", force, held))[coarse.n :])

    free = missing(at.X)
    for quantity, of in goals:
        modes = np.empty((0, 0, 3))
        if system is not None and quantity == "lowest eigenvalue":
            with suppress(SingularMatrix):  # no mode is known; the shares of the energy will do
                modes = lowest(system, 1)[1]
        unknown = quantity == "lowest eigenvalue" and not len(modes)
        if system is None or quantity == "energy" or unknown:
            yield 0.5 * stiffness * free**2 + at_held(at.gradient_with_reactions)
            continue
        slope = _along(at.shape, modes[0], second=True) if len(modes) else _slope(at.shape, quantity, of)
        dual = at.space.to_vectors(system.solve(at.space.to_coordinates(slope)))
        shares = stiffness * free * missing(dual) + at_held(slope - _along(at.shape, dual))
        yield shares + sum(stiffness * missing(mode) ** 2 for mode in modes)


def _interpolation_error(coarse: Surface, field: Floats) -> Floats:
    """(n,3) the field at each new vertex less the mean of the ends of its edge; 0 at the others."""
    error = np.zeros_like(field)
    error[coarse.n :] = field[coarse.n :] - field[coarse.topology.edges].mean(axis=1)
    return error


def _slope(surface: Surface, quantity: str, of: str) -> Floats:
    """(n,3) the derivative of a quantity by the positions."""
    if quantity == "height":
        slope = np.zeros_like(surface.vertices)
        slope[summit(surface, surface.patch_index(of))[0]] = surface.plane.normal
        return slope
    if quantity in ("area", "volume"):
        return MEASURES[quantity].measure(surface, of or None).by_position
    acting = Forces.of(surface)
    share, halves, own = line_shares(acting, of.split(" near (")[0])
    if quantity == "reaction per length":
        return largest_pull(acting, own & acting.along_patch(None)).by_position
    # at its ends a curve has half the pulls on its own edges, and its share of the rest
    ends, size = surface.topology.edges, segment_lengths(surface.vertices, surface.topology.sides)
    direction = np.array(surface.plane.normal)
    if quantity == "thrust":
        force = share @ acting.along + (halves.sum(axis=1) * size) @ acting.pulls
        direction = surface.plane.along(force) / (np.linalg.norm(surface.plane.along(force)) or 1.0)
    freed = apply_supports(surface, np.tile(direction, (surface.n, 1)))
    # of Σ ⟨pull, f⟩ with f = Σ α ∂A - ⅓ Σ p A_T ν_T; A_T ν_T changes along u by (q - r) × u / 2, as the
    # corner opposite the side q, r moves
    pull = share[:, None] * (direction - freed)
    X, F = surface.vertices, surface.faces
    none = dict.fromkeys((p.name for p in surface.patches), 0.0)
    weights = surface.retensioned(pressures=none, snows=none)
    slope = _along(weights, pull)
    sixth = surface.net_pressures[surface.patch_of_face][:, None] / 6.0 * pull[F].sum(axis=1)
    for c in range(3):
        np.add.at(slope, F[:, c], -np.cross(X[F[:, c - 2]] - X[F[:, c - 1]], sixth))
    some = np.flatnonzero(halves.any(axis=1))
    along = np.einsum("es,esd->ed", halves[some], (direction - freed)[ends[some, ::-1]])
    sides, slopes, _ = pull_slopes(surface, ends[some], along)
    pulls = sides.pulls(X[sides.corners], *sides.laws(surface))
    stretch = np.einsum("sd,sd->s", pulls, along[sides.edge])[:, None]
    t = X[sides.corners[:, 2]] - X[sides.corners[:, 1]]
    length = np.linalg.norm(t, axis=1)[:, None]
    slopes *= length[:, None]
    slopes[:, 1] -= stretch * t / length
    slopes[:, 2] += stretch * t / length
    np.add.at(slope, sides.corners, slopes)
    return slope


def _along(surface: Surface, field: Floats, second: bool = False) -> Floats:
    """(n,3) the derivative of ∇E along a field, or the second one, by differences."""
    most = float(np.linalg.norm(field, axis=1).max())
    if most == 0.0:
        return np.zeros_like(field)
    step = (sqrt(STEP) if second else STEP) * surface.size / most
    shifts = (step, -step, 0.0) if second else (step, -step)
    places = (surface.vertices + s * field for s in shifts)
    ahead, back, *here = (energy_and_gradient(surface, X, supports=False)[1] for X in places)
    return (ahead + back - 2.0 * here[0]) / step**2 if second else (ahead - back) / (2.0 * step)
