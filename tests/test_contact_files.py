"""Pinched walls written and read: whole where patches share vertices, as they stand where they do not."""

from functools import partial

import meshio
import numpy as np
import pytest
import pyvista
from shapes import rotation
from starts import stationary, two_squares

import pcmc
from pcmc import Plane, Surface, certify
from pcmc.contact import resting, walls
from pcmc.errors import FileError, FileWarning, SurfaceError

WHOLE = ["pcmc", "fe", "dmp", "obj", "ply", "vtp", "vtu"]
APART = ["stl", "glb", "gltf", "3dm"]


def flat():
    """Two squares whose whole junction rests on Π."""
    return stationary(partial(two_squares, 8, alpha_aux=3.0)).surface


def partly():
    """Two squares whose junction rests on Π next to both corners."""
    return stationary(partial(two_squares, 16, alpha_aux=2.0)).surface


def turned():
    """The same with Π somewhere else, so that its vertices lie on it to rounding only."""
    surface, R, shift = partly(), rotation(3), np.array([3.0, -1.0, 2.0])
    plane = Plane(R @ surface.plane.point + shift, R @ surface.plane.normal)
    return Surface(
        surface.vertices @ R.T + shift, surface.faces, surface.patch_of_face, surface.patches,
        fixed=surface.fixed, on_plane=surface.on_plane, plane=plane,
    )  # fmt: skip


@pytest.mark.parametrize("suffix", WHOLE)
@pytest.mark.parametrize("make", [flat, partly, turned])
def test_a_pinched_surface_is_read_as_it_was(make, suffix, tmp_path):
    surface = make()
    pcmc.write(tmp_path / f"pinched.{suffix}", surface)
    again = pcmc.read(tmp_path / f"pinched.{suffix}")
    np.testing.assert_allclose(again.vertices, surface.vertices, rtol=1e-15, atol=1e-15)
    np.testing.assert_array_equal(again.faces, surface.faces)
    rests = resting(surface, walls(surface))
    assert rests.any()
    np.testing.assert_array_equal(resting(again, walls(again)), rests)
    one, two = certify(surface), certify(again)
    np.testing.assert_array_equal(two.pinched, one.pinched)
    assert (two.verdict, two.index) == (one.verdict, one.index)
    assert two.residual < 1e-10
    assert two.energy == pytest.approx(one.energy, rel=1e-13)


@pytest.mark.parametrize("suffix", APART)
@pytest.mark.parametrize(("make", "names"), [(flat, 2), (partly, 3)])
def test_where_patches_are_apart_what_stands_is_kept(make, names, suffix, tmp_path):
    surface = make()
    with pytest.warns(FileWarning, match=r"cannot carry \d+ triangles of walls without height"):
        pcmc.write(tmp_path / f"pinched.{suffix}", surface)
    again = pcmc.read(tmp_path / f"pinched.{suffix}")
    assert [p.name for p in again.patches] == ["left", "right", "wall"][:names]
    rests = resting(surface, walls(surface))
    place = np.linalg.norm(again.vertices[:, None] - surface.vertices[rests], axis=2)
    assert (place.min(axis=0) < 1e-6).all()
    if suffix != "stl":
        assert again.on_plane[place.argmin(axis=0)].all()
        assert pcmc.energy(again) == pytest.approx(pcmc.energy(surface), rel=1e-6)


def test_a_standing_wall_is_written_without_a_warning(tmp_path):
    for suffix in APART:
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
