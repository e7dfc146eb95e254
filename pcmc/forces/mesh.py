"""The elements that areas and volumes are summed over, with the weights of their energy."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..base.arrays import Floats, Ints, read_only
from ..surface import Surface
from ..surface.lagrange import Shapes, shapes


class Mesh(NamedTuple):
    """Elements with the weights of their energy, as one argument of compiled loops; positions are another."""

    faces: Ints  # (e,k) nodes: of flat triangles the corners
    patch: Ints  # (e,) of each element
    origin: Floats  # (3,) the reference point of volumes
    tension: Floats  # (k,) α of each patch; p and w below
    pressure: Floats
    weight: Floats
    ground: Floats  # (3,) a point of Π, and its normal: weights act along it
    normal: Floats
    shapes: Shapes  # of curved elements

    @property
    def curved(self) -> bool:
        """Whether the elements are no flat triangles."""
        return self.faces.shape[1] > 3

    def weighing(self, weight: Floats | None = None) -> Mesh:
        """With these weights alone, no tension and no pressure; None for no weights, and both as they are."""
        none = read_only(np.zeros_like(self.tension))
        if weight is None:
            return self._replace(weight=none)
        return self._replace(tension=none, pressure=none, weight=read_only(weight.view()))


def energy_mesh(surface: Surface, tension: Floats | None = None, pressure: Floats | None = None) -> Mesh:
    """All elements of a surface, with its own tensions and pressures (k,) or with others."""
    of_elements = shapes(surface.order)
    tension = surface.tensions if tension is None else read_only(tension)
    pressure = surface.net_pressures if pressure is None else read_only(pressure)
    plane = np.array(surface.plane.point), np.array(surface.plane.normal)
    patch = read_only(np.ascontiguousarray(surface.patch_of_face[:: surface.order**2]))
    return Mesh(surface.nodes, patch, surface.origin, tension, pressure, surface.weights, *plane, of_elements)


class Points(NamedTuple):
    """All elements at the points of the quadrature: one for a flat triangle, its middle."""

    place: Floats  # (e,q,3) x
    along_u: Floats  # (e,q,3) x_ξ
    along_v: Floats  # (e,q,3) x_η
    area: Floats  # (e,q,3) ν dA: the weight times x_ξ × x_η, length²

    @classmethod
    def of(cls, mesh: Mesh, X: Floats) -> Points:
        """Those of the elements with their nodes at X (n,3)."""
        N, Nu, Nv, weight = mesh.shapes
        x, u, v = (np.einsum("qk,ekd->eqd", shape, X[mesh.faces]) for shape in (N, Nu, Nv))
        return cls(x, u, v, weight[:, None] * np.cross(u, v))
