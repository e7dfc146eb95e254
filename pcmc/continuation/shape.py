"""What stays the same along a branch: faces, supports, and which junctions rest on Π."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..contact.pinching import (
    excess_pull,
    place_pinched_walls,
    place_wall_rows,
    standing_part,
)
from ..energy.functional import energy_and_gradient, patch_volumes
from ..energy.motion_space import MotionSpace, force_scale, motion_space
from ..energy.projected_hessian import Pattern, assemble, hessian_pattern
from ..meshing.quality import turns_over, worst_quality
from ..meshing.redistribution import redistribute
from ..solvers.smoother import HarmonicExtension
from ..stability.factorisation import Factor, Factoriser, factoriser
from ..stability.modes import Stiffness, full_matrix, lumped_mass
from ..surface import Surface
from ..surface.geometry import vertex_area_vectors
from ..surface.topology import SHEET
from .direction import Line, weighted_gradient

CLEAR = 1.02  # ratio of qualities that counts as better


class Shape:
    """A surface's faces and supports, with the tensions of the moment given from outside.

    Attributes
    ----------
    full : the surface as it was given.
    surface : the same without the walls that are gone where a junction rests on Π.
    classes : what its vertices lie on.
    """

    def __init__(self, surface: Surface, backend: str | None = None) -> None:
        self.full = surface
        self._part = part = standing_part(surface)
        self.surface, self.walls, self.resting = part.surface, part.walls, part.resting
        self.classes, self.quality_faces = part.classes, part.quality_faces
        self.pressed: Floats = (~surface.walls).astype(float)
        self._backend = backend
        self._extension: HarmonicExtension | None = None
        self._travels = bool(((self.classes.kind != SHEET) & ~self.surface.fixed).any())
        self._dimension: Ints | None = None

    # -- equilibrium ---------------------------------------------------------------------------

    def space(self, X: Floats) -> MotionSpace:
        """The motion space at X (n,3)."""
        return motion_space(self.surface, self.classes, X)

    def residual(self, X: Floats) -> float:
        """‖Bᵀ∇E‖ over the norm of the single triangles' forces, at X, the tensions being the first."""
        left = self.space(X).to_coordinates(energy_and_gradient(self.surface, X)[1])
        return float(np.linalg.norm(left)) / force_scale(self.surface, self.classes, X)

    def hessian(self, surface: Surface, space: MotionSpace, X: Floats) -> tuple[Floats, Factor]:
        """Values of Bᵀ(∂²E)B in the pattern, and its factor. The symbolic work is pattern.

        Raises
        ------
        SingularMatrix : a pivot is exactly zero.
        """
        if self._dimension is None or not np.array_equal(self._dimension, space.dimension):
            self._dimension = space.dimension
            self._pattern: Pattern = hessian_pattern(self.classes, space)
            self._factoriser: Factoriser = factoriser(self._pattern, self._backend)
        data = assemble(surface, self.classes, space, self._pattern, X)
        return data, self._factoriser.factor(data)

    def stiffness(self, space: MotionSpace, X: Floats, data: Floats, factor: Factor) -> Stiffness:
        """The Hessian, its mass and its inertia."""
        return Stiffness(
            space, full_matrix(self._pattern, data), lumped_mass(space, self.classes, X), factor,
            np.zeros((space.size, 0)), factor.negative,
        )  # fmt: skip

    # -- quantities ----------------------------------------------------------------------------

    def volume(self, X: Floats) -> float:
        """Volume under the patches that had a pressure at the start, length³."""
        return float(patch_volumes(self.surface.moved(X)) @ self.pressed)

    def volume_gradient(self, X: Floats) -> Floats:
        """(n,3) its gradient, supports applied, length²."""
        return weighted_gradient(self.surface, X, np.zeros_like(self.pressed), -self.pressed)

    def top(self, X: Floats) -> int:
        """The highest vertex over Π."""
        return int(self.surface.plane.height(X).argmax())

    def height(self, X: Floats) -> float:
        """Height of the highest vertex over Π, length."""
        return float(self.surface.plane.height(X).max())

    def weights(self, X: Floats) -> Floats:
        """(n,) the area around each vertex over all area, over size²."""
        area = vertex_area_vectors(X, self.classes.faces)[1]
        return area / (area.sum() * self.full.size**2)

    # -- contact of walls with Π ---------------------------------------------------------------

    def whole(self, X: Floats) -> Surface:
        """The full surface, walls that are gone laid on Π."""
        if not self.resting.any():
            return self.full.moved(X)
        return self.full.moved(place_pinched_walls(self.full, self.walls, self.resting, X))

    def down(self, X: Floats) -> Bools:
        """(n,) standing junction vertices that have come down to Π or below."""
        standing = self.walls.top_free & ~self.resting
        return standing & (self.walls.side * self.surface.plane.height(X) <= 0.0)

    def landed(self, X: Floats) -> Surface:
        """The full surface with the vertices that came down laid on Π."""
        X, down = X.copy(), self.down(X)
        normal = np.array(self.surface.plane.normal)
        X[down] -= self.surface.plane.height(X[down])[:, None] * normal
        return self.whole(place_wall_rows(self.surface, self.walls, X))

    def unheld(self, line: Line, value: float, X: Floats) -> Floats:
        """(n,) the pull on resting junction vertices beyond what their walls can hold at λ, force."""
        if not self.resting.any():
            return np.zeros(self.full.n)
        surface = line.applied(self.surface, value).moved(X)
        return excess_pull(surface, self.walls, self.resting)

    # -- triangles -----------------------------------------------------------------------------

    def quality(self, X: Floats) -> float:
        """Quality of the worst triangle outside walls that may pinch."""
        return worst_quality(X, self.quality_faces)

    def turned(self, before: Floats, after: Floats) -> bool:
        """Whether a triangle's normal has turned by more than a right angle."""
        return turns_over(before, after, self.quality_faces)

    def swept(self, X: Floats, space: MotionSpace) -> Floats:
        """X (n,3) with the rows of walls brought below their crest, within the wall."""
        return place_wall_rows(self.surface, self.walls, X, space)

    def motion(self, space: MotionSpace, X: Floats, s: Floats) -> Floats:
        """Bs (n,3), with the insides of the sheets sliding along after their curves."""
        if self._extension is None and self._travels:
            self._extension = HarmonicExtension(self.surface, self.classes, X, self._backend)
        d = space.to_vectors(s)
        return d if self._extension is None else self._extension.extend(space, d)

    def redistribute(self, X: Floats, aim: float) -> Floats | None:
        """X with its vertices spread along the shape until the worst triangle has quality ``aim``.

        The best of the sweeps; None where none is clearly better.
        """
        best, worst = redistribute(self._part, X, aim, slide=False)
        return best if worst > CLEAR * self.quality(X) else None
