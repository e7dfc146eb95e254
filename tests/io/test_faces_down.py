"""A mesh whose triangles look down is named, and `pcmc repair` says which patches it turned over."""

import warnings

import numpy as np
import pytest

import pcmc
from pcmc import cli
from pcmc.base.errors import FileWarning, FreeSurfaceWarning
from pcmc.plan import Plan

SQUARE = [[0, 0], [4, 0], [4, 3], [0, 3]]


def write_obj(path, surface, turned=False):
    lines = ["v {:.9g} {:.9g} {:.9g}".format(*x) for x in surface.vertices.tolist()]
    lines += ["f {} {} {}".format(*f) for f in (surface.faces[:, :: -1 if turned else 1] + 1).tolist()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def risen(surface):
    return pcmc.solve(surface.retensioned({surface.patches[0].name: 2.0})).surface.vertices[:, 2]


def test_a_roof_that_faces_down_gives_a_warning_and_the_command_turns_it(tmp_path, capsys):
    roof = Plan(SQUARE, edge_length=1.0, tension=2.0).surface()
    path = write_obj(tmp_path / "down.obj", roof, turned=True)
    with pytest.warns(FileWarning, match="the triangles face down, so a pressure above 0") as caught:
        hung = risen(pcmc.read(path))
    assert hung.max() <= 0.0 > -0.2 > hung.min()
    command = str(caught[0].message).split("turn them: pcmc ")[1].split(";")[0]
    assert cli.main([*command.replace("turned.obj", str(tmp_path / "turned.obj")).split()]) == 0
    assert "1 patches turned over" in capsys.readouterr().out
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        assert risen(pcmc.read(tmp_path / "turned.obj")).max() == pytest.approx(-hung.min(), rel=0.02)
    assert not any("face down" in str(one.message) for one in told)


def test_a_roof_that_faces_up_gives_none(tmp_path):
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        pcmc.read(write_obj(tmp_path / "roof.obj", Plan(SQUARE, tension=2.0).surface()))
    assert not any("face down" in str(one.message) for one in told)


def test_repair_says_that_it_turns_the_lower_sheet_of_a_cushion_over(tmp_path):
    path = tmp_path / "cushion.obj"
    pcmc.write(path, Plan(SQUARE, tension=2.0, cushion=1.2).surface())
    with pytest.warns(FreeSurfaceWarning):  # the sheets are closed, so that nothing is fixed
        repaired = pcmc.repair(path)
    assert repaired.changes["patches turned over"] == 1
    assert np.isfinite(repaired.surface.vertices).all()
