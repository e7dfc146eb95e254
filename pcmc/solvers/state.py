"""Where the geometric solver stands on one mesh: shape, frames, residual, and what rests on Π."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..contact.pinching import (
    Walls,
    crest_spacing,
    excess,
    find_walls,
    lifted,
    place_wall_rows,
    resting,
    settled,
    standing,
)
from ..energy.functional import energy_and_gradient, energy_at
from ..energy.motion_space import MotionSpace, force_scale, motion_space
from ..meshing.quality import compare, worst_quality
from ..meshing.redistribution import redistribute
from ..surface import Surface

LOW = 5e-3  # height, in spacings along the crest, at which a sinking junction is set to rest
LIFT = 5e-2  # height, in the same, to which one that rests is lifted at first
CAUTION = 0.25  # by which both are multiplied each time that a vertex is lifted again
POOR = 2 / 3  # of the quality that is cared for: once spreading has failed, what is left to mend
CARES = 60  # times that the vertices are spread at most
RELEASES = 30  # times that resting junctions are lifted at most


class State:
    """One mesh: the surface as it stands, and how it may move.

    Attributes
    ----------
    full, surface : all of the mesh as it last was; the part of it that stands (see ``contact``).
    standing : that part with its walls, and what lies on what.
    size : of the mesh at the start.
    X : (n,3) where the standing surface is now.
    rests : (n,) junction vertices at rest on Π.
    classes, space : what each vertex lies on, and the basis of its motion there.
    energy, gradient, residual, norm, scale : E, ∇E, Bᵀ∇E, its norm and the forces it compares with.
    version : changes whenever the faces or the number of unknowns do.
    evaluations : passes over the triangles so far: E, ∇E or its derivative along a motion.
    """

    def __init__(self, surface: Surface, min_quality: float) -> None:
        self.full = surface
        self.min_quality, self.size = min_quality, surface.size
        self.walls: Walls = find_walls(surface)
        self.spacing = crest_spacing(surface, self.walls)
        self.evaluations = 0
        self.version = 0
        self.cares, self.releases = CARES, RELEASES
        self.caution: Floats = np.ones(surface.n)  # less where a vertex has been lifted in vain
        self._care_from, self._care_below = (
            min_quality,
            np.inf,
        )  # quality and residual that ask for it
        self._pinch(resting(surface, self.walls))

    def _pinch(self, rests: Bools) -> None:
        self.standing = found = standing(self.full, self.walls, rests)
        self.rests, self.surface, self.classes = rests, found.surface, found.classes
        self.judged: Ints = found.judged
        self.X: Floats = self.surface.vertices.copy()
        self.version += 1
        self.space: MotionSpace = motion_space(self.surface, self.classes, self.X)
        self.measure()

    def measure(self) -> None:
        """Energy, gradient, frames and residual where the surface stands."""
        self.energy, self.gradient = energy_and_gradient(self.surface, self.X)
        self.evaluations += 1
        before = self.space.dimension
        self.space = motion_space(self.surface, self.classes, self.X)
        if not np.array_equal(before, self.space.dimension):
            self.version += 1
        self.scale = force_scale(self.surface, self.classes, self.X)
        self.residual = self.space.to_coordinates(self.gradient)
        self.norm = float(np.linalg.norm(self.residual))

    def energy_at(self, X: Floats) -> float:
        """E of the standing surface at X."""
        self.evaluations += 1
        return energy_at(self.surface, X)

    @property
    def relative(self) -> float:
        """The residual relative to its scale."""
        return self.norm / self.scale

    @property
    def worst(self) -> float:
        """Quality of the worst triangle outside walls that may pinch."""
        return worst_quality(self.X, self.judged)

    def result_surface(self) -> Surface:
        """The whole surface as it stands, vanished walls on the junction that rests."""
        if not self.rests.any():
            return self.full.moved(self.X)
        return self.full.moved(settled(self.full, self.walls, self.rests, self.X))

    def move(self, X: Floats, down: Bools) -> None:
        """Go to X; crests that came ``down`` rest from now on."""
        self.X = X
        if down.any():
            self.full = self.result_surface()
            self._pinch(self.rests | down)
        else:
            self.measure()

    def go_back(self, X: Floats, version: int) -> None:
        """Stand at X again, where that belongs to the present mesh; all else is measured anew."""
        if version == self.version:
            self.X = X
        self.measure()

    def moved_by(self, d: Floats) -> tuple[Floats, Bools]:
        """X + d and the crests it brings down to Π, which it leaves there.

        The rows of a wall follow its crest in proportion to its height.
        """
        X = self.X + d
        standing = self.walls.can_rest & ~self.rests
        if not standing.any():
            return X, standing
        height = self.surface.plane.height(X)
        above = self.walls.side * height
        sinks = above < self.walls.side * self.surface.plane.height(self.X)
        low = LOW * self.caution * self.spacing
        down = standing & ((above <= 0.0) | (sinks & (above <= low)))
        X[down] -= height[down, None] * np.array(self.surface.plane.normal)
        X = place_wall_rows(self.surface, self.walls, X, self.space)
        return X, down

    def spoils(self, X: Floats) -> bool:
        """Whether the move to X turns a triangle over or makes the worst one much worse.

        The triangles of walls that may pinch are not judged: there a vanishing height is the answer.
        """
        turned, before, after = compare(self.X, X, self.judged)
        return turned or after < 0.7 * min(before, self.min_quality)

    def maintain_mesh(self) -> bool:
        """Spread the vertices along the shape while triangles are poor; True if they moved."""
        start = self.worst
        if self.cares <= 0 or start >= self._care_from:
            return False
        if not 1e-7 <= self.relative < self._care_below:
            return False
        self.cares -= 1
        best, worst = redistribute(self.standing, self.X, self.min_quality, slide=True)
        if worst <= 1.02 * start:
            self._care_from = POOR * self.min_quality
            self._care_below = 0.1 * self.relative
            return False
        self.X = best
        self.measure()
        return True

    def overpull(self) -> Floats:
        """(n,) the pull on resting vertices beyond what the wall can hold, force; see ``excess``."""
        return excess(self.surface.moved(self.X), self.walls, self.rests)

    def seen_anew(self) -> bool:
        """Whether what stands, seen from the positions reached, is other than what was solved for.

        A foot that has come below its crest is one with it from then on.
        """
        full = self.result_surface()
        anew = replace(find_walls(full), side=self.walls.side)
        same = np.array_equal(standing(full, anew, self.rests).surface.faces, self.surface.faces)
        if same or self.releases <= 0:
            return False
        self.releases -= 1
        self.full, self.walls = full, anew
        self._pinch(self.rests)
        return True

    def release(self) -> bool:
        """Lift the resting vertices that the sheets pull harder than the wall can hold, to their side."""
        beyond = self.overpull()
        free = beyond != 0.0
        if self.releases <= 0 or not free.any():
            return False
        self.releases -= 1
        side = np.where(beyond < 0.0, -self.walls.side, self.walls.side)
        self.walls = replace(self.walls, side=side)
        self.full = lifted(self.result_surface(), self.walls, free, LIFT * self.caution)
        self.caution[free] *= CAUTION
        self._pinch(self.rests & ~free)
        return True
