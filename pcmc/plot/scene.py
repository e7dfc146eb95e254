"""A surface as coloured triangles, lines and dots, in a view; and two painters of it: matplotlib, from back
to front; pyvista for many triangles, with OpenGL.

Projection is parallel, so lengths can be compared. Light and colour are the same for both painters.
"""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..base import validate
from ..base.arrays import Bools, Floats, Ints, mask_of
from ..base.libraries import load_library, require
from ..surface import Surface
from ..surface.colours import patch_colors, rgb
from ..surface.geometry import area_vectors

Image = npt.NDArray[np.uint8]

NO_VALUE = "#D9D9D9"
FIXED_DOT, SLIDING_DOT = "#C8102E", "#1F4FBF"
LINE, MESH_LINE = "#303030", "#585858"

VIEWS = {"diagonal": (-60.0, 28.0), "elevation": (-90.0, 0.0), "plan": (-90.0, 90.0)}
CELLS_UP_TO = 20_000  # triangles; above, a vertex's own cell is smaller than a pixel or two
MARGIN = 10.0  # pixels around each picture, for lines and dots that stick out
TALLEST = 1.1  # height of a picture at most, as a part of its width
LIFT = 2e-3  # of the size: lines and dots stand this much before the surface they lie on


class Camera(NamedTuple):
    """The direction of view: unit vectors right, up and towards the viewer, as rows of (3,3)."""

    axes: Floats

    def project(self, points: Floats) -> Floats:
        """(…,2) picture coordinates in units of length."""
        return points @ self.axes[:2].T

    def depth(self, points: Floats) -> Floats:
        """(…) distance towards the viewer."""
        return points @ self.axes[2]


def view_of(surface: Surface, view: str | tuple[float, float]) -> Camera:
    """From a name or (azimuth, elevation) in degrees; the normal of Π is up.

    Azimuth turns about it, from the first of x, y, z that is not along it: -90 looks along +y above a floor.
    """
    if isinstance(view, str):
        view = VIEWS[validate.choice("view", view, tuple(VIEWS))]
    azimuth, elevation = (math.radians(a) for a in view)
    first, second, up = surface.plane.axes
    away = math.cos(azimuth) * first + math.sin(azimuth) * second
    towards = math.cos(elevation) * away + math.sin(elevation) * up
    right = np.cross(up, away)
    return Camera(np.stack([right, np.cross(towards, right), towards]))


class Rendering(NamedTuple):
    """One surface of a picture: where it is seen from and what is shown on it."""

    surface: Surface
    view: Camera
    title: str
    values: Floats | None  # (n,) or (m,), shown as colours
    numbers: Floats | None  # (n,), printed at the vertices
    patches: Sequence[str] | None  # the names of those to draw; None: all

    @property
    def faces(self) -> Bools:
        """(m,) triangles of the patches drawn."""
        if self.patches is None:
            return np.ones(self.surface.m, dtype=bool)
        return self.surface.patch_faces([self.surface.patch_index(name) for name in self.patches])

    @property
    def shown(self) -> Bools:
        """(n,) vertices of the patches drawn."""
        shown = np.full(self.surface.n, self.patches is None)
        shown[self.surface.faces[self.faces]] = True
        return shown

    def points(self, every: bool) -> Floats:
        """(k,2) picture coordinates of every vertex, or of those on the patches drawn."""
        X = self.surface.vertices
        return self.view.project(X if every else X[self.shown])


class Scene(NamedTuple):
    """Everything that a painter needs.

    ``order`` (t + s + d,) numbers triangles, then segments, then dots, farthest first.
    """

    view: Camera
    corners: Floats  # (t,3,3) triangles
    colors: Floats  # (t,3,3) RGB of their corners, 0..1
    segments: Floats  # (s,2,3)
    widths: Floats  # (s,), in pixels
    shades: Floats  # (s,3) RGB
    dots: Floats  # (d,3)
    dot_colors: Floats  # (d,3) RGB
    order: Ints


def scene(drawing: Rendering, values: Floats | None, *, supports: bool, edges: bool) -> Scene:
    """The scene of a drawing; ``edges`` draws the mesh.

    ``values`` are None for patch colours, or RGB (n,3) or (m,3), NaN where there is none.
    """
    surface, view, shown = drawing.surface.cell, drawing.view, drawing.faces
    F, topo = surface.faces[shown], surface.topology
    P = surface.vertices[F]
    near = view.depth(P).mean(axis=1)
    light = _light(surface, shown, view, 0.45 if values is None else 0.08, smooth=not edges)
    if values is None:
        colors = patch_colors(surface)[surface.patch_of_face[shown]][:, None] * light[..., None]
    else:
        known = np.where(np.isnan(values), rgb(NO_VALUE), values)
        if len(values) != surface.n:
            colors = known[shown][:, None] * light[..., None]
        elif len(F) <= CELLS_UP_TO:
            P, colors = _cells(P, known[F], light)
        else:  # the mean of the corners' colours that exist
            there = ~np.isnan(values[F][..., :1])
            count, total = there.sum(axis=1), np.where(there, values[F], 0.0).sum(axis=1)
            base = np.where(count > 0, total / np.maximum(count, 1), rgb(NO_VALUE))
            colors = base[:, None] * light[..., None]
    there = mask_of(topo.edge_of_face[shown], len(topo.edges))
    chosen = np.flatnonzero(there & (topo.curve_edge | edges))
    heavy = topo.curve_edge[chosen]
    ends = surface.vertices[topo.edges[chosen]] + LIFT * surface.size * view.axes[2]
    held = np.flatnonzero(mask_of(F, surface.n) & surface.held & supports)
    edge_depth = _nearest(len(topo.edges), topo.edge_of_face[shown], near)[chosen]
    depth = [np.tile(near, len(P) // max(len(F), 1)), edge_depth, _nearest(surface.n, F, near)[held]]
    order = np.argsort(np.concatenate(depth), kind="stable")
    shades = np.where(heavy[:, None], rgb(LINE), rgb(MESH_LINE))
    dots = surface.vertices[held] + 3 * LIFT * surface.size * view.axes[2]
    dot_colors = np.where(surface.pinned[held][:, None], rgb(FIXED_DOT), rgb(SLIDING_DOT))
    lines = ends, np.where(heavy, 1.6, 0.6), shades
    return Scene(view, P, np.clip(colors, 0.0, 1.0), *lines, dots, dot_colors, order)


def _nearest(count: int, parts: Ints, near: Floats) -> Floats:
    """(count,) depth of the nearest face at each edge or vertex; ``parts`` (m,3) are those of the faces."""
    result = np.full(count, -np.inf)
    np.maximum.at(result, parts.ravel(), np.repeat(near, 3))
    return result


def _light(surface: Surface, shown: Bools, view: Camera, strength: float, smooth: bool) -> Floats:
    """(t,3) brightness at the corners of a matt sheet seen from either side, lit from above the left; normals
    are the faces', or if ``smooth`` their means at each vertex in its patch."""
    F = surface.faces
    area = area_vectors(surface.vertices[F])
    normal = np.repeat(area[:, None], 3, axis=1)
    if smooth:
        key = surface.patch_of_face[:, None].astype(np.int64) * surface.n + F
        inverse = np.unique(key, return_inverse=True)[1].ravel()
        total = np.stack([np.bincount(inverse, np.repeat(a, 3)) for a in area.T], axis=1)
        normal = total[inverse].reshape(-1, 3, 3)
    length = np.linalg.norm(normal, axis=2, keepdims=True)
    seen = (normal / np.where(length > 0.0, length, 1.0))[shown] @ view.axes.T
    seen = seen * np.where(seen[..., 2:] < 0.0, -1.0, 1.0)
    source = np.array([-0.35, 0.50, 0.79])
    lambert = np.maximum(seen @ (source / np.linalg.norm(source)), 0.0)
    return 1.03 - strength * (1.0 - lambert)


def _cells(P: Floats, known: Floats, light: Floats) -> tuple[Floats, Floats]:
    """Each triangle in six, two around each corner in its colour: no colour shows that no vertex has."""
    middle, bright = P.mean(axis=1), light.mean(axis=1)
    corners, colors = [], []
    for k in range(3):
        for other in ((k + 1) % 3, (k + 2) % 3):
            half, half_light = (P[:, k] + P[:, other]) / 2, (light[:, k] + light[:, other]) / 2
            corners.append(np.stack([P[:, k], half, middle], axis=1))
            shade = np.stack([light[:, k], half_light, bright], axis=1)
            colors.append(known[:, k, None] * shade[..., None])
    return np.concatenate(corners), np.concatenate(colors)


def mean_edge(surface: Surface) -> float:
    """Mean edge length, from at most ten thousand faces."""
    step = max(1, surface.m // 10_000)
    P = surface.vertices[surface.faces[::step]]
    return float(np.linalg.norm(P - np.roll(P, 1, axis=1), axis=2).mean())


class Frame(NamedTuple):
    """A rectangle of pixels and the picture coordinates in it."""

    size: tuple[int, int]  # width and height in pixels
    low: Floats  # (2,) picture coordinates of the lower left corner
    scale: float  # pixels per unit of length

    def show(self, axes: Any, image: Image) -> None:
        """Place a painted scene on the axes, pixel on pixel."""
        right, top = self.low + np.array(self.size) / self.scale
        figure, box = axes.figure.bbox, axes.get_window_extent()
        left = round(box.x0) / figure.width
        bottom = (figure.height - round(figure.height - box.y1) - self.size[1]) / figure.height
        axes.set_position((left, bottom, self.size[0] / figure.width, self.size[1] / figure.height))
        axes.imshow(image, extent=(self.low[0], right, self.low[1], top), aspect="auto")


def frames_of(points: Sequence[Floats], columns: int, width: int, one_scale: bool = True) -> list[Frame]:
    """Frames around the given points (k,2), row by row; those of a row are of one height."""
    spans, wide = np.array([np.ptp(p, axis=0) for p in points]), width // columns
    room = np.array([wide, TALLEST * wide]) - 2 * MARGIN
    scales = (room / np.maximum(spans, 1e-9 * spans.max())).min(axis=1)
    if one_scale:
        scales[:] = scales.min()
    frames = []
    for k, (corners, span, scale) in enumerate(zip(points, spans, scales.tolist(), strict=True)):
        row = slice(k - k % columns, k - k % columns + columns)
        high = math.ceil((spans[row, 1] * scales[row]).max() + 2 * MARGIN)
        low = corners.min(axis=0) - np.array([(wide / scale - span[0]) / 2.0, MARGIN / scale])
        frames.append(Frame((wide, high), low, scale))
    return frames


RENDERERS = ("auto", "pyvista", "matplotlib")
SAMPLES = 2  # pixels painted for each pixel shown, in each direction
DOT = 5.0  # pixels across
MANY = 40_000  # triangles from which pyvista is faster than matplotlib, its import and first answer included


def paint(scene: Scene, frame: Frame, renderer: str = "auto") -> Image:
    """(h,w,3) bytes: the scene in a frame."""
    from PIL import Image as Pillow

    validate.choice("renderer", renderer, RENDERERS)
    fast = renderer == "pyvista" or (renderer == "auto" and len(scene.corners) > MANY and opengl())
    painter = _with_pyvista if fast else _with_matplotlib
    fine = Pillow.fromarray(np.ascontiguousarray(painter(scene, frame)))
    return np.asarray(fine.reduce(SAMPLES))


@cache
def opengl() -> bool:
    """Whether VTK can draw here. A child process tries it: without a driver VTK aborts the process."""
    require("pyvista", extra="plot")
    probe = (
        "import vtkmodules.vtkRenderingOpenGL2\n"
        "from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow\n"
        "w = vtkRenderWindow(); w.SetOffScreenRendering(1); w.SetSize(8, 8)\n"
        "w.AddRenderer(vtkRenderer()); w.Render()\n"
    )
    return not subprocess.run([sys.executable, "-c", probe], capture_output=True, check=False).returncode


def _with_pyvista(scene: Scene, frame: Frame) -> Floats:
    pyvista = load_library("pyvista", "plot")
    width, height = frame.size[0] * SAMPLES, frame.size[1] * SAMPLES
    with pyvista.vtk_verbosity("off"):
        plotter = pyvista.Plotter(off_screen=True, window_size=(width, height), lighting="none")
        plotter.set_background("white")
        plain: dict[str, Any] = {"scalars": "rgb", "rgb": True, "lighting": False}
        cells = np.arange(3 * len(scene.corners)).reshape(-1, 3)
        mesh = pyvista.PolyData.from_regular_faces(scene.corners.reshape(-1, 3), cells)
        mesh["rgb"] = np.round(scene.colors.reshape(-1, 3) * 255.0).astype(np.uint8)
        plotter.add_mesh(mesh, **plain)
        for line_width in np.unique(scene.widths):
            chosen = scene.widths == line_width
            lines = pyvista.line_segments_from_points(scene.segments[chosen].reshape(-1, 3))
            lines.cell_data["rgb"] = np.round(scene.shades[chosen] * 255.0).astype(np.uint8)
            plotter.add_mesh(lines, line_width=SAMPLES * line_width, **plain)
        if len(scene.dots):
            dots = pyvista.PolyData(scene.dots)
            dots["rgb"] = np.round(scene.dot_colors * 255.0).astype(np.uint8)
            round_dots = {"style": "points", "render_points_as_spheres": True, "point_size": SAMPLES * DOT}
            plotter.add_mesh(dots, **plain, **round_dots)
        (right, up, towards), depth = scene.view.axes, scene.view.depth(scene.corners.reshape(-1, 3))
        across, high = frame.low + np.array(frame.size) / (2.0 * frame.scale)
        focus = across * right + high * up + depth.max() * towards
        thick = np.ptp(depth)
        reach = max(thick, max(frame.size) / frame.scale)
        camera = plotter.camera
        camera.position = focus + reach * towards
        camera.focal_point = focus
        camera.up = up
        camera.parallel_projection = True
        camera.parallel_scale = frame.size[1] / (2.0 * frame.scale)
        camera.clipping_range = (0.5 * reach, 1.5 * reach + thick)
        image = plotter.screenshot(return_img=True)
        plotter.close()
    return image[..., :3]


def _with_matplotlib(scene: Scene, frame: Frame) -> Floats:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    project = scene.view.project
    circle = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    disc = np.stack([np.cos(circle), np.sin(circle)], axis=1) * DOT / (2.0 * frame.scale)
    shapes = [*project(scene.corners), *project(scene.segments), *(project(scene.dots)[:, None] + disc)]
    fills = np.concatenate([scene.colors.mean(axis=1), scene.shades, scene.dot_colors])
    widths = np.concatenate([np.full(len(scene.corners), 0.4), scene.widths, np.zeros(len(scene.dots))])
    order, (right, top) = scene.order, frame.low + np.array(frame.size) / frame.scale
    figure = Figure(figsize=(frame.size[0] / 72.0, frame.size[1] / 72.0), dpi=72.0 * SAMPLES)
    canvas, axes = FigureCanvasAgg(figure), figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set(xlim=(frame.low[0], right), ylim=(frame.low[1], top))
    painted, fills = [shapes[k] for k in order], fills[order]
    look: dict[str, Any] = {"linewidths": widths[order], "joinstyle": "round"}
    axes.add_collection(PolyCollection(painted, facecolors=fills, edgecolors=fills, **look))
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[: frame.size[1] * SAMPLES, : frame.size[0] * SAMPLES, :3]
