"""One point of a solution branch: equilibrium and one more equation, solved together.

The unknowns are the positions X and the parameter λ:

    r(X, λ) = B(X)ᵀ ∇E(X; λ) = 0,    g(X, λ) = 0

with g a condition on arclength, volume, height or λ itself. A Newton step solves

    [ J   f ] [ s ]     [ -r ]        J s = dr along s,  f = Bᵀ ∂∇E/∂λ
    [ cᵀ  d ] [ δλ]  =  [ -g ]        c = Bᵀ ∂g/∂X,  d = ∂g/∂λ

by GMRES. J is applied, not assembled: s moves the vertices by Bs, the sheets slide along after their
junctions, and the frames B turn (``linearise``). The preconditioner has H = Bᵀ(∂²E)B in the place of
J, by block elimination on a factorisation of H. At a fold J is singular and the bordered matrix is not.
(Keller 1977 for the arclength; Govaerts 2000, ch. 3, for the elimination.)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import eigh
from scipy.sparse.linalg import LinearOperator, gmres
from scipy.spatial import cKDTree

from ..base.arrays import Floats
from ..energy.functional import energy_and_gradient, energy_at
from ..energy.jacobian import Linearisation, linearise
from ..energy.motion_space import MotionSpace, force_scale
from ..stability.factorisation import Factor, SingularMatrix
from ..stability.modes import Stiffness, lowest
from ..surface import Surface
from .direction import Line
from .shape import Shape

ITERATIONS = 12  # Newton steps before a correction is given up
SLOW = 0.8  # a residual that falls by less, three times in a row, will not converge
COLLAPSED = 0.02  # triangle quality below which no point is accepted
SMALL = 12  # unknowns below which all eigenvalues are computed at once


class Lost(ArithmeticError):
    """No point of the branch was found there; the message says why."""


class Collapsed(Lost):
    """The triangles there are no good."""


class Touched(Lost):
    """A wall's contact with Π may change: near the positions X, at about the parameter λ."""

    def __init__(self, X: Floats, value: float) -> None:
        super().__init__("the contact of a wall with the plane changes")
        self.X, self.value = X, value


@dataclass(frozen=True, eq=False)
class Border:
    """The equation g(X, λ) = 0 beside equilibrium: g, ∂g/∂X (n,3) and ∂g/∂λ; g of order 1."""

    value: Callable[[Floats, float], float]
    gradient: Callable[[Floats], Floats]
    rate: float


def at_parameter(value: float, scale: float) -> Border:
    """λ = value."""
    return Border(lambda X, v: (v - value) / scale, lambda X: np.zeros_like(X), 1.0 / scale)


def across(X: Floats, value: float, row: Floats, rate: float) -> Border:
    """⟨row, X' - X⟩ + rate (λ' - λ) = 0: pseudo-arclength."""
    return Border(
        lambda there, v: float((row * (there - X)).sum()) + rate * (v - value), lambda _: row, rate
    )


def at_volume(shape: Shape, volume: float) -> Border:
    """V = volume."""
    unit = shape.full.size**3
    return Border(
        lambda X, v: (shape.volume(X) - volume) / unit,
        lambda X: shape.volume_gradient(X) / unit,
        0.0,
    )


def at_height(shape: Shape, vertex: int, height: float) -> Border:
    """Height of one vertex over Π = height."""
    plane, unit = shape.surface.plane, shape.full.size
    row = np.zeros((shape.full.n, 3))
    row[vertex] = np.array(plane.normal) / unit
    return Border(lambda X, v: float(plane.height(X[vertex]) - height) / unit, lambda X: row, 0.0)


@dataclass(frozen=True, eq=False)
class Solution:
    """A point of the branch: positions (n,3), λ, relative residual, Newton steps taken."""

    shape: Shape
    X: Floats
    value: float
    residual: float
    iterations: int


@dataclass(frozen=True, eq=False)
class Bordered:
    """The matrix [[J, f], [cᵀ, d]] at a place, with H factorised to solve with it.

    c·s is ⟨row, motion⟩ and d is ``rate``; ``unit`` brings the last row to the size of the others.
    """

    shape: Shape
    surface: Surface
    space: MotionSpace
    X: Floats
    factor: Factor
    f: Floats
    row: Floats
    rate: float
    unit: float

    def solve(self, right: Floats, last: float, accuracy: float) -> tuple[Floats, float]:
        """(s, δ) with  J s + f δ = right,  ⟨row, motion⟩ + rate δ = last."""
        size = len(right) + 1
        behind, c = self.factor.solve(self.f), self.space.to_coordinates(self.row)
        pivot = self.rate - float(c @ behind)
        if not np.isfinite(pivot) or pivot == 0.0:
            raise Lost("the bordered matrix is singular: branches meet here")

        def eliminate(z: Floats) -> Floats:
            s = self.factor.solve(z[:-1])
            delta = (z[-1] / self.unit - float(c @ s)) / pivot
            return np.append(s - behind * delta, delta)

        z, _ = gmres(
            LinearOperator((size, size), self.times, dtype=float),
            np.append(right, last * self.unit),
            M=LinearOperator((size, size), eliminate, dtype=float),
            rtol=accuracy, restart=20, maxiter=2,
        )  # fmt: skip
        return z[:-1], float(z[-1])

    def times(self, z: Floats) -> Floats:
        """The matrix times a vector (N+1,)."""
        d = self.shape.motion(self.space, self.X, z[:-1])
        d = self.shape.swept(self.X + d, self.space) - self.swept
        along = float((self.row * d).sum())
        return np.append(
            self.linear.times(d) + self.f * z[-1], self.unit * (along + self.rate * z[-1])
        )

    @cached_property
    def swept(self) -> Floats:
        """X (n,3) with the rows of walls below their crest, from where motions count."""
        return self.shape.swept(self.X, self.space)

    @cached_property
    def linear(self) -> Linearisation:
        """J, as it acts on motions of the vertices."""
        gradient = energy_and_gradient(self.surface, self.X)[1]
        return linearise(self.surface, self.shape.classes, self.space, self.X, gradient)


def correct(
    shape: Shape, line: Line, X: Floats, value: float, border: Border, tolerance: float
) -> Solution:
    """The point of the branch near (X, λ) that also meets the border.

    Raises
    ------
    Lost : Newton's method does not converge there, or the mesh collapses.
    Touched : a junction comes down to Π on the way.
    """
    last, slow, start = np.inf, 0, (X, value)
    _check(line, value)
    for iteration in range(ITERATIONS + 1):
        surface = line.applied(shape.surface, value)
        space = shape.space(X)
        right = space.to_coordinates(energy_and_gradient(surface, X)[1])
        residual = float(np.linalg.norm(right)) / force_scale(surface, shape.classes, X)
        g = border.value(X, value)
        if residual <= tolerance and abs(g) <= 1e-9:
            return Solution(shape, X, value, residual, iteration)
        slow = slow + 1 if not residual + abs(g) < SLOW * last else 0
        if slow >= 3 or not np.isfinite(residual + g):
            break
        last = residual + abs(g)
        factor = _hessian(shape, surface, space, X)[1]
        matrix = _bordered(shape, surface, line, space, X, factor, border.gradient(X), border.rate)
        s, change = matrix.solve(-right, -g, 1e-3)
        step = shape.motion(space, X, s)
        if not np.abs(step).max() < shape.full.size:
            break
        X, value = shape.swept(X + step, space), value + change
        _check(line, value)
        if shape.quality(X) < COLLAPSED:
            raise Collapsed("triangles collapse")
        if shape.down(X).any():
            raise Touched(*start)  # below Π the walls' forces mislead Newton's method
    raise Lost(f"Newton's method does not converge (residual {residual:.1e})")


def _check(line: Line, value: float) -> None:
    if not line.allows(value):
        raise Lost(f"a tension would reach 0 at the parameter {value:g}")


@dataclass(frozen=True, eq=False)
class Station:
    """A point of the branch and all that is known there.

    Attributes
    ----------
    X, value, residual, iterations : of its ``Solution``.
    energy, volume, height, quality : what a table shows; height is the highest vertex's.
    eigenvalues : all negative ones and at least one more, ascending, force/length³.
    index : number of negative eigenvalues.
    weights : (n,) of the metric  ds² = Σ weights |dX|² + (dλ/scale)², 1/length²: its first part is
        the mean square displacement over the surface in units of its size.
    direction, slope : dX/ds (n,3) and dλ/ds along the branch.
    """

    shape: Shape
    X: Floats
    value: float
    residual: float
    iterations: int
    energy: float
    volume: float
    height: float
    quality: float
    eigenvalues: Floats
    index: int
    weights: Floats
    direction: Floats
    slope: float

    def row(self, scale: float) -> tuple[Floats, float]:
        """The tangent as a linear form: (n,3) and its entry for λ."""
        return self.weights[:, None] * self.direction, self.slope / scale**2

    def length(self, d: Floats, change: float, scale: float) -> float:
        """Of a displacement d (n,3) and a change of λ, in the metric."""
        return _length(self.weights, d, change / scale)


def examine(found: Solution, line: Line, scale: float, before: Station | float) -> Station:
    """Tangent, index and lowest eigenvalues at a point; ``before`` gives the tangent's sense.

    That is the station before it, or the sign of dλ/ds.
    """
    shape, X = found.shape, found.X
    surface = line.applied(shape.surface, found.value)
    space = shape.space(X)
    if isinstance(before, Station):
        row, rate = before.row(scale)
        sense = 1.0
    else:
        row, rate, sense = np.zeros_like(X), 1.0 / scale**2, before
    data, factor = _hessian(shape, surface, space, X)
    matrix = _bordered(shape, surface, line, space, X, factor, row, rate)
    s, slope = matrix.solve(np.zeros(space.size), sense, 1e-6)
    direction, weights = shape.motion(space, X, s), shape.weights(X)
    length = _length(weights, direction, slope / scale)
    stiffness = shape.stiffness(space, X, data, factor)
    return Station(
        shape=shape, X=X, value=found.value, residual=found.residual, iterations=found.iterations,
        energy=energy_at(surface, X), volume=shape.volume(X), height=shape.height(X),
        quality=shape.quality(X), eigenvalues=_eigenvalues(stiffness), index=stiffness.negative,
        weights=weights, direction=direction / length, slope=slope / length,
    )  # fmt: skip


def transferred(here: Station, shape: Shape) -> Station:
    """A station with its tangent on another mesh, each vertex taking that of the nearest one."""
    X = shape.surface.vertices
    nearest = cKDTree(here.X).query(X)[1]
    return replace(
        here, shape=shape, X=X, weights=shape.weights(X), direction=here.direction[nearest]
    )


def _bordered(
    shape: Shape, surface: Surface, line: Line, space: MotionSpace, X: Floats, factor: Factor,
    row: Floats, rate: float,
) -> Bordered:  # fmt: skip
    f = space.to_coordinates(line.gradient(surface, X))
    unit = (float(np.linalg.norm(f)) or 1.0) / float(np.linalg.norm(row) + abs(rate))
    return Bordered(shape, surface, space, X, factor, f, row, rate, unit)


def _hessian(
    shape: Shape, surface: Surface, space: MotionSpace, X: Floats
) -> tuple[Floats, Factor]:
    try:
        return shape.hessian(surface, space, X)
    except SingularMatrix as error:
        raise Lost(f"the Hessian has no factorisation ({error})") from None


def _length(weights: Floats, d: Floats, relative: float) -> float:
    """√(Σ weights |d|² + relative²)."""
    return float(np.sqrt(weights @ np.einsum("ij,ij->i", d, d) + relative**2))


def _eigenvalues(system: Stiffness) -> Floats:
    """All negative eigenvalues and at least one more, ascending."""
    size = len(system.mass)
    if size < SMALL:
        return np.asarray(eigh(system.matrix.toarray(), np.diag(system.mass), eigvals_only=True))
    count = system.negative + 2
    while True:
        values = lowest(system, min(count, size - 1))[0]
        if np.count_nonzero(values < 0.0) >= system.negative or count >= size - 1:
            return values
        count *= 2
