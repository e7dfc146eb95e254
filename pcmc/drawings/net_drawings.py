"""Drawings and tables of a net of panels: nodes and panels in plan, panels at true size."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..base import validate
from ..base.units import Units, as_units, expect_length, length_factor
from ..panelling import PanelNet
from .drawing_set import CSV, DrawingSet, document_files
from .drawing_set import SUFFIXES as DRAWINGS
from .panel_sheets import flat_panels, panel_sheets, polygons_at_true_size
from .sheet import FORMATS, SheetLine, add_frames, length_decimals, table_sheets
from .views import DrawnView, placed

OBJ = ".obj"
SUFFIXES = (*DRAWINGS, CSV, OBJ)
TABLES = ("", "nodes", "beams")  # of panels, nodes and beams


def net_drawings(
    net: PanelNet, units: str | Units, *, sheet: str = "A1", name: str = "", mark: str = ""
) -> DrawingSet:
    """The plan of a net, tables of its nodes and panels, and each panel at true size, for .dxf, .pdf, .svg.

    Parameters
    ----------
    units : of the lengths: "m", "cm", "mm", "ft" or "in".
    sheet : format of the sheets, "A4" to "A0".
    name, mark : of the roof, in the title strips and on every sheet.

    >>> from generators import delaunay
    >>> from pcmc import panel_net
    >>> drawings = net_drawings(panel_net(delaunay(exact=True), 0.9, anyway=True), "m", sheet="A0")
    >>> [page.title for page in drawings.sheets[:3]], drawings.sheets[3].title[7:]
    (['Panels and nodes in plan', 'Nodes', 'Panels'], ' at true size, outside up')
    """
    validate.choice("sheet", sheet, tuple(FORMATS))
    length = expect_length(as_units(units).length, "drawings of panels")
    millimetres, decimals = length_factor(length, "mm"), length_decimals(length, net.mesh.size)
    curves = [
        SheetLine(net.points[loop], "PCMC-PANEL", True, name=f"panel {k}")
        for k, loop in enumerate(net.polygons, start=1)
    ]
    lines = [line._replace(points=line.points[:, :2]) for line in curves]
    numbers = [(line.points.mean(axis=0), str(k), np.zeros(2)) for k, line in enumerate(lines, start=1)]
    ends = [np.array([column.min(), column.max()]) for column in net.points[:, :2].T]
    nodes = [(at, str(k), "PCMC-POINT") for k, at in enumerate(net.points[:, :2], start=1)]
    plan = DrawnView("", lines, numbers, nodes, stations=(ends[0], ends[1]))
    sheets = [placed([plan], "Panels and nodes in plan", sheet, millimetres, None, decimals)]
    tables = [
        ("Nodes", net.nodes[["node", *"xyz", "kind"]], dict.fromkeys("xyz", length)),
        ("Panels", net.panels[["panel", "patch", "kind", "corners", "area"]], {"area": f"{length}²"}),
    ]
    for title, table, head in tables:
        sheets += table_sheets(title, table, sheet, decimals, head)
    panels = polygons_at_true_size(net, millimetres)
    sheets += panel_sheets(panels, sheet)
    add_frames(sheets, name, length, net.certificate, mark)
    points = net.nodes[["node", *"xyz"]].rename(columns={"node": "point"}).astype({"point": str})
    points = points.assign(on="panel")
    about = net.mesh, length, net.certificate, curves
    return DrawingSet(*about, (), points, (), None, flat_panels(panels), sheets, mark=mark)


def net_files(
    net: PanelNet,
    paths: Iterable[str | os.PathLike[str]],
    units: str | Units,
    sheet: str = "A1",
    name: str = "",
    mark: str = "",
) -> list[tuple[Path, Callable[[Path], Any]]]:
    """Each file of a net with the function that writes it; FileError for an unknown suffix."""
    tables = dict(zip(TABLES, (net.panels, net.nodes, net.beams), strict=True))
    draw = partial(net_drawings, net, units, sheet=sheet, name=name, mark=mark)
    return document_files(paths, draw, tables, {OBJ: partial(net.write_obj, mark=mark)}, "a net of panels")
