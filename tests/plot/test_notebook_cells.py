"""What a notebook's cell shows of a surface and of a result."""

from __future__ import annotations

import subprocess
import sys

from tents import tent

import pcmc
from generators import spherical_cap, two_squares
from pcmc.base.errors import MissingExtra
from pcmc.base.units import Units
from pcmc.plan import Divider, Hole, Plan
from pcmc.plot import pictures
from pcmc.project import Outcome

CELL = """
from IPython.core.interactiveshell import InteractiveShell
shell = InteractiveShell.instance()
import pcmc
surface = pcmc.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [pcmc.Patch("a", 1.0)], fixed=[0])
corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.4]]
roof = pcmc.Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
                    [pcmc.Patch("roof", 1.0)], fixed=range(4))
design = pcmc.meet(roof, [pcmc.Target("apex", value=0.4)], ["roof"])
from pcmc.project import Outcome
for value in (surface, pcmc.solve(surface, iterations=1), design, Outcome(pcmc.solve(roof), ())):
    data, _ = shell.display_formatter.format(value)
    print(data["text/html"].count("data:image/png;base64"), "Surface of " in data["text/plain"])
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


def test_a_plan_is_a_few_lines():
    plan = Plan(
        [[0, 0], [12, 0], [12, 8], [0, 8]],
        [
            Divider([[6, 0], [6, 8]], wall=1.5),
            Divider([[9, 0], [9, 8]], wall=False, cable=3.0),
            [[3, 0], [3, 8]],
        ],
        [Hole({"circle": {"centre": [1.5, 4], "radius": 0.5}}, name="eye")],
        {name: {"tension": 5.0} for name in "abc"} | {"d": {"tension": 4.0, "volume": 9.0}},
        edge_length=0.8,
        supports=[[4.5, 4.0]],
    )
    assert repr(plan).splitlines() == [
        "Plan of 12 × 8, edge length 0.8",
        "  outline: fixed; 1 points and 0 curves are held",
        "  patches: a (tension 5, pressure 1), b (tension 5, pressure 1), c (tension 5, pressure 1),"
        " d (tension 4, volume 9)",
        "  dividers: wall 1 (wall 1.5), divider 2 (cable 3), wall 3 (wall balanced)",
        "  holes: 'eye' (fixed)",
        "  rooms: d (volume 9)",
    ]
    masts = Plan(
        [[0, 0], [4, 0], [4, 3]], edge="cable", cable=9.0, tension=2.0, pressure=0.0, points={"top": [3, 1]}
    )
    assert repr(masts).splitlines()[1:] == [
        "  outline: cable of tension 9",
        "  patches: all (tension 2)",
        "  points: top",
    ]


def test_a_design_is_a_few_lines():
    design = pcmc.meet(spherical_cap(0.5), [pcmc.Target("apex", value=0.5)], ["cap"])
    lines = repr(design).splitlines()
    assert lines[:2] == ["met: every target is reached", "  targets: apex 0.5"]
    assert lines[2].startswith("  parameters: tension of cap 0.6")
    assert lines[3] == f"  {design.solves} solves"
    assert "\n".join(lines[4:]) == repr(design.surface)


def test_a_mesh_check_and_an_accurate_result_are_their_texts():
    cap = spherical_cap(0.5)
    check = pcmc.check_mesh(pcmc.solve(cap), 2)
    assert repr(check) == str(check)
    accurate = pcmc.solve_to_accuracy(cap, "height=1")
    assert repr(accurate) == f"{accurate.message}\n{accurate.surface!r}"


def test_many_patches_are_counted():
    surface = tent()
    patches = [pcmc.Patch(f"p{k}", 1.0) for k in range(8)]
    several = pcmc.Surface(
        surface.vertices, surface.faces, [k % 8 for k in range(12)], patches, surface.fixed
    )
    assert "p5 (tension 1, pressure 1), and 2 more" in repr(several)


def test_cells_of_ipython_show_pictures():
    done = subprocess.run([sys.executable, "-c", CELL], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n") == ["1 True"] * 4 + [""]


def test_without_the_plot_extra_cells_show_text(monkeypatch):
    def missing(surface, **options):
        raise MissingExtra("pyvista", "plot")

    monkeypatch.setattr("pcmc.plot.pictures.draw", missing)
    assert pictures.cell_html(tent()).startswith("<pre>Surface of 12 triangles")


def test_a_result_has_its_verdict_once_it_is_known():
    result = pcmc.solve(tent())
    verdict = result.certify().verdict.value
    assert verdict not in repr(result)
    assert result.certificate.verdict.value == verdict
    assert repr(result).splitlines()[1] == verdict


def test_an_outcome_is_its_verdict_and_advice_above_the_surface():
    result = pcmc.solve(tent())
    outcome = Outcome(result, (), advice=("type in roof.toml:", "[plan] tension = 3"), units=Units("m", "kN"))
    assert repr(outcome).splitlines() == [
        result.certificate.verdict.value,
        result.certificate.detail,
        "type in roof.toml:",
        "  [plan] tension = 3",
        Units("m", "kN").sentence,
        *repr(result.surface).splitlines(),
    ]
