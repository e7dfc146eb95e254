"""Panels at true size, with their numbers, and along each edge the neighbour's number and the edge's."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from ..base.arrays import Floats
from ..base.errors import OptionError
from ..panels import Panels
from .sheet import FORMATS, WIDTH, Line, Sheet, Text, corner, room

SPACE = 6.0  # mm between panels
TURNS = np.radians(np.arange(180.0))  # in which a panel is tried that does not fit as it lies


def panel_sheets(schedule: Panels, name: str, millimetres: float) -> list[Sheet]:
    """The panels in order of their numbers, row by row, on as many sheets as they need.

    Raises
    ------
    OptionError : a panel does not fit a sheet at true size; the message names the smallest format.
    """
    labels = _labels(schedule)
    wide, high = room(name)
    sheets: list[Sheet] = []
    row: list[Floats] = []  # the panels of the row being filled
    y = depth = 0.0  # the row's top below the sheet's, and its height
    first = 0
    for k, panel in enumerate(_turned_to_fit(schedule.flat * millimetres, name)):
        size = np.ptp(panel, axis=0)
        placed = _beside(row, panel)
        if not sheets or placed[:, 0].max() > wide or y + size[1] > high:
            y, depth, row = y + depth + SPACE, 0.0, []
            if not sheets or y + size[1] > high:
                if sheets:
                    _name(sheets[-1], first, k)
                sheets.append(Sheet("", name, "1:1"))
                y, first = 0.0, k
            placed = _beside(row, panel)
        row.append(placed)
        depth = max(depth, float(size[1]))
        place = corner() + np.array([0.0, high - y])
        _add_panel(sheets[-1], placed + place, k, schedule, labels[k])
    _name(sheets[-1], first, len(schedule.panels))
    return sheets


def _beside(row: list[Floats], panel: Floats) -> Floats:
    """The panel (3,2) to the right of those of a row, one side up or the other, as far left as possible.

    Its highest point has y = 0, at the left end of a row its leftmost one x = 0.
    """
    ways = []
    for way in (panel, -panel):
        at = way - np.array([way[:, 0].min(), way[:, 1].max()])
        shift = max((_gap(other, at) + SPACE for other in row[-3:]), default=0.0)
        ways.append(at + np.array([max(shift, 0.0), 0.0]))
    return min(ways, key=lambda way: float(way[:, 0].max()))


def _gap(left: Floats, right: Floats) -> float:
    """How far the right triangle must move along x until it only touches the left one.

    Both sides are convex, so a corner of one of the two touches.
    """
    low, high = max(left[:, 1].min(), right[:, 1].min()), min(left[:, 1].max(), right[:, 1].max())
    levels = np.clip(np.append(left[:, 1], right[:, 1]), low, high)
    return float((_reach(left, levels).max(axis=0) - _reach(right, levels).min(axis=0)).max())


def _reach(triangle: Floats, levels: Floats) -> Floats:
    """(2,k) the least and the largest x of a triangle at each level y."""
    x = []
    for a, b in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
        low, high = sorted((a, b), key=lambda point: float(point[1]))
        inside = (levels >= low[1]) & (levels <= high[1])
        rise = high[1] - low[1]
        share = (levels - low[1]) / rise if rise > 0.0 else np.zeros_like(levels)
        at = low[0] + share * (high[0] - low[0])
        x += [np.where(inside, at, np.nan), np.where(inside & (rise == 0.0), high[0], np.nan)]
    return np.stack([np.nanmin(x, axis=0), np.nanmax(x, axis=0)])


def _name(sheet: Sheet, first: int, end: int) -> None:
    sheet.title = f"Panels {first + 1} to {end} at true size, outside up"


def _turned_to_fit(flat: Floats, name: str) -> Floats:
    """(k,3,2) the panels; those that do not fit as they lie are turned until they do."""
    wrong = np.flatnonzero((np.ptp(flat, axis=1) > np.array(room(name)) + 1e-9).any(axis=1))
    flat = flat.copy()
    for k in wrong:
        turned = _turned(flat[k], name)
        if turned is None:
            better = next((f for f in FORMATS if _turned(flat[k], f) is not None), None)
            wide, high = np.ptp(flat[k], axis=0)
            text = f"sheet: panel {k + 1}, {wide:.0f} × {high:.0f} mm at true size, does not fit {name}; "
            text += f"use sheet {better!r}" if better else "nor any format: leave the panel sheets out"
            raise OptionError(text, what="sheet", found=name, expected=better)
        flat[k] = turned
    return flat


def _turned(corners: Floats, name: str) -> Floats | None:
    """A triangle (3,2) turned so that it fits a format, as low as possible; None if it fits in no way."""
    cosine, sine = np.cos(TURNS), np.sin(TURNS)
    turn = np.stack([np.stack([cosine, -sine], axis=-1), np.stack([sine, cosine], axis=-1)], axis=-2)
    ways = corners @ turn.transpose(0, 2, 1)
    sizes = np.ptp(ways, axis=1)
    fit = np.flatnonzero((sizes <= np.array(room(name)) + 1e-9).all(axis=1))
    return ways[fit[sizes[fit, 1].argmin()]] if len(fit) else None


def _labels(schedule: Panels) -> list[list[str]]:
    """For each panel the labels of its edges 0, 1, 2: the neighbours' numbers and the edge's."""
    sides = schedule.surface.topology.edge_of_face[schedule.panels["face"].to_numpy()]
    at_edge: dict[int, list[int]] = defaultdict(list)
    for number, edges in enumerate(sides.tolist(), start=1):
        for edge in edges:
            at_edge[edge].append(number)
    return [
        [_label(edge, [other for other in at_edge[edge] if other != number]) for edge in edges]
        for number, edges in enumerate(sides.tolist(), start=1)
    ]


def _label(edge: int, others: list[int]) -> str:
    return f"{'+'.join(map(str, others)) or 'rim'} / e{edge}"


def _add_panel(sheet: Sheet, corners: Floats, k: int, schedule: Panels, labels: list[str]) -> None:
    sheet.lines.append(Line(corners, "PCMC-CUT", True))
    edges = np.roll(corners, 1, axis=0) - np.roll(corners, -1, axis=0)  # edge j is opposite corner j
    lengths = np.linalg.norm(edges, axis=1)
    middle = (lengths[:, None] * corners).sum(axis=0) / lengths.sum()  # of the inscribed circle
    first, second = corners[1] - corners[0], corners[2] - corners[0]
    radius = abs(first[0] * second[1] - first[1] * second[0]) / lengths.sum()
    number = str(k + 1)
    family = f"F{schedule.panels['family'].iloc[k]}"
    height = min(12.0, 0.4 * radius, 1.2 * radius / (WIDTH * max(len(number), len(family))))
    x, y = map(float, middle)
    sheet.texts.append(Text((x, y + 0.2 * height), number, height, align="C"))
    sheet.texts.append(Text((x, y - 0.9 * height), family, 0.6 * height, align="C"))
    for j in range(3):
        small = min(4.0, 0.25 * radius, 0.7 * lengths[j] / (WIDTH * len(labels[j])))
        along = edges[j] / lengths[j]
        inward = np.array([-along[1], along[0]])
        at = 0.5 * (corners[j - 1] + corners[j - 2]) + small * inward
        turn = float(np.degrees(np.arctan2(along[1], along[0])))
        turn += 180.0 if not -90.0 < turn <= 90.0 else 0.0
        x, y = map(float, at)
        sheet.texts.append(Text((x, y), labels[j], float(small), "PCMC-LABEL", "C", turn))
