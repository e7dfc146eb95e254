"""The force of a cable: the part Σ τ ℓ of E over edges with a line tension τ; gradient and Hessian block.

An edge from a to b has the length ℓ = |b - a| and the direction t = (b - a) / ℓ. Then

    ∂ℓ/∂b = t = -∂ℓ/∂a,     ∂²ℓ/∂b² = (1 - t tᵀ) / ℓ = ∂²ℓ/∂a² = -∂²ℓ/∂a∂b

An edge without length has no direction and contributes none of these.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.errors import SurfaceError
from ..surface import Surface
from ..surface.parts import CableEdges
from ..surface.topology import Topology


class EdgeBlocks(NamedTuple):
    """Blocks of edges i → j: s t tᵀ + k 1 of an end with itself, -s t tᵀ - k 1 + [q]× of both."""

    ends: Ints  # (e,2) i and j
    t: Floats  # (e,3)
    s: Floats  # (e,)
    k: Floats  # (e,)
    q: Floats  # (e,3)


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


def cable_blocks(surface: Surface, X: Floats, hessian: float = 1.0, stiffness: float = 0.0) -> EdgeBlocks:
    """The blocks of all cables, of hessian · ∂²E + stiffness · L; L is τ/ℓ 1."""
    ends, tension = surface.cable_edges
    t, length = directions(X, ends)
    pull = tension / np.where(length > 0.0, length, np.inf)
    return EdgeBlocks(np.asarray(ends), t, -hessian * pull, (hessian + stiffness) * pull, 0.0 * t)


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
