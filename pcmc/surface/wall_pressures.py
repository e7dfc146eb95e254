"""Rooms of other pressures: the walls between them carry what the difference becomes."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from ..base.arrays import Floats
from . import Surface

ALIKE = 1e-12  # of the largest change: what rounding leaves


def with_pressures(
    surface: Surface,
    tensions: Mapping[str, float] | None = None,
    pressures: Mapping[str, float] | None = None,
) -> Surface:
    """``surface.retensioned``, where walls follow the pressures of the rooms that they stand between.

    A wall carries the pressure of one room less that of the other; it changes by what that difference
    changes by, unless ``pressures`` names the wall itself.

    >>> from pcmc.plan import Divider, Plan
    >>> hall = Plan([[0, 0], [8, 0], [8, 4], [0, 4]], [Divider([[4, 0], [4, 4]])], edge_length=1.0,
    ...             patches={"west": {"tension": 4.0}, "east": {"tension": 4.0}}).surface()
    >>> with_pressures(hall, None, {"west": 1.25}).pressures.tolist()
    [1.25, 1.0, 0.25]
    """
    changed = surface.retensioned(tensions, pressures)
    named = {surface.patch_index(name) for name in pressures or ()}
    follow = wall_pressure_changes(surface, changed.pressures - surface.pressures, named)
    walls = {
        surface.patches[k].name: float(surface.pressures[k] + follow[k])
        for k in np.flatnonzero(follow)
    }
    return changed.retensioned(None, walls, walls) if walls else changed


def wall_pressure_changes(surface: Surface, change: Floats, named: Collection[int] = ()) -> Floats:
    """(k,) by what the pressures of walls change where those of the patches change by ``change`` (k,).

    Such that along the edges where one wall meets two sheets the changes cancel. 0 for the walls in
    ``named``, and for a wall between different rooms along its length, which has no one pressure.
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
