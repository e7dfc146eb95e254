"""Strips of triangles between neighbouring lines of vertices, for walls, fans and discs."""

from __future__ import annotations

import numpy as np

from pcmc.base.arrays import Bools, Ints


def strips(line_vertices: Ints, segments: Ints, mirrored: Bools | None = None) -> Ints:
    """Triangles (f,3) that fill the strips between consecutive lines of vertices.

    Line i has ``segments[i] + 1`` vertices, and the strip to the next line has a triangle for
    each segment of either line, in the order of their midpoints. A line of 0 segments is one vertex.
    Faces are counter-clockwise where lines run upwards and the next line lies to the right.

    Parameters
    ----------
    line_vertices : the vertex numbers of all lines, one line after the other.
    segments : (c,) int, segments of each line.
    mirrored : (c-1,) bool, strips whose diagonals lean the other way where midpoints coincide.

    >>> strips(np.array([0, 1, 2, 3]), np.array([1, 1])).tolist()
    [[0, 2, 1], [1, 2, 3]]
    >>> len(strips(np.arange(9), np.array([0, 2, 4])))
    8
    """
    segments = np.asarray(segments, dtype=np.int64)
    start = np.concatenate([[0], np.cumsum(segments + 1)[:-1]])
    left, right = segments[:-1], segments[1:]
    lean = np.zeros(len(left), dtype=bool) if mirrored is None else mirrored

    gap, j = number_within_groups(left)
    passed = _midpoints_before(j, left[gap], right[gap], lean[gap])
    on_left = start[gap] + j
    first = np.stack([on_left, start[gap + 1] + passed, on_left + 1], axis=1)
    order_first = (gap, j + passed)

    gap, k = number_within_groups(right)
    passed = _midpoints_before(k, right[gap], left[gap], ~lean[gap])
    on_right = start[gap + 1] + k
    second = np.stack([start[gap] + passed, on_right, on_right + 1], axis=1)
    order_second = (gap, k + passed)

    gaps, steps = (np.concatenate(pair) for pair in zip(order_first, order_second, strict=True))
    faces = np.concatenate([first, second])[np.lexsort((steps, gaps))]
    return np.asarray(line_vertices)[faces]


def number_within_groups(counts: Ints) -> tuple[Ints, Ints]:
    """For each of counts[i] items of group i: the group, and the item's number within it.

    >>> [a.tolist() for a in number_within_groups(np.array([2, 0, 1]))]
    [[0, 0, 2], [0, 1, 0]]
    """
    group = np.repeat(np.arange(len(counts)), counts)
    return group, np.arange(len(group)) - np.repeat(np.cumsum(counts) - counts, counts)


def _midpoints_before(j: Ints, own: Ints, other: Ints, ties: Bools) -> Ints:
    """How many of the other line's midpoints (k + ½)/other come before (j + ½)/own, or tie."""
    # (2k + 1) own < (2j + 1) other, in integers, so that rounding loses no tie
    twice = (2 * j + 1) * other
    below = (twice + own - 1) // (2 * own)
    return np.clip(np.where(ties, (twice + own) // (2 * own), below), 0, other)
