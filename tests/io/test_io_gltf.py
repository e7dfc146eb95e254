"""What other programs see in a .glb file: axes, metres, names, materials and colours."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh
from refusals import refused
from tents import tent

import pcmc
from generators import two_squares
from pcmc.base.errors import FileWarning, LostWarning, OptionError
from pcmc.io import load

NAMES = ("west side", "east", "wall")


def contents(path):
    """The header and the binary part of a .glb file, by its specification alone."""
    data = path.read_bytes()
    assert data[:4] == b"glTF"
    assert int.from_bytes(data[8:12], "little") == len(data)
    size = int.from_bytes(data[12:16], "little")
    return json.loads(data[20 : 20 + size], parse_constant=pytest.fail), data[28 + size :]


def array(header, binary, accessor):
    """An array of the binary part."""
    about = header["accessors"][accessor]
    view = header["bufferViews"][about["bufferView"]]
    kind = {5121: np.uint8, 5125: np.uint32, 5126: np.float32}[about["componentType"]]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[about["type"]]
    start = view.get("byteOffset", 0) + about.get("byteOffset", 0)
    return np.frombuffer(binary, kind, about["count"] * width, start).reshape(-1, width)


def attributes(path, name):
    """The vertex attributes of a mesh by its name, and its material."""
    header, binary = contents(path)
    primitive = next(mesh for mesh in header["meshes"] if mesh["name"] == name)["primitives"][0]
    found = {key: array(header, binary, number) for key, number in primitive["attributes"].items()}
    return found, header["materials"][primitive["material"]]


def of_patch(surface, k):
    return np.unique(surface.faces[surface.patch_of_face == k])


def test_height_is_y_and_nothing_is_mirrored(tmp_path):
    surface = tent(tilted=False)
    pcmc.write(tmp_path / "a.glb", surface)
    for k, name in enumerate(NAMES):
        x, y, z = attributes(tmp_path / "a.glb", name)[0]["POSITION"].T
        used = surface.vertices[of_patch(surface, k)].astype(np.float32)
        np.testing.assert_array_equal(np.column_stack([x, -z, y]), used)
    scene = trimesh.load_scene(tmp_path / "a.glb", process=False)
    outward = [np.cross(b - a, c - a) for a, b, c in surface.vertices[surface.faces[:4]]]
    up = scene.geometry["west side"].face_normals[:, 1] * np.linalg.norm(outward, axis=1)
    assert up == pytest.approx(np.array(outward)[:, 2], rel=1e-5)
    assert scene.extents == pytest.approx(np.ptp(surface.vertices, axis=0)[[0, 2, 1]], rel=1e-6)


def test_lengths_are_metres(tmp_path):
    surface = tent(tilted=False)
    pcmc.write(tmp_path / "a.glb", surface, units="mm")
    x, y, z = attributes(tmp_path / "a.glb", "east")[0]["POSITION"].T
    used = 0.001 * surface.vertices[of_patch(surface, 1)]
    assert np.column_stack([x, -z, y]) == pytest.approx(used, rel=1e-6, abs=1e-9)
    with pytest.warns(FileWarning, match="converted from m to mm"):
        again = pcmc.read(tmp_path / "a.glb", units="mm")
    assert again.tensions == pytest.approx(surface.tensions, rel=1e-14)


def test_each_patch_has_a_material_of_its_name(tmp_path):
    pcmc.write(tmp_path / "a.glb", tent())
    header, _ = contents(tmp_path / "a.glb")
    assert {node["name"] for node in header["nodes"] if "mesh" in node} == set(NAMES)
    seen = set()
    for name in NAMES:
        found, material = attributes(tmp_path / "a.glb", name)
        assert material["name"] == name
        assert material["doubleSided"]
        assert "COLOR_0" not in found
        seen.add(tuple(material["pbrMetallicRoughness"]["baseColorFactor"]))
    assert len(seen) == 3
    blue = attributes(tmp_path / "a.glb", "west side")[1]["pbrMetallicRoughness"]["baseColorFactor"]
    shown = 1.055 * np.array(blue[:3]) ** (1 / 2.4) - 0.055  # as a screen shows it
    assert (255 * shown).round().tolist() == [0x77, 0xAA, 0xDD]


def test_vertices_have_the_colours_of_a_scalar(tmp_path):
    surface = two_squares(4, alpha_aux=1.0)
    height, path = surface.vertices[:, 2].copy(), tmp_path / "a.glb"
    unknown = of_patch(surface, 0)[:2]
    height[unknown] = np.nan
    pcmc.write(path, surface, scalars={"height": height, "x": surface.vertices[:, 0]}, colour="height")
    header, _ = contents(path)
    known = height[np.isfinite(height)]
    note = header["scenes"][0]["extras"]["pcmc colours"]
    assert note == {"scalar": "height", "least": known.min(), "most": known.max()}
    for k, patch in enumerate(surface.patches):
        found, material = attributes(path, patch.name)
        assert material["pbrMetallicRoughness"]["baseColorFactor"] == [1.0] * 4
        color, values = found["COLOR_0"].astype(int), height[of_patch(surface, k)]
        assert (color[:, 3] == 255).all()
        order = np.argsort(values[np.isfinite(values)])
        brightness = color[np.isfinite(values), :3].sum(axis=1)[order]
        assert (np.diff(brightness) <= 0).all()  # from pale to dark
        lowest, highest = values == known.min(), values == known.max()
        assert (color[lowest, :3] > 200).all()
        assert (color[highest, :3] < 20).all()
        grey = color[np.isnan(values), :3]
        assert (grey == grey[:, :1]).all()
    loaded = trimesh.load_scene(path).geometry["left"]
    assert loaded.visual.material.name == "left"
    again = load(path)
    assert len(again.vertices) == surface.n
    assert np.isnan(again.scalars["height"]).sum() == 2  # and no NaN is in the file
    assert np.isfinite(attributes(path, "left")[0]["_height"]).all()


def test_colours_of_something_else(tmp_path):
    surface = tent()
    with refused(OptionError, what="colour", found="hight"):
        pcmc.write(tmp_path / "a.glb", surface, scalars={"height": surface.vertices[:, 2]}, colour="hight")
    with refused(OptionError, what="colour", found="load"):  # of faces
        pcmc.write(tmp_path / "a.glb", surface, scalars={"load": np.zeros(12)}, colour="load")
    assert not list(tmp_path.iterdir())
    with pytest.warns(LostWarning, match=r"cannot carry colours of 'height'"):
        pcmc.write(tmp_path / "a.ply", surface, scalars={"height": surface.vertices[:, 2]}, colour="height")
