"""Columns and stays: statics at the points that hold a sail, Euler's load, and what cannot be."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from programs import needs_ccx
from refusals import refused
from structures import model_of

import pcmc
from generators import joined_caps
from pcmc import Material, StructuralModel
from pcmc.base.errors import OptionError
from pcmc.base.units import Units
from pcmc.plan import Plan, polyline
from pcmc.report.chapters import at_rest_chapter, under_load_chapter
from pcmc.report.tables import Table
from pcmc.structure import Member, Profile, analyse
from pcmc.structure.columns import column_answers, column_table, column_text, columns_at_rest
from pcmc.structure.member_forces import members_at_rest
from pcmc.structure.section import check_members, members_of

TUBE, STEEL = Profile.tube(0.1143, 0.005), Material(2.1e8, density=7.85)
ROPE, NONE = Profile(3e-4, 1e-9), Units()
CORNERS = [[0, 0, 4], [10, 0, 0], [10, 10, 4], [0, 10, 0]]


@cache
def sail():
    """A sail on four points, two of them high."""
    edges = {"edge": "cable", "cable": 9.0, "supports": CORNERS}
    plan = Plan([p[:2] for p in CORNERS], **edges, tension=1.0, pressure=0.0, edge_length=2.0)
    return pcmc.solve(plan.surface())


def column(top, foot, **more):
    return Member([top, foot], TUBE, STEEL, name="mast", **more)


def stay(top, anchor, **more):
    return Member([top, anchor], ROPE, STEEL, "cable", name="stay", **more)


def sail_on(*members):
    return StructuralModel(sail(), Material(5e5), 1e-3, cable_area=1e-4, members=members)


def test_a_mast_with_two_stays_has_the_forces_of_the_closed_form():
    """Stays alike on both sides of the diagonal: T = H L over their reach in plan; the mast has the rest."""
    model = sail_on(column([0, 0], [0, 0], strength=2.35e5), stay([0, 0], [-3, -1]), stay([0, 0], [-1, -3]))
    reaction = sail().certificate.reactions[model.bars[0].vertices[0]]
    H, V = np.hypot(*reaction[:2]), reaction[2]
    table = columns_at_rest(model)
    length, reach = np.sqrt(26.0), 4.0 * np.sqrt(2.0)  # both stays together pull along the diagonal
    T = H * length / reach
    expected = [-V - 2.0 * T * 4.0 / length, T, T]
    assert table["N"].to_numpy() == pytest.approx(expected, rel=1e-3)
    assert table["kind"].tolist() == ["column", "stay", "stay"]
    assert table["member"].tolist() == ["mast", "stay-1", "stay-2"]
    assert np.abs(table[["left_x", "left_y", "left_z"]].to_numpy()).max() < 1e-9
    directions = np.array([bar.direction for bar in model.bars])
    np.testing.assert_allclose(table["N"] @ directions, reaction, atol=1e-9)
    euler = np.pi**2 * 2.1e8 * TUBE.upright / 4.0**2
    assert table["euler"][0] == pytest.approx(euler)
    assert table["euler_over"][0] == pytest.approx(euler / -table["N"][0])
    assert table["utilisation"][0] == pytest.approx(-table["N"][0] / TUBE.area / 2.35e5)
    assert table.loc[1:, ["utilisation", "euler", "euler_over"]].isna().all(axis=None)
    assert column_answers(model, table, NONE) == []


def test_columns_in_the_direction_of_the_reactions_carry_all_loads():
    """With feet where the answers say, nothing is left, and their forces balance those on the sail."""
    upright = sail_on(column([0, 0], [0, 0]), column([10, 10], [10, 10]))
    table = columns_at_rest(upright)
    answers = column_answers(upright, table, NONE)
    assert len(answers) == 2
    R = [sail().certificate.reactions[bar.vertices[0]] for bar in upright.bars]
    for bar, force, answer in zip(upright.bars, R, answers, strict=True):
        foot = bar.points[0] - bar.points[0][2] / force[2] * force
        x, y = (float(f"{c:.3g}") for c in foot[:2])
        assert f"with its foot at ({x:g}, {y:g}) it would carry all" in answer
    places = [bar.points[0] - bar.points[0][2] / f[2] * f for bar, f in zip(upright.bars, R, strict=True)]
    leaning = sail_on(*(column(c[:2], list(p)) for c, p in zip(CORNERS[::2], places, strict=True)))
    table = columns_at_rest(leaning)
    assert np.abs(table[["left_x", "left_y", "left_z"]].to_numpy()).max() < 1e-9
    assert column_answers(leaning, table, NONE) == []
    others = sail().certificate.reactions.sum(axis=0) - sum(R)
    carried = sum(N * bar.direction for N, bar in zip(table["N"], leaning.bars, strict=True))
    loads = sail().certificate.acting.loads.sum(axis=0)
    np.testing.assert_allclose(carried + others + loads, 0.0, atol=1e-9)


def test_a_case_with_other_reactions_has_its_own_rows():
    model = sail_on(column([0, 0], [-1, -1]))
    R = sail().certificate.reactions
    table = column_table(model, [("one", R), ("two", 2.0 * R)])
    assert table["N"][1] == pytest.approx(2.0 * table["N"][0])
    assert table["case"].tolist() == ["one", "two"]
    assert column_text(model, table, NONE).splitlines()[-1].startswith("two: across mast ")


def test_a_stay_that_would_be_pressed_is_left_out_and_the_others_solved_again():
    """With stays along (-1, ∓1, -1) a force (-1, y, 5) needs tensions in the ratio 1 - y to 1 + y: beyond
    y = 1 the first is slack, and the second, T/√3 = (1 + y)/2, is of least squares across the mast."""
    model = sail_on(column([0, 0], [0, 0]), stay([0, 0], [-4, -4]), stay([0, 0], [-4, 4]))
    cases = []
    for name, y in (("calm", 0.5), ("gust", 3.0)):
        reactions = np.zeros((len(sail().surface.vertices), 3))
        reactions[model.bars[0].vertices[0]] = -1.0, y, 5.0
        cases.append((name, reactions))
    table = column_table(model, cases)
    root = np.sqrt(3.0)
    assert table["N"].to_numpy() == pytest.approx([-6.0, root / 4, 3 * root / 4, -7.0, 0.0, 2.0 * root])
    assert table["slack"].tolist() == [False] * 4 + [True, False]
    np.testing.assert_allclose(table[["left_x", "left_y", "left_z"]][3:], [[1.0, 1.0, 0.0]] * 3, atol=1e-12)
    lines = column_answers(model, table, NONE)
    assert lines[0] == "gust: stay-1 is slack and left out, as a stay can only pull"
    assert lines[1].startswith("gust: across mast and stay-1 and stay-2 1.41 are left, (1, 1);")


def test_the_report_has_the_forces_of_columns_where_no_load_cases_were_run():
    model = sail_on(column([0, 0], [0, 0]), stay([0, 0], [-3, -1]), stay([0, 0], [-1, -3]))
    blocks = list(at_rest_chapter(model, Units("m", "kN")))
    [table] = [block for block in blocks if isinstance(block, Table)]
    assert (table.title, len(table.rows)) == ("Forces of columns and stays", 3)
    assert table.rows[0][:3] == ["form pressure", "mast", "column"]
    assert any("no load cases were run" in block for block in blocks if isinstance(block, str))
    assert list(at_rest_chapter(sail_on(), Units("m", "kN"))) == []


@needs_ccx
def test_each_case_and_the_report_have_the_forces_of_columns():
    """By CalculiX at rest as by the certificate, and other ones under snow."""
    upright = sail_on(column([0, 0], [0, 0]), stay([0, 0], [-3, -3]))
    analysis = analyse(replace(upright, loads=[pcmc.Snow(0.1)], certificate=None))
    rest, form = columns_at_rest(upright), analysis.columns[:2]
    assert form["N"].to_numpy() == pytest.approx(rest["N"].to_numpy(), rel=1e-2)
    assert (analysis.columns["N"][2:].abs().to_numpy() > 1.05 * form["N"].abs().to_numpy()).all()
    assert "columns" in analysis.tables
    assert "euler_over" in str(analysis)
    tables = [block for block in under_load_chapter(analysis, Units("m", "kN")) if isinstance(block, Table)]
    [table] = [block for block in tables if block.title == "Forces of columns and stays"]
    assert table.rows[0][:4] == ["form pressure", "mast", "column", "tube 0.1143 × 0.005"]
    assert table.rows[1][3] == "A = 0.0003"


def test_what_gives_way_is_told():
    """A column that buckles, a stay that is pushed, a stress beyond the strength."""
    thin = Member([[0, 0], [0, 0]], Profile.circle(0.02), STEEL, name="mast")
    pushed = stay([10, 10], [5, 5, -4])
    model = sail_on(thin, stay([0, 0], [-3, -3], strength=1e4), pushed)
    lines = column_answers(model, columns_at_rest(model), Units("m", "kN"))
    N = columns_at_rest(model).set_index("member")["N"]
    factor = -N["mast"] / (np.pi**2 * 2.1e8 * np.pi * 0.02**4 / 64.0 / 16.0)
    assert any(f"it needs {factor:.2g} times its E I" in line for line in lines)
    assert any("stay-2 is slack and left out" in line and "move its anchor" in line for line in lines)
    used = N["stay-1"] / ROPE.area / 1e4
    assert any(f"stay-1 has {used:.2g} times the stress of its strength" in line for line in lines)


def test_a_column_under_the_end_of_a_beam_carries_what_the_beam_ends_with():
    """Two straight edges on columns: each end has half of the pull across the edge, α L / 2."""
    from structures import square

    edge = Member(polyline([[0, 1], [1, 1]]), TUBE, STEEL, name="edge")
    post = Member([[0, 1], [0, 1, -3]], TUBE, STEEL, name="post")
    model = model_of(square(8, tension=2.0), members=[edge, post], anyway=True)
    [row] = columns_at_rest(model).to_dict("records")
    [beam] = members_at_rest(model)
    assert abs(row["N"]) < 1e-9
    assert row["left_y"] == pytest.approx(abs(beam.within[0, 2]), rel=0.2)
    total = 2.0 * 1.0 / 2.0 + 2.0 / 16.0  # of the beam, and of half an edge of the sheet beside
    assert row["left_y"] == pytest.approx(total, rel=0.15)


def test_columns_and_stays_that_cannot_be_are_refused_in_a_line():
    with refused(OptionError, what="members", where="mast"):  # in the middle of the sail
        sail_on(column([5, 5], [5, 5]))
    with refused(OptionError, what="members", where="mast"):  # its foot is its head
        sail_on(column([10, 0], [10, 0, 0]))
    with refused(OptionError, what="members", where="mast"):  # a fourth bar
        sail_on(column([0, 0], [0, 0]), *(stay([0, 0], [x, y]) for x, y in ((-3, -1), (-1, -3), (-2, -2))))
    with refused(OptionError, what="members", where="mast"):  # two in one line
        sail_on(column([0, 0], [0, 0]), stay([0, 0], [0, 0, -1]))
    held = joined_caps(1.0, exact=True)  # held along its rim alone
    with refused(OptionError, what="members", where="mast"):
        model_of(held, members=[column([0, 0], [0, 0, -9])], anyway=True)
    tent = Plan(
        [[0, 0], [8, 0], [8, 8], [0, 8]], supports=[[4, 4, 2]], tension=1.0, pressure=0.0, edge_length=2.0
    )
    inside = tent.surface()
    assert len(model_of(inside, members=[column([4, 4], [4, 4])], anyway=True).bars) == 1
    with refused(OptionError, what="members", where="stay"):
        model_of(inside, members=[stay([4, 4], [0, 0])], anyway=True)
    half = Plan(
        [[0, 0], [5, 0], [5, 10], [0, 10]],
        edge="cable",
        cable=9.0,
        supports=[[5, 0, 4], [0, 0], [0, 10], [5, 10, 4]],
        mirrors=[[[5, 0], [5, 10]]],
        tension=1.0,
        pressure=0.0,
    ).surface()
    with refused(OptionError, what="members", where="mast"):
        model_of(half, members=[column([5, 0], [5, 0])], cable_area=1e-4, anyway=True)
    for on in ([[0, 0]], [[0, 0], [1, "a"]], 3, [[0, 0], [1, np.nan]]):
        with refused(OptionError, what="Member.on"):
            Member(on, TUBE, STEEL)


def test_columns_of_a_project_stand_at_points_of_the_plan():
    plan = Plan(
        [p[:2] for p in CORNERS],
        edge="cable",
        cable=9.0,
        supports=CORNERS,
        tension=1.0,
        pressure=0.0,
        points={"high": [0, 0]},
    )
    table = {"young": 2.1e8, "diameter": 0.1, "strength": 2e5, "bars": [["high", [0, 0, 0]]]}
    [mast] = members_of({"mast": table}, plan)
    assert (mast.two_points, mast.strength, mast.label) == (((0.0, 0.0), (0.0, 0.0, 0.0)), 2e5, "mast")
    with refused(OptionError, what="structure.members", where="mast"):
        members_of({"mast": table | {"bars": [["low", [0, 0]]]}}, plan)
    with refused(OptionError, what="structure.members", where="mast"):
        members_of({"mast": {"young": 2.1e8, "bars": table["bars"]}}, plan)
    with refused(OptionError, what="Member.on"):
        members_of({"mast": table | {"bars": [[0, 0]]}}, plan)


@pytest.mark.parametrize(("key", "value"), [("density", 7.85), ("ends", "clamped")])
def test_keys_that_count_for_nothing_on_a_column_are_refused(key, value):
    """Its weight is left out, and it has hinges: both were taken without a word."""
    mast = {"young": 2.1e8, "diameter": 0.1, "bars": [[[0, 0], [0, 0]]], key: value}
    arch = {**mast, "bars": []}
    plan = Plan([[0, 0], [9, 0], [9, 9]], [{"curve": [[3, 0], [3, 3]], "member": "arch"}], tension=1.0)
    with refused(OptionError, what=key, where="mast"):
        check_members({"arch": arch, "mast": mast}, plan)
    check_members({"arch": arch}, plan)
