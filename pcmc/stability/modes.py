"""Morse index and lowest modes: which motions lower the energy of a surface at rest.

The Hessian in the motion space is compared with the lumped area mass M (a third of the area around each
vertex): λ of  Bᵀ(∂²E)B s = λ M s  is the second variation per unit normal displacement, force/length³. The
number of negative λ is the Morse index; it is counted by inertia, without computing any of them.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh, null_space
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from ..base.arrays import Floats
from ..forces.motion_space import MotionSpace
from ..surface import Surface
from .equilibrium import Equilibrium, SecondVariation
from .factorisation import SingularMatrix

ALIKE = 1e-7  # of the largest eigenvalue that was computed: a difference of equal ones
DENSE = 40  # unknowns up to which all eigenvalues are computed at once


def descent_mode(surface: Surface) -> tuple[int, Floats]:
    """The Morse index of a surface at rest and its lowest mode (n,3); empty if there is no way down.

    Raises
    ------
    SingularMatrix : the second variation has no inertia that can be counted.
    """
    system = Equilibrium.of(surface).factorised()
    if system.negative == 0:
        return system.negative, np.empty((0, 3))
    return system.negative, lowest(system, 1)[1][0]


def all_modes(system: SecondVariation) -> tuple[Floats, Floats]:
    """All eigenvalues (k,), ascending, and their modes (N,k) of unit mass; for a few unknowns."""
    across = np.eye(len(system.of.mass))
    if system.of.excluded.shape[1]:
        across = null_space(system.of.excluded.T)
    if not across.shape[1]:
        return np.empty(0), across
    H, M = system.matrix.toarray(), np.diag(system.of.mass)
    values, vectors = eigh(across.T @ H @ across, across.T @ M @ across)
    return values, across @ vectors


def _settled(values: Floats, vectors: Floats, space: MotionSpace, root: Floats) -> Floats:
    """The eigenvectors (s,k), those of equal eigenvalues as the projections of fixed displacements.

    Any basis of their space is as good, and rounding alone would choose one: a symmetric saddle would lean
    to another side on each processor. ``root`` (s,) are the roots of the masses.
    """
    vectors = vectors.copy()
    ends = np.flatnonzero(np.diff(values) > ALIKE * np.abs(values).max(initial=0.0)) + 1
    for group in np.split(np.arange(len(values)), ends):
        if len(group) > 1:
            wave = np.arange(3 * len(space.dimension)).reshape(-1, 3)
            fixed = [space.to_coordinates(np.cos((1.618 + k) * wave)) for k in range(len(group))]
            shares = vectors[:, group].T @ (root * np.array(fixed)).T
            basis, upper = np.linalg.qr(shares)
            vectors[:, group] = vectors[:, group] @ (basis * np.where(np.diag(upper) < 0.0, -1.0, 1.0))
    return vectors


def lowest(system: SecondVariation, count: int) -> tuple[Floats, Floats]:
    """The ``count`` eigenvalues (k,) nearest zero, ascending, and their modes (k,n,3).

    The search takes in all negative ones, so the first is the lowest of all. Modes have unit mass:
    Σ M |v|² = 1. Rigid motions are left out; rooms keep their prescribed volumes. The factor may be that of
    A - σM for a small σ; the eigenvalues are those of A.

    Raises
    ------
    SingularMatrix : the iteration does not converge.
    """
    size, root = len(system.of.mass), np.sqrt(system.of.mass)
    k = max(count + 1, system.negative + 2)
    while True:
        values, vectors = _dense(system, k) if max(2 * k, DENSE) >= size else _nearest(system, k)
        # one more than are wanted, and all negative ones: these may be farther from zero than positive ones
        whole = len(values) <= count or values[-1] - values[count - 1] > ALIKE * np.abs(values).max()
        if len(values) < k or (whole and np.count_nonzero(values < 0.0) >= system.negative):
            break
        k *= 2
    vectors = _settled(values, root[:, None] * vectors, system.of.space, root)
    fields = [system.of.space.to_vectors(vector / root) for vector in vectors.T[:count]]
    return values[:count], np.array(fields).reshape(len(fields), len(system.of.space.dimension), 3)


def _dense(system: SecondVariation, k: int) -> tuple[Floats, Floats]:
    values, vectors = all_modes(system)
    return values[:k], vectors[:, :k]


def _nearest(system: SecondVariation, k: int) -> tuple[Floats, Floats]:
    """The k eigenvalues nearest the factor's shift, ascending, and their modes (N,k) of unit mass."""
    size, root = len(system.of.mass), np.sqrt(system.of.mass)

    def inverse(x: Floats) -> Floats:
        return root * system.solve(root * x)

    operator = LinearOperator((size, size), inverse, dtype=float)
    start = inverse(np.cos(np.arange(size) * 1.618))  # always the same, so that runs repeat
    try:
        vectors = eigsh(operator, k=k, which="LM", v0=start)[1] / root[:, None]
    except ArpackError as error:
        raise SingularMatrix(f"the eigenvalues did not converge ({error})") from None
    values = np.einsum("ik,ik->k", vectors, system.matrix @ vectors)
    order = np.argsort(values)
    return values[order], vectors[:, order]
