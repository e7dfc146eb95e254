"""One equilibrium: a surface at positions X, and all that tells whether it is at rest there and stable.

A P-CMC surface at rest solves r = Bᵀ∇E = 0, with B the basis of the motion space at X. Where rooms prescribe
volumes V̄, their pressures are unknowns, too, and V = V̄. A = Bᵀ(∂²E)B is the second variation.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from ..base.arrays import Floats, read_only
from ..forces.functional import energy_and_gradient
from ..forces.jacobian import linearise
from ..forces.loose_parts import relative_forces
from ..forces.motion_space import MotionSpace, VertexClasses, force_scale, motion_space
from ..forces.pattern import Pattern, hessian_pattern
from ..forces.pinching import StandingPart, excess_pull, standing_part
from ..forces.rigid_motions import net_forces, rigid_field, rigid_modes, rigid_motions
from ..forces.rooms import prescribed_volumes, room_volume_gradients, room_volumes
from ..forces.second_variation import assemble
from ..surface import Surface
from ..surface.geometry import face_areas, vertex_area_vectors
from ..surface.supports import apply_supports
from .bordered import BorderedFactor, across, negatives_without
from .factorisation import Factor, Factoriser, Linear, SingularMatrix, factoriser

STRONG = 1e-6  # of the largest tension: where all are at least this, factors need no units
SOFT = 1e-9  # of the stiffness BᵀLB, added where a matrix is singular


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """The standing part of a surface with its vertices at X, at rest or on the way there."""

    part: StandingPart  # its surface has the tensions and pressures, not the positions
    X: Floats  # (n,3)
    backend: str | None = None  # of the factorisation; None for the fastest here
    least_volume: float = 0.0  # smaller prescribed volumes count as this large in ``volume_units``, length³

    def __post_init__(self) -> None:
        read_only(self.X)  # like those of a surface: compiled loops are compiled for one kind of array

    @classmethod
    def of(cls, surface: Surface, backend: str | None = None) -> Equilibrium:
        """That of the part of a surface that stands, where it is.

        >>> from pcmc import Patch
        >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
        >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
        ...                [Patch("roof", 1.0)], fixed=range(4))
        >>> at = Equilibrium.of(roof)
        >>> at.residual < 1e-15, at.factorised().negative  # the Morse index
        (True, 0)
        """
        part = standing_part(surface)
        return cls(part, part.surface.vertices, backend)

    def at(self, X: Floats, part: StandingPart | None = None) -> Equilibrium:
        """The same part at other positions, or with other values; the pattern goes along where it can."""
        new, known = replace(self, part=part or self.part, X=X), self.__dict__
        if "rigid_motions" in known:
            new.__dict__["rigid_motions"] = self.rigid_motions
        if "unknowns" in known and np.array_equal(new.space.dimension, self.space.dimension):
            new.__dict__["unknowns"] = self.unknowns
        return new

    def same_as(self, other: Equilibrium) -> bool:
        """Whether both have the same faces, values, supports and positions."""
        here, there = self.surface, other.surface
        arrays = [(at.X, at.surface.faces, *at.space, *at.surface.cable_edges) for at in (self, other)]
        values = [(surface.patches, surface.rooms, surface.plane) for surface in (here, there)]
        return values[0] == values[1] and all(map(np.array_equal, *arrays))

    def release(self) -> None:
        """Give back the memory of the factoriser; another is made when it is asked for."""
        self.__dict__.pop("unknowns", None)

    @property
    def surface(self) -> Surface:
        """The standing surface; its vertices are not at X."""
        return self.part.surface

    @property
    def classes(self) -> VertexClasses:
        return self.part.classes

    @cached_property
    def shape(self) -> Surface:
        """The standing surface with its vertices at X."""
        return self.surface if self.X is self.surface.vertices else self.surface.moved(self.X)

    @property
    def part_here(self) -> StandingPart:
        """The standing part with its vertices, and those of the whole surface, at X."""
        return replace(self.part, whole=self.part.whole_at(self.X), surface=self.shape)

    # At rest

    @cached_property
    def _measured(self) -> tuple[float, Floats]:
        return energy_and_gradient(self.surface, self.X, supports=False)

    @property
    def energy(self) -> float:
        """E, force·length."""
        return self._measured[0]

    @property
    def gradient_with_reactions(self) -> Floats:
        """∇E (n,3), supports not applied, force."""
        return self._measured[1]

    @cached_property
    def gradient(self) -> Floats:
        """∇E (n,3), supports applied, force."""
        return apply_supports(self.surface, self.gradient_with_reactions.copy(), self.X)

    @cached_property
    def space(self) -> MotionSpace:
        """The motion space, whose basis is B."""
        return motion_space(self.surface, self.classes, self.X)

    @cached_property
    def forces(self) -> Floats:
        """r = Bᵀ∇E (N,), force; along the motions ``carried`` theirs, not that of their part across."""
        r, (modes, motions) = self.space.to_coordinates(self.gradient), self.carried
        if not len(motions):
            return r
        return r + modes @ (net_forces(motions, self.X, self.gradient) - modes.T @ r)

    @cached_property
    def unbalanced(self) -> Floats:
        """B r (n,3), the forces that are left, force; zero at images of vertices."""
        left = self.space.to_vectors(self.forces)
        left[self.surface.images[:, 0]] = 0.0
        return left

    @cached_property
    def scale(self) -> float:
        """The norm of the single triangles' forces, with which those left are compared."""
        return force_scale(self.surface, self.classes, self.X)

    @cached_property
    def excess_pull(self) -> Floats:
        """(n,) the pull on resting vertices beyond what their walls can take, force."""
        if not self.part.resting.any():
            return np.zeros(len(self.X))
        return excess_pull(self.part_here, -self.gradient_with_reactions)

    @cached_property
    def jacobian(self) -> Callable[[Floats], Floats]:
        """d ↦ J d, the derivative of r along motions of the vertices; B turns along with the surface."""
        gradient = self.gradient
        if len(self.carried[1]):
            gradient = gradient - rigid_field(self._placing, self.X)
        return linearise(self.surface, self.classes, self.space, self.X, gradient)

    # Rooms of prescribed volume

    @cached_property
    def wanted_volumes(self) -> Floats:
        """(r,) V̄, length³."""
        return prescribed_volumes(self.surface)

    @cached_property
    def volume_defects(self) -> Floats:
        """(r,) V - V̄, length³."""
        return room_volumes(self.surface, self.X) - self.wanted_volumes

    @cached_property
    def volume_units(self) -> Floats:
        """(r,) what brings the defect of a volume to the size of forces, force/length³."""
        return self.scale / np.maximum(np.abs(self.wanted_volumes), self.least_volume)

    @cached_property
    def volume_gradients(self) -> Floats:
        """(r,n,3) ∂V/∂X, supports applied, length²."""
        return room_volume_gradients(self.surface, self.X)

    @cached_property
    def volume_columns(self) -> Floats:
        """(N,r) Bᵀ ∂V/∂X, length²."""
        columns = [self.space.to_coordinates(gradient) for gradient in self.volume_gradients]
        return np.stack(columns, axis=1) if columns else np.zeros((self.space.size, 0))

    @cached_property
    def defects(self) -> Floats:
        """(N+r,) r, and the defects V - V̄ in units of force."""
        return np.append(self.forces, self.volume_units * self.volume_defects)

    def times(self, d: Floats, pressures: Floats) -> Floats:
        """(N+r,) how ``defects`` change with a motion d = Bs (n,3) and with rooms' pressures over units:

        [ J   -C ] [ s ]
        [ Cᵀ   0 ] [ μ ]        C = Bᵀ ∂V/∂X in units of force
        """
        change = self.jacobian(d)
        if len(self.carried[1]):  # r = Bᵀ(∇E - the field of ``_placing``), whose arms move along
            turned = self.space.to_coordinates(np.cross(self._placing[1], d))
            change = self.across_carried(change - turned)
        if not self.surface.rooms:
            return change
        growth = self.volume_units * np.einsum("rnd,nd->r", self.volume_gradients, d)
        return np.append(change - self.volume_columns @ (self.volume_units * pressures), growth)

    @cached_property
    def norm(self) -> float:
        """‖r‖, with the volumes' defects in units of force; of loose parts the worst counts as if all."""
        if self.surface.topology.in_parts:
            left = relative_forces(self.surface, self.classes, self.X, self.unbalanced)
            return self._with_volumes(self.scale * left)
        return self._with_volumes(float(np.linalg.norm(self.forces)))

    @property
    def residual(self) -> float:
        """``norm`` over the scale."""
        return self.norm / self.scale

    @cached_property
    def residual_with_pull(self) -> float:
        """The same with ``excess_pull``."""
        forces = np.column_stack([self.unbalanced, self.excess_pull])
        left = relative_forces(self.surface, self.classes, self.X, forces)
        return self._with_volumes(self.scale * left) / self.scale

    def _with_volumes(self, norm: float) -> float:
        if not self.surface.rooms:
            return norm
        return float(np.hypot(norm, np.linalg.norm(self.volume_units * self.volume_defects)))

    # The second variation

    @cached_property
    def unknowns(self) -> tuple[Pattern, Factoriser]:
        """The pattern of A and its factoriser; they stay while each vertex has as many unknowns.

        Where tensions differ by orders, it factorises in units of powers of two near 1/√α around each
        unknown: so a patch that pulls far less than another still counts.
        """
        pattern, patch = hessian_pattern(self.classes, self.space), self.classes.patch_of_face
        tension, units = self.surface.tensions[np.flatnonzero(np.bincount(patch))], None
        if len(tension) and tension.min() < STRONG * tension.max():
            strongest = np.zeros(len(self.X))
            np.maximum.at(strongest, self.classes.topology.faces, self.surface.tensions[patch, None])
            units = 2.0 ** -np.round(0.5 * np.log2(np.repeat(strongest, self.space.dimension)))
        return pattern, factoriser(pattern, self.backend, units)

    @cached_property
    def mass(self) -> Floats:
        """M (N,), a third of the area of the active triangles around each unknown's vertex, length²."""
        area = vertex_area_vectors(self.X, self.classes.faces, self.classes.topology.faces)[1]
        return np.repeat(area / 3.0, self.space.dimension)

    @cached_property
    def tension_mass(self) -> Floats:
        """(N,) a third of tension times area, summed over the active triangles around a vertex."""
        F = self.classes.faces
        pull = self.surface.tensions[self.classes.patch_of_face] * face_areas(self.X[F]) / 3.0
        sums = np.bincount(self.classes.topology.faces.ravel(), np.repeat(pull, 3), len(self.X))
        return np.repeat(np.asarray(sums, dtype=np.float64), self.space.dimension)

    @cached_property
    def rigid_motions(self) -> Floats:
        """(k,2,3) the rigid motions that no support resists."""
        return rigid_motions(self.surface)

    @cached_property
    def _rigid(self) -> tuple[Floats, Floats]:
        return rigid_modes(self.space, self.rigid_motions, self.X)

    @property
    def rigid(self) -> Floats:
        """(N,k) the same in the motion space, orthonormal."""
        return self._rigid[0]

    @cached_property
    def carried(self) -> tuple[Floats, Floats]:
        """(N,k) and (k,2,3): free rigid motions by which curved elements move as they are.

        The part of a rigid motion across the surface moves the vertices along the shape, too. Of flat
        triangles E depends on their places by the square of the edge length, and comes to rest at one; of
        curved ones so little that it may not, and the solver would carry the vertices far away.
        """
        if self.surface.order == 1:
            return np.empty((self.space.size, 0)), np.empty((0, 2, 3))
        return self._rigid

    @cached_property
    def _placing(self) -> Floats:
        """(2,3) the motion carried whose field has the part of Bᵀ∇E that ``forces`` leaves out."""
        modes, motions = self.carried
        return np.tensordot(self.space.to_coordinates(self.gradient) @ modes, motions, axes=1)

    def across_carried(self, r: Floats) -> Floats:
        """r (N,) without its part along the motions ``carried``."""
        return r - self.carried[0] @ (self.carried[0].T @ r)

    @cached_property
    def excluded(self) -> Floats:
        """(N,k) the rigid motions, and the unit gradients of the volumes that rooms prescribe.

        Motions across all of them deform the surface and keep the volumes.
        """
        if not self.surface.rooms:
            return self.rigid
        length = np.linalg.norm(self.volume_columns, axis=0)
        return np.hstack([self.rigid, self.volume_columns[:, length > 0.0] / length[length > 0.0]])

    def matrix(self, hessian: float, stiffness: float) -> Floats:
        """Values of hessian · A + stiffness · BᵀLB in the pattern."""
        if (hessian, stiffness) == (1.0, 0.0):
            return self._plain_matrix
        pattern = self.unknowns[0]
        return assemble(self.surface, self.classes, self.space, pattern, self.X, hessian, stiffness)

    @cached_property
    def _plain_matrix(self) -> Floats:
        return assemble(self.surface, self.classes, self.space, self.unknowns[0], self.X)

    def factorised(
        self, shift: Floats | float = 0.0, stiffness: float = 0.0, soften: bool = True
    ) -> SecondVariation:
        """A + stiffness · BᵀLB - diag(shift), shift (N,), factorised; the factor before is used up.

        Motions that cost no energy make it singular, such as sliding a vertex inside a flat part on Π. Then,
        with ``soften``, a little more stiffness is added. SingularMatrix if that does not help.
        """
        pattern, solver = self.unknowns
        for added in (0.0, SOFT) if soften else (0.0,):
            data = self.matrix(1.0, stiffness + added)
            if np.ndim(shift) or shift:
                data = data.copy()
                data[pattern.indptr[:-1]] -= shift
            with suppress(SingularMatrix):
                found = SecondVariation(self, pattern, solver.factor(data), stiffness, added)
                if soften:
                    _ = found.negative  # which may be what rounding hides
                return found
        raise SingularMatrix("the second variation is singular, also with a little stiffness added")


@dataclass(frozen=True, eq=False)
class SecondVariation:
    """A = Bᵀ(∂²E)B of a surface at its positions, factorised, perhaps shifted."""

    of: Equilibrium
    pattern: Pattern
    factor: Factor  # of A + (stiffness + added) BᵀLB, less a shift of its diagonal
    stiffness: float = 0.0  # asked for
    added: float = 0.0  # to a singular matrix

    @cached_property
    def negative(self) -> int:
        """Number of negative eigenvalues, of those below the shift, among the motions that count."""
        return negatives_without(self.factor, self.of.excluded)

    @cached_property
    def matrix(self) -> csr_array:
        """(N,N) sparse symmetric A, without the shift, with what was added."""
        return self.pattern.symmetric(self.of.matrix(1.0, self.stiffness + self.added))

    @cached_property
    def added_matrix(self) -> csr_array | None:
        """(N,N) what was added to a singular matrix; None if nothing was."""
        return self.pattern.symmetric(self.of.matrix(0.0, self.added)) if self.added else None

    @cached_property
    def bordered(self) -> Linear:
        """The inverse of ``Equilibrium.times``, with A in the place of J, across the motions carried."""
        inner = across(self.factor.solve, self.of.carried[0])
        columns = self.of.volume_columns * self.of.volume_units
        return BorderedFactor(inner, -columns, columns.T).solve if self.of.surface.rooms else inner

    @cached_property
    def solve(self) -> Linear:
        """The inverse of A among the motions that count: with none of the excluded ones."""
        return across(self.factor.solve, self.of.excluded)
