"""Projects of every kind, in several units, with the files that they read."""

from __future__ import annotations

from pathlib import Path

import numpy as np

METRES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "ft": 0.3048, "in": 0.0254}  # the world's, not pcmc's own table


KILONEWTONS = {"": 1.0, "N": 1e-3, "kN": 1.0, "lbf": 4.4482216152605e-3, "kip": 4.4482216152605}


HEAD = 'units = "{u}"\nforce = "{f}"\n[plan]\nedge_length = {e}\n'


HALL = "outline = [[0, 0], [{a}, 0], [{a}, {b}], [0, {b}]]\n"


WALL = 'dividers = [{{curve = [[{h}, 0], [{h}, {b}]], name = "wall", wall = {w}{more}}}]\n'


PATCHES = "patches = {{west = {{tension = {t}}}, east = {{tension = {t}}}}}\n"


def hall(unit="m", force="kN", wall="", extra="", patches=PATCHES) -> str:
    """A hall of 8 m by 5 m and two patches with a wall, in any units."""
    length, strength = 1.0 / METRES[unit], 1.0 / KILONEWTONS[force]
    values = {
        "a": 8 * length,
        "b": 5 * length,
        "h": 4 * length,
        "w": strength / length,
        "t": 4 * strength / length,
    }
    values |= {"u": unit, "f": force, "e": length, "p": strength / length**2, "more": wall}
    pressure = "" if unit == "m" else "pressure = {p!r}\n"
    return (HEAD + HALL + WALL + pressure + (patches if unit == "m" else ONE) + extra).format(**values)


WEIGHTS = "patches = {{west = {{tension = {t}, weight = 0.1}}, east = {{tension = {t}, weight = 0.2}}}}\n"


ONE = "tension = {t!r}\n"


SAIL = """
units = "m"
force = "kN"
[plan]
edge_length = 1.0
outline = [[0, 0], [6, 0], [6, 6], [0, 6]]
edge = "cable"
cable = 9.0
supports = [[0, 0, 2], [6, 0, 0], [6, 6, 2], [0, 6, 0]]
tension = 1.0
pressure = 0.0
weight = 0.01
"""


HALF = """
units = "m"
force = "kN"
[plan]
edge_length = 0.9
outline = [[0, 0], [4, 0], [4, 5], [0, 5]]
mirrors = [[[0, 0], [0, 5]]]
patches = {roof = {tension = 3.0}}
[output]
whole = true
"""


PROJECTS = {
    "metres": hall(),
    "millimetres": hall("mm", "N"),
    "feet": hall("ft", "lbf"),
    "snow": hall(extra="snow = 0.25\n"),
    "weight": hall(patches=WEIGHTS),
    "snow on one patch": hall(
        patches="patches = {{west = {{tension = {t}, snow = 0.3}}, east = {{tension = {t}}}}}\n"
    ),
    "cables": SAIL,
    "half": HALF,
    "upright": hall(wall=", upright = true"),
    "rise": hall(patches="rise = 1.1\n"),
    "targets": hall(
        extra='[targets]\nmeet = [{{quantity = "apex", of = "west", value = 0.6}}]\nvary = ["west"]\n'
    ),
    "remesh": hall(extra="[remesh]\nedge_length = 0.8\n"),
    "drawing": 'force = "kN"\n[plan]\ndrawing = "plan.dxf"\nedge_length = 1000\n'
    "patches = {west = {tension = 4e-3, pressure = 1e-6}, east = {tension = 4e-3, pressure = 1e-6}}\n",
    "mesh": 'units = "m"\nforce = "kN"\n[mesh]\nfile = "bare.obj"\nsupports = "boundary"\n'
    "patches = {roof = {tension = 3.0, snow = 0.2}}\n",
}


def draw_plan(path: Path) -> None:
    """The hall as a drawing in millimetres."""
    import ezdxf

    drawing = ezdxf.new(units=4)
    space = drawing.modelspace()
    corners = [(0, 0), (8000, 0), (8000, 5000), (0, 5000)]
    space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "outline"})
    space.add_line((4000, 0), (4000, 5000), dxfattribs={"layer": "divider wall"})
    space.add_text("west", dxfattribs={"layer": "patch", "insert": (2000, 2500)})
    space.add_text("east", dxfattribs={"layer": "patch", "insert": (6000, 2500)})
    drawing.saveas(path)


def write_bare_mesh(path: Path) -> None:
    """A flat plate of 5 m by 4 m as an .obj that says nothing but triangles."""
    x, y = np.meshgrid(np.linspace(0.0, 5.0, 7), np.linspace(0.0, 4.0, 6))
    number = np.arange(x.size).reshape(x.shape) + 1
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    lines = [f"v {p} {q} 0" for p, q in zip(x.ravel(), y.ravel(), strict=True)]
    path.write_text("\n".join([*lines, "g roof", *(f"f {i} {j} {k}" for i, j, k in faces)]), encoding="utf-8")
