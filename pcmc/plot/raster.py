"""The painter of a Scene: a depth for each pixel, the same on every machine, without OpenGL."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..base.arrays import Floats, Ints
from ..base.compiled import compiled
from .scene import Scene

Singles = npt.NDArray[np.float32]

SAMPLES = 2  # pixels painted for each pixel shown, in each direction
DOT = 5.0  # pixels across
ROUNDING = 1e-9  # of a triangle: a pixel this far outside is painted, so that no cracks show


@dataclass(frozen=True, eq=False)
class Painted:
    """A picture, and how much of each part of its scene can be seen.

    Attributes
    ----------
    image : (h,w,3) bytes.
    triangles, dots : (t,) and (d,) pixels on which each of them is the nearest.
    """

    image: Floats
    triangles: Floats
    dots: Floats


def paint(scene: Scene, low: Floats, scale: float, size: tuple[int, int]) -> Painted:
    """The scene with picture coordinates ``low`` at the lower left corner.

    ``scale`` is pixels per unit of length, ``size`` (w, h) in pixels.
    """
    width, height = size[0] * SAMPLES, size[1] * SAMPLES
    image = np.ones((height, width, 3), dtype=np.float32)
    nearest = np.full((height, width), -np.inf, dtype=np.float32)
    part = np.full((height, width), -1, dtype=np.int32)  # triangles first, then strokes

    def placed(points: Floats) -> Floats:
        """(…,3) pixels to the right, pixels down, and pixels towards the viewer."""
        right, up = np.moveaxis((scene.view.project(points) - low) * scale * SAMPLES, -1, 0)
        return np.stack([right, height - up, scene.view.depth(points) * scale * SAMPLES], axis=-1)

    _paint_triangles(placed(scene.corners), scene.colors.astype(float), image, nearest, part)
    ends = np.concatenate([scene.segments, np.stack([scene.dots, scene.dots], axis=1)])
    widths = SAMPLES * np.concatenate([scene.widths, np.full(len(scene.dots), DOT)])
    shades = np.concatenate([scene.shades, scene.dot_colors])
    first = len(scene.corners)
    _paint_strokes(placed(ends), 0.5 * widths, shades, image, nearest, part, first)
    mean = sum(image[a::SAMPLES, b::SAMPLES] for a in range(SAMPLES) for b in range(SAMPLES)) / SAMPLES**2
    pixels = np.bincount(part[part >= 0], minlength=first + len(ends)) / SAMPLES**2
    return Painted(
        np.round(255.0 * mean).astype(np.uint8), pixels[:first], pixels[first + len(scene.segments) :]
    )


@compiled
def _paint_triangles(corners: Floats, colors: Floats, image: Singles, nearest: Singles, part: Ints) -> None:
    """Triangles (t,3,3) in the colours (t,3,3) of their corners, by barycentric coordinates u, v, w."""
    height, width = nearest.shape
    for t in range(len(corners)):
        ax, ay, az = corners[t, 0]
        bx, by, bz = corners[t, 1]
        cx, cy, cz = corners[t, 2]
        twice_area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if twice_area == 0.0:  # seen from the side
            continue
        for i in range(max(0, int(min(ay, by, cy))), min(height, int(max(ay, by, cy)) + 1)):
            for j in range(max(0, int(min(ax, bx, cx))), min(width, int(max(ax, bx, cx)) + 1)):
                x, y = j + 0.5, i + 0.5
                u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / twice_area
                v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / twice_area
                w = 1.0 - u - v
                depth = u * az + v * bz + w * cz
                if min(u, v, w) >= -ROUNDING and depth > nearest[i, j]:
                    nearest[i, j], part[i, j] = depth, t
                    for k in range(3):
                        image[i, j, k] = u * colors[t, 0, k] + v * colors[t, 1, k] + w * colors[t, 2, k]


@compiled
def _paint_strokes(
    ends: Floats, radii: Floats, shades: Floats, image: Singles, nearest: Singles, part: Ints, first: int
) -> None:
    """Segments (s,2,3) with round ends; a segment without length is a dot."""
    height, width = nearest.shape
    for s in range(len(ends)):
        ax, ay, az = ends[s, 0]
        bx, by, bz = ends[s, 1]
        r, dx, dy = radii[s], bx - ax, by - ay
        length2 = dx * dx + dy * dy
        for i in range(max(0, int(min(ay, by) - r)), min(height, int(max(ay, by) + r) + 1)):
            for j in range(max(0, int(min(ax, bx) - r)), min(width, int(max(ax, bx) + r) + 1)):
                x, y = j + 0.5 - ax, i + 0.5 - ay
                along = (x * dx + y * dy) / length2 if length2 > 0.0 else 0.0
                along = min(1.0, max(0.0, along))
                depth = az + along * (bz - az)
                if math.hypot(x - along * dx, y - along * dy) <= r and depth > nearest[i, j]:
                    nearest[i, j], part[i, j] = depth, first + s
                    for k in range(3):
                        image[i, j, k] = shades[s, k]
