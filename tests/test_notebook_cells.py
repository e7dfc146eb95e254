"""What a notebook's cell shows of a surface and of a result."""

from __future__ import annotations

import subprocess
import sys

from tents import tent

import pcmc
from generators import two_squares
from pcmc.base.errors import MissingExtra
from pcmc.plot import notebook

CELL = """
from IPython.core.interactiveshell import InteractiveShell
shell = InteractiveShell.instance()
import pcmc
surface = pcmc.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [pcmc.Patch("a", 1.0)], fixed=[0])
for value in (surface, pcmc.solve(surface, iterations=1)):
    data, _ = shell.display_formatter.format(value)
    print(data["text/html"].count("data:image/png;base64"), "Surface of 1 triangles" in data["text/plain"])
"""


def test_a_surface_is_five_lines():
    lines = repr(two_squares(4, alpha_aux=1.0)).splitlines()
    assert lines == [
        "Surface of 70 triangles and 48 vertices, 9 across",
        "  patches: left (tension 2, pressure 1), right (tension 2, pressure 1)",
        "  walls: wall (tension 1, pressure 0)",
        "  supports: 24 vertices fixed, 3 sliding",
        "  heights over the plane: 0 to 1",
    ]


def test_many_patches_are_counted():
    surface = tent()
    patches = [pcmc.Patch(f"p{k}", 1.0) for k in range(8)]
    several = pcmc.Surface(
        surface.vertices, surface.faces, [k % 8 for k in range(12)], patches, surface.fixed
    )
    assert "p5 (tension 1, pressure 1), and 2 more" in repr(several)


def test_cells_of_ipython_show_pictures():
    done = subprocess.run([sys.executable, "-c", CELL], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n") == ["1 True", "1 True", ""]


def test_without_the_plot_extra_cells_show_text(monkeypatch):
    def missing(surface, **options):
        raise MissingExtra("pyvista", "plot")

    monkeypatch.setattr("pcmc.plot.pictures.draw", missing)
    assert notebook.cell_html(tent()).startswith("<pre>Surface of 12 triangles")
