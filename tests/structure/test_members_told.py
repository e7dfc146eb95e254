"""What pcmc says of members: in the report, in a picture and in sentences, and where one is too weak."""

from dataclasses import replace

import numpy as np
import pytest
from hall_with_members import STEEL, TUBE, hall, hall_under_load, hall_with
from programs import needs_ccx
from refusals import refused
from starts import spherical_cap
from structures import FABRIC, model_of, scaled, square

from pcmc import Material, StructuralModel, solve
from pcmc.base.errors import OptionError
from pcmc.base.units import Units
from pcmc.plan import Plan, circle, polyline
from pcmc.plot import member_forces
from pcmc.report.chapters import under_load_chapter
from pcmc.report.tables import Picture, Table
from pcmc.structure import Member, Profile, analyse
from pcmc.structure.inp import text_of
from pcmc.structure.member_forces import (
    cable_notes,
    members_at_rest,
    sentences,
    weak_members,
)
from pcmc.structure.section import members_of
from pcmc.surface.geometry import segment_lengths


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


def test_equal_beams_share_a_line():
    edges = [Member(polyline([[x, 0], [x, 1]]), TUBE, STEEL, name=f"edge {x}") for x in (0, 1)]
    told = sentences(model_of(square(8, tension=2.0), members=edges, anyway=True), Units("m", "kN"))
    assert len(told) == 1
    assert told[0].startswith("edge 0, edge 1: at rest N = ")


@pytest.mark.parametrize("sizes", [(0.2, 0.2), (0.1, 0.2)])
def test_a_beam_that_stands_needs_a_section_alike_all_round(sizes):
    """The height of another one lay along an axis of space: it did not turn with the roof."""
    flat = square(4, tension=2.0)
    film = flat.moved(flat.vertices @ [[1.0, 0, 0], [0, 0, 1.0], [0, 0, 0]])
    edge = Member(polyline([[0, 0, 0], [0, 0, 1]]), Profile.rectangle(*sizes), STEEL, name="edge")
    if sizes[0] == sizes[1]:
        assert len(model_of(film, members=[edge], anyway=True).lines) == 1
        return
    with refused(OptionError, what="members", where="edge") as caught:
        model_of(film, members=[edge], anyway=True)
    assert "stands upright" in str(caught.value)


def test_beams_and_columns_of_one_name_have_numbers():
    """Tables had several under one name, and a file the force of the last one on all of them."""
    film, steel = square(8, tension=2.0), (TUBE, STEEL)
    ends = [
        Member(polyline(line), *steel, name="edge") for line in ([[0, 0], [1, 0]], [[0, 0.25], [0, 0.75]])
    ]
    column = Member([[0, 0], [0, 0, -1]], *steel, name="edge")
    model = model_of(film, members=[*ends, column], anyway=True)
    assert [line.name for line in (*model.lines, *model.bars)] == ["edge-1", "edge-2", "edge-3"]
    assert "** MEMBER_1: edge-1\n** MEMBER_2: edge-2\n" in text_of(model, model.steps).partition("*NODE")[0]


@pytest.mark.parametrize("profile", [TUBE, Profile(5.38e-3, 8.36e-5, 6.04e-6)], ids=["tube", "I"])
def test_the_torsion_constant_of_a_section_without_a_shape_is_told(profile):
    """4 I I'/(I + I') = 2.25e-5 m⁴; that of an IPE 300 is 2.0e-7: a bow twists a hundred times as much."""
    edge = Member(polyline([[0, 0], [0, 1]]), profile, STEEL)
    [told] = sentences(model_of(square(4, tension=2.0), members=[edge], anyway=True), Units("m", "kN"))
    assert ("torsion constant is taken as 2.25e-05 m⁴, an ellipse's" in told) == (not profile.shape)


@needs_ccx
def test_the_diagram_of_a_ring_comes_back_to_where_it_begins(monkeypatch):
    rim = Member(circle([0, 0], 1.0), TUBE, STEEL, propped=True, name="rim")
    cap = solve(spherical_cap(0.4, alpha=0.6)).surface
    monkeypatch.setattr("pcmc.plot.uses.finish", lambda figure, path: figure)
    figure = member_forces(analyse(model_of(cap, members=[rim], anyway=True)), width=400)
    around = segment_lengths(cap.vertices, cap.topology.edges[cap.topology.boundary_edge]).sum()
    for axes in figure.axes:
        s, force = axes.lines[1].get_data()
        assert (s[0], s[-1]) == pytest.approx((0.0, around))
        assert force[0] == force[-1]


def test_a_beam_on_a_cable_is_told_to_be_a_rope():
    """A cable does not bend; without a word the beam had its area alone."""
    beam, rope = (
        model_of(square(cable=3.0), members=[Member("tie", TUBE, STEEL, kind)], anyway=True)
        for kind in ("beam", "cable")
    )
    assert cable_notes(rope) == []
    assert cable_notes(beam) == [
        'the members on the cables "tie" count as their sections: cables do not bend'
    ]


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
    with refused(OptionError, what="members", where="tie"):  # the last one counted
        model_of(square(cable=3.0), members=[Member("tie", TUBE, STEEL, "cable")] * 2, anyway=True)
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
    assert weak(analyse(hall_with(replace(arch, profile=scaled(arch.profile, factor(told)))))) == []

    edge = Member(polyline([[0, 1], [1, 1]]), Profile.tube(0.06, 0.005), Material(2.1e6), name="edge")
    [told] = weak(analyse(model_of(square(8, tension=2.0), members=[edge], anyway=True)))
    assert int(told.split("the sheets carry ")[1].split(" %")[0]) > 50
    stiff = replace(edge, profile=scaled(edge.profile, factor(told)))
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


def test_a_ring_that_only_sheets_hold_upright_wants_props_and_no_stiffness():
    """The sheets of a cap pull its rim down with the load on the disc, however stiff the rim is."""
    cap = spherical_cap(0.4, alpha=0.6, exact=True)
    for propped in (False, True):
        for profile in (TUBE, scaled(TUBE, 1e3)):
            rim = Member(circle([0, 0], 1.0), profile, STEEL, propped=propped, name="rim")
            model = model_of(cap, members=[rim], anyway=True)
            [text] = sentences(model, Units("m", "kN"))
            lines = [text, *weak_members(model, [("snow", members_at_rest(model))], Units("m", "kN"))]
            told = [line for line in lines if "nothing but the sheets holds rim upright" in line]
            assert len(told) == (0 if propped else 2)
            assert all("propped = true" in line and "too weak" not in line for line in told)
            assert ("times its E A" in text) == propped
