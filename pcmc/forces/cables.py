"""The force of a cable: the part Σ τ ℓ of E over edges with a line tension τ; gradient and Hessian block.

Along an edge of nodes x_i with shape functions N_i (``surface.lagrange``) x = Σ N_i x_i and x' = Σ N_i' x_i,
its direction is t = x'/|x'|, and

    ℓ = ∫ |x'|,     ∂ℓ/∂x_i = ∫ N_i' t,     ∂²ℓ/∂x_i∂x_j = ∫ N_i' N_j' (1 - t tᵀ) / |x'|

over 0..1, and L has τ N_i' N_j' / |x'|. Of a straight edge from a to b, N' is -1 and 1, and |x'| = |b - a|.
Where that is 0 an edge has no direction and contributes none of these.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.errors import SurfaceError
from ..surface import Surface
from ..surface.lagrange import side_shapes
from ..surface.parts import Cable
from ..surface.topology import Topology
from .elements import Elements


def elements(surface: Surface, X: Floats) -> Iterator[Elements]:
    """Σ τ ℓ at X (n,3).

    >>> from pcmc import Cable, Patch
    >>> right = Surface([[0, 0, 0], [4, 0, 0], [0, 3, 0]], [[0, 1, 2]], [0], [Patch("a", 1.0)], [0],
    ...                 cables=[Cable("edge", 2.0, [[1, 2]])])
    >>> [cable] = elements(right, right.vertices)
    >>> cable.value.tolist(), (cable.gradient() + 0.0).tolist()
    ([10.0], [[[1.6, -1.2, 0.0], [-1.6, 1.2, 0.0]]])
    """
    if surface.cables:
        yield lengths(X, surface.cable_sides.ends).times(surface.cable_sides.tension)


def lengths(X: Floats, nodes: Ints) -> Elements:
    """Σ ℓ over edges of nodes (c,p+1) at X (n,3)."""
    _, slope, weight = side_shapes(nodes.shape[1] - 1)
    t, speed = along(X, nodes)

    def hessian() -> Floats:
        bend = (weight * inverse(speed))[..., None, None] * across(t)
        return np.asarray(np.einsum("qi,qj,cqxy->cijxy", slope, slope, bend))

    def stiffness() -> Floats:
        return np.asarray(np.einsum("qi,qj,cq->cij", slope, slope, weight * inverse(speed)))

    def gradient() -> Floats:
        return np.asarray(np.einsum("qi,cqx->cix", slope, weight[:, None] * t))

    return Elements(nodes, speed @ weight, gradient, hessian, stiffness)


def along(X: Floats, nodes: Ints) -> tuple[Floats, Floats]:
    """Unit directions (c,q,3) and speeds |x'| (c,q) of edges of nodes (c,p+1) at X (n,3)."""
    x = side_shapes(nodes.shape[1] - 1)[1] @ X[nodes]
    speed = np.sqrt(np.einsum("cqx,cqx->cq", x, x))
    return x / np.where(speed > 0.0, speed, 1.0)[..., None], speed


def inverse(length: Floats) -> Floats:
    """1/ℓ; 0 without length."""
    return np.asarray(1.0 / np.where(length > 0.0, length, np.inf))


def across(t: Floats) -> Floats:
    """(…,3,3) 1 - t tᵀ of directions (…,3)."""
    return np.asarray(np.eye(3) - t[..., :, None] * t[..., None, :])


def directions(X: Floats, ends: Ints) -> tuple[Floats, Floats]:
    """Unit directions (c,3) and lengths (c,) of edges (c,2) at X (n,3); zero without length."""
    t, length = along(X, ends)
    return t[:, 0], length[:, 0]


def cable_pulls(surface: Surface, X: Floats) -> Floats:
    """(c,) τ + g z̄, the pull of each edge of ``Surface.cable_edges`` at X (n,3), force."""
    ends, tension, weight = surface.cable_edges
    if not weight.any():
        return np.asarray(tension)
    return np.asarray(tension + weight * surface.plane.height(X)[ends].mean(axis=1))


def pull_along(surface: Surface, cable: Cable, vertices: Ints) -> Floats:
    """(k,) τ + g z, the pull of a cable at the mean of some vertices (k,) or (k,2), force."""
    z = np.atleast_2d(surface.plane.height(surface.vertices)[vertices].T).mean(axis=0)
    return np.asarray(cable.tension + cable.weight * z)


def heavy_cable_pulls(surface: Surface) -> Floats:
    """(c,) τ + g z̄ of the edges of cables with a weight, force; infinite for others. ≤ 0 is compression."""
    return np.where(surface.cable_edges.weight != 0.0, cable_pulls(surface, surface.vertices), np.inf)


def squared_cable_forces(surface: Surface, X: Floats) -> Floats:
    """(c,) squared pulls at both ends of each edge, added up, force²."""
    return np.asarray(2.0 * cable_pulls(surface, X) ** 2)


def laws_on(topo: Topology, surface: Surface) -> Floats:
    """(e,2) the line tension, force, and weight, force/length, on each edge of a topology.

    SurfaceError if a cable runs along an edge that is not there, so that nothing else acts on it.
    """
    ends, tension, weight = surface.cable_edges
    place = topo.edge_numbers(ends)
    alone = np.flatnonzero(place < 0)
    if len(alone):
        i, j = (int(v) for v in ends[alone[0]])
        message = (
            f"the cable from vertex {i} to {j} runs where no patch has a tension or a pressure;"
            " give the patches there a tension, or remove the cable"
        )
        raise SurfaceError(message, what="cables", where=(i, j))
    laws = np.zeros((len(topo.edges), 2))
    laws[place] = np.stack([tension, weight], axis=1)
    return laws
