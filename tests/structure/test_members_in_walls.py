"""Members in the place of a wall: what they carry, and shapes that do not bend."""

import re

import numpy as np
import pytest
from hall_with_members import STEEL, TUBE, hall, hall_under_load, hall_with
from programs import needs_ccx
from refusals import refused
from small_project import HALL_WITH_ARCH
from structures import model_of

import pcmc
from generators import joined_caps
from pcmc import Material, Snow, StructuralModel, Wind, cli
from pcmc.base.errors import OptionError
from pcmc.plan import CableLine, Divider, Plan
from pcmc.structure import Member, Profile, analyse
from pcmc.structure.frames import balancing_force, turns
from pcmc.structure.member_forces import (
    forces_on_members,
    members_at_rest,
)
from pcmc.structure.members import lines_on


def test_the_junction_of_two_spheres_needs_no_bending():
    """It is an arc of a circle in the plane of its wall: N = α_w r, exactly in the limit."""
    edges, shares, forces = (1.0, 0.5, 0.25), [], []
    for edge in edges:
        caps = joined_caps(edge, exact=True)
        arch = Member("wall", TUBE, STEEL)
        [beam] = members_at_rest(model_of(caps, members=[arch], anyway=True))
        N, share = beam.balance
        x, _, z = beam.points.T
        radius = np.hypot(beam.points[:, 1], z + 4.5)
        assert abs(x).max() < 1e-12
        assert np.ptp(radius) < 1e-12
        forces.append(N / (3.0 * radius[0]) - 1.0)
        shares.append(share)
    assert np.polyfit(np.log(edges), np.log(forces), 1)[0] > 1.6
    assert forces[-1] < 3e-3
    assert shares[-1] < 0.015 < shares[0] / 3.0


@pytest.mark.parametrize("load", [Wind({"wall": 0.2}), Snow(0.2, ["wall"])])
def test_a_load_on_a_wall_with_a_member_is_refused(load):
    """The wall is no element then: its load was left out without a word."""
    arch, caps = Member("wall", TUBE, STEEL), joined_caps(1.0, exact=True)
    with refused(OptionError, what="loads", where="wall"):
        model_of(caps, members=[arch], loads=[load], anyway=True)
    model_of(caps, loads=[load], anyway=True)


@needs_ccx
def test_a_member_in_the_place_of_a_wall_carries_what_the_wall_did():
    """The reactions balance the loads; at rest the member carries the wall's pull; beam theory agrees."""
    analysis = hall_under_load()
    model = analysis.model
    free = model.nodes & ~model.held & ~model.on_members
    assert analysis.carried
    for case in analysis.cases:
        left = forces_on_members(model, case.results.step, case.results)
        scale = np.abs(left[model.on_members]).max()
        assert np.abs(left[free]).max() < 0.01 * scale
        total = model.nodal_loads(case.results.step, np.nan_to_num(case.results.displacements)).sum(axis=0)
        np.testing.assert_allclose(case.results.reactions.sum(axis=0), -total, atol=5e-3)
    [rest], [run] = members_at_rest(model), analysis.cases[0].members
    np.testing.assert_allclose(run.pulls, rest.pulls, atol=0.03)
    assert run.deflection == pytest.approx(rest.deflection, rel=0.1)
    assert run.within[:, 0] == pytest.approx(rest.within[:, 0], rel=0.03)
    assert set(analysis.tables) == {"cases", "patches", "supports", "members", "member-forces"}


@needs_ccx
def test_the_supports_have_the_ends_of_a_member_and_no_foot_of_its_wall():
    """What holds an end is the force of its last bar, and the sheets' pull; all balance the loads."""
    analysis = hall_under_load()
    table = analysis.supports
    assert table["support"].tolist() == ["B1", "B2", "M1", "M2"] * 3
    for case in analysis.cases:
        own = table[table["case"] == case.name]
        forces = own[[f"force_{axis}" for axis in "xyz"]].to_numpy()
        np.testing.assert_allclose(forces.sum(axis=0), case.results.reactions.sum(axis=0), atol=1e-9)
        [beam] = case.members
        for row, place, next_to in ((2, 0, 1), (3, -1, -2)):
            np.testing.assert_allclose(own[[*"xyz"]].to_numpy()[row], beam.points[place], atol=1e-9)
            of_bar = 0.5 * (beam.within[place] + beam.within[next_to])[:3]
            left = np.linalg.norm(forces[row] + beam.pulls[place])
            assert left == pytest.approx(np.linalg.norm(of_bar), rel=0.01)


@needs_ccx
def test_a_cable_that_ends_at_the_foot_of_a_wall_leaves_no_row_for_that_wall():
    plan = Plan(
        [[0, 0], [9, 0], [9, 8], [0, 8]],
        [{"curve": [[5, 0], [5, 8]], "wall": 0.3}],
        edge_length=1.2,
        patches={"west": {"tension": 1.5, "pressure": 0.3}, "east": {"tension": 1.5, "pressure": 0.0}},
        cables=[CableLine([[5, 0], [9, 0]], 12.0)],
    )
    model = hall_with(of=pcmc.solve(plan.surface()).surface, cable_area=2e-4)
    table = analyse(model, remedy=False).supports
    assert "wall 1" not in table["name"][table["kind"] == "line"].tolist()
    assert table["kind"].tolist().count("cable end") == 2
    np.testing.assert_allclose(table.groupby("case")[["force_z"]].sum(), [[-12.0]], rtol=0.05)


@pytest.mark.parametrize("of", [{}, {"scale": 0.05, "east": 0.15}], ids=["even", "wall under pressure"])
def test_a_cable_in_the_place_of_a_wall_has_the_tension_that_balances_best(of):
    model = hall_with(Member("wall 1", Profile(1e-4, 1e-9), STEEL, kind="cable"), hall(**of))
    [cable], [beam] = model.standing.cables, members_at_rest(hall_with(of=hall(**of)))
    assert cable.name == "wall 1"
    assert cable.tension == pytest.approx(beam.balance[0], rel=1e-4)
    assert model.cable_sections[0] == (1e-4, STEEL)
    assert not model.beams


def test_the_lines_that_the_command_offers_give_a_shape_that_does_not_bend(tmp_path, capsys):
    """What N leaves of the sheets' pull falls below a twentieth: by the project, its lines, and again."""

    def bending(model):
        if model.beams:
            return members_at_rest(model)[0].balance[1]
        [cable], [pulls] = model.standing.cables, [forces_on_members(model, model.steps[0])]
        [curve] = model.standing.topology.chains(cable.edges, np.zeros(model.surface.n, bool))
        P = model.standing.vertices[curve.vertices]
        return balancing_force(P, pulls[curve.vertices] - cable.tension * turns(P, False), False)[1]

    path, shares = tmp_path / "hall.toml", []
    text = HALL_WITH_ARCH.split("[output]")[0]
    for _ in range(2):
        path.write_text(text, encoding="utf-8")
        assert cli.main(["structure", str(path), "-o", str(tmp_path / "hall.inp")]) == 0
        printed = capsys.readouterr().out.splitlines()
        outcome = pcmc.project.designed(path)
        shares.append(bending(outcome.model(outcome.project.structure)))
        offered = [line for line in printed if re.match("(wall|cable|name) = ", line)]
        text = text.replace("wall = 0.6", ", ".join(offered) or "wall = 0.6")
    assert offered == []  # the second time
    assert shares[0] > 0.1
    assert shares[1] < 0.05 * shares[0]


def test_a_wall_with_a_tension_that_is_free_along_it_balances_a_line_that_does_not_bend():
    """On the circle where two spheres meet N κ is the wall's own tension; elsewhere it is another one."""
    off = []
    for edge in (1.0, 0.5):
        caps = joined_caps(edge, exact=True)
        [beam] = members_at_rest(model_of(caps, members=[Member("wall", TUBE, STEEL)], anyway=True))
        off.append(np.nanmean(np.abs(beam.wall_tensions - 3.0), axis=0))
    assert (off[1] < 0.5 * off[0]).all()
    [beam] = members_at_rest(hall_with())
    pull, unbent = beam.wall_tensions[1:-1].T
    assert pull[2:-2] == pytest.approx(0.6, rel=0.05)
    assert np.ptp(unbent) > 0.1


def test_a_cable_in_the_place_of_a_wall_finds_a_shape_that_does_not_bend():
    """What the best force along the junction leaves is then nothing."""
    bays = {name: {"tension": 1.5, "pressure": 0.3} for name in ("west", "east")}
    line = {"curve": [[6, 0], [6, 8]], "wall": False, "cable": 6.56}
    plan = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], [line], edge_length=1.2, patches=bays)
    found = pcmc.solve(plan.surface())
    assert found.certificate.certified
    model = StructuralModel(found, Material(5e5), 1e-3, cable_area=1e-4)
    [cable] = model.standing.cables
    left = forces_on_members(model, model.steps[0])[np.unique(cable.edges)[2:-2]]
    assert np.abs(left).max() < 0.05 * 6.56


def test_a_member_leaves_the_wall_of_another_divider_alone():
    """A wall "axis-2" is a part of a divider "axis" only where no wall has that name itself."""
    dividers = [Divider([[x, 0], [x, 6]], name=name) for x, name in ((4, "axis"), (8, "axis-2"))]
    bays = Plan([[0, 0], [12, 0], [12, 6], [0, 6]], dividers, edge_length=1.5, tension=4.0).surface()
    assert [line.wall for line in lines_on(bays, [Member("axis", TUBE, STEEL)])] == ["axis"]
