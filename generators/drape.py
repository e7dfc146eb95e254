"""Heights for a roof whose edges are given: a membrane under an even load."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import splu

from pcmc.arrays import Bools, Floats, Ints


def drape(plan: Floats, faces: Ints, held: Bools, heights: Floats, top: float) -> Floats:
    """(n,) heights z with -Δz = q over the plan, z given where held, and q such that max z = top.

    Linear finite elements on the plan's triangles.

    Parameters
    ----------
    plan : (n,2); faces : (m,3); held : (n,) bool; heights : (n,), used where held.
    top : the height of the highest point, above that of every held one.

    >>> plan = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]])
    >>> faces = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    >>> drape(plan, faces, np.arange(5) < 4, np.zeros(5), 3.0).tolist()
    [0.0, 0.0, 0.0, 0.0, 3.0]
    """
    stiffness, load = _membrane(plan, faces)
    free = ~held
    solver = splu(csc_array(stiffness[free][:, free]))
    still = np.where(held, heights, 0.0)
    still[free] = solver.solve(-stiffness[free][:, held] @ heights[held])
    lifted = solver.solve(load[free])
    still[free] += ((top - still[free]) / lifted).min() * lifted
    return still


def _membrane(plan: Floats, faces: Ints) -> tuple[csc_array, Floats]:
    """Stiffness ∫ ⟨∇u, ∇v⟩ (n,n) and load ∫ v (n,)."""
    opposite = plan[faces[:, [2, 0, 1]]] - plan[faces[:, [1, 2, 0]]]
    a, b = opposite[:, 0], opposite[:, 1]
    twice = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    block = np.einsum("fic,fjc->fij", opposite, opposite) / (2.0 * twice)[:, None, None]
    rows = np.broadcast_to(faces[:, :, None], block.shape).ravel()
    columns = np.broadcast_to(faces[:, None, :], block.shape).ravel()
    n = len(plan)
    load = np.bincount(faces.ravel(), np.repeat(twice / 6.0, 3), minlength=n)
    stiffness = coo_array((block.ravel(), (rows, columns)), shape=(n, n)).tocsc()
    return stiffness, load.astype(float)
