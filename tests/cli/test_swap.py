"""``pcmc solve --swap``: films and walls that open the other way, from a file, a project and a cell."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from periodic_cases import scattered, steiner_films

import pcmc
from pcmc import cli

HALL = """
[plan]
edge_length = 1.2
tension = 12.0
outline = [[0, 0, 4], [6, 0, 4], [6, 12, 4], [0, 12, 4]]
[[plan.dividers]]
curve = [[0, 0], [2, 6]]
[[plan.dividers]]
curve = [[0, 12], [2, 6]]
[[plan.dividers]]
curve = [[6, 0], [4, 6]]
[[plan.dividers]]
curve = [[6, 12], [4, 6]]
[[plan.dividers]]
curve = [[2, 6], [4, 6]]
""".replace("curve", 'wall = 4.0\nbottom = "sliding"\ncurve')
TARGETS = """
[targets]
meet = [{quantity = "volume", value = 281.0}]
vary = [["patch 2", "patch 3"]]
"""
MEET = "'south-west' and 'south-east' now meet, and 'north-west' and 'north-east'; E = "


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PCMC_CACHE", str(tmp_path / "cache"))
    return tmp_path


@pytest.mark.parametrize("name", ["vanished", "middle"])
def test_a_film_of_a_cell_that_vanished_opens_the_other_way(name, here, capsys):
    pcmc.write("films.pcmc", steiner_films(0.56, 1.0))
    assert cli.main(["solve", "films.pcmc"]) == 1
    assert "try pcmc solve FILE --swap vanished" in capsys.readouterr().out
    assert cli.main(["solve", "films.pcmc", "--swap", name, "-o", "swapped.pcmc"]) == 0
    out = capsys.readouterr().out
    assert MEET in out
    assert "stable: at rest" in out
    assert pcmc.solve(pcmc.read("swapped.pcmc")).energy == pytest.approx(1.0 + 0.56 * 3**0.5, abs=1e-12)


def test_a_film_across_the_faces_of_its_cell(here, capsys):
    films = scattered(steiner_films(0.56, 1.0).rebuilt(fixed=()), [[0, 0, 1]])
    corners = np.isclose(np.abs(films.vertices[:, :2]), [0.28, 0.5]).all(axis=1)
    pcmc.write("films.pcmc", films.rebuilt(fixed=corners))
    assert cli.main(["solve", "films.pcmc", "--swap", "vanished", "--no-mesh-check"]) == 0
    assert MEET in capsys.readouterr().out


@pytest.mark.nightly
def test_a_wall_of_a_project_that_vanished_opens_the_other_way(here, capsys):
    Path("hall.toml").write_text(HALL)
    command = ["solve", "hall.toml", "--swap", "vanished", "--no-mesh-check", "-o", "hall.pcmc"]
    assert cli.main([*command, "--pressure", "1.0"]) == 0
    out = capsys.readouterr().out
    assert "'patch 1' and 'patch 4' now meet; E = 11" in out
    assert "type in" not in out
    assert not list(here.glob("cache/*"))  # the project alone has another roof
    swapped = pcmc.read("hall.pcmc")
    assert pcmc.certify(swapped).certified


def test_targets_are_met_after_the_swap(here, capsys):
    Path("hall.toml").write_text(f"{HALL}{TARGETS}")
    command = ["solve", "hall.toml", "--swap", "vanished", "--no-mesh-check", "-o", "hall.pcmc"]
    assert cli.main(command) == 0
    out = capsys.readouterr().out
    assert "'patch 1' and 'patch 4' now meet" in out
    assert "targets met" in out
    assert "type in" not in out
    assert not list(here.glob("cache/*"))  # the project alone has another roof
    assert pcmc.certify(pcmc.read("hall.pcmc")).certified


def test_where_no_film_has_vanished_the_roof_is_as_without(here, capsys):
    pcmc.write("films.pcmc", steiner_films(1.0, 1.0))
    assert cli.main(["solve", "films.pcmc", "--swap", "vanished", "-o", "same.pcmc", "--no-mesh-check"]) == 0
    assert "nothing swapped: no film or wall between two junctions has vanished" in capsys.readouterr().out
    assert pcmc.energy(pcmc.read("same.pcmc")) == pytest.approx(1.0 + 3**0.5, abs=1e-12)


def test_a_swap_that_does_not_come_to_rest_is_undone(here, capsys):
    pcmc.write("films.pcmc", steiner_films(2.0, 1.0))  # wider than √3: no film along y is at rest
    assert cli.main(["solve", "films.pcmc", "--swap", "middle", "-o", "same.pcmc"]) == 0
    assert (
        "undone, as nothing comes to rest after the swap: patch 'middle' vanishes" in capsys.readouterr().out
    )
    assert pcmc.energy(pcmc.read("same.pcmc")) == pytest.approx(2.0 + 3**0.5, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("midle", "unknown patch 'midle'; did you mean 'middle'?"),
        ("south-west", "patch 'south-west' is no film between two junctions"),
    ],
)
def test_a_name_of_no_film_is_refused_in_a_line(name, sentence, here, capsys):
    pcmc.write("films.pcmc", steiner_films(1.0, 1.0))
    assert cli.main(["solve", "films.pcmc", "--swap", name, "-o", "new.pcmc"]) == 2
    said = capsys.readouterr().err
    assert sentence in said
    assert said.count("\n") == 1
    assert not Path("new.pcmc").exists()
