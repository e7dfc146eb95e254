"""Panels at true size, with their numbers, and along each edge the neighbour's number and the edge's."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from ..base.arrays import Floats
from ..panelling import Panels
from ..panelling.flat import packed, turned_to_fit
from .sheet import WIDTH, Sheet, SheetLine, Text, corner, drawing_area, table_sheets


def panel_sheets(schedule: Panels, name: str, millimetres: float) -> list[Sheet]:
    """The panels in order of their numbers, row by row, on as many sheets as they need.

    Those that fit no sheet at true size are listed on sheets of their own; ``flat_panels`` has them.
    """
    labels, (wide, high) = _labels(schedule), drawing_area(name)
    turned = {k: turned_to_fit(panel, wide, high) for k, panel in enumerate(schedule.flat * millimetres)}
    fit = {k: panel for k, panel in turned.items() if panel is not None}
    sheets: list[Sheet] = []
    for k, (page, placed) in zip(fit, packed(fit.values(), wide, high), strict=True):
        if page == len(sheets):
            first = k + 1
            sheets.append(Sheet("", name, "1:1"))
        sheets[page].title = f"Panels {first} to {k + 1} at true size, outside up"
        _add_panel(sheets[page], placed + corner() + [0.0, high], k, schedule, labels[k])
    large = (schedule.panels[["a", "b", "c"]] * millimetres).iloc[[k for k in turned if k not in fit]]
    if len(large):
        large.insert(0, "panel", large.index + 1)
        title = f"Panels larger than {name}: flat at true size in the model space of the .dxf"
        sheets += table_sheets(title, large, name, 1, dict.fromkeys("abc", "mm"))
    return sheets


def flat_panels(schedule: Panels, millimetres: float) -> Sheet:
    """All panels side by side at true size, mm, on one sheet without an end: for the model space."""
    labels, sheet = _labels(schedule), Sheet("Panels", "A0", "1:1")
    panels = list(schedule.flat * millimetres)
    across = 1.5 * float(np.sqrt(sum(np.prod(np.ptp(panel, axis=0)) for panel in panels)))
    across = max(across, *(float(np.ptp(panel[:, 0])) for panel in panels))
    for k, (_, placed) in enumerate(packed(panels, across, np.inf)):
        _add_panel(sheet, placed, k, schedule, labels[k])
    return sheet


def _labels(schedule: Panels) -> list[list[str]]:
    """For each panel the labels of its edges 0, 1, 2: the neighbours' numbers and the edge's."""
    sides = schedule.surface.topology.edge_of_face[schedule.panels["face"].to_numpy()].tolist()
    at_edge: dict[int, list[int]] = defaultdict(list)
    for number, edges in enumerate(sides, start=1):
        for edge in edges:
            at_edge[edge].append(number)

    return [
        [f"{'+'.join(str(k) for k in at_edge[e] if k != number) or 'rim'} / e{e}" for e in edges]
        for number, edges in enumerate(sides, start=1)
    ]


def _add_panel(sheet: Sheet, corners: Floats, k: int, schedule: Panels, labels: list[str]) -> None:
    sheet.lines.append(SheetLine(corners, "PCMC-CUT", True))
    edges = np.roll(corners, 1, axis=0) - np.roll(corners, -1, axis=0)  # edge j is opposite corner j
    lengths = np.linalg.norm(edges, axis=1)
    middle = (lengths[:, None] * corners).sum(axis=0) / lengths.sum()  # of the inscribed circle
    first, second = corners[1] - corners[0], corners[2] - corners[0]
    radius = abs(first[0] * second[1] - first[1] * second[0]) / lengths.sum()
    number = str(k + 1)
    family = f"F{schedule.panels['family'].iloc[k]}"
    most = 1.2 * radius / (WIDTH * max(len(number), len(family)))
    height = min(max(12.0, 0.15 * radius), 0.4 * radius, most)
    sheet.texts.append(Text(middle + np.array([0.0, 0.2 * height]), number, height, align="C"))
    sheet.texts.append(Text(middle - np.array([0.0, 0.9 * height]), family, 0.6 * height, align="C"))
    for j in range(3):
        small = min(4.0, 0.25 * radius, 0.7 * lengths[j] / (WIDTH * len(labels[j])))
        along = edges[j] / lengths[j]
        inward = np.array([-along[1], along[0]])
        at = 0.5 * (corners[j - 1] + corners[j - 2]) + small * inward
        turn = float(np.degrees(np.arctan2(along[1], along[0])))
        turn += 180.0 if not -90.0 < turn <= 90.0 else 0.0
        sheet.texts.append(Text(at, labels[j], float(small), "PCMC-LABEL", "C", turn))
