"""The elements that areas and volumes are summed over, and all other forces, as sums over elements, too.

A force is one file with a function of a surface and positions X (n,3) that yields ``Elements``; listed in
``functional.FORCES`` it is part of the energy, its gradient, the assembled matrices and their products.

The order of the elements is a parameter: k vertices each, 1 for a point, 2 for an edge, 6 for a quadratic
triangle. The pattern must have all pairs of vertices of an element (``pattern.pattern_of``). Flat triangles
are by far the most: their blocks are made within the loops of ``second_variation``, and not kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from ..base.arrays import Floats, Ints, kept_with_owner, read_only
from ..surface import Surface
from ..surface.lagrange import Shapes, shapes


class Mesh(NamedTuple):
    """Elements with the weights of their energy, as one argument of compiled loops; positions are another."""

    faces: Ints  # (e,k) nodes: of flat triangles the corners
    rows: Ints  # (e,k) the vertices that these are images of, or the same: where forces and blocks belong
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

    def part(self, first: int, last: int) -> Mesh:
        """Elements first..last alone."""
        faces, rows = self.faces[first:last], self.rows[first:last]
        return self._replace(faces=faces, rows=rows, patch=self.patch[first:last])


@kept_with_owner
def energy_mesh(surface: Surface) -> Mesh:
    """All elements of a surface, with its own tensions, net pressures and weights."""
    ground, normal = np.array(surface.plane.point), np.array(surface.plane.normal)
    nodes, of_elements = surface.nodes, shapes(surface.order)
    rows = surface.topology.faces if surface.periodic else nodes
    patch = read_only(np.ascontiguousarray(surface.patch_of_face[:: surface.order**2]))
    laws = surface.tensions, surface.net_pressures, surface.weights
    return Mesh(nodes, rows, patch, surface.origin, *laws, ground, normal, of_elements)


class Points(NamedTuple):
    """All elements at the points of the quadrature: one for a flat triangle, its middle."""

    place: Floats  # (e,q,3) x
    along_u: Floats  # (e,q,3) x_ξ
    along_v: Floats  # (e,q,3) x_η
    area: Floats  # (e,q,3) ν dA: the weight times x_ξ × x_η, length²

    @classmethod
    def of(cls, mesh: Mesh, X: Floats) -> Points:
        """Those of the elements with their nodes at X (n,3)."""
        (N, Nu, Nv, weight), nodes = mesh.shapes, X[mesh.faces]
        x, u, v = (np.einsum("qk,ekd->eqd", shape, nodes) for shape in (N, Nu, Nv))
        return cls(x, u, v, weight[:, None] * np.cross(u, v))


class Elements(NamedTuple):
    """Elements of k vertices x_0, x_1, … each, at some positions."""

    vertices: Ints  # (e,k)
    value: Floats  # (e,) energy
    gradient: Callable[[], Floats]  # (e,k,3) ∂/∂x_i, computed when asked for like those below
    hessian: Callable[[], Floats]  # (e,k,k,3,3) ∂²/∂x_i∂x_j
    stiffness: Callable[[], Floats] | None = None  # (e,k,k) multiples of 1 in L; None where there are none


def add_values(forces: Iterable[Elements], gradient: Floats | None = None) -> float:
    """The energy of all elements; their gradient is added to ``gradient`` (n,3) if that is given."""
    energy = 0.0
    for force in forces:
        energy += float(force.value.sum())
        if gradient is not None:
            np.add.at(gradient, force.vertices, force.gradient())
    return energy


def add_hessian_products(forces: Iterable[Elements], d: Floats, change: Floats) -> None:
    """Add (∂²E) d to ``change`` (n,3), for a motion d (n,3)."""
    for force in forces:
        each = np.einsum("eijxy,ejy->eix", force.hessian(), d[force.vertices])
        np.add.at(change, force.vertices, each)
