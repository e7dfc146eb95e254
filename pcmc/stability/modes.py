"""Morse index and lowest modes: which motions lower the energy of a surface at rest.

The Hessian in the motion space is compared with the lumped area mass M (a third of the area around each
vertex): λ of  Bᵀ(∂²E)B s = λ M s  is the second variation per unit normal displacement, force/length³. The
number of negative λ is the Morse index; it is counted by inertia, without computing any of them.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import eigh, null_space
from scipy.sparse import csr_array, triu
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from ..base.arrays import Floats
from ..contact.pinching import standing_part
from ..forces.motion_space import MotionSpace, VertexClasses, motion_space
from ..forces.pattern import Pattern, hessian_pattern
from ..forces.rigid_motions import rigid_modes, rigid_motions
from ..forces.rooms import volume_columns
from ..forces.second_variation import assemble
from ..surface import Surface
from ..surface.geometry import face_areas, vertex_area_vectors
from .factorisation import Factor, Factoriser, SingularMatrix, factoriser

STRONG = 1e-6  # of the largest tension: where all are at least this, factors need no units
TINY = float(np.finfo(float).tiny)
ALIKE = 1e-7  # of the largest eigenvalue that was computed: a difference of equal ones
CLOSE = 1e-12  # cosine of Q and H⁻¹Q: below, rounding may have chosen its sign
DENSE = 40  # unknowns up to which all eigenvalues are computed at once
SOFT = 1e-9  # of the stiffness BᵀLB, added where a matrix is singular


@dataclass(frozen=True, eq=False)
class Stiffness:
    """Bᵀ(∂²E)B of a surface, factorised, with the rigid motions set apart.

    Attributes
    ----------
    space : the motion space that B is the basis of.
    matrix : (N,N) sparse symmetric Bᵀ(∂²E)B.
    mass : (N,) lumped area, length².
    factor : its factorisation, or that of the matrix less a shift.
    excluded : (N,k) unit columns; only motions across all of them count. See ``excluded_columns``.
    negative : number of negative eigenvalues among these motions; of a shifted matrix, those below the shift.
    """

    space: MotionSpace
    matrix: csr_array
    mass: Floats
    factor: Factor
    excluded: Floats
    negative: int

    @cached_property
    def _behind(self) -> Floats:
        return self.factor.solve(self.excluded)

    def solve(self, right: Floats) -> Floats:
        """The inverse (N,) among the motions that count: with none of the excluded ones."""
        y, Q = self.factor.solve(right), self.excluded
        if Q.shape[1]:
            y = y - self._behind @ np.linalg.solve(Q.T @ self._behind, Q.T @ y)
        return y


def strength_units(surface: Surface, classes: VertexClasses, space: MotionSpace) -> Floats | None:
    """(N,) 1/√α of the tension around each unknown, as powers of two; None if all are of one order.

    Factorised in these units, a patch that pulls far less than another still counts.
    """
    tension = surface.tensions[np.unique(classes.patch_of_face)]
    if not len(tension) or tension.min() >= STRONG * tension.max():
        return None
    strongest = np.zeros(surface.n)
    np.maximum.at(strongest, classes.faces, surface.tensions[classes.patch_of_face, None])
    unknown = np.repeat(strongest, space.dimension)
    return np.asarray(2.0 ** -np.round(0.5 * np.log2(unknown)))


def full_matrix(pattern: Pattern, data: Floats) -> csr_array:
    """The symmetric matrix (N,N) whose upper triangle has these values in the pattern."""
    upper = pattern.matrix(data)
    return csr_array(upper + triu(upper, k=1).T)


def lumped_mass(space: MotionSpace, classes: VertexClasses, X: Floats) -> Floats:
    """(N,) a third of the area of the active triangles around each unknown's vertex, length²."""
    return np.repeat(vertex_area_vectors(X, classes.faces)[1] / 3.0, space.dimension)


def excluded_columns(surface: Surface, space: MotionSpace, rigid: Floats, X: Floats) -> Floats:
    """(N,k) the rigid motions given, and the unit gradients of the volumes that rooms prescribe.

    Motions that cross all of them deform the surface and keep the volumes. A volume that no motion changes
    excludes none.
    """
    if not surface.rooms:
        return rigid
    columns = volume_columns(surface, space, X)
    length = np.linalg.norm(columns, axis=0)
    return np.hstack([rigid, columns[:, length > 0.0] / length[length > 0.0]])


def negatives_without(factor: Factor, columns: Floats) -> int:
    """Negative eigenvalues on the complement of the columns (N,k).

    Haynsworth: the bordered matrix [[H, Q], [Qᵀ, 0]] has the inertia of H restricted to the
    complement plus (k, k), and that of H plus that of -QᵀH⁻¹Q.

    Raises
    ------
    SingularMatrix : the inertia of H, or that of QᵀH⁻¹Q, is hidden by rounding.
    """
    k = columns.shape[1]
    if not k:
        return factor.negative
    solved = factor.solve(columns)
    # a rigid motion costs nothing, so its entries are far larger than those of a volume
    size = np.sqrt(np.linalg.norm(solved, axis=0)) + TINY
    small = (columns.T @ solved) / np.outer(size, size)
    values = np.linalg.eigvalsh(0.5 * (small + small.T))
    if not np.abs(values).min() > CLOSE:
        raise SingularMatrix("the second variation is singular among the motions that keep the volumes")
    positive = int((values > 0.0).sum())
    return factor.negative + positive - k


@dataclass(frozen=True, eq=False)
class SecondVariation:
    """A = Bᵀ(∂²E)B of a surface at its positions, to be factorised at shifts.

    Motions that cost no energy at all make it singular, such as sliding a vertex inside a flat part
    that rests on Π. Then a little of the stiffness BᵀLB is added: such motions do not lower the energy.
    Where rooms prescribe volumes, only motions that keep them count.

    Attributes
    ----------
    surface, classes, space : what it is the second variation of.
    mass : (N,) lumped area M, length².
    excluded : (N,k) unit columns; only motions across all of them count. See ``excluded_columns``.
    """

    surface: Surface
    classes: VertexClasses
    space: MotionSpace
    mass: Floats
    excluded: Floats
    pattern: Pattern
    solver: Factoriser

    @classmethod
    def of(
        cls,
        surface: Surface,
        classes: VertexClasses,
        space: MotionSpace,
        rigid: Floats,
        backend: str | None = None,
    ) -> SecondVariation:
        """That of a surface, with the rigid motions (N,k) set apart."""
        X, pattern = surface.vertices, hessian_pattern(classes, space)
        solver = factoriser(pattern, backend, strength_units(surface, classes, space))
        mass = lumped_mass(space, classes, X)
        return cls(surface, classes, space, mass, excluded_columns(surface, space, rigid, X), pattern, solver)

    def at(self, shift: Floats | float = 0.0) -> Stiffness:
        """A - diag(shift), shift (N,), factorised, ``negative`` counted there; the factor before is used up.

        Raises
        ------
        SingularMatrix : it is singular, also with a little stiffness added.
        """
        diagonal = self.pattern.indptr[:-1]
        for added in (0.0, SOFT):
            data = self._values if not added else self._assembled(added)
            shifted = data.copy()
            shifted[diagonal] -= shift
            with suppress(SingularMatrix):
                factor = self.solver.factor(shifted)
                negative = negatives_without(factor, self.excluded)
                matrix = full_matrix(self.pattern, data)
                return Stiffness(self.space, matrix, self.mass, factor, self.excluded, negative)
        raise SingularMatrix("the second variation is singular, also with a little stiffness added")

    @cached_property
    def tension_mass(self) -> Floats:
        """(N,) a third of tension times area, summed over the active triangles around a vertex."""
        F = self.classes.faces
        pull = self.surface.tensions[self.classes.patch_of_face] * face_areas(self.surface.vertices[F]) / 3.0
        around = np.bincount(F.ravel(), np.repeat(pull, 3), self.surface.n)
        return np.repeat(around, self.space.dimension)

    @cached_property
    def _values(self) -> Floats:
        return self._assembled(0.0)

    def _assembled(self, added: float) -> Floats:
        X = self.surface.vertices
        return assemble(self.surface, self.classes, self.space, self.pattern, X, 1.0, added)


def stiffness(
    surface: Surface, classes: VertexClasses, space: MotionSpace, rigid: Floats, backend: str | None = None
) -> Stiffness:
    """The second variation at the positions of a surface, assembled and factorised.

    Raises
    ------
    SingularMatrix : it is singular, also with a little stiffness added.
    """
    return SecondVariation.of(surface, classes, space, rigid, backend).at()


def morse_index(surface: Surface) -> int:
    """Number of independent motions that lower the energy of a surface at rest to second order.

    Counted in the motion space, by inertia; rigid motions that no support resists are left out. Where rooms
    prescribe volumes, only motions that keep them count.

    Raises
    ------
    SingularMatrix : the second variation has no inertia that can be counted.

    Examples
    --------
    >>> from pcmc import Patch
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> morse_index(roof)
    0
    """
    return second_variation(surface).negative


def ways_down(surface: Surface) -> tuple[int, Floats]:
    """The Morse index of a surface at rest and its lowest mode (n,3); empty if there is no way down.

    Raises
    ------
    SingularMatrix : the second variation has no inertia that can be counted.
    """
    system = second_variation(surface)
    if system.negative == 0:
        return system.negative, np.empty((0, 3))
    return system.negative, lowest(system, 1)[1][0]


def second_variation(surface: Surface) -> Stiffness:
    """The second variation of the part of a surface that stands.

    Raises
    ------
    SingularMatrix : it has no factorisation.
    """
    part = standing_part(surface)
    X = part.surface.vertices
    space = motion_space(part.surface, part.classes, X)
    rigid = rigid_modes(space, rigid_motions(part.surface), X)
    return stiffness(part.surface, part.classes, space, rigid)


def all_modes(system: Stiffness) -> tuple[Floats, Floats]:
    """All eigenvalues (k,), ascending, and their modes (N,k) of unit mass; for a few unknowns."""
    across = np.eye(len(system.mass))
    if system.excluded.shape[1]:
        across = null_space(system.excluded.T)
    if not across.shape[1]:
        return np.empty(0), across
    H, M = system.matrix.toarray(), np.diag(system.mass)
    values, vectors = eigh(across.T @ H @ across, across.T @ M @ across)
    return values, across @ vectors


def _settled(values: Floats, vectors: Floats, space: MotionSpace, root: Floats) -> Floats:
    """The eigenvectors (s,k), those of equal eigenvalues as the projections of fixed displacements.

    Any basis of their space is as good, and rounding alone would choose one: a symmetric saddle would lean
    to another side on each processor. ``root`` (s,) are the roots of the masses.
    """
    vectors, ends = (
        vectors.copy(),
        np.flatnonzero(np.diff(values) > ALIKE * np.abs(values).max(initial=0.0)) + 1,
    )
    for group in np.split(np.arange(len(values)), ends):
        if len(group) > 1:
            wave = np.arange(3 * len(space.dimension)).reshape(-1, 3)
            fixed = [space.to_coordinates(np.cos((1.618 + k) * wave)) for k in range(len(group))]
            shares = vectors[:, group].T @ (root * np.array(fixed)).T
            basis, upper = np.linalg.qr(shares)
            vectors[:, group] = vectors[:, group] @ (basis * np.where(np.diag(upper) < 0.0, -1.0, 1.0))
    return vectors


def lowest(system: Stiffness, count: int) -> tuple[Floats, Floats]:
    """The ``count`` eigenvalues (k,) nearest zero, ascending, and their modes (k,n,3).

    The search takes in all negative ones, so the first is the lowest of all. Modes have unit mass:
    Σ M |v|² = 1. Rigid motions are left out; rooms keep their prescribed volumes. The factor may be that of
    A - σM for a small σ; the eigenvalues are those of A.

    Raises
    ------
    SingularMatrix : the iteration does not converge.
    """
    size, root = len(system.mass), np.sqrt(system.mass)
    k = max(count + 1, system.negative + 2)
    while True:
        values, vectors = _dense(system, k) if max(2 * k, DENSE) >= size else _nearest(system, k)
        # one more than are wanted, and all negative ones: these may be farther from zero than positive ones
        whole = len(values) <= count or values[-1] - values[count - 1] > ALIKE * np.abs(values).max()
        if len(values) < k or (whole and np.count_nonzero(values < 0.0) >= system.negative):
            break
        k *= 2
    vectors = _settled(values, root[:, None] * vectors, system.space, root)
    fields = [system.space.to_vectors(vector / root) for vector in vectors.T[:count]]
    return values[:count], np.array(fields).reshape(len(fields), len(system.space.dimension), 3)


def _dense(system: Stiffness, k: int) -> tuple[Floats, Floats]:
    values, vectors = all_modes(system)
    return values[:k], vectors[:, :k]


def _nearest(system: Stiffness, k: int) -> tuple[Floats, Floats]:
    """The k eigenvalues nearest the factor's shift, ascending, and their modes (N,k) of unit mass."""
    size, root = len(system.mass), np.sqrt(system.mass)

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
