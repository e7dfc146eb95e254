"""Example 4: a hall of three bays on non-planar Bézier boundaries (Figs. 22-25)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pcmc import Patch, Surface
from pcmc.arrays import Floats, Ints

from .bezier import chain
from .building import Builder
from .drape import drape
from .meshing import fill
from .options import positive

WIDTH, DEPTH, HEIGHT = 190.22, 101.56, 29.17
LEFT, MIDDLE, RIGHT, LEFT_WALL, RIGHT_WALL = range(5)

# Knots and control points of cubics, (x, y, z), smooth across inner knots. The outline runs
# counter-clockwise: it comes down to the four feet, where the walls end, rises between them, and
# touches the sides of the box at knots, so that the box is met at every edge length.
WEST = [
    (58, 93, 4), (42, 100, 9), (0, 96, 20),
    (0, 51, 17), (0, 14, 14.5), (44, 4, 6), (65, 10, 0),
]  # fmt: skip
SOUTH = [
    (65, 10, 0), (78, 3, 6), (87, 0, 15),
    (101, 0, 16), (115, 0, 17), (121, 4, 11), (132, 11, 6),
]  # fmt: skip
EAST = [
    (132, 11, 6), (149, 4, 10), (WIDTH, 11, 14),
    (WIDTH, 52, 14), (WIDTH, 88, 14), (160, 97, 6), (140, 90, 0),
]  # fmt: skip
NORTH = [
    (140, 90, 0), (126, 98, 7), (114, DEPTH, 19),
    (97, DEPTH, 20), (80, DEPTH, 21), (70, 98.5, 11), (58, 93, 4),
]  # fmt: skip
ARCHES = (
    [(65, 10, 0), (56, 38, 24), (53, 65, 29), (58, 93, 4)],
    [(132, 11, 6), (138, 39, 29), (145, 62, 24), (140, 90, 0)],
)
HOLE = [
    (114, 55, 25), (114, 64, 26), (106, 70, 27.5),
    (96, 69, 28), (86, 68, 28.5), (80, 62, 26.5),
    (81, 54, 26), (82, 46, 25.5), (89, 42, 24),
    (98, 42.5, 24), (107, 43, 24), (114, 46, 24), (114, 55, 25),
]  # fmt: skip


def bezier_hall(
    edge_length: float = 4.0,
    *,
    alpha: float = 30.0,
    alpha_left: float = 10.0,
    alpha_right: float = 15.0,
) -> Surface:
    """Three bays, a wall under each arch between them, and a hole in the middle one.

    The paper gives the box, 190.22 by 101.56 by 29.17, the tensions and the kinds of boundary; the
    curves are this package's own. Outline, hole and the walls' sloping feet are fixed in all
    directions. The initial roof is a membrane under an even load over outline, hole and arches.

    Parameters
    ----------
    edge_length : in plan, length.
    alpha : tension of "left", "middle" and "right".
    alpha_left, alpha_right : tension of "left wall" and "right wall".

    >>> surface = bezier_hall()
    >>> [round(float(side), 2) for side in np.ptp(surface.vertices, axis=0)]
    [190.22, 101.56, 29.17]
    """
    edge_length = positive(edge_length, "edge_length")
    mesh = Builder()
    outline, arches, hole = _curves(mesh, edge_length)
    held = mesh.positions(np.arange(1 + hole[-1]))
    bays = _bays(outline, arches, hole)
    pieces = [fill([held[loop, :2] for loop in bay], edge_length) for bay in bays]
    faces, count = [], len(held)
    for bay, (inner, local) in zip(bays, pieces, strict=True):
        faces.append(np.concatenate([*bay, count + np.arange(len(inner))])[local])
        count += len(inner)
    plan = np.concatenate([held[:, :2], *(inner for inner, _ in pieces)])
    given = np.arange(count) < len(held)
    z = drape(plan, np.concatenate(faces), given, np.resize(held[:, 2], count), HEIGHT)
    mesh.points(np.column_stack([plan, z])[~given])
    for patch, part in zip((LEFT, MIDDLE, RIGHT), faces, strict=True):
        mesh.faces(part, patch)
    feet = [
        mesh.wall(wall, arch, _slope(held[arch]), edge_length)
        for wall, arch in zip((LEFT_WALL, RIGHT_WALL), arches, strict=True)
    ]
    patches = [Patch(name, alpha) for name in ("left", "middle", "right")]
    patches += [Patch("left wall", alpha_left, 0.0), Patch("right wall", alpha_right, 0.0)]
    return mesh.surface(patches, fixed=np.concatenate([*outline, hole, *feet]))


def _curves(mesh: Builder, edge_length: float) -> tuple[list[Ints], list[Ints], Ints]:
    """Numbers along the outline's four curves, the two arches, and the hole, which comes last."""
    curves = [chain(np.array(c), edge_length) for c in (WEST, SOUTH, EAST, NORTH, *ARCHES)]
    feet = mesh.points([curve[0] for curve in curves[:4]])
    northwest, southwest, southeast, northeast = feet[:, None]
    around = [northwest, southwest, southeast, northeast, northwest]
    ends = [*pairwise(around), (southwest, northwest), (southeast, northeast)]
    lines = [
        np.concatenate([start, mesh.points(curve[1:-1]), end])
        for curve, (start, end) in zip(curves, ends, strict=True)
    ]
    return lines[:4], lines[4:], mesh.points(chain(np.array(HOLE), edge_length)[:-1])


def _bays(outline: list[Ints], arches: list[Ints], hole: Ints) -> list[list[Ints]]:
    """The closed curves around each bay, the outer one first."""
    west, south, east, north = outline
    left, right = arches
    around_middle = [south[:-1], right[:-1], north[:-1], left[:0:-1]]
    return [
        [np.concatenate([west[:-1], left[:-1]])],
        [np.concatenate(around_middle), hole],
        [np.concatenate([east[:-1], right[:0:-1]])],
    ]


def _slope(arch: Floats) -> Floats:
    """The points below an arch on the even slope between its feet."""
    steps = np.linalg.norm(np.diff(arch[:, :2], axis=0), axis=1)
    share = np.append(0.0, np.cumsum(steps)) / steps.sum()
    height = arch[0, 2] + share * (arch[-1, 2] - arch[0, 2])
    return np.column_stack([arch[:, :2], height])
