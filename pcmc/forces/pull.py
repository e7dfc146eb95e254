"""How hard the sheets pull at the junctions that rest on their pinched walls, and what the walls can hold."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Bools, Floats
from ..base.tolerances import EXCESS
from ..surface import Surface
from .functional import energy_and_gradient
from .pinching import Walls


def pull_and_capacity(
    surface: Surface, walls: Walls, resting: Bools, force: Floats | None = None
) -> tuple[Floats, Floats]:
    """Pull (n,) on each resting vertex of a standing part and what the wall can take, force.

    The pull is the force of the sheets away from Π, to the vertex's own side; negative to the other.
    Lifting the vertex by dz to either side makes a wall of area ½ ℓ dz under each top edge there, ℓ
    its length along Π, so the capacity is ½ Σ α_w ℓ; the vertex rests while |pull| ≤ capacity.
    On a held bottom the pull is the force across its curve, to any side, and ℓ is taken on the bottom.
    ``force`` (n,3) is -∇E without supports, if that is known.
    """
    force = -energy_and_gradient(surface, supports=False)[1] if force is None else force
    pull = np.where(resting, walls.side * (force @ np.array(surface.plane.normal)), 0.0)
    held = resting & walls.held
    pull[held] = np.linalg.norm(walls.across_bottom(force, surface.vertices)[held], axis=1)
    ends = np.where(walls.foot >= 0, walls.foot, np.arange(surface.n))[walls.top_edges]
    start, end = surface.vertices[ends.T]
    tension = surface.tensions[walls.wall_below]
    half = 0.5 * tension * np.linalg.norm(surface.plane.along(end - start), axis=1)
    capacity = np.zeros(surface.n)
    for end in walls.top_edges.T:
        np.add.at(capacity, end, half)
    return pull, np.where(resting, capacity, 0.0)


def excess_pull(surface: Surface, walls: Walls, resting: Bools, force: Floats) -> Floats:
    """(n,) the pull on each resting vertex of a standing part beyond what its wall can take, force.

    Zero at equilibrium: a junction that is pulled harder stands off Π. Signed as the pull is.
    """
    pull, capacity = pull_and_capacity(surface, walls, resting, force)
    beyond = np.where(np.abs(pull) > capacity * (1.0 + EXCESS), np.abs(pull) - capacity, 0.0)
    return np.copysign(beyond, pull)


def pull_directions(surface: Surface, walls: Walls, resting: Bools, force: Floats) -> Floats:
    """(n,3) the unit direction to lift each vertex of a standing part: off Π, or as a held one is pulled."""
    direction = walls.side[:, None] * np.array(surface.plane.normal)
    held = resting & walls.held
    if held.any():
        across = walls.across_bottom(force, surface.vertices)
        length = np.linalg.norm(across, axis=1)
        pulled = held & (length > 0.0)
        direction[pulled] = across[pulled] / length[pulled, None]
    return direction
