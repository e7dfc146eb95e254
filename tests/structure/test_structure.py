"""Structural models as files: what is written, and what is refused."""

import re
import tomllib
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from shapes import rotation
from small_project import HALL_WITH_ARCH
from starts import stationary, two_squares
from structures import FABRIC, LOADS, model_of, pyramid, square

import pcmc
from generators import hypar_roof
from pcmc import Material, Patch, SelfWeight, Snow, StructuralModel, Surface, Wind, cli
from pcmc.base.errors import FileError, OptionError, SurfaceError
from pcmc.base.units import Units
from pcmc.certificate.forces import total_load
from pcmc.forces.functional import patch_areas
from pcmc.project import Structure
from pcmc.structure.member_forces import cable_notes
from pcmc.surface.geometry import face_areas


def sections(path):
    """The data lines of an input file by keyword line, those of equal ones together; no comments."""
    found, key = {}, ""
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("**"):
            continue
        if line.startswith("*"):
            key = line
            found.setdefault(key, [])
        else:
            found[key].append([word for word in line.split(",") if word])
    return found


def written(folder, model):
    path = folder / "model.inp"
    pcmc.write_structure(path, model)
    return sections(path)


def test_nodes_and_elements_are_the_vertices_and_faces(tmp_path):
    surface = pyramid()
    material = Material(1e6 / 3, 0.1 / 3, 0.1 / 3)
    found = written(tmp_path, model_of(surface, material=material, thickness=1e-5 / 3))
    nodes = np.array(found["*NODE, NSET=NALL"], dtype=float)
    np.testing.assert_allclose(nodes[:, 1:], surface.vertices, rtol=1e-12)
    elements = np.array(found["*ELEMENT, TYPE=M3D3, ELSET=PATCH_1"], dtype=int)
    np.testing.assert_array_equal(elements - 1, np.column_stack([range(4), surface.faces]))
    assert found["*BOUNDARY"] == [["FIXED", "1", "3"]]
    assert found["*NSET, NSET=FIXED"] == [["1", "2", "3", "4"]]
    assert found["*NSET, NSET=SUPPORT_B1"] == [["1", "2", "3", "4"]]
    found.pop("*HEADING")
    assert all(len(field) <= 20 for rows in found.values() for row in rows for field in row)


def test_the_prestress_is_uniform_in_each_face(tmp_path):
    """σ ν = 0, and both other principal stresses are α/t."""
    surface = pyramid()
    model = model_of(surface, thickness={"roof": 0.002})
    rows = np.array(written(tmp_path, model)["*INITIAL CONDITIONS, TYPE=STRESS"], dtype=float)
    assert rows[:, :2].astype(int).tolist() == [[f, p] for f in range(1, 5) for p in (1, 2)]
    tensors = rows[:, 2:][:, [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]
    np.testing.assert_allclose(np.linalg.eigvalsh(tensors), [[0, 500, 500]] * 8, atol=1e-9)
    P = surface.vertices[surface.faces]
    normal = np.cross(P[:, 1] - P[:, 0], P[:, 2] - P[:, 0])
    np.testing.assert_allclose(tensors[::2] @ normal[:, :, None], 0.0, atol=1e-9)


def test_loads_balance_their_totals():
    """The pressure's force is ours; snow weighs s times the plan, self-weight ρ t g times the area."""
    surface = pyramid()
    model = model_of(surface, loads=LOADS)
    assert model.loads == tuple(LOADS)  # as given: a load, or loads that act together
    form, weight, snow, both = model.steps
    assert [step.name for step in model.steps] == ["form pressure", "self-weight", "snow", "snow and wind"]
    assert model.nodal_loads(form).sum(axis=0) == pytest.approx([0, 0, total_load(surface)])
    own = 0.1 * 1e-3 * 9.81 * face_areas(surface.vertices[surface.faces]).sum()
    assert model.nodal_loads(weight).sum(axis=0) == pytest.approx([0, 0, total_load(surface) - own])
    assert model.nodal_loads(snow).sum(axis=0) == pytest.approx([0, 0, 4.0 - own - 0.5 * 4.0])
    assert model.nodal_loads(both).sum(axis=0) == pytest.approx([0, 0, 1.3 * 4.0 - own - 0.2 * 4.0])
    np.testing.assert_allclose(model.nodal_loads(form)[4], [0, 0, 4 / 3])


@pytest.mark.parametrize("together", [False, True])
def test_self_weight_stays_in_combinations_that_do_not_name_it(together):
    """Also where it acts in one step with another load: there it was left out without a word."""
    weight, snow, wind = SelfWeight(gravity=10.0), Snow(0.5), Wind({"roof": 0.1})
    loads = [(weight, snow), wind] if together else [weight, snow, wind]
    model = model_of(pyramid(), loads=loads, combinations={"u": {"wind": 1.5, "form": 1.2}})
    form, last = model.steps[0], model.steps[-1]
    assert last.gravity == 10.0
    np.testing.assert_allclose(last.pressures, 1.2 * form.pressures + 0.15)
    np.testing.assert_allclose(last.forces, 1.2 * form.forces)


def test_snow_does_not_fall_on_what_is_below(tmp_path):
    """A bulge wider than its base carries snow on the plan of its upper side alone."""
    base = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
    X = [*base, *(2 * base + [0, 0, 1]), [0, 0, 2]]
    turns = [(a, (a + 1) % 4) for a in range(4)]
    F = [f for a, b in turns for f in ([a, b, 4 + b], [a, 4 + b, 4 + a], [4 + a, 4 + b, 8])]
    bulge = Surface(X, F, [0] * 12, [Patch("bulge", 1.0)], fixed=range(4))
    model = model_of(bulge, loads=[Snow(2.0)], anyway=True)
    assert model.steps[1].forces.sum(axis=0) == pytest.approx([0, 0, -2.0 * 16.0])


def test_patch_weights_belong_to_the_form_finding_load():
    surface = pyramid().retensioned(weights={"roof": 0.1})
    (form,) = model_of(surface, anyway=True).steps
    area = face_areas(surface.vertices[surface.faces]).sum()
    assert form.forces.sum(axis=0) == pytest.approx([0, 0, -0.1 * area])


def test_sliding_vertices_are_held_across_their_plane(tmp_path):
    """Their own first axis is the plane's normal; loads on them are given in their own axes."""
    given, turn = two_squares(4, alpha_aux=1.0), rotation(2)
    surface = Surface(
        given.vertices @ turn.T, given.faces, given.patch_of_face, given.patches,
        fixed=given.fixed, on_plane=given.on_plane, plane=pcmc.Plane(normal=turn[:, 2]),
    )  # fmt: skip
    surface = surface.retensioned(weights={"wall": 0.1})
    model = model_of(surface, loads=[Snow(0.5)], anyway=True)
    found = written(tmp_path, model)
    axes = np.array(found["*TRANSFORM, NSET=GUIDE_1, TYPE=R"], dtype=float).reshape(2, 3)
    np.testing.assert_allclose(np.cross(axes[0], turn[:, 2]), 0.0, atol=1e-12)
    assert axes[0] @ axes[1] == pytest.approx(0.0, abs=1e-12)
    assert ["GUIDE_1", "1", "1"] in found["*BOUNDARY"]
    guided = [int(v) - 1 for row in found["*NSET, NSET=GUIDE_1"] for v in row]
    np.testing.assert_array_equal(guided, np.flatnonzero(model.held & ~surface.fixed))
    np.testing.assert_allclose(
        model.axes @ model.axes.transpose(0, 2, 1), np.tile(np.eye(3), (surface.n, 1, 1)), atol=1e-12
    )
    assert np.abs(model.steps[1].forces[guided]).max() > 1e-3
    forces = np.zeros((surface.n, 3))
    for vertex, axis, value in found["*CLOAD, OP=NEW"]:
        forces[int(vertex) - 1, int(axis) - 1] = float(value)
    np.testing.assert_allclose(np.einsum("nij,ni->nj", model.axes, forces), model.steps[1].forces, atol=1e-11)


def test_pinched_walls_are_left_out(tmp_path):
    """Elements keep the numbers of their faces; the junction that rests on Π slides there."""
    surface = stationary(partial(two_squares, 8, alpha_aux=3.0)).surface
    model = model_of(surface, anyway=True)
    wall = surface.patch_of_face == surface.patch_index("wall")
    np.testing.assert_array_equal(model.faces, np.flatnonzero(~wall))
    resting = pcmc.certify(surface).pinched
    assert model.held[resting].all()
    assert not model.nodes[np.setdiff1d(surface.faces[wall], surface.faces[~wall])].any()
    assert "*ELEMENT, TYPE=M3D3, ELSET=PATCH_3" not in written(tmp_path, model)


def test_cables_have_their_tension_and_need_an_area(tmp_path):
    surface = square(4, cable=3.0, turn=rotation(1))
    with refused(OptionError, what="cable_area", where="tie"):
        model_of(surface, anyway=True)
    with refused(OptionError, what="cable_area", where="tie"):
        model_of(surface, anyway=True, cable_area={})
    with refused(OptionError, what="cable"):
        model_of(surface, anyway=True, cable_area={"tye": 1.0})
    found = written(tmp_path, model_of(surface, anyway=True, cable_area=1e-4))
    stress = np.array(found["*INITIAL CONDITIONS, TYPE=STRESS"], dtype=float)
    cable = stress[stress[:, 0] > surface.m]
    assert len(cable) == 4 * 8
    np.testing.assert_allclose(cable[:, 2:5].sum(axis=1), 3e4)


def test_cables_as_soft_as_the_cloth_are_named(capsys, tmp_path):
    """A cable of E = 5e5 kN/m² stretches 300 times as far as one of steel."""
    surface, steel = square(4, cable=3.0), Material(2.1e8)
    assert cable_notes(model_of(surface, anyway=True, cable_area=1e-4, cable_material=steel)) == []
    assert cable_notes(model_of(square(4), anyway=True)) == []
    pcmc.write(tmp_path / "sail.pcmc", surface, units="m")
    given = ["--thickness", "0.001", "--young", "5e5", "--cable-area", "1e-4", "--allow-uncertified"]
    cli.main(["structure", str(tmp_path / "sail.pcmc"), "-o", str(tmp_path / "sail.inp"), *given])
    text = "cables have the material of the patches, E = 5e+05 force/m²; in a project a member of kind"
    assert text in capsys.readouterr().out


def test_elements_are_numbered_in_turn_faces_first_then_cable_after_cable(tmp_path):
    sail = hypar_roof(4)
    found = written(tmp_path, model_of(sail, cable_area=1e-4, anyway=True))
    elements = [row for key, rows in found.items() if key.startswith("*ELEMENT") for row in rows]
    assert [int(row[0]) for row in elements] == list(range(1, len(elements) + 1))
    edges = [cable.edges for cable in sail.cables]
    assert len(edges) > 1
    np.testing.assert_array_equal(
        [[int(v) - 1 for v in row[1:]] for row in elements[sail.m :]], np.concatenate(edges)
    )


@pytest.mark.parametrize(
    ("units", "metres", "newtons", "mass"),
    [("m kN", 1.0, 1e3, 1e3), ("mm N", 1e-3, 1.0, 1e3), ("ft lbf", 0.3048, 4.4482216152605, 14.5939029)],
)
def test_self_weight_is_the_same_force_in_all_units(tmp_path, units, metres, newtons, mass):
    """A film of 1000 kg/m³, 1 mm thick, on an area of 4 unit squares weighs 9.81 kN per m³ in any units."""
    surface = pyramid()
    density = 1000.0 / (mass / metres**3)
    given = {"loads": [SelfWeight()], "material": Material(1e6, 0.3, density), "thickness": 1e-3 / metres}
    model = model_of(surface, **given, units=Units(*units.split()))
    forces = model.nodal_loads(model.steps[1]) - model.nodal_loads(model.steps[0])
    weight = patch_areas(surface)[0] * metres**2 * 1e-3 * 9810.0
    assert -forces.sum(axis=0)[2] * newtons == pytest.approx(weight, rel=1e-6)
    pcmc.write_structure(tmp_path / "roof.inp", model)
    text = (tmp_path / "roof.inp").read_text()
    assert f"EALL,GRAV,{9.81 / metres:.12g}," in text
    assert f"masses in {'slug' if metres == 0.3048 else 't'}, times in s" in text
    fixed = model_of(surface, **given | {"loads": [SelfWeight(2.0)]}, units=Units(*units.split()))
    assert fixed.steps[1].gravity == 2.0


def test_supports_and_cables_are_named_at_the_head(tmp_path):
    sail = pcmc.solve(hypar_roof(4)).surface
    model = model_of(sail, cable_area=1e-4)
    pcmc.write_structure(tmp_path / "sail.inp", model)
    text = (tmp_path / "sail.inp").read_text()
    found = sections(tmp_path / "sail.inp")
    for label, x, y, z in model.certificate.supports[["support", *"xyz"]].to_numpy().tolist():
        (node,) = found[f"*NSET, NSET=SUPPORT_{label}"][0]
        np.testing.assert_array_equal(sail.vertices[int(node) - 1], [x, y, z])
        assert f"** SUPPORT_{label}: point, {label}\n" in text
    for number, cable in enumerate(sail.cables, 1):
        assert f"** CABLE_{number}: {cable.name}\n" in text


def test_without_units_the_model_says_that_it_takes_metres():
    model = model_of(pyramid(), loads=[SelfWeight()])
    assert model.steps[1].gravity == 9.81
    assert "as in metres" in model.note
    assert not model_of(pyramid(), loads=[SelfWeight(9.81)]).note


def test_snow_on_walls_alone_names_its_patches():
    wall = square().retensioned(walls=["film"])
    with refused(OptionError, what="Snow.patches"):
        model_of(wall, loads=[Snow(1.0)], anyway=True).steps  # noqa: B018
    for surface, patches in ((wall, ["film"]), (square(), [])):  # a film that is no wall carries snow
        model = model_of(surface, loads=[Snow(1.0, patches=patches)], anyway=True)
        assert model.steps[1].forces.sum(axis=0) == pytest.approx([0, 0, -1.0])


def test_a_surface_that_is_not_certified_is_refused_or_marked(tmp_path):
    surface = pyramid().retensioned(tensions={"roof": 2.0})
    with refused(SurfaceError, what="surface"):
        model_of(surface)
    with refused(OptionError, what="anyway"):
        model_of(surface, anyway=1)
    heading = written(tmp_path, model_of(surface, anyway=True))["*HEADING"]
    assert "NOT CERTIFIED" in heading[0][0] + heading[0][-1]
    assert "NOT CERTIFIED" not in str(written(tmp_path, model_of(pyramid()))["*HEADING"])
    with refused(SurfaceError, what="surface"):
        StructuralModel(None, FABRIC, 1.0)


def test_nothing_is_written_half(tmp_path):
    model = model_of(pyramid())
    for path in (tmp_path / "model.txt", tmp_path / "missing" / "model.inp", tmp_path / "a\0.inp"):
        with pytest.raises(FileError):
            pcmc.write_structure(path, model)
    with refused(OptionError, what="model"):
        pcmc.write_structure(tmp_path / "model.inp", pyramid())
    with refused(OptionError, what="model"):
        pcmc.read_results(tmp_path / "model.dat", pyramid())
    with pytest.raises(FileError):
        pcmc.read_results(tmp_path / "model.dat", model)
    with pytest.raises(FileError):
        pcmc.read_results(tmp_path / "model.vtk", model)
    assert not list(tmp_path.iterdir())


def test_the_command_writes_a_model(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    pcmc.write("roof.pcmc", pyramid())
    given = ["structure", "roof.pcmc", "-o", "roof.inp", "--young", "1e6"]
    assert (
        cli.main([*given, "--thickness", "0.001", "--snow", "0.5", "--wind", "roof=-0.2", "--density", "0.1"])
        == 0
    )
    assert "form pressure, self-weight, snow, wind" in capsys.readouterr().out
    assert ["PATCH_1", "P1", "0.8"] in sections(tmp_path / "roof.inp")["*DLOAD, OP=NEW"]
    (tmp_path / "roof.inp").unlink()
    for more in ([], ["--thickness", "0"], ["--thickness", "rof=1"], ["--thickness", "1", "--wind", "rof=1"]):
        assert cli.main([*given, *more]) == 2
        assert capsys.readouterr().err.count("\n") == 1
    assert cli.main([*given[:3], "roof.txt", "--young", "1", "--thickness", "1"]) == 2
    pcmc.write("other.pcmc", pyramid().retensioned(tensions={"roof": 2.0}))
    other = ["structure", "other.pcmc", "-o", "roof.inp", "--young", "1e6", "--thickness", "roof=0.001"]
    assert cli.main(other) == 2
    assert not (tmp_path / "roof.inp").exists()
    assert cli.main([*other, "--allow-uncertified"]) == 1
    assert (tmp_path / "roof.inp").exists()


PROJECT = """
[plan]
edge_length = 1.0
outline = [[0, 0], [4, 0], [4, 3], [0, 3]]
patches = {roof = {tension = 4.0}}
[structure]
young = 1e6
thickness = 0.001
wind = {roof = 0.5}
"""


def test_a_project_is_solved_and_has_the_values(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "roof.toml").write_text(PROJECT)
    assert cli.main(["structure", "roof.toml", "-o", "roof.inp", "--poisson", "0.1"]) == 0
    found = sections(tmp_path / "roof.inp")
    assert found["*ELASTIC"] == [["1000000", "0.1"]]
    assert ["PATCH_1", "P1", "1.5"] in found["*DLOAD, OP=NEW"]
    (tmp_path / "small.toml").write_text(f'units = "mm"\nforce = "N"\n{PROJECT}')
    assert cli.main(["structure", "small.toml", "-o", "small.inp", "--density", "1e-9"]) == 0
    assert ["EALL", "GRAV", "9810", "-0", "-0", "-1"] in sections(tmp_path / "small.inp")["*DLOAD, OP=NEW"]
    assert "masses in t" in capsys.readouterr().out
    monkeypatch.setattr("pcmc.project.designed", None)  # what follows is refused before solving
    assert cli.main(["structure", "roof.toml", "-o", "roof.inp", "--wind", "rof=1"]) == 2
    (tmp_path / "roof.toml").write_text(PROJECT.replace("young", "yung"))
    assert cli.main(["structure", "roof.toml", "-o", "roof.inp"]) == 2
    assert "young" in capsys.readouterr().err
    (tmp_path / "roof.toml").write_text(PROJECT.replace("1e6", "-1.0"))
    assert cli.main(["structure", "roof.toml", "-o", "roof.inp"]) == 2


def test_values_of_the_command_replace_those_of_the_patches_that_they_name(tmp_path, monkeypatch, capsys):
    """The others keep theirs; a bare value is of all that are not named, those with their own, too."""
    monkeypatch.chdir(tmp_path)
    plan = "[plan]\nedge_length = 1.0\noutline = [[0, 0], [4, 0], [4, 3], [0, 3]]\n"
    plan += "dividers = [{curve = [[2, 0], [2, 3]], wall = 2.0}]\n"
    plan += "patches = {west = {tension = 4.0}, east = {tension = 4.0}}\n"
    values = "[structure]\nyoung = 1e6\nthickness = 0.001\nwind = {west = 0.5, east = 0.25}\n"
    Path("roof.toml").write_text(plan + values + "patches = {west = {thickness = 0.003}}\n")
    given = ["structure", "roof.toml", "-o", "roof.inp"]

    def thicknesses(*more):
        assert cli.main([*given, *more]) == 0
        found = Path("roof.inp").read_text().split("*MEMBRANE SECTION")[1:]
        return [float(section.splitlines()[1]) for section in found]

    assert thicknesses("--wind", "west=0.2") == [0.003, 0.001]
    pressures = sections(Path("roof.inp"))["*DLOAD, OP=NEW"]
    assert ["PATCH_1", "P1", "1.2"] in pressures
    assert ["PATCH_2", "P1", "1.25"] in pressures
    assert thicknesses("--thickness", "west=0.005") == [0.005, 0.001]
    assert thicknesses("--thickness", "east=0.005") == [0.003, 0.005]
    assert thicknesses("--thickness", "0.002") == [0.002, 0.002]
    Path("roof.toml").write_text(plan + values + "patches = {wset = {young = 2e6}}\n")
    capsys.readouterr()
    assert cli.main([*given, "--thickness", "0.002"]) == 2
    assert "unknown patch 'wset'; did you mean 'west'?" in capsys.readouterr().err


def test_a_member_alone_has_a_weight_too(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    given = ["structure", "hall.toml", "-o", "hall.inp"]
    (tmp_path / "hall.toml").write_text(
        HALL_WITH_ARCH.replace("young = 2.1e8", "young = 2.1e8\ndensity = 7.85")
    )
    assert cli.main([*given, "--gravity", "10"]) == 0
    assert "form pressure, self-weight" in capsys.readouterr().out
    loads = sections(tmp_path / "hall.inp")["*CLOAD, OP=NEW"]
    outcome = pcmc.project.designed(tmp_path / "hall.toml")
    [arch] = outcome.model(outcome.project.structure).lines
    weight = 10.0 * 7.85 * arch.length * arch.member.profile.area
    assert -sum(float(force) for *_, force in loads) == pytest.approx(weight)
    (tmp_path / "hall.toml").write_text(HALL_WITH_ARCH)
    assert cli.main([*given, "--gravity", "10"]) == 2
    assert "gravity: nothing has a weight; give a density, too" in capsys.readouterr().err


def test_a_roof_that_misses_its_targets_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    targets = '[targets]\nmeet = [{quantity = "apex", of = "roof", value = 30.0}]\nvary = ["roof"]\n'
    (tmp_path / "roof.toml").write_text(PROJECT + targets)
    assert cli.main(["structure", "roof.toml", "-o", "roof.inp"]) == 2
    assert "targets" in capsys.readouterr().err
    assert not (tmp_path / "roof.inp").exists()
    assert cli.main(["structure", "roof.toml", "-o", "roof.inp", "--allow-uncertified"]) == 1
    assert (tmp_path / "roof.inp").exists()


def test_the_how_to_page_has_the_keys_of_the_section():
    page = (Path(__file__).resolve().parents[2] / "docs/how-to/structural-model.md").read_text(
        encoding="utf-8"
    )
    text = re.search(r"```toml\n(.*?)```", page, re.S)[1]
    wanted = Structure(**tomllib.loads(text)["structure"])
    assert [load.name for load in wanted.loads(("hall",))] == ["self-weight", "snow", "wind"]
    example = re.search(r"```python\n(.*?)pcmc.write_structure", page, re.S)[1]
    named = pyramid().retensioned()
    surface = Surface(named.vertices, named.faces, [0] * 4, [Patch("hall", 1.0)], fixed=range(4))
    names = {"result": pcmc.solve(surface)}
    exec(compile(example, "structural-model.md", "exec"), names)
    assert len(names["model"].steps) == 4
