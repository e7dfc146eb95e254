"""Positions X on a mesh of a branch and a parameter λ, with the equations r = B(X)ᵀ ∇E(X; λ) = 0."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...base.arrays import Bools, Floats
from ...forces.loose_parts import part_size, rounding_left
from ...forces.motion_space import MotionSpace
from ...forces.pinching import part_by_positions, standing_part
from ...forces.rooms import with_room_pressures
from ...forces.volume_below import volume_below_gradient, volumes_below
from ...meshing.quality import worst_quality
from ...stability.equilibrium import Equilibrium
from ...surface import Surface
from ...surface.geometry import vertex_area_vectors
from ...surface.supports import apply_supports, onto_circles
from ...surface.topology import SHEET
from ..smoother import HarmonicExtension
from .parameters import ParameterLine

LEAST_VOLUME = 1e-3  # of the size, cubed: smaller prescribed volumes count as this large
QUANTITIES = ("parameter", "energy", "volume", "height")  # attributes that a goal may name


class BranchMesh:
    """What the points of a branch share as long as neither the mesh nor what rests on Π changes.

    ``surface`` is the standing part's; ``line`` has its values and boundary as functions of λ. With ``held``,
    walls with held bottoms can pinch.
    """

    def __init__(
        self, surface: Surface, line: ParameterLine, backend: str | None = None, held: bool = False
    ) -> None:
        self.line, self.size, self._backend = line, part_size(surface), backend
        self.part = part = part_by_positions(surface, held) if held else standing_part(surface)
        self.surface = part.surface
        self.rounding = rounding_left(self.surface, part.classes, self.surface.vertices)  # of the residual
        self.roof: Floats = surface.roof.astype(float)  # (patches,) 1 where the volume over Π is the roof's
        self._curves_move = bool(((part.classes.kind != SHEET) & ~self.surface.fixed).any())
        self._extension: HarmonicExtension | None = None
        self._inside: HarmonicExtension | None = None
        least = LEAST_VOLUME * self.size**3
        self.last = Equilibrium(part, self.surface.vertices, backend, least)  # that asked for last

    def motion(self, space: MotionSpace, X: Floats, s: Floats) -> Floats:
        """The motion Bs (n,3), in which the insides of the sheets follow their curves."""
        if self._extension is None and self._curves_move:
            self._extension = HarmonicExtension(self.surface, self.part.classes, X, self._backend)
        d = space.to_vectors(s)
        return d if self._extension is None else self._extension.extend(space, d)

    def carried(self, change: Floats, X: Floats) -> Floats:
        """The motion w (n,3) in which the inside follows a change (k,3) of the boundary."""
        surface, classes = self.surface, self.part.classes
        if self._inside is None:
            self._inside = HarmonicExtension(surface, classes, X, self._backend, surface.pinned)
        motion = np.zeros_like(X)
        motion[surface.pinned] = change
        w = apply_supports(surface, self._inside.harmonic(motion), X)
        w[surface.pinned] = change
        return w

    def reaches_plane(self, X: Floats) -> Bools:
        """(n,) bool, junction vertices that stood off Π and are now on it or beyond."""
        return self.part.coming_down(X, self.surface.vertices)


@dataclass(frozen=True, eq=False)
class BranchState:
    """Positions X (n,3) on a mesh, a value of the parameter λ, and the Newton steps that led there.

    ``room_changes`` (r,) are the pressures of rooms of prescribed volume, less those of the mesh's surface.
    """

    mesh: BranchMesh
    X: Floats
    parameter: float
    iterations: int = 0
    room_changes: tuple[float, ...] = ()

    def with_values(self, surface: Surface) -> Surface:
        """A surface of this mesh with the tensions and pressures that it has here."""
        surface = self.mesh.line.surface_at(surface, self.parameter)
        return with_room_pressures(surface, np.array(self.room_changes)) if self.room_changes else surface

    @cached_property
    def rest(self) -> Equilibrium:
        """The equations and their derivatives by the positions; factors are valid until the next one's."""
        self.mesh.last = self.mesh.last.at(self.X, self.mesh.part.with_values(self.with_values))
        return self.mesh.last

    @property
    def whole(self) -> Surface:
        """The surface with all its walls; those that vanish lie on Π."""
        return self.rest.part.whole_at(self.X)

    @cached_property
    def parameter_derivative(self) -> Floats:
        """(N+r,) dr/dλ = Bᵀ ∂∇E/∂λ, and Bᵀ Df[v] where λ moves the boundary; -dV̄/dλ in units of force."""
        rest, line = self.rest, self.mesh.line
        change = rest.space.to_coordinates(line.gradient(rest.surface, self.X))
        if self.carried is not None:
            change = change + rest.jacobian(self.carried)
        return np.append(change, -rest.volume_units * line.rates.get("volumes", 0.0))

    @cached_property
    def carried(self) -> Floats | None:
        """v (n,3), how the vertices follow the boundary as λ grows; None where it stays."""
        velocity = self.mesh.line.velocity(self.parameter)
        return None if velocity is None else self.mesh.carried(velocity, self.X)

    @property
    def energy(self) -> float:
        """E, force·length."""
        return self.rest.energy

    @cached_property
    def volume(self) -> float:
        """The volume under the roof, length³, as in ``volume_below``; its patches are those of the start."""
        return float(volumes_below(self.mesh.surface.moved(self.X)) @ self.mesh.roof)

    @cached_property
    def volume_gradient(self) -> Floats:
        """(n,3) gradient of the volume, supports applied unless the boundary moves, length²."""
        surface = self.mesh.surface
        gradient = volume_below_gradient(surface.moved(self.X), self.mesh.roof)
        return gradient if self.carried is not None else apply_supports(surface, gradient, self.X)

    @cached_property
    def highest_vertex(self) -> int:
        """Index of the vertex farthest above Π."""
        return int(self.mesh.surface.plane.height(self.X).argmax())

    @property
    def height(self) -> float:
        """Height of the highest vertex over Π, length."""
        return float(self.mesh.surface.plane.height(self.X)[self.highest_vertex])

    @cached_property
    def quality(self) -> float:
        """Quality of the worst triangle outside walls that can pinch."""
        return worst_quality(self.X, self.mesh.part.quality_faces)

    @cached_property
    def area_weights(self) -> Floats:
        """(n,) the area around each vertex over all area, over size², 1/length²."""
        area = vertex_area_vectors(self.X, self.mesh.part.classes.faces)[1]
        return area / (area.sum() * self.mesh.size**2)

    @cached_property
    def aligned(self) -> Floats:
        """X (n,3) with the rows of walls below their junction; motions count from here."""
        return self.mesh.part.follow(self.X, self.rest.space)

    def motion(self, s: Floats, change: float = 0.0) -> Floats:
        """``BranchMesh.motion``; and what follows a change of λ, and so of the boundary, to first order."""
        d = self.mesh.motion(self.rest.space, self.X, s)
        return d if self.carried is None or not change else d + change * self.carried

    def step(
        self, d: Floats, parameter: float, iterations: int = 0, rooms: Floats | None = None
    ) -> BranchState:
        """The state at X + d (n,3) and λ, its boundary there, and ``rooms`` (r,) more in units of borders."""
        X, changes = self.moved(d), self.room_changes
        if rooms is not None:
            before = np.array(changes) if changes else np.zeros(len(rooms))
            changes = tuple((before + self.rest.volume_units * rooms).tolist())
        boundary = self.mesh.line.boundary(parameter)
        if boundary is not None:
            fixed = self.mesh.surface.pinned
            X = self.moved(d + self.mesh.carried(boundary - X[fixed], self.X))
            X[fixed] = boundary
        return BranchState(self.mesh, X, parameter, iterations, changes)

    def moved(self, d: Floats) -> Floats:
        """X + d (n,3), with the rows of walls below their junction."""
        return self.mesh.part.follow(onto_circles(self.mesh.surface, self.X + d), self.rest.space)
