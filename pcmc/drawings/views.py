"""Views of a roof on sheets: plan, elevations, sections, each drawn to a scale that fits."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from ..base.arrays import Bools, Floats
from ..base.errors import OptionError
from ..surface import Surface
from ..surface.geometry import area_vectors
from ..surface.sections import curves_by_kind, section
from .sheet import (
    CORNER,
    FORMATS,
    MEMBERS,
    SMALL,
    Dimension,
    Lines,
    Sheet,
    SheetLine,
    Text,
    drawing_area,
    place_labels,
    width,
)

SCALES: tuple[float, ...] = (0.02, 0.05, 0.1, 0.2, 0.5)
SCALES += (1, 2, 5, 10, 20, 25, 50, 100, 200, 250, 500, 1000, 2000, 5000, 10000, 20000, 50000)
"""The scales that are chosen from where none is given, 1 to this: ISO 5455 and a few between and beyond."""
ROW = 6.0  # mm between a view and its dimensions, and between their rows
BEFORE = np.array([2 * ROW + 5.0, 2 * ROW + 10.0])  # mm left of a view and below it: dimensions, title
BEHIND = np.array([24.0, 4.0])  # mm right of a view and above it: levels
TINY = 1.8  # mm: height of the numbers of setting-out points
TURN = 0.87  # cosine of the turn from which a point of an outline is a corner
ELEVATIONS = {  # to the right, and towards the viewer
    "south, seen along y": ((1.0, 0.0), (0.0, -1.0)),
    "east, seen against x": ((0.0, 1.0), (1.0, 0.0)),
    "north, seen against y": ((-1.0, 0.0), (0.0, 1.0)),
    "west, seen along x": ((0.0, -1.0), (-1.0, 0.0)),
}


@dataclass
class DrawnView:
    """What is drawn on two axes, in the surface's unit."""

    title: str
    lines: list[SheetLine] = field(default_factory=list)
    texts: list[tuple[Floats, str, Floats]] = field(default_factory=list)  # at points, in a direction (2,)
    points: list[tuple[Floats, str, str]] = field(default_factory=list)  # marked, with their names and layers
    stations: tuple[Floats, Floats] = (np.empty(0), np.empty(0))  # along each axis, to be dimensioned
    levels: Floats = field(default_factory=lambda: np.empty(0))  # heights that are marked beside it

    @property
    def box(self) -> tuple[Floats, Floats]:
        """(2,) lower and upper corner of all lines."""
        every = np.concatenate([line.points for line in self.lines])
        return every.min(axis=0), every.max(axis=0)


def model_curves(surface: Surface, without: Collection[str] = ()) -> list[SheetLine]:
    """Ridges, where two sheets meet; rims, where one ends; lines in mirrors and of walls alone, but for those
    ``without``; cables."""
    found = []
    for kind, curve in curves_by_kind(surface, without):
        names = dict.fromkeys(surface.patches[k].name for k in curve.sheets)
        found.append((f"PCMC-{kind}", curve, " | ".join(names)))
    for cable in surface.cables:
        found += [("PCMC-CABLE", c, cable.name) for c in surface.topology.chains(cable.edges)]
    return [
        SheetLine(surface.vertices[c.vertices], layer, c.closed, name, tuple(c.vertices.tolist()))
        for layer, c, name in found
    ]


def outline_places(curves: Lines, axis: Sequence[float]) -> Floats:
    """Where the corners and ends of rims and wall lines are along an axis (3,), and how far these reach; of
    roofs without rims, as cushions are, those of ridges."""
    places, layers = [], {curve.layer for curve in curves}
    for curve in curves:
        if curve.layer in ("PCMC-WALL", "PCMC-RIM" if "PCMC-RIM" in layers else "PCMC-RIDGE"):
            P = curve.points
            before, after = P - np.roll(P, 1, axis=0), np.roll(P, -1, axis=0) - P
            sizes = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
            sharp = np.einsum("ij,ij->i", before, after) < TURN * sizes
            if not curve.closed:
                sharp[[0, -1]] = True
            along = P @ np.array(axis)
            places += [along[sharp], [along.min(), along.max()]]
    return np.concatenate(places) if places else np.empty(0)


def cut_lines(
    surface: Surface, point: Floats, normal: Floats, without: Collection[str] = ()
) -> list[SheetLine]:
    """The lines in which a plane cuts the roof and its walls, but for those ``without``."""
    layers = ["PCMC-SECTION" if roof else "PCMC-SECTION-WALL" for roof in surface.roof]
    named = [(one, surface.patches[one.patch].name) for one in section(surface, point, normal)]
    kept = [(one, name) for one, name in named if name not in without]
    return [SheetLine(one.points, layers[one.patch], one.closed, name) for one, name in kept]


def _seen(title: str, surface: Surface, curves: Lines, axes: Floats, faces: Bools) -> DrawnView:
    """The edges of faces and the curves on two axes (2,3)."""
    edges = surface.topology.edges[surface.topology.edges_of(faces)]
    lines = [SheetLine(pair, "PCMC-PANEL") for pair in surface.vertices[edges] @ axes.T]
    return DrawnView(title, lines + [curve._replace(points=curve.points @ axes.T) for curve in curves])


def plan_view(surface: Surface, curves: Lines, points: Sequence[tuple[Floats, str, str]]) -> DrawnView:
    """From above: panels, curves with names of cables and members, points, places of outline and walls."""
    view = _seen("plan", surface, curves, np.eye(3)[:2], surface.roof[surface.patch_of_face])
    view.points = [(at[:2], name, layer) for at, name, layer in points]
    middle = 0.5 * np.sum(view.box, axis=0)
    for curve in curves:
        if curve.layer in ("PCMC-CABLE", MEMBERS):
            at = curve.points[[(len(curve.points) - 1) // 2, len(curve.points) // 2], :2].mean(axis=0)
            away = at - middle
            view.texts.append((at, curve.name, away / (np.linalg.norm(away) or 1.0)))
    view.stations = outline_places(curves, (1.0, 0.0, 0.0)), outline_places(curves, (0.0, 1.0, 0.0))
    return view


def elevations(surface: Surface, curves: Lines) -> list[DrawnView]:
    """From four sides: curves, the edges of the panels that face the viewer, and levels."""
    height, normal = surface.vertices[:, 2], area_vectors(surface.vertices[surface.faces])
    views = []
    for title, (right, towards) in ELEVATIONS.items():
        axes = np.array([[*right, 0.0], [0.0, 0.0, 1.0]])
        facing = surface.roof[surface.patch_of_face] & (normal[:, :2] @ np.array(towards) > 0.0)
        along, heights = (np.sort(outline_places(curves, axis)) for axis in axes)
        views.append(_seen(title, surface, curves, axes, facing))
        views[-1].stations = along[[0, -1]] if len(along) else along, np.empty(0)
        views[-1].levels = np.append(heights, [height.min(), height.max()])
    return views


def contours(surface: Surface, curves: Lines, cuts: Sequence[tuple[float, list[SheetLine]]]) -> DrawnView:
    """Sections at heights, seen from above, each with its height."""
    view = plan_view(surface, curves, ())
    view.title = "sections at heights"
    view.lines = [line for line in view.lines if line.layer != "PCMC-PANEL"]
    for height, lines in cuts:
        view.lines += [one._replace(points=one.points[:, :2]) for one in lines]
        top = max((one.points for one in lines), key=lambda points: float(points[:, 1].max()))
        view.texts.append((top[top[:, 1].argmax(), :2], f"z = {height:.6g}", np.array([0.0, 1.0])))
    return view


def profile(name: str, start: Floats, along: Floats, lines: Lines) -> DrawnView:
    """A section along a line in the plan: distance from the line's first point, and height.

    Its stations and levels are the ends of its lines, where the roof ends or meets a wall, and its top.
    """
    view, ends = DrawnView(name), [np.empty((0, 2))]
    for one in lines:
        flat = np.stack([(one.points[:, :2] - start) @ along, one.points[:, 2]], axis=1)
        view.lines.append(one._replace(points=flat))
        ends.append(flat[[flat[:, 0].argmin(), flat[:, 0].argmax()] if one.closed else [0, -1]])
    stations, levels = np.concatenate(ends).T
    view.stations, view.levels = (stations, np.empty(0)), np.append(levels, [end[1] for end in view.box])
    return view


def placed(
    views: Sequence[DrawnView], title: str, name: str, millimetres: float, scale: int | None, decimals: int
) -> Sheet:
    """The views on one sheet, in a grid, at one scale: the one given, or the largest that fits.

    OptionError if they do not fit at the scale given, with the smallest format that holds them.
    """
    boxes = [view.box for view in views]
    extent = np.max([high - low for low, high in boxes], axis=0)
    grids = np.array([(columns, math.ceil(len(views) / columns)) for columns in range(1, len(views) + 1)])
    for chosen in SCALES if scale is None else (scale,):
        factor = millimetres / chosen
        cell = extent * factor + BEFORE + BEHIND
        fits = {f: (grids * cell <= drawing_area(f) + 1e-9).all(axis=1) for f in FORMATS}
        if fits[name].any():
            break
    else:
        better = next((f for f in FORMATS if fits[f].any()), None)
        wide, high = min((grids * cell).tolist(), key=max)
        text = f"scale: {title.lower()} at 1:{chosen} needs {wide:.0f} × {high:.0f} mm, more than {name} has;"
        text += f" use sheet {better!r}" if better else " use a smaller scale"
        raise OptionError(text, what="scale", found=scale, expected=better)
    columns, rows = grids[fits[name].argmax()].tolist()
    sheet = Sheet(title, name, f"{1 / chosen:g}:1" if chosen < 1 else f"1:{chosen}")
    origin = CORNER + 0.5 * (drawing_area(name) - np.array([columns, rows]) * cell) + BEFORE
    for k, (view, (low, high)) in enumerate(zip(views, boxes, strict=True)):
        place = origin + np.array([k % columns, rows - 1 - k // columns]) * cell
        shift = place - factor * low
        shift[0] += 0.5 * factor * (extent - (high - low))[0]
        sheet.places.append((factor, shift))
        _add_dimensions(sheet, view, factor, shift, decimals)
        if len(views) > 1:
            at = float(0.5 * factor * (low + high)[0] + shift[0]), float(place[1] - BEFORE[1]) + SMALL
            sheet.texts.append(Text(at, view.title, align="C"))
        _add(sheet, view, factor, shift)
    return sheet


def _add(sheet: Sheet, view: DrawnView, factor: float, shift: Floats) -> None:
    """Lines, marked points, and the names that find room: those of supports and cables first."""
    lines = sorted(view.lines, key=lambda line: line.layer != "PCMC-PANEL")
    sheet.lines += [SheetLine(factor * line.points + shift, line.layer, line.closed) for line in lines]
    small, marks = list[Text](), list[Text]()
    large = [
        Text(factor * at + shift + direction * [0.5 * width(text) + 1.0, SMALL], text, align="C")
        for at, text, direction in view.texts
    ]
    for at, name, layer in view.points:
        place = factor * at + shift
        half, height = (0.8, TINY) if layer == "PCMC-POINT" else (1.5, SMALL)
        square = place + half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        sheet.lines += [SheetLine(square[::2], layer), SheetLine(square[[3, 1]], layer)]
        if layer != "PCMC-POINT":
            sheet.lines.append(SheetLine(square, layer, True))
            marks.append(Text(place, "##", align="C"))  # kept free of names
        beside = place + np.array([half + 0.3, half + 0.6 * height])
        (small if layer == "PCMC-POINT" else large).append(Text(beside, name, height, layer))
    kept = [line for line in sheet.lines if line.layer != "PCMC-PANEL"]
    sheet.texts += place_labels(large, sheet.drawn()[1], kept)
    sheet.texts += place_labels(small, [*sheet.drawn()[1], *marks], kept, rings=2, needed=False)


def _add_dimensions(sheet: Sheet, view: DrawnView, factor: float, shift: Floats, decimals: int) -> None:
    """Distances between stations, and over all, below and left of a view; levels at its right."""
    low, high = (factor * end + shift for end in view.box)
    for axis, stations in enumerate(view.stations):
        places = np.unique((factor * stations + shift[axis]).round(6))
        chosen = _spaced(places, width(f"{(places[-1:] - places[:1]).sum() / factor:.{decimals}f}") + 2.0)
        chains = [chosen, chosen[[0, -1]]] if len(chosen) > 2 else [chosen]
        for row, chain in enumerate(chains, start=1):
            feet = np.tile(low, (len(chain), 1))
            feet[:, axis] = chain
            at = float(low[1 - axis] - row * ROW)
            sheet.dimensions += [Dimension(a, b, axis, at, 1.0 / factor, decimals) for a, b in pairwise(feet)]
    places = np.unique((factor * view.levels + shift[1]).round(6))
    for y in _spaced(places, 2.0 * SMALL).tolist():
        x, z = float(high[0]) + 3.0, (y - shift[1]) / factor
        mark = np.array([[x, y], [x + 1.2, y + 2.0], [x - 1.2, y + 2.0]])
        rule = np.array([[x - 2.0, y], [x + 18.0, y]])
        sheet.lines += [SheetLine(mark, "PCMC-DIM", True), SheetLine(rule, "PCMC-DIM")]
        text = f"{z:+.{decimals}f}"
        text = text if float(text) else f"±{abs(z):.{decimals}f}"
        sheet.texts.append(Text((x + 2.0, y + 0.7 * SMALL), text, layer="PCMC-DIM"))


def _spaced(places: Floats, least: float) -> Floats:
    """Those of ascending numbers that are ``least`` apart: the last, the first if there is room, and others.

    >>> _spaced(np.array([0.0, 1.0, 4.0, 8.5, 10.0]), 2.0).tolist()
    [0.0, 4.0, 10.0]
    """
    chosen: list[float] = []
    for place in places[:-1].tolist():
        if places[-1] - place >= least and (not chosen or place - chosen[-1] >= least):
            chosen.append(place)
    return np.array([*chosen, *places[-1:]])
