"""The state of the geometric solver on one mesh: positions, residual, and what rests on Π."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base.arrays import Bools, Floats
from ..base.tolerances import ROOM_VOLUME
from ..forces.functional import energy_at
from ..forces.loose_parts import rounding_left
from ..forces.pinching import (
    StandingPart,
    lift,
    part_by_positions,
    pull_directions,
    standing_part,
    top_spacing,
)
from ..forces.rooms import closing_volumes, room_volume_gradients, room_volumes, with_room_pressures
from ..forces.wall_rows import Walls, find_walls
from ..meshing.elevation import blended, flat_places
from ..meshing.quality import edge_lengths, redistribute, turns_over, worst_quality
from ..stability.equilibrium import Equilibrium
from ..surface import Surface
from ..surface.checks import reachable
from ..surface.geometry import vertex_area_vectors
from ..surface.supports import apply_supports, onto_circles
from ..surface.topology import CURVE, SHEET

LOW = 5e-3  # height, in spacings along the junction, at which a sinking vertex is set to rest
LIFT = 5e-2  # height, in the same, to which a resting vertex is lifted the first time
DAMPING = 0.25  # factor on both, each time that the vertex is lifted again
RETRY = 2 / 3  # of the quality aimed at: below this redistribution is tried again after it has failed
REDISTRIBUTIONS = 60  # the most of them
VOLUME_STEPS = 4  # the most corrections of the volumes after a move
BLENDED = 1e-4  # of an edge: the insides of curved elements follow their edges to this
RELEASES = 30  # the most times that resting junctions are lifted or walls are updated


class SolverState:
    """One mesh with the positions reached, and how it may move.

    ``at`` is the standing part at the positions reached, ``size`` that of the start. ``version`` changes
    whenever the faces or the number of unknowns do. ``evaluations`` counts passes over the triangles: for E,
    ∇E or its derivative along a motion.
    """

    def __init__(
        self, surface: Surface, min_quality: float, held: bool = False, backend: str | None = None
    ) -> None:
        # nodes stay where they are in elements, and vertices of a periodic surface along it
        self.min_quality = 0.0 if surface.order > 1 or surface.periodic else min_quality
        self.size, self.backend = surface.size, backend
        self.pressures = np.zeros(len(surface.rooms))  # (r,) δ, their changes since the start
        part = part_by_positions(surface, held) if held else standing_part(surface)
        self.held = bool(part.walls.held.any())  # whether walls with held bottoms can pinch, too
        self.spacing = top_spacing(surface, part.walls)
        self.evaluations = self.version = 0
        self._redistributions_left, self._releases_left = REDISTRIBUTIONS, RELEASES
        self._damping: Floats = np.ones(surface.n)  # smaller where a vertex has been lifted in vain
        self._poor_quality, self._small_residual = min_quality, np.inf  # redistribution is due below these
        self._take(part)

    def _take(self, part: StandingPart) -> None:
        """Go on with another standing part, where it is."""
        self.at = Equilibrium(part, part.surface.vertices, self.backend)
        self.quality_faces = part.quality_faces
        self.rounding = rounding_left(part.surface, part.classes, self.at.X)  # of the residual, about
        self._at_rest: StandingPart | None = None  # of the surface reached, once nothing changes any more
        self.version += 1
        self.evaluations += 1

    def go_to(self, X: Floats) -> None:
        """Be at the positions X (n,3)."""
        before, self.at, self._at_rest = self.at, self.at.at(X), None
        self.evaluations += 1
        if not np.array_equal(before.space.dimension, self.at.space.dimension):
            self.version += 1

    @property
    def walls(self) -> Walls:
        return self.at.part.walls

    @property
    def resting(self) -> Bools:
        return self.at.part.resting

    @property
    def energy(self) -> float:
        """E, or where rooms prescribe volumes the Lagrangian, E at the first pressures - Σ δ (V - V̄)."""
        return self.at.energy + self._multiplied()

    def energy_at(self, X: Floats) -> float:
        """The same at X."""
        self.evaluations += 1
        return energy_at(self.at.surface, X) + self._multiplied()

    def _multiplied(self) -> float:
        """Σ δ V̄, without the parts of the volumes that E does not see."""
        if not len(self.pressures):
            return 0.0
        return float(self.pressures @ (self.at.wanted_volumes - closing_volumes(self.at.surface)))

    def change_pressures(self, change: Floats) -> None:
        """Change the rooms' pressures by δ (r,)."""
        if len(change):
            self.pressures = self.pressures + change
            part = self.at.part.with_values(lambda surface: with_room_pressures(surface, change))
            self.at = self.at.at(self.at.X, part)

    def keep_volumes(self, X: Floats) -> Floats:
        """X (n,3) moved evenly along the normals until each room has the volume that it has now."""
        if not len(self.pressures):
            return X
        surface, wanted = self.at.surface, self.at.volume_defects + self.at.wanted_volumes
        area = vertex_area_vectors(X, self.at.classes.faces, self.at.classes.topology.faces)[1]
        for _ in range(VOLUME_STEPS):
            left = wanted - room_volumes(surface, X)
            if (np.abs(left) <= ROOM_VOLUME * np.abs(self.at.wanted_volumes)).all():
                break
            G = room_volume_gradients(surface, X)
            even = G / np.where(area > 0.0, area, 1.0)[:, None]
            small = np.einsum("rnd,snd->rs", G, even)
            X = X + surface.spread(np.tensordot(np.linalg.lstsq(small, left)[0], even, axes=1))
        return onto_circles(surface, X)

    @property
    def quality(self) -> float:
        """Quality of the worst triangle outside walls that can pinch."""
        return worst_quality(self.at.X, self.quality_faces)

    def result_surface(self, X: Floats | None = None) -> Surface:
        """The whole surface at X, with pinched walls placed on their resting junctions."""
        if X is None and self._at_rest is not None:
            return self._at_rest.keep().whole
        return self.at.part.whole_at(self.at.X if X is None else X)

    def move(self, X: Floats, down: Bools) -> None:
        """Go to X; the junction vertices ``down`` rest from now on."""
        if down.any():
            self._take(StandingPart.of(self.result_surface(X), self.walls, self.resting | down))
        else:
            self.go_to(X)

    def displaced(self, d: Floats) -> tuple[Floats, Bools]:
        """X + d with walls following, and the junction vertices that it brings down to Π, placed there."""
        part = self.at.part
        X = onto_circles(part.surface, self.at.X + d)
        if not part.standing.any():
            return X, part.standing
        down = part.coming_down(X, self.at.X, LOW * self._damping * self.spacing)
        if not down.any() and part.hardly_moves(self.at.X, X):
            return X, down
        return part.landed(X, down, self.at.space, self.at.X), down

    def spoils_triangles(self, X: Floats) -> bool:
        """Whether the move to X turns a triangle over, makes the worst much worse or leads too far out."""
        if not reachable(X) or turns_over(self.at.X, X, self.quality_faces):
            return True
        return worst_quality(X, self.quality_faces) < 0.7 * min(self.quality, self.min_quality)

    def maintain_mesh(self) -> bool:
        """Redistribute the vertices along the shape while triangles are poor; True if they moved.

        Of curved elements the insides follow the edges: where junctions bend, their maps stay smooth.
        """
        if self.at.surface.order > 1:
            surface, X, kind = self.at.surface, self.at.X, self.at.classes.kind
            if surface.order == 2 or self.at.residual < 1e-7:
                return False

            def slide(d: Floats) -> Floats:
                return apply_supports(surface, d - self.at.space.project(d), X)

            even = X + slide(np.where((kind == CURVE)[:, None], flat_places(surface, X) - X, 0.0))
            d = slide(blended(surface, even, (kind != SHEET) | (self.at.space.dimension == 0)) - X)
            if np.abs(d).max() <= BLENDED * np.median(edge_lengths(self.at.shape)):
                return False
            self.go_to(X + d)
            return True
        if self.at.surface.periodic:
            return False
        start, residual = self.quality, self.at.residual
        due = start < self._poor_quality and 1e-7 <= residual < self._small_residual
        if not due or self._redistributions_left <= 0:
            return False
        self._redistributions_left -= 1
        X, quality = redistribute(self.at.part, self.at.X, self.min_quality, slide=True)
        if quality <= 1.02 * start:
            self._poor_quality, self._small_residual = RETRY * self.min_quality, 0.1 * residual
            return False
        self.go_to(X)
        return True

    def update_walls(self) -> bool:
        """Find the walls and the standing part anew at X; False if its faces are the same.

        A wall's foot that has come straight below a resting vertex coincides with it from then on.
        """
        whole = self.result_surface()
        walls = replace(find_walls(whole, self.held), side=self.walls.side)
        part = StandingPart.of(whole, walls, self.resting)
        if np.array_equal(part.surface.faces, self.at.surface.faces) or self._releases_left <= 0:
            if not self.held or (self.resting & walls.held).any():  # else no surface alone shows these walls
                self._at_rest = part
            return False
        self._releases_left -= 1
        self._take(part)
        return True

    def lift_overpulled(self) -> bool:
        """Lift resting vertices that are pulled harder than their walls can take, to the side of the pull.

        A wall that was lifted before comes up straight: as bent as it was, it could cost more than the pull
        gains, and be brought down again without end.
        """
        excess, resting = self.at.excess_pull, self.resting
        lifted = excess != 0.0
        if self._releases_left <= 0 or not lifted.any():
            return False
        self._releases_left -= 1
        walls = replace(self.walls, side=np.where(excess < 0.0, -self.walls.side, self.walls.side))
        sides = replace(self.at.part_here, walls=walls)
        directions = pull_directions(sides, -self.at.gradient_with_reactions)
        again, rows = lifted & (self._damping < 1.0), walls.rows
        bent = ~again[rows.top_ends].any(axis=1)
        walls = replace(walls, rows=replace(rows, offset=rows.offset * bent[:, None]))
        whole = lift(self.result_surface(), walls, lifted, LIFT * self._damping, directions)
        self._damping[lifted] *= DAMPING
        self._take(StandingPart.of(whole, walls, resting & ~lifted))
        return True
