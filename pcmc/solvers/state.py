"""The state of the geometric solver on one mesh: positions, frames, residual, and what rests on Π."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..contact.pinching import (
    StandingPart,
    Walls,
    coming_down,
    find_walls,
    lift,
    place_pinched_walls,
    place_wall_rows,
    put_down,
    remove_pinched_walls,
    resting_vertices,
    slide_over_feet,
    standing_part,
    top_spacing,
)
from ..contact.pull import excess_pull, pull_directions
from ..forces.functional import energy_and_gradient, energy_at, onto_circles
from ..forces.loose_parts import relative_forces, rounding_left
from ..forces.motion_space import MotionSpace, force_scale, motion_space
from ..forces.rooms import (
    closing_volumes,
    prescribed_volumes,
    volume_gradients_at,
    volumes_at,
    with_room_pressures,
)
from ..meshing.quality import compare, redistribute, worst_quality
from ..surface import Surface
from ..surface.checks import reachable
from ..surface.geometry import vertex_area_vectors

LOW = 5e-3  # height, in spacings along the junction, at which a sinking vertex is set to rest
LIFT = 5e-2  # height, in the same, to which a resting vertex is lifted the first time
DAMPING = 0.25  # factor on both, each time that the vertex is lifted again
POOR = 2 / 3  # of the quality aimed at: below this redistribution is tried again after it has failed
REDISTRIBUTIONS = 60  # the most of them
VOLUME_STEPS = 4  # the most corrections of the volumes after a move
VOLUME_LEFT = 1e-10  # of a volume: corrected up to here
RELEASES = 30  # the most times that resting junctions are lifted or walls are updated


class State:
    """One mesh with the positions reached, and how it may move.

    Attributes
    ----------
    full : the whole surface when its walls were last pinched or lifted.
    part, surface, walls, resting, classes : its standing part; see ``StandingPart``.
    quality_faces : (k,3) the faces whose quality counts.
    held : whether walls with held bottoms can pinch, too.
    size : of the mesh at the start.
    X : (n,3) the positions reached.
    space : the motion space there.
    energy, gradient, residual, norm, scale : E, ∇E, Bᵀ∇E, its norm, and the norm of the single
        triangles' forces to compare with. Of several loose parts the worst counts, as if it were all.
        Where rooms prescribe volumes, E is the Lagrangian, E at the first pressures - Σ δ (V - V̄), and
        the norm takes in the defects of the volumes, times ``volume_units``.
    pressures : (r,) δ, the changes of the rooms' pressures since the start.
    wanted_volumes : (r,) V̄.
    defects, volume_gradients : (r,) V - V̄ and (r,n,3) ∂V/∂X.
    volume_units : (r,) scale / |V̄|, which brings a defect to the size of forces.
    rounding : what rounding of the coordinates alone leaves of the relative residual, about.
    version : changes whenever the faces or the number of unknowns do.
    evaluations : passes over the triangles so far: E, ∇E or its derivative along a motion.
    """

    def __init__(self, surface: Surface, min_quality: float, held: bool = False) -> None:
        self.full = surface
        self.pressures = np.zeros(len(surface.rooms))
        self.wanted_volumes = prescribed_volumes(surface)
        self.min_quality, self.size = min_quality, surface.size
        part = standing_part(surface)
        if held:
            walls = find_walls(surface, held)
            part = StandingPart.of(surface, walls, resting_vertices(surface, walls))
        self.held = bool(part.walls.held.any())
        self.spacing = top_spacing(surface, part.walls)
        self.evaluations = 0
        self.version = 0
        self._redistributions_left, self._releases_left = REDISTRIBUTIONS, RELEASES
        self._damping: Floats = np.ones(surface.n)  # smaller where a vertex has been lifted in vain
        self._poor_quality, self._small_residual = min_quality, np.inf  # redistribution is due below these
        self._take(part)

    def _take(self, part: StandingPart) -> None:
        """Go on with this standing part of ``full``."""
        self.part, self.surface = part, part.surface
        self.walls: Walls = part.walls
        self.resting, self.classes = part.resting, part.classes
        self.quality_faces: Ints = part.quality_faces
        self.X: Floats = self.surface.vertices.copy()
        self.rounding = rounding_left(self.surface, self.classes, self.X)
        self.version += 1
        self.space: MotionSpace = motion_space(self.surface, self.classes, self.X)
        self.measure()

    def measure(self) -> None:
        """Compute energy, gradient, frames and residual at X."""
        self.energy, self.gradient = energy_and_gradient(self.surface, self.X)
        self.evaluations += 1
        before = self.space.dimension
        self.space = motion_space(self.surface, self.classes, self.X)
        if not np.array_equal(before, self.space.dimension):
            self.version += 1
        self.scale = force_scale(self.surface, self.classes, self.X)
        self.residual = self.space.to_coordinates(self.gradient)
        self.norm = float(np.linalg.norm(self.residual))
        if self.surface.topology.components.any():
            left = self.space.to_vectors(self.residual)
            self.norm = self.scale * relative_forces(self.surface, self.classes, self.X, left)
        if len(self.pressures):
            self._measure_rooms()

    def _measure_rooms(self) -> None:
        """Take the rooms' volumes into the energy and the norm."""
        self.energy += self._multiplied()
        self.defects = volumes_at(self.surface, self.X) - self.wanted_volumes
        self.volume_gradients = volume_gradients_at(self.surface, self.X)
        self.volume_units = self.scale / np.abs(self.wanted_volumes)
        self.norm = float(np.hypot(self.norm, np.linalg.norm(self.volume_units * self.defects)))

    def _multiplied(self) -> float:
        """Σ δ V̄, without the parts of the volumes that E does not see."""
        return float(self.pressures @ (self.wanted_volumes - closing_volumes(self.surface)))

    def volume_columns(self) -> Floats:
        """(N,r) the gradients of the volumes in the motion space, in units of force."""
        columns = [self.space.to_coordinates(g) for g in self.volume_gradients]
        return np.stack(columns, axis=1) * self.volume_units

    def energy_at(self, X: Floats) -> float:
        """E of the standing surface at X, or the Lagrangian."""
        self.evaluations += 1
        value = energy_at(self.surface, X)
        return value + self._multiplied() if len(self.pressures) else value

    def change_pressures(self, change: Floats) -> None:
        """Change the rooms' pressures by δ (r,); measure afterwards, or move."""
        if not len(change):
            return
        self.pressures = self.pressures + change
        self.full = with_room_pressures(self.full, change)
        self.surface = with_room_pressures(self.surface, change)
        self.part = replace(self.part, surface=self.surface)

    def keep_volumes(self, X: Floats) -> Floats:
        """X (n,3) moved evenly along the normals until each room has the volume that it has now."""
        if not len(self.pressures):
            return X
        wanted = self.defects + self.wanted_volumes
        area = vertex_area_vectors(X, self.classes.faces)[1]
        for _ in range(VOLUME_STEPS):
            left = wanted - volumes_at(self.surface, X)
            if (np.abs(left) <= VOLUME_LEFT * np.abs(self.wanted_volumes)).all():
                break
            G = volume_gradients_at(self.surface, X)
            even = G / np.where(area > 0.0, area, 1.0)[:, None]
            small = np.einsum("rnd,snd->rs", G, even)
            X = X + np.tensordot(np.linalg.lstsq(small, left)[0], even, axes=1)
        return onto_circles(self.surface, X)

    @property
    def relative(self) -> float:
        """The residual relative to its scale."""
        return self.norm / self.scale

    @property
    def quality(self) -> float:
        """Quality of the worst triangle outside walls that can pinch."""
        return worst_quality(self.X, self.quality_faces)

    def result_surface(self, X: Floats | None = None) -> Surface:
        """The whole surface at X, with pinched walls placed on their resting junctions."""
        X = self.X if X is None else X
        if self.resting.any():
            X = place_pinched_walls(self.full, self.walls, self.resting, X)
        return self.full.moved(X)

    def move(self, X: Floats, down: Bools) -> None:
        """Go to X; the junction vertices ``down`` rest from now on."""
        self.X = X
        if down.any():
            self.full = self.result_surface()
            self._take(StandingPart.of(self.full, self.walls, self.resting | down))
        else:
            self.measure()

    def displaced(self, d: Floats) -> tuple[Floats, Bools]:
        """X + d, and the junction vertices that this brings down to Π, where they are placed.

        The rows of a wall follow its junction.
        """
        X = onto_circles(self.surface, self.X + d)
        standing = self.walls.top_free & ~self.resting
        if not standing.any():
            return X, standing
        low = LOW * self._damping * self.spacing
        down = coming_down(self.surface, self.walls, standing, self.X, X, low)
        X = put_down(self.surface, self.walls, X, down)
        X = slide_over_feet(self.walls, X, standing & ~down, self.space)
        X = place_wall_rows(self.surface, self.walls, X, self.space)
        return X, down

    def spoils_triangles(self, X: Floats) -> bool:
        """Whether the move to X turns a triangle over, makes the worst one much worse or leads too far out.

        Triangles of walls that can pinch do not count: their height may vanish.
        """
        if not reachable(X):
            return True
        turned, before, after = compare(self.X, X, self.quality_faces)
        return turned or after < 0.7 * min(before, self.min_quality)

    def maintain_mesh(self) -> bool:
        """Redistribute the vertices along the shape while triangles are poor; True if they moved."""
        start = self.quality
        due = start < self._poor_quality and 1e-7 <= self.relative < self._small_residual
        if not due or self._redistributions_left <= 0:
            return False
        self._redistributions_left -= 1
        X, quality = redistribute(self.part, self.X, self.min_quality, slide=True)
        if quality <= 1.02 * start:
            self._poor_quality = POOR * self.min_quality
            self._small_residual = 0.1 * self.relative
            return False
        self.X = X
        self.measure()
        return True

    def excess_pull(self) -> Floats:
        """(n,) the pull on resting vertices beyond what their walls can take, force."""
        return excess_pull(self.surface.moved(self.X), self.walls, self.resting)

    def update_walls(self) -> bool:
        """Find the walls and the standing part anew at X; False if its faces are the same.

        A wall's foot that has come straight below a resting vertex coincides with it from then on.
        """
        full = self.result_surface()
        walls = replace(find_walls(full, self.held), side=self.walls.side)
        standing = remove_pinched_walls(full, walls, self.resting).faces
        if np.array_equal(standing, self.surface.faces) or self._releases_left <= 0:
            return False
        self._releases_left -= 1
        self.full = full
        self._take(StandingPart.of(full, walls, self.resting))
        return True

    def lift_overpulled(self) -> bool:
        """Lift resting vertices that are pulled harder than their walls can take, to the side of the pull."""
        excess = self.excess_pull()
        lifted = excess != 0.0
        if self._releases_left <= 0 or not lifted.any():
            return False
        self._releases_left -= 1
        walls = replace(self.walls, side=np.where(excess < 0.0, -self.walls.side, self.walls.side))
        directions = pull_directions(self.surface.moved(self.X), walls, self.resting)
        self.full = lift(self.result_surface(), walls, lifted, LIFT * self._damping, directions)
        self._damping[lifted] *= DAMPING
        self._take(StandingPart.of(self.full, walls, self.resting & ~lifted))
        return True
