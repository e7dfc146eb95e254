"""The weight of a cable in plans, projects, files in other units, sweeps, commands, branches, on the page."""

from pathlib import Path

import numpy as np
import pytest

import pcmc
from pcmc import cli
from pcmc.base.errors import OptionError
from pcmc.explore.page_data import state_data
from pcmc.explore.session import Session, solved_start
from pcmc.forces.functional import by_rates
from pcmc.io.mesh_data import scaled_surface
from pcmc.plan import CableLine, Divider, Hole, Plan
from pcmc.project import designed, load, surface_of, varied
from pcmc.project.file import read_data
from pcmc.project.values import changeable_values, data_with_values
from pcmc.solvers.continuation import Direction
from pcmc.surface.values import rates_of

SAIL = """
units = "m"
force = "kN"
[plan]
edge_length = 1.5
outline = [[0, 0], [6, 0], [6, 6], [0, 6]]
edge = "cable"
cable = 9.0
cable_weight = 0.2
supports = [[0, 0, 2], [6, 0, 0], [6, 6, 2], [0, 6, 0]]
tension = 1.0
pressure = 0.0
"""
SQUARE = [[0, 0], [6, 0], [6, 6], [0, 6]]


@pytest.fixture
def sail(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = Path("sail.toml")
    path.write_text(SAIL, encoding="utf-8")
    return path


def weights_of(surface):
    return {cable.name: cable.weight for cable in surface.cables}


def test_each_kind_of_cable_of_a_plan_has_one():
    corners = [*SQUARE, [3, 3, 0]]
    rim = Plan(
        SQUARE,
        holes=[Hole([[2, 2], [4, 2], [4, 4], [2, 4]], "cable", cable=3.0, cable_weight=0.3)],
        cables=[CableLine([[0, 0], [6, 0]], 4.0, "hem", 0.1)],
        supports=[*corners[:4], [2, 2], [4, 4]],
        edge="cable",
        cable=9.0,
        cable_weight=0.2,
        tension=1.0,
        pressure=0.0,
    ).surface()
    assert weights_of(rim)["hem"] == 0.1
    assert sorted(weights_of(rim).values()) == [0.1, 0.2, 0.2, 0.2, 0.3, 0.3]
    ridge = Divider([[3, 0], [3, 6]], wall=False, name="ridge", cable=5.0, cable_weight=0.4)
    patches = {"west": {"tension": 1.0, "at": [1, 1]}, "east": {"tension": 1.0, "at": [5, 5]}}
    assert weights_of(Plan(SQUARE, [ridge], patches=patches).surface()) == {"ridge": 0.4}


def test_one_without_a_cable_is_refused():
    with pytest.raises(OptionError, match=r"the outline: cable_weight = 0[.]2 needs a cable"):
        Plan(SQUARE, tension=1.0, cable_weight=0.2)
    with pytest.raises(OptionError, match=r"divider 1: cable_weight = 1 needs a cable"):
        Plan(SQUARE, [Divider([[3, 0], [3, 6]], cable_weight=1.0)], tension=1.0)


def test_a_heavier_cable_hangs_lower_and_its_weight_is_carried(sail):
    heavy = designed(sail, use_cache=False)
    light = designed(sail, changed=lambda s: s.retensioned(cable_weights=dict.fromkeys(weights_of(s), 0.0)))
    assert heavy.good
    assert light.good
    free = ~heavy.surface.fixed
    assert heavy.surface.vertices[free, 2].mean() < light.surface.vertices[free, 2].mean() - 0.01
    ends = heavy.surface.vertices[heavy.surface.cable_edges.ends]
    total = 0.2 * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()
    assert heavy.certificate.reactions[:, 2].sum() == pytest.approx(
        total, rel=3e-3
    )  # but what the mesh leaves
    assert set(heavy.certificate.cables["weight"]) == {0.2}
    assert "weight" not in light.certificate.cables


def test_the_saved_project_has_the_weights_shown(sail):
    data = read_data(sail)[1]
    start = surface_of(load(sail))
    assert changeable_values(start)["cable_weights"] == dict.fromkeys(weights_of(start), 0.2)
    alike = start.retensioned(cable_weights=dict.fromkeys(weights_of(start), 0.35))
    saved, _, again = data_with_values(sail, data, alike)
    assert saved["plan"]["cable_weight"] == 0.35
    assert weights_of(again) == weights_of(alike)
    one = start.retensioned(cable_weights={"cable 2": 0.5})
    saved, _, again = data_with_values(sail, data, one)
    assert weights_of(again) == weights_of(one)
    assert {line["name"]: line["weight"] for line in saved["plan"]["cables"]}["cable 2"] == 0.5


def test_sweeps_and_commands_vary_it(sail, capsys):
    assert weights_of(varied(sail, {"plan.cable_weight": 0.5})[1])["cable 1"] == 0.5
    for name in ("cable 3.weight", "cable cable 3.weight"):
        assert weights_of(varied(sail, {name: 0.7})[1]) == dict.fromkeys(
            ("cable 1", "cable 2", "cable 4"), 0.2
        ) | {"cable 3": 0.7}
    assert cli.main(["certify", "sail.toml", "--cable-weight", "cable 3=0.7", "--no-cache"]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert any(row[:2] == ["cable", "3"] and "0.7" in row for row in rows)


def test_another_unit_keeps_the_forces(sail):
    surface = surface_of(load(sail))
    small = scaled_surface(surface, 1000.0)
    assert weights_of(small)["cable 1"] == pytest.approx(0.2e-3)
    assert pcmc.energy(small) == pytest.approx(1000.0 * pcmc.energy(surface))
    pcmc.write("sail.pcmc", surface, units="m")
    with pytest.warns(pcmc.base.errors.FileWarning, match="converted"):
        assert weights_of(pcmc.read("sail.pcmc", units="mm"))["cable 1"] == pytest.approx(0.2e-3)


def test_another_unit_moves_the_point_of_a_plane(sail):
    plane = pcmc.Plane((2.0, 3.0, -4.0), (0.0, 0.0, 1.0))
    small = scaled_surface(surface_of(load(sail)).rebuilt(plane=plane), 1000.0)
    assert small.plane.point == (2000.0, 3000.0, -4000.0)


def test_a_branch_follows_it(sail):
    start = surface_of(load(sail))
    rates = {"cable_weights": rates_of(start, "cable_weights", {"cable 1": 1.0, "cable 2": -2.0})}
    step, X = {"cable 1": 0.2 + 1e-3, "cable 2": 0.2 - 2e-3}, start.vertices
    more = start.retensioned(cable_weights=step)
    assert by_rates(start, rates, X)[0] * 1e-3 == pytest.approx(pcmc.energy(more) - pcmc.energy(start))
    difference = pcmc.gradient(more) - pcmc.gradient(start)
    free = ~start.fixed
    assert by_rates(start, rates)[1][free] * 1e-3 == pytest.approx(difference[free], abs=1e-12)
    first = pcmc.solve(start).surface
    direction = Direction(cable_weights=dict.fromkeys(weights_of(start), 1.0))
    branch = pcmc.follow(first, direction, stop=0.3)
    reached = branch.surfaces[max(branch.surfaces)]
    assert weights_of(reached)["cable 4"] == pytest.approx(0.3)
    again = pcmc.solve(reached).surface
    assert np.abs(again.vertices - reached.vertices).max() < 1e-6


def test_targets_find_it(sail):
    ropes = weights_of(surface_of(load(sail)))
    heavy = designed(sail, changed=lambda s: s.retensioned(cable_weights=dict.fromkeys(ropes, 0.3)))
    meet = f"meet = [{{quantity = 'volume', value = {heavy.certificate.volume}}}]"
    vary = f"vary = [{{patch = {list(ropes)}, kind = 'cable_weight'}}]"
    sail.write_text(f"{SAIL}[targets]\n{meet}\n{vary}\n", encoding="utf-8")
    roof = designed(sail, use_cache=False)
    assert roof.good, roof
    (found,) = set(weights_of(roof.surface).values())
    assert found == pytest.approx(0.3, rel=1e-5)
    assert roof.design.values(roof.units).endswith(f"weight of {' and '.join(ropes)} {found:.6g} kN/m")


def test_the_page_has_a_slider_for_it(sail):
    session = Session(solved_start(surface_of(load(sail))))
    state = session.settle({"cable_weights": {"cable 1": 0.3}})
    assert weights_of(state.surface)["cable 1"] == 0.3
    about = state_data(state, np.zeros(3), moving=False)
    assert about["values"]["shown"]["cable_weights"]["cable 1"] == 0.3
