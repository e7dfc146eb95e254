"""Example 1 with its wall held, also pressed onto its bottom, and what rests there."""

import numpy as np
from shapes import placed, rotation
from starts import two_squares, uneven

from pcmc.forces.functional import energy_and_gradient
from pcmc.forces.pinching import StandingPart, pull_and_capacity, pull_directions, resting_vertices
from pcmc.forces.wall_rows import find_walls


def held(surface):
    """The same surface with the bottoms of its walls fixed."""
    return surface.rebuilt(fixed=surface.held)


def example(n, alpha_aux, right=2.0):
    """Example 1 with its wall held, and a right patch of another tension."""
    return held(two_squares(n, alpha_aux=alpha_aux)).retensioned({"right": right})


def contact(surface):
    """Which vertices rest, their pull, and what their wall can take."""
    walls = find_walls(surface)
    resting = resting_vertices(surface, walls)
    return resting, *pull_and_capacity(StandingPart.of(surface, walls, resting))


def directions_of_pull(part):
    """As the sheets pull."""
    return pull_directions(part, -energy_and_gradient(part.surface, supports=False)[1])


def elsewhere(surface, seed=0):
    """The surface turned and moved, its plane with it."""
    R, shift = rotation(seed), np.array([3.0, -1.0, 2.0])
    return placed(surface, R, shift)


def pressed(n=6, count=2, right=2.0, drop=0.0):
    """Example 1, its junction pressed onto the held bottom at the first ``count`` vertices from one end.

    The pressure right of the wall is less by ``drop``.
    """
    surface = uneven(example(n, 3.0, right), drop)
    walls = find_walls(surface, held=True)
    free = np.flatnonzero(walls.top_free)
    resting = np.zeros(surface.n, dtype=bool)
    resting[free[np.argsort(surface.vertices[free, 1])][:count]] = True
    standing = StandingPart.of(surface, walls, resting).surface
    full = surface.moved(StandingPart.of(surface, walls, resting).whole_positions(standing.vertices))
    return full, find_walls(full), resting, standing
