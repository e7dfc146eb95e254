"""What OpenUSD reads in a .usda file, and that its validators accept the file."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdShade, UsdValidation
from refusals import refused
from tents import tent

import pcmc
from pcmc.base.errors import FileError, MissingExtra


def meshes(path):
    """The stage, and the meshes by the names of their patches."""
    stage = Usd.Stage.Open(str(path))
    prims = [prim for prim in stage.GetPrimAtPath("/Roof").GetChildren() if prim.IsA(UsdGeom.Mesh)]
    return stage, {prim.GetDisplayName(): UsdGeom.Mesh(prim) for prim in prims}


def test_each_patch_is_a_mesh_with_its_material(tmp_path):
    surface, path = tent(names=("Süd/Ost", "a.b", "κ_1 (2)")), tmp_path / "a.usda"
    pcmc.write(path, surface, units="mm")
    stage, found = meshes(path)
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.001
    assert stage.GetDefaultPrim().GetPath() == "/Roof"
    assert list(found) == [patch.name for patch in surface.patches]
    colors = set()
    for k, (name, mesh) in enumerate(found.items()):
        points = np.array(mesh.GetPointsAttr().Get())
        corners = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
        wanted = surface.vertices[surface.faces[surface.patch_of_face == k]].astype(np.float32)
        np.testing.assert_array_equal(points[corners], wanted)
        np.testing.assert_array_equal(mesh.GetExtentAttr().Get(), [points.min(axis=0), points.max(axis=0)])
        material, _ = UsdShade.MaterialBindingAPI(mesh.GetPrim()).ComputeBoundMaterial()
        assert material.GetPrim().GetDisplayName() == name
        shader = material.ComputeSurfaceSource()[0]
        color = tuple(shader.GetInput("diffuseColor").Get())
        assert color == pytest.approx(tuple(mesh.GetDisplayColorAttr().Get()[0]))
        assert mesh.GetDoubleSidedAttr().Get()  # a roof is seen from below, too
        assert 0.0 < shader.GetInput("roughness").Get() <= 1.0
        colors.add(color)
    assert len(colors) == 3


def test_vertices_have_the_colours_of_a_scalar(tmp_path):
    surface, path = tent(tilted=False), tmp_path / "a.usda"
    pcmc.write(path, surface, scalars={"the height": surface.vertices[:, 2]}, colour="the height")
    _stage, found = meshes(path)
    for mesh in found.values():
        height = np.array(mesh.GetPointsAttr().Get())[:, 2]
        values = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("the_height").Get()
        np.testing.assert_array_equal(values, height)
        color = mesh.GetDisplayColorPrimvar()
        assert color.GetInterpolation() == "vertex"
        brightness = np.array(color.Get()).sum(axis=1)
        assert (np.diff(brightness[np.argsort(height)]) <= 0).all()


def test_far_from_the_origin_the_roof_is_placed(tmp_path):
    near, shift, path = tent(tilted=False), np.array([5e5, 5e6, 100.0]), tmp_path / "a.usda"
    held = {"fixed": near.fixed, "on_plane": near.on_plane, "plane": pcmc.Plane(tuple(shift))}
    far = pcmc.Surface(near.vertices + shift, near.faces, near.patch_of_face, near.patches, **held)
    pcmc.write(path, far)
    _stage, found = meshes(path)
    points = np.array(found["east"].GetPointsAttr().Get(), dtype=float)
    place = np.array(found["east"].ComputeLocalToWorldTransform(Usd.TimeCode.Default()))
    again = points + place[3, :3]
    assert np.abs(again - far.vertices[np.unique(far.faces[4:8])]).max() < 1e-6


def test_the_validators_of_openusd_accept_it(tmp_path):
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    pcmc.write(tmp_path / "a.usda", tent(), scalars={"h": tent().vertices[:, 2]}, colour="h")
    assert [e.GetMessage() for e in context.Validate(Usd.Stage.Open(str(tmp_path / "a.usda")))] == []
    text = (tmp_path / "a.usda").read_text().replace('upAxis = "Z"', "")
    (tmp_path / "b.usda").write_text(text)
    found = [e.GetName() for e in context.Validate(Usd.Stage.Open(str(tmp_path / "b.usda")))]
    assert found == ["MissingUpAxisMetadata"]


def test_it_is_not_read(tmp_path):
    path = tmp_path / "a.usda"
    pcmc.write(path, tent())
    with refused(FileError, what=str(path), found=".usda"):
        pcmc.read(path)


def test_without_usd(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(MissingExtra, match=r"usd-core is not installed.*pcmc-surfaces\[usd\]"):
        pcmc.write(tmp_path / "a.usda", tent())
    assert not list(tmp_path.iterdir())
