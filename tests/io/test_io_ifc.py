"""What IfcOpenShell reads in an .ifc file, and that its own validator accepts the file."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import ifcopenshell
import numpy as np
import pytest
from ifcopenshell.util import geolocation
from ifcopenshell.util.element import get_container, get_material, get_pset, get_psets
from ifcopenshell.util.placement import get_local_placement
from ifcopenshell.util.unit import calculate_unit_scale, get_project_unit
from refusals import refused
from tents import tent

import pcmc
from pcmc import cli
from pcmc.base.errors import FileError, FileWarning, LostWarning, MissingExtra, OptionError
from pcmc.base.units import FORCES, LENGTHS, Units, length_factor
from pcmc.forces.functional import patch_areas
from pcmc.io import Georeference
from pcmc.plan import Plan, polyline
from pcmc.structure import StructuralModel, drawn_members
from pcmc.structure.columns import columns_at_rest


def roof_of(path):
    """The file, which must live as long as its entities, its roof, and the roof's parts by name."""
    model = ifcopenshell.open(path)
    roof = model.by_type("IfcRoof")[0]
    return model, roof, {part.Name: part for part in roof.IsDecomposedBy[0].RelatedObjects}


@pytest.mark.nightly
def test_the_validator_of_ifcopenshell_accepts_it(tmp_path):
    """With the rules of the schema; and it refuses a file in which a rule is broken."""
    from generators import two_squares

    surface = tent(names=("Süd/Ost", "a.b", "κ_1 (2)"))
    about = {
        "units": Units("mm", "kN"),
        "georeference": Georeference("EPSG:25832", 691e3, rotation=30.0),
    }
    pcmc.write(tmp_path / "a.ifc", surface, certificate=pcmc.certify(surface), **about)
    pcmc.write(tmp_path / "b.ifc", two_squares(4, alpha_aux=1.0), units=Units("ft", "kip"))
    text = (tmp_path / "b.ifc").read_text().replace(",.ROOF.)", ",.USERDEFINED.)")  # without an ObjectType
    (tmp_path / "wrong.ifc").write_text(text)
    command = [
        sys.executable,
        "-m",
        "ifcopenshell.validate",
        "--rules",
        "--json",
        "a.ifc",
        "b.ifc",
        "wrong.ifc",
    ]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    lines = run.stdout.splitlines()
    assert lines[:2] == ["No validation issues found."] * 2
    assert "CorrectPredefinedType" in lines[2]


@pytest.mark.parametrize(("unit", "x"), [("m", 0.0), ("mm", 0.0), ("ft", 2e6)])
def test_it_is_on_a_map(tmp_path, unit, x):
    """Eastings and northings of a corner as IfcOpenShell finds them; far from zero, too, and turned."""
    surface = Plan([[x, 0], [x + 4, 0], [x + 4, 3], [x, 3]], edge_length=2.0, tension=2.0).surface()
    place = Georeference("EPSG:25832", 691_000.0, 5_334_000.0, 519.5, rotation=30.0)
    pcmc.write(tmp_path / "a.ifc", surface, units=unit, georeference=place)
    model = ifcopenshell.open(tmp_path / "a.ifc")
    [crs] = model.by_type("IfcProjectedCRS")
    assert (crs.Name, crs.MapUnit.Name) == ("EPSG:25832", "METRE")
    assert calculate_unit_scale(model) == pytest.approx(length_factor(unit, "m"))
    x, y, z = surface.vertices[0]
    metre, turn = length_factor(unit, "m"), np.exp(1j * np.radians(30.0))
    across = complex(691_000.0, 5_334_000.0) + metre * turn * complex(x, y)
    expected = [across.real, across.imag, 519.5 + metre * z]
    assert geolocation.auto_xyz2enh(model, x, y, z) == pytest.approx(expected, abs=1e-6)
    with pytest.warns(LostWarning, match="cannot carry .*its place on a map"):
        pcmc.write(tmp_path / "a.obj", surface, units=unit, georeference=place)
    with pytest.warns(FileWarning, match="a.ifc: its place on a map is left out"):
        pcmc.read(tmp_path / "a.ifc")
    with refused(OptionError, what="georeference", found="EPSG:25832", expected="a Georeference or None"):
        pcmc.write(tmp_path / "a.ifc", surface, units=unit, georeference="EPSG:25832")


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({"crs": "UTM 32"}, "crs: expected a coordinate system such as \"EPSG:25832\", found 'UTM 32'"),
        ({"crs": "EPSG:25832", "eastings": float("nan")}, "eastings: expected a finite number, found nan"),
    ],
)
def test_a_place_that_is_on_no_map_is_refused(given, line):
    with refused(OptionError, what=next(reversed(given))) as caught:
        Georeference(**given)
    assert str(caught.value) == line


def test_members_have_profiles_and_the_volume_of_their_length(tmp_path):
    """A tube in the place of a wall, which is a virtual element then; a rectangle and an area along edges."""
    from ifcopenshell import geom
    from ifcopenshell.util.shape import get_volume

    plan = Plan([[0, 0], [4, 0], [4, 2], [0, 2]], [[[2, 0], [2, 2]]], edge_length=0.5, tension=2.0)
    surface, steel, sides = plan.surface(), pcmc.Material(2.1e8, density=7.85), (0.0, 2.0)
    profiles = pcmc.Profile.rectangle(0.1, 0.2), pcmc.Profile(1e-3, 1e-6)
    members = [pcmc.Member("wall 1", pcmc.Profile.tube(0.1, 0.005), steel)]
    for y, profile in zip(sides, profiles, strict=True):
        of = replace(steel, density=7.85 * (y == 0.0))  # else it is not known
        members.append(pcmc.Member(polyline([[0, y], [4, y]]), profile, of, name=f"edge {y:.0f}"))
    model = StructuralModel(surface, steel, 1e-3, members=members, anyway=True)
    path, lines = tmp_path / "a.ifc", drawn_members(model)
    pcmc.write(path, surface, units=Units("m", "kN"), members=lines)
    model, _, parts = roof_of(path)
    [arch], [wall] = model.by_type("IfcMember"), model.by_type("IfcVirtualElement")
    assert (arch.Name, wall.Name, model.by_type("IfcWall")) == ("wall 1", "wall 1", ())
    assert {part.Name for part in model.by_type("IfcBeam")} == {"edge 0", "edge 2"}
    assert get_pset(arch, "Pcmc_Member", "YoungsModulus") == 2.1e8
    kinds = {v.Name: v.NominalValue.is_a() for v in model.by_type("IfcPropertySingleValue")}
    assert kinds["SecondMomentAcross"] == "IfcMomentOfInertiaMeasure"
    assert (kinds["MassDensity"], kinds["TargetMeanCurvature"]) == (
        "IfcMassDensityMeasure",
        "IfcCurvatureMeasure",
    )
    assert [get_pset(parts[f"edge {y}"], "Pcmc_Member").get("MassDensity") for y in (0, 2)] == [7.85, None]
    assert get_material(arch).ForProfileSet.MaterialProfiles[0].Profile.WallThickness == 0.005
    lengths = {line.name: line.segments(np.eye(3)[2])[2].sum() for line in lines}
    for part, profile in ((parts["edge 0"], profiles[0]), (arch, members[0].profile)):
        volume = get_volume(geom.create_shape(geom.settings(), part).geometry)
        assert volume == pytest.approx(profile.area * lengths[part.Name], rel=0.05)
    points = np.array(geom.create_shape(geom.settings(), parts["edge 0"]).geometry.verts).reshape(-1, 3)
    assert np.ptp(points, axis=0) == pytest.approx([4.0, 0.1, 0.2])
    again = pcmc.read(path)
    assert [patch.name for patch in again.patches] == [patch.name for patch in surface.patches]
    assert again.m == surface.m
    with pytest.warns(LostWarning, match="members"):
        pcmc.write(tmp_path / "a.obj", surface, members=lines)


def test_columns_and_stays_have_their_forces(tmp_path):
    """IfcColumn and IfcTendon, with the force at rest of the table; nothing of it in an uncertified roof."""
    corners = [[0, 0, 4], [10, 0, 0], [10, 10, 4], [0, 10, 0]]
    outline, edges = [p[:2] for p in corners], {"edge": "cable", "cable": 9.0, "supports": corners}
    start = Plan(outline, **edges, tension=1.0, pressure=0.0, edge_length=2.5).surface()
    steel, tube, rope = pcmc.Material(2.1e8), pcmc.Profile.tube(0.1, 0.005), pcmc.Profile(3e-4, 1e-9)
    members = [pcmc.Member([[0, 0], [0, 0]], tube, steel, name="mast")]
    members += [pcmc.Member([[0, 0], a], rope, steel, "cable", name="stay") for a in ([-3, -1], [-1, -3])]
    about = {"material": steel, "thickness": 1e-3, "cable_area": 1e-4, "members": members, "anyway": True}
    at_rest = StructuralModel(pcmc.solve(start), **about)
    forces = columns_at_rest(at_rest).set_index("member")["N"]
    pcmc.write(tmp_path / "a.ifc", at_rest.surface, units=Units("m", "kN"), members=drawn_members(at_rest))
    model = roof_of(tmp_path / "a.ifc")[0]
    [mast] = model.by_type("IfcColumn")
    stays = [part for part in model.by_type("IfcTendon") if part.Name.startswith("stay")]
    assert [mast.Name, *(part.Name for part in stays)] == list(forces.index)
    for part in (mast, *stays):
        assert get_pset(part, "Pcmc_Member", "LargestForceAtRest") == pytest.approx(forces[part.Name])
    assert [part.TensionForce for part in stays] == pytest.approx(forces.iloc[1:].tolist())
    assert [part.CrossSectionArea for part in stays] == [3e-4, 3e-4]
    assert all(one.forces is None for one in drawn_members(StructuralModel(start, **about)))


def test_the_hierarchy_is_whole(tmp_path):
    path, surface = tmp_path / "a.ifc", tent(names=("Süd/Ost", "a.b", "κ_1 (2)"))
    certificate = pcmc.certify(surface)
    pcmc.write(path, surface, certificate=certificate)
    model, roof, parts = roof_of(path)
    assert model.schema == "IFC4"
    above, chain = get_container(roof), []
    while above:
        chain.append(above.is_a())
        above = above.Decomposes[0].RelatingObject if above.Decomposes else None
    assert chain == ["IfcBuildingStorey", "IfcBuilding", "IfcSite", "IfcProject"]
    assert list(parts) == [patch.name for patch in surface.patches]
    found = get_pset(roof, "Pcmc_Certificate")
    assert found["Verdict"] == certificate.verdict.name.lower()
    assert found["Residual"] == certificate.residual
    assert found["Detail"] == certificate.detail


def test_each_patch_is_a_mesh_with_its_properties(tmp_path):
    from generators import two_squares

    path, surface = tmp_path / "a.ifc", two_squares(4, alpha_aux=1.0)
    pcmc.write(path, surface, units=Units("m", "kN"))
    areas = patch_areas(surface)
    _model, roof, parts = roof_of(path)
    assert [e.is_a() for e in parts.values()] == ["IfcSlab", "IfcSlab", "IfcWall"]
    for k, (patch, element) in enumerate(zip(surface.patches, parts.values(), strict=True)):
        assert element.Name == patch.name
        mesh = element.Representation.Representations[0].Items[0]
        assert mesh.is_a("IfcTriangulatedFaceSet")
        points, corners = np.array(mesh.Coordinates.CoordList), np.array(mesh.CoordIndex) - 1
        np.testing.assert_array_equal(
            points[corners], surface.vertices[surface.faces[surface.patch_of_face == k]]
        )
        values = get_psets(element)["Pcmc_Patch"]
        assert (values["Tension"], values["Pressure"]) == (patch.tension, patch.pressure)
        assert values["Area"] == pytest.approx(areas[k], rel=1e-14)
        assert values.get("TargetMeanCurvature") == patch.target_curvature
        style = mesh.StyledByItem[0].Styles[0]
        assert style.Name == patch.name
    assert "Pcmc_Certificate" not in get_psets(roof)


def test_a_heavy_patch_has_no_single_curvature(tmp_path):
    """H̄ follows slope and height, so p / 2α is that of no point; the certificate has the mean."""
    hall = Plan([[0, 0], [4, 0], [4, 3], [0, 3]], tension=2.0, weight=0.2, edge_length=1.0).surface()
    pcmc.write(tmp_path / "roof.ifc", hall)
    _model, _roof, parts = roof_of(tmp_path / "roof.ifc")
    assert "TargetMeanCurvature" not in get_pset(parts["patch 1"], "Pcmc_Patch")
    flat = pcmc.Surface([[0, 0, 0], [4, 0, 0], [0, 3, 0]], [[0, 1, 2]], [0], hall.patches, fixed=range(3))
    assert np.isnan(pcmc.certify(flat).patches.target[0])  # no vertex inside has one


def test_a_result_brings_its_certificate(tmp_path):
    from generators import spherical_cap

    result = pcmc.solve(spherical_cap(4))
    pcmc.write(tmp_path / "a.ifc", result)
    _model, roof, _parts = roof_of(tmp_path / "a.ifc")
    found = get_pset(roof, "Pcmc_Certificate")
    assert (found["Verdict"], found["MorseIndex"]) == ("stable", 0)
    assert found["LowestEigenvalue"] == result.certificate.eigenvalues[0] > 0.0
    pcmc.write(tmp_path / "a.obj", result)  # without a warning that it is lost
    assert pcmc.read(tmp_path / "a.obj").n == result.surface.n


METRES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "ft": 0.3048, "in": 0.0254}


@pytest.mark.parametrize("again", [False, True], ids=["written", "converted"])
def test_a_roof_that_is_not_certified_is_named_so(tmp_path, again):
    start = tent()
    pcmc.write(tmp_path / "a.pcmc", start, certificate=pcmc.certify(start))
    if again:
        assert cli.main(["convert", str(tmp_path / "a.pcmc"), str(tmp_path / "a.ifc")]) == 0
    else:
        pcmc.write(tmp_path / "a.ifc", start, certificate=pcmc.certify(start))
    _model, roof, _parts = roof_of(tmp_path / "a.ifc")
    assert roof.Name == "Roof, NOT CERTIFIED: no equilibrium"
    assert get_pset(roof, "Pcmc_Certificate")["Mark"] == "NOT CERTIFIED: no equilibrium"


@pytest.mark.parametrize("length", LENGTHS)
def test_units_are_those_of_the_surface(tmp_path, length):
    path, surface = tmp_path / "a.ifc", tent()
    pcmc.write(path, surface, units=length)
    model, _roof, parts = roof_of(path)
    assert calculate_unit_scale(model) == pytest.approx(METRES[length], rel=1e-15)
    assert get_project_unit(model, "FORCEUNIT") is None
    area = get_psets(parts["east"])["Pcmc_Patch"]["Area"]  # always in m²
    again = pcmc.read(path, units=length)
    assert np.abs(np.sort(again.vertices, axis=0) - np.sort(surface.vertices, axis=0)).max() == 0.0
    assert again.tensions.tolist() == surface.tensions.tolist()
    assert area == pytest.approx(METRES[length] ** 2 * patch_areas(surface)[1], rel=1e-14)


@pytest.mark.parametrize("force", FORCES)
def test_forces_have_units_if_they_are_given(tmp_path, force):
    path = tmp_path / "a.ifc"
    pcmc.write(path, tent(), units=Units("ft", force))
    model = ifcopenshell.open(path)
    newtons = {"N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605, "kip": 4448.2216152605}[force]
    assert calculate_unit_scale(model, "FORCEUNIT") == pytest.approx(newtons, rel=1e-15)
    values = {v.Name: v for v in model.by_type("IfcPropertySingleValue") if v.Name in ("Tension", "Pressure")}
    assert values["Tension"].NominalValue.is_a("IfcLinearForceMeasure")
    assert values["Pressure"].NominalValue.is_a("IfcPlanarForceMeasure")
    powers = {
        unit.UnitType: [element.Exponent for element in unit.Elements]
        for unit in model.by_type("IfcDerivedUnit")
    }
    assert powers == {
        "CURVATUREUNIT": [-1],
        "MOMENTOFINERTIAUNIT": [4],
        "LINEARFORCEUNIT": [1, -1],
        "PLANARFORCEUNIT": [1, -2],
        "MASSDENSITYUNIT": [1, 2, -4],
    }
    dimensions = {unit.UnitType: tuple(unit.Dimensions) for unit in model.by_type("IfcConversionBasedUnit")}
    assert dimensions.pop("LENGTHUNIT") == (1, 0, 0, 0, 0, 0, 0)  # length, mass, time, and four more
    assert set(dimensions.values()) <= {(1, 1, -2, 0, 0, 0, 0)}


def test_unknown_units_are_refused(tmp_path):
    with refused(OptionError, what="units", found="furlong"):
        pcmc.write(tmp_path / "a.ifc", tent(), units="furlong")
    assert not list(tmp_path.iterdir())


def test_far_from_the_origin_the_roof_is_placed(tmp_path):
    near, shift = tent(tilted=False), np.array([5e5, 5e6, 100.0])
    plane = pcmc.Plane(tuple(shift))
    held = {"fixed": near.fixed, "on_plane": near.on_plane, "plane": plane}
    far = pcmc.Surface(near.vertices + shift, near.faces, near.patch_of_face, near.patches, **held)
    pcmc.write(tmp_path / "a.ifc", far)
    _model, _roof, parts = roof_of(tmp_path / "a.ifc")
    element = parts["east"]
    points = np.array(element.Representation.Representations[0].Items[0].Coordinates.CoordList)
    assert np.abs(points).max() < 10.0
    place = get_local_placement(element.ObjectPlacement)[:3, 3]
    np.testing.assert_array_equal(points + place, far.vertices[np.unique(far.faces[4:8])])
    assert pcmc.read(tmp_path / "a.ifc").n == far.n


def test_other_files_are_refused(tmp_path):
    path = tmp_path / "a.ifc"
    pcmc.write(path, tent())
    foreign = path.read_text().replace("Pcmc_Surface", "Other")
    path.write_text(foreign)
    with refused(FileError, what=str(path), where="Pcmc_Surface"):
        pcmc.read(path)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("((1,3,5)", "((1,3,9999)"),
        ("((1,3,5)", "((0,3,7)"),
        ("((1,3,5)", "((1,3)"),
        ("IFCTEXT('22", "IFCTEXT('2x"),
        ("IFCTEXT('22", "IFCTEXT('2"),
        ("IFCTEXT('22", "IFCTEXT('72"),
        ('"counts"', '"count"'),
        ("IFCTRIANGULATEDFACESET(", "IFCPOLYGONALFACESET("),
        ("#34,(#50,", "#34,(#99999,"),
    ],
)
def test_damaged_files_are_refused_in_one_line(tmp_path, old, new):
    path = tmp_path / "a.ifc"
    pcmc.write(path, tent())
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(FileError) as caught:
        pcmc.read(path)
    assert "\n" not in str(caught.value)


def test_what_it_cannot_carry_is_named(tmp_path):
    with pytest.warns(LostWarning, match=r"a \.ifc file cannot carry height"):
        pcmc.write(tmp_path / "a.ifc", tent(), scalars={"height": tent().vertices[:, 2]})


def test_without_ifcopenshell(tmp_path, monkeypatch):
    pcmc.write(tmp_path / "a.ifc", tent())
    monkeypatch.setitem(sys.modules, "ifcopenshell", None)
    for act in (lambda: pcmc.write(tmp_path / "b.ifc", tent()), lambda: pcmc.read(tmp_path / "a.ifc")):
        with pytest.raises(MissingExtra, match=r"ifcopenshell is not installed.*pcmc-surfaces\[ifc\]"):
            act()
    assert [p.name for p in tmp_path.iterdir()] == ["a.ifc"]
