"""A point of a branch with its tangent, its index and its lowest eigenvalues."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Floats
from ..stability.equilibrium import SecondVariation
from ..stability.factorisation import SingularMatrix
from ..stability.modes import lowest
from .correction import BorderedMatrix, NotOnBranch
from .state import BranchMesh, State

TANGENT_ACCURACY = 1e-6  # relative, to which the tangent's linear system is solved


@dataclass(frozen=True, eq=False)
class Tangent:
    """dX/ds and dλ/ds along a branch, in the metric  ds² = Σ weights |dX|² + (dλ/scale)².

    Attributes
    ----------
    direction, slope : dX/ds (n,3), and dλ/ds.
    weights : (n,) 1/length²; with them the first part of ds² is the mean square displacement over the
        surface in units of its size.
    scale : size of λ.
    """

    direction: Floats
    slope: float
    weights: Floats
    scale: float

    @property
    def row(self) -> Floats:
        """(n,3) the tangent as a linear form on displacements."""
        return self.weights[:, None] * self.direction

    @property
    def rate(self) -> float:
        """Its entry for changes of λ."""
        return self.slope / self.scale**2

    def length(self, d: Floats, change: float) -> float:
        """Length of a displacement d (n,3) and a change of λ together, in the metric."""
        square = self.weights @ np.einsum("ij,ij->i", d, d)
        return float(np.sqrt(square + (change / self.scale) ** 2))

    def on(self, old: State, mesh: BranchMesh) -> Tangent:
        """The tangent on another mesh: each vertex takes it from the nearest one of the old mesh."""
        new = State(mesh, mesh.surface.vertices, old.parameter)
        nearest = cKDTree(old.X).query(new.X)[1]
        return Tangent(self.direction[nearest], self.slope, new.area_weights, self.scale)


@dataclass(frozen=True, eq=False)
class BranchPoint:
    """A point of the branch; ``index`` is the number of its negative eigenvalues.

    ``eigenvalues`` are all negative ones and at least one more, ascending, force/length³; ``room_rates`` (r,)
    the derivatives of the rooms' pressures by arclength.
    """

    state: State
    tangent: Tangent
    eigenvalues: Floats
    index: int
    room_rates: Floats


def branch_point(at: State, before: Tangent | float) -> BranchPoint:
    """The point of the branch at a state on it.

    ``before`` gives the sense of the tangent: a tangent nearby, or the sign of dλ/ds.
    """
    scale = at.mesh.line.scale
    if isinstance(before, Tangent):
        matrix, sense = BorderedMatrix(at, before.row, before.rate), 1.0
    else:
        matrix, sense = BorderedMatrix(at, np.zeros_like(at.X), 1.0 / scale**2), before
    s, slope = matrix.solve(np.zeros(len(at.defects)), sense, TANGENT_ACCURACY)
    size = at.rest.space.size
    direction, weights = at.motion(s[:size], slope), at.area_weights
    length = Tangent(direction, slope, weights, scale).length(direction, slope)
    tangent = Tangent(direction / length, slope / length, weights, scale)
    rates = at.rest.volume_units * s[size:] / length
    with _counted():
        return BranchPoint(at, tangent, _eigenvalues(matrix.second), matrix.second.negative, rates)


@contextmanager
def _counted() -> Iterator[None]:
    """Where rounding hides the eigenvalues, there is no point of the branch: one beside it will do."""
    try:
        yield
    except SingularMatrix as error:
        raise NotOnBranch(f"the second variation has no eigenvalues that can be told ({error})") from None


def soft_modes(at: State, count: int) -> tuple[Floats, Floats]:
    """The ``count`` eigenvalues (k,) nearest zero, nearest first, and their motions (k,n,3)."""
    with _counted():
        second = at.rest.factorised(soften=False)
        every, fields = lowest(second, second.negative + count + 1)
    nearest = np.argsort(np.abs(every))[:count]
    return every[nearest], np.array([at.motion(at.rest.space.to_coordinates(fields[i])) for i in nearest])


def along_branch(at: BranchPoint, count: int) -> float:
    """Cosine between the tangent and the ``count`` softest modes, in the metric of arclength."""
    tangent = at.tangent
    modes = soft_modes(at.state, count)[1]
    squares = np.einsum("v,kvi,kvi->k", tangent.weights, modes, modes)
    return float(np.linalg.norm(np.einsum("vi,kvi->k", tangent.row, modes) / np.sqrt(squares)))


def _eigenvalues(second: SecondVariation) -> Floats:
    """All negative eigenvalues and at least one more, ascending."""
    values = lowest(second, second.negative + 2)[0]
    return values if len(values) else np.array([np.inf])  # nothing moves at these volumes
