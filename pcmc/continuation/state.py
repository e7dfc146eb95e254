"""Positions X and a parameter λ, and the equations of equilibrium there.

r(X, λ) = B(X)ᵀ ∇E(X; λ) = 0
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.arrays import Floats
from ..energy.functional import energy_and_gradient, energy_at, patch_volumes
from ..energy.jacobian import Linearisation, linearise
from ..energy.motion_space import MotionSpace, force_scale, motion_space
from ..surface import Surface
from ..surface.geometry import vertex_area_vectors
from .direction import weighted_gradient
from .mesh import BranchMesh

QUANTITIES = ("parameter", "energy", "volume", "height")  # attributes that a goal may name


@dataclass(frozen=True, eq=False)
class State:
    """Positions on a mesh, and a value of the parameter.

    Attributes
    ----------
    X : (n,3) positions.
    parameter : λ.
    iterations : Newton steps that led here.
    """

    mesh: BranchMesh
    X: Floats
    parameter: float
    iterations: int = 0

    # -- equilibrium ---------------------------------------------------------------------------

    @cached_property
    def surface(self) -> Surface:
        """The mesh's surface with the tensions and pressures at λ; its positions are not X."""
        return self.mesh.line.surface_at(self.mesh.surface, self.parameter)

    @cached_property
    def space(self) -> MotionSpace:
        """The motion space at X, whose basis is B."""
        return motion_space(self.mesh.surface, self.mesh.classes, self.X)

    @cached_property
    def gradient(self) -> Floats:
        """∇E (n,3), supports applied, force."""
        return energy_and_gradient(self.surface, self.X)[1]

    @cached_property
    def forces(self) -> Floats:
        """r = Bᵀ∇E (N,), force."""
        return self.space.to_coordinates(self.gradient)

    @cached_property
    def residual(self) -> float:
        """‖r‖ over the norm of the single triangles' forces."""
        scale = force_scale(self.surface, self.mesh.classes, self.X)
        return float(np.linalg.norm(self.forces)) / scale

    @cached_property
    def parameter_derivative(self) -> Floats:
        """∂r/∂λ = Bᵀ ∂∇E/∂λ (N,)."""
        return self.space.to_coordinates(self.mesh.line.gradient(self.surface, self.X))

    @cached_property
    def jacobian(self) -> Linearisation:
        """∂r along motions of the vertices."""
        return linearise(self.surface, self.mesh.classes, self.space, self.X, self.gradient)

    # -- quantities ----------------------------------------------------------------------------

    @cached_property
    def energy(self) -> float:
        """E, force·length."""
        return energy_at(self.surface, self.X)

    @cached_property
    def volume(self) -> float:
        """Volume under the patches that had a pressure at the start, length³."""
        return float(patch_volumes(self.mesh.surface.moved(self.X)) @ self.mesh.loaded)

    @cached_property
    def volume_gradient(self) -> Floats:
        """(n,3) gradient of the volume, supports applied, length²."""
        loaded = self.mesh.loaded
        return weighted_gradient(self.mesh.surface, self.X, np.zeros_like(loaded), -loaded)

    @cached_property
    def highest_vertex(self) -> int:
        """Index of the vertex farthest above Π."""
        return int(self.surface.plane.height(self.X).argmax())

    @cached_property
    def height(self) -> float:
        """Height of the highest vertex over Π, length."""
        return float(self.surface.plane.height(self.X)[self.highest_vertex])

    @cached_property
    def quality(self) -> float:
        """Quality of the worst triangle outside walls that can pinch."""
        return self.mesh.quality(self.X)

    @cached_property
    def area_weights(self) -> Floats:
        """(n,) the area around each vertex over all area, over size², 1/length²."""
        area = vertex_area_vectors(self.X, self.mesh.classes.faces)[1]
        return area / (area.sum() * self.mesh.full.size**2)

    @property
    def overpulled(self) -> bool:
        """Whether a resting junction is pulled off Π harder than its wall can hold."""
        return bool(self.mesh.excess_pull(self.parameter, self.X).any())

    # -- motions -------------------------------------------------------------------------------

    @cached_property
    def aligned(self) -> Floats:
        """X (n,3) with the rows of walls below their crest; motions count from here."""
        return self.mesh.place_walls(self.X, self.space)

    def motion(self, s: Floats) -> Floats:
        """The motion Bs (n,3), in which the insides of the sheets follow their curves."""
        return self.mesh.motion(self.space, self.X, s)

    def moved(self, d: Floats) -> Floats:
        """X + d (n,3), with the rows of walls below their crest."""
        return self.mesh.place_walls(self.X + d, self.space)
