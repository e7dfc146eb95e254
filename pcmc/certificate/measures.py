"""Quantities that a design can aim at, with exact derivatives.

A quantity q depends on the positions X and, some of them, on the tensions and pressures themselves:
dq = ⟨∂q/∂X, dX⟩ + Σ ∂q/∂α_i dα_i + Σ ∂q/∂p_i dp_i, and so on for weights and the tensions of cables.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import OptionError, SurfaceError
from ..forces.functional import by_rates, weighted
from ..forces.rooms import pressure_shares
from ..forces.volume_below import volume_below_gradient, volumes_below
from ..surface import Surface
from ..surface.geometry import area_vectors, cross_2d, segment_lengths
from ..surface.parts import Cable
from ..surface.values import part_index
from .cables import chord
from .forces import Forces, SheetSides
from .tables import lean_sines

TIE = 1e-6  # of a maximum's size: a change of parameters as small, relative, may bring another one to the top
TINY = 1e-30  # size of imaginary steps, whose squares vanish


class Branches(NamedTuple):
    """The quantities that a maximum is taken over: a row of derivatives for each."""

    by_position: csr_array  # (q,3n)
    by: Mapping[str, Floats] = {}  # (q,k) by kinds of values

    @classmethod
    def of(cls, vertices: Ints, slopes: Floats, n: int, by: Mapping[str, Floats] | None = None) -> Branches:
        """Branches whose derivatives are ``slopes`` (q,p,3) at the ``vertices`` (q,p)."""
        column = (3 * vertices[:, :, None] + np.arange(3)).ravel()
        row = np.repeat(np.arange(len(vertices)), 3 * vertices.shape[1])
        return cls(csr_array((slopes.ravel(), (row, column)), shape=(len(vertices), 3 * n)), by or {})


@dataclass(frozen=True, eq=False)
class Measurement:
    """A quantity's value, and its derivatives."""

    value: float
    by_position: Floats  # (n,3)
    by: Mapping[str, Floats] = field(default_factory=dict)  # (k,) by the kinds of values it depends on itself
    ties: Branches | None = None  # of a maximum, those that come within TIE of it, if there are several


class Measure(NamedTuple):
    """How a quantity is measured, ``of`` as in ``Target``, and its usual size, for misfits from 0."""

    measure: Callable[[Surface, Any], Measurement]
    size: Callable[[Surface], float]


def largest(values: Floats, size: float, branches: Callable[[Ints], Branches]) -> Measurement:
    """The largest of ``values``, of the usual ``size``; ``branches`` gives derivatives of some of them.

    OptionError where there are none."""
    if not len(values):
        raise OptionError("it has no triangles to measure: the wall is pinched all along", what="of")
    order = np.argsort(-values, kind="stable")
    near = order[values[order] >= values[order[0]] - TIE * size]
    found = branches(near)
    slope = found.by_position[[0]].toarray().reshape(-1, 3)
    first = {kind: rows[0] for kind, rows in found.by.items()}
    return Measurement(float(values[order[0]]), slope, first, found if len(near) > 1 else None)


def _apex(surface: Surface, of: str | None) -> Measurement:
    """Greatest height over Π: that of the highest vertex, for triangles are flat."""
    vertices = vertices_up(surface, of)
    up = np.array(surface.plane.normal)
    return largest(
        surface.plane.height(surface.vertices[vertices]),
        surface.size,
        lambda near: Branches.of(vertices[near, None], np.tile(up, (len(near), 1, 1)), surface.n),
    )


def vertices_up(surface: Surface, of: str | None) -> Ints:
    """The vertices of a patch, or of the roof, from the lowest over Π to the highest."""
    vertices = np.unique(surface.faces[_faces_of(surface, of)])
    return vertices[np.argsort(surface.plane.height(surface.vertices[vertices]))]


def _height(surface: Surface, point: tuple[float, float]) -> Measurement:
    """Height at which the normal of Π through a point of Π meets the highest triangle of the roof.

    A corner's displacement d raises the triangle's plane there by λ ⟨d, ν⟩ / ⟨ν, n⟩, with λ the
    corner's barycentric coordinate and ν, n the normals of triangle and Π.
    """
    F = surface.faces[_faces_of(surface, None)]
    corner = surface.plane.to_local(surface.vertices)[F]
    flat = corner[:, :, :2] - np.array(point)
    weight = cross_2d(flat[:, [1, 2, 0]], flat[:, [2, 0, 1]])
    twice = weight.sum(axis=1)
    upright = np.abs(twice) <= 1e-14 * surface.size**2
    weight /= np.where(upright, 1.0, twice)[:, None]
    over = np.flatnonzero((weight >= -1e-9).all(axis=1) & ~upright)
    if not len(over):
        message = f"height at ({point[0]:.12g}, {point[1]:.12g}): no patch is over that point"
        raise OptionError(message, what="of", found=point)
    heights = np.einsum("fc,fc->f", weight[over], corner[over, :, 2])
    face = over[heights.argmax()]
    normal = area_vectors(surface.vertices[F[face]])
    slope = np.zeros_like(surface.vertices)
    slope[F[face]] = weight[face][:, None] * (normal / (normal @ np.array(surface.plane.normal)))
    return Measurement(float(heights.max()), slope)


def _area(surface: Surface, of: str | None) -> Measurement:
    """A_i, length²."""
    one = _chosen_patches(surface, of)
    (areas, _, _), slope = weighted(surface, one)
    return Measurement(float(areas[one != 0.0].sum()), slope)


def _volume(surface: Surface, of: str | None) -> Measurement:
    """V_i as in ``volumes_below``, of one patch or of the roof, length³."""
    one = _chosen_patches(surface, of)
    return Measurement(float(volumes_below(surface)[one != 0.0].sum()), volume_below_gradient(surface, one))


def _curvature(surface: Surface, of: str) -> Measurement:
    """p / (2α), p net of snow, 1/length."""
    index = surface.patch_index(of)
    alpha, p = surface.tensions[index], surface.net_pressures[index]
    if surface.patches[index].weight:
        message = f"curvature of {of}: with a weight it differs from place to place; it has no single value"
        raise OptionError(message, what="of", found=of)
    if alpha == 0.0:
        raise OptionError(f"curvature of {of}: a wall without tension has none", what="of", found=of)
    one = _chosen_patches(surface, of)
    by = {"tensions": -p / (2.0 * alpha**2) * one, "pressures": one / (2.0 * alpha)}
    still = np.zeros_like(surface.vertices)
    return Measurement(float(p / (2.0 * alpha)), still, by | {"snows": -by["pressures"]})


def _pressure(surface: Surface, of: str) -> Measurement:
    """The pressure of the air in a room of prescribed volume, force/length²."""
    row = pressure_shares(surface)[part_index(surface, "volumes", of)]
    return Measurement(float(row @ surface.pressures), np.zeros_like(surface.vertices), {"pressures": row})


def _reaction(surface: Surface, of: str | None) -> Measurement:
    """The largest pull along an edge of the lines that hold a patch: |Σ (α + w z) n| of the sheets there.

    As in the certificate's table of supports; an edge that slides pulls across its plane. Force/length.
    """
    acting = Forces.of(surface)
    edges = acting.along_patch(None if of is None else surface.patch_index(of))
    if not edges.any():
        raise OptionError(f"reaction of {of}: nothing holds the edges of that patch", what="of", found=of)
    return largest_pull(acting, edges)


def largest_pull(acting: Forces, edges: Bools) -> Measurement:
    """The largest pull along some of the edges (e,) of a surface, force/length."""
    surface, numbers = acting.standing, np.flatnonzero(edges)
    pulls, patches = acting.pulls[numbers], len(surface.patches)
    sizes = np.linalg.norm(pulls, axis=1)

    def branches(near: Ints) -> Branches:
        ends = acting.surface.topology.edges[numbers[near]]
        unit = (pulls / np.where(sizes > 0.0, sizes, 1.0)[:, None])[near]
        s, slopes, by_law = pull_slopes(surface, ends, unit)
        sheet, one = Branches.of(s.corners, slopes, surface.n).by_position, np.arange(len(s.edge))
        together = csr_array((np.ones(len(one)), (s.edge, one)), shape=(len(near), len(one)))
        by = {
            kind: (together @ csr_array((values, (one, s.patch)), (len(one), patches))).toarray()
            for kind, values in zip(("tensions", "weights", "pressures"), by_law, strict=True)
        }
        return Branches(csr_array(together @ sheet), by | {"snows": -by["pressures"]})

    return largest(sizes, float(surface.tensions.max()), branches)


def pull_slopes(surface: Surface, ends: Ints, along: Floats) -> tuple[SheetSides, Floats, Floats]:
    """The sides at edges, and the derivatives of their pulls ⟨(α + w z) n, u⟩: (s,5,3) by their corners, and
    (3,s) by α, w and p.

    The edges are given by their ends (k,2), each with a vector u (k,3). Each derivative is the imaginary part
    over a small imaginary step, exact to rounding.
    """
    s = SheetSides.at(surface, ends)
    X, laws, u = surface.vertices[s.corners], s.laws(surface), along[s.edge]

    def slope(step: Any, by: int | None = None) -> Floats:
        moved, changed = X + (step if by is None else 0.0), [*laws]
        if by is not None:
            changed[by] = changed[by] + step
        found: Floats = (s.pulls(moved, *changed) * u).sum(axis=1).imag / TINY
        return found

    slopes = np.empty_like(X)
    for place in np.ndindex(X.shape[1:]):
        step = np.zeros(X.shape[1:], dtype=complex)
        step[place] = TINY * 1j
        slopes[:, *place] = slope(step)
    return s, slopes, np.array([slope(TINY * 1j, by) for by in range(len(laws))])


def _lean(surface: Surface, of: str | None) -> Measurement:
    """Largest angle of a wall's triangles from the vertical of Π, degrees; of all walls if ``of`` is None.

    θ = arcsin |s|, s = ⟨ν, n⟩, ν = N / |N|; N = (b - a) × (c - a) changes by da × (b - c) with the corner a,
    so ∂s/∂a = (b - c) × (n - s ν) / |N|. The largest of all θ and -θ: where walls are upright it has a kink.
    """
    walls = [surface.patch_index(of)] if of is not None else np.flatnonzero(surface.walls).tolist()
    if of is not None and not surface.walls[walls[0]]:
        raise OptionError(f"lean of {of}: that patch is under pressure; a wall can lean", what="of", found=of)
    if not walls:
        raise OptionError("lean: the surface has no walls", what="of", found=of)
    sines = np.where(np.isin(surface.patch_of_face, walls), lean_sines(surface), 0.0)
    signs = np.repeat([1.0, -1.0], surface.m)
    own = np.flatnonzero(np.tile(np.isin(surface.patch_of_face, walls), 2))
    if not len(own):
        name = "every wall" if of is None else f"{of}: the wall"
        raise SurfaceError(f"lean of {name} rests on Π all along, so it does not lean", what="of", found=of)

    def branches(near: Ints) -> Branches:
        sign, face = signs[own[near]], own[near] % surface.m
        s, corners = sines[face][:, None], surface.vertices[surface.faces[face]]
        normal = 2.0 * area_vectors(corners)
        length = np.linalg.norm(normal, axis=1)[:, None]
        length[length == 0.0] = np.inf  # a triangle without area has no slope
        across = (np.array(surface.plane.normal) - s * normal / length) / length
        rate = np.degrees(sign[:, None] / np.sqrt(np.maximum(1.0 - s * s, 1e-12)))
        sides = np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1)
        slopes = rate[:, :, None] * np.cross(sides, across[:, None])
        return Branches.of(surface.faces[face], slopes, surface.n)

    return largest(np.degrees(np.arcsin(np.clip(signs * np.tile(sines, 2), -1.0, 1.0)))[own], 90.0, branches)


def _sag(surface: Surface, of: str) -> Measurement:
    """The largest distance of a cable's vertices from its chord, the straight line between its two ends.

    With the chord from a to b and x at the share s of it, the distance along the unit vector e changes by
    ⟨e, dx - (1 - s) da - s db⟩.
    """
    order, both, share, out, size = chord(surface, of)
    distance = np.linalg.norm(out, axis=1)
    direction = out / np.where(distance > 0.0, distance, 1.0)[:, None]

    def branches(near: Ints) -> Branches:
        along, e = share[near][:, None], direction[near]
        ends = np.tile(both, (len(near), 1))
        slopes = np.stack([e, (along - 1.0) * e, -along * e], axis=1)
        return Branches.of(np.column_stack([order[near], ends]), slopes, surface.n)

    return largest(distance, size, branches)


def _length(surface: Surface, of: str) -> Measurement:
    """The length L of a cable."""
    cable, one = _chosen_cable(surface, of)
    length = segment_lengths(surface.vertices, cable.edges).sum()
    return Measurement(float(length), by_rates(surface, {"cables": one})[1])


def _force(surface: Surface, of: str) -> Measurement:
    """τ, the force in a cable: the same all along it."""
    cable, one = _chosen_cable(surface, of)
    if cable.weight:
        message = f"force of {of}: with a weight it differs along the cable; it has no single value"
        raise OptionError(message, what="of", found=of)
    return Measurement(cable.tension, np.zeros_like(surface.vertices), {"cables": one})


def _chosen_cable(surface: Surface, of: str) -> tuple[Cable, Floats]:
    """A cable, and 1 for it, 0 for the others (cables,)."""
    index = surface.cable_index(of)
    return surface.cables[index], np.eye(len(surface.cables))[index]


def _chosen_patches(surface: Surface, of: str | None) -> Floats:
    """(k,) 1 for the chosen patches, 0 for the others."""
    if of is None:
        return surface.roof.astype(float)
    return np.eye(len(surface.patches))[surface.patch_index(of)]


def _faces_of(surface: Surface, of: str | None) -> Bools:
    """(m,) faces of the patch, or of the roof."""
    return np.asarray(_chosen_patches(surface, of)[surface.patch_of_face] != 0.0)


MEASURES = {
    "apex": Measure(_apex, lambda surface: surface.size),
    "height": Measure(_height, lambda surface: surface.size),
    "volume": Measure(_volume, lambda surface: surface.size**3),
    "area": Measure(_area, lambda surface: surface.size**2),
    "curvature": Measure(_curvature, lambda surface: 1.0 / surface.size),
    "pressure": Measure(_pressure, lambda surface: float(surface.tensions.max()) / surface.size),
    "lean": Measure(_lean, lambda surface: 90.0),
    "sag": Measure(_sag, lambda surface: surface.size),
    "length": Measure(_length, lambda surface: surface.size),
    "force": Measure(_force, lambda surface: max(cable.tension for cable in surface.cables) or 1.0),
    "reaction per length": Measure(_reaction, lambda surface: float(surface.tensions.max())),
}
