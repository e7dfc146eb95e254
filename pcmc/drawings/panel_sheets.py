"""Panels at true size, with their numbers, and along each edge the neighbour's number and the edge's."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from ..base.arrays import Floats
from ..base.errors import OptionError
from ..panels import Panels
from .sheet import WIDTH, Line, Sheet, Text, corner, room, smallest_format

SPACE = 6.0  # mm between panels


def panel_sheets(schedule: Panels, name: str, millimetres: float) -> list[Sheet]:
    """The panels in order of their numbers, row by row, on as many sheets as they need.

    Raises
    ------
    OptionError : a panel does not fit a sheet at true size; the message names the smallest format.
    """
    flat = schedule.flat * millimetres
    flat = _turned_to_fit(flat, name)
    sizes = np.ptp(flat, axis=1)
    labels = _labels(schedule)
    wide, high = room(name)
    sheets: list[Sheet] = []
    x = y = row = 0.0
    first = 0
    for k, size in enumerate(sizes):
        if x > 0.0 and x + size[0] > wide:
            x, y, row = 0.0, y + row + SPACE, 0.0
        if not sheets or y + size[1] > high:
            if sheets:
                _name(sheets[-1], first, k)
            sheets.append(Sheet("", name, "1:1"))
            x = y = row = 0.0
            first = k
        place = corner() + np.array([x, high - y - size[1]]) - flat[k].min(axis=0)
        _add_panel(sheets[-1], flat[k] + place, k, schedule, labels[k])
        x, row = x + size[0] + SPACE, max(row, float(size[1]))
    _name(sheets[-1], first, len(sizes))
    return sheets


def _name(sheet: Sheet, first: int, end: int) -> None:
    sheet.title = f"Panels {first + 1} to {end} at true size, outside up"


def _turned_to_fit(flat: Floats, name: str) -> Floats:
    """(k,3,2) the panels, turned by 90 degrees where only so they fit."""
    sizes, limit = np.ptp(flat, axis=1), np.array(room(name)) + 1e-9
    lying, standing = (sizes <= limit).all(axis=1), (sizes[:, ::-1] <= limit).all(axis=1)
    wrong = np.flatnonzero(~(lying | standing))
    if len(wrong):
        worst = wrong[sizes[wrong].max(axis=1).argmax()]
        size = sizes[worst]
        better = smallest_format(size) or smallest_format(size[::-1])
        hint = f"use sheet {better!r}" if better else "no format holds it: leave the panel sheets out"
        text = f"sheet: panel {worst + 1} is {size[0]:.0f} × {size[1]:.0f} mm at true size, more than"
        raise OptionError(f"{text} {name} has; {hint}", what="sheet", found=name, expected=better or None)
    turned = np.stack([-flat[..., 1], flat[..., 0]], axis=-1)
    return np.where(lying[:, None, None], flat, turned)


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
