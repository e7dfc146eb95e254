"""Cables, weights, snow, volumes and mirrors, from the lines of a plan to files: what a designer types."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from volume_cases import cap_height

import pcmc
from pcmc import Verdict, cli, io
from pcmc.base.errors import FileError, LostWarning, OptionError, PlanError, PlanWarning
from pcmc.energy.rooms import room_volumes
from pcmc.plan import Area, CableLine, Divider, Hole, Plan
from pcmc.project import load, run, varied

NOTEBOOKS = Path(__file__).resolve().parent.parent / "notebooks"
SQUARE = [[0, 0], [10, 0], [10, 10], [0, 10]]
MASTS = [[0, 0, 4], [10, 0, 0], [10, 10, 4], [0, 10, 0]]
SAIL = {"edge": "cable", "cable": 9.0, "supports": MASTS, "tension": 1.0, "pressure": 0.0, "edge_length": 1.5}
HALL = [[0, 0], [10, 0], [10, 6], [0, 6]]

SAIL_TOML = """
units = "m"
force = "kN"

[plan]
edge_length = 1.5
outline = [[0, 0], [10, 0], [10, 10], [0, 10]]
edge = "cable"
cable = 9.0
supports = [[0, 0, 4], [10, 0, 0], [10, 10, 4], [0, 10, 0]]
tension = 1.0
pressure = 0.0

[targets]
meet = [{quantity = "sag", of = "cable 1", value = 1.5}, {quantity = "sag", of = "cable 3", value = 1.5}]
vary = [{patch = "cable 1", kind = "cable"}, {patch = "cable 3", kind = "cable"}]
tolerance = 1e-9

[output]
files = ["sail.pcmc", "sail.fe", "sail.3dm"]
picture = "sail.png"
"""

BUBBLE_TOML = """
[plan]
edge_length = 1.0
outline = {circle = {centre = [0, 0], radius = 3}}

[plan.patches]
dome = {tension = 2.0, volume = 40.0}

[output]
files = ["bubble.pcmc"]
"""

HALF_TOML = """
[plan]
edge_length = 1.2
outline = [[0, 0], [5, 0], [5, 6], [0, 6]]
mirrors = [[[5, 0], [5, 6]]]
dividers = [{curve = [[0, 3], [5, 3]]}]

[plan.patches]
south = {tension = 3.0}
north = {tension = 3.2}

[solve]
tolerance = 1e-13

[output]
files = ["half.pcmc"]
picture = "half.png"
whole = true
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def cables(surface):
    return {cable.name: (cable.tension, len(cable.edges)) for cable in surface.cables}


# ---- cables in a plan


def test_an_edge_between_masts_carries_a_cable_per_stretch():
    surface = Plan(SQUARE, **SAIL).surface()
    assert {name: tension for name, (tension, _) in cables(surface).items()} == dict.fromkeys(
        ["cable 1", "cable 2", "cable 3", "cable 4"], 9.0
    )
    assert sum(count for _, count in cables(surface).values()) == surface.topology.boundary_edge.sum()
    np.testing.assert_allclose(surface.vertices[surface.fixed], MASTS)
    south = np.unique(surface.cables[0].edges)
    np.testing.assert_allclose(surface.vertices[south, 2], 4.0 - 0.4 * surface.vertices[south, 0], atol=1e-12)


def test_the_stretch_over_the_first_point_of_the_outline_is_one_cable():
    plan = Plan(SQUARE, **(SAIL | {"supports": [[5, 0], [10, 5], [5, 10], [0, 5]]}))
    surface = plan.surface()
    assert len(surface.cables) == 4
    assert sum(count for _, count in cables(surface).values()) == surface.topology.boundary_edge.sum()
    for cable in surface.cables:
        ends = np.bincount(cable.edges.ravel())
        assert (ends == 1).sum() == 2
        assert surface.fixed[np.flatnonzero(ends == 1)].all()


def test_a_flat_sail_is_bounded_by_arcs_of_radius_tension_over_tension():
    """τ/α = 9, chord 10: sag 9 - √(81 - 25); order 2 in the edge length."""
    sags = []
    for h in (1.5, 0.75):
        flat = SAIL | {"supports": [p[:2] for p in MASTS], "edge_length": h}
        result = pcmc.solve(Plan(SQUARE, **flat).surface())
        assert result.certificate.verdict is Verdict.STABLE
        sags.append(pcmc.Target("sag", "cable 1"))
        sags[-1] = pcmc.design.targets.measure(result.surface, sags[-1]).value
    errors = np.abs(np.array(sags) - (9.0 - 56.0**0.5))
    assert errors[1] < 0.4 * errors[0]
    assert errors[1] < 0.02


def test_parts_of_the_outline_and_holes_have_cables_of_their_own():
    lines = [CableLine([[0, 0], [10, 0]], 12.0, "south")]
    plan = Plan(
        SQUARE,
        holes=[Hole([[4, 4], [6, 4], [6, 6], [4, 6]], edge="cable", cable=0.7)],
        cables=lines,
        tension=1.0,
        pressure=0.0,
    )
    surface = plan.surface()
    assert cables(surface).keys() == {"cable 1", "south"}
    assert cables(surface)["south"] == (12.0, 10)
    assert surface.cables[0].tension == 0.7
    assert len(surface.cables[0].edges) == len(np.unique(surface.cables[0].edges))  # closed
    assert surface.fixed.sum() == 31


def test_a_named_cable_cut_by_a_mast_is_numbered():
    plan = Plan(SQUARE, cables=[CableLine([[0, 0], [10, 0]], 12.0, "south")], supports=[[5, 0]], tension=1.0,
                pressure=0.0)  # fmt: skip
    assert list(cables(plan.surface())) == ["south-1", "south-2"]


def test_a_divider_without_wall_is_a_ridge_cable():
    plan = Plan(
        SQUARE,
        [Divider([[5, 0], [5, 10]], wall=None, name="ridge", cable=2.0)],
        patches={"roof": {"tension": 3.0, "at": [[2, 5], [8, 5]]}},
        edge_length=1.5,
    )
    surface = plan.surface()
    assert [patch.name for patch in surface.patches] == ["roof"]
    assert cables(surface).keys() == {"ridge"}
    plain = pcmc.solve(surface.retensioned(cables={"ridge": 0.0})).surface
    low = pcmc.solve(surface).surface
    ridge = np.unique(surface.cables[0].edges)
    assert low.vertices[ridge, 2].max() < 0.95 * plain.vertices[ridge, 2].max()


def test_a_free_edge_without_cable_still_warns_and_one_with_a_cable_does_not():
    with pytest.warns(PlanWarning, match='edge = "cable"'):
        Plan(SQUARE, edge="free", supports=MASTS, tension=1.0, pressure=0.0).surface()
    Plan(SQUARE, **SAIL).surface()  # warnings are errors


# ---- weight, snow, volumes


def test_weight_and_snow_are_those_of_the_patches():
    areas = [Area("west", 3.0, at=[1, 1], weight=0.1), Area("east", 3.0, at=[9, 1], snow=0.5)]
    surface = Plan(HALL, [[[5, 0], [5, 6]]], patches=areas, snow=0.25).surface()
    assert surface.weights.tolist() == [0.1, 0.0, 0.0]
    assert surface.pressures.tolist() == [0.75, 0.5, 0.25]
    assert surface.uncancelled.max() == 0.0
    snowy = Plan(HALL, tension=3.0, snow=0.25, edge_length=1.5).surface()
    bare = Plan(HALL, tension=3.0, edge_length=1.5).surface()
    assert snowy.pressures.tolist() == bare.with_snow(0.25).pressures.tolist()


def test_a_patch_with_a_negative_volume_hangs_below_the_plane():
    """The cap of height h over the unit disc has the pressure 4 α h / (1 + h²)."""
    plan = {"outline": {"circle": {"centre": [0, 0], "radius": 1.0}}, "edge_length": 0.2}
    for volume in (1.0, -1.0):
        result = pcmc.solve(Plan(**plan, patches={"cap": {"tension": 2.0, "volume": volume}}).surface())
        assert result.certify().certified
        heights, h = result.surface.vertices[:, 2], np.sign(volume) * cap_height(1.0)
        assert heights[np.abs(heights).argmax()] == pytest.approx(h, rel=0.03)
        assert result.surface.pressures[0] == pytest.approx(8.0 * h / (1.0 + h * h), rel=0.03)


def test_rooms_of_prescribed_volume_close_at_their_walls():
    plan = Plan(
        HALL,
        [Divider([[4, 0], [4, 6]])],
        patches={"west": {"tension": 3.0, "volume": 20.0}, "east": {"tension": 3.0, "volume": 40.0}},
    )
    surface = plan.surface()
    assert [room.patches for room in surface.rooms] == [
        (("west", 1), ("wall 1", 1)),
        (("east", 1), ("wall 1", -1)),
    ]
    result = pcmc.solve(surface)
    assert result.certificate.verdict is Verdict.STABLE
    np.testing.assert_allclose(room_volumes(result.surface), [20.0, 40.0], rtol=1e-10)
    west, east, wall = result.surface.pressures
    assert wall == pytest.approx(west - east, abs=1e-12)


def test_a_room_under_two_patches_has_no_wall_between_them():
    plan = Plan(
        HALL,
        [Divider([[4, 0], [4, 6]])],
        patches={"west": {"tension": 3.0}, "east": {"tension": 3.0}},
        rooms={"hall": {"patches": ["west", "east"], "volume": 50.0}},
    )
    (room,) = plan.surface().rooms
    assert room.patches == (("west", 1), ("east", 1))


def test_a_wall_is_cut_where_the_room_beside_it_changes():
    lines = [Divider([[0, 3], [10, 3]], name="long"), [[5, 3], [5, 6]]]
    plan = Plan(
        HALL,
        lines,
        patches=[
            Area("south", 3.0, at=[5, 1]),
            Area("nw", 3.0, at=[1, 5]),
            Area("ne", 3.0, at=[9, 5], volume=9.0),
        ],
    )
    surface = plan.surface()
    assert [p.name for p in surface.patches[3:]] == ["long-1", "long-2", "wall 2"]
    (room,) = surface.rooms
    assert dict(room.patches).keys() == {"ne", "long-2", "wall 2"}


# ---- mirrors


def test_half_and_quarter_of_a_roof_are_the_whole():
    half = Plan(
        [[0, 0], [5, 0], [5, 6], [0, 6]],
        [Divider([[0, 3], [5, 3]])],
        patches={"south": {"tension": 3.0}, "north": {"tension": 3.2}},
        mirrors=[[[5, 0], [5, 6]]],
    ).surface()
    on_mirror = half.vertices[:, 0] == 5.0
    assert not (half.pinned & on_mirror & (half.vertices[:, 2] > 0.0)).any()
    quarter = Plan(
        [[0, 0], [5, 0], [5, 5], [0, 5]], tension=4.0, mirrors=[[[5, 0], [5, 5]], [[0, 5], [5, 5]]]
    ).surface()
    for piece, images in ((half, 2), (quarter, 4)):
        part = pcmc.solve(piece, tolerance=1e-13)
        whole = pcmc.solve(pcmc.mirrored(piece), tolerance=1e-13)
        assert whole.surface.m == images * piece.m
        assert images * part.energy == pytest.approx(whole.energy, rel=1e-11)
        away = pcmc.mirrored(part.surface).vertices - whole.surface.vertices
        assert np.abs(away).max() < 1e-9 * whole.surface.size
    plane, mask = quarter.on_planes[0]
    assert plane.mirror
    assert plane.name == "mirror 1"
    assert (mask == (np.abs(quarter.vertices[:, 0] - 5.0) < 1e-9)).all()


def test_half_of_a_sail_is_at_rest_as_the_whole():
    """On a diagonal through two masts; the whole has the images of the cables."""
    half = Plan(SQUARE[:3], mirrors=[[SQUARE[0], SQUARE[2]]], **(SAIL | {"supports": MASTS[:3]})).surface()
    assert cables(half).keys() == {"cable 1", "cable 2"}
    assert half.vertices[half.on_planes[0][1], 2].min() > 1.0  # not the height of the outline there, 0
    whole = pcmc.mirrored(pcmc.solve(half, tolerance=1e-12).surface)
    certificate = pcmc.certify(whole)
    assert certificate.verdict is Verdict.STABLE
    assert certificate.residual < 1e-10
    assert whole.fixed.sum() == 4
    assert sum(count for _, count in cables(whole).values()) == whole.topology.boundary_edge.sum()


def test_a_mirror_across_a_tilted_plane_stands_on_it():
    plane = pcmc.Plane((1, 2, 3), (1, 0, 2))
    piece = Plan(
        [[0, 0], [4, 0], [4, 3]], tension=2.0, mirrors=[[[4, 0], [4, 3]]], edge_length=0.7, plane=plane
    ).surface()
    ((mirror, mask),) = piece.on_planes
    assert mask.sum() >= 5
    assert abs(np.dot(mirror.normal, plane.normal)) < 1e-12


# ---- projects, command line, sweeps


def test_a_hypar_roof_on_masts_from_toml_to_certified_files(folder, capsys):
    (folder / "sail.toml").write_text(SAIL_TOML, encoding="utf-8")
    assert cli.main(["solve", "sail.toml", "--no-mesh-check"]) == 0
    out = capsys.readouterr().out
    assert "sag of cable 1 1.5 m" in out
    assert "tension of cable 1 " in out
    assert "kN" in out
    assert all((folder / f"sail.{end}").stat().st_size > 1000 for end in ("pcmc", "fe", "3dm", "png"))
    roof = io.read("sail.pcmc")
    assert pcmc.certify(roof).verdict is Verdict.STABLE
    for name in ("cable 1", "cable 3"):
        sag = pcmc.design.targets.measure(roof, pcmc.Target("sag", name)).value
        assert sag == pytest.approx(1.5, abs=1e-8)
    assert cables(io.read("sail.fe")) == cables(roof)
    assert cli.main(["plot", "sail.pcmc", "plain.png", "--cable", "cable 1=12"]) == 0
    assert cli.main(["certify", "sail.pcmc", "--cable", "12", "--weight", "0.1"]) == 1  # not at rest any more


def test_a_bubble_room_by_its_volume_from_toml(folder, capsys):
    (folder / "bubble.toml").write_text(BUBBLE_TOML, encoding="utf-8")
    assert cli.main(["solve", "bubble.toml", "--no-mesh-check"]) == 0
    bubble = io.read("bubble.pcmc")
    assert room_volumes(bubble)[0] == pytest.approx(40.0, rel=1e-9)
    larger = ["solve", "bubble.toml", "--no-mesh-check", "--volume", "dome=50", "-o", "larger.pcmc"]
    assert cli.main(larger) == 0
    assert room_volumes(io.read("larger.pcmc"))[0] == pytest.approx(50.0, rel=1e-9)
    assert (
        cli.main(["sweep", "bubble.toml", "dome.volume=30,40", "--workers", "1", "--all", "--csv", "t.csv"])
        == 0
    )
    assert "30.0" in (folder / "t.csv").read_text()
    capsys.readouterr()


def test_half_of_a_roof_is_written_whole(folder, capsys):
    (folder / "half.toml").write_text(HALF_TOML, encoding="utf-8")
    outcome = run("half.toml")
    whole = io.read("half.pcmc")
    assert outcome.good
    assert whole.m == 2 * outcome.surface.m
    assert not whole.on_planes
    assert outcome.whole.certificate.verdict is Verdict.STABLE
    assert outcome.whole.certificate.energy == pytest.approx(2.0 * outcome.certificate.energy, rel=1e-12)
    assert (folder / "half.png").stat().st_size > 1000
    assert cli.main(["certify", "half.toml", "--whole"]) == 0
    assert cli.main(["convert", "half.toml", "again.obj", "--whole"]) == 0
    assert io.read("again.obj", fixed="boundary").m == whole.m
    capsys.readouterr()


def test_sweeps_name_cables_weights_and_rooms(folder):
    text = SAIL_TOML.partition("[targets]")[0].replace("pressure = 0.0", "pressure = 0.0\nweight = 0.02")
    (folder / "sail.toml").write_text(text, encoding="utf-8")
    for name in ("cable 2.tension", "cable cable 2.tension"):
        _, surface = varied("sail.toml", {name: 5.0, "patch 1.weight": 0.1})
        assert [cable.tension for cable in surface.cables] == [9.0, 5.0, 9.0, 9.0]
        assert surface.weights.tolist() == [0.1]
    sweep = pcmc.sweep.projects.project_sweep("sail.toml", {"cable 2.tension": [8.0, 10.0]})
    table = pcmc.sweep.run(sweep, workers=1)
    assert set(table["verdict"]) == {"stable"}
    assert table["cable 2.length"].is_monotonic_decreasing
    (folder / "bubble.toml").write_text(BUBBLE_TOML, encoding="utf-8")
    assert varied("bubble.toml", {"dome.volume": 7.0})[1].rooms[0].volume == 7.0
    with refused(OptionError, what="parameter", where="dome"):
        varied("bubble.toml", {"dome.pressure": 7.0})


# ---- files


@pytest.mark.parametrize("suffix", io.FORMATS)
def test_a_format_carries_the_forces_or_says_in_one_line_what_it_leaves_out(suffix, folder):
    surface = Plan(
        [[0, 0], [5, 0], [5, 6], [0, 6]],
        [Divider([[0, 3], [5, 3]], cable=0.5)],
        patches=[Area("a", 3.0, volume=8.0, weight=0.01), Area("b", 3.2, volume=8.0)],
        mirrors=[[[5, 0], [5, 6]]],
        edge_length=1.5,
    ).surface()
    path = folder / f"roof{suffix}"
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        io.write(path, surface)
        back = io.read(path) if io.FORMATS[suffix].reads else None
    losses = [str(w.message) for w in caught if issubclass(w.category, LostWarning)]
    said = "".join(losses)
    assert len(losses) == bool(losses)
    assert "\n" not in said
    words = {"cables": "cables", "rooms": "volumes of rooms", "on_planes": "mirror planes"}
    for field, word in words.items():
        assert (word in said) != (
            back is not None and len(getattr(back, field)) == len(getattr(surface, field))
        )
    if back is not None:
        assert ("weights" in said) != (back.weights.tolist() == surface.weights.tolist())
    if not losses:
        assert back.cables[0].tension == 0.5
        assert [room.volume for room in back.rooms] == [8.0, 8.0]


# ---- bad input: one line with cause and place


ENDS = [[0, 0], [10, 0]]
TWO = {"west": {"tension": 3.0}, "east": {"tension": 3.0}}
WRONG = {
    "a cable beside the edges": (
        {"cables": [CableLine([[2, 2], [4, 2]], 3.0)]} | {"tension": 1.0, "pressure": 0.0},
        PlanError,
        "cable 1",
    ),
    "a cable with a negative tension": (
        {"cables": [{"curve": [[0, 0], [10, 0]], "tension": -3.0}], "tension": 1.0},
        OptionError,
        "tension",
    ),
    "an edge with a negative cable": (SAIL | {"cable": -1.0}, OptionError, "cable"),
    "an edge without the tension of its cable": (SAIL | {"cable": None}, OptionError, "cable"),
    "a cable on a fixed edge": ({"cable": 2.0, "tension": 1.0}, OptionError, "edge"),
    "pressure beside a free edge": (SAIL | {"pressure": 1.0, "supports": ENDS}, PlanError, "pressure"),
    "snow beside a free edge": (SAIL | {"snow": 1.0, "supports": ENDS}, PlanError, "pressure"),
    "a cable edge that nothing holds": (SAIL | {"supports": []}, PlanError, "supports"),
    "a mast beside its edge": ({"tension": 4.0, "supports": [[10, 3, 2]]}, PlanError, "supports"),
    "a room without a wall": (
        {
            "dividers": [Divider([[4, 0], [4, 6]], wall=False)],
            "patches": TWO | {"west": {"tension": 3.0, "volume": 9.0}},
        },
        PlanError,
        "rooms",
    ),
    "a volume and a pressure": (
        {"patches": {"roof": {"tension": 3.0, "pressure": 1.0, "volume": 9.0}}},
        OptionError,
        "volume",
    ),
    "two volumes": (
        {
            "patches": {"roof": {"tension": 3.0, "volume": 9.0}},
            "rooms": {"hall": {"patches": ["roof"], "volume": 9.0}},
        },
        OptionError,
        "rooms",
    ),
    "a room of no patch": (
        {"patches": TWO, "rooms": {"hall": {"patches": ["nave"], "volume": 9.0}}},
        OptionError,
        "room 'hall': patch",
    ),
    "a mirror through the plan": ({"tension": 4.0, "mirrors": [[[5, 0], [5, 6]]]}, PlanError, "mirror 1"),
    "a mirror beside the plan": ({"tension": 4.0, "mirrors": [[[11, 0], [11, 6]]]}, PlanError, "mirror 1"),
    "a bent mirror": ({"tension": 4.0, "mirrors": [[[10, 0], [11, 3], [10, 6]]]}, OptionError, "mirror 1"),
    "a weight on no patch": ({"patches": TWO, "weight": 1.0}, OptionError, "weight"),
    "a cable with the name of a patch": (
        {
            "tension": 1.0,
            "cables": [CableLine([[0, 0], [10, 0]], 3.0, "wall 1")],
            "dividers": [[[5, 0], [5, 6]]],
        },
        OptionError,
        "name",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_plans_are_refused_in_one_line(name):
    values, kind, what = WRONG[name]
    with refused(kind, what=what) as caught:
        Plan(HALL, **values).surface()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "options",
    [
        ["--cable", "cable 1=-3"],
        ["--cable", "cable 9=3"],
        ["--cable", "3"],
        ["--volume", "4"],
        ["--volume", "west=4"],
        ["--weight", "wall 1=0.1"],
        ["--whole"],
    ],
)
def test_wrong_values_of_the_command_line_are_refused_in_one_line(folder, capsys, options):
    plan = Plan(HALL, [Divider([[4, 0], [4, 6]], wall=0.0)], patches=TWO)
    io.write("roof.pcmc", plan.surface())
    assert cli.main(["solve", "roof.pcmc", *options]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_wrong_keys_of_a_project_are_refused_with_their_line(folder):
    text = BUBBLE_TOML.replace("volume = 40.0", "volum = 40.0")
    (folder / "roof.toml").write_text(text, encoding="utf-8")
    with refused(FileError, what="plan.patches.dome.volum", where=7):
        load("roof.toml")
    (folder / "roof.toml").write_text(BUBBLE_TOML + "whole = true\n", encoding="utf-8")
    with refused(OptionError, what="whole"):
        run("roof.toml")
    assert not (folder / "bubble.pcmc").exists()


def test_the_sail_of_the_notebooks_is_certified(folder):
    text = (NOTEBOOKS / "sail.toml").read_text(encoding="utf-8")
    (folder / "sail.toml").write_text(text, encoding="utf-8")
    outcome = run("sail.toml")
    assert outcome.good
    assert {cable.name for cable in outcome.surface.cables} == {"cable 1", "cable 2", "cable 3", "cable 4"}


def test_the_pressure_that_keeps_a_volume_is_printed(tmp_path, capsys):
    plan = "[plan]\noutline = [[0, 0], [6, 0], [6, 6], [0, 6]]\nedge_length = 1.5\n"
    text = f'units = "m"\nforce = "kN"\n{plan}[plan.patches]\ndome = {{tension = 4.0, volume = 20.0}}\n'
    (tmp_path / "dome.toml").write_text(text, encoding="utf-8")
    assert cli.main(["solve", str(tmp_path / "dome.toml"), "--no-mesh-check"]) == 0
    (pressure,) = run(tmp_path / "dome.toml").certificate.rooms["pressure"]
    assert f"pressures that keep the volumes: 'dome' {pressure:.6g} kN/m²" in capsys.readouterr().out
