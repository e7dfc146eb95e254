"""Two painters of a Scene: matplotlib, from back to front; pyvista for many triangles, with OpenGL."""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import Floats
from ..base.libraries import load_library, require
from .figure import Image
from .scene import Scene

RENDERERS = ("auto", "pyvista", "matplotlib")
SAMPLES = 2  # pixels painted for each pixel shown, in each direction
DOT = 5.0  # pixels across
MANY = 40_000  # triangles from which pyvista is faster than matplotlib, its import and first answer included


def paint(scene: Scene, low: Floats, scale: float, size: tuple[int, int], renderer: str = "auto") -> Image:
    """(h,w,3) bytes: the scene with picture coordinates ``low`` at the lower left corner, ``scale``
    pixels per unit of length, ``size`` (w, h) in pixels.
    """
    from PIL import Image as Pillow

    validate.choice("renderer", renderer, RENDERERS)
    many = len(scene.corners) > MANY
    painter = _with_matplotlib
    if renderer == "pyvista" or (renderer == "auto" and many and opengl()):
        painter = _with_pyvista
    fine = Pillow.fromarray(np.ascontiguousarray(painter(scene, low, scale, size)))
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
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, check=False)
    return done.returncode == 0


def _with_pyvista(scene: Scene, low: Floats, scale: float, size: tuple[int, int]) -> Floats:
    pyvista = load_library("pyvista", "plot")
    width, height = size[0] * SAMPLES, size[1] * SAMPLES
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
        axes, depth = scene.view.axes, scene.view.depth(scene.corners.reshape(-1, 3))
        centre = low + np.array(size) / (2.0 * scale)
        near, far = depth.max(), depth.min()
        reach = max(near - far, np.array(size).max() / scale)
        focus = centre @ axes[:2] + near * axes[2]
        camera = plotter.camera
        camera.position = focus + reach * axes[2]
        camera.focal_point = focus
        camera.up = axes[1]
        camera.parallel_projection = True
        camera.parallel_scale = size[1] / (2.0 * scale)
        camera.clipping_range = (0.5 * reach, reach + (near - far) + 0.5 * reach)
        image = plotter.screenshot(return_img=True)
        plotter.close()
    return image[..., :3]


def _with_matplotlib(scene: Scene, low: Floats, scale: float, size: tuple[int, int]) -> Floats:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    project = scene.view.project
    circle = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    disc = np.stack([np.cos(circle), np.sin(circle)], axis=1) * DOT / (2.0 * scale)
    shapes = [*project(scene.corners), *project(scene.segments), *(project(scene.dots)[:, None] + disc)]
    fills = np.concatenate([scene.colors.mean(axis=1), scene.shades, scene.dot_colors])
    thin = np.full(len(scene.corners), 0.4)
    widths = np.concatenate([thin, scene.widths, np.zeros(len(scene.dots))])
    order = scene.order
    figure = Figure(figsize=(size[0] / 72.0, size[1] / 72.0), dpi=72.0 * SAMPLES)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(low[0], low[0] + size[0] / scale)
    axes.set_ylim(low[1], low[1] + size[1] / scale)
    painted, fills = [shapes[k] for k in order], fills[order]
    look: dict[str, Any] = {"linewidths": widths[order], "joinstyle": "round"}
    axes.add_collection(PolyCollection(painted, facecolors=fills, edgecolors=fills, **look))
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[: size[1] * SAMPLES, : size[0] * SAMPLES, :3]
