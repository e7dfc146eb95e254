"""The force of a cable: the part Σ τ ℓ of E over edges with a line tension τ; gradient and Hessian block.

An edge from a to b has the length ℓ = |b - a| and the direction t = (b - a) / ℓ. Then

    ∂ℓ/∂b = t = -∂ℓ/∂a,     ∂²ℓ/∂b² = (1 - t tᵀ) / ℓ = ∂²ℓ/∂a² = -∂²ℓ/∂a∂b

An edge without length has no direction and contributes none of these.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.compiled import inlined
from ..base.errors import SurfaceError
from ..surface import Surface
from ..surface.geometry import norm, point, scaled, sub
from ..surface.parts import CableEdges
from ..surface.topology import Topology
from .triangles import Block


def add_cables(surface: Surface, X: Floats, gradient: Floats | None = None) -> float:
    """Σ τ ℓ at X (n,3), force·length; its gradient is added to ``gradient`` (n,3) if that is given.

    >>> from pcmc import Cable, Patch
    >>> right = Surface([[0, 0, 0], [4, 0, 0], [0, 3, 0]], [[0, 1, 2]], [0], [Patch("a", 1.0)], [0],
    ...                 cables=[Cable("edge", 2.0, [[1, 2]])])
    >>> forces = np.zeros((3, 3))
    >>> add_cables(right, right.vertices, forces), forces.tolist()[1]
    (10.0, [1.6, -1.2, 0.0])
    """
    ends, tension = surface.cable_edges
    return float((tension * add_pull(X, ends, tension, gradient)).sum()) if len(ends) else 0.0


def add_pull(X: Floats, ends: Ints, tension: Floats | float, gradient: Floats | None = None) -> Floats:
    """(c,) lengths of edges (c,2); the gradient of Σ τ ℓ is added to ``gradient`` (n,3) if that is given."""
    t, length = directions(X, ends)
    if gradient is not None:
        pull = np.broadcast_to(tension, len(ends))[:, None] * t
        np.add.at(gradient, ends[:, 1], pull)
        np.add.at(gradient, ends[:, 0], -pull)
    return length


def directions(X: Floats, ends: Ints) -> tuple[Floats, Floats]:
    """Unit directions (c,3) and lengths (c,) of edges (c,2) at X (n,3); zero without length."""
    side = X[ends[:, 1]] - X[ends[:, 0]]
    length = np.sqrt(np.einsum("ij,ij->i", side, side))
    return side / np.where(length > 0.0, length, 1.0)[:, None], length


@inlined
def cable_block(cables: CableEdges, X: Floats, e: int, hessian: float, stiffness: float) -> Block:
    """Of an end with itself; that of both ends with each other is the negative. The stiffness is τ/ℓ 1."""
    side = sub(point(X, cables.ends[e, 1]), point(X, cables.ends[e, 0]))
    length = norm(side)
    scale = 1.0 / length if length > 0.0 else 0.0
    pull = cables.tension[e] * scale
    return Block(-hessian * pull, scaled(scale, side), (hessian + stiffness) * pull)


def squared_cable_forces(surface: Surface) -> Floats:
    """(c,) τ² at both ends of each edge that pulls, added up, force²."""
    return np.asarray(2.0 * surface.cable_edges.tension**2)


def tensions_on(topo: Topology, cables: CableEdges) -> Floats:
    """(e,) the line tension on each edge of a topology, force.

    Raises
    ------
    SurfaceError : a cable runs along an edge that is not there, so that nothing else acts on it.
    """
    place = topo.edge_numbers(cables.ends)
    alone = np.flatnonzero(place < 0)
    if len(alone):
        i, j = (int(v) for v in cables.ends[alone[0]])
        message = (
            f"the cable from vertex {i} to {j} runs where no patch has a tension or a pressure;"
            " give the patches there a tension, or remove the cable"
        )
        raise SurfaceError(message, what="cables", where=(i, j))
    return np.bincount(place, cables.tension, len(topo.edges)).astype(float)
