"""Variants of a roof: what is measured of each, and how far one shape is from another."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..certificate import Certificate
from ..certificate.reactions import support_forces
from ..energy.volume_below import volumes_below
from ..panels.distance import distances
from ..surface import Surface
from ..surface.geometry import area_vectors, vertex_sums

MOST_VARIANTS = 20


@dataclass(frozen=True, eq=False)
class Variant:
    """A surface that is kept, with its name and certificate."""

    name: str
    surface: Surface
    certificate: Certificate

    @cached_property
    def measures(self) -> list[dict[str, Any]]:
        """``measures`` of it."""
        return measures(self.surface, self.certificate)


def measures(surface: Surface, certificate: Certificate) -> list[dict[str, Any]]:
    """What a designer reads from a surface: of each patch under pressure, cable and room, and of all.

    A row has ``quantity``, ``of`` ("" for all patches under pressure), ``kind`` of its unit, and ``value``.
    The apex is the greatest height over Π, the reaction the largest force per length of a support.
    """
    height, areas = surface.plane.height(surface.vertices), certificate.patches["area"].to_numpy()
    acting, volumes = support_forces(surface, certificate.reactions), volumes_below(surface)
    rows: list[dict[str, Any]] = []

    def add(quantity: str, of: str, kind: str, value: float | None) -> None:
        rows.append({"quantity": quantity, "of": of, "kind": kind, "value": value})

    roofs = np.flatnonzero(surface.roof)
    for k in roofs.tolist():
        name, faces = surface.patches[k].name, surface.patch_of_face == k
        add("apex", name, "length", float(height[surface.faces[faces]].max()))
        add("area", name, "area", float(areas[k]))
        add("volume", name, "volume", float(volumes[k]))
        add("reaction", name, "tension", acting.largest_per_length(k))
    add("apex", "", "length", float(height.max()))
    add("area", "", "area", float(areas[roofs].sum()))
    add("volume", "", "volume", float(certificate.volume))
    add("reaction", "", "tension", acting.largest_per_length())
    for patch, of_roof in zip(surface.patches, surface.roof.tolist(), strict=True):
        add("tension", patch.name, "tension", patch.tension)
        if of_roof:
            add("pressure", patch.name, "pressure", patch.pressure)
        for kind in ("weight", "snow"):
            if getattr(patch, kind):
                add(kind, patch.name, "pressure", getattr(patch, kind))
    for cable in surface.cables:
        add("tension", cable.name, "force", cable.tension)
    for room in surface.rooms:
        add("volume", room.name, "volume", room.volume)
    return rows


def difference(surface: Surface, other: Surface) -> Floats:
    """(n,) distance of each vertex from another surface, length; positive outside it, along its normals.

    The meshes may differ. Walls are no part of it, except for the vertices of walls.

    >>> from pcmc import Patch
    >>> corners = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0.0]])
    >>> flat = Surface(corners, [[0, 1, 2]], [0], [Patch("roof", 1.0)], fixed=[0, 1, 2])
    >>> lower = Surface(corners - [0, 0, 0.5], [[0, 1, 2]], [0], [Patch("roof", 1.0)], fixed=[0, 1, 2])
    >>> difference(flat, lower).tolist(), difference(lower, flat).tolist()
    ([0.5, 0.5, 0.5], [-0.5, -0.5, -0.5])
    """
    roof, other_roof = (s.faces[s.roof[s.patch_of_face]] for s in (surface, other))
    if not (len(roof) and len(other_roof)):
        return _away(surface.vertices, other.vertices, other.faces)
    on_roof = np.zeros(surface.n, dtype=bool)
    on_roof[roof] = True
    away = np.empty(surface.n)
    away[on_roof] = _away(surface.vertices[on_roof], other.vertices, other_roof)  # a wall may be nearer
    away[~on_roof] = _away(surface.vertices[~on_roof], other.vertices, other.faces)
    return away


def _away(points: Floats, Y: Floats, F: Ints) -> Floats:
    """(k,) signed distance of points (k,3) from the triangles F of vertices Y."""
    if not len(points):
        return np.empty(0)
    away = distances(points, Y, F)
    normal, used = vertex_sums(area_vectors(Y[F]), F, len(Y)), np.unique(F)
    nearest = used[cKDTree(Y[used]).query(points)[1]]
    outside = np.einsum("ij,ij->i", points - Y[nearest], normal[nearest]) >= 0.0
    return np.where(outside, away, -away)
