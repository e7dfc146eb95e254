"""Curved elements: Lagrange triangles of order p, whose nodes are the vertices of a subdivided triangle.

1→4 refinement cuts a triangle log₂ p times into p² small ones. Their (p+1)(p+2)/2 vertices, at barycentric
coordinates λ = l/p with whole numbers l, are the nodes of one element

    x(λ) = Σ N_l(λ) x_l,     N_l(λ) = Π_c Π_{s<l_c} (p λ_c - s) / (s + 1),

N_l the polynomial of degree p that is 1 at node l and 0 at all others. Order 1 is the flat triangle. In the
plane of (ξ, η) with λ = (1 - ξ - η, ξ, η), integrals are sums over points of a quadrature.
"""

from __future__ import annotations

from functools import cache
from math import ceil
from typing import Any, NamedTuple

import numpy as np

from ..base import validate
from ..base.arrays import Floats, Ints, read_only
from ..base.errors import PcmcError, SurfaceError
from .images import expect_no_images
from .topology import edge_places

ORDERS = (1, 2, 4, 8)


class Lattice(NamedTuple):
    """The nodes of an element, the corners first, and where the small triangles have them."""

    nodes: Ints  # (k,3) l = p λ
    first: Ints  # (k,) the first of all 3p² corners of the small triangles that is there
    node: Ints  # (p²,3) the node at each corner of the small triangles


class Shapes(NamedTuple):
    """The N_l and their derivatives at the q points of a quadrature, whose weights add up to ½."""

    value: Floats  # (q,k)
    along_u: Floats  # (q,k) ∂N/∂ξ
    along_v: Floats  # (q,k) ∂N/∂η
    weight: Floats  # (q,)


def known_order(order: Any, error: type[PcmcError] = SurfaceError) -> int:
    """The order, if there are such elements.

    >>> known_order(3)
    Traceback (most recent call last):
        ...
    pcmc.base.errors.SurfaceError: order: expected 1, 2, 4 or 8, found 3
    """
    if isinstance(order, bool) or not np.isscalar(order) or order not in ORDERS:
        validate.refuse("order", order, "1, 2, 4 or 8", error=error)
    return next(known for known in ORDERS if known == order)


def checked_order(given: object, F: Ints, patch: Ints) -> int:
    """The order, if small triangles (m,3) of the patches (m,) are parts of elements of that order."""
    order = known_order(given)
    if order > 1:
        element_nodes(F, order)
        mixed = np.flatnonzero(np.ptp(patch.reshape(-1, order**2), axis=1))
        if len(mixed):
            face = int(mixed[0]) * order**2
            message = f"order {order}: the element of the {order**2} faces from face {face} on"
            message += " is in two patches; give order=1 for flat triangles"
            raise SurfaceError(message, what="order", where=face, found=order)
    return order


def expect_flat(surface: Any, what: str) -> None:
    """Refuse a Surface of curved elements, or a periodic one, where ``what`` is about flat triangles alone.

    >>> from pcmc import Patch, Surface
    >>> flat = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("a", 1.0)], fixed=[0])
    >>> expect_flat(flat, "the panels")
    """
    expect_no_images(surface, what)
    if surface.order > 1:
        message = f"{what}: only for flat triangles, and the elements are of order {surface.order}; type"
        message += " order = 1 under [solve], or pass surface.rebuilt(order=1), the triangles that join the"
        message += " nodes"
        raise SurfaceError(message, what="order", found=surface.order, expected=1)


@cache
def lattice(order: int) -> Lattice:
    """The nodes of an element of order p.

    >>> lattice(2).node.tolist()
    [[0, 3, 4], [1, 5, 3], [2, 4, 5], [5, 4, 3]]
    """
    cut = order * np.eye(3, dtype=np.int64)[None]
    for _ in range(order.bit_length() - 1):  # as ``meshing.refinement`` numbers them
        a, b, c = cut[:, 0], cut[:, 1], cut[:, 2]
        bc, ca, ab = (b + c) // 2, (c + a) // 2, (a + b) // 2
        cut = np.stack([a, ab, ca, b, bc, ab, c, ca, bc, bc, ca, ab], axis=1).reshape(-1, 3, 3)
    places, first, node = np.unique(cut.reshape(-1, 3), axis=0, return_index=True, return_inverse=True)
    rank = np.lexsort((-places[:, 1], -places[:, 0], places.max(axis=1) < order))
    return Lattice(places[rank], first[rank], np.argsort(rank)[node].reshape(-1, 3))


def element_nodes(F: Ints, order: int) -> Ints:
    """(e,k) the nodes of the elements that the small triangles (m,3) are parts of, p² in a row each.

    SurfaceError if they are not such triangles.
    """
    here = lattice(order)
    whole = len(F) // order**2 * order**2
    corners = F[:whole].reshape(-1, 3 * order**2)
    nodes = corners[:, here.first]
    wrong = np.flatnonzero((nodes[:, here.node.ravel()] != corners).any(axis=1))
    if len(wrong) or whole < len(F):
        face = int(wrong[0]) * order**2 if len(wrong) else whole
        message = f"order {order}: the {order**2} faces from face {face} on are not one triangle cut by"
        message += " 1→4 refinement, in its order; give order=1 for flat triangles"
        raise SurfaceError(message, what="order", where=face, found=order)
    return read_only(np.ascontiguousarray(nodes))


@cache
def side_nodes(order: int) -> Ints:
    """(3,p+1) the nodes on each side of an element, from corner to corner; side k is opposite corner k.

    >>> side_nodes(2).tolist()
    [[1, 5, 2], [2, 4, 0], [0, 3, 1]]
    """
    nodes = lattice(order).nodes
    on = [np.flatnonzero(nodes[:, k] == 0) for k in range(3)]
    return np.stack([side[np.argsort(nodes[side, k - 1])] for k, side in enumerate(on)])


def sides_along(nodes: Ints, order: int, edges: Ints) -> Ints:
    """(s,p+1) the nodes of those sides of elements (e,k) whose small edges are all among ``edges`` (c,2)."""
    sides = nodes[:, side_nodes(order)].reshape(-1, order + 1)
    steps = np.sort(np.stack([sides[:, :-1], sides[:, 1:]], axis=2), axis=2)
    among = (edge_places(steps.reshape(-1, 2), edges) >= 0).reshape(-1, order).all(axis=1)
    sides = sides[among]
    return sides[np.unique(np.sort(sides[:, [0, -1]], axis=1), axis=0, return_index=True)[1]]


@cache
def side_shapes(order: int) -> tuple[Floats, Floats, Floats]:
    """(q,p+1) the N_l along a side and their derivatives by t in 0..1, at q points, and the weights (q,).

    >>> [values.tolist() for values in side_shapes(1)]
    [[[0.5, 0.5]], [[-1.0, 1.0]], [1.0]]
    """
    (t, dt), side = _gauss(order), side_nodes(order)[2]
    value, slope, _ = shape_functions(order, np.stack([1.0 - t, t, 0.0 * t], axis=1))
    return value[:, side], slope[:, side], dt


def _gauss(order: int) -> tuple[Floats, Floats]:
    """Gauss's points in 0..1 and their weights, exact for degree 3p - 2."""
    points, weight = np.polynomial.legendre.leggauss(ceil((3 * order - 1) / 2))
    return 0.5 * (1.0 + points), 0.5 * weight


def turned_over(F: Ints, order: int) -> Ints:
    """The small triangles (…,m,3) of elements turned over, in the order that elements have.

    >>> turned_over(np.array([[0, 3, 4], [1, 5, 3], [2, 4, 5], [5, 4, 3]]), 2).tolist()
    [[2, 5, 4], [1, 3, 5], [0, 4, 3], [3, 4, 5]]
    """
    here, places = lattice(order), lattice(order).nodes.tolist()
    mirror = [places.index(place[::-1]) for place in places]
    nodes = element_nodes(F.reshape(-1, 3), order)[:, mirror]
    return np.ascontiguousarray(nodes[:, here.node].reshape(F.shape))


def middles_of_sides(X: Floats, nodes: Ints, order: int) -> Floats:
    """(m,3,3) the points of elements (e,k) half way along the sides of their small triangles, by barycentric
    coordinates; side k is opposite corner k.

    >>> bow = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [1, 0, 1], [0, 1, 0], [1, 1, 0]])
    >>> middles_of_sides(bow, np.arange(6)[None], 2)[0, 2].tolist()
    [0.5, 0.0, 0.75]
    """
    corner = lattice(order).nodes[lattice(order).node]  # (p²,3,3)
    middle = (corner.sum(axis=1, keepdims=True) - corner) / (2.0 * order)
    value = shape_functions(order, middle.reshape(-1, 3))[0]
    return np.asarray(np.einsum("qk,ekd->eqd", value, X[nodes]).reshape(-1, 3, 3))


@cache
def shapes(order: int) -> Shapes:
    """The shape functions at points that integrate (x, x_ξ × x_η) exactly, of degree 3p - 2.

    Up to order 2 the rules of degree 1 and 5 that treat the corners alike (Radon 1948); above, Gauss's in ξ
    and in η/(1 - ξ), with Jacobi's weight (Stroud 1971).

    >>> [len(shapes(order).weight) for order in ORDERS]
    [1, 7, 36, 144]
    """
    if order == 1:
        points, weight = np.full((1, 3), 1.0 / 3.0), np.array([0.5])
    elif order == 2:
        root = np.sqrt(15.0)
        inner, outer = (6.0 - root) / 21.0, (6.0 + root) / 21.0
        rings = [np.full((3, 3), near) + (1.0 - 3.0 * near) * np.eye(3) for near in (inner, outer)]
        points = np.concatenate([np.full((1, 3), 1.0 / 3.0), *rings])
        weight = np.repeat([270.0, 155.0 - root, 155.0 + root], [1, 3, 3]) / 2400.0
    else:
        from scipy.special import roots_jacobi  # it takes long to import

        t, dt = _gauss(order)
        s, ds = roots_jacobi(len(t), 1, 0)
        xi, share = (grid.ravel() for grid in np.meshgrid(0.5 * (1.0 + s), t, indexing="ij"))
        points = np.stack([(1.0 - xi) * (1.0 - share), xi, (1.0 - xi) * share], axis=1)
        weight = 0.25 * np.outer(ds, dt).ravel()
    return Shapes(*(read_only(np.ascontiguousarray(a)) for a in (*shape_functions(order, points), weight)))


def shape_functions(order: int, points: Floats) -> tuple[Floats, Floats, Floats]:
    """(q,k) each: N and its derivatives along ξ and η, at barycentric coordinates (q,3).

    >>> [values.tolist() for values in shape_functions(1, np.array([[0.5, 0.25, 0.25]]))]
    [[[0.5, 0.25, 0.25]], [[-1.0, 1.0, 0.0]], [[-1.0, 0.0, 1.0]]]
    """
    value = np.ones((order + 1, *points.shape))  # Π_{s<l} (p λ_c - s) / (s + 1) for l = 0, 1, …, p
    slope = np.zeros_like(value)
    for s in range(order):
        factor = order * points - s
        value[s + 1] = value[s] * factor / (s + 1)
        slope[s + 1] = (slope[s] * factor + value[s] * order) / (s + 1)
    power, c = lattice(order).nodes, np.arange(3)
    parts = value[power, :, c]  # (k,3,q)
    by = slope[power, :, c] * parts[:, c - 1] * parts[:, c - 2]
    return parts.prod(axis=1).T, (by[:, 1] - by[:, 0]).T, (by[:, 2] - by[:, 0]).T
