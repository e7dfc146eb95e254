"""Views of a roof on sheets: plan, elevations, sections, each drawn to a scale that fits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..base.arrays import Floats
from ..base.errors import OptionError
from ..surface import Surface
from ..surface.geometry import area_vectors
from .sections import Polyline
from .sheet import GAP, SCALES, SMALL, Line, Sheet, Text, corner, fits, room, smallest_format

CAPTION = 3.0 * SMALL  # mm below a view
ELEVATIONS = {  # to the right, and towards the viewer
    "front, seen along y": ((1.0, 0.0), (0.0, -1.0)),
    "right, seen against x": ((0.0, 1.0), (1.0, 0.0)),
    "back, seen against y": ((-1.0, 0.0), (0.0, 1.0)),
    "left, seen along x": ((0.0, -1.0), (-1.0, 0.0)),
}


@dataclass(frozen=True)
class Curve:
    """A ridge, a rim or a wall line: its layer, points (k,3), and whether it is closed."""

    layer: str
    points: Floats
    closed: bool
    vertices: tuple[int, ...] = field(repr=False)


@dataclass
class View:
    """What is drawn on two axes, in the surface's unit: lines by layer, and texts at points."""

    title: str
    lines: list[Line] = field(default_factory=list)
    texts: list[tuple[Floats, str]] = field(default_factory=list)
    points: list[tuple[Floats, str]] = field(default_factory=list)

    @property
    def box(self) -> tuple[Floats, Floats]:
        """(2,) lower and upper corner of all lines."""
        every = np.concatenate([line.points for line in self.lines])
        return every.min(axis=0), every.max(axis=0)


def model_curves(surface: Surface) -> list[Curve]:
    """Ridges, where two sheets of the roof meet; rims, where one ends; and lines of walls alone."""
    topo, walls = surface.topology, surface.walls
    curves = []
    for curve in (*topo.junctions, *topo.boundary_loops):
        roofs = sum(not walls[k] for k in curve.sheets)
        layer = "PCMC-RIDGE" if roofs > 1 else "PCMC-RIM" if roofs == 1 else "PCMC-WALL"
        vertices = tuple(map(int, curve.vertices))
        curves.append(Curve(layer, surface.vertices[curve.vertices], curve.closed, vertices))
    return curves


def plan(surface: Surface, curves: Sequence[Curve], points: Sequence[tuple[str, Floats]]) -> View:
    """From above: panels, curves, setting-out points, and the overall size."""
    view = View("plan")
    roof = ~surface.walls[surface.patch_of_face]
    edges = surface.topology.edges[np.unique(surface.topology.edge_of_face[roof])]
    view.lines += [Line(pair, "PCMC-PANEL") for pair in surface.vertices[edges][:, :, :2]]
    view.lines += [Line(c.points[:, :2], c.layer, c.closed) for c in curves]
    view.points += [(at[:2], name) for name, at in points]
    return view


def elevations(surface: Surface, curves: Sequence[Curve]) -> list[View]:
    """From four sides: curves, and the edges of the panels that face the viewer."""
    topo, X = surface.topology, surface.vertices
    roof = ~surface.walls[surface.patch_of_face]
    normal = area_vectors(X[surface.faces])
    views = []
    for title, (right, towards) in ELEVATIONS.items():
        axes = np.array([[*right, 0.0], [0.0, 0.0, 1.0]])
        facing = roof & (normal[:, :2] @ np.array(towards) > 0.0)
        edges = topo.edges[np.unique(topo.edge_of_face[facing])]
        view = View(title)
        view.lines += [Line(pair, "PCMC-PANEL") for pair in X[edges] @ axes.T]
        view.lines += [Line(c.points @ axes.T, c.layer, c.closed) for c in curves]
        views.append(view)
    return views


def contours(surface: Surface, curves: Sequence[Curve], cuts: Sequence[tuple[float, list[Polyline]]]) -> View:
    """Sections at heights, seen from above, each with its height."""
    view = View("sections at heights")
    view.lines += [Line(c.points[:, :2], c.layer, c.closed) for c in curves]
    for height, lines in cuts:
        view.lines += [Line(one.points[:, :2], section_layer(surface, one), one.closed) for one in lines]
        longest = max(lines, key=lambda one: len(one.points))
        view.texts.append((longest.points[len(longest.points) // 2, :2], f"z = {height:.6g}"))
    return view


def profile(surface: Surface, name: str, start: Floats, along: Floats, lines: list[Polyline]) -> View:
    """A section along a line in the plan: distance from the line's first point, and height."""
    view = View(name)
    for one in lines:
        flat = np.stack([(one.points[:, :2] - start) @ along, one.points[:, 2]], axis=1)
        view.lines.append(Line(flat, section_layer(surface, one), one.closed))
    return view


def section_layer(surface: Surface, line: Polyline) -> str:
    """The layer of a section's line: of the roof, or of a wall."""
    return "PCMC-SECTION-WALL" if surface.walls[line.patch] else "PCMC-SECTION"


def placed(
    views: Sequence[View], title: str, name: str, millimetres: float, scale: int | None, columns: int = 1
) -> Sheet:
    """The views on one sheet, in a grid, at one scale: the one given, or the largest that fits.

    Raises
    ------
    OptionError : they do not fit at the scale given; the message names the smallest format that holds them.
    """
    columns = min(columns, len(views))
    rows = math.ceil(len(views) / columns)
    boxes = [view.box for view in views]
    extent = np.max([high - low for low, high in boxes], axis=0)
    gaps = np.array([(columns - 1) * 2.0 * GAP + 12.0, (rows - 1) * GAP + rows * CAPTION + 12.0])
    times = np.array([columns, rows])
    scale = _scale(extent * times * millimetres, gaps, name, scale, title)
    sheet = Sheet(title, name, f"1:{scale}")
    factor = millimetres / scale
    cell = extent * factor + np.array([2.0 * GAP, GAP + CAPTION])
    origin = corner() + 0.5 * (np.array(room(name)) - times * extent * factor - gaps) + 6.0
    for k, (view, (low, high)) in enumerate(zip(views, boxes, strict=True)):
        place = origin + np.array([k % columns, rows - 1 - k // columns]) * cell + [0.0, CAPTION]
        shift = place - factor * (0.5 * (low + high) - 0.5 * extent * np.array([1.0, 0.0]))
        shift[1] = place[1] - factor * low[1]
        _add(sheet, view, factor, shift)
        _add_size(sheet, factor * low + shift, factor * high + shift, high - low)
        under = float(place[1] - CAPTION)
        if len(views) > 1:
            at = float(0.5 * factor * (low[0] + high[0]) + shift[0])
            sheet.texts.append(Text((at, under), view.title, align="C"))
    return sheet


def _scale(size: Floats, gaps: Floats, name: str, scale: int | None, title: str) -> int:
    """The scale, 1 to this, at which ``size`` (2,) mm fits a format: as given, or the largest."""
    for one in SCALES if scale is None else (scale,):
        if fits(size / one + gaps, name):
            return one
    needed = size / (scale or SCALES[-1]) + gaps
    better = smallest_format(needed)
    text = (
        f"scale: {title.lower()} at 1:{scale or SCALES[-1]} needs {needed[0]:.0f} × {needed[1]:.0f} mm, more"
    )
    text += f" than {name} has; use " + (f"sheet {better!r}" if better else "a smaller scale")
    raise OptionError(text, what="scale", found=scale, expected=better or None)


def _add(sheet: Sheet, view: View, factor: float, shift: Floats) -> None:
    sheet.lines += [
        Line(factor * line.points + shift, line.layer, line.closed)
        for line in sorted(view.lines, key=lambda line: line.layer != "PCMC-PANEL")
    ]
    for at, text in view.texts:
        x, y = factor * at + shift
        sheet.texts.append(Text((float(x), float(y) + SMALL), text, align="C"))
    for at, text in view.points:
        x, y = map(float, factor * at + shift)
        for step in ((0.8, 0.8), (0.8, -0.8)):
            cross = np.array([[x - step[0], y - step[1]], [x + step[0], y + step[1]]])
            sheet.lines.append(Line(cross, "PCMC-POINT"))
        sheet.texts.append(Text((x + 1.0, y + 1.2), text, 1.3, "PCMC-POINT"))


def _add_size(sheet: Sheet, low: Floats, high: Floats, size: Floats) -> None:
    """The overall size along both axes, below and to the left."""
    for axis in (0, 1):
        if size[axis] <= 0.0:
            continue
        a, b = low - 4.0, low - 4.0
        a[axis], b[axis] = low[axis], high[axis]
        tick = np.array([1.0, 1.0])
        sheet.lines += [
            Line(np.stack(pair), "PCMC-TEXT") for pair in ((a, b), (a - tick, a + tick), (b - tick, b + tick))
        ]
        middle = 0.5 * (a + b)
        middle[1 - axis] -= SMALL
        at = (float(middle[0]), float(middle[1]))
        sheet.texts.append(Text(at, f"{size[axis]:.6g}", align="C", turn=90.0 * axis))
