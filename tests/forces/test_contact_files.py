"""Pinched walls written and read: whole where a format can tell of them, else as they stand."""

from functools import partial

import meshio
import numpy as np
import pytest
import pyvista
import rhino3dm
from refusals import refused
from shapes import placed, rotation
from starts import stationary, two_squares

import pcmc
from pcmc import certify
from pcmc.base.errors import FileError, FileWarning, SurfaceError
from pcmc.forces.pinching import resting_vertices
from pcmc.forces.wall_rows import find_walls
from pcmc.io import load
from pcmc.io.metadata import WALLS as KEY

WHOLE = ["pcmc", "fe", "dmp", "obj", "ply", "vtp", "vtu"]
APART = ["glb", "gltf", "3dm", "ifc"]
DOUBLE = ("3dm", "ifc")  # of APART, in double precision


def flat():
    """Two squares whose whole junction rests on Π."""
    return stationary(partial(two_squares, 8, alpha_aux=3.0)).surface


def partly():
    """Two squares whose junction rests on Π next to both corners."""
    return stationary(partial(two_squares, 16, alpha_aux=2.0)).surface


def turned():
    """The same with Π somewhere else, so that its vertices lie on it to rounding only."""
    surface, R, shift = partly(), rotation(3), np.array([3.0, -1.0, 2.0])
    return placed(surface, R, shift)


@pytest.mark.parametrize("suffix", WHOLE)
@pytest.mark.parametrize("make", [flat, partly, turned])
def test_a_pinched_surface_is_read_as_it_was(make, suffix, tmp_path):
    surface = make()
    pcmc.write(tmp_path / f"pinched.{suffix}", surface)
    again = pcmc.read(tmp_path / f"pinched.{suffix}")
    np.testing.assert_allclose(again.vertices, surface.vertices, rtol=1e-15, atol=1e-15)
    np.testing.assert_array_equal(again.faces, surface.faces)
    resting = resting_vertices(surface, find_walls(surface))
    assert resting.any()
    np.testing.assert_array_equal(resting_vertices(again, find_walls(again)), resting)
    one, two = certify(surface), certify(again)
    np.testing.assert_array_equal(two.pinched, one.pinched)
    assert (two.verdict, two.index) == (one.verdict, one.index)
    assert two.residual < 1e-10
    assert two.energy == pytest.approx(one.energy, rel=1e-13)


@pytest.mark.parametrize("suffix", APART)
@pytest.mark.parametrize("make", [flat, partly, turned])
def test_walls_without_height_come_back_where_patches_are_written_apart(make, suffix, tmp_path):
    surface = make()
    path = tmp_path / f"pinched.{suffix}"
    pcmc.write(path, surface, scalars=SCALARS[suffix](surface))
    again = pcmc.read(path)
    digits = 1e-15 if suffix in DOUBLE else 1e-6
    order = np.lexsort(([p.name for p in again.patches],))
    assert [again.patches[k] for k in order] == sorted(surface.patches, key=lambda p: p.name)
    assert (again.n, again.m) == (surface.n, surface.m)
    assert (again.fixed.sum(), again.on_plane.sum()) == (surface.fixed.sum(), surface.on_plane.sum())
    for patch in surface.patches:  # each triangle of each patch at its place
        corners = [
            np.sort(s.vertices[s.faces[s.patch_faces([s.patch_index(patch.name)])]].sum(axis=1), 0)
            for s in (surface, again)
        ]
        np.testing.assert_allclose(corners[1], corners[0], rtol=0, atol=10 * digits * surface.size)
    resting, back = (
        resting_vertices(surface, find_walls(surface)),
        resting_vertices(again, find_walls(again)),
    )
    np.testing.assert_allclose(
        np.sort(again.vertices[back], axis=0), np.sort(surface.vertices[resting], axis=0), atol=1e-14
    )
    one = certify(surface)
    assert pcmc.energy(again) == pytest.approx(one.energy, rel=10 * digits)
    two = certify(again) if suffix in DOUBLE else pcmc.solve(again, target="stationary").certificate
    assert (two.verdict, two.index, two.pinched.sum()) == (one.verdict, one.index, one.pinched.sum())
    assert two.residual < 1e-10
    if suffix not in DOUBLE:
        assert len(load(path).scalars["height"]) == again.n


SCALARS = {
    "3dm": lambda surface: {},
    "glb": lambda surface: {"height": surface.plane.height(surface.vertices)},
}
SCALARS["gltf"], SCALARS["ifc"] = SCALARS["glb"], SCALARS["3dm"]


@pytest.mark.parametrize(("make", "names"), [(flat, 2), (partly, 3)])
def test_where_nothing_can_be_told_what_stands_is_kept(make, names, tmp_path):
    surface = make()
    with pytest.warns(FileWarning, match=r"cannot carry \d+ triangles of walls without height"):
        pcmc.write(tmp_path / "pinched.stl", surface)
    again = pcmc.read(tmp_path / "pinched.stl")
    assert [p.name for p in again.patches] == ["left", "right", "wall"][:names]
    resting = resting_vertices(surface, find_walls(surface))
    place = np.linalg.norm(again.vertices[:, None] - surface.vertices[resting], axis=2)
    assert (place.min(axis=0) < 1e-6).all()


def rhino_changed(path, change):
    model = rhino3dm.File3dm.Read(str(path))
    change(model)
    assert model.Write(str(path), 7)


def moved(model):
    shift = rhino3dm.Transform.Translation(1e-3, 0.0, 0.0)
    assert all(item.Geometry.Transform(shift) for item in model.Objects)


def without_the_wall(model):
    for item in list(model.Objects):
        if item.Attributes.Name == "wall":
            model.Objects.Delete(item.Attributes.Id)


@pytest.mark.parametrize("change", [moved, without_the_wall])
def test_walls_of_a_surface_changed_elsewhere_are_left_out_and_this_is_said(change, tmp_path):
    surface, path = partly(), tmp_path / "pinched.3dm"
    pcmc.write(path, surface)
    rhino_changed(path, change)
    with pytest.warns(FileWarning, match="walls without height were left out: the surface has"):
        again = pcmc.read(path)
    assert again.m < surface.m


@pytest.mark.parametrize("text", ["{", "[]", '{"vertices": [[0, 0, 0]]}', None])
def test_a_damaged_description_of_walls_is_refused(text, tmp_path):
    path = tmp_path / "pinched.3dm"
    pcmc.write(path, flat())

    def damage(model):
        told = text or model.Layers[0].GetUserString(KEY).replace('"faces": [[', '"faces": [[9999, ')
        model.Layers[0].SetUserString(KEY, told)

    rhino_changed(path, damage)
    with refused(FileError, what=str(path), where=KEY):
        pcmc.read(path)


def test_a_standing_wall_is_written_without_a_warning(tmp_path):
    for suffix in [*APART, "stl"]:
        pcmc.write(tmp_path / f"standing.{suffix}", two_squares(4))


@pytest.mark.parametrize("suffix", WHOLE)
def test_a_triangle_without_area_elsewhere_is_refused(suffix, tmp_path):
    surface = partly()
    X = surface.vertices.copy()
    face = surface.faces[np.flatnonzero(surface.patch_of_face == 1)[100]]
    X[face[0]] = X[face[1]]
    pcmc.write(tmp_path / f"bad.{suffix}", surface.moved(X))
    with pytest.raises((FileError, SurfaceError), match=rf"bad.{suffix}: .*'right' has zero area"):
        pcmc.read(tmp_path / f"bad.{suffix}")


@pytest.mark.parametrize("suffix", ["obj", "ply", "vtp"])
def test_vertices_at_one_place_are_still_joined_in_what_others_wrote(suffix, tmp_path):
    """Without the description of what was written here, patches may be apart."""
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0.0]]
    path = tmp_path / f"apart.{suffix}"
    if suffix == "vtp":
        pyvista.PolyData.from_regular_faces(np.array(square), [[0, 1, 2], [3, 4, 5]]).save(path)
    else:
        meshio.Mesh(np.array(square), [("triangle", [[0, 1, 2], [3, 4, 5]])]).write(path)
    assert pcmc.read(path).n == 4
