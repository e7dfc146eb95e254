"""Snow beside the pressure: one energy, and both numbers wherever the roof goes."""

from dataclasses import replace

import numpy as np
import pytest
from force_cases import HALL
from nightly import at_night
from programs import needs_evolver
from refusals import refused
from volume_cases import cap

import pcmc
from generators import hypar_roof, spherical_cap
from pcmc import Parameter, Patch, Surface, Target, cli, io
from pcmc.base.errors import LostWarning, OptionError, SurfaceError
from pcmc.cli.arguments import Loads
from pcmc.design.targets import measure
from pcmc.explore.following import between, reach, wanted
from pcmc.forces.rooms import room_pressures
from pcmc.io.mesh_data import scaled_surface
from pcmc.plan import PatchSpec, Plan, plan_from
from pcmc.project import digest, run, varied
from pcmc.project.values import changeable_values, data_with_values
from pcmc.solvers.homotopy import Solves, attempt, raise_loads
from pcmc.solvers.starts import low_start
from pcmc.structure import Material, Snow, StructuralModel
from pcmc.structure.loads import Step
from studies.reference import evolver

TOML = """
[plan]
edge_length = 1.5
outline = [[0, 0], [10, 0], [10, 6], [0, 6]]
tension = 4.0
snow = 0.25

[output]
files = ["hall.pcmc"]
"""


def hall(west: float = 0.25, east: float = 0.5) -> pcmc.Surface:
    """Two rooms with a wall between them, 0.9 and 1 the pressures of the air, under snow."""
    areas = [PatchSpec("west", 4.0, 0.9, at=[1, 1], snow=west), PatchSpec("east", 4.0, at=[9, 1], snow=east)]
    return Plan(HALL, [[[5, 0], [5, 6]]], patches=areas, edge_length=1.0).surface()


def net(surface: pcmc.Surface) -> pcmc.Surface:
    """The same with lower pressures in place of the snow."""
    patches = [replace(p, pressure=p.net_pressure, snow=0.0) for p in surface.patches]
    return surface.rebuilt(patches=patches)


def test_the_energy_is_that_of_the_net_pressures():
    snowy = hall()
    np.testing.assert_allclose(snowy.pressures, [0.9, 1.0, -0.1], rtol=1e-15)
    assert snowy.snows.tolist() == [0.25, 0.5, -0.25]
    assert snowy.uncancelled.max() == 0.0  # so no force depends on Π's point
    lower = net(snowy)
    for of in (pcmc.energy, pcmc.gradient, lambda s: pcmc.hessian(s).toarray()):
        np.testing.assert_array_equal(of(snowy), of(lower))
    one, other = pcmc.solve(snowy), pcmc.solve(lower)
    np.testing.assert_array_equal(one.surface.vertices, other.surface.vertices)
    for name in ("load", "load_ratio", "residual", "curvature_error", "reactions", "eigenvalues"):
        np.testing.assert_array_equal(getattr(one.certificate, name), getattr(other.certificate, name))
    table = one.certificate.patches
    assert table["pressure"].tolist() == snowy.pressures.tolist()
    assert (table["pressure"] - table["snow"]).tolist() == table["net"].tolist() == lower.pressures.tolist()
    np.testing.assert_array_equal(table["target"], other.certificate.patches["target"])
    assert "net" not in other.certificate.patches


def test_walls_follow_the_air_of_their_rooms_and_the_difference_of_the_snow():
    snowy = hall()
    warmer = snowy.retensioned(None, {"west": 1.15})
    np.testing.assert_allclose(warmer.pressures, [1.15, 1.0, 0.15], rtol=1e-14)
    assert warmer.snows.tolist() == snowy.snows.tolist()
    even = snowy.retensioned(snows={"east": 0.25})
    np.testing.assert_allclose(even.pressures, snowy.pressures)
    assert even.snows.tolist() == [0.25, 0.25, 0.0]
    assert even.uncancelled.max() == warmer.uncancelled.max() == 0.0
    with refused(SurfaceError, what="snow"):
        snowy.with_snow(0.1, ["west"])  # which leaves the wall as it was
    assert not Patch("sail", 1.0, pressure=0.0, snow=0.1).auxiliary
    with refused(SurfaceError, what="tension"):
        Patch("roof", 0.0, pressure=0.0, snow=0.1)


@pytest.mark.parametrize("suffix", [s for s, form in io.FORMATS.items() if form.reads])
def test_files_carry_the_air_and_the_snow(suffix, tmp_path):
    roof, path = pcmc.solve(hall()).surface, tmp_path / f"hall{suffix}"
    if io.FORMATS[suffix].bare:
        with pytest.warns(LostWarning, match="snow"):
            pcmc.write(path, roof)
        return
    pcmc.write(path, roof)
    again = pcmc.read(path)
    for name in ("tensions", "pressures", "snows"):
        np.testing.assert_allclose(getattr(again, name), getattr(roof, name), rtol=1e-14, atol=1e-15)
    assert again.walls.tolist() == roof.walls.tolist()
    assert pcmc.certify(again).residual < 1e-5  # in single precision
    in_mm = scaled_surface(roof, 1000.0)
    assert pcmc.energy(in_mm) == pytest.approx(1000.0 * pcmc.energy(roof), rel=1e-12)


@pytest.mark.parametrize("suffix", [s for s in io.FORMATS if s in (".pcmc", ".obj", ".glb")])
def test_files_without_snow_are_what_they_were(suffix, tmp_path):
    bare = hall(0.0, 0.0).rebuilt(curves=())  # curves of held lines need the newest version
    pcmc.write(path := tmp_path / f"hall{suffix}", bare)
    assert b"snow" not in path.read_bytes().lower()
    if suffix == ".pcmc":
        assert '"version": 1' in str(np.load(path)["meta"])


def test_meshes_of_compas_carry_snow():
    pytest.importorskip("compas")
    from pcmc.compas import from_meshes, to_meshes

    assert [p.snow for p in from_meshes(to_meshes(hall())).patches] == [0.25, 0.5, -0.25]


@needs_evolver
def test_evolver_has_the_same_energy_under_snow_also_in_a_room(tmp_path):
    snowy = hall()
    assert evolver.energy(snowy) == pytest.approx(pcmc.energy(snowy), rel=1e-12)
    forces = pcmc.gradient(snowy)
    np.testing.assert_allclose(evolver.gradient(snowy), forces, rtol=0, atol=1e-12 * abs(forces).max())
    room = pcmc.solve(cap(1.0, 0.4).retensioned(snows={"cap": 0.2})).surface
    assert room_pressures(room)[0] == pytest.approx(room.pressures[0], rel=1e-14)
    dump = tmp_path / "out.dmp"
    out = evolver.run(
        room,
        f'hessian_normal on\nhessian\nforeach body bb do printf "P %.17g\\n", bb.pressure\ndump "{dump}"',
    )
    assert evolver.numbers(out, "P", 1)[0, 0] == pytest.approx(room.pressures[0], rel=1e-6)
    again = pcmc.read(dump)
    assert again.snows.tolist() == [0.2]
    assert again.pressures[0] == pytest.approx(room.pressures[0], rel=1e-6)


def test_the_pressure_of_a_room_is_that_of_the_air():
    bare = pcmc.solve(cap(1.0, 0.4)).surface
    snowy = pcmc.solve(bare.retensioned(snows={"cap": 0.2})).surface
    np.testing.assert_allclose(snowy.vertices, bare.vertices, atol=1e-9)
    assert room_pressures(snowy)[0] - room_pressures(bare)[0] == pytest.approx(0.2, rel=1e-8)


def test_commands_change_one_and_keep_the_other(tmp_path, monkeypatch, capsys):
    """``--pressure 1`` once replaced 0.75, net of the snow."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hall.toml").write_text(TOML)
    assert cli.main(["solve", "hall.toml", "--no-mesh-check"]) == 0
    heights = []
    for flags in ([], ["--pressure", "1"], ["--snow", "0"], ["--snow", "patch 1=0.4", "--pressure", "1.15"]):
        for file in ("hall.toml", "hall.pcmc"):
            assert cli.main(["solve", file, *flags, "-o", "out.pcmc", "--no-mesh-check"]) == 0
            roof = pcmc.read("out.pcmc")
            heights.append(roof.vertices[:, 2].max())
    low, same, high, other = np.array(heights).reshape(4, 2)
    np.testing.assert_allclose([low, same, other], low[0], rtol=1e-6)
    assert high.min() > 1.1 * low[0]
    assert (roof.pressures.tolist(), roof.snows.tolist()) == ([1.15], [0.4])
    capsys.readouterr()
    assert cli.main(["certify", "hall.pcmc"]) == 0
    header, row = capsys.readouterr().out.split("\n\n")[1].splitlines()[:2]
    assert header.split()[:5] == ["patch", "tension", "pressure", "snow", "net"]
    assert row.split()[-len(header.split()) + 1 :][:4] == ["4", "1", "0.25", "0.75"]


@pytest.mark.parametrize("lower", ["roof below", "under"])
def test_snow_falls_on_the_upper_sheet_alone_whatever_their_names(lower):
    corners = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0.6, 0.6, 1], [0.6, 0.6, -1]]
    faces = [[0, 1, 3], [1, 2, 3], [2, 0, 3], [1, 0, 4], [2, 1, 4], [0, 2, 4]]
    sheets = [Patch("roof", 1.0), Patch(lower, 1.0)]
    cushion = Surface(corners, faces, [0] * 3 + [1] * 3, sheets, fixed=range(3))
    assert cushion.with_snow(0.25).snows.tolist() == [0.25, 0.0]
    assert Loads(snow=["0.25"]).of(cushion).snows.tolist() == [0.25, 0.0]
    step = Snow(0.25).added_to(Step("snow", np.zeros(6), np.zeros((5, 3))), cushion, 0.0)
    assert step.forces[3, 2] < 0.0 == step.forces[4, 2]


def test_sweeps_vary_the_snow(tmp_path):
    (tmp_path / "hall.toml").write_text(TOML)
    _, roof = varied(tmp_path / "hall.toml", {"patch 1.snow": 0.5})
    assert (roof.pressures.tolist(), roof.snows.tolist()) == ([1.0], [0.5])
    one, other = (tmp_path / f"{k}.pcmc" for k in (1, 2))
    pcmc.write(one, hall())
    pcmc.write(other, hall(0.3, 0.55))
    assert digest(one) != digest(other)


def test_snow_of_a_plan_whose_patches_have_their_own_is_refused_and_not_saved(tmp_path):
    own = {"west": {"tension": 3.0, "snow": 0.1}, "east": {"tension": 3.0}}
    plan = {"outline": [[0, 0], [8, 0], [8, 4], [0, 4]], "dividers": [[[4, 0], [4, 4]]], "edge_length": 1.0}
    data = {"plan": {**plan, "snow": 0.3, "patches": own}}
    roof = plan_from(data["plan"]).surface()
    saved, _, again = data_with_values(tmp_path / "roof.toml", data, roof.retensioned(snows={"east": 0.2}))
    assert again.snows[:2].tolist() == [0.1, 0.2]
    assert "snow" not in saved["plan"]
    with pytest.raises(OptionError, match=r"snow = 0\.3 of the plan counts for nothing"):
        plan_from({**saved["plan"], "snow": 0.3})


def test_the_page_follows_the_snow():
    start = pcmc.solve(hall()).surface
    values = changeable_values(start)
    assert values["snows"] == {"west": 0.25, "east": 0.5}
    assert values["pressures"] == {"west": 0.9, "east": 1.0}
    asked = wanted(start, values | {"snows": {"west": 0.25, "east": 0.25}})
    assert asked.snows.tolist() == [0.25, 0.25, 0.0]
    assert between(start, asked, 0.5).snows.tolist() == [0.25, 0.375, -0.125]
    reached = reach(start, asked, lambda: False)
    assert reached.failed is None
    assert changeable_values(reached.surface) == changeable_values(asked)


def test_snow_can_be_sought():
    of = [Target("apex", "east"), Target("curvature", "east"), Target("reaction per length")]
    roof = pcmc.solve(hall()).surface
    slopes = pcmc.sensitivities(roof, of, Parameter("east", "snow"))
    for sign in (1.0, -1.0):
        moved = pcmc.solve(roof.retensioned(snows={"east": 0.5 + 1e-4 * sign})).surface
        change = [measure(moved, target).value - measure(roof, target).value for target in of]
        np.testing.assert_allclose(change, 1e-4 * sign * slopes.to_numpy()[:, 0], rtol=5e-3, atol=1e-12)


def test_the_form_pressure_of_a_structure_is_net_and_more_snow_is_a_load_of_its_own():
    roof = pcmc.solve(hall()).surface
    steel = Material(young=2e8, poisson=0.3)
    models = [StructuralModel(s, steel, 0.01, loads=[Snow(0.1)]) for s in (roof, net(roof))]
    (form, more), plain = (model.steps for model in models)
    assert form.name == "form pressure less snow"
    for one, other in zip((form, more), plain, strict=True):
        loads = [model.nodal_loads(step) for model, step in zip(models, (one, other), strict=True)]
        np.testing.assert_array_equal(*loads)


@pytest.mark.parametrize(
    ("tension", "word"), [(0.8, "raising the net pressure"), *at_night((0.3, "of the net pressure"))]
)
def test_the_search_raises_what_is_net_of_the_snow(tension, word):
    """The cap over the unit disc rests up to a net pressure of 2 α: 0.8 carries 0.75, and 0.3 does not."""
    snowy = spherical_cap(0.25, alpha=tension).with_snow(0.25)
    lows = [low_start(s) for s in (snowy, net(snowy))]
    found, other = (attempt(raise_loads(s), Solves(None, {})) for s in lows)
    assert word in (found[1] if isinstance(found, tuple) else str(found))
    if isinstance(found, tuple):
        np.testing.assert_array_equal(found[0].vertices, other[0].vertices)
        assert found[0].patches == snowy.patches
    else:
        assert found.value == other.value == pytest.approx(0.8, rel=0.1)
        assert "the net pressure is 1.2" in str(pcmc.solve(snowy).proofs[0])


def test_a_branch_in_the_snow_keeps_the_wall_between_the_rooms():
    roof = pcmc.solve(hall()).surface
    branch = pcmc.follow(roof, Parameter("east", "snow"), 0.3)
    assert branch.last.snows.tolist() == pytest.approx([0.25, 0.3, -0.05], abs=1e-12)
    np.testing.assert_array_equal(branch.last.pressures, roof.pressures)
    assert branch.points["snow east"].iloc[-1] == pytest.approx(0.3)
    there = pcmc.solve(roof.retensioned(snows={"east": 0.3})).surface
    assert pcmc.energy(branch.last) == pytest.approx(pcmc.energy(there), rel=1e-7)
    line, more = pcmc.Direction(snows={"east": 1.0}).line(roof), roof.retensioned(snows={"east": 1.5})
    rate = line.energy_derivative(roof, roof.vertices, 0.5)  # E is linear in the snow
    assert rate == pytest.approx(pcmc.energy(more) - pcmc.energy(roof), rel=1e-12)
    force = pcmc.gradient(more) - pcmc.gradient(roof)
    np.testing.assert_allclose(line.gradient(roof, roof.vertices), force, atol=1e-13 * abs(force).max())
    with refused(SurfaceError, what="snow"):
        pcmc.follow(pcmc.solve(hypar_roof(4)).surface, pcmc.Direction(snows={"roof": 1.0}), 0.1)


def test_a_rise_is_found_under_almost_as_much_snow_as_air(tmp_path):
    """The first tension was that of the air alone, and the one wanted out of its bounds."""
    outline = "outline = {circle = {centre = [0, 0], radius = 5}}"
    (tmp_path / "dome.toml").write_text(f"[plan]\nedge_length = 2.0\n{outline}\nrise = 1.0\nsnow = 0.97\n")
    outcome = run(tmp_path / "dome.toml")
    assert outcome.design.met
    assert outcome.surface.vertices[:, 2].max() == pytest.approx(1.0, rel=1e-6)


def test_snow_beside_free_edges_of_a_mesh_is_refused_in_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    pcmc.write("sail.pcmc", hypar_roof(4))
    (tmp_path / "sail.toml").write_text('[mesh]\nfile = "sail.pcmc"\n[mesh.patches]\nroof = {snow = 0.1}\n')
    for given in (["sail.toml"], ["sail.pcmc", "--snow", "0.1"]):
        assert cli.main(["solve", *given]) == 2
        assert "edges are free" in capsys.readouterr().err


def test_snow_on_one_of_two_patches_without_a_wall_names_both(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    roof = hypar_roof(4)
    halves = (roof.vertices[roof.faces].mean(axis=1)[:, 0] > roof.vertices[:, 0].mean()).astype(int)
    patches, edge = [Patch("left", 4.0), Patch("right", 4.0)], roof.topology.on_boundary
    pcmc.write("two.pcmc", roof.rebuilt(patches=patches, patch_of_face=halves, fixed=edge))
    table = '[mesh]\nfile = "two.pcmc"\npatches = {%s}\n'
    (tmp_path / "two.toml").write_text(table % "left = {snow = 0.1}, right = {snow = 0.5}")
    for given in (["two.toml"], ["two.pcmc", "--snow", "right=0.5"]):
        assert cli.main(["solve", *given]) == 2
        said = capsys.readouterr().err
        assert "snow differs between 'right' and 'left', and no wall stands there" in said
        assert "'left' = {snow = 0.5} under patches" in said
        assert "free" not in said
    (tmp_path / "two.toml").write_text(table % "'left' = {snow = 0.5}, right = {snow = 0.5}")
    assert cli.main(["solve", "two.toml", "--no-mesh-check"]) == 0
