"""Heights over a plan with given heights at its boundary: a loaded membrane, or a soap film."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import splu

from pcmc.base.arrays import Bools, Floats, Ints

ITERATIONS = 100


def membrane(plan: Floats, faces: Ints, held: Bools, heights: Floats, top: float) -> Floats:
    """(n,) heights z with -Δz = q over the plan, z given where held, and q such that max z = top.

    Linear finite elements on the plan's triangles.

    Parameters
    ----------
    plan : (n,2); faces : (m,3); held : (n,) bool; heights : (n,), used where held.
    top : height of the highest point, above every held one.

    >>> plan = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]])
    >>> faces = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    >>> membrane(plan, faces, np.arange(5) < 4, np.zeros(5), 3.0).tolist()
    [0.0, 0.0, 0.0, 0.0, 3.0]
    """
    stiffness, areas = _stiffness(np.column_stack([plan, np.zeros(len(plan))]), faces)
    free = ~held
    solver = splu(csc_array(stiffness[free][:, free]))
    z = np.where(held, heights, 0.0)
    z[free] = solver.solve(-stiffness[free][:, held] @ heights[held])
    load = np.bincount(faces.ravel(), np.repeat(areas / 3.0, 3), minlength=len(plan))
    lifted = solver.solve(load[free].astype(float))
    z[free] += ((top - z[free]) / lifted).min() * lifted
    return z


def soap_film(plan: Floats, faces: Ints, held: Bools, heights: Floats) -> Floats:
    """(n,) heights of the surface of least area over the plan, z given where held.

    Solves Σ (cot a + cot b)(z_i - z_j) = 0 repeatedly, with the cotangents of the last surface
    (Pinkall and Polthier 1993), until z changes by less than 1e-12 of its range.

    >>> plan = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]])
    >>> faces = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    >>> soap_film(plan, faces, np.arange(5) < 4, np.array([0, 2, 0, 2.0, 9.0])).round(9).tolist()
    [0.0, 2.0, 0.0, 2.0, 1.0]
    """
    free = ~held
    z = np.where(held, heights, 0.0)
    film = np.column_stack([plan, np.zeros(len(plan))])
    for _ in range(ITERATIONS):
        stiffness, _ = _stiffness(film, faces)
        film[:, 2] = z
        film[free, 2] = splu(csc_array(stiffness[free][:, free])).solve(
            -stiffness[free][:, held] @ z[held]
        )
        if np.abs(film[:, 2] - z).max() <= 1e-12 * np.ptp(z[held]):
            break
        z = film[:, 2].copy()
    return film[:, 2]


def _stiffness(X: Floats, faces: Ints) -> tuple[csc_array, Floats]:
    """Stiffness ∫ ⟨∇u, ∇v⟩ (n,n) on the triangles, and their areas (m,)."""
    opposite = X[faces[:, [2, 0, 1]]] - X[faces[:, [1, 2, 0]]]
    area = 0.5 * np.linalg.norm(np.cross(opposite[:, 0], opposite[:, 1]), axis=1)
    block = np.einsum("fic,fjc->fij", opposite, opposite) / (4.0 * area)[:, None, None]
    rows = np.broadcast_to(faces[:, :, None], block.shape).ravel()
    columns = np.broadcast_to(faces[:, None, :], block.shape).ravel()
    shape = (len(X), len(X))
    return coo_array((block.ravel(), (rows, columns)), shape=shape).tocsc(), area
