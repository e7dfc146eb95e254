"""The mesh check as commands, projects and sweeps make it."""

import numpy as np
import pytest
from refusals import refused

from generators import (
    spherical_cap_exact,
)
from pcmc import certify, check_mesh, cli, read
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.meshing.held_curves import held_edges
from pcmc.project import run
from pcmc.sweep import run as run_sweep
from pcmc.sweep import solve_case
from pcmc.sweep.projects import project_sweep

HALL = """
[plan]
edge_length = 1.5
outline = [[0, 0], [6, 0], [6, 4], [0, 4]]
patches = {roof = {tension = 5.0}}
[output]
files = ["hall.pcmc"]
"""


@pytest.fixture
def hall(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hall.toml").write_text(HALL, encoding="utf-8")
    return tmp_path


def test_solve_prints_the_check_unless_told_not_to(hall, capsys):
    assert cli.main(["solve", "hall.toml"]) == 0
    out = capsys.readouterr().out
    assert "persists: " in out
    assert " ± " in out
    assert "lowest eigenvalue" in out
    assert cli.main(["solve", "hall.toml", "--no-mesh-check"]) == 0
    assert "persists: " not in capsys.readouterr().out
    assert cli.main(["certify", "hall.pcmc", "--meshes", "3"]) == 0
    assert "reaction per length" in capsys.readouterr().out
    assert cli.main(["certify", "hall.pcmc", "--meshes", "1"]) == 2
    assert "--meshes: expected a whole number ≥ 2" in capsys.readouterr().err


def test_large_surfaces_are_checked_on_request_only(hall, capsys, monkeypatch):
    for room in ("project.outcome", "cli.reports"):
        monkeypatch.setattr(f"pcmc.{room}.MOST_CHECKED", 10)
    assert cli.main(["solve", "hall.toml"]) == 0
    assert "mesh check left out above 10 triangles" in capsys.readouterr().out
    assert cli.main(["solve", "hall.toml", "--mesh-check"]) == 0
    assert "persists: " in capsys.readouterr().out


def test_ctrl_c_during_the_check_keeps_the_files(hall, capsys, monkeypatch):
    def pressed(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("pcmc.accuracy.mesh_check.solve_once", pressed)
    assert cli.main(["solve", "hall.toml"]) == 130
    assert "written: hall.pcmc" in capsys.readouterr().out
    assert certify(read("hall.pcmc")).certified


def test_a_check_that_fails_costs_nothing(hall, capsys, monkeypatch):
    def refuse(*_, **__):
        raise SurfaceError("too fine", what="vertices")

    monkeypatch.setattr("pcmc.accuracy.mesh_check.refine", refuse)
    assert cli.main(["solve", "hall.toml"]) == 0
    assert "no mesh check: too fine" in capsys.readouterr().out
    case = solve_case("generators:spherical_cap", mesh_check=True, edge_length=0.5)
    assert (case["verdict"], case["mesh_verdict"], case["mesh_detail"]) == (
        "stable",
        "not checked",
        "too fine",
    )


def test_a_project_may_ask_for_the_check(hall):
    assert run("hall.toml").mesh_check is None
    (hall / "hall.toml").write_text(HALL + "[solve]\nmesh_check = true\n", encoding="utf-8")
    outcome = run("hall.toml")
    assert outcome.mesh_check.persists
    assert outcome.mesh_check.surfaces[0] is outcome.surface


def test_shallow_corners_of_a_plan_stay_corners(hall):
    """A plan of 12 sides turns by 30° at each corner: it is not a circle."""
    angle = 2.0 * np.pi * np.arange(12) / 12
    outline = np.stack([np.cos(angle), np.sin(angle)], axis=1).tolist()
    text = f"[plan]\nedge_length = 0.2\noutline = {outline}\ntension = 1.0\n[solve]\nmesh_check = true\n"
    (hall / "round.toml").write_text(text, encoding="utf-8")
    check = run("round.toml").mesh_check
    row = check.row("reaction")  # the load on the plan's area
    assert check.row("reaction").value == pytest.approx(-3.0, rel=0.02)
    assert abs(row.limit + 3.0) <= row.limit_error < 0.01
    assert not len(held_edges(check.surfaces[0]))  # a plan draws all that is held, and nothing is guessed
    bare = check.surfaces[0].rebuilt(curves=())  # without the lines of the plan, curves go through them
    rounded = check_mesh(bare).row("reaction")
    assert 0.01 < abs(rounded.limit + 3.0) <= rounded.limit_error


@pytest.mark.nightly
def test_sweeps_have_columns_of_the_check(hall):
    case = solve_case("generators:spherical_cap", mesh_check=True, edge_length=0.25)
    assert case["mesh_verdict"] == "persists"
    assert abs(case["height_limit"] - spherical_cap_exact().height) <= case["height_limit_error"]
    sweep = project_sweep("hall.toml", {"roof.tension": [4.0, 6.0]}, mesh_check=True)
    table = run_sweep(sweep, workers=1)
    assert table["mesh_verdict"].tolist() == ["persists"] * 2
    assert (table["volume_error"] > table["volume_limit_error"]).all()
    with refused(OptionError, what="mesh_check", found=3):
        project_sweep("hall.toml", {"roof.tension": [4.0, 6.0]}, mesh_check=3)
