"""Elevations of shapes below each other on common axes, their walls beside them.

In the elevation of two roofs that meet over a wall, the wall is seen edge on: so it is also drawn alone,
from the side, to the same scale.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pcmc import Surface
from pcmc.base.arrays import Floats, Ints
from pcmc.surface.colours import patch_colors

PIXELS = 78.0  # a unit of length
LEFT, GAP, RIGHT, TITLE, FOOT = 70.0, 60.0, 20.0, 40.0, 60.0  # pixels around the axes


def draw_elevations(shapes: Mapping[str, Surface], path: Path, *, top: float) -> None:
    """A row for each shape by its title: seen along y, and its walls alone seen along x.

    ``top`` is the height up to which all rows are drawn.
    """
    from pcmc.plot.figure import INK, SMALL, TEXT, finish, new, style

    X = np.concatenate([surface.vertices for surface in shapes.values()])
    ranges = [(float(X[:, k].min()), float(X[:, k].max())) for k in (0, 1)]
    widths = [PIXELS * (high - low) for low, high in ranges]
    row = PIXELS * top
    total = LEFT + sum(widths) + GAP + RIGHT, len(shapes) * (row + TITLE) + FOOT
    figure = new(*total)
    for k, (title, surface) in enumerate(shapes.items()):
        below = total[1] - (k + 1) * (row + TITLE)
        for axis, left in ((0, LEFT), (1, LEFT + widths[0] + GAP)):
            place = (left / total[0], below / total[1], widths[axis] / total[0], row / total[1])
            axes = style(figure.add_axes(place))
            axes.set(xlim=ranges[axis], ylim=(0.0, top), yticks=np.arange(0.0, top, 0.5))
            faces = np.arange(surface.m) if axis == 0 else _walls(surface)
            _paint(axes, surface, faces, axis)
            name = title if axis == 0 else "its wall alone, from the side" if k == 0 else ""
            axes.set_title(name, fontsize=TEXT, color=INK, pad=4.0, loc="left")
            if k + 1 < len(shapes):
                axes.set_xticklabels([])
            else:
                axes.set_xlabel("xy"[axis], fontsize=SMALL, color=INK, labelpad=1.5)
            axes.set_ylabel("height" if axis == 0 else "", fontsize=SMALL, color=INK, labelpad=2.0)
    finish(figure, path)


def _walls(surface: Surface) -> Ints:
    return np.flatnonzero(surface.walls[surface.patch_of_face])


def _paint(axes: Any, surface: Surface, faces: Ints, axis: int) -> None:
    """Faces as seen along y (``axis`` 0) or along x (1), the farthest first, the walls last."""
    from matplotlib.collections import PolyCollection

    P = surface.vertices[surface.faces[faces]]
    depth = P[:, :, 1 - axis].mean(axis=1) * (1.0 if axis else -1.0)
    order = np.argsort(depth, kind="stable")
    walls = np.isin(faces[order], _walls(surface))
    order = np.concatenate([order[~walls], order[walls]])
    seen: Floats = P[order][:, :, [axis, 2]]
    colors = patch_colors(surface)[surface.patch_of_face[faces[order]]]
    edge = np.where(np.sort(walls)[:, None], 0.1, 0.35 * np.ones(3))
    axes.add_collection(
        PolyCollection(
            list(seen), facecolors=colors, edgecolors=edge, clip_on=False, joinstyle="round",
            linewidths=np.where(np.sort(walls), 0.9, 0.35),
        )
    )  # fmt: skip
