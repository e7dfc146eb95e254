"""A member across a mirror plane is in the model of the whole roof, which its refusal asks for."""

import pytest
from refusals import refused

from pcmc.base.errors import OptionError
from pcmc.project import run

ROOF = """
[plan]
edge_length = 1.5
outline = [[0, 0], [6, 0], [6, 8], [0, 8]]
mirrors = [[[6, 0], [6, 8]]]
dividers = [{curve = [[0, 4.5], [6, 4.5]], wall = 0.9, upright = true, member = "arch"}]
[plan.patches]
south = {tension = 3.0, pressure = 0.4, at = [2, 2]}
north = {tension = 3.0, pressure = 0.4, at = [2, 7]}
[structure]
young = 5e5
thickness = 0.001
members = {arch = {young = 2.1e8, diameter = 0.2}}
[output]
structure = "roof.inp"
"""


def test_a_member_across_a_mirror_is_in_the_model_of_the_whole(tmp_path):
    path = tmp_path / "roof.toml"
    path.write_text(ROOF + "whole = true\n")
    outcome = run(path)
    [line] = outcome.model(outcome.project.structure).lines
    places = outcome.shown.surface.vertices[line.vertices]
    assert (tmp_path / "roof.inp").exists()
    assert (places[:, 0].min(), places[:, 0].max()) == pytest.approx((0.0, 12.0))
    path.write_text(ROOF)
    with refused(OptionError) as error:
        run(path)
    assert "take the whole roof, whole = true" in str(error.value)
