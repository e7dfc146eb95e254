"""Files that are wrong, each in its own way."""

import re

import pytest
from refusals import refused

import pcmc
from pcmc.base.errors import FileError, SurfaceError
from pcmc.io.mesh_data import within
from tests.io.test_io_foreign import PLY, X, expected

meshio = pytest.importorskip("meshio")
pyvista = pytest.importorskip("pyvista")
rhino3dm = pytest.importorskip("rhino3dm")
trimesh = pytest.importorskip("trimesh")

V = "".join("v {} {} {}\n".format(*x) for x in X.tolist())
WRONG = {  # the suffix, what is in the file, and where the error is
    "obj, a coordinate": (".obj", "v 0 0 0\nv 1 zero 0\n", 2),
    "obj, a coordinate for Python": (".obj", V + "v 0 1_000 0\nf 1 2 7\n", 7),
    "obj, a corner for Python": (".obj", V + "f 1 2 0_5\n", 7),
    "ply, a number for Python": (".ply", PLY.replace("2 1 0.5", "2 1_0 0.5"), "body"),
    "stl, a number for Python": (
        ".stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1_0 0\n"
        "endloop\nendfacet\nendsolid a\n", 6,
    ),
    "fe, a number for Python": (".fe", "VERTICES\n1 0 0 0\n2 1_000 0 0\n3 0 1 0\nEDGES\n1 1 2\nFACES\n", 3),
    "obj, two coordinates": (".obj", "v 0 0\n", 1),
    "obj, no faces": (".obj", V, "faces"),
    "obj, a number": (".obj", V + "f 1 2 x\n", 7),
    "obj, a vertex": (".obj", V + "f 1 2 5\nf 1 2 9\n", 8),
    "obj, zero": (".obj", V + "f 0 1 2\n", 7),
    "obj, two corners": (".obj", V + "f 1 2\n", 7),
    "obj, a support": (".obj", V + "g fixed\np 12\ng a\nf 1 2 5\n", 8),
    "obj, damaged comment": (".obj", "# pcmc {\n" + V + "f 1 2 5\n", "metadata"),
    "ply, no format": (".ply", "ply\nend_header\n", "header"),
    "ply, a type": (".ply", PLY.replace("uchar red", "colour red"), 8),
    "ply, two lists": (
        ".ply", PLY.replace("property float weight", "property list uchar int more"), 15,
    ),
    "ply, no z": (".ply", PLY.replace("property float z\n", ""), "vertex"),
    "ply, no faces": (".ply", PLY.replace("element face", "element edges"), "header"),
    "ply, no corners": (".ply", PLY.replace("vertex_index", "texture"), "face"),
    "ply, a word": (".ply", PLY.replace("2 1 0.5", "2 one 0.5"), "body"),
    "ply, an index": (".ply", PLY.replace("1 2 5 4 3.5", "1 2 6 4 3.5"), 2),
    "ply, cut off": (".ply", PLY[: PLY.index("8 4")], "face"),
    "stl, cut off": (".stl", "solid a\nfacet normal 0 0 1\n outer loop\n", 3),
    "stl, binary, cut off": (".stl", b"\0" * 80 + b"\2\0\0\0" + b"\0" * 50, 2),
    "stl, no triangles": (".stl", b"\0" * 84, "faces"),
    "vtp, damaged": (".vtp", "<VTKFile>\n<Piece>\n</VTKFile>", None),
    "glb, damaged": (".glb", b"glTF\2\0\0\0\x20\0\0\0\4\0\0\0JSON{}  ", "faces"),
}  # fmt: skip
NO_SURFACE = {
    "a face twice": V + "f 1 2 5\nf 2 5 1\n",
    "faces against each other": V + "f 1 2 5\nf 1 4 5\n",
    "three faces at an edge": V + "v 0 0 1\nf 1 2 5\nf 5 2 6\nf 2 5 7\n",
    "a face without area": "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n",
    "no number": "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_files_are_refused_in_one_line_that_names_the_place(tmp_path, case, capfd):
    suffix, data, where = WRONG[case]
    path = tmp_path / f"file{suffix}"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    with refused(FileError, what=str(path), where=where) as caught:
        pcmc.read(path, fixed="boundary")
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    in_lines = isinstance(where, int) and suffix != ".ply" and isinstance(data, str)
    assert not in_lines or f": line {where}: " in message
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("case", NO_SURFACE)
def test_a_mesh_that_is_no_surface_is_refused_with_the_files_name(tmp_path, case):
    path = tmp_path / "file.obj"
    path.write_text(NO_SURFACE[case])
    with pytest.raises(FileError if case == "no number" else SurfaceError) as caught:
        pcmc.read(path, fixed="boundary")
    assert str(caught.value).startswith(f"{path}: ")


def test_a_gltf_that_is_cut_off_or_without_its_parts_says_so(tmp_path):
    path = tmp_path / "roof.gltf"
    pcmc.write(path, expected())
    whole = path.read_text(encoding="utf-8")
    path.write_text(whole[: len(whole) // 2], encoding="utf-8")
    with refused(FileError, what=str(path)):
        pcmc.read(path)
    path.write_text(re.sub(r'"uri": ?"data:[^"]*"', '"uri":"part.bin"', whole), encoding="utf-8")
    with refused(FileError, what=str(path), where="part.bin"):
        pcmc.read(path)


@pytest.mark.parametrize("name", ["a\0.obj", "\ud800.obj"])
def test_a_name_that_no_file_can_have_is_refused(name):
    with refused(FileError, what=name):
        pcmc.read(name)
    with refused(FileError, what=name):
        pcmc.write(name, expected())


def test_an_index_that_is_outside_is_named_with_what_is_inside():
    with refused(FileError, what="faces", where=1, found=[2, 3], expected=(0, 2)) as caught:
        within([[0, 1], [2, 3]], "faces", 3)
    assert str(caught.value).endswith("faces: entry 1 is 2, 3, outside 0..2")
