"""Views of a roof on sheets: plan, elevations, sections, each drawn to a scale that fits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..base.arrays import Floats
from ..base.errors import OptionError
from ..surface import Surface
from ..surface.curve_kinds import curves_by_kind
from ..surface.geometry import area_vectors
from .sections import Polyline
from .sheet import FORMATS, SCALES, SMALL, Line, Sheet, Text, corner, fits, room

CAPTION = 13.0  # mm below a view, for its size and its title
BESIDE = np.array([CAPTION, CAPTION + 3.0])  # mm to the left of a view and below it
ELEVATIONS = {  # to the right, and towards the viewer
    "front, seen along y": ((1.0, 0.0), (0.0, -1.0)),
    "right, seen against x": ((0.0, 1.0), (1.0, 0.0)),
    "back, seen against y": ((-1.0, 0.0), (0.0, 1.0)),
    "left, seen along x": ((0.0, -1.0), (-1.0, 0.0)),
}


@dataclass(frozen=True)
class Curve:
    """A ridge, a rim, a wall line or a cable's edge: its layer, points (k,3), and whether it is closed."""

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
    """Ridges, where two sheets of the roof meet; rims, where one ends; lines of walls alone; cables."""
    curves = [
        Curve(f"PCMC-{kind}", surface.vertices[curve.vertices], curve.closed, tuple(map(int, curve.vertices)))
        for kind, curve in curves_by_kind(surface)
    ]
    edges = [edge for cable in surface.cables for edge in cable.edges]  # cables may branch
    return curves + [Curve("PCMC-CABLE", surface.vertices[e], False, tuple(map(int, e))) for e in edges]


def plan(surface: Surface, curves: Sequence[Curve], points: Sequence[tuple[str, Floats]]) -> View:
    """From above: panels, curves, setting-out points, and the overall size."""
    view = View("plan")
    roof = surface.roof[surface.patch_of_face]
    edges = surface.topology.edges[np.unique(surface.topology.edge_of_face[roof])]
    view.lines += [Line(pair, "PCMC-PANEL") for pair in surface.vertices[edges][:, :, :2]]
    view.lines += [Line(c.points[:, :2], c.layer, c.closed) for c in curves]
    view.points += [(at[:2], name) for name, at in points]
    return view


def elevations(surface: Surface, curves: Sequence[Curve]) -> list[View]:
    """From four sides: curves, and the edges of the panels that face the viewer."""
    topo, X = surface.topology, surface.vertices
    roof = surface.roof[surface.patch_of_face]
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
    return "PCMC-SECTION" if surface.roof[line.patch] else "PCMC-SECTION-WALL"


def placed(views: Sequence[View], title: str, name: str, millimetres: float, scale: int | None) -> Sheet:
    """The views on one sheet, in a grid, at one scale: the one given, or the largest that fits.

    Raises
    ------
    OptionError : they do not fit at the scale given; the message names the smallest format that holds them.
    """
    boxes = [view.box for view in views]
    extent = np.max([high - low for low, high in boxes], axis=0)
    scale, columns = _scale(extent * millimetres, len(views), name, scale, title)
    rows = math.ceil(len(views) / columns)
    sheet = Sheet(title, name, f"1:{scale}")
    factor = millimetres / scale
    cell = extent * factor + BESIDE
    origin = corner() + 0.5 * (np.array(room(name)) - np.array([columns, rows]) * cell) + BESIDE
    for k, (view, (low, high)) in enumerate(zip(views, boxes, strict=True)):
        place = origin + np.array([k % columns, rows - 1 - k // columns]) * cell
        spare = np.array([0.5 * factor * (extent - (high - low))[0], 0.0])
        shift = place + spare - factor * low
        _add(sheet, view, factor, shift)
        _add_size(sheet, factor * low + shift, factor * high + shift, high - low)
        if len(views) > 1:
            at = float(0.5 * factor * (low + high)[0] + shift[0]), float(place[1]) - CAPTION + SMALL
            sheet.texts.append(Text(at, view.title, align="C"))
    return sheet


def _scale(size: Floats, count: int, name: str, scale: int | None, title: str) -> tuple[int, int]:
    """The scale, 1 to this, and the columns with which views of ``size`` (2,) mm fit a format."""
    grids = [(columns, math.ceil(count / columns)) for columns in range(1, count + 1)]
    for one in SCALES if scale is None else (scale,):
        for grid in grids:
            if fits(np.array(grid) * (size / one + BESIDE), name):
                return one, grid[0]
    one = scale or SCALES[-1]
    needed = [np.array(grid) * (size / one + BESIDE) for grid in grids]
    better = next((f for f in FORMATS if any(fits(each, f) for each in needed)), None)
    least = min(needed, key=lambda each: float(each.max()))
    text = (
        f"scale: {title.lower()} at 1:{one} needs {least[0]:.0f} × {least[1]:.0f} mm, more than {name} has;"
    )
    text += f" use sheet {better!r}" if better else " use a smaller scale"
    raise OptionError(text, what="scale", found=scale, expected=better)


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
