"""Roofs held at single points, and roofs with free edges: the cause is named, and what is typed works."""

from __future__ import annotations

import re
from pathlib import Path

import drawn
import numpy as np
import pytest
import tomlkit
from drawn import drawing

from pcmc import cli, project, solve
from pcmc.advice.rises import mast_note, point_masts, with_rings
from pcmc.base.errors import FileWarning, OptionError, PlanWarning
from pcmc.plan import Plan
from pcmc.project import solving

SQUARE = "[plan]\nedge_length = 1.2\noutline = [[0, 0], [20, 0], [20, 12], [0, 12]]\n"
TENT = (
    f'{SQUARE}edge = "cable"\ncable = 20.0\ntension = 1.0\npressure = 0.0\n'
    "supports = [[0, 0, 0], [20, 0, 4], [20, 12, 0], [0, 12, 4], [10, 6, 6]]\n"
)
FREE = f'{SQUARE}edge = "free"\nsupports = [[0, 0], [20, 0, 2], [20, 12], [0, 12, 2]]\nrise = 3.0\n'


def advised(path, text):
    """The advice for a project, its heading first."""
    path.write_text(text)
    return project.run_project(project.load(path), use_cache=False).advice


def typed(text, lines):
    """A project with advised lines of [plan] and tables of [[plan.holes]] typed into it."""
    removed = [line.removeprefix("[plan] supports: remove ") for line in lines if "supports" in line]
    keys = [line.removeprefix("[plan] ") for line in lines if line.startswith("[plan] ") and " = " in line]
    plan = [line for line in text.splitlines() if not line.startswith(("edge =", "rise", "pressure"))]
    for point in removed:
        plan = [line.replace(f", {point}", "") for line in plan]
    tables = [line for line in lines if not line.startswith("[plan]")]
    kept = [line for line in text.splitlines() if line.startswith("edge =")] if not keys else []
    values = [re.sub(r"  \(.*\)$", "", key) for key in keys] or ["pressure = 0.0"]
    return "\n".join([*plan, *kept, *values, *tables, ""])


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.FileWarning")
def test_a_point_mast_is_the_cause_and_the_ring_that_is_printed_works(tmp_path):
    path = tmp_path / "tent.toml"
    heading, *lines = advised(path, TENT)
    assert heading == (
        "the cause is a roof held at a single point; type in tent.toml, which was tried and comes to rest,"
        " on finer meshes, too:"
    )
    with pytest.warns(FileWarning, match=re.escape(lines[2])):  # the note before has the same ring
        project.load(path)
    assert lines[-1] == "[plan] supports: remove [10, 6, 6]"
    mended = typed(TENT, lines)
    assert tomlkit.parse(mended)["plan"]["holes"][0]["name"] == "mast 1"
    path.write_text(f"{mended}[solve]\nmesh_check = true\n")
    assert project.run(path).mesh_check.persists


def test_a_point_mast_is_noted_before_the_solve(tmp_path):
    path = tmp_path / "tent.toml"
    path.write_text(TENT)
    with pytest.warns(FileWarning, match=r"a single point inside, \[10, 6, 6\].*on some meshes and not on"):
        project.load(path)
    path.write_text(TENT.replace(", [10, 6, 6]", ""))
    project.load(path)  # a warning would be an error


def test_a_lower_ring_is_rounded_over_the_roof_not_over_0():
    """At 523.4 m, two digits of the height were 530: above the point."""
    square = [[0, 0, 523.4], [10, 0, 523.4], [10, 10, 523.4], [0, 10, 523.4]]
    plan = Plan(square, supports=[[5, 5, 535.4]], tension=1.0, pressure=0.0, edge_length=1)
    assert [mast.top.tolist() for mast in point_masts(plan)] == [[5.0, 5.0, 526.7]]


def test_a_support_outside_the_plan_is_no_mast():
    square = [[0, 0], [8, 0], [8, 8], [0, 8]]
    assert not point_masts(Plan(square, supports=[[12, 4, 2]], tension=2.0, edge_length=1))


def test_supports_on_lines_are_no_point_masts():
    square = [[0, 0], [8, 0], [8, 8], [0, 8]]
    plan = Plan(
        square,
        dividers=[[[4, 0], [4, 8]]],
        holes=[[[5, 5], [6, 5], [6, 6]]],
        supports=[[0, 0], [4, 4], [5, 5], [2, 3, 1], [[6, 1], [7, 2]]],
        tension=2.0,
        edge_length=1,
    )
    (mast,) = point_masts(plan)
    assert (mast.number, mast.clearance) == (3, 2.0)
    ringed = with_rings(plan, [mast], 0.25)
    assert len(ringed.supports) == 4
    assert ringed.holes[-1].curve.length == pytest.approx(3.14159, rel=1e-3)


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.FileWarning")
def test_a_point_that_is_too_high_for_any_ring_gets_a_lower_one(tmp_path):
    """The point that names its patch is inside the ring, and moves out of it."""
    plan = "[plan]\noutline = [[0, 0], [10, 0], [10, 8], [0, 8]]\nedge_length = 0.7\nsupports = [[5, 4, 6]]\n"
    file = tmp_path / "tent.toml"
    file.write_text(f"{plan}patches = {{roof = {{tension = 3.8, at = [5, 4.5]}}}}\n")
    outcome = project.run(file)
    assert outcome.advice[1:] == [
        "[[plan.holes]]",
        'name = "mast 1"',
        "curve = {circle = {centre = [5, 4, 4.3], radius = 2.2}}",
        "[plan] supports: remove [5, 4, 6]",
        "[plan.patches] roof: at = [[5.0, 6.64]]  (now [5, 4.5])",
    ]
    with pytest.warns(FileWarning, match=r"4\.3\], radius = 2\.2\}\}; no ring can be as high as the point"):
        project.load(file)
    ring = "holes = [{curve = {circle = {centre = [5, 4, 4.3], radius = 2.2}}}]\n"
    plan = plan.replace("supports = [[5, 4, 6]]\n", ring)
    file.write_text(f"{plan}patches = {{roof = {{tension = 3.8, at = [[5.0, 6.64]]}}}}\n")
    assert project.run(file).good


@pytest.mark.parametrize(("x", "says"), [(1.2, "radius = 0.5"), (0.9, "too near to what is held beside it")])
def test_a_ring_is_as_large_as_triangles_can_follow(tmp_path, x, says):
    path = tmp_path / "tent.toml"
    path.write_text(
        TENT.replace("[10, 6, 6]", f"[{x}, 6, 0.3]").replace("edge_length = ", "edge_length = 2 # ")
    )
    with pytest.warns(FileWarning, match=says):
        project.load(path)


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.FileWarning")
def test_for_a_drawing_the_ring_is_drawn(tmp_path, monkeypatch):
    file = drawing(tmp_path, ("line", "mast", (4, 3, 0), (4, 3, 2.5)))
    loaded = project.load(file)
    solves = iter([stalled])
    monkeypatch.setattr(solving, "solve", lambda *given, **options: next(solves, solve)(*given, **options))
    heading, *lines = project.run_project(loaded, use_cache=False).advice
    assert heading.endswith("draw in hall.dxf, which was tried and comes to rest, on finer meshes, too:")
    radius, x, y, z = map(
        float, re.search(r"radius (\S+) around \((\S+), (\S+)\) at height (\S+)", lines[0]).groups()
    )
    assert (x, y, z) == (4.0, 3.0, 2.5)
    monkeypatch.undo()
    drawn.drawing(tmp_path, ("circle", "mast", (x, y, z), radius))
    assert project.run(file).good


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.BalanceWarning")
def test_for_a_drawing_without_a_project_the_advice_says_how_to_write_one(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("pcmc.plan.proposal.TRIANGLES", 120)
    document, space = drawn.new()
    space.add_lwpolyline(drawn.BOX, close=True, dxfattribs=drawn.on("outline"))
    space.add_line((6, 0), (6, 6), dxfattribs=drawn.on("divider chancel"))
    for name, x in (("west = 1", 3), ("east = 9", 8)):
        space.add_text(name, dxfattribs=drawn.on("patch")).set_placement((x, 3))
    file = Path("plans", "hall.toml")
    file.parent.mkdir()
    document.saveas("plans/hall.dxf")
    assert cli.main(["solve", "plans/hall.dxf", "--no-cache"]) == cli.NOT_CERTIFIED
    _, _, advised = capsys.readouterr().out.partition("write a project ")
    heading, line = advised.splitlines()
    command = heading[1 : heading.index(")")]
    assert heading == f"({command}) and type in hall.toml, which was tried and comes to rest:"
    assert cli.main(command.split()[1:]) == cli.OK
    assert line == "  [plan.patches] west: tension = 3.2  (now 1)"
    text = file.read_text(encoding="utf-8").replace("west = {tension = 1.0", "west = {tension = 3.2")
    file.write_text(text, encoding="utf-8")
    assert cli.main(["solve", str(file), "--no-cache", "--no-mesh-check"]) == cli.OK


def test_a_ring_that_a_cable_alone_holds_is_advised_to_be_fixed(tmp_path):
    """It is at rest at the radius cable / tension alone, and there a saddle: "remesh" does not help."""
    file = tmp_path / "roof.toml"
    hole = "[[plan.holes]]\ncurve = {circle = {centre = [5, 4], radius = 1.5}}\n"
    plan = "[plan]\nedge_length = 0.7\noutline = [[0, 0], [10, 0], [10, 8], [0, 8]]\n"
    plan += "tension = 4.0\npressure = 0.0\n" + hole
    file.write_text(f"{plan}edge = 'cable'\ncable = 8.0\n")
    outcome = project.run(file)
    assert not outcome.good
    assert outcome.advice[1:] == [
        '[[plan.holes]] number 1: edge = "fixed"  (now "cable")',
        "[[plan.holes]] number 1: remove cable  (now 8)",
    ]
    file.write_text(f"{plan}edge = 'fixed'\n")
    assert project.run(file).good
    masts = "edge = 'cable'\ncable = 60.0\nsupports = [[0, 0], [10, 0], [10, 8], [0, 8]]\n"
    file.write_text(f"{plan.replace(hole, masts + hole)}edge = 'cable'\ncable = 8.0\n")
    assert project.run(file).advice == outcome.advice


def stalled(surface, *_, **__):
    """A solve that is stopped after a step, as on a mesh with too sharp a peak."""
    from pcmc.solvers import solve_once

    return solve_once(surface, iterations=1)


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.PlanWarning")
def test_all_that_a_free_edge_needs_is_printed_at_once(tmp_path, capsys):
    path = tmp_path / "sail.toml"
    heading, *lines = advised(path, FREE)
    assert heading == (
        "the cause is edges that nothing holds; type in sail.toml, which was tried and comes to rest:"
    )
    assert [line.split(" = ")[0] for line in lines] == [
        f"[plan] {key}" for key in ("edge", "cable", "tension", "pressure")
    ]
    path.write_text(typed(FREE, lines))
    assert project.run(path).good
    assert cli.main(["certify", str(path)]) == 0
    capsys.readouterr()


def test_the_note_on_a_free_edge_has_all_keys():
    square = [[0, 0], [8, 0], [8, 8], [0, 8]]
    with pytest.warns(PlanWarning, match="nothing holds the outline") as caught:
        Plan(square, edge="free", supports=square[:3], tension=2.0, edge_length=1).surface()
    keys = re.search(r'edge = "cable", cable = (\S+), tension = 1.0, pressure = 0.0', str(caught[0].message))
    cable = float(keys[1])
    sail = Plan(
        square, edge="cable", cable=cable, supports=square[:3], tension=1.0, pressure=0.0, edge_length=1
    )
    assert sail.surface().cables


def test_an_apex_below_a_raised_ring_is_refused(tmp_path):
    path = tmp_path / "dome.toml"
    path.write_text(
        f'units = "m"\n{SQUARE}tension = 6.0\n'
        '[[plan.holes]]\nname = "lantern"\ncurve = {circle = {centre = [10, 6, 3], radius = 1.5}}\n'
        "[targets]\nmeet = [{quantity = 'apex', value = 2.0}]\nvary = ['patch 1']\n"
    )
    with pytest.raises(OptionError, match="hole 'lantern' is held at 3 m, so the apex cannot be 2 m"):
        project.run(path)


def test_a_point_in_a_mirror_is_inside_the_whole_roof():
    whole = Plan(
        [[0, 0], [12, 0], [12, 8], [0, 8]], supports=[[6, 4, 4], [6, 0]], tension=1.0, edge_length=1.0
    )
    half = Plan(
        [[0, 0], [6, 0], [6, 8], [0, 8]],
        supports=[[6, 4, 4], [6, 0]],
        mirrors=[[[6, 0], [6, 8]]],
        tension=1.0,
    )
    found = [[(m.text, m.clearance, m.in_mirror) for m in point_masts(plan)] for plan in (whole, half)]
    assert found == [[("[6, 4, 4]", 4.0, False)], [("[6, 4, 4]", pytest.approx(4.0), True)]]
    assert "lead the outline around it on an arc of radius 0.48 around [6, 4, 4]" in mast_note(half)


@pytest.mark.parametrize("unit", [0.3, 1.0, 7.0, 1000.0])
def test_the_end_of_a_mirror_is_a_point_of_the_rim(unit):
    """In m a sail on such points got the note of a mast inside, in mm it did not."""
    outline = unit * np.array([[0, 0], [5, 0], [5, 8], [0, 8]])
    sail = {"edge": "cable", "cable": 9.0, "tension": 1.0, "pressure": 0.0, "edge_length": 0.6 * unit}
    assert not point_masts(Plan(outline, supports=outline, mirrors=[outline[1:3]], **sail))
