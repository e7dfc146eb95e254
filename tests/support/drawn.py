"""Roofs drawn in a CAD's terms: DXF files written with ezdxf."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

ezdxf = pytest.importorskip("ezdxf")
units = pytest.importorskip("ezdxf.units")
pytest.importorskip("tomlkit")  # it writes the projects of drawings

BOX = [(0, 0), (10, 0), (10, 6), (0, 6)]


def new(unit: int = units.M):
    """An empty drawing."""
    document = ezdxf.new("R2018", setup=True)
    document.header["$INSUNITS"] = unit
    return document, document.modelspace()


def on(layer: str) -> dict[str, str]:
    return {"layer": layer}


def drawing(folder: Path, *calls: Any, outline: bool = True, unit: int = units.M) -> Path:
    """A drawing with a box as outline, and calls of the modelspace: name, layer, arguments."""
    document, space = new(unit)
    if outline:
        space.add_lwpolyline(BOX, close=True, dxfattribs=on("outline"))
    for name, layer, *arguments in calls:
        entity = getattr(space, f"add_{name}")(*arguments, dxfattribs=on(layer))
        if name == "text":
            entity.set_placement((5, 3))
    file = folder / "hall.dxf"
    document.saveas(file)
    return file


def nave(path: Path, scale: float = 1.0, unit: int = units.M, gap: float = 0.0) -> Path:
    """A nave, 8 by 18, whose apse is a half circle; a divider between them, and two across the nave."""
    document, space = new(unit)
    corners = [(8.0 - gap, 0.0), (0, 0), (0, 18), (8, 18)]
    lines = [(scale * x, scale * y) for x, y in corners]
    space.add_lwpolyline(lines[:3], dxfattribs=on("OUTLINE"))
    space.add_line(lines[3], (scale * 8, 0), dxfattribs=on("OUTLINE"))
    space.add_arc((scale * 4, scale * 18), scale * 4, 0, 180, dxfattribs=on("OUTLINE"))
    space.add_line(lines[2], lines[3], dxfattribs=on("DIVIDER chancel"))
    space.add_line((0, scale * 9), (scale * 8, scale * 9), dxfattribs=on("DIVIDER middle"))
    for name, y in (("west", 4), ("east", 13), ("apse", 19.5)):
        space.add_text(name, height=scale * 0.5, dxfattribs=on("PATCH")).set_placement((scale * 4, scale * y))
    space.add_text("Section A-A", height=scale, dxfattribs=on("annotation")).set_placement((0, -scale))
    document.saveas(path)
    return path


def pavilion(path: Path) -> Path:
    """Four splines around a square of 16, and an oculus raised by 3."""
    document, space = new()
    corner = [(-8, -8), (8, -8), (8, 8), (-8, 8)]
    for k in range(4):
        (ax, ay), (bx, by) = corner[k], corner[(k + 1) % 4]
        inwards = [(0.75 * x, 0.75 * y) for x, y in ((ax * 2 / 3 + bx / 3, ay * 2 / 3 + by / 3),)]
        (cx, cy) = inwards[0]
        (dx, dy) = (0.75 * (ax / 3 + bx * 2 / 3), 0.75 * (ay / 3 + by * 2 / 3))
        spline = space.add_spline(dxfattribs=on("outline"))
        spline.set_open_uniform([(ax, ay, 0), (cx, cy, 0), (dx, dy, 0), (bx, by, 0)], degree=3)
    space.add_circle((0, 0, 3.0), 1.5, dxfattribs=on("hole oculus"))
    document.saveas(path)
    return path


def flower(path: Path) -> Path:
    """Five domes: arcs around a pentagon, dividers from its middle to the corners."""
    document, space = new()
    corners = [(7 * math.cos(a), 7 * math.sin(a)) for a in (math.tau * (k / 5 + 0.05) for k in range(5))]
    for k, (x, y) in enumerate(corners):
        u, v = corners[(k + 1) % 5]
        middle, half = ((x + u) / 2, (y + v) / 2), math.hypot(u - x, v - y) / 2
        start = math.degrees(math.atan2(y - middle[1], x - middle[0]))
        space.add_arc(middle, half, start, start + 180, dxfattribs=on("outline"))
        space.add_line((0, 0), (x, y), dxfattribs=on("divider"))
    document.saveas(path)
    return path


def corner(path: Path) -> Path:
    """An L with a courtyard, and three dividers that meet at 120 degrees."""
    document, space = new()
    outline = [(0, 0), (24, 0), (24, 10), (10, 10), (10, 24), (0, 24)]
    space.add_lwpolyline(outline, close=True, dxfattribs=on("outline"))
    space.add_circle((17, 5), 2, dxfattribs=on("hole courtyard"))
    for end in ((10, 10), (0, 9.5096189432), (9.5096189432, 0)):
        space.add_line((7.5, 7.5), end, dxfattribs=on("divider"))
    document.saveas(path)
    return path
