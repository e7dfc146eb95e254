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
from pcmc.base.arrays import Bools, Floats, Ints
from pcmc.surface.colours import patch_colors

WIDTH = 1086  # pixels


def draw_elevations(shapes: Mapping[str, Surface], path: Path, *, top: float) -> None:
    """A row for each shape by its title: seen along y, and its walls alone seen along x.

    ``top`` is the height up to which all rows are drawn.
    """
    from pcmc.plot.figure import INK, SMALL, TEXT, finish, fit_height, grid, new, style

    X = np.concatenate([surface.vertices for surface in shapes.values()])
    ranges = [(float(X[:, k].min()), float(X[:, k].max())) for k in (0, 1)]
    widths = [high - low for low, high in ranges]
    figure = new(WIDTH, 180.0 * len(shapes))
    axes = grid(figure, 2 * len(shapes), 2, width_ratios=widths)
    for k, (title, surface) in enumerate(shapes.items()):
        for axis, place in enumerate(axes[2 * k : 2 * k + 2]):
            style(place)
            place.set(xlim=ranges[axis], ylim=(0.0, top), yticks=np.arange(0.0, top, 0.5))
            faces = np.arange(surface.m) if axis == 0 else _walls(surface)
            _paint(place, surface, faces, axis)
            name = title if axis == 0 else "its wall alone, from the side" if k == 0 else ""
            place.set_title(name, fontsize=TEXT, color=INK, pad=4.0, loc="left")
            if k + 1 < len(shapes):
                place.set_xticklabels([])
            else:
                place.set_xlabel("xy"[axis], fontsize=SMALL, color=INK, labelpad=1.5)
            place.set_ylabel("height" if axis == 0 else "", fontsize=SMALL, color=INK, labelpad=2.0)
    fit_height(figure, dict.fromkeys(axes[::2], top / widths[0]))
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
            list(seen),
            facecolors=colors,
            edgecolors=edge,
            clip_on=False,
            joinstyle="round",
            linewidths=np.where(np.sort(walls), 0.9, 0.35),
        )
    )


def with_triangles(surface: Surface, chosen: Bools) -> Surface:
    """The part of a surface that has these of its triangles (m,)."""
    used, faces = np.unique(surface.faces[chosen], return_inverse=True)
    numbers, patch = np.unique(surface.patch_of_face[chosen], return_inverse=True)
    patches = tuple(surface.patches[k] for k in numbers)
    return Surface(surface.vertices[used], faces.reshape(-1, 3), patch, patches, fixed=surface.fixed[used])
