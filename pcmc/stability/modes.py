"""Morse index, lowest modes and soft motions: which motions lower the energy of a surface at rest.

The Hessian in the motion space is compared with the lumped area mass M (a third of the area around each
vertex): λ of  Bᵀ(∂²E)B s = λ M s  is the second variation per unit normal displacement, force/length³. The
number of negative λ is the Morse index; it is counted by inertia, without computing any of them.

A motion v is soft if |v·A v| ≤ band · Σ α |v|² dA: beside the tension α of what it moves. The counts are
those of the pencil A s = λ N s, N the lumped area times each triangle's tension: the negative eigenvalues of
A - band·N and of A + band·N are those below ±band. With σ = near · max α, near ≥ band, A - σM is not above
A - band·N: where it has no negative eigenvalue, none is negative nor soft.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh, null_space
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from ..base.arrays import Floats
from ..base.tolerances import NEAR_NEUTRAL, SAME_EIGENVALUE
from ..surface import Surface
from .equilibrium import Equilibrium, SecondVariation
from .factorisation import SingularMatrix

DENSE = 40  # unknowns up to which all eigenvalues are computed at once
CELL_TOLERANCE = 1e-12  # of the eigenvalues of a periodic surface's inverse


@dataclass(frozen=True)
class Spectrum:
    """Counts of eigenvalues."""

    index: int | None = None  # of the negative ones; None where rounding hides it
    below: int | None = None  # of those that are negative and not soft; None where rounding hides it
    soft: int = 0  # of the soft ones
    near: int = 0  # of those in a wider band
    hidden: str = ""  # what else of it could not be computed, as a sentence

    @property
    def unknown(self) -> bool:
        """Whether something is missing that decides about stability."""
        return self.below is None or bool(self.hidden)


def clear_of_zero(at: Equilibrium) -> SecondVariation | None:
    """A - σM with σ = near · max α, factorised, if nothing is negative or near; None otherwise."""
    above = _factorised(at, _wide(at, NEAR_NEUTRAL / at.shape.size**2))
    return above if above is not None and above.negative == 0 else None


def _wide(at: Equilibrium, near: float) -> Floats:
    return near * at.surface.tensions.max(initial=0.0) * at.mass


def count_soft(
    at: Equilibrium, band: float, near: float, clear: SecondVariation | None = None
) -> tuple[Spectrum, SecondVariation | None]:
    """The counts for two bands in units of α, 1/length², and a factor for the modes; None if there is none.

    One factorisation where nothing is near or negative, two where nothing is near, else up to seven.
    """
    wide = _wide(at, near)
    above = clear or _factorised(at, wide)
    if above is not None and above.negative == 0:
        return Spectrum(0, 0), above
    below = _factorised(at, -wide)
    if above is not None and below is not None and above.negative == below.negative:
        return Spectrum(below.negative, below.negative), below
    least, most = _between(at, near)
    near_count = 0 if least is None or most is None else most - least
    down, up = _between(at, band)
    here = _factorised(at, 0.0)  # the last: it has the modes
    index = None if here is None else here.negative
    if down is None or up is None:
        return Spectrum(index), here
    index = down if down == up else index
    return Spectrum(index, down, up - down, near_count), here or _factorised(at, wide)


def _between(at: Equilibrium, band: float) -> tuple[int, int] | tuple[None, None]:
    """The negative eigenvalues of A + band·N, and those of A - band·N; None where rounding hides one."""
    ends = [_factorised(at, shift * at.tension_mass) for shift in (-band, band)]
    return (None, None) if ends[0] is None or ends[1] is None else (ends[0].negative, ends[1].negative)


def _factorised(at: Equilibrium, shift: Floats | float) -> SecondVariation | None:
    try:
        return at.factorised(shift)
    except SingularMatrix:
        return None


def descent_mode(surface: Surface) -> tuple[int, Floats]:
    """The Morse index of a surface at rest and its lowest mode (n,3); empty if there is no way down.

    SingularMatrix if the second variation has no inertia that can be counted.
    """
    system = Equilibrium.of(surface).factorised()
    if system.negative == 0:
        return system.negative, np.empty((0, 3))
    return system.negative, lowest(system, 1)[1][0]


def lowest(system: SecondVariation, count: int) -> tuple[Floats, Floats]:
    """The ``count`` eigenvalues (k,) nearest zero, ascending, and their modes (k,n,3).

    The search takes in all negative ones, so the first is the lowest of all. Modes have unit mass:
    Σ M |v|² = 1. Rigid motions are left out; rooms keep their prescribed volumes. The factor may be that of
    A - σM for a small σ; the eigenvalues are those of A. SingularMatrix if the iteration does not converge.
    """
    size, root = len(system.of.mass), np.sqrt(system.of.mass)
    k = max(count + 1, system.negative + 2)
    while True:
        if max(2 * k, DENSE) < size:
            values, vectors = _nearest(system, k)
        else:
            excluded = system.of.excluded
            across = null_space(excluded.T) if excluded.shape[1] else np.eye(size)
            H = across.T @ system.matrix.toarray() @ across
            M = across.T @ np.diag(system.of.mass) @ across
            values, vectors = eigh(H, M) if len(H) else (np.empty(0), H)
            values, vectors = values[:k], across @ vectors[:, :k]
        # one more than are wanted, and all negative ones: these may be farther from zero than positive ones
        rounding = SAME_EIGENVALUE * np.abs(values).max(initial=0.0)
        whole = len(values) <= count or values[-1] - values[count - 1] > rounding
        if len(values) < k or (whole and np.count_nonzero(values < 0.0) >= system.negative):
            break
        k *= 2
    # of equal eigenvalues the modes are the projections of fixed displacements: rounding alone would choose a
    # basis of their space, another one on each processor
    space, vectors = system.of.space, root[:, None] * vectors
    ends = np.flatnonzero(np.diff(values) > SAME_EIGENVALUE * np.abs(values).max(initial=0.0)) + 1
    for group in np.split(np.arange(len(values)), ends):
        if len(group) > 1:
            wave = np.arange(3 * len(space.dimension)).reshape(-1, 3)
            fixed = [space.to_coordinates(np.cos((1.618 + k) * wave)) for k in range(len(group))]
            shares = vectors[:, group].T @ (root * np.array(fixed)).T
            basis, upper = np.linalg.qr(shares)
            vectors[:, group] = vectors[:, group] @ (basis * np.where(np.diag(upper) < 0.0, -1.0, 1.0))
    fields = [space.to_vectors(vector / root) for vector in vectors.T[:count]]
    return values[:count], np.array(fields).reshape(len(fields), len(space.dimension), 3)


def _nearest(system: SecondVariation, k: int) -> tuple[Floats, Floats]:
    """The k eigenvalues nearest the factor's shift, ascending, and their modes (N,k) of unit mass."""
    size, root = len(system.of.mass), np.sqrt(system.of.mass)

    def inverse(x: Floats) -> Floats:
        return root * system.solve(root * x)

    operator = LinearOperator((size, size), inverse, dtype=float)
    start = inverse(np.cos(np.arange(size) * 1.618))  # always the same, so that runs repeat
    # in cells, whose translations are left out, rounding may let no vector converge to the last digit
    tolerance = CELL_TOLERANCE if system.of.surface.periodic else 0.0
    try:
        vectors = eigsh(operator, k=k, which="LM", v0=start, tol=tolerance)[1] / root[:, None]
    except ArpackError as error:
        raise SingularMatrix(f"the eigenvalues did not converge ({error})") from None
    values = np.einsum("ik,ik->k", vectors, system.matrix @ vectors)
    order = np.argsort(values)
    return values[order], vectors[:, order]
