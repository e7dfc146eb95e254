"""Rings of vertices around one: the net of discs and caps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pcmc.base.arrays import Floats, Ints

from .strips import numbered, strips


@dataclass(frozen=True)
class Rosette:
    """A vertex with rings around it; the vertices of the last ring come last.

    Attributes
    ----------
    share : (k,) 0 for the vertex in the middle, rising to 1 on the last ring.
    angle : (k,) around the middle.
    faces : (f,3), counter-clockwise seen so that angles grow counter-clockwise.
    """

    share: Floats
    angle: Floats
    faces: Ints


def rosette(segments: Ints) -> Rosette:
    """The rosette with the given number of segments in each ring.

    >>> net = rosette(np.array([6, 12]))
    >>> len(net.share), len(net.faces), net.faces[0].tolist()
    (19, 24, [0, 1, 2])
    """
    segments = np.asarray(segments)
    ring, step = numbered(segments)
    share = np.append(0.0, (ring + 1) / len(segments))
    angle = np.append(0.0, 2.0 * np.pi * step / segments[ring])
    line, step = numbered(segments + 1)
    closed = 1 + (np.cumsum(segments) - segments)[line] + step % segments[line]
    return Rosette(share, angle, strips(np.append(0, closed), np.append(0, segments)))


def even_segments(radii: Floats, edge_length: float) -> Ints:
    """Segments for rings of the given radii that make them about ``edge_length`` long, at least 6.

    >>> even_segments(np.array([0.5, 1.0, 2.0]), 1.0).tolist()
    [6, 6, 13]
    """
    return np.maximum(6, np.rint(2.0 * np.pi * radii / edge_length)).astype(np.int64)


def disc_points(net: Rosette) -> Floats:
    """(k,2) points of the unit disc, rings of equal width."""
    return net.share[:, None] * np.stack([np.cos(net.angle), np.sin(net.angle)], axis=1)


def cap_directions(net: Rosette, opening: float) -> Floats:
    """(k,3) unit vectors around +z, rings of equal width up to the angle ``opening`` from it."""
    theta = opening * net.share
    return np.stack(
        [np.sin(theta) * np.cos(net.angle), np.sin(theta) * np.sin(net.angle), np.cos(theta)],
        axis=1,
    )
