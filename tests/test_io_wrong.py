"""Files that are wrong, each in its own way."""

import re

import pytest

import pcmc
from pcmc.base.errors import FileError, PcmcError, SurfaceError
from tests.test_io_foreign import PLY, X, expected

meshio = pytest.importorskip("meshio")
pyvista = pytest.importorskip("pyvista")
rhino3dm = pytest.importorskip("rhino3dm")
trimesh = pytest.importorskip("trimesh")

V = "".join("v {} {} {}\n".format(*x) for x in X.tolist())
WRONG = {
    "obj, a coordinate": (".obj", "v 0 0 0\nv 1 zero 0\n", r"line 2: expected three coordinates"),
    "obj, two coordinates": (".obj", "v 0 0\n", r"line 1: expected three coordinates"),
    "obj, no faces": (".obj", V, "it holds no faces"),
    "obj, a number": (".obj", V + "f 1 2 x\n", r"line 7: expected vertex numbers, found 'f 1 2 x'"),
    "obj, a vertex": (".obj", V + "f 1 2 5\nf 1 2 9\n", r"line 8: the face names .* outside 1\.\.6"),
    "obj, zero": (".obj", V + "f 0 1 2\n", r"line 7: the face names a vertex outside"),
    "obj, two corners": (".obj", V + "f 1 2\n", "line 7: the face has fewer than three corners"),
    "obj, a support": (".obj", V + "g fixed\np 12\ng a\nf 1 2 5\n", r"a point here is outside 1\.\.6"),
    "obj, twice": (".obj", V + "f 1 2 5\nf 2 5 1\n", r"faces\[1\] is the same triangle"),
    "obj, reversed": (".obj", V + "f 1 2 5\nf 1 4 5\n", "not consistently oriented"),
    "obj, three at an edge": (
        ".obj", V + "v 0 0 1\nf 1 2 5\nf 5 2 6\nf 2 5 7\n", "3 of its faces share edge",
    ),
    "obj, flat": (".obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", r"faces\[0\] .* has zero area"),
    "obj, not finite": (".obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", r"vertices\[0\] .* not finite"),
    "obj, damaged comment": (".obj", "# pcmc {\n" + V + "f 1 2 5\n", "description is damaged"),
    "ply, no format": (".ply", "ply\nend_header\n", "no format that is known"),
    "ply, a type": (".ply", PLY.replace("uchar red", "colour red"), r"line 8: cannot be understood"),
    "ply, two lists": (
        ".ply", PLY.replace("property float weight", "property list uchar int more"),
        r"line 15: a second list",
    ),
    "ply, no z": (".ply", PLY.replace("property float z\n", ""), "no property z"),
    "ply, no faces": (".ply", PLY.replace("element face", "element edges"), "no vertices and faces"),
    "ply, no corners": (".ply", PLY.replace("vertex_index", "texture"), "list no vertex_indices"),
    "ply, a word": (".ply", PLY.replace("2 1 0.5", "2 one 0.5"), "not all numbers"),
    "ply, an index": (".ply", PLY.replace("1 2 5 4 3.5", "1 2 6 4 3.5"), r"outside 0\.\.5"),
    "ply, cut off": (".ply", PLY[: PLY.index("8 4")], "cut off: .* 3 face elements"),
    "stl, cut off": (".stl", "solid a\nfacet normal 0 0 1\n outer loop\n", "line 3: cut off before"),
    "stl, no triangles": (".stl", b"\0" * 84, "no triangles|not a readable"),
    "vtp, damaged": (".vtp", "<VTKFile>\n<Piece>\n</VTKFile>", "not a readable vtp file|no faces"),
    "glb, damaged": (".glb", b"glTF\2\0\0\0\x20\0\0\0\4\0\0\0JSON{}  ", "not a readable glTF|no tri"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_said_in_one_line(tmp_path, case, capfd):
    suffix, data, message = WRONG[case]
    path = tmp_path / f"file{suffix}"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    with pytest.raises(PcmcError, match=message) as caught:
        pcmc.read(path, fixed="boundary")
    assert isinstance(caught.value, FileError | SurfaceError)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_a_gltf_that_is_cut_off_or_without_its_parts_says_so(tmp_path):
    path = tmp_path / "roof.gltf"
    pcmc.write(path, expected())
    whole = path.read_text(encoding="utf-8")
    path.write_text(whole[: len(whole) // 2], encoding="utf-8")
    with pytest.raises(FileError, match=r"roof\.gltf: not a readable glTF file, or cut off"):
        pcmc.read(path)
    path.write_text(re.sub(r'"uri": ?"data:[^"]*"', '"uri":"part.bin"', whole), encoding="utf-8")
    with pytest.raises(FileError, match=r"roof\.gltf: its part part\.bin is not beside it"):
        pcmc.read(path)
