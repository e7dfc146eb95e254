"""Sweeps over a project file, or a surface, with some of its numbers replaced."""

from __future__ import annotations

import pydoc
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from refusals import refused
from swept_roof import NUMBERS, TEXT

import pcmc
from generators import two_squares
from pcmc import cli
from pcmc.base.errors import FileError, OptionError, PcmcError
from pcmc.project import check_varied, designed, digest, run, varied
from pcmc.sweep.projects import column_labels, project_sweep, solve_varied


def test_numbers_of_the_file_and_of_patches_are_replaced(roof):
    plain, start = varied(roof, {})
    values = {
        "plan.edge_length": 2.0,
        "plan.outline.2.1": 7,
        "plan.holes.yard.curve.circle.radius": 0.5,
        "solve.tolerance": 1e-8,
        "west.tension": 4.0,
        "wall 1.tension": 0.1,
        "east.pressure": 1.25,
    }
    project, surface = varied(roof, values)
    assert (project.plan.edge_length, project.options) == (2.0, {"tolerance": 1e-8})
    assert surface.vertices[:, 0].max() == 7.0
    hole = np.linalg.norm(surface.vertices[:, :2] - [1.5, 2.0], axis=1).min()
    assert hole == pytest.approx(0.5)
    assert surface.m < start.m
    told = {p.name: (p.tension, p.pressure) for p in surface.patches}
    assert told == {"west": (4.0, 1.0), "east": (3.0, 1.25), "wall 1": (0.1, -0.25)}
    again, same_start = varied(roof, {})
    assert again.plan.edge_length == plain.plan.edge_length == 1.5
    assert pcmc.energy(same_start) == pcmc.energy(start)


DRAWN = """
[plan]
edge_length = 1.5
tension = 4.0
outline = [[0, 0], [9, 0], [9, 6], [0, 6]]
dividers = [[[3, -1], [3, 7]], {name = "eye", curve = {arc = [[6, -1], [7, 3], [6, 7]]}}]
holes = [{name = "eye", curve = {circle = {centre = [1.5, 3], radius = 0.5}}}]
supports = [[8, 3, 2]]
points = {crown = [4.5, 3]}
"""


def test_both_sheets_of_a_cushion_have_the_pressure_that_one_is_given(tmp_path):
    path = tmp_path / "cushion.toml"
    path.write_text(
        "[plan]\noutline = [[0, 0], [6, 0], [6, 4], [0, 4]]\nedge_length = 1.0\ncushion = 1.2\ntension = 4.0"
    )
    for name in "patch 1.pressure", "patch 1 below.pressure":
        assert varied(path, {name: 0.8})[1].pressures.tolist() == [0.8, 0.8]
    both = {"patch 1.pressure": 0.8, "patch 1 below.pressure": 0.7}
    assert varied(path, both)[1].pressures.tolist() == [0.8, 0.7]
    assert varied(path, {"patch 1.tension": 5.0})[1].tensions.tolist() == [5.0, 6.0]  # its factor stays
    assert varied(path, {"patch 1 below.tension": 5.0})[1].tensions.tolist() == [4.0, 5.0]


def test_lines_and_points_are_shifted_as_they_are(roof):
    roof.write_text(DRAWN, encoding="utf-8")
    aims = '[targets]\nmeet = [{quantity = "height", of = "crown", value = 1}]\nvary = ["patch 2"]\n'

    plain = varied(roof, {})[0].plan
    shifts = {
        "wall 1.x": 0.5,
        "divider eye.x": -0.25,
        "hole eye.y": 1.0,
        "hole eye.z": 0.75,
        "support 1.z": 1.0,
    }
    roof.write_text(DRAWN + aims, encoding="utf-8")
    project, surface = varied(roof, shifts | {"crown.x": 0.25, "crown.y": -1.0})
    moved = project.plan
    t = np.array([0.0, 0.5, 1.0])
    for before, after, by in (
        (plain.dividers[0].curve, moved.dividers[0].curve, [0.5, 0.0]),
        (plain.dividers[1].curve, moved.dividers[1].curve, [-0.25, 0.0]),
    ):
        np.testing.assert_array_equal(after.at(t), before.at(t) + by)
    assert moved.holes[0].curve.at(0.0).tolist() == [[2.0, 4.0, 0.75]]
    assert moved.supports[0].tolist() == [8.0, 3.0, 3.0]
    assert moved.points == {"crown": (4.75, 2.0)}
    assert project.targets[0].of == (4.75, 2.0)  # the target goes with its point
    assert surface.vertices[surface.fixed, 2].max() == 3.0
    same = varied(roof, dict.fromkeys(shifts, 0.0))[1]
    np.testing.assert_array_equal(same.vertices, varied(roof, {})[1].vertices)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("eye.x", "several lines; type divider eye.x or hole eye.x"),
        ("wal 1.x", "unknown number 'wal 1.x'; did you mean 'divider wall 1.x'"),
        ("wall 1.z", "only its place in plan counts"),
        ("crown.z", "only its place in plan counts"),
    ],
)
def test_a_shift_that_cannot_be_is_refused(roof, name, message):
    roof.write_text(DRAWN, encoding="utf-8")
    with pytest.raises(PcmcError, match=message) as caught:
        project_sweep(roof, {name: [0.0, 0.5]})
    assert str(caught.value).startswith(f"{roof}: ")


def test_the_file_is_read_once_and_meshed_for_names_alone(roof, monkeypatch):
    counts = {"read": 0, "meshed": 0}
    for place, name in (("tomllib.loads", "read"), ("pcmc.plan.Plan.surface", "meshed")):
        original = pydoc.locate(place)

        def counted(*given, original=original, name=name, **rest):
            counts[name] += 1
            return original(*given, **rest)

        monkeypatch.setattr(place, counted)
    check_varied(roof, {"plan.edge_length": [1.0, 2.0], "wall 1.x": [0.0, 0.1], "plan.snow": [0.0, 0.1]})
    assert counts == {"read": 1, "meshed": 0}
    check_varied(roof, {"west.tension": [1.0, 2.0, 3.0], "wall 1.tension": [0.5, 1.0]})
    assert counts == {"read": 2, "meshed": 1}
    varied(roof, {"west.tension": 3.0, "plan.edge_length": 1.2})
    assert counts == {"read": 3, "meshed": 2}


def test_numbers_that_the_file_leaves_out_vary_too(roof):
    values = {"plan.patches.east.weight": 0.1, "plan.patches.west.snow": 0.2, "plan.dividers.1.cable": 2.0}
    project = varied(roof, values | {"solve.iterations": 7})[0]
    plan = project.plan
    assert (plan.patches[1].weight, plan.patches[0].snow, plan.dividers[0].cable) == (0.1, 0.2, 2.0)
    assert project.options["iterations"] == 7
    with refused(FileError, what="plan.rise"):  # it was the height of the start shape, and changed no roof
        varied(roof, {"plan.rise": 0.7})


def test_a_case_is_what_the_project_with_these_numbers_gives(roof):
    case = solve_varied("roof.toml", digest(roof), **{"west.tension": 3.2, "wall 1.tension": 0.5})
    text = TEXT.replace("west = {tension = 3.0", "west = {tension = 3.2").replace("0.8", "0.5")
    roof.write_text(text, encoding="utf-8")
    alone = run(roof)
    assert case["verdict"] == "stable"
    assert case["energy"] == pytest.approx(pcmc.energy(alone.surface), rel=1e-12)
    assert case["west.tension_reached"] == 3.2


HALF = """
[plan]
edge_length = 1.5
tension = 4.0
outline = [[0, 0], [6, 0], [6, 4], [0, 4]]
mirrors = [[[6, 0], [6, 4]]]
"""


@pytest.mark.parametrize(
    ("output", "extent"), [("[output]\nwhole = true\n", "whole"), ("", "part between mirrors")]
)
def test_a_case_has_the_figures_of_the_roof_that_the_project_shows(roof, output, extent):
    roof.write_text(HALF + output, encoding="utf-8")
    case = solve_varied("roof.toml", digest(roof))
    outcome = designed(roof, use_cache=False)
    assert case["extent"] == extent
    for figure in outcome.figures:
        name = f"{figure.of}.{figure.quantity}" if figure.of else figure.quantity
        assert case[name] == pytest.approx(figure.value, rel=1e-9), name
    assert (case["area"] > 40.0) == bool(output)
    assert case["volume"] == pytest.approx(outcome.shown.certificate.volume, rel=1e-9)


def test_cells_are_empty_where_nothing_is_at_rest(roof, capsys):
    given = ["sweep", "roof.toml", "east.tension=0.2,3", "--csv", "t.csv", "--workers", "1"]
    assert cli.main([*given, "--all"]) == 1
    shown = capsys.readouterr().out.splitlines()
    assert "NaN" not in "".join(shown)
    table = pd.read_csv("t.csv", index_col="case")
    assert table["verdict"].eq("stable").tolist() == [False, True]
    numbers = table.select_dtypes("number")
    kept = {"triangles", "iterations_taken", "evaluations_made", "gradient_squared", "residual", "load_ratio"}
    assert set(numbers.columns[numbers.loc[0].notna()]) == kept | {"east.tension"}
    assert table.loc[1, NUMBERS].notna().all()


def test_any_quantity_is_shown_and_drawn(roof, capsys, monkeypatch):
    drawn = {}
    monkeypatch.setattr("pcmc.plot.lines", lambda curves, path, **rest: drawn.update(rest, curves=curves))
    roof.write_text(f'units = "m"\nforce = "kN"\n{TEXT}', encoding="utf-8")
    given = ["sweep", "roof.toml", "wall 1.x=0,0.5", "--workers", "1", "--csv", "t.csv", "--plot", "t.png"]
    assert cli.main([*given, "--show", "volume", "--show", "west.area", "--show", "sag"]) == 0
    shown = capsys.readouterr().out.splitlines()
    for label in ("wall 1.x [m]", "west.volume [m³]", "volume [m³]", "west.area [m²]"):
        assert label in shown[0]
    assert "rise" not in shown[0]
    assert shown[-1] == "no case has sag"
    table = pd.read_csv("t.csv", index_col="case")
    assert list(table) == [
        "wall 1.x",
        "status",
        "verdict",
        "west.volume",
        "east.volume",
        "volume",
        "west.area",
    ]
    assert table["west.volume"].diff()[1] > 0.2  # the wall has moved to the east
    assert (drawn["y"], set(drawn["curves"])) == ("volume [m³]", {"west", "east", "roof"})
    assert cli.main([*given, "--show", "west.volum"]) == 2
    assert "did you mean 'volume'" in capsys.readouterr().err


def test_targets_and_remeshing_are_the_projects(roof):
    aim = '[targets]\nmeet = [{quantity = "apex", of = "west", value = 0.3}]\nvary = ["west"]\n'
    roof.write_text(TEXT + aim + "[remesh]\nedge_length = 0.9\n", encoding="utf-8")
    case = solve_varied("roof.toml", digest(roof), **{"east.tension": 3.1})
    assert case["targets_met"] is True
    assert case["triangles"] > 1.5 * varied(roof, {})[1].m


def test_the_digest_is_of_what_the_file_says(roof, tmp_path):
    first = digest(roof)
    roof.write_bytes(TEXT.replace("\n", "\r\n").encode())  # as an editor on Windows leaves it
    assert digest(roof) == first
    roof.write_text(TEXT.replace("0.8", "0.81"), encoding="utf-8")
    assert digest(roof) != first
    surface = two_squares(2)
    pcmc.write(tmp_path / "a.pcmc", surface)
    pcmc.write(tmp_path / "b.pcmc", surface.retensioned({"left": 9.0}))
    pcmc.write(tmp_path / "c.pcmc", surface.moved(surface.vertices * (1.0 + 1e-15)))
    wall = [replace(patch, wall=True) for patch in surface.patches]
    pcmc.write(tmp_path / "d.pcmc", surface.rebuilt(patches=wall))
    assert len({digest(tmp_path / f"{name}.pcmc") for name in "abcd"}) == 4


CORNER = "supports = [[[0, 0], [6, 0]]]"
BAD = [
    ("wst.tension", 2.0, "unknown number 'wst.tension'; did you mean 'west.tension'"),
    ("west.tensoin", 2.0, "did you mean 'west.tension'"),
    ("plan.edge_lenght", 2.0, "did you mean 'plan.edge_length'"),
    ("plan.outlin.2.1", 2.0, "did you mean 'plan.outline.2.1'"),
    ("plan.holes.1.curve.circle.radius", 2.0, "did you mean 'plan.holes.yard.curve"),
    ("plan.outline.5.1", 2.0, "unknown number"),
    ("plan.edge", 2.0, "unknown number"),
    ("structure.snow", 0.5, r"no shape depends on \[structure\]"),
    ("plan.edge_length", -1, "edge_length: expected a finite number > 0, found -1"),
    ("plan.edge_length", "x", "must be a finite number, found 'x'"),
    ("plan.edge_length", True, "must be a finite number, found True"),
    ("west.tension", float("nan"), "west.tension must be a finite number, found nan"),
    ("west.tension", -2.0, "tension of 'west': expected a finite number ≥ 0"),
    ("solve.tolerance", -1.0, "tolerance"),
]


@pytest.mark.parametrize(("name", "value", "message"), BAD, ids=[f"{n}={v}" for n, v, _ in BAD])
def test_bad_names_and_values_are_refused_before_any_case(roof, name, value, message):
    good = {"east.tension": [3.0, 4.0]}
    with pytest.raises(PcmcError, match=message) as caught:
        project_sweep(roof, good, {name: value})
    assert str(caught.value).startswith(f"{roof}: ")
    with pytest.raises(PcmcError, match=message):
        project_sweep(roof, good | {name: [value, 1.0]})


def test_two_names_of_one_number_are_refused(roof):
    """The second one was in the table, and counted for nothing."""
    names = {"west.tension": "plan.patches.west.tension", "wall 1.tension": "plan.dividers.1.wall"}
    for name, other in names.items():
        with pytest.raises(PcmcError, match=f"{name} and {other} set the same number; give one of them"):
            project_sweep(roof, {name: [4.0], other: [5.0, 6.0]})
    assert len(project_sweep(roof, {"west.tension": [4.0], "plan.patches.east.tension": [5.0]})) == 1


@pytest.mark.parametrize(
    ("lines", "name", "other"),
    [
        ("tension = 5.0", "patch 1.tension", "plan.tension"),
        ("tension = 5.0\ncushion = 1.0", "patch 1.pressure", "plan.pressure"),
        (
            f"tension = 5.0\npressure = 0.0\nedge = 'cable'\ncable = 9\n{CORNER}",
            "cable 1.tension",
            "plan.cable",
        ),
    ],
)
def test_a_number_of_all_and_that_of_the_only_one_are_one(tmp_path, lines, name, other):
    """Before, the first one was in the table, and counted for nothing."""
    path = tmp_path / "roof.toml"
    path.write_text(f"[plan]\nedge_length = 1.5\noutline = [[0, 0], [6, 0], [6, 4], [0, 4]]\n{lines}\n")
    with pytest.raises(PcmcError, match=f"{name} and {other} set the same number; give one of them"):
        project_sweep(path, {name: [4.0], other: [5.0, 6.0]})


def test_a_name_that_is_none_is_refused_by_a_case_too(roof):
    with pytest.raises(OptionError, match=r"unknown number 'edge'"):
        varied(roof, {"edge": 1.0})
    with pytest.raises(OptionError, match=r"unknown number 'wst.tension'; did you mean 'west.tension'"):
        varied(roof, {"wst.tension": 1.0})


def test_bad_methods_and_projects_are_refused(roof):
    with pytest.raises(OptionError, match="did you mean 'newton'"):
        project_sweep(roof, {"west.tension": [3.0, 4.0]}, method="newtn")
    with pytest.raises(FileError, match=r"none\.toml: cannot be read"):
        project_sweep("none.toml", {"west.tension": [3.0, 4.0]})


AIMED = """
[targets]
meet = [{quantity = "apex", of = "west", value = 1.0}]
vary = ["west"]
"""


@pytest.mark.parametrize("name", ["west.tension", "plan.patches.west.tension"])
def test_a_number_that_the_targets_find_is_not_swept(roof, name):
    roof.write_text(TEXT + AIMED, encoding="utf-8")
    with refused(OptionError, what=name, where="tension of west"):
        project_sweep("roof.toml", {name: [3, 4]})
    assert len(project_sweep("roof.toml", {"east.tension": [3, 4]})) == 2
    plain = TEXT.split("[plan.patches]")[0].replace("[plan]", "[plan]\ntension = 3.0")
    roof.write_text(plain + AIMED.replace("west", "patch 1"), encoding="utf-8")
    with refused(OptionError, what="plan.tension"):
        project_sweep("roof.toml", {"plan.tension": [3, 4]})


def test_a_tension_that_the_rise_of_a_mesh_finds_is_not_swept(roof):
    pcmc.write("roof.obj", varied(roof, {})[1])
    text = '[mesh]\nfile = "roof.obj"\nrise = 1.0\n[mesh.patches.east]\nweight = 0.1\n'
    roof.write_text(text, encoding="utf-8")
    for name in ("west.tension", "mesh.tension", "mesh.patches.east.tension"):
        with pytest.raises(PcmcError, match="is found by the search"):
            project_sweep("roof.toml", {name: [3, 4]})
    others = {"mesh.patches.east.weight": [0.1, 0.2], "mesh.rise": [1.0, 1.1]}
    assert len(project_sweep("roof.toml", others)) == 4


def test_a_cable_is_meant_by_its_own_name_before_one_whose_name_has_cable_before_it(roof):
    text = '[plan]\nedge = "cable"\ncable = 9.0\ntension = 1.0\npressure = 0.0\n'
    text += "outline = [[0, 0], [9, 0], [9, 9], [0, 9]]\nsupports = [[0, 0], [9, 0], [9, 9], [0, 9]]\n"
    text += 'cables = [{name = "1", tension = 4.0, curve = [[0, 0], [9, 0]]}]\n'
    roof.write_text(text, encoding="utf-8")
    tensions = {cable.name: cable.tension for cable in varied(roof, {"cable 1.tension": 5.0})[1].cables}
    assert (tensions["cable 1"], tensions["1"]) == (5.0, 4.0)


def test_the_tension_of_a_cable_is_a_force_also_where_nothing_is_at_rest(roof):
    text = 'units = "m"\nforce = "kN"\n[plan]\nedge = "cable"\ncable = 9.0\ntension = 1.0\npressure = 0.0\n'
    text += "outline = [[0, 0], [9, 0], [9, 9], [0, 9]]\nsupports = [[0, 0], [9, 0], [9, 9], [0, 9]]\n"
    text += 'cables = [{name = "hem", tension = 4.0, curve = [[0, 0], [9, 0]]}]\n'
    roof.write_text(text, encoding="utf-8")
    names = ["cable 1.tension", "hem.tension", "plan.cables.hem.tension", "plan.cable", "patch 1.tension"]
    labels = column_labels(roof, [*names, "support 1.z", "verdict"])
    assert [label.rpartition(" ")[2] for label in labels.values()] == [*["[kN]"] * 4, "[kN/m]", "[m]"]
