"""Quantities that a design can aim at, with exact derivatives.

A quantity q depends on the positions X and, some of them, on the tensions and pressures themselves:
dq = ⟨∂q/∂X, dX⟩ + Σ ∂q/∂α_i dα_i + Σ ∂q/∂p_i dp_i, and so on for weights and the tensions of cables.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats, Ints
from ..base.errors import OptionError
from ..certificate.cables import cable_ends
from ..certificate.reactions import support_forces
from ..energy import kernels
from ..energy.functional import gradient_by, weighted
from ..energy.second_variation import add_products
from ..energy.volume_below import volume_below_gradient, volumes_below
from ..surface import Surface
from ..surface.geometry import area_vectors, cross_2d, vertex_sums
from . import cable_quantities
from .lean import lean
from .measurement import Measurement


@dataclass(frozen=True)
class Measure:
    """How a quantity is measured, ``of`` as in ``Target``.

    Misfits are divided by its usual ``size`` where the value wanted is 0.
    """

    measure: Callable[[Surface, Any], Measurement]
    size: Callable[[Surface], float]


def _apex(surface: Surface, of: str | None) -> Measurement:
    """Greatest height over Π: that of the highest vertex, for triangles are flat."""
    top = int(vertices_up(surface, of)[-1])
    slope = np.zeros_like(surface.vertices)
    slope[top] = surface.plane.normal
    return Measurement(float(surface.plane.height(surface.vertices[top])), slope)


def vertices_up(surface: Surface, of: str | None) -> Ints:
    """The vertices of a patch, or of all under pressure, from the lowest over Π to the highest."""
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
        message = f"height at ({point[0]:g}, {point[1]:g}): no patch is over that point"
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
    areas, _, slope = weighted(surface, one)
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
    by_tension, by_pressure = np.zeros((2, len(surface.patches)))
    by_tension[index], by_pressure[index] = -p / (2.0 * alpha**2), 1.0 / (2.0 * alpha)
    return Measurement(float(p / (2.0 * alpha)), np.zeros_like(surface.vertices), by_tension, by_pressure)


def _pressure(surface: Surface, of: str) -> Measurement:
    """The pressure of the air in a room of prescribed volume, force/length²."""
    row = np.linalg.pinv(surface.room_signs.T)[room_index(surface, of)]
    rest, snow = np.zeros_like(surface.vertices), {"snow": np.zeros_like(row)}
    return Measurement(float(row @ surface.pressures), rest, by_pressure=row, by_load=snow)


def room_index(surface: Surface, name: str) -> int:
    """Index of the room called ``name``."""
    names = [room.name for room in surface.rooms]
    return names.index(validate.choice("room", name, names))


def _reaction(surface: Surface, of: str | None) -> Measurement:
    """max |f_v| / ℓ_v over the lines that hold a patch, ℓ_v half the length of the held edges at v.

    f_v = Σ α ∂A - ⅓ Σ p A_T ν_T over all triangles at v, and the forces of weights and of cables that run
    through v, as in the certificate's table of supports: at a corner the patches' pulls along their junction
    cancel, and cables that end there are apart. A vertex that slides takes only the force across its plane.
    Force/length.
    """
    acting = support_forces(surface)
    vertices = np.flatnonzero(acting.of_patch(None if of is None else surface.patch_index(of)))
    if not len(vertices):
        raise OptionError(f"reaction of {of}: nothing holds the edges of that patch", what="of", found=of)
    force, share = acting.along, acting.lengths
    size = np.linalg.norm(force[vertices], axis=1) / share[vertices]
    v, value = int(vertices[size.argmax()]), float(size.max())
    pull = force[v] / (float(np.linalg.norm(force[v])) or 1.0) / share[v]
    standing, topo = acting.standing, surface.topology
    ending = {cable.name: 0.0 for cable, vertex, _ in cable_ends(standing) if vertex == v}
    slope = _force_gradient(standing.retensioned(cables=ending), v, pull)
    ends = topo.edges[(acting.lines & (topo.edges == v)).any(axis=1)]
    side = surface.vertices[ends[:, 1]] - surface.vertices[ends[:, 0]]
    along = (0.5 * value / share[v] / np.linalg.norm(side, axis=1))[:, None] * side
    np.add.at(slope, ends[:, 0], along)
    np.add.at(slope, ends[:, 1], -along)
    by_tension, by_pressure = _force_by_patch(standing, v)
    by_load = {}
    for kind, parts in (("weight", surface.patches), ("cable", surface.cables)):
        slopes = np.array([gradient_by(surface, kind, i)[v] @ pull for i in range(len(parts))])
        apart = np.array([kind == "cable" and part.name in ending for part in parts], dtype=bool)
        by_load[kind] = np.where(apart, 0.0, slopes)
    return Measurement(value, slope, by_tension @ pull, by_pressure @ pull, by_load)


def _force_gradient(surface: Surface, v: int, pull: Floats) -> Floats:
    """(n,3) derivative of ⟨pull, f_v⟩, f_v = Σ α ∂A - ⅓ Σ p A_T ν_T at v with cables and weights."""
    around = np.flatnonzero((surface.faces == v).any(axis=1))
    F, patch = surface.faces[around], surface.patch_of_face[around]
    slope, unit = np.zeros_like(surface.vertices), np.zeros_like(surface.vertices)
    unit[v] = pull  # the second derivatives are symmetric
    mesh = kernels.energy_mesh(surface, pressure=0.0 * surface.pressures)
    add_products(surface, mesh._replace(faces=F, patch=patch), surface.vertices, unit, slope)
    # ⅓ A ν = (q - p) × (r - p) / 6, whose part along u changes by (q - r) × u / 6 as p moves
    X, sixth = surface.vertices, surface.net_pressures[surface.patch_of_face[around]] / 6.0
    for c in range(3):
        opposite = X[F[:, c - 2]] - X[F[:, c - 1]]
        np.add.at(slope, F[:, c], -sixth[:, None] * np.cross(opposite, pull))
    return slope


def _force_by_patch(surface: Surface, v: int) -> tuple[Floats, Floats]:
    """(k,3) derivatives of f_v by each patch's tension and pressure: ∇A_i and -⅓ Σ A_T ν_T at v."""
    by_tension, by_pressure = np.zeros((2, len(surface.patches), 3))
    for i in np.unique(surface.patch_of_face[(surface.faces == v).any(axis=1)]):
        one = np.zeros(len(surface.patches))
        one[i] = 1.0
        by_tension[i] = weighted(surface, one)[2][v]
        # not ∇V_i: at a boundary that includes the sides of the cone, which are no part of the surface
        pushes = area_vectors(surface.vertices[surface.faces]) / 3.0 * one[surface.patch_of_face, None]
        by_pressure[i] = -vertex_sums(pushes, surface.faces, surface.n)[v]
    return by_tension, by_pressure


def _chosen_patches(surface: Surface, of: str | None) -> Floats:
    """(k,) 1 for the chosen patches, 0 for the others."""
    if of is None:
        return surface.roof.astype(float)
    one = np.zeros(len(surface.patches))
    one[surface.patch_index(of)] = 1.0
    return one


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
    "lean": Measure(lean, lambda surface: 90.0),
    "sag": Measure(cable_quantities.sag, lambda surface: surface.size),
    "length": Measure(cable_quantities.length, lambda surface: surface.size),
    "force": Measure(
        cable_quantities.force, lambda surface: max(cable.tension for cable in surface.cables) or 1.0
    ),
    "reaction per length": Measure(_reaction, lambda surface: float(surface.tensions.max())),
}
