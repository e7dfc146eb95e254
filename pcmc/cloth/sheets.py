"""Drawings of a cutting pattern: seams on the roof, strips with allowances, notches and labels, tables."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..base.arrays import Floats
from ..base.errors import OptionError
from ..base.libraries import load_library
from ..base.tolerances import ON
from ..base.units import Units, as_units, expect_length, length_factor
from ..drawings import DrawingSet, Sheet
from ..drawings.drawing_set import CSV, document_files
from ..drawings.drawing_set import SUFFIXES as DRAWINGS
from ..drawings.sheet import SheetLine, Text, add_frames, length_decimals, table_sheets
from ..drawings.views import DrawnView, placed
from ..surface.geometry import cross_2d, lengths_along, unit_vectors
from .strips import CuttingPattern, Seam, Side, Strip

SUFFIXES, TABLES = (*DRAWINGS, CSV), ("", "seams")  # tables of strips and of seams
LAYER_OF = {"seam": "PCMC-SEAM", "junction": "PCMC-RIDGE", "mirror": "PCMC-SEAM", "rim": "PCMC-RIM"}
PER_SHEET = 4  # strips drawn to scale on a sheet
LETTERS, GAP = 40.0, 150.0  # mm: height of labels at true size; between strips there
MITRE = 3.0  # of an allowance: so far from a corner cloth is cut across, if the lines outside meet farther
MOST_NOTCHES = 1000  # on a seam; more mean a mistake in the unit
ARROW = 0.3  # of a strip's length: the arrow of its warp


def pattern_drawings(
    pattern: CuttingPattern, units: str | Units, *, sheet: str = "A1", name: str = "", mark: str = ""
) -> DrawingSet:
    """The sheets of a cutting pattern, and a model with all strips flat at true size, for .dxf, .pdf, .svg.

    Parameters
    ----------
    units : of the lengths: "m", "cm", "mm", "ft" or "in".
    sheet : format of the sheets, "A4" to "A0".
    name, mark : of the roof, in the title strips and on every sheet.

    >>> from pcmc import Patch, Surface, cutting_pattern
    >>> flat = Surface([[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]], [[0, 1, 2], [0, 2, 3]], [0, 0],
    ...                [Patch("sail", 2.0, pressure=0.0)], fixed=range(4))
    >>> drawings = pattern_drawings(cutting_pattern(flat, strips=2), "m", sheet="A3")
    >>> [page.title for page in drawings.sheets]
    ['Seams on the roof', 'Strips 1 to 2, outside up', 'Strips', 'Seams']
    """
    length = expect_length(as_units(units).length, "a cutting pattern")
    millimetres, decimals = length_factor(length, "mm"), length_decimals(length, pattern.surface.size)
    size = sheet, millimetres, None, decimals
    sheets = [seam_sheet(pattern, sheet, length)]
    for first in range(0, len(pattern.strips), PER_SHEET):
        group, views = pattern.strips[first : first + PER_SHEET], list[DrawnView]()
        for strip in group:  # as it is cut, with its net length and width
            lines, labels = strip_lines(pattern, strip)
            labels.append((_inside(strip), f"{strip.number}", np.zeros(2)))
            ends = np.array([0.0, strip.length]), np.array([0.0, strip.width])
            views.append(DrawnView(f"strip {strip.number}, {strip.patch}", lines, labels, stations=ends))
        title = f"Strips {group[0].number} to {group[-1].number}, outside up"
        sheets.append(placed(views, title, *size))
    head = {"area": f"area, {length}²", "cut_area": f"cut area, {length}²", "strain_min": "strain from, %"}
    head |= {"strain_max": "to, %", "strain_rms": "mean, %", "warp": "warp shorter, %", "weft": "weft, %"}
    sheets += table_sheets("Strips", pattern.table.rename(columns=head), sheet, decimals)
    sewn = pattern.seam_table.query("kind != 'rim'")[["seam", "kind", "strips", "length", "cut_length"]]
    if len(sewn):
        sheets += table_sheets("Seams", sewn.rename(columns={"cut_length": "cut length"}), sheet, decimals)
    add_frames(sheets, name, length, pattern.certificate, mark)
    rows = [[str(strip.number), *at, "strip"] for strip, at in _middles(pattern)]
    points = pd.DataFrame(rows, columns=["point", *"xyz", "on"])
    about = pattern.surface, length, pattern.certificate, _curves(pattern)
    return DrawingSet(*about, (), points, (), None, _side_by_side(pattern, millimetres), sheets, mark=mark)


def pattern_files(
    pattern: CuttingPattern,
    paths: Iterable[str | os.PathLike[str]],
    units: str | Units,
    sheet: str = "A1",
    name: str = "",
    mark: str = "",
) -> list[tuple[Path, Callable[[Path], Any]]]:
    """Each file of a cutting pattern with the function that writes it; FileError for an unknown suffix."""
    tables = dict(zip(TABLES, (pattern.table, pattern.seam_table), strict=True))
    draw = partial(pattern_drawings, pattern, units, sheet=sheet, name=name, mark=mark)
    return document_files(paths, draw, tables, {}, "a cutting pattern")


def _curves(pattern: CuttingPattern) -> list[SheetLine]:
    """The seams on the roof."""
    return [SheetLine(seam.points, LAYER_OF[seam.kind], name=f"S{seam.number}") for seam in pattern.seams]


def _middles(pattern: CuttingPattern) -> list[tuple[Strip, Floats]]:
    """Each strip and its middle (3,) on the roof."""
    return [(s, s.areas @ s.roof[s.faces].mean(axis=1) / s.area) for s in pattern.strips]


def seam_sheet(pattern: CuttingPattern, sheet: str, length: str) -> Sheet:
    """The seams from above, with the numbers of strips, and the places of corners along both axes; square to
    a tilted plane Π, in its coordinates, as drawn seams have them."""
    plane, title = pattern.surface.plane, "Seams on the roof"
    if tilted := bool((plane.axes != np.eye(3)).any()):
        title += ", seen square to its tilted plane and placed in its axes"
    seen = plane.to_local if tilted else np.asarray
    lines = [curve._replace(points=seen(curve.points)[:, :2]) for curve in _curves(pattern)]
    texts = [(seen(at)[:2], str(strip.number), np.zeros(2)) for strip, at in _middles(pattern)]
    every = np.concatenate([line.points for line in lines])
    x, y = np.stack([every.min(axis=0), every.max(axis=0)], axis=1)
    views = [DrawnView("roof", lines, texts, stations=(x, y))]
    decimals = length_decimals(length, pattern.surface.size)
    return placed(views, title, sheet, length_factor(length, "mm"), None, decimals)


def _inside(strip: Strip) -> Floats:
    """(2,) a point in the middle of a cut strip."""
    return np.array(strip.polygon.representative_point().coords[0])


def strip_lines(
    pattern: CuttingPattern, strip: Strip
) -> tuple[list[SheetLine], list[tuple[Floats, str, Floats]]]:
    """What is drawn of a strip in its own coordinates, in the unit of the surface: the line to cut along, the
    seam lines, notches and the arrow of the warp; and the labels of its sides, seam and neighbour, at points
    (2,), with the unit vectors (2,) from there into the strip."""
    options, added, labels = pattern.options, dict[tuple[int, int], float](), []
    marks = [SheetLine(strip.cut[loop], "PCMC-SEAM", True) for loop in strip.outlines]
    mean = float(np.mean([s.width for s in pattern.strips]))
    step = mean if options.notches is None else options.notches
    for seam, side in [(m, side) for m in pattern.seams for side in m.sides if side.strip == strip.number]:
        beyond = options.rim_allowance if seam.kind == "rim" else options.allowance
        edges = side.edges if side.forward else side.edges[:, ::-1]
        added |= dict.fromkeys(map(tuple, edges.tolist()), beyond)
        count = int(seam.length / step) if seam.kind != "rim" and step > 0.0 else 0
        if count > MOST_NOTCHES:
            text = f"notches: marks at distances of {step:g} would be {count} on seam {seam.number}, more"
            text += f" than {MOST_NOTCHES}; give a larger one"
            raise OptionError(text, what="notches", found=step)
        length = beyond or 0.02 * strip.width
        for place in seam.length * np.arange(1, count + 1) / (count + 1):  # the same for all of its sides
            at, inward = _along(seam, side, strip, place)
            marks.append(SheetLine(np.array([at, at - length * inward]), "PCMC-NOTCH"))
        at, inward = _along(seam, side, strip, 0.5 * seam.length)
        others = "+".join(str(s.strip) for s in seam.sides if s is not side)
        others = "image" if seam.kind == "mirror" else others
        labels.append((at, f"S{seam.number}" + (f" / {others}" if others else ""), inward))
    cloth = _with_allowances(strip, added)
    shapes = [cloth.exterior, *cloth.interiors] if cloth.geom_type == "Polygon" else []
    cut = [SheetLine(np.array(ring.coords[:-1]), "PCMC-CUT", True) for ring in shapes]
    # the arrow along the warp, a tenth of the width below the strip's number
    middle, half = _inside(strip) - np.array([0.0, 0.1 * strip.width]), 0.5 * ARROW * strip.length
    barb, shaft = 0.1 * min(half, strip.width), middle + np.array([[-half, 0.0], [half, 0.0]])
    head = shaft[1] - barb * np.array([[1.0, -0.5], [0.0, 0.0], [1.0, 0.5]])
    return [*cut, *marks, SheetLine(shaft, "PCMC-WARP"), SheetLine(head, "PCMC-WARP")], labels


def _with_allowances(strip: Strip, added: Mapping[tuple[int, int], float]) -> Any:
    """The polygon of a strip with the cloth added outside each edge of its outline; in corners up to where
    the lines outside meet, or cut across at ``MITRE`` of the larger allowance if that is farther. Along the
    weft it reaches no farther than the allowance from the widest place."""
    shapely = load_library("shapely", "cloth")
    parts = [strip.polygon]
    for loop in strip.outlines:
        X, onward = strip.cut[loop], np.roll(strip.cut[loop], -1, axis=0)
        along = unit_vectors(onward - X)
        out = np.stack([along[:, 1], -along[:, 0]], axis=1)
        wide = np.array([added[ends] for ends in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)])
        out *= wide[:, None]
        turns = cross_2d(np.roll(along, 1, axis=0), along)
        parts += [shapely.Polygon([a, a + n, b + n, b]) for a, b, n in zip(X, onward, out, strict=True)]
        for k in np.flatnonzero((turns > 1e-9) & (wide + np.roll(wide, 1) > 0.0)).tolist():
            before, v = along[k - 1], X[k]
            reach = (wide[k] - wide[k - 1] * float(before @ along[k])) / turns[k]
            tip = out[k - 1] + reach * before
            tips = [tip] if reach >= 0.0 >= tip @ along[k] else []
            far, most = float(np.linalg.norm(tip)), MITRE * max(wide[k - 1], wide[k])
            if tips and far > most:
                short = [(n, n @ tip / far) for n in (out[k - 1], out[k])]
                tips = [n + (most - begin) / (far - begin) * (tip - n) for n, begin in short]
            parts.append(shapely.Polygon(v + np.array([0.0 * v, out[k - 1], *tips, out[k]])))
    # along a straight side rounding leaves slits between the parts, which close where they grow by as little
    little = ON * float(np.ptp(strip.cut, axis=0).max())
    cloth = shapely.union_all(parts).buffer(little, join_style="mitre").buffer(-little, join_style="mitre")
    # corners that point across the warp reach no farther than seams do: else the strip would be too wide
    (left, _, right, _), most = cloth.bounds, max(added.values())
    return cloth.intersection(shapely.box(left, -most, right, strip.width + most))


def _along(seam: Seam, side: Side, strip: Strip, place: float) -> tuple[Floats, Floats]:
    """The point (2,) of a strip at a length along a seam on the roof, and the unit vector into the strip."""
    total = lengths_along(seam.points)
    k = min(int(np.searchsorted(total, place, side="right")) - 1, len(total) - 2)
    a, b = strip.cut[side.edges[k]]
    (x, y), turn = (b - a) / np.linalg.norm(b - a), 1.0 if side.forward else -1.0
    return a + (place - total[k]) / (total[k + 1] - total[k]) * (b - a), turn * np.array([-y, x])


def _side_by_side(pattern: CuttingPattern, millimetres: float) -> Sheet:
    """All strips above one another at true size, mm, on one sheet without an end: for the model space."""
    sheet, top = Sheet("Strips", "A0", "1:1"), 0.0
    for strip in pattern.strips:
        lines, labels = strip_lines(pattern, strip)
        x, y = millimetres * np.concatenate([line.points for line in lines]).T
        shift, top = np.array([-x.min(), top - y.max()]), top - np.ptp(y) - GAP
        sheet.lines += [line._replace(points=millimetres * line.points + shift) for line in lines]
        height = min(LETTERS, 0.1 * millimetres * strip.width)
        about: Any = {"layer": "PCMC-LABEL", "align": "C"}
        for at, text, inward in labels:
            turn = float(np.degrees(np.arctan2(inward[1], inward[0]))) % 180.0 - 90.0
            place = millimetres * at + height * inward + shift
            sheet.texts.append(Text(place, text, height, turn=turn, **about))
        title = f"{strip.number}  {strip.patch}"
        sheet.texts.append(Text(millimetres * _inside(strip) + shift, title, 1.5 * height, **about))
    return sheet
