"""Elements of higher order on the triangles of a mesh."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Bools, Floats
from ..base.errors import CurvedContactError, SurfaceError
from ..forces.pinching import standing_part
from ..surface import Surface, expect_surface
from ..surface.images import expect_no_images
from ..surface.lagrange import known_order, lattice
from .refinement import Projection, refine


def elevate(surface: Surface, order: int, project: Projection | None = None) -> Surface:
    """The surface with each flat triangle as an element of order 2, 4 or 8, to start a solver from.

    Its nodes are the vertices of ``refine(surface, log₂ order)``: on the curves of the boundary, and flat
    between them. Inside, they follow a curved edge ab as smoothly as it runs: with its distance from the
    chord written as t (1 - t) Q(2t - 1), t from a to b, the map of the element has

        x(λ) = x_flat(λ) + Σ_ab λ_a λ_b Q(λ_b - λ_a)       (Szabó and Babuška 1991).

    So its derivatives of each order k are O(h^k), which elements of order 4 and more need for their accuracy.

    Parameters
    ----------
    order : 2, 4 or 8.
    project : as for ``refine``, where fixed vertices lie on a curve that the surface does not carry.

    Raises
    ------
    SurfaceError : no such order, ``surface`` is of a higher order already, or a wall rests on Π.

    >>> from pcmc import Patch
    >>> flat = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("a", 1.0)], fixed=[0])
    >>> curved = elevate(flat, 2)
    >>> curved.order, curved.n, curved.nodes.tolist()
    (2, 6, [[0, 1, 2, 3, 4, 5]])
    """
    expect_surface(surface)
    expect_no_images(surface, "curved elements")
    order = known_order(order)
    if surface.order > 1:
        message = f"order: the surface is of order {surface.order} already; give order={surface.order}"
        raise SurfaceError(message, what="order", found=order, expected=surface.order)
    if standing_part(surface).resting.any():
        message = "order: a wall rests on the plane, and only flat triangles have contact; give order=1"
        raise CurvedContactError(message, what="order", found=order, expected=1)
    fine = refine(surface, order.bit_length() - 1, project).rebuilt(order=order)
    return fine.moved(blended(fine, fine.vertices, np.ones(fine.n, dtype=bool)))


def flat_places(surface: Surface, X: Floats) -> Floats:
    """(n,3) where the nodes would be if the elements were flat, with the same corners."""
    place = X.copy()
    place[surface.nodes] = lattice(surface.order).nodes / surface.order @ X[surface.nodes[:, :3]]
    return place


def blended(surface: Surface, X: Floats, on_curve: Bools) -> Floats:
    """X (n,3) with the nodes of elements on their flat triangles, but for those ``on_curve`` (n,).

    Inside an element the distances that nodes ``on_curve`` on its sides have from there are blended.
    """
    p, nodes, flat = surface.order, surface.nodes, flat_places(surface, X)
    share = lattice(p).nodes / p
    inside, moved = np.flatnonzero(share.min(axis=1) > 0.0), X.copy()
    away = np.where(on_curve[nodes, None], (X - flat)[nodes], 0.0)
    away[:, inside] = 0.0
    place = flat[nodes] + away
    for c in range(3):
        a, b = share[:, (c + 1) % 3], share[:, (c + 2) % 3]
        edge = np.flatnonzero((share[:, c] == 0.0) & (a * b > 0.0))
        known, wanted = (np.vander((b - a)[some], p - 1) for some in (edge, inside))
        weights = (a * b)[inside, None] * (wanted @ np.linalg.inv(known)) / (a * b)[edge]
        place[:, inside] += np.einsum("ij,ejd->eid", weights, away[:, edge])
    moved[nodes[:, 3:]] = place[:, 3:]
    return moved
