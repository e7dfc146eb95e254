"""Every bad input is refused with the first offender named; good values stay what they were."""

import numpy as np
import pytest
from shapes import octahedron, pyramid, three_patches
from starts import two_squares

from pcmc import Patch, Plane, Surface
from pcmc.base.errors import FreeSurfaceWarning, OptionError, PcmcError, SurfaceError

SQUARE = {
    "vertices": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1]],
    "faces": [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
    "patch_of_face": [0, 0, 1, 1],
    "patches": [Patch("left", 1.0), Patch("right", 2.0)],
    "fixed": [0, 1, 2, 3],
}


def vertices(row, *value):
    X = np.array(SQUARE["vertices"], dtype=float)
    X[row] = value
    return {"vertices": X}


def faces(row, *value):
    F = np.array(SQUARE["faces"])
    F[row] = value
    return {"faces": F}


def more(point, *triangles, patch=0):
    return {
        "vertices": SQUARE["vertices"] + point,
        "faces": SQUARE["faces"] + list(triangles),
        "patch_of_face": SQUARE["patch_of_face"] + [patch] * len(triangles),
    }


BAD = {
    "nan": (vertices(2, 1, np.nan, 0), r"vertices\[2\] = .* is not finite \(1 such"),
    "far": (vertices(2, 1, 1e51, 0), r"vertices\[2\] = .* is farther out than 1e\+50 \(1 such"),
    "infinite": (vertices([3, 4], np.inf), r"vertices\[3\] = .* is not finite \(2 such"),
    "flat vertices": (
        {"vertices": np.zeros((5, 2))},
        r"vertices: expected shape \(n, 3\).*\(5, 2\)",
    ),
    "no vertices": ({"vertices": np.zeros((0, 3))}, r"vertices: expected shape .* n > 0"),
    "ragged vertices": ({"vertices": [[0, 0, 0], [1, 0]]}, "vertices: expected a regular array"),
    "words": ({"vertices": [["a", "b", "c"]]}, "vertices: expected a regular array of numbers"),
    "index too high": (
        faces(1, 1, 2, 5),
        r"faces\[1\] = .* names a vertex outside 0\.\.4",
    ),
    "index below 0": (faces(2, 2, 3, -1), r"faces\[2\] = .* outside 0\.\.4 \(1 such"),
    "repeated vertex": (faces(3, 3, 3, 4), r"faces\[3\] = \[3, 3, 4\] has a vertex twice"),
    "repeated, ends": (faces(0, 4, 1, 4), r"faces\[0\] = \[4, 1, 4\] has a vertex twice"),
    "quads": ({"faces": [[0, 1, 2, 3]]}, r"faces: expected shape \(m, 3\).*\(1, 4\)"),
    "no faces": ({"faces": np.zeros((0, 3), int)}, r"faces: expected shape .* m > 0"),
    "half indices": (
        {"faces": [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0.5, 4]]},
        r"faces: expected whole numbers, found 0\.5 at place 10",
    ),
    "zero area": (more([[2, 0, 0]], [0, 5, 1]), r"face 4 = \[0, 5, 1\] of patch 'left' has zero"),
    "coincident": (
        vertices(4, 1, 1, 0),
        r"face 1 = .* of patch 'left' has zero area \(2 ",
    ),
    "one face turned": (
        faces(1, 2, 1, 4),
        r"patch 'left' is not consistently oriented: faces 0 and 1 run along edge \[1, 4\]",
    ),
    "same face": (
        more([], [1, 4, 0]),
        r"faces 0 and 4 are the same triangle \[0, 1, 4\]",
    ),
    "same face, turned": (more([], [2, 1, 4], patch=1), r"faces 1 and 4 are the same triangle"),
    "fan of three": (
        {
            "vertices": [[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 1, 0], [-1, -1, 0]],
            "faces": [[0, 1, 2], [1, 0, 3], [0, 1, 4]],
            "patch_of_face": [0, 0, 0],
            "patches": [Patch("fan", 1.0)],
        },
        r"patch 'fan': 3 of its faces share edge \[0, 1\] \(faces 0 and 2 among them\); split",
    ),
    "unreferenced": (
        {"vertices": SQUARE["vertices"] + [[9, 9, 9], [8, 8, 8]]},
        r"vertex 5 belongs to no face \(2 such",
    ),
    "short patch_of_face": ({"patch_of_face": [0, 0, 1]}, r"patch_of_face: expected shape \(4,\)"),
    "patch index": ({"patch_of_face": [0, 2, 1, 3]}, r"patch_of_face\[1\] = 2 is outside 0\.\.1"),
    "patch below 0": ({"patch_of_face": [0, 0, 1, -1]}, r"patch_of_face\[3\] = -1 is outside"),
    "empty patch": ({"patch_of_face": [0] * 4}, r"patch 'right' \(index 1\) has no faces"),
    "no patches": ({"patches": []}, "patches: expected a sequence of Patch"),
    "not patches": ({"patches": ["left", "right"]}, "patches: expected a sequence of Patch"),
    "one patch, not a sequence": ({"patches": Patch("a", 1.0)}, "patches: expected a sequence"),
    "same name": (
        {"patches": [Patch("a", 1.0), Patch("a", 2.0)]},
        "patches: the name 'a' is used twice",
    ),
    "fixed index": ({"fixed": [0, 7]}, r"fixed\[1\] = 7 is outside 0\.\.4"),
    "fixed below 0": ({"fixed": [-1]}, r"fixed\[0\] = -1 is outside"),
    "short mask": (
        {"fixed": np.ones(4, bool)},
        r"fixed: a mask must .* found \(4,\)",
    ),
    "fixed in halves": ({"fixed": [0.5]}, r"fixed: expected whole numbers, found 0\.5 at place 0"),
    "fixed huge": ({"fixed": [1e20]}, r"fixed: expected whole numbers, found 1e\+20"),
    "fixed nan": ({"fixed": [np.nan]}, r"fixed: expected whole numbers"),
    "normal for a plane": ({"plane": (0, 0, 1)}, r"plane: expected a Plane, found \(0, 0, 1\)"),
    "off its plane": ({"on_plane": [4]}, r"vertex 4 slides on the plane but lies 1 away from it"),
    "off a tilted plane": (
        {"fixed": [4], "on_plane": [0, 1], "plane": Plane(normal=(1, 0, 0))},
        r"vertex 1 slides on the plane but lies 1 away",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_refused_by_name(name):
    change, message = BAD[name]
    with pytest.raises(SurfaceError, match=message):
        Surface(**{**SQUARE, **change})


def test_the_square_itself_is_good():
    surface = Surface(**SQUARE)
    assert (surface.n, surface.m) == (5, 4)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("roof", True), r"patch 'roof': tension must be a number, found True"),
        (("roof", 1e300), r"patch 'roof': tension must be at most 1e\+50, found 1e\+300"),
        (("roof", 1.0, -1e51), r"patch 'roof': pressure must be at most 1e\+50"),
        (("roof", -1.0), r"patch 'roof': tension must be a finite number ≥ 0, found -1\.0"),
        (("roof", np.nan), "patch 'roof': tension must be .* found nan"),
        (("roof", np.inf), "patch 'roof': tension must be .* found inf"),
        (("roof", 1.0, np.nan), "patch 'roof': pressure must be finite, found nan"),
        (("roof", "tight"), "patch 'roof': tension must be a number, found 'tight'"),
        (("roof", 1.0, None), "patch 'roof': pressure must be a number, found None"),
        (("roof", 0.0), "patch 'roof': a patch under pressure 1.0 needs a tension > 0"),
    ],
)
def test_bad_patches(arguments, message):
    with pytest.raises(SurfaceError, match=message):
        Patch(*arguments)


def test_a_wall_may_have_no_tension():
    wall = Patch("wall", 0.0, pressure=0.0)
    assert wall.auxiliary
    assert np.isnan(wall.target_curvature)
    assert Patch("roof", 2.0).target_curvature == 0.25


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"normal": (0, 0, 0)}, "Plane.normal must not be the zero vector"),
        ({"normal": (0, 0)}, "Plane.normal: expected three finite numbers"),
        ({"normal": 3}, "Plane.normal: expected three finite numbers, found 3"),
        ({"point": (0, np.nan, 0)}, "Plane.point: expected three finite numbers"),
    ],
)
def test_bad_planes(arguments, message):
    with pytest.raises(SurfaceError, match=message):
        Plane(**arguments)


def test_plane_heights_and_projection():
    plane = Plane(point=(1, 1, 1), normal=(3, 0, 4))
    assert plane.height([[2, 5, 1], [1, 9, 2]]).tolist() == pytest.approx([0.6, 0.8])
    along = plane.along(np.array([[1.0, 2.0, 3.0]]))
    assert along @ plane.normal == pytest.approx(0.0, abs=1e-15)
    assert along[0].tolist() == pytest.approx([1 - 3 * 0.6, 2, 3 - 3 * 0.8])


def test_nothing_held_warns():
    with pytest.warns(FreeSurfaceWarning, match="translations are free"):
        octahedron(fixed=())


def test_supports_as_masks_indices_or_ranges():
    mask = np.array([True, True, False, False, False])
    by_mask = Surface(**{**SQUARE, "fixed": mask})
    by_index = Surface(**{**SQUARE, "fixed": [1, 0, 0]})
    by_set = Surface(**{**SQUARE, "fixed": {0, 1}})
    for surface in (by_mask, by_index, by_set):
        assert surface.fixed.tolist() == mask.tolist()


def test_fixed_wins_over_sliding():
    surface = Surface(**{**SQUARE, "fixed": [0, 1], "on_plane": [1, 2]})
    assert surface.fixed.tolist() == [True, True, False, False, False]
    assert surface.on_plane.tolist() == [False, False, True, False, False]
    assert surface.free.tolist() == [False, False, False, True, True]


def test_a_surface_is_frozen_and_owns_its_arrays():
    X = np.array(SQUARE["vertices"], dtype=float)
    surface = Surface(**{**SQUARE, "vertices": X})
    X[0] = 99.0
    assert surface.vertices[0].tolist() == [0, 0, 0]
    with pytest.raises(ValueError, match="read-only"):
        surface.vertices[0] = 1.0
    with pytest.raises(AttributeError):
        surface.plane = Plane()


def test_moved_keeps_everything_but_the_positions():
    surface = three_patches()
    moved = surface.moved(2.0 * surface.vertices)
    assert moved.size == pytest.approx(2.0 * surface.size)
    assert moved.topology is surface.topology
    assert moved.patches == surface.patches
    assert moved.plane == surface.plane
    for name in ("faces", "patch_of_face", "fixed", "on_plane"):
        assert getattr(moved, name) is getattr(surface, name)
    with pytest.raises(ValueError, match="read-only"):
        moved.vertices[0] = 1.0


@pytest.mark.parametrize(
    ("X", "message"),
    [
        (np.zeros((4, 3)), r"vertices: expected shape \(5, 3\), found \(4, 3\)"),
        (np.full((5, 3), np.nan), r"vertices\[0\] = .* is not finite"),
        (np.zeros(15), r"vertices: expected shape \(n, 3\)"),
    ],
)
def test_moved_refuses_bad_positions(X, message):
    with pytest.raises(SurfaceError, match=message):
        pyramid().moved(X)


def test_retensioned_changes_what_it_is_told():
    surface = three_patches()
    other = surface.retensioned({"roof0": 9.0}, pressures={"wall1": 0.25})
    assert other.tensions.tolist() == [9.0, *surface.tensions[1:]]
    assert other.pressures.tolist() == [1, 1, 1, 0, 0.25, 0]
    assert surface.tensions[0] == 2.0
    assert other.vertices is surface.vertices


def test_retensioned_refuses_what_a_patch_would():
    with pytest.raises(OptionError, match="unknown patch 'rof0'; did you mean 'roof0'"):
        three_patches().retensioned({"rof0": 1.0})
    with pytest.raises(SurfaceError, match="patch 'roof': tension must be"):
        pyramid().retensioned({"roof": -2.0})


def test_patches_by_name():
    surface = three_patches()
    assert surface.patch_index("wall1") == 4
    assert surface.patch_faces([4]).sum() == 9
    assert surface.patch_faces([0, 4]).sum() == 27
    with pytest.raises(OptionError, match="unknown patch 'wal'; did you mean 'wall"):
        surface.patch_index("wal")


def test_every_error_is_one_family():
    assert issubclass(SurfaceError, PcmcError)
    assert issubclass(OptionError, PcmcError)
    assert issubclass(PcmcError, ValueError)


def test_moving_keeps_sliding_vertices_on_the_plane():
    surface = two_squares(4)
    with pytest.raises(SurfaceError, match=r"slides on the plane but lies 0\.5 away"):
        surface.moved(surface.vertices + np.array([0, 0, 0.5]))
