"""Meshes of concentric rings, for discs and caps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pcmc.base.arrays import Floats, Ints

from .strips import number_within_groups, strips


@dataclass(frozen=True)
class RingMesh:
    """A vertex with rings of vertices around it, the outermost ring last.

    Attributes
    ----------
    radius : (k,) 0 for the vertex in the middle, 1 on the last ring.
    angle : (k,) around the middle, radians.
    faces : (f,3), counter-clockwise as the angles.
    """

    radius: Floats
    angle: Floats
    faces: Ints


def ring_mesh(segments: Ints) -> RingMesh:
    """The mesh with the given number of segments in each ring.

    >>> mesh = ring_mesh(np.array([6, 12]))
    >>> len(mesh.radius), len(mesh.faces), mesh.faces[0].tolist()
    (19, 24, [0, 1, 2])
    """
    segments = np.asarray(segments)
    ring, step = number_within_groups(segments)
    radius = np.append(0.0, (ring + 1) / len(segments))
    angle = np.append(0.0, 2.0 * np.pi * step / segments[ring])
    line, step = number_within_groups(segments + 1)
    closed = 1 + (np.cumsum(segments) - segments)[line] + step % segments[line]
    return RingMesh(radius, angle, strips(np.append(0, closed), np.append(0, segments)))


def even_segments(radii: Floats, edge_length: float) -> Ints:
    """Segments, at least 6, about ``edge_length`` long, for rings of the given radii.

    >>> even_segments(np.array([0.5, 1.0, 2.0]), 1.0).tolist()
    [6, 6, 13]
    """
    return np.maximum(6, np.rint(2.0 * np.pi * radii / edge_length)).astype(np.int64)


def disc_points(mesh: RingMesh) -> Floats:
    """(k,2) points of the unit disc, rings of equal width."""
    return mesh.radius[:, None] * np.stack([np.cos(mesh.angle), np.sin(mesh.angle)], axis=1)


def cap_directions(mesh: RingMesh, opening: float) -> Floats:
    """(k,3) unit vectors around +z, rings of equal width up to the angle ``opening`` from it."""
    theta = opening * mesh.radius
    return np.stack(
        [np.sin(theta) * np.cos(mesh.angle), np.sin(theta) * np.sin(mesh.angle), np.cos(theta)],
        axis=1,
    )
