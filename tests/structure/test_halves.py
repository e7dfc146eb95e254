"""Half of a roof between mirror planes is built as the whole is: under load, as cloth and in panels."""

import dataclasses
import warnings
from collections import Counter
from functools import cache

import numpy as np
import pytest
from programs import needs_ccx
from refusals import refused

import pcmc
from generators.grid import grid_faces
from pcmc import Cable, Material, Patch, Plane, SelfWeight, Snow, StructuralModel, Surface, Wind, cli
from pcmc.base.errors import LostWarning, OptionError
from pcmc.base.units import Units
from pcmc.drawings.views import model_curves
from pcmc.plan import Plan
from pcmc.project.members import warn_of_members
from pcmc.report.tables import cable_tables
from pcmc.report.words import verdict_sentences
from pcmc.structure import analyse
from pcmc.structure.section import Structure


@cache
def halves():
    """Half of a hall whose ridge is a cable in the mirror plane, and the whole."""
    outline, mirror = [[0, 0], [5, 0], [5, 6], [0, 6]], [[[5, 0], [5, 6]]]
    start = Plan(outline, mirrors=mirror, edge_length=1.0, tension=3.0, pressure=0.5).surface()
    ridge = start.topology.edges[start.mirror_edge]
    half = pcmc.solve(start.rebuilt(cables=[Cable("ridge", 3.0, ridge)])).surface
    return half, pcmc.mirrored(half)


@needs_ccx
def test_half_with_a_cable_in_its_mirror_carries_what_the_whole_does():
    half, whole = (
        analyse(
            StructuralModel(
                surface, Material(5e5), 1e-3, [Snow(0.3)], cable_area=1e-4, cable_material=Material(1.6e8)
            )
        )
        for surface in halves()
    )
    sizes = [one["snow"].results.largest_displacement for one in (half, whole)]
    pulls = [one["snow"].results.cable_tensions["ridge"] for one in (half, whole)]
    assert sizes[0] == pytest.approx(sizes[1], rel=1e-6)
    assert np.sort(2.0 * pulls[0]) == pytest.approx(np.sort(pulls[1]), abs=1e-4)
    for one, pull in zip((half, whole), pulls, strict=True):  # the end of the cable carries what it has there
        table = one.supports.query("case == 'snow' and kind == 'cable end'")
        ends = np.linalg.norm(table[["force_x", "force_y", "force_z"]], axis=1)
        assert [np.abs(np.abs(pull) - end).min() < 1e-6 for end in ends] == [True, True]


def test_half_of_shells_is_refused():
    """A mirror held no turns: a thin half deflected 3 % more than its whole, a thick one too."""
    half, whole = halves()
    given = {"elements": "shell", "cable_area": 1e-4, "anyway": True}
    with refused(OptionError, what="elements"):
        StructuralModel(half, Material(5e5), 1e-3, **given)
    StructuralModel(whole, Material(5e5), 1e-3, **given)


def test_snow_and_weight_behind_a_mirror_that_is_not_upright_are_refused():
    """Half of an upright film: its image would weigh upwards, and the displacements were not the whole's."""
    x, z = np.meshgrid(np.linspace(-2.0, 2.0, 5), np.linspace(0.0, 2.0, 3), indexing="ij")
    X = np.stack([x.ravel(), 0.0 * x.ravel(), z.ravel()], axis=1)
    rim, level = (np.abs(X[:, 0]) == 2.0) | (X[:, 2] == 2.0), Plane(normal=(0, 0, 1), mirror=True)
    parts = {"fixed": rim, "on_planes": {level: X[:, 2] == 0.0}, "plane": Plane((0, 0, -1))}
    half = pcmc.solve(Surface(X, grid_faces(4, 2), [0] * 16, [Patch("film", 1.0, 0.3)], **parts)).surface
    for surface in (half, pcmc.mirrored(half)):
        StructuralModel(surface, Material(5e5, density=1.0), 1e-3, [Wind({"film": 0.1})])
    for load in (Snow(0.1), SelfWeight()):
        StructuralModel(surface, Material(5e5, density=1.0), 1e-3, [load])
        with refused(OptionError, what="loads"):
            StructuralModel(half, Material(5e5, density=1.0), 1e-3, [load])


def test_a_zone_that_is_another_one_behind_a_mirror_is_refused():
    """A drift from 1 m before the ridge to the far eave was one of 1 m on each side of it."""
    half, whole = halves()

    def steps(surface, x0, x1):
        drift = Snow(0.1, area=[[x0, -1], [x1, -1], [x1, 7], [x0, 7]])
        return StructuralModel(surface, Material(5e5), 1e-3, [drift], cable_area=1e-4, anyway=True).steps

    for x0, x1 in ((3.0, 5.0), (3.0, 7.0), (-1.0, 11.0)):
        steps(half, x0, x1)
    steps(whole, 4.0, 11.0)
    with refused(OptionError, what="snow") as caught:
        steps(half, 4.0, 11.0)
    assert "take the whole roof: --whole" in str(caught.value)


def test_a_cable_in_a_mirror_is_in_balance_as_in_the_whole():
    half, whole = (pcmc.certify(surface) for surface in halves())
    columns = ["sheet_pull", "cable_pull"]
    assert 2.0 * half.cables[columns].to_numpy() == pytest.approx(whole.cables[columns].to_numpy(), rel=1e-6)


def test_a_part_says_that_a_cable_has_half_of_its_force():
    """Sheets and files had 3 kN for a cable of 6 kN without a word."""
    half, whole = (pcmc.certify(surface) for surface in halves())
    assert half.part.endswith("behind its mirror planes and has half of the force of 'ridge'")
    assert not whole.part
    assert any(half.part in sentence for sentence in verdict_sentences(half))


def test_a_mirror_holds_no_end_of_a_cable():
    """The cable goes on behind it: "held" told of a support in the middle of the roof."""
    line = {"curve": [[0, 3], [5, 3]], "cable": 3.0, "wall": False}
    outline, mirror = [[0, 0], [5, 0], [5, 6], [0, 6]], [[[5, 0], [5, 6]]]
    half = Plan(outline, [line], mirrors=mirror, edge_length=1.0, tension=3.0, pressure=0.5).surface()
    certificate = pcmc.certify(half)
    ends = certificate.cable_ends
    assert dict(zip(ends.x, ends.held, strict=True)) == {0.0: True, 5.0: False}
    _, table = cable_tables(certificate, Units("m", "kN"))
    assert {tuple(row[1:3]) for row in table.rows} == {("held", "0.000"), ("mirror", "5.000")}


def test_under_a_cable_across_one_patch_no_curvature_is_asked_for():
    whole = halves()[1]
    assert np.isnan(pcmc.mean_curvature(whole)[whole.cables[0].edges]).all()
    assert pcmc.certify(whole).curvature_error < 1e-9


def test_cloth_is_sewn_to_its_image_in_a_mirror():
    pattern = pcmc.cutting_pattern(halves()[0], width=2.0, allowance=0.05, hem=0.2)
    sewn = pattern.seam_table.query("kind == 'mirror'")
    half = pattern.surface
    ends = half.vertices[half.topology.edges[half.mirror_edge]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()
    assert sewn["length"].sum() == pytest.approx(length, rel=1e-2)
    assert sewn[["x0", "x1"]].to_numpy() == pytest.approx(5.0)
    assert "part of a roof" in str(pattern)


def test_panels_of_a_half_have_no_boundary_in_the_mirror():
    half, whole = (pcmc.panels(surface, 0.01) for surface in halves())
    lengths = [one.edge_totals.set_index("kind")["length"] for one in (half, whole)]
    assert 2.0 * lengths[0]["boundary"] == pytest.approx(lengths[1]["boundary"])
    assert "mirror" in lengths[0]
    assert "mirror" not in lengths[1]
    assert "part of a roof" in str(half)
    assert "part of a roof" not in str(whole)


def test_the_mirror_of_a_moved_half_is_known():
    half = halves()[0]
    turned = pcmc.cut(halves()[1], Plane((5, 0, 0), (1, 0, 0)))
    patterns = [pcmc.cutting_pattern(surface, width=2.0).seam_table for surface in (half, turned)]
    sums = [table.groupby("kind")["length"].sum()["mirror"] for table in patterns]
    assert sums[0] == pytest.approx(sums[1], rel=1e-6)


ROOMS = """
units = "m"
force = "kN"
[plan]
edge_length = 1.6
outline = [[0, 0], [8, 0], [8, 8], [0, 8]]
mirrors = [[[8, 0], [8, 8]]]
dividers = [{curve = [[4, 0], [4, 8]], wall = 2.0, name = "w"}]
[plan.patches]
side = {tension = 4.0, at = [2, 4], volume = 22.0}
mid = {tension = 4.2, at = [6, 4]}
[structure]
young = 5e5
thickness = 0.001
wind = {side = 0.3}
patches = {side = {thickness = 0.002, young = 1e6}}
run = true
[pattern]
strips = {side = 2, mid = 1}
"""


@needs_ccx
def test_what_a_project_names_holds_for_its_images(tmp_path):
    """Wind, cloth and strips of a patch whose image in the whole has a name of its own."""
    path = tmp_path / "rooms.toml"
    path.write_text(ROOMS)
    half = pcmc.project.run(path)
    whole = dataclasses.replace(half, unfold=True)
    names = [patch.name for patch in whole.shown.surface.patches]
    tables = [one.analysis().patches.set_index(["case", "patch"])["largest_force"] for one in (half, whole)]
    assert "side (2)" in names
    assert tables[1]["wind", "side (2)"] == pytest.approx(tables[0]["wind", "side"], rel=1e-5)
    strips = whole.cutting_pattern(whole.project.pattern).table.groupby("patch")["warp"]
    assert strips.count()["side (2)"] == 2
    assert strips.max()["side (2)"] == pytest.approx(strips.max()["side"])


SAIL = """
units = "m"
force = "kN"
[plan]
outline = [[0, 0], [6, 0], [6, 8], [0, 8]]
edge = "cable"
cable = 9.0
edge_length = 2.0
supports = [[0, 0, 2], [0, 8, 3]]
mirrors = [[[6, 0], [6, 8]]]
tension = 1.0
pressure = 0.0
[structure]
young = 5e5
thickness = 0.001
cable_area = {"cable 1" = 1e-4, "cable 2" = 1e-4}
[structure.members.rope]
kind = "cable"
area = 3e-4
young = 1.6e8
on = ["cable 3"]
"""


def test_a_cable_and_its_image_are_two(tmp_path):
    path = tmp_path / "sail.toml"
    path.write_text(SAIL)
    half = pcmc.project.run(path)
    whole = dataclasses.replace(half, unfold=True)
    found = [{(f.of, f.quantity): f.value for f in one.figures} for one in (half, whole)]
    for quantity in ("length", "sag"):
        assert found[1]["cable 3 (2)", quantity] == pytest.approx(found[0]["cable 3", quantity])
    assert found[1]["cable 1", "length"] == pytest.approx(2.0 * found[0]["cable 1", "length"])
    model = whole.model(whole.project.structure)
    areas = {cable.name: area for cable, area, *_ in model.cable_edges()}
    assert areas == {"cable 1": 1e-4, "cable 2": 1e-4, "cable 3": 3e-4, "cable 3 (2)": 3e-4}


def test_drawings_say_why_members_are_left_out(tmp_path):
    path = tmp_path / "sail.toml"
    path.write_text(SAIL)  # its member is the section of a cable, which drawings have
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of_members(pcmc.project.run(path), "drawings", held=True)
    mast = "[structure.members.mast]\nyoung = 2.1e8\ndiameter = 0.2\nbars = [[[0, 0], [0, 0]]]\n"
    text = SAIL.partition("[structure.members.rope]")[0] + mast
    path.write_text(text.replace('{"cable 1" = 1e-4, "cable 2" = 1e-4}', "1e-4"))
    half = pcmc.project.run(path)
    with pytest.warns(LostWarning, match="^roof.obj: members are left out$"):
        warn_of_members(half, "roof.obj")
    with pytest.warns(LostWarning, match="left out; .* draw the whole plan, without mirrors"):
        warn_of_members(dataclasses.replace(half, unfold=True), "drawings", held=True)


def test_the_corner_of_two_mirrors_ends_a_seam():
    outline, mirrors = [[0, 0], [3, 0], [3, 2], [0, 2]], [[[3, 0], [3, 2]], [[0, 2], [3, 2]]]
    quarter = pcmc.solve(Plan(outline, mirrors=mirrors, edge_length=0.5, tension=3.0, pressure=0.5).surface())
    seams = pcmc.cutting_pattern(quarter.surface, strips=1).seam_table.query("kind == 'mirror'")
    ends = seams[["x0", "y0", "x1", "y1"]].to_numpy().reshape(-1, 2, 2)
    assert sorted(np.abs(ends[:, 1] - ends[:, 0]).max(axis=1)) == pytest.approx([2.0, 3.0])


@pytest.mark.filterwarnings("ignore:.*single point")
@pytest.mark.parametrize("where", ["bars = [[[6, 4], [6, 4]]]", "along = [[[0, 0], [6, 0]]]"])
def test_a_member_at_a_mirror_without_images_asks_for_the_whole_plan(tmp_path, where):
    """With ``whole`` it is refused, too, so that is no advice."""
    path = tmp_path / "roof.toml"
    plan = "[plan]\nedge_length = 2.0\noutline = [[0, 0], [6, 0], [6, 8], [0, 8]]\ntension = 3.0\n"
    plan += "mirrors = [[[6, 0], [6, 8]]]\npressure = 0.0\nsupports = [[6, 4, 1]]\n"
    member = (
        f"[structure]\nyoung = 5e5\nthickness = 0.001\nmembers.m = {{diameter = 0.2, young = 2e8, {where}}}\n"
    )
    for whole in ("", "whole = true\n"):
        path.write_text(f'{plan}{member}[output]\nstructure = "roof.inp"\n{whole}')
        with pytest.raises(OptionError, match="draw the whole plan, without mirrors"):
            pcmc.project.run(path)


def test_a_line_in_a_mirror_is_drawn_as_no_rim():
    lengths = [Counter(), Counter()]
    for found, surface in zip(lengths, halves(), strict=True):
        for curve in model_curves(surface):
            steps = np.diff(curve.points, axis=0, append=curve.points[: int(curve.closed)])
            found[curve.layer] += np.linalg.norm(steps, axis=1).sum()
    half = halves()[0]
    ends = half.vertices[half.topology.edges[half.mirror_edge]]
    assert 2.0 * lengths[0]["PCMC-RIM"] == pytest.approx(lengths[1]["PCMC-RIM"])
    assert lengths[0]["PCMC-MIRROR"] == pytest.approx(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())


@pytest.mark.parametrize(("east", "told"), [(3.0, True), (5.0, True), (8.0, False), (10.0, False)])
def test_a_zone_on_one_side_alone_is_named_in_the_whole(east, told):
    """In the part it acts on the images, too; without a word the whole had half of the drift. The part
    refuses one that goes on behind the mirror, and is another one there."""
    half, _ = halves()
    zone = {"case": "drift", "snow": 0.3, "area": [[0, 0], [east, 0], [east, 3], [0, 3]]}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        Structure(young=5e5, thickness=1e-3, zones=[zone], cable_area=1e-4).check(half, unfold=True)
    assert ["drift: its area is on one side" in str(warning.message) for warning in caught] == [True] * told


@pytest.mark.parametrize("unfold", [False, True])
@pytest.mark.parametrize(("warp", "told"), [((1, 0, 0), 0), ((0, 1, 0), 0), ((0, 1, 1), 0), ((2, 1, 0), 1)])
def test_an_oblique_warp_at_a_mirror_is_named(warp, told, unfold):
    """The part under load has its image behind the mirror, the whole the same direction there."""
    cloth = Structure(young=5e5, weft=3e5, shear=1e4, warp=warp, thickness=1e-3, cable_area=1e-4)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        cloth.check(halves()[0], unfold=unfold)
    said = [str(warning.message) for warning in caught]
    assert ["neither along the mirror plane" in text for text in said] == [True] * told


def test_the_command_names_such_a_zone_once(tmp_path, capsys):
    path = tmp_path / "half.toml"
    path.write_text(
        "[plan]\nedge_length = 1.0\noutline = [[0, 0], [4, 0], [4, 6], [0, 6]]\ntension = 5.0\n"
        "mirrors = [[[4, 0], [4, 6]]]\n[structure]\nyoung = 5e5\nthickness = 0.001\n"
        'zones = [{case = "drift", wind = 0.1, area = [[0, 0], [4, 0], [4, 6], [0, 6]]}]\n'
        '[output]\nstructure = "half.inp"\nwhole = true\n'
    )
    assert cli.main(["structure", str(path), "-o", str(tmp_path / "roof.inp"), "--no-cache"]) == 0
    assert capsys.readouterr().err.count("drift: its area is on one side of the mirror plane") == 1


def test_the_volume_of_a_gas_is_that_of_the_part():
    half, whole = halves()
    given = Structure(young=5e5, thickness=1e-3, gas={"volume": 20.0, "patches": ["patch 1"]})
    gas = given.of_whole(half, whole, None).enclosed
    assert (gas.volume, list(gas.patches)) == (40.0, ["patch 1"])
