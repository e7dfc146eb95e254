"""Panels at true size, with their numbers, and along each edge the neighbour's number and the edge's."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator

import numpy as np

from ..base.arrays import Floats
from ..panels import Panels
from .sheet import WIDTH, Line, Sheet, Text, corner, room, table_sheets

SPACE = 6.0  # mm between panels
ROUNDING = 1e-9  # mm
TURNS = np.radians(np.arange(180.0))  # in which a panel is tried that does not fit as it lies


def panel_sheets(schedule: Panels, name: str, millimetres: float) -> list[Sheet]:
    """The panels in order of their numbers, row by row, on as many sheets as they need.

    Those that fit no sheet at true size are listed on sheets of their own; ``flat_panels`` has them.
    """
    labels = _labels(schedule)
    wide, high = room(name)
    turned = [_turned_to_fit(panel, name) for panel in schedule.flat * millimetres]
    fit = [k for k, panel in enumerate(turned) if panel is not None]
    pages: list[list[int]] = []
    sheets: list[Sheet] = []
    for k, (page, placed) in zip(fit, _packed([p for p in turned if p is not None], wide, high), strict=True):
        if page == len(sheets):
            sheets.append(Sheet("", name, "1:1"))
            pages.append([])
        pages[page].append(k + 1)
        _add_panel(sheets[page], placed + corner() + [0.0, high], k, schedule, labels[k])
    for sheet, numbers in zip(sheets, pages, strict=True):
        sheet.title = f"Panels {numbers[0]} to {numbers[-1]} at true size, outside up"
    sizes = schedule.panels[["a", "b", "c"]].to_numpy() * millimetres
    rows = [[str(k + 1), *(f"{x:.1f}" for x in sizes[k])] for k in range(len(turned)) if turned[k] is None]
    if rows:
        title = f"Panels larger than {name}: flat at true size in the model space of the .dxf"
        sheets += table_sheets(title, ["panel", "a, mm", "b, mm", "c, mm"], rows, name)
    return sheets


def flat_panels(schedule: Panels, millimetres: float) -> Sheet:
    """All panels side by side at true size, mm, on one sheet without an end: for the model space."""
    labels, sheet = _labels(schedule), Sheet("Panels", "A0", "1:1")
    panels = list(schedule.flat * millimetres)
    across = 1.5 * float(np.sqrt(sum(np.prod(np.ptp(panel, axis=0)) for panel in panels)))
    across = max(across, *(float(np.ptp(panel[:, 0])) for panel in panels))
    for k, (_, placed) in enumerate(_packed(panels, across, np.inf)):
        _add_panel(sheet, placed, k, schedule, labels[k])
    return sheet


def _packed(panels: Iterable[Floats], wide: float, high: float) -> Iterator[tuple[int, Floats]]:
    """The page of each panel, and the panel (3,2) placed on it: rows below one another, from y = 0 down."""
    page, y, depth = 0, 0.0, 0.0  # of the row that is filled: its top below the page's, and its height
    row: list[Floats] = []
    for panel in panels:
        size, placed = np.ptp(panel, axis=0), _beside(row, panel)
        if placed[:, 0].max() > wide + ROUNDING or y + size[1] > high + ROUNDING:
            y, depth, row = y + depth + SPACE, 0.0, []
            if y + size[1] > high + ROUNDING:
                page, y = page + 1, 0.0
            placed = _beside(row, panel)
        row.append(placed)
        depth = max(depth, float(size[1]))
        yield page, placed - [0.0, y]


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


def _turned_to_fit(corners: Floats, name: str) -> Floats | None:
    """A triangle (3,2) as it lies, or turned so that it is as low as possible; None if it fits in no way."""
    if (np.ptp(corners, axis=0) <= np.array(room(name)) + ROUNDING).all():
        return corners
    cosine, sine = np.cos(TURNS), np.sin(TURNS)
    turn = np.stack([np.stack([cosine, -sine], axis=-1), np.stack([sine, cosine], axis=-1)], axis=-2)
    ways = corners @ turn.transpose(0, 2, 1)
    sizes = np.ptp(ways, axis=1)
    fit = np.flatnonzero((sizes <= np.array(room(name)) + ROUNDING).all(axis=1))
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
    most = 1.2 * radius / (WIDTH * max(len(number), len(family)))
    height = min(max(12.0, 0.15 * radius), 0.4 * radius, most)
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
