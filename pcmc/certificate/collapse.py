"""Why the triangles of a mesh have collapsed: where the worst one is, and the likely cause."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints
from ..meshing.quality import edge_lengths, triangle_quality
from ..surface import Surface

REACH = 1.5  # median edge lengths: the cause is looked for this near to the worst triangle
LOW = 0.2  # median edge lengths: a held wall this low has no room for triangles
KEY = 'in a plan, bottom = "{}"'
ALONG = 30.0  # degrees: at a smaller angle to the support a junction counts as lying along it


def where_collapsed(surface: Surface, pinchable: Bools) -> str:
    """Names the worst triangle outside walls that can pinch, and its cause if that is a known one.

    ``pinchable`` (k,) marks these walls. Two causes are known: a junction slips along a support away
    from its own end, where only the mesh holds it; or it comes down on the held bottom of its wall,
    which cannot pinch (``find_walls``).
    """
    face, quality = _worst_face(surface, pinchable)
    patch = int(surface.patch_of_face[face])
    place = surface.vertices[surface.faces[face]].mean(axis=0)
    edge = float(np.median(edge_lengths(surface)))
    worst = (
        f"worst is face {face} of patch {surface.patches[patch].name!r} near"
        f" {place.round(4).tolist()}, quality {quality:.1e}"
    )
    if held_wall_down(surface, pinchable):
        return worst + (
            "; the junction there comes down on the held bottom of its wall, so the wall has no height"
            " left: make the wall weaker, or let its bottom slide so that the junction can rest on the plane"
            f" ({KEY.format('sliding')})"
        )
    if _slips(surface, pinchable, place, REACH * edge):
        worst += (
            "; the junction there slips along a support, which does not hold its end: hold the bottom"
            f" of its wall ({KEY.format('held')})"
        )
    return worst


def held_wall_down(surface: Surface, pinchable: Bools) -> bool:
    """Whether the worst triangle is in a wall whose junction has come down on its held bottom.

    Without a bottom vertex below each junction vertex such a wall cannot pinch: its triangles collapse.
    """
    patch = int(surface.patch_of_face[_worst_face(surface, pinchable)[0]])
    edge = float(np.median(edge_lengths(surface)))
    return bool(surface.auxiliary[patch]) and _height(surface, patch) < LOW * edge


def _worst_face(surface: Surface, pinchable: Bools) -> tuple[int, float]:
    """The worst triangle outside walls that can pinch, and its quality."""
    quality = triangle_quality(surface.vertices, surface.faces)
    outer = np.where(pinchable[surface.patch_of_face], np.inf, quality)
    return int(outer.argmin()), float(outer.min())


def _height(surface: Surface, patch: int) -> float:
    """The least distance of a wall's free junction vertices from its held bottom."""
    X = surface.vertices
    used = np.zeros(surface.n, dtype=bool)
    used[surface.faces[surface.patch_of_face == patch]] = True
    top = used & surface.topology.on_junction
    bottom = used & surface.fixed & ~top
    top &= surface.free
    if not (top.any() and bottom.any()):
        return np.inf
    return float(np.min(cKDTree(X[bottom]).query(X[top])[0]))


def _slips(surface: Surface, pinchable: Bools, place: Floats, reach: float) -> bool:
    """Whether a junction near the place slides on a support next to its fixed end, or lies along it."""
    X, topo = surface.vertices, surface.topology
    near = np.linalg.norm(X - place, axis=1) <= reach
    of_junction = topo.on_junction & ~surface.fixed
    if not (near & of_junction).any():
        return False
    if (near & surface.fixed).any() and (near & surface.on_plane).any():
        return True
    held = topo.edges[topo.boundary_edge & surface.fixed[topo.edges].all(axis=1)]
    for curve in topo.junctions:
        if near[curve.vertices].any() and pinchable[list(curve.sheets)].any() and not curve.closed:
            for end, beside in (curve.vertices[:2], curve.vertices[:-3:-1]):
                if surface.fixed[end] and _along(X, held, int(end), int(beside)):
                    return True
    return False


def _along(X: Floats, held: Ints, end: int, beside: int) -> bool:
    """Whether the edge from ``end`` to ``beside`` lies along one of the held edges (k,2) there."""
    sides = X[held[(held == end).any(axis=1)].sum(axis=1) - end] - X[end]
    edge = X[beside] - X[end]
    lengths = np.linalg.norm(sides, axis=1) * np.linalg.norm(edge)
    return bool((sides @ edge > np.cos(np.radians(ALONG)) * lengths).any())
