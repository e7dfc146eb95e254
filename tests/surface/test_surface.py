"""Every bad input is refused with the first offender named; good values stay what they were."""

import numpy as np
import pytest
from refusals import refused
from shapes import octahedron, pyramid, three_patches
from starts import two_squares

from pcmc import Patch, Plane, Surface
from pcmc.base.errors import FreeSurfaceWarning, OptionError, PcmcError, SurfaceError
from pcmc.surface import Cable, Room

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
    "nan": (vertices(2, 1, np.nan, 0), "vertices", 2, "is not finite;"),
    "far": (vertices(2, 1, 1e51, 0), "vertices", 2, r"is farther out than 1e\+50"),
    "infinite": (vertices([3, 4], np.inf), "vertices", 3, r"is not finite \(2 such"),
    "flat vertices": ({"vertices": np.zeros((5, 2))}, "vertices", None, r"\(n, 3\).*\(5, 2\)"),
    "no vertices": ({"vertices": np.zeros((0, 3))}, "vertices", None, "n > 0"),
    "ragged vertices": ({"vertices": [[0, 0, 0], [1, 0]]}, "vertices", None, "a regular array"),
    "words": ({"vertices": [["a", "b", "c"]]}, "vertices", None, "an array of real numbers"),
    "index too high": (faces(1, 1, 2, 5), "faces", 1, r"outside the range 0\.\.4"),
    "index below 0": (faces(2, 2, 3, -1), "faces", 2, r"outside the range 0\.\.4"),
    "repeated vertex": (faces(3, 3, 3, 4), "faces", 3, r"= \[3, 3, 4\] has a vertex twice"),
    "repeated, ends": (faces(0, 4, 1, 4), "faces", 0, r"= \[4, 1, 4\] has a vertex twice"),
    "quads": ({"faces": [[0, 1, 2, 3]]}, "faces", None, r"\(m, 3\).*\(1, 4\)"),
    "no faces": ({"faces": np.zeros((0, 3), int)}, "faces", None, "m > 0"),
    "half indices": (
        {"faces": [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0.5, 4]]},
        "faces",
        (3, 1),
        r"faces\[3, 1\]: expected a whole number, found 0\.5",
    ),
    "zero area": (more([[2, 0, 0]], [0, 5, 1]), "faces", 4, "of patch 'left' has zero area"),
    "coincident": (vertices(4, 1, 1, 0), "faces", 1, r"of patch 'left' has zero area \(2 "),
    "one face turned": (
        faces(1, 2, 1, 4),
        "faces",
        1,
        r"patch 'left' is not consistently oriented: faces 0 and 1 run along edge \[1, 4\]",
    ),
    "same face": (more([], [1, 4, 0]), "faces", 4, r"as faces\[0\] = \[0, 1, 4\]"),
    "same face, turned": (more([], [2, 1, 4], patch=1), "faces", 4, r"as faces\[1\]"),
    "fan of three": (
        {
            "vertices": [[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 1, 0], [-1, -1, 0]],
            "faces": [[0, 1, 2], [1, 0, 3], [0, 1, 4]],
            "patch_of_face": [0, 0, 0],
            "patches": [Patch("fan", 1.0)],
        },
        "faces",
        2,
        r"patch 'fan': 3 of its faces share edge \[0, 1\]",
    ),
    "unreferenced": (
        {"vertices": SQUARE["vertices"] + [[9, 9, 9], [8, 8, 8]]},
        "vertices",
        5,
        r"belongs to no face \(2 such",
    ),
    "short patch_of_face": ({"patch_of_face": [0, 0, 1]}, "patch_of_face", None, r"\(4,\)"),
    "patch index": ({"patch_of_face": [0, 2, 1, 3]}, "patch_of_face", 1, r"0\.\.1"),
    "patch below 0": ({"patch_of_face": [0, 0, 1, -1]}, "patch_of_face", 3, r"0\.\.1"),
    "empty patch": ({"patch_of_face": [0] * 4}, "patches", "right", "has no faces"),
    "no patches": ({"patches": []}, "patches", None, "a sequence of Patch"),
    "not patches": ({"patches": ["left", "right"]}, "patches", None, "a sequence of Patch"),
    "one patch, not a sequence": ({"patches": Patch("a", 1.0)}, "patches", None, "a sequence"),
    "same name": (
        {"patches": [Patch("a", 1.0), Patch("a", 2.0)]},
        "patches",
        None,
        "the name 'a' is used twice",
    ),
    "fixed index": ({"fixed": [0, 7]}, "fixed", 1, r"outside the range 0\.\.4"),
    "fixed below 0": ({"fixed": [-1]}, "fixed", 0, r"outside the range 0\.\.4"),
    "short mask": ({"fixed": np.ones(4, bool)}, "fixed", None, r"\(5,\) for a mask, found \(4,\)"),
    "mask of 0 and 1": ({"fixed": [1, 1, 0, 0, 0]}, "fixed", None, "give a mask as booleans"),
    "fixed in halves": ({"fixed": [0.5]}, "fixed", 0, r"a whole number, found 0\.5"),
    "fixed huge": ({"fixed": [1e20]}, "fixed", 0, r"a whole number, found 1e\+20"),
    "fixed nan": ({"fixed": [np.nan]}, "fixed", 0, "a whole number"),
    "normal for a plane": ({"plane": (0, 0, 1)}, "plane", None, r"a Plane, found \(0, 0, 1\)"),
    "off its plane": ({"on_plane": [4]}, "vertices", 4, "slides on the plane, but is 1 away"),
    "off a tilted plane": (
        {"fixed": [4], "on_plane": [0, 1], "plane": Plane(normal=(1, 0, 0))},
        "vertices",
        1,
        "slides on the plane, but is 1 away",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_refused_by_name(name):
    change, what, where, message = BAD[name]
    with refused(SurfaceError, what=what, where=where) as caught:
        Surface(**{**SQUARE, **change})
    assert caught.match(message)


def test_the_square_itself_is_good():
    surface = Surface(**SQUARE)
    assert (surface.n, surface.m) == (5, 4)


@pytest.mark.parametrize(
    ("arguments", "what", "expected"),
    [
        (("roof", True), "tension", "a finite number ≥ 0"),
        (("roof", 1e300), "tension", "a finite number ≥ -1e+50 and ≤ 1e+50"),
        (("roof", 1.0, -1e51), "pressure", "a finite number ≥ -1e+50 and ≤ 1e+50"),
        (("roof", -1.0), "tension", "a finite number ≥ 0"),
        (("roof", np.inf), "tension", "a finite number ≥ 0"),
        (("roof", "tight"), "tension", "a finite number ≥ 0"),
        (("roof", 1.0, np.inf), "pressure", "a finite number"),
        (("roof", 1.0, None), "pressure", "a finite number"),
    ],
)
def test_bad_patches(arguments, what, expected):
    found = arguments[1 + (what == "pressure")]
    with refused(SurfaceError, what=what, where="roof", found=found, expected=expected):
        Patch(*arguments)


@pytest.mark.parametrize("numbers", [(np.nan,), (1.0, np.nan)])
def test_a_patch_refuses_nan(numbers):
    with refused(SurfaceError, what=("tension", "pressure")[len(numbers) - 1], where="roof"):
        Patch("roof", *numbers)


def test_a_patch_under_pressure_needs_a_tension():
    with refused(SurfaceError, what="tension", where="roof", found=0.0, expected="> 0"):
        Patch("roof", 0.0)


def test_a_wall_may_have_no_tension():
    wall = Patch("wall", 0.0, pressure=0.0)
    assert wall.auxiliary
    assert np.isnan(wall.target_curvature)
    assert Patch("roof", 2.0).target_curvature == 0.25


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("normal", (0.0, 0.0, 0.0), "a vector of positive length"),
        ("normal", (0, 0), "three finite numbers"),
        ("normal", 3, "three finite numbers"),
        ("point", (0, np.nan, 0), "three finite numbers"),
    ],
)
def test_bad_planes(key, value, expected):
    with refused(SurfaceError, what=f"Plane.{key}", found=value, expected=expected):
        Plane(**{key: value})


def test_plane_heights_and_projection():
    plane = Plane(point=(1, 1, 1), normal=(3, 0, 4))
    assert plane.height([[2, 5, 1], [1, 9, 2]]).tolist() == pytest.approx([0.6, 0.8])
    along = plane.along(np.array([[1.0, 2.0, 3.0]]))
    assert along @ plane.normal == pytest.approx(0.0, abs=1e-15)
    assert along[0].tolist() == pytest.approx([1 - 3 * 0.6, 2, 3 - 3 * 0.8])


def test_nothing_held_warns_once():
    with pytest.warns(FreeSurfaceWarning, match="translations are free"):
        loose = octahedron(fixed=())
    loose.rebuilt(faces=loose.faces[:, ::-1])  # a warning would be an error here
    with pytest.warns(FreeSurfaceWarning, match="translations are free"):
        octahedron().rebuilt(fixed=())


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


def test_arrays_in_the_order_of_columns_are_kept_in_that_of_rows():
    """As loops read them, which are otherwise compiled once more."""
    columns = {name: np.asfortranarray(SQUARE[name]) for name in ("vertices", "faces")}
    surface = Surface(**SQUARE | columns)
    assert surface.faces.tolist() == SQUARE["faces"]
    assert all(array.flags.c_contiguous for array in (surface.vertices, surface.faces))


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
    ("X", "where", "expected"),
    [
        (np.zeros((4, 3)), None, (5, 3)),
        (np.full((5, 3), np.nan), 0, None),
        (np.zeros(15), None, "(n, 3) with n > 0"),
    ],
)
def test_moved_refuses_bad_positions(X, where, expected):
    with refused(SurfaceError, what="vertices", where=where, expected=expected):
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
    with refused(SurfaceError, what="tension", where="roof", found=-2.0):
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
    with refused(SurfaceError, what="vertices", where=int(np.argmax(surface.on_plane))):
        surface.moved(surface.vertices + np.array([0, 0, 0.5]))


@pytest.mark.parametrize(
    "name",
    [
        "",
        " a",
        "a ",
        "a\n",
        "a\tb",
        "a\x00",
        "a\r\nq",
        "a\x7f",
        "\ud800",
        "a\u2028",
        "a" * 101,
        3,
        None,
    ],
)
def test_names_that_no_part_may_have(name):
    """One rule for all parts: a line break, say, would write commands into a datafile."""
    for kind, arguments in (
        (Patch, (1.0,)),
        (Cable, (1.0, [[0, 1]])),
        (Room, ({"a": 1}, 2.0)),
    ):
        with refused(SurfaceError, what=f"{kind.__name__}.name", found=name):
            kind(name, *arguments)
    if name != "":
        with refused(SurfaceError, what="Plane.name", found=name):
            Plane(name=name)


@pytest.mark.parametrize("name", ["a" * 100, "Süd/Ost κ_1 (2) $x$ \\ '\"#", "屋根"])
def test_names_that_every_part_may_have(name):
    assert Patch(name, 1.0).name == Plane(name=name).name == name
