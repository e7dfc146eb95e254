"""A mesh on a branch: its faces, its supports, and which junctions rest on Π."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..contact.pinching import (
    excess_pull,
    place_pinched_walls,
    place_wall_rows,
    standing_part,
)
from ..energy.motion_space import MotionSpace
from ..energy.projected_hessian import Pattern, assemble, hessian_pattern
from ..meshing.quality import turns_over, worst_quality
from ..meshing.redistribution import redistribute
from ..solvers.smoother import HarmonicExtension
from ..stability.factorisation import Factor, Factoriser, factoriser
from ..stability.modes import Stiffness, full_matrix, lumped_mass
from ..surface import Surface
from ..surface.topology import SHEET
from .direction import ParameterLine

CLEARLY_BETTER = 1.02  # ratio of the qualities of a new mesh and the old one


class BranchMesh:
    """What the points of a branch share as long as neither the mesh nor the contact with Π changes.

    Attributes
    ----------
    full : the surface with all its walls.
    surface : the surface without the walls that vanish where a junction rests on Π.
    line : the tensions and pressures as functions of the parameter λ.
    walls, resting : the walls that can pinch, and (n,) which junction vertices rest on Π.
    classes : what each vertex lies on.
    quality_faces : (k,3) the faces outside walls that can pinch.
    loaded : (patches,) 1 for the patches under pressure, 0 for walls.
    """

    def __init__(self, surface: Surface, line: ParameterLine, backend: str | None = None) -> None:
        self.full, self.line, self._backend = surface, line, backend
        self._part = part = standing_part(surface)
        self.surface, self.walls, self.resting = part.surface, part.walls, part.resting
        self.classes, self.quality_faces = part.classes, part.quality_faces
        self.loaded: Floats = (~surface.walls).astype(float)
        self._curves_move = bool(((self.classes.kind != SHEET) & ~self.surface.fixed).any())
        self._extension: HarmonicExtension | None = None
        self._dimension: Ints | None = None

    # -- the Hessian ---------------------------------------------------------------------------

    def hessian(self, surface: Surface, space: MotionSpace, X: Floats) -> tuple[Floats, Factor]:
        """Values of Bᵀ(∂²E)B in its sparsity pattern, and its factor, valid until the next call.

        Raises
        ------
        SingularMatrix : a pivot is exactly zero.
        """
        if self._dimension is None or not np.array_equal(self._dimension, space.dimension):
            self._dimension = space.dimension
            self._pattern: Pattern = hessian_pattern(self.classes, space)
            self._factoriser: Factoriser = factoriser(self._pattern, self._backend)
        values = assemble(surface, self.classes, space, self._pattern, X)
        return values, self._factoriser.factor(values)

    def stiffness(self, space: MotionSpace, X: Floats, values: Floats, factor: Factor) -> Stiffness:
        """The Hessian just factorised, with its mass and its inertia."""
        matrix, mass = full_matrix(self._pattern, values), lumped_mass(space, self.classes, X)
        no_rigid_motions = np.zeros((space.size, 0))
        return Stiffness(space, matrix, mass, factor, no_rigid_motions, factor.negative)

    # -- motions -------------------------------------------------------------------------------

    def motion(self, space: MotionSpace, X: Floats, s: Floats) -> Floats:
        """The motion Bs (n,3), in which the insides of the sheets follow their curves."""
        if self._extension is None and self._curves_move:
            self._extension = HarmonicExtension(self.surface, self.classes, X, self._backend)
        d = space.to_vectors(s)
        return d if self._extension is None else self._extension.extend(space, d)

    def place_walls(self, X: Floats, space: MotionSpace) -> Floats:
        """X (n,3) with the rows of each wall brought below its crest, within the wall."""
        return place_wall_rows(self.surface, self.walls, X, space)

    def flips(self, before: Floats, after: Floats) -> bool:
        """Whether the normal of a triangle turns by more than a right angle between two positions."""
        return turns_over(before, after, self.quality_faces)

    def redistribute(self, X: Floats, min_quality: float) -> Floats | None:
        """X (n,3) redistributed along the shape until the worst triangle has this quality.

        The best of the sweeps; None where none is clearly better.
        """
        best, worst = redistribute(self._part, X, min_quality, slide=False)
        return best if worst > CLEARLY_BETTER * self.quality(X) else None

    def quality(self, X: Floats) -> float:
        """Quality of the worst triangle outside walls that can pinch."""
        return worst_quality(X, self.quality_faces)

    # -- contact of walls with Π ---------------------------------------------------------------

    def full_surface(self, X: Floats) -> Surface:
        """The surface with all its walls; those that vanish lie on Π."""
        if not self.resting.any():
            return self.full.moved(X)
        return self.full.moved(place_pinched_walls(self.full, self.walls, self.resting, X))

    def surface_in_contact(self, X: Floats) -> Surface:
        """The full surface, with the vertices that came down to Π placed on it."""
        X, down = X.copy(), self.reaches_plane(X)
        normal = np.array(self.surface.plane.normal)
        X[down] -= self.surface.plane.height(X[down])[:, None] * normal
        return self.full_surface(place_wall_rows(self.surface, self.walls, X))

    def reaches_plane(self, X: Floats) -> Bools:
        """(n,) bool, junction vertices that stood off Π and are now on it or beyond."""
        standing_off = self.walls.top_free & ~self.resting
        return standing_off & (self.walls.side * self.surface.plane.height(X) <= 0.0)

    def excess_pull(self, value: float, X: Floats) -> Floats:
        """(n,) the pull on resting junction vertices beyond what their walls can hold at λ, force."""
        if not self.resting.any():
            return np.zeros(self.full.n)
        pulled = self.line.surface_at(self.surface, value).moved(X)
        return excess_pull(pulled, self.walls, self.resting)
