"""The force of a cable: the part Σ ∫ (τ + g z) ds of E, τ its line tension and g its weight per length.

Along an edge of nodes x_i with shape functions N_i (``surface.lagrange``) x = Σ N_i x_i and x' = Σ N_i' x_i,
its direction is t = x'/|x'|, and z the height of x over Π, whose normal is n. With T = τ + g z,

    ∂/∂x_i = ∫ T N_i' t + g N_i |x'| n
    ∂²/∂x_i∂x_j = ∫ T N_i' N_j' (1 - t tᵀ) / |x'| + g (N_i N_j' n tᵀ + N_i' N_j t nᵀ)

over 0..1, and L has ∫ T₊ N_i' N_j' / |x'|, T₊ = τ + max(g z, 0). Of a straight edge from a to b, N' is -1 and
1, |x'| = |b - a| and z the height of its middle, N = ½. Where |x'| is 0 an edge has no direction and
contributes none of these. A cable pulls with T: in its plane, where nothing else acts, it hangs in the
catenary z + τ/g = c cosh(x/c). Where T ≤ 0 it is under compression.
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
    """Σ ∫ (τ + g z) ds at X (n,3).

    >>> from pcmc import Cable, Patch
    >>> high = Surface([[0, 0, 3], [4, 0, 3], [0, 3, 3]], [[0, 1, 2]], [0], [Patch("a", 1.0)], [0],
    ...                cables=[Cable("edge", 2.0, [[1, 2]], weight=0.5)])
    >>> [cable] = elements(high, high.vertices)
    >>> cable.value.tolist(), cable.gradient()[0, 0].round(9).tolist()
    ([17.5], [2.8, -2.1, 1.25])
    """
    if surface.cables:
        yield line_integrals(surface, X, *surface.cable_sides)


def line_integrals(surface: Surface, X: Floats, nodes: Ints, tension: Floats, weight: Floats) -> Elements:
    """∫ (τ + g z) ds of edges of nodes (c,p+1) with tensions τ (c,) and weights g (c,) at X (n,3)."""
    n, (N, slope, dt) = np.array(surface.plane.normal), side_shapes(nodes.shape[1] - 1)
    t, speed = along(X, nodes)
    inverse, lift = 1.0 / np.where(speed > 0.0, speed, np.inf), weight[:, None] * dt
    raised = lift * surface.plane.height(N @ X[nodes])
    pull = tension[:, None] * dt + raised

    def gradient() -> Floats:
        down = np.einsum("qi,cq->ci", N, lift * speed)[..., None] * n
        return np.asarray(down + np.einsum("qi,cqx->cix", slope, pull[..., None] * t))

    def hessian() -> Floats:
        across = np.eye(3) - t[..., :, None] * t[..., None, :]
        bent = np.einsum("qi,qj,cqxy->cijxy", slope, slope, (pull * inverse)[..., None, None] * across)
        lean = np.einsum("qi,qj,x,cqy->cijxy", N, slope, n, lift[..., None] * t)
        return np.asarray(bent + lean + lean.transpose(0, 2, 1, 4, 3))

    def stiffness() -> Floats:
        positive = tension[:, None] * dt + np.maximum(raised, 0.0)
        return np.asarray(np.einsum("qi,qj,cq->cij", slope, slope, positive * inverse))

    return Elements(nodes, (pull * speed).sum(axis=1), gradient, hessian, stiffness)


def along(X: Floats, nodes: Ints) -> tuple[Floats, Floats]:
    """Unit directions (c,q,3) and speeds |x'| (c,q) of edges of nodes (c,p+1) at X (n,3)."""
    x = side_shapes(nodes.shape[1] - 1)[1] @ X[nodes]
    speed = np.sqrt(np.einsum("cqx,cqx->cq", x, x))
    return x / np.where(speed > 0.0, speed, 1.0)[..., None], speed


def directions(X: Floats, ends: Ints) -> tuple[Floats, Floats]:
    """Unit directions (c,3) and lengths (c,) of edges (c,2) at X (n,3); zero without length."""
    t, length = along(X, ends)
    return t[:, 0], length[:, 0]


def cable_pulls(surface: Surface, X: Floats) -> Floats:
    """(c,) τ + g z̄, the pull of each edge of ``Surface.cable_edges`` at X (n,3), force."""
    ends, tension, weight = surface.cable_edges
    return np.asarray(tension + weight * surface.plane.height(X)[ends].mean(axis=1))


def pull_along(surface: Surface, cable: Cable, vertices: Ints) -> Floats:
    """(k,) τ + g z, the pull of a cable at the mean of some vertices (k,) or (k,2), force."""
    z = np.atleast_2d(surface.plane.height(surface.vertices)[vertices].T).mean(axis=0)
    return np.asarray(cable.tension + cable.weight * z)


def heavy_cable_pulls(surface: Surface) -> Floats:
    """(c,) τ + g z̄ of the edges of cables with a weight, force; infinite for others. ≤ 0 is compression."""
    return np.where(surface.cable_edges.weight != 0.0, cable_pulls(surface, surface.vertices), np.inf)


def laws_on(topo: Topology, surface: Surface) -> Floats:
    """(e,2) the line tension, force, and weight, force/length, on each edge of a topology.

    SurfaceError if a cable runs along an edge that is not there, so that nothing else acts on it.
    """
    ends, tension, weight = surface.cable_edges
    place = topo.edge_numbers(ends)
    alone = np.flatnonzero(place < 0)
    if len(alone):
        i, j = (int(v) for v in ends[alone[0]])
        message = f"the cable from vertex {i} to {j} runs where no patch has a tension or a pressure;"
        message += " give the patches there a tension, or remove the cable"
        raise SurfaceError(message, what="cables", where=(i, j))
    laws = np.zeros((len(topo.edges), 2))
    laws[place] = np.stack([tension, weight], axis=1)
    return laws
