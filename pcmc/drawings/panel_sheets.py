"""Panels at true size, with their numbers, and along each edge the neighbour's number and the edge's."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from itertools import count
from string import ascii_lowercase
from typing import NamedTuple

import numpy as np
import pandas as pd

from ..base.arrays import Floats
from ..panelling import PanelNet, Panels
from ..panelling.planar import laid_flat_polygons
from ..panelling.schedule import packed, turned_to_fit
from ..surface.geometry import cross_2d
from .sheet import CORNER, WIDTH, Sheet, SheetLine, Text, drawing_area, table_sheets

LEAST_WARP = 0.05  # mm: corners that are farther from the panel's plane are marked on its sheet


class FlatPanel(NamedTuple):
    """A panel at true size with what is written on it."""

    corners: Floats  # (k,2) mm, outside up
    number: int
    below: str
    labels: list[str]  # of the edges, the first from corner 0 to 1: the neighbour's number and the edge's


def panel_sheets(panels: Sequence[FlatPanel], name: str) -> list[Sheet]:
    """The panels in order of their numbers, row by row, on as many sheets as they need.

    Those that fit no sheet at true size are listed on sheets of their own; ``flat_panels`` has them.
    """
    wide, high = drawing_area(name)
    turned = [(panel, turned_to_fit(panel.corners, wide, high)) for panel in panels]
    fit = [panel._replace(corners=corners) for panel, corners in turned if corners is not None]
    sheets: list[Sheet] = []
    for panel, (page, placed) in zip(fit, packed((one.corners for one in fit), wide, high), strict=True):
        if page == len(sheets):
            first = panel.number
            sheets.append(Sheet("", name, "1:1"))
        named = f"Panel {first}" if panel.number == first else f"Panels {first} to {panel.number}"
        sheets[page].title = f"{named} at true size, outside up"
        _add_panel(sheets[page], panel._replace(corners=placed + CORNER + [0.0, high]))
    large = [panel for panel, corners in turned if corners is None]
    if large:
        edges = [[f"{x:.1f}" for x in _edges(panel.corners)[1]] for panel in large]
        most = max(map(len, edges))
        letters = [f"{ascii_lowercase[k % 26]}{k // 26 or ''}" for k in range(most)]
        table = pd.DataFrame([[*row, *[""] * (most - len(row))] for row in edges], columns=letters)
        table.insert(0, "panel", [panel.number for panel in large])
        title = f"Panels larger than {name}: flat at true size in the model space of the .dxf"
        sheets += table_sheets(title, table, name, 1, dict.fromkeys(table.columns[1:], "mm"))
    return sheets


def flat_panels(panels: Sequence[FlatPanel]) -> Sheet:
    """All panels side by side at true size, mm, on one sheet without an end: for the model space."""
    sheet, sizes = Sheet("Panels", "A0", "1:1"), [np.ptp(panel.corners, axis=0) for panel in panels]
    across = max(1.5 * float(np.sqrt(sum(map(np.prod, sizes)))), *(float(size[0]) for size in sizes))
    placed = packed((panel.corners for panel in panels), across, np.inf)
    for panel, (_, corners) in zip(panels, placed, strict=True):
        _add_panel(sheet, panel._replace(corners=corners))
    return sheet


def triangles_at_true_size(schedule: Panels, millimetres: float) -> list[FlatPanel]:
    """The triangles of a schedule, with their families."""
    sides = schedule.surface.topology.edge_of_face[schedule.panels["face"].to_numpy()].tolist()
    at_edge: dict[int, list[int]] = defaultdict(list)
    for number, edges in enumerate(sides, start=1):
        for edge in edges:
            at_edge[edge].append(number)
    labels = [
        [f"{'+'.join(str(k) for k in at_edge[e] if k != number) or 'rim'} / e{e}" for e in edges]
        for number, edges in enumerate(sides, start=1)
    ]
    rows = zip(schedule.flat * millimetres, count(1), schedule.panels["family"], labels, strict=False)
    # an edge of a triangle has the number of the corner opposite
    return [FlatPanel(corners, k, f"F{family}", [c, a, b]) for corners, k, family, (a, b, c) in rows]


def polygons_at_true_size(net: PanelNet, millimetres: float) -> list[FlatPanel]:
    """The panels of a net; below the number of one that is not planar, how far corners are from a plane."""
    flat, warp = laid_flat_polygons(net.points, net.start, net.corner)
    columns = ["node", "other", "beam", "panel", "neighbour"]
    beams = {(a, b): rest for a, b, *rest in net.beams[columns].to_numpy().tolist()}
    panels = []
    for k, (loop, corners) in enumerate(zip(net.polygons, flat, strict=True), start=1):
        labels = []
        for a, b in zip((loop + 1).tolist(), (np.roll(loop, -1) + 1).tolist(), strict=True):
            beam, one, other = beams[min(a, b), max(a, b)]
            labels.append(f"{one + other - k or 'rim'} / b{beam}")
        off = float(warp[k - 1]) * millimetres
        below = f"warp {off:.1f}" if off >= LEAST_WARP else ""
        panels.append(FlatPanel(corners * millimetres, k, below, labels))
    return panels


def _edges(corners: Floats) -> tuple[Floats, Floats]:
    """(k,2) from each corner to the next, and their lengths (k,)."""
    edges = np.roll(corners, -1, axis=0) - corners
    return edges, np.linalg.norm(edges, axis=1)


def _add_panel(sheet: Sheet, panel: FlatPanel) -> None:
    corners, (edges, lengths) = panel.corners, _edges(panel.corners)
    sheet.lines.append(SheetLine(corners, "PCMC-CUT", True))
    inward = np.stack([-edges[:, 1], edges[:, 0]], axis=1) / lengths[:, None]
    part = cross_2d(corners, corners + edges)
    middle = (part[:, None] * (2.0 * corners + edges)).sum(axis=0) / (3.0 * part.sum())
    radius = float(np.abs(np.einsum("ki,ki->k", middle - corners, inward)).min())
    number = str(panel.number)
    most = 1.2 * radius / (WIDTH * max(len(number), len(panel.below)))
    height = min(max(12.0, 0.15 * radius), 0.4 * radius, most)
    sheet.texts.append(Text(middle + np.array([0.0, 0.2 * height]), number, height, align="C"))
    if panel.below:
        sheet.texts.append(Text(middle - [0.0, 0.9 * height], panel.below, 0.6 * height, align="C"))
    for j, label in enumerate(panel.labels):
        small = min(4.0, 0.25 * radius, 0.7 * lengths[j] / (WIDTH * len(label)))
        at = corners[j] + 0.5 * edges[j] + small * inward[j]
        turn = float(np.degrees(np.arctan2(edges[j, 1], edges[j, 0])))
        turn += 180.0 if not -90.0 < turn <= 90.0 else 0.0
        sheet.texts.append(Text(at, label, float(small), "PCMC-LABEL", "C", turn))
