"""A surface in a few lines of text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

NAMED = 6  # patches, cables or rooms that are named


def summary(surface: Any) -> str:
    """Of a Surface: size, patches, walls, cables, rooms, supports and heights, a line each."""
    patches = [
        f"{p.name} (tension {p.tension:g}, pressure {p.pressure:g}{f', snow {p.snow:g}' * bool(p.snow)})"
        for p in surface.patches
    ]
    parts = {
        "patches": [patches[k] for k in np.flatnonzero(~surface.walls)],
        "walls": [patches[k] for k in np.flatnonzero(surface.walls)],
        "cables": [
            f"{cable.name} (tension {cable.tension:g}{f', weight {cable.weight:g}' * bool(cable.weight)})"
            for cable in surface.cables
        ],
        "rooms": [f"{room.name} (volume {room.volume:g})" for room in surface.rooms],
        "planes": [str(plane) for plane, _ in surface.on_planes],
    }
    height, fixed = surface.plane.height(surface.vertices), surface.pinned.sum()
    lines = [
        f"Surface of {surface.m} triangles and {surface.n} vertices, {surface.size:.4g} across",
        *(f"  {name}: {listed(texts)}" for name, texts in parts.items() if texts),
        f"  supports: {fixed} vertices fixed, {surface.held.sum() - fixed} sliding",
        f"  heights over the plane: {height.min():.4g} to {height.max():.4g}",
    ]
    return "\n".join(lines)


def listed(texts: Sequence[str]) -> str:
    """The first few, and how many more there are.

    >>> listed("abcdefgh")
    'a, b, c, d, e, f, and 2 more'
    """
    more = f", and {len(texts) - NAMED} more" if len(texts) > NAMED else ""
    return ", ".join(texts[:NAMED]) + more
