"""A surface as coloured triangles, lines and dots, in a view: everything except the painting.

Projection is parallel throughout, so lengths can be compared between pictures and text can be
placed on the vertices. Light and colour are computed here, so both painters show the same.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats, Ints
from ..surface import Surface
from ..surface.colours import patch_colors, rgb
from ..surface.geometry import area_vectors

NO_VALUE = "#D9D9D9"
FIXED_DOT, SLIDING_DOT = "#C8102E", "#1F4FBF"
LINE = "#303030"

VIEWS = {"diagonal": (-60.0, 28.0), "elevation": (-90.0, 0.0), "plan": (-90.0, 90.0)}
CELLS_UP_TO = 20_000  # triangles; above, a vertex's own cell is smaller than a pixel or two
LIFT = 2e-3  # of the size: lines and dots stand this much before the surface they lie on


@dataclass(frozen=True, eq=False)
class View:
    """The direction of view: unit vectors right, up and towards the viewer, as rows of (3,3)."""

    axes: Floats

    def project(self, points: Floats) -> Floats:
        """(…,2) picture coordinates in units of length."""
        return points @ self.axes[:2].T

    def depth(self, points: Floats) -> Floats:
        """(…) distance towards the viewer."""
        return points @ self.axes[2]


def view_of(surface: Surface, view: str | tuple[float, float]) -> View:
    """From a name or (azimuth, elevation) in degrees; the normal of Π is up.

    Azimuth turns about the normal, from the first of x, y, z that is not along it; -90 looks along
    +y when Π is horizontal.
    """
    if isinstance(view, str):
        view = VIEWS[validate.choice("view", view, tuple(VIEWS))]
    azimuth, elevation = (math.radians(a) for a in view)
    up = np.array(surface.plane.normal)
    first = next(e for e in np.eye(3) if abs(e @ up) < 0.9)
    first = first - (first @ up) * up
    first /= np.linalg.norm(first)
    second = np.cross(up, first)
    away = math.cos(azimuth) * first + math.sin(azimuth) * second
    towards = math.cos(elevation) * away + math.sin(elevation) * up
    right = np.cross(up, away)
    return View(np.stack([right, np.cross(towards, right), towards]))


@dataclass(frozen=True, eq=False)
class Drawing:
    """One surface of a picture: where it is seen from and what is shown on it.

    Attributes
    ----------
    values : (n,) or (m,), shown as colours.
    numbers : (n,), printed at the vertices.
    patches : the names of those to draw; None: all.
    """

    surface: Surface
    view: View
    title: str
    values: Floats | None
    numbers: Floats | None
    patches: Sequence[str] | None

    @property
    def shown(self) -> Bools:
        """(n,) vertices of the patches drawn."""
        shown = np.full(self.surface.n, self.patches is None)
        faces = self.surface.patch_faces([self.surface.patch_index(name) for name in self.patches or ()])
        shown[self.surface.faces[faces]] = True
        return shown

    def points(self, every: bool) -> Floats:
        """(k,2) picture coordinates of every vertex, or of those on the patches drawn."""
        X = self.surface.vertices
        return self.view.project(X if every else X[self.shown])


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything that a painter needs.

    Attributes
    ----------
    corners : (t,3,3) triangles; colors : (t,3,3) RGB of their corners, 0..1.
    segments : (s,2,3); widths (s,), in pixels; shades (s,3) RGB.
    dots : (d,3); dot_colors (d,3) RGB.
    order : (t + s + d,) indices into triangles, then segments, then dots, farthest first: a
        triangle is as near as its middle, what lies on triangles as near as the nearest of them.
    """

    view: View
    corners: Floats
    colors: Floats
    segments: Floats
    widths: Floats
    shades: Floats
    dots: Floats
    dot_colors: Floats
    order: Ints


def scene(
    surface: Surface,
    view: View,
    values: Floats | None,
    *,
    supports: bool,
    edges: bool,
    patches: Sequence[str] | None = None,
) -> Scene:
    """``values`` is None for patch colours, or RGB (n,3) or (m,3), NaN where there is none.

    ``edges`` draws the mesh, ``patches`` only those named.
    """
    shown = np.ones(surface.m, dtype=bool)
    if patches is not None:
        shown = surface.patch_faces([surface.patch_index(name) for name in patches])
    F = surface.faces[shown]
    P = surface.vertices[F]
    near = view.depth(P).mean(axis=1)
    light = _light(_normals(surface, smooth=not edges)[shown], view, 0.45 if values is None else 0.08)
    if values is None:
        base = patch_colors(surface)[surface.patch_of_face[shown]]
    elif len(values) == surface.m and surface.m != surface.n:
        base = np.where(np.isnan(values), rgb(NO_VALUE), values)[shown]
    else:
        base = _mean_known(values, F)
    colors, triangles_near = base[:, None] * light[..., None], near
    if values is not None and len(values) == surface.n and len(F) <= CELLS_UP_TO:
        known = np.where(np.isnan(values), rgb(NO_VALUE), values)
        P, colors = _cells(P, known[F], light)
        triangles_near = np.tile(near, 6)
    chosen, ends, widths, shades = _segments(surface, view, edges, shown)
    held, points, kinds = _dots(surface, view, supports, F)
    topo = surface.topology
    edges_near = _nearest(len(topo.edges), topo.edge_of_face[shown], near)[chosen]
    depth = np.concatenate([triangles_near, edges_near, _nearest(surface.n, F, near)[held]])
    order = np.argsort(depth, kind="stable")
    return Scene(view, P, np.clip(colors, 0.0, 1.0), ends, widths, shades, points, kinds, order)


def _nearest(count: int, parts: Ints, near: Floats) -> Floats:
    """(count,) depth of the nearest face at each edge or vertex; ``parts`` (m,3) are those of the faces."""
    result = np.full(count, -np.inf)
    np.maximum.at(result, parts.ravel(), np.repeat(near, 3))
    return result


def _light(normals: Floats, view: View, strength: float) -> Floats:
    """(…) brightness of a matt sheet seen from either side, lit from above the viewer's left."""
    seen = normals @ view.axes.T
    seen = seen * np.where(seen[..., 2:] < 0.0, -1.0, 1.0)
    source = np.array([-0.35, 0.50, 0.79])
    lambert = np.maximum(seen @ (source / np.linalg.norm(source)), 0.0)
    return 1.03 - strength * (1.0 - lambert)


def _normals(surface: Surface, smooth: bool) -> Floats:
    """(m,3,3) unit normals at the corners: the face's, or the mean at the vertex in its patch."""
    X, F = surface.vertices, surface.faces
    area = area_vectors(X[F])
    if smooth:
        key = surface.patch_of_face[:, None].astype(np.int64) * surface.n + F
        inverse = np.unique(key, return_inverse=True)[1].ravel()
        total = np.stack([np.bincount(inverse, np.repeat(a, 3)) for a in area.T], axis=1)
        normal = total[inverse].reshape(-1, 3, 3)
    else:
        normal = np.repeat(area[:, None], 3, axis=1)
    length = np.linalg.norm(normal, axis=2, keepdims=True)
    return normal / np.where(length > 0.0, length, 1.0)


def _cells(P: Floats, known: Floats, light: Floats) -> tuple[Floats, Floats]:
    """Each triangle in six, two around each corner in the corner's colour.

    So no colour shows that no vertex has.
    """
    middle, bright = P.mean(axis=1), light.mean(axis=1)
    corners, colors = [], []
    for k in range(3):
        for other in ((k + 1) % 3, (k + 2) % 3):
            half, half_light = (P[:, k] + P[:, other]) / 2, (light[:, k] + light[:, other]) / 2
            corners.append(np.stack([P[:, k], half, middle], axis=1))
            shade = np.stack([light[:, k], half_light, bright], axis=1)
            colors.append(known[:, k, None] * shade[..., None])
    return np.concatenate(corners), np.concatenate(colors)


def _mean_known(values: Floats, faces: Ints) -> Floats:
    """(m,3) mean of the corners' colours that exist."""
    corner = values[faces]
    there = ~np.isnan(corner[..., :1])
    count = there.sum(axis=1)
    total = np.where(there, corner, 0.0).sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), rgb(NO_VALUE))


def _segments(surface: Surface, view: View, edges: bool, shown: Bools) -> tuple[Ints, Floats, Floats, Floats]:
    """Indices of the edges to draw, their ends, widths and colours."""
    topo = surface.topology
    curve = topo.curve_edge
    there = np.zeros(len(curve), dtype=bool)
    there[topo.edge_of_face[shown]] = True
    chosen = np.flatnonzero(there & (curve | edges))
    ends = surface.vertices[topo.edges[chosen]] + LIFT * surface.size * view.axes[2]
    heavy = curve[chosen]
    shades = np.where(heavy[:, None], rgb(LINE), rgb("#585858"))
    return chosen, ends, np.where(heavy, 1.6, 0.6), shades


def _dots(surface: Surface, view: View, supports: bool, faces: Ints) -> tuple[Ints, Floats, Floats]:
    """Indices of the supported vertices to draw, where, and their colours."""
    there = np.zeros(surface.n, dtype=bool)
    there[faces] = supports
    held = np.flatnonzero(there & surface.held)
    points = surface.vertices[held] + 3 * LIFT * surface.size * view.axes[2]
    colors = np.where(surface.pinned[held][:, None], rgb(FIXED_DOT), rgb(SLIDING_DOT))
    return held, points, colors


def mean_edge(surface: Surface) -> float:
    """Mean edge length, from at most ten thousand faces."""
    step = max(1, surface.m // 10_000)
    P = surface.vertices[surface.faces[::step]]
    return float(np.linalg.norm(P - np.roll(P, 1, axis=1), axis=2).mean())
