"""Changed room pressures: the walls between the rooms take the new differences."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from ..base.arrays import Floats
from . import Surface

ALIKE = 1e-12  # of the largest change; smaller differences are rounding


def with_pressures(
    surface: Surface,
    tensions: Mapping[str, float] | None = None,
    pressures: Mapping[str, float] | None = None,
    *,
    weights: Mapping[str, float] | None = None,
    snows: Mapping[str, float] | None = None,
    cables: Mapping[str, float] | None = None,
    volumes: Mapping[str, float] | None = None,
) -> Surface:
    """``surface.retensioned``, with the pressures of walls updated to those of their rooms.

    A wall's pressure is the difference of its two rooms' pressures. It changes with that difference,
    unless ``pressures`` names the wall itself. Its snow is the difference of that over its rooms, in the same
    way: none where both carry the same.

    Raises
    ------
    SurfaceError : an edge under one of the ``snows`` is free; see ``Surface.with_snow``.

    >>> from pcmc.plan import Divider, Plan
    >>> hall = Plan([[0, 0], [8, 0], [8, 4], [0, 4]], [Divider([[4, 0], [4, 4]])], edge_length=1.0,
    ...             patches={"west": {"tension": 4.0}, "east": {"tension": 4.0}}).surface()
    >>> with_pressures(hall, None, {"west": 1.25}).pressures.tolist()
    [1.25, 1.0, 0.25]
    """
    changed = surface.retensioned(
        tensions, pressures, weights=weights, snows=snows, cables=cables, volumes=volumes
    )
    walls = _followed(surface, surface.pressures, changed.pressures, pressures)
    under = _followed(surface, surface.snows, changed.snows, snows)
    if walls or under:
        changed = changed.retensioned(None, walls, {**walls, **under}, snows=under)
    return changed.with_held_snow() if snows else changed


def _followed(
    surface: Surface, old: Floats, new: Floats, given: Mapping[str, float] | None
) -> dict[str, float]:
    """The values of walls that follow from those of the patches (k,); by name, without walls in ``given``."""
    follow = wall_pressure_changes(surface, new - old, {surface.patch_index(name) for name in given or ()})
    return {surface.patches[k].name: float(old[k] + follow[k]) for k in np.flatnonzero(follow)}


def wall_pressure_changes(surface: Surface, change: Floats, named: Collection[int] = ()) -> Floats:
    """(k,) changes of the walls' pressures that follow from the changes ``change`` (k,) of the patches'.

    The changes cancel along the edges where one wall meets two sheets. They are 0 for the walls in
    ``named``, and for a wall that stands between different rooms along its length.
    """
    follow = np.zeros(len(surface.patches))
    wall = surface.walls.copy()
    wall[list(named)] = False
    if not change.any() or not wall.any():
        return follow
    topo = surface.topology
    edge, sense = topo.edge_of_face.ravel(), topo.sense.ravel()
    patch = np.repeat(surface.patch_of_face, 3)
    below, count = wall[patch], len(topo.edges)
    left = np.bincount(edge[~below], (change[patch] * sense)[~below], count)
    sheets = np.bincount(edge[~below], minlength=count)
    walls = np.bincount(edge[below], minlength=count)
    top = below & (walls[edge] == 1) & (sheets[edge] == 2)
    wanted = -left[edge[top]] * sense[top]
    least, most = np.full((2, len(follow)), [[np.inf], [-np.inf]])
    np.minimum.at(least, patch[top], wanted)
    np.maximum.at(most, patch[top], wanted)
    one = np.isfinite(least) & (most - least <= ALIKE * np.abs(change).max())
    follow[one] = most[one]
    return follow
