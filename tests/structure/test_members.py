"""Beams, cables and rings of a structural model: what the sheets pull them with, and what CalculiX finds."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from refusals import refused
from small_project import HALL_WITH_ARCH
from starts import spherical_cap
from structures import FABRIC, model_of, square

import pcmc
from generators import joined_caps
from pcmc import Circle, Material, SelfWeight, Snow, StructuralModel, cli
from pcmc.base.errors import OptionError
from pcmc.base.units import Units
from pcmc.plan import Plan, circle, polyline
from pcmc.plot import member_forces
from pcmc.report.chapters import under_load_chapter
from pcmc.report.tables import Picture, Table
from pcmc.structure import Member, Profile, analyse, calculix
from pcmc.structure.member_forces import (
    forces_on_members,
    member_tables,
    members_at_rest,
    sentences,
    weak_members,
)
from pcmc.structure.pulls import balancing_force, turns
from pcmc.structure.section import members_of

needs_ccx = pytest.mark.skipif(not calculix.available(), reason="ccx is not installed")
STEEL = Material(2.1e8, density=7.85)
TUBE = Profile.tube(0.1, 0.005)


@cache
def hall(scale=1.0, east=0.3, wall=0.6):
    """Two bays with a wall between them, at rest; all forces times a scale."""
    bays = {"west": (1.5, 0.3), "east": (1.5, east)}
    bays = {name: {"tension": a * scale, "pressure": p * scale} for name, (a, p) in bays.items()}
    line = {"curve": [[6, 0], [6, 8]], "wall": wall * scale}
    return pcmc.solve(
        Plan([[0, 0], [12, 0], [12, 8], [0, 8]], [line], edge_length=1.2, patches=bays).surface()
    )


def hall_with(member=None, of=None, **more):
    member = member or Member("wall 1", TUBE, STEEL)
    return StructuralModel(of or hall(), Material(5e5, 0.2, 1.2), 0.001, members=[member], **more)


@cache
def hall_under_load():
    """The hall with an arch, by CalculiX."""
    return analyse(hall_with(loads=[SelfWeight(), Snow(0.1)]), remedy=False)


def test_the_edge_of_a_flat_sheet_pulls_a_straight_beam_sideways():
    """M = α L²/8, V = α L/2 at its ends."""
    edge = Member(polyline([[0, 1], [1, 1]]), TUBE, STEEL)
    [beam] = members_at_rest(model_of(square(8, tension=2.0), members=[edge], anyway=True))
    assert (len(beam.points), beam.line.closed, beam.span) == (9, False, 1.0)
    assert beam.within[4, 5] == pytest.approx(2.0 / 8.0)
    assert abs(beam.within[[0, -1], 2]) == pytest.approx(2.0 / 2.0)
    off = beam.deflection / (5 * 2.0 / 384.0 / (2.1e8 * TUBE.upright)) - 1.0
    assert off == pytest.approx(-0.8 / 8**2)  # of a load lumped at eight points
    assert beam.enough == pytest.approx(300.0 * beam.deflection)


def test_a_beam_whose_end_slides_along_it_bends_as_one_with_both_ends_held():
    """On a circle that touches its line, the end neither leaves the line nor turns about it."""
    film = square(8, tension=2.0).retensioned(None, {"film": 1.0})
    end = np.arange(film.n) == film.n - 1
    slides = {Circle((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0): end}
    edge = Member(polyline([[0, 1], [1, 1]]), TUBE, STEEL)
    held, rolls = (
        members_at_rest(model_of(surface, members=[edge], anyway=True))[0]
        for surface in (film, film.rebuilt(fixed=film.fixed & ~end, on_line=slides))
    )
    assert rolls.within[:, 1:] == pytest.approx(held.within[:, 1:], abs=1e-9)
    assert rolls.displacements[:, 1:] == pytest.approx(held.displacements[:, 1:], abs=1e-12)


def test_beams_have_nodes_of_their_own_tied_to_the_vertices_where_these_are(tmp_path):
    model = hall_with()
    pcmc.write_structure(tmp_path / "hall.inp", model)
    text = (tmp_path / "hall.inp").read_text()
    [line] = model.beams
    part = re.search(r"^\*NODE, NSET=BEAMS\n(.*?)^\*", text, re.M | re.S)[1]
    nodes = {int(row[0]): row[1:] for row in np.loadtxt(part.splitlines(), delimiter=",").tolist()}
    assert len(nodes) == len(np.unique(line.pairs))
    blocks = re.findall(r"^\*ELEMENT.*\n([^*]*)", text, re.M)
    numbers = [row.split(",")[0] for rows in blocks for row in rows.split()]
    assert len(numbers) == len(set(numbers)) == len(model.faces) + len(line.pairs)
    tied = re.findall(r"^\*EQUATION\n2\n(\d+),(\d),1\.,(\d+),(\d),-1\.$", text, re.M)
    for node, axis, vertex, same in tied:
        assert axis == same
        assert nodes[int(node)] == pytest.approx(model.standing.vertices[int(vertex) - 1].tolist())
    assert {int(node) for node, *_ in tied} == set(nodes) - {95, 96}  # the feet are held


@needs_ccx
def test_the_deflection_of_a_stiff_beam_goes_like_one_over_its_stiffness():
    """In CalculiX, too, 5 α L⁴ / 384 E I within 2 %: with a stiff member the shape is that of the form."""
    moved = []
    for young in (2.1e10, 2.1e11):
        edge = Member(polyline([[0, 1], [1, 1]]), TUBE, Material(young))
        analysis = analyse(model_of(square(8, tension=2.0), members=[edge], anyway=True))
        moved.append(analysis.members["moved"][0] * young)
        assert analysis.members["M"][0] == pytest.approx(2.0 / 8.0, rel=1e-3)
    assert moved == pytest.approx([5 * 2.0 / 384.0 / TUBE.upright] * 2, rel=0.02)


@needs_ccx
def test_a_member_takes_over_what_is_loaded_at_its_vertices_too():
    """The weight of the form stays while the member takes over: both are loads at the same vertices."""
    film = pcmc.solve(square(8, tension=2.0).retensioned(weights={"film": 0.2})).surface
    edge = Member(polyline([[0, 1], [1, 1]]), TUBE, Material(2.1e10))
    analysis = analyse(model_of(film, members=[edge], anyway=True))
    assert analysis.members["M"][0] == pytest.approx(2.0 / 8.0, rel=0.02)
    assert analysis.table["moved"][0] < 1e-3
    area = pcmc.certify(film).patches["area"][0]
    assert analysis.table["force_z"][0] == pytest.approx(0.2 * area, rel=1e-3)


def test_a_rim_carries_the_pull_of_its_sheet_as_a_ring():
    """A cap at its rim has the slope angle θ: N = -α cos θ R where columns carry it upright, order 2."""
    off = []
    for edge in (0.2, 0.1, 0.05):
        rim = Member(circle([0, 0], 1.0), TUBE, STEEL, propped=True)
        cap = pcmc.solve(
            spherical_cap(edge, alpha=0.6)
        ).surface  # of a sphere of radius 1.2 over the unit circle
        [ring] = members_at_rest(model_of(cap, members=[rim], anyway=True))
        exact = -0.6 * np.sqrt(1.0 - 1.0 / 1.2**2)
        assert ring.line.closed
        assert ring.span == pytest.approx(2.0, rel=0.01)
        off.append(abs(ring.within[:, 0].mean() / exact - 1.0))
    assert np.polyfit(np.log([0.2, 0.1, 0.05]), np.log(off), 1)[0] > 0.9
    assert off[-1] < 0.05
    # a ring whose load keeps its direction buckles in its plane at q = 4 E I/R³, N = -q R
    assert ring.buckling == pytest.approx(-4.0 * 2.1e8 * TUBE.upright / ring.within[:, 0].mean(), rel=0.01)


def test_a_member_that_buckles_is_told_with_what_would_hold_it():
    cap, wire = pcmc.solve(spherical_cap(0.2, alpha=0.6)).surface, Profile.circle(0.005)
    rim = Member(circle([0, 0], 1.0), wire, STEEL, propped=True, name="rim")
    model = model_of(cap, members=[rim], anyway=True)
    rings = members_at_rest(model)
    table, _ = member_tables([("rest", rings)])
    assert 0.01 < table["buckling"][0] < 0.1
    [line] = [line for line in weak_members(model, [("rest", rings)], Units()) if "buckles" in line]
    assert line.startswith("rest: rim buckles at ")
    factor = float(line.split("; ")[1].split(" times")[0])
    assert factor == pytest.approx(1.0 / table["buckling"][0], rel=0.05)
    stiff = replace(rim, profile=wire.scaled(1.01 * factor))
    assert 1.0 < members_at_rest(model_of(cap, members=[stiff], anyway=True))[0].buckling < 1.1


def sail_with_hole():
    """A flat film with a round hole, held at both edges."""
    return Plan(
        [[-3, -3], [3, -3], [3, 3], [-3, 3]],
        holes=[circle([0, 0], 1.0)],
        edge_length=0.5,
        tension=2.0,
        pressure=0.0,
    ).surface()


@needs_ccx
def test_a_ring_around_a_hole_is_in_tension():
    """N = α R, at rest and in CalculiX, where it is stiff."""
    model = model_of(sail_with_hole(), members=[Member(circle([0, 0], 1.0), TUBE, STEEL)], anyway=True)
    [ring] = members_at_rest(model)
    N, share = ring.balance
    assert pytest.approx(2.0 * np.cos(np.pi / len(ring.points))) == N
    assert share < 1e-9
    analysis = analyse(model)
    assert analysis.members.loc[0, ["least_N", "largest_N"]].tolist() == pytest.approx([2.0, 2.0], rel=0.05)
    assert analysis.members["moved"][0] < 1e-4


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
def test_the_chapter_of_a_report_has_sections_and_forces_of_members():
    blocks = list(under_load_chapter(hall_under_load(), Units("m", "kN")))
    tables = {block.title: block for block in blocks if isinstance(block, Table)}
    [arch] = tables["Members"].rows
    assert arch == ["wall 1", "wall 1", "tube 0.1 × 0.005", "0.001492", "1.688e-06", "1.688e-06", "2.1e+08"]
    assert [row[:2] for row in tables["Forces of members"].rows] == [
        [case, "wall 1"] for case in ("form pressure", "self-weight", "snow")
    ]
    assert "M, kN·m" in tables["Forces of members"].head
    assert any(isinstance(block, str) and block.startswith("wall 1: at rest N = ") for block in blocks)
    assert sum(isinstance(block, Picture) for block in blocks) == 3


@needs_ccx
def test_the_picture_of_forces_has_a_column_per_member_and_refuses_a_wrong_name():
    """A straight edge bends in the plane of its sheet: what is across is dashed."""
    edges = [Member(polyline([[0, y], [1, y]]), TUBE, STEEL, name=f"edge {y}") for y in (0, 1)]
    both = analyse(model_of(square(8, tension=2.0), members=edges, anyway=True))
    one, two = member_forces(both, members=("edge 0",), width=400), member_forces(both, width=800)
    assert one.shape[1] == two.shape[1] // 2
    assert one.shape[0] == two.shape[0]
    inked = [(picture.min(axis=2) < 100).sum() for picture in (one, two)]
    assert inked[1] > 1.5 * inked[0]
    with refused(OptionError, what="members", found="edge 2"):
        member_forces(both, members=("edge 2",))
    with refused(OptionError, what="cases", found="wind"):
        member_forces(both, cases=("wind",))
    with refused(OptionError, what="analysis"):
        member_forces(analyse(model_of(square(4, tension=2.0), anyway=True)))


@pytest.mark.parametrize("of", [{}, {"scale": 0.05, "east": 0.15}], ids=["even", "wall under pressure"])
def test_a_cable_in_the_place_of_a_wall_has_the_tension_that_balances_best(of):
    model = hall_with(Member("wall 1", Profile(1e-4, 1e-9), STEEL, kind="cable"), hall(**of))
    [cable], [beam] = model.standing.cables, members_at_rest(hall_with(of=hall(**of)))
    assert cable.name == "wall 1"
    assert cable.tension == pytest.approx(beam.balance[0], rel=1e-4)
    assert model.cable_sections[0] == (1e-4, STEEL)
    assert not model.beams


@pytest.mark.parametrize("closed", [False, True])
def test_a_taut_line_pulls_its_ends_as_it_pulls_the_points_between(closed):
    """The forces of one tension add up to nothing, and have no moment."""
    P = np.random.default_rng(0).normal(size=(6, 3))
    forces = turns(P, closed)
    np.testing.assert_allclose([forces.sum(axis=0), np.cross(P, forces).sum(axis=0)], 0.0, atol=1e-12)


def test_a_member_that_cannot_be_is_refused_in_a_line():
    def lines(surface, member):
        return model_of(surface, members=[member], anyway=True).lines

    cap = spherical_cap(0.2, alpha=0.6)
    with refused(OptionError, what="members", found="wall 2"):
        hall_with(Member("wall 2", TUBE, STEEL))
    with refused(OptionError, what="members", found="west"):
        hall_with(Member("west", TUBE, STEEL))
    with refused(OptionError, what="members", where="wall 1"):  # its junction rests, but for a third of it
        hall_with(of=hall(wall=1.4))
    with refused(OptionError, what="members", where="member"):
        lines(cap, Member(polyline([[5, 5], [6, 6]]), TUBE, STEEL))
    with refused(OptionError, what="Member.propped"):
        Member("wall 1", TUBE, STEEL, propped=True)
    with refused(OptionError, what="Member.material"):
        Member("wall 1", TUBE, Material(1e5, weft=1e5, shear=1e4))
    with refused(OptionError, what="Member.profile"):
        Member("wall 1", 0.3, STEEL)
    with refused(OptionError, what="Profile.area"):
        Profile(0.0, 1.0)
    with refused(OptionError, what="Profile.thickness"):
        Profile.tube(0.1, 0.06)
    with refused(OptionError, what="members", where="wall 1"):
        StructuralModel(hall(), FABRIC, 1e-3, members=[Member("wall 1", TUBE, STEEL)] * 2)
    with refused(OptionError, what="members"):
        StructuralModel(hall(), FABRIC, 1e-3, members=["wall 1"])
    crossing = [[[4, 0], [4, 4]], [[0, 2], [8, 2]]]
    bays = Plan([[0, 0], [8, 0], [8, 4], [0, 4]], crossing, edge_length=0.8, tension=2.0).surface()
    with refused(OptionError, what="members", where="wall 1"):
        lines(bays, Member("wall 1", TUBE, STEEL))
    assert (
        len(model_of(bays, members=[Member(w, TUBE, STEEL) for w in ("wall 1", "wall 2")], anyway=True).lines)
        == 2
    )


def test_members_of_a_project_are_refused_in_a_line():
    """Without a section, on a divider without a wall, on a free hole, of a name that is not there."""
    area = [[0, 0], [4, 0], [4, 2], [0, 2]]

    def members(table, **divider):
        line = {"curve": [[2, 0], [2, 2]], "member": "arch", **divider}
        return members_of({"arch": table}, Plan(area, [line], tension=2.0))

    good = {"young": 2.1e8, "diameter": 0.1, "thickness": 0.005}
    assert [m.on for m in members(good)] == ["wall 1"]
    with refused(OptionError, what="structure.members", where="arch"):
        members({"young": 2.1e8})
    with refused(OptionError, what="structure.members", where="arch"):
        members({"diameter": 0.1})
    with refused(OptionError, what="area"):
        members({"young": 2.1e8, "area": 0.0, "upright": 1.0})
    with refused(OptionError, where="depth"):
        members({"young": 2.1e8, "depth": 1.0})
    with refused(OptionError, what="member", found="truss"):
        members(good, member="truss")
    with refused(OptionError, what="member"):
        members(good, wall=False)
    hole = {"curve": circle([2, 1], 0.4), "edge": "free", "member": "arch"}
    with refused(OptionError, what="member"):
        members_of({"arch": good}, Plan(area, holes=[hole], tension=2.0))


@needs_ccx
def test_a_member_that_is_too_weak_is_told_with_the_stiffness_that_is_enough():
    """A wire in the place of an arch moves beyond span/300; an edge so soft that the film spans in its place.
    Each is named; with the stiffness that the line gives, neither is."""

    def weak(analysis):
        return [line for line in analysis.answers() if "too weak" in line]

    def factor(line):
        return float(line.split("it would need ")[1].split(" times")[0])

    arch = Member("wall 1", Profile.tube(0.005, 0.0005), STEEL)
    [told] = weak(analyse(hall_with(arch), remedy=False))
    [rest] = members_at_rest(hall_with(arch))
    assert told.startswith("wall 1 is too weak: under form pressure it moves 0.0")
    assert factor(told) == pytest.approx(300.0 * rest.deflection / rest.span, rel=0.01)
    assert weak(analyse(hall_with(replace(arch, profile=arch.profile.scaled(factor(told)))))) == []

    edge = Member(polyline([[0, 1], [1, 1]]), Profile.tube(0.06, 0.005), Material(2.1e6), name="edge")
    [told] = weak(analyse(model_of(square(8, tension=2.0), members=[edge], anyway=True)))
    assert int(told.split("the sheets carry ")[1].split(" %")[0]) > 50
    stiff = replace(edge, profile=edge.profile.scaled(factor(told)))
    assert weak(analyse(model_of(square(8, tension=2.0), members=[stiff], anyway=True))) == []


def test_what_sheets_carry_of_the_pull_of_a_weak_member_is_a_percentage():
    """A beam under load with a quarter of its pull at rest: the sheets carry the other three."""
    model = hall_with(Member("wall 1", Profile.tube(0.005, 0.0005), STEEL))
    rest = members_at_rest(model)
    case = tuple(replace(beam, pulls=0.25 * beam.pulls) for beam in rest)
    [line] = [line for line in weak_members(model, [("snow", case)], Units()) if "too weak" in line]
    assert "at rest the sheets carry 75 % of what it should" in line


def test_a_sentence_has_the_force_that_is_largest_in_size_and_what_it_leaves():
    """In tension below 1 along an arch, with its share of bending; in compression along a rim."""
    arch = hall_with(of=hall(scale=0.05))
    rim = model_of(
        spherical_cap(0.4, alpha=0.6, exact=True),
        members=[Member(circle([0, 0], 1.0), TUBE, STEEL, propped=True)],
        anyway=True,
    )
    for model, sign in ((arch, 1.0), (rim, -1.0)):
        [text], [beam] = sentences(model, Units("m", "kN")), members_at_rest(model)
        N = max(beam.within[:, 0], key=abs)
        assert N * sign > 0.0
        assert f": at rest N = {N:.3g} kN, M up to {beam.largest['M']:.3g} kN·m" in text
        assert "thrust" not in text
    share = members_at_rest(arch)[0].balance[1]
    assert f"would leave {100.0 * share:.0f} % of the sheets' pull" in sentences(arch, Units())[0]


@pytest.mark.parametrize(("ends", "shown"), [((-3.0, 1.0), "-3"), ((-1.0, 3.0), "3")])
def test_a_sentence_shows_a_thrust_that_is_larger_than_the_pull(monkeypatch, ends, shown):
    [beam] = members_at_rest(hall_with())
    within = beam.within.copy()
    within[:, 0] = np.linspace(*ends, len(within))
    turned = [replace(beam, within=within)]
    monkeypatch.setattr("pcmc.structure.member_forces.members_at_rest", lambda model: turned)
    [text] = sentences(hall_with(), Units("m", "kN"))
    assert text.startswith(f"wall 1: at rest N = {shown} kN, ")


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
