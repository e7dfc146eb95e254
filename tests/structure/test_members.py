"""Beams, cables and rings of a structural model: what the sheets pull them with, and what CalculiX finds."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hall_with_members import STEEL, TUBE, hall_with
from nightly import at_night
from programs import expect_ccx, needs_ccx
from starts import spherical_cap
from structures import model_of, scaled, square

import pcmc
from pcmc import Circle, Material, SelfWeight, Snow
from pcmc.base.errors import OptionError
from pcmc.base.units import Units
from pcmc.io.mesh_data import scaled_surface
from pcmc.plan import Divider, Plan, circle, polyline
from pcmc.structure import Member, Profile, analyse
from pcmc.structure.frames import turns
from pcmc.structure.inp import PIECES, text_of
from pcmc.structure.member_forces import (
    held_turns,
    member_tables,
    members_at_rest,
    weak_members,
)


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


@needs_ccx
@pytest.mark.parametrize("edges", [2, 3])
def test_the_program_bends_a_clamped_beam_of_few_edges_as_the_frame_does(edges):
    """Of two edges, each with one curvature, it moved by the shear alone, a hundredth of what is right."""
    bar = Member(polyline([[0, 1], [1, 1]]), Profile.rectangle(0.03, 0.03), Material(2.1e11), ends="clamped")
    model = model_of(square(edges, tension=2.0), members=[bar], anyway=True)
    [alone], [within] = members_at_rest(model), analyse(model, remedy=False).cases[0].members
    assert within.deflection == pytest.approx(alone.deflection, rel=0.07)


@needs_ccx
def test_a_straight_beam_between_fixed_points_has_the_force_of_its_elongation():
    """As it bends it lengthens, and held ends make a cable of it. Taken as an arch that was there from the
    start, it had twice the force."""
    bar = Member(polyline([[0, 1], [1, 1]]), Profile.rectangle(0.05, 0.05), Material(3e6))
    model = model_of(square(8, tension=2.0), members=[bar], material=Material(1e3), anyway=True)
    [beam] = analyse(model, remedy=False).cases[0].members
    moved = beam.points + beam.displacements
    stretch = np.linalg.norm(np.diff(moved, axis=0), axis=1).sum() - 1.0
    assert beam.within[:, 0].mean() == pytest.approx(0.05**2 * 3e6 * stretch, rel=0.02)


@pytest.mark.parametrize("ends", ["hinged", "clamped"])
def test_a_beam_whose_end_slides_along_it_bends_as_one_with_both_ends_held(ends):
    """On a circle that touches its line, the end neither leaves the line nor turns about it. A clamped end
    that slides was a hinge without a word."""
    film = square(8, tension=2.0).retensioned(None, {"film": 1.0})
    end = np.arange(film.n) == film.n - 1
    slides = {Circle((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0): end}
    edge = Member(polyline([[0, 1], [1, 1]]), TUBE, STEEL, ends=ends)
    models = [
        model_of(surface, members=[edge], anyway=True)
        for surface in (film, film.rebuilt(fixed=film.fixed & ~end, on_line=slides))
    ]
    (held,), (rolls,) = map(members_at_rest, models)
    assert rolls.within[:, 1:] == pytest.approx(held.within[:, 1:], abs=1e-9)
    assert rolls.displacements[:, 1:] == pytest.approx(held.displacements[:, 1:], abs=1e-12)
    expect_ccx()
    moments = [analyse(model, remedy=False).members["M"][0] for model in models]
    assert moments[1] == pytest.approx(moments[0], rel=1e-3)


@pytest.mark.parametrize("program", [False, pytest.param(True, marks=needs_ccx)])
def test_hinged_beams_that_meet_at_a_corner_bend_as_each_alone(program):
    """Rigidly joined, the twist that the one holds would clamp the other."""
    corners = [[0, 0], [6, 0], [6, 4], [0, 4]]
    roof = pcmc.solve(Plan(corners, edge_length=1.0, tension=4.0).surface()).surface
    edges = [
        Member(polyline([corners[k - 1], corners[k]]), TUBE, Material(2.1e10), name=f"edge {k}")
        for k in range(4)
    ]

    def found(members):
        model = model_of(roof, members=members)
        return analyse(model, remedy=False).cases[0].members if program else members_at_rest(model)

    for alone, beside in zip((found([edge])[0] for edge in edges), found(edges), strict=True):
        assert beside.deflection == pytest.approx(alone.deflection, rel=0.01)
        assert np.abs(beside.within[[0, -1], 4:]).max() < 1e-6 * np.abs(beside.within[:, 4:]).max()
    model = model_of(roof, members=edges)
    nodes, places = model.member_nodes
    assert len(nodes) == sum(map(len, places)) == len(np.unique(nodes)) + 4


def test_a_hinge_of_a_curved_beam_holds_its_twist_about_the_tangent_with_order_two():
    off = []
    for n in (8, 16, 32):
        angle = np.linspace(-1.0, 1.0, n + 1)
        arc = np.stack([np.sin(angle), np.cos(angle), 0.0 * angle], axis=1)
        fan = [[n + 1, k + 1, k] for k in range(n)]
        film = pcmc.Surface(
            [*arc, [0, 0, 0]], fan, [0] * n, [pcmc.Patch("film", 2.0, 0.0)], fixed=range(n + 2)
        )
        model = model_of(film, members=[Member(polyline(arc.tolist()), TUBE, STEEL)], anyway=True)
        held = held_turns(model, film.vertices)
        assert set(held) == {0, n}
        assert [len(turns) for turns in held.values()] == [1, 1]
        off.append(abs(held[0][0] @ [np.sin(-1.0), np.cos(-1.0), 0.0]))
    assert off[-1] < 1e-3
    assert np.polyfit(np.log([8, 16, 32]), np.log(off), 1)[0] < -1.9


def test_a_hinge_beside_a_corner_holds_the_twist_about_its_own_bar():
    film = square(4, tension=2.0)
    bent = Member(polyline([[0, 0.25], [0, 0], [1, 0]]), TUBE, STEEL)
    held = held_turns(model_of(film, members=[bent], anyway=True), film.vertices)
    about = {tuple(film.vertices[v, :2].tolist()): abs(turns[0]) for v, turns in held.items()}
    assert about == {(0.0, 0.25): pytest.approx([0.0, 1.0, 0.0]), (1.0, 0.0): pytest.approx([1.0, 0.0, 0.0])}


def test_shells_with_a_cable_that_meets_a_beam_are_refused():
    """The program makes a hinge of the node that both have: the beam moved 900 times as far."""
    corners = [[0, 0], [6, 0], [6, 4], [0, 4]]
    ridge = Divider([[3, 0], [3, 4]], wall=False, cable=1.0)
    roof = Plan(corners, [ridge], edge_length=1.0, tension=4.0).surface()
    edge = Member(polyline(corners[:2]), TUBE, STEEL)
    with pytest.raises(OptionError, match=r"^elements: in shells a cable would be a hinge of 'member'"):
        model_of(roof, members=[edge], cable_area=1e-3, elements="shell", anyway=True)


@needs_ccx
@pytest.mark.parametrize("ends", ["hinged", "clamped"])
def test_the_program_holds_the_turns_of_a_curved_beam_where_a_cable_ends_too(ends):
    angle = np.linspace(0.15, 0.85, 15) * np.pi
    arc = 5.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    outline = [*arc.tolist(), [arc[-1, 0], 0.0], [arc[0, 0], 0.0]]
    ridge = Divider([outline[0], outline[-2]], wall=False, cable=1.0)
    roof = pcmc.solve(Plan(outline, [ridge], edge_length=1.0, tension=4.0).surface()).surface
    bow = Member(polyline(arc.tolist()), Profile.tube(0.3, 0.02), Material(2.1e10), ends=ends)
    model = model_of(roof, members=[bow], cable_area=1e-3)
    [alone], [within] = members_at_rest(model), analyse(model, remedy=False).cases[0].members
    assert within.deflection == pytest.approx(alone.deflection, rel=0.03)


@needs_ccx
@pytest.mark.parametrize("profile", [Profile.tube(0.3, 0.02), Profile(0.08, 1.07e-3, 2.67e-4)])
def test_the_program_lets_a_curved_beam_bend_at_its_hinges_as_the_frame_does(profile):
    """A bow over 126 degrees, which its sheet lifts: it twists as much as it bends. (Of a section that is not
    round the program's torsion is 2 to 7 % stiffer than 4 I I'/(I + I').)"""
    angle = np.linspace(0.15, 0.85, 15) * np.pi
    arc = 5.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    outline = [*arc.tolist(), [arc[-1, 0], 0.0], [arc[0, 0], 0.0]]
    roof = pcmc.solve(Plan(outline, edge_length=1.0, tension=4.0).surface())
    bow = Member(polyline(arc.tolist()), profile, Material(2.1e10))
    model = model_of(roof.surface, members=[bow])
    [alone], [within] = members_at_rest(model), analyse(model, remedy=False).cases[0].members
    assert within.deflection == pytest.approx(alone.deflection, rel=0.01 if profile.shape else 0.06)


def test_beams_have_nodes_of_their_own_tied_to_the_vertices_where_these_are(tmp_path):
    model = hall_with()
    pcmc.write_structure(tmp_path / "hall.inp", model)
    text = (tmp_path / "hall.inp").read_text()
    [line] = model.beams
    part = re.search(r"^\*NODE, NSET=MEMBERS\n(.*?)^\*", text, re.M | re.S)[1]
    nodes = {int(row[0]): row[1:] for row in np.loadtxt(part.splitlines(), delimiter=",").tolist()}
    assert len(nodes) == len(np.unique(line.pairs))
    blocks = re.findall(r"^\*ELEMENT.*\n([^*]*)", text, re.M)
    numbers = [row.split(",")[0] for rows in blocks for row in rows.split()]
    assert len(numbers) == len(set(numbers)) == len(model.faces) + PIECES * len(line.pairs)
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
    stiff = replace(rim, profile=scaled(wire, 1.01 * factor))
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
    assert ring.largest["M"] == ring.largest["V"] == 0.0  # no rounding is shown as a moment
    analysis = analyse(model)
    assert analysis.members.loc[0, ["least_N", "largest_N"]].tolist() == pytest.approx([2.0, 2.0], rel=0.05)
    assert analysis.members["moved"][0] < 1e-4


@cache
def roof_with_ring():
    """Two bays with a wall and an opening; in metres and kilonewtons."""
    bays = {name: {"tension": 1.5, "pressure": 0.3} for name in ("west", "east")}
    line, opening = {"curve": [[6, 0], [6, 8]], "wall": 0.6}, circle([3, 4], 1.2)
    plan = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], [line], [opening], edge_length=1.2, patches=bays)
    return pcmc.solve(plan.surface()).surface


def ring_and_arch(metre, density=0.0):
    """The same roof with a ring and an arch; one metre is ``metre`` units of length."""
    per_area = metre**-2
    ring_profile, tube = Profile.rectangle(0.1 * metre, 0.2 * metre), Profile.tube(0.1 * metre, 0.005 * metre)
    steel = Material(2.1e8 * per_area, 0.2, density * metre**-4)
    members = [Member(circle([3 * metre, 4 * metre], 1.2 * metre), ring_profile, steel)]
    members += [Member("wall 1", tube, steel)]
    cloth = Material(5e5 * per_area, density=density * metre**-4, weft=4e5 * per_area, shear=2e4 * per_area)
    loads = [SelfWeight(9.81 * metre)] * bool(density) + [Snow(0.15 * per_area)]
    surface = scaled_surface(roof_with_ring(), metre)
    return model_of(surface, material=cloth, thickness=0.001 * metre, loads=loads, members=members)


@needs_ccx
@pytest.mark.parametrize("metres", [[1000.0], *at_night([1.0, 1000.0])], ids=["carried", "alike"])
def test_the_program_finds_in_mm_what_it_finds_in_m(metres):
    """Where beams meet it compares terms of 1/length with fixed numbers; in mm it stopped at 71 % here."""
    found = []
    for metre in metres:
        analysis = analyse(ring_and_arch(metre), remedy=False)
        assert analysis.carried
        lengths = analysis.table[["down", "up"]].to_numpy().ravel() / metre
        forces = [*analysis.members["largest_N"], *analysis.table["largest_force"] * metre]
        found.append([*lengths, *forces])
    np.testing.assert_allclose(found[-1], found[0], rtol=1e-5, atol=1e-8)


def test_a_file_in_another_unit_has_the_numbers_of_a_model_in_that_unit():
    numbers = [
        np.array(
            re.findall(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?", text_of(model, model.steps, unit=unit)), dtype=float
        )
        for model, unit in ((ring_and_arch(1.0, 1.2), 1.0), (ring_and_arch(1000.0, 1.2), 1000.0))
    ]
    np.testing.assert_allclose(numbers[1], numbers[0], rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("closed", [False, True])
def test_a_taut_line_pulls_its_ends_as_it_pulls_the_points_between(closed):
    """The forces of one tension add up to nothing, and have no moment."""
    P = np.random.default_rng(0).normal(size=(6, 3))
    forces = turns(P, closed)
    np.testing.assert_allclose([forces.sum(axis=0), np.cross(P, forces).sum(axis=0)], 0.0, atol=1e-12)
