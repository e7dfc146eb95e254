"""Datafiles of Surface Evolver that were written by hand, good ones and wrong ones."""

import re

import numpy as np
import pytest
from refusals import refused

import pcmc
from pcmc.base.errors import FileError, FileWarning

CUBE = """// A quarter of a cube's surface, by hand
PARAMETER side = 2*sqrt(4)/2
SPACE_DIMENSION 3
CONSTRAINT 2  /* the floor */
FORMULA: z/2 - 1 = side - 2

vertices /* given by
coordinates */
10  0 0 side  constraint 2
20  side 0 side  constraint 2
30  side  side^1 side fixed
40  0 2.0 side  fixed
50  1 1 side + 1

edges
1 10 20 color red
2 20 30
3 30 40
4 40 10
5 10 50
6 20 50
faces
1 1 6 -5 tension side/4 color blue
2 5 -6 2 3 4
bodies
1 1 2 volume 3 lagrange_multiplier 0.25
2 -2 density 2
read
hessian
"""


def test_foreign_datafile(tmp_path):
    path = tmp_path / "a.fe"
    path.write_text(CUBE.replace("side + 1", "side+1"))
    with pytest.warns(FileWarning, match="1 polygons were cut .*; body 2 has no pressure in the file"):
        surface = pcmc.read(path)
    assert surface.plane == pcmc.Plane((0.0, 0.0, 2.0))
    np.testing.assert_allclose(surface.vertices[[2, 4]], [[2, 2, 2], [1, 1, 3]])
    assert np.flatnonzero(surface.on_plane).tolist() == [0, 1]
    assert np.flatnonzero(surface.fixed).tolist() == [2, 3]
    assert surface.patch_of_face.tolist() == [0, 1, 1, 1]
    assert surface.tensions.tolist() == [0.5, 1.0]
    assert surface.pressures.tolist() == [0.25, -0.75]  # of two bodies on its two sides


def test_the_edges_of_a_patch_that_lies_on_the_plane_slide_on_it(tmp_path):
    """Surface Evolver refines it as pcmc does: five vertices on the ground, and eight edges."""
    X = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, 0]]
    F = [[k, (k + 1) % 4, top] for top in (4, 5) for k in range(4)]
    patches = [pcmc.Patch("drop", 1.0), pcmc.Patch("ground", 0.5, pressure=0.0)]
    drop = pcmc.Surface(X, F, [0] * 4 + [1] * 4, patches, on_plane=[0, 1, 2, 3, 5])
    pcmc.write(tmp_path / "a.fe", drop)
    assert (tmp_path / "a.fe").read_text().count(" constraint 1\n") == 5 + 8


FE = {
    "no faces": ("faces\n", "facettes\n", "faces", "no faces section"),
    "a word": ("20  side 0", "20  sid 0", 10, r"'sid' \('sid' is not a number, a parameter"),
    "too few": ("40  0 2.0 side  fixed", "40  0 2.0", 12, "expected a vertex number and three"),
    "spaces": ("side^1", "side ^ 1 *", 11, r"'\^' "),
    "an edge": ("6 20 50", "6 20 60", 21, r"there is no vertex 60"),
    "a face's edge": ("1 1 6 -5", "1 1 7 -5", 23, "there is no edge 7"),
    "not a cycle": ("1 1 6 -5", "1 1 6 5", 23, "the edges of the face do not follow"),
    "a body's face": ("2 -2 density", "2 -3 density", 27, "there is no face 3"),
    "a pressure": ("0.25", "p", 26, r"'p' \("),
    "a tension": ("side/4 color", "x color", 23, "expected a number, found 'x'"),
    "a sphere": ("z/2 - 1 =", "z*z =", 5, r"constraint 2 is not a plane: 'z\*z"),
    "no coordinate": ("z/2 - 1 =", "1 =", 5, "constraint 2 is not a plane: .* no coordinate"),
    "no formula": ("FORMULA", "ENERGY", 1, "constraint 2 has no formula"),
    "two constraints": ("side 0 side  constraint 2", "side 0 side  constraint 2 3", 1, "constraint 3 has no"),
    "two planes": ("side 0 side  constraint 2", "side 0 side  constraint 3", 1, "constraint 3 has no"),
    "a boundary": ("20  side 0 side  constraint 2", "20  1 2 3 boundary 1", 10, "a vertex on a param"),
    "string model": ("SPACE_DIMENSION 3", "STRING", 3, r"string is not supported; load the file"),
    "not finite": ("2*sqrt(4)/2", "1/0", 2, r"'1/0' \(divide by zero"),
    "letters": ("1 10 20 color", "1 ten 20 color", 16, "expected an edge number and two vertices"),
}  # fmt: skip


@pytest.mark.parametrize("case", FE)
def test_wrong_datafiles_name_the_line(tmp_path, case):
    old, new, where, message = FE[case]
    text = CUBE.replace("side + 1", "side+1")
    assert text.count(old) == 1
    path = tmp_path / "a.fe"
    path.write_text(text.replace(old, new))
    with refused(FileError, what=str(path), where=where) as caught:
        pcmc.read(path)
    assert re.search(message, str(caught.value))
    assert str(caught.value).startswith(f"{path}: ")


def test_datafile_without_bodies(tmp_path):
    path = tmp_path / "a.fe"
    path.write_text(CUBE.replace("side + 1", "side+1").split("bodies")[0])
    with pytest.warns(FileWarning, match="no bodies, so no patch is under pressure"):
        assert pcmc.read(path).pressures.tolist() == [0.0, 0.0]
