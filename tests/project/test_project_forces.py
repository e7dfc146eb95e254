"""Cables, weights, volumes and mirrors from project files: solved, swept, written to every format."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from force_cases import BUBBLE_TOML, cables
from refusals import refused
from small_project import HALL_WITH_ARCH

import pcmc
from pcmc import Verdict, cli, io
from pcmc.base.errors import LostWarning, OptionError
from pcmc.forces.rooms import room_volumes
from pcmc.plan import Divider, PatchSpec, Plan
from pcmc.project import run, varied
from pcmc.project.members import members_drawn
from pcmc.sweep import run as run_sweep
from pcmc.sweep.projects import project_sweep

NOTEBOOKS = Path(__file__).resolve().parents[2] / "notebooks"
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
        cli.main(["sweep", "bubble.toml", "dome.volume=30", "--workers", "1", "--all", "--csv", "t.csv"]) == 0
    )
    assert "30.0" in (folder / "t.csv").read_text()
    capsys.readouterr()


def test_rhino_and_drawings_have_members_and_other_files_say_that_they_leave_them_out(folder):
    """The same section and force in both; the layer of the wall is hidden, and read back."""
    import ezdxf
    import rhino3dm

    (folder / "hall.toml").write_text(HALL_WITH_ARCH.replace('"hall.obj"', '"hall.obj", "hall.3dm"'))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        outcome = run("hall.toml")
    losses = [str(w.message) for w in caught if issubclass(w.category, LostWarning)]
    assert losses == ["hall.obj: members are left out; a wall in whose place one stands is drawn"]
    [arch] = members_drawn(outcome)
    texts = arch.texts(outcome.units)
    assert texts["N at rest"] == " to ".join(f"{N:.4g}" for N in arch.forces) + " kN"

    model = rhino3dm.File3dm.Read("hall.3dm")
    visible = {layer.Name: layer.Visible for layer in model.Layers}
    assert (visible["wall 1"], visible["west"], visible["member wall 1"]) == (False, True, True)
    assert "PCMC-WALL" not in visible
    [line] = [item for item in model.Objects if item.Attributes.Name == "member wall 1"]
    assert dict(line.Attributes.GetUserStrings()) == texts
    points = [line.Geometry.Point(k) for k in range(line.Geometry.PointCount)]
    np.testing.assert_allclose([(p.X, p.Y, p.Z) for p in points], arch.points)
    assert [patch.name for patch in io.read("hall.3dm").patches] == ["west", "east", "wall 1"]

    [line] = ezdxf.readfile("hall.dxf").modelspace().query('POLYLINE[layer=="PCMC-MEMBER-wall 1"]')
    np.testing.assert_allclose([list(v.dxf.location) for v in line.vertices], arch.points)
    words = [value for _, value in line.get_xdata("PCMC")]
    assert words == ["wall 1", *(f"{key}: {text}" for key, text in texts.items() if key != "member")]


def test_the_sections_of_cables_are_in_files_that_hold_them(folder):
    """In m² in the building model, with their unit in Rhino, also where a member gives the section of one."""
    import ifcopenshell
    import rhino3dm

    cloth = "[structure]\nyoung = 5e5\nthickness = 1e-3\ncable_area = 1e-4\n"
    rope = "[structure.members]\nrope = {on = ['cable 2'], kind = 'cable', young = 1.6e8, area = 3e-4}\n"
    text = SAIL_TOML.replace('"sail.pcmc", "sail.fe", ', '"sail.ifc", ')
    (folder / "sail.toml").write_text(text + cloth + rope)
    run("sail.toml")
    tendons = {part.Name: part for part in ifcopenshell.open("sail.ifc").by_type("IfcTendon")}
    areas = {name: part.CrossSectionArea for name, part in tendons.items()}
    assert areas == {f"cable {k}": 3e-4 if k == 2 else 1e-4 for k in range(1, 5)}
    curves = [item.Attributes for item in rhino3dm.File3dm.Read("sail.3dm").Objects]
    texts = {dict(one.GetUserStrings()).get("area") for one in curves}
    assert texts == {None, "0.0001 m²", "0.0003 m²"}


def test_a_project_says_what_its_files_lose_once_each_and_not_what_nobody_asked_for(folder):
    (folder / "lost.toml").write_text(
        SAIL_TOML.replace('"sail.3dm"', '"sail.stl", "sail.obj"'), encoding="utf-8"
    )
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run("lost.toml")
    losses = sorted(str(w.message) for w in caught if issubclass(w.category, LostWarning))
    assert losses == [
        "sail.fe: a .fe file cannot carry its unit m; left out",
        "sail.stl: a .stl file cannot carry cables, its unit m, supports, tensions, pressures; left out",
    ]


HALF_WITH_ARCH = """
units = "m"
force = "kN"

[plan]
edge_length = 1.2
outline = [[0, 0], [12, 0], [12, 4], [0, 4]]
mirrors = [[[0, 4], [12, 4]]]
patches = {west = {tension = 1.5, pressure = 0.3}, east = {tension = 1.5, pressure = 0.3}}
dividers = [{curve = [[6, 0], [6, 4]], wall = 0.6, member = "arch"}]

[structure]
young = 5e5
thickness = 0.001
members = {arch = {diameter = 0.1, thickness = 0.005, young = 2.1e8}}

[output]
report = "half.pdf"
"""


def test_a_report_on_a_half_says_that_it_leaves_members_out(folder):
    (folder / "half.toml").write_text(HALF_WITH_ARCH, encoding="utf-8")
    with pytest.warns(LostWarning, match="^report: members are left out; .* take the whole roof, whole"):
        run("half.toml")
    (folder / "half.toml").write_text(HALF_WITH_ARCH + "whole = true\n", encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("error", LostWarning)
        run("half.toml")


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
    sweep = project_sweep("sail.toml", {"cable 2.tension": [8.0, 10.0]})
    table = run_sweep(sweep, workers=1)
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
        patches=[PatchSpec("a", 3.0, volume=8.0, weight=0.01), PatchSpec("b", 3.2, volume=8.0)],
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
        assert (word in said) != (back is None or len(getattr(back, field)) == len(getattr(surface, field)))
    if back is None:
        return
    assert ("weights" in said) != (back.weights.tolist() == surface.weights.tolist())
    if not losses:
        assert back.cables[0].tension == 0.5
        assert [room.volume for room in back.rooms] == [8.0, 8.0]


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
