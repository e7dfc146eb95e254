"""What a picture shows."""

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure


def near(image, color, tolerance=0.12):
    """(h,w) pixels close to an RGB colour."""
    return (np.abs(image / 255.0 - color) < tolerance).all(axis=2)


def back_to_front(scene, low, scale, size):
    """(h,w,3) the triangles of a Scene as matplotlib paints them, the farthest first, each in one colour."""
    corners = scene.view.project(scene.corners)
    order = np.argsort(scene.view.depth(scene.corners).mean(axis=1), kind="stable")
    colors = scene.colors.mean(axis=1)[order]
    figure = Figure(figsize=(size[0] / 72.0, size[1] / 72.0), dpi=72.0)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(low[0], low[0] + size[0] / scale)
    axes.set_ylim(low[1], low[1] + size[1] / scale)
    axes.add_collection(PolyCollection(corners[order], facecolors=colors, edgecolors=colors, linewidths=0.4))
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3]
