"""Files made to mislead a reader: each is refused in one line, in bounded time and memory."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from refusals import refused

import pcmc
from pcmc import cli
from pcmc.base import child_script, libraries
from pcmc.base.errors import FileError, FileWarning
from tests.io.test_io_foreign import X, expected

pytest.importorskip("pyvista")
pytest.importorskip("rhino3dm")
pytest.importorskip("trimesh")

V = "".join("v {} {} {}\n".format(*x) for x in X.tolist())
PLY = """ply
format ascii 1.0
element vertex {vertices}
property float x
property float y
property float z
element face {faces}
property list {kind} int vertex_indices
end_header
"""
BINARY = PLY.replace("ascii", "binary_little_endian")


def ply(body, vertices=3, faces=1, kind="uchar", header=PLY):
    return header.format(vertices=vertices, faces=faces, kind=kind).encode() + body


TRIANGLE = b"0 0 0\n1 0 0\n0 1 0\n"
WRONG = {  # the suffix, the content, and where the error is
    "obj, an index of 23 digits": (".obj", V + f"f 1 2 {'9' * 23}\n", 7),
    "obj, an index of 5000 digits": (".obj", V + f"f 1 2 {'9' * 5000}\n", 7),
    "obj, two signs": (".obj", V + "f 1 2 --5\n", 7),
    "obj, a support of 23 digits": (".obj", V + f"g fixed\np {'9' * 23}\ng a\nf 1 2 5\n", 8),
    "obj, a point after very many spaces": (".obj", V + f"g fixed\np{' ' * 100_000}x\n", "faces"),
    "obj, a polygon of 3000 corners": (".obj", "v 0 0 0\n" * 3000 + f"f{' 1 2 3' * 1000}\n", 0),
    "obj, far out": (".obj", "v 1e300 0 0\nv 0 1e300 0\nv 0 0 1\nv 1 1 1\nf 1 2 3 4\n", 0),
    "ply, very many vertices": (".ply", ply(b"0 0 0\n", 10**12), "vertex"),
    "ply, very many rows of nothing": (
        ".ply",
        ply(TRIANGLE).replace(b"element", b"element none 1000000000000\nelement", 1),
        "none",
    ),
    "ply, a number of 400 digits": (".ply", ply(b"0 0 0\n", int("9" * 400)), 3),
    "ply, fewer than none": (".ply", ply(b"0 0 0\n", -3), 3),
    "ply, a list of 2^32 - 1": (".ply", ply(bytes(36) + b"\xff" * 8, faces=2, kind="uint", header=BINARY), 0),
    "ply, a list of 2^64 - 1": (".ply", ply(bytes(36) + b"\xff" * 16, kind="uint64", header=BINARY), 0),
    "ply, a list of -1": (".ply", ply(TRIANGLE + b"-1 0 1 2\n"), 0),
    "ply, a list of no number": (".ply", ply(TRIANGLE + b"nan 0 1 2\n"), 0),
    "ply, a list of infinity": (".ply", ply(TRIANGLE + b"inf 0 1 2\n"), 0),
    "ply, no corner": (".ply", ply(TRIANGLE + b"3 0 1 nan\n"), 0),
    "ply, half a corner": (".ply", ply(TRIANGLE + b"3 0 1 1.5\n"), 0),
    "ply, a name twice": (".ply", ply(TRIANGLE).replace(b"float y", b"float x"), "header"),
    "ply, corners without a list": (".ply", ply(TRIANGLE).replace(b"list uchar int", b"int"), "face"),
    "vtu, very many cells": (".vtu", '<VTKFile><Piece NumberOfCells="400000000">\n</VTKFile>', 1),
    "vtu, a count of 400 digits": (".vtu", f'<VTKFile><Piece NumberOfCells="{"9" * 400}">\n</VTKFile>', 1),
}


@pytest.mark.parametrize("case", WRONG)
def test_absurd_numbers_are_refused(tmp_path, case, capfd):
    suffix, content, where = WRONG[case]
    path = tmp_path / f"file{suffix}"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with refused(FileError, what=str(path), where=where) as caught:
        pcmc.read(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400 + len(str(path))
    assert capfd.readouterr() == ("", "")


def test_the_command_says_it_in_one_line(tmp_path, capfd):
    (tmp_path / "a.obj").write_text(V + f"f 1 2 {'9' * 23}\n", encoding="utf-8")
    assert cli.main(["certify", str(tmp_path / "a.obj")]) == 2
    out, err = capfd.readouterr()
    assert (out, err.count("\n")) == ("", 1)


# ---- Surface Evolver


def evolver(tmp_path, old, new, times=1):
    """A datafile with a change."""
    path = tmp_path / "a.fe"
    pcmc.write(path, expected())
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, times), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("0.5 fixed", f"{'-' * 100_000}0.5 fixed"),
        ("0.5 fixed", f"{'(' * 240}0.5{')' * 240} fixed"),
        ("0.5 fixed", "9^9^9^9^9 fixed"),
        ("0.5 fixed", "\0 fixed"),
        ("\n6 ", f"\n{2**63 + 5} "),
        ("\n6 ", f"\n{'9' * 5000} "),
        (" fixed", f" constraint {'9' * 5000}"),
        ("EDGES\n1 ", f"EDGES\n{2**70} "),
        ("BODIES\n1 1", f"BODIES\n1 {2**63}"),
        ("FACES\n1 ", f"FACES\n{2**63} "),
    ],
)
def test_numbers_of_an_evolver_file(tmp_path, old, new):
    path = evolver(tmp_path, old, new)
    with refused(FileError, what=str(path)) as caught:
        pcmc.read(path)
    assert isinstance(caught.value.where, int)
    assert f"line {caught.value.where}: " in str(caught.value)


def test_comments_that_do_not_end_take_no_time(tmp_path):
    path = tmp_path / "a.fe"
    path.write_text("/*" * 200_000, encoding="utf-8")
    with refused(FileError, what=str(path), where="vertices"):
        pcmc.read(path)


# ---- glTF


def gltf(tmp_path, change, name="a.glb"):
    """A .glb or .gltf with a changed header."""
    path = tmp_path / name
    pcmc.write(path, expected())
    data = path.read_bytes()
    if name.endswith(".gltf"):
        header = json.loads(data)
        change(header, None)
        path.write_text(json.dumps(header), encoding="utf-8")
        return path
    size = int.from_bytes(data[12:16], "little")
    header, rest = json.loads(data[20 : 20 + size]), bytearray(data[20 + size :])
    change(header, rest)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    path.write_bytes(data[:12] + struct.pack("<I", len(text)) + b"JSON" + text + rest)
    return path


def corner(number):
    """Another first corner in the first mesh."""

    def change(header, rest):
        accessor = header["accessors"][header["meshes"][0]["primitives"][0]["indices"]]
        start = 8 + header["bufferViews"][accessor["bufferView"]]["byteOffset"]
        rest[start : start + 4] = struct.pack("<I", number)

    return change


@pytest.mark.parametrize("number", [2**31 - 1, 2**32 - 1, 5])
def test_corners_outside_a_mesh_are_refused_also_inside_the_next(tmp_path, number):
    path = gltf(tmp_path, corner(number))
    with refused(FileError, what=str(path), where=0):
        pcmc.read(path)


@pytest.mark.parametrize("count", [10**9, 10**30, -1])
def test_arrays_without_bytes_are_refused(tmp_path, count):
    def change(header, rest):
        for accessor in header["accessors"]:
            accessor.pop("bufferView")
            accessor["count"] = count

    path = gltf(tmp_path, change)
    with refused(FileError, what=str(path), where=0, found=count):
        pcmc.read(path)


@pytest.mark.parametrize("part", ["pipe", "/pipe", "missing/pipe", "/dev/zero"])
def test_parts_that_are_pipes_or_devices_are_refused(tmp_path, part):
    os.mkfifo(tmp_path / "pipe")
    path = gltf(tmp_path, lambda header, _: header["buffers"][0].update(uri=part), "a.gltf")
    with refused(FileError, what=str(path)) as caught:
        pcmc.read(path)
    assert "is no regular file" in str(caught.value)


# ---- .pcmc


def native(tmp_path, **arrays):
    """A .pcmc with other arrays."""
    path = tmp_path / "a.pcmc"
    pcmc.write(path, expected())
    with np.load(path) as archive:
        old = {name: archive[name] for name in archive.files}
    with path.open("wb") as file:
        np.savez_compressed(file, **(old | arrays))
    return path


@pytest.mark.parametrize(
    ("name", "array"),
    [
        ("vertices", np.zeros(18)),
        ("vertices", np.zeros((6, 2))),
        ("vertices", np.zeros((0, 3))),
        ("vertices", np.zeros((6, 3), complex)),
        ("vertices", np.full((6, 3), "a")),
        ("faces", np.full((4, 3), "a")),
        ("faces", np.full((4, 3), 0.5)),
        ("faces", np.zeros((4, 4), int)),
        ("faces", np.zeros((0, 3), int)),
        ("patch_of_face", np.zeros(1, int)),
        ("patch_of_face", np.zeros(4)),
        ("support", np.zeros(2, int)),
        ("support", np.zeros(6)),
    ],
)
def test_arrays_of_the_wrong_shape_or_type_are_named(tmp_path, name, array):
    path = native(tmp_path, **{name: array})
    with refused(FileError, what=str(path), where=name, found=array.shape):
        pcmc.read(path)


@pytest.mark.parametrize(
    ("name", "array", "row"),
    [
        ("faces", np.full((4, 3), 10**9), 0),
        ("faces", np.array([[0, 1, 4], [0, 4, -3], [1, 2, 4], [2, 5, 4]]), 1),
        ("faces", np.full((4, 3), 2**64 - 1, dtype=np.uint64), 0),
        ("patch_of_face", np.array([0, 0, 2, 1]), 2),
        ("support", np.array([0, 0, 0, 3, 0, 0]), 3),
    ],
)
def test_numbers_out_of_range_are_named_with_their_row(tmp_path, name, array, row):
    path = native(tmp_path, **{name: array})
    with refused(FileError, what=str(path), where=row):
        pcmc.read(path)


def test_vertices_that_are_not_finite_or_too_far_out(tmp_path):
    for value in (np.nan, np.inf, 1e300):
        with refused(FileError):
            pcmc.read(native(tmp_path, vertices=np.full((6, 3), value)))


def test_an_archive_that_becomes_too_large_is_not_unpacked(tmp_path):
    path = native(tmp_path)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive, archive.open("more.npy", "w") as file:
        file.write(b"\x93NUMPY\x02\x00" + struct.pack("<I", 200_000_000))  # NumPy would read it all
        for _ in range(20):
            file.write(b" " * 10_000_000)
    with refused(FileError, what=str(path), where="size"):
        pcmc.read(path)


# ---- VTK


def vtk(tmp_path, suffix, old, new):
    """A VTK file in text with a change."""
    import pyvista

    surface = expected()
    mesh = pyvista.PolyData.from_regular_faces(surface.vertices, surface.faces)
    mesh.field_data["pcmc"] = ["text"]
    path = tmp_path / f"a{suffix}"
    (mesh if suffix == ".vtp" else mesh.cast_to_unstructured_grid()).save(path, binary=False)
    text = " ".join(path.read_text(encoding="utf-8").split())
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


@pytest.mark.parametrize("suffix", [".vtp", ".vtu"])
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("3 6 9 12", "3 6 -9000000000 12"),
        ("3 6 9 12", "3 6 9 999999999999"),
        ("3 6 9 12", "3 2 1 0"),
        ("0 1 4 0", "0 1 40000000 0"),
        ("0 1 4 0", "-1 1 4 0"),
        ('NumberOfPoints="6"', 'NumberOfPoints="5"'),
        ('NumberOfPoints="6"', 'NumberOfPoints="600000"'),
        ('NumberOfPoints="6"', 'NumberOfPoints="-6"'),
        ('NumberOfComponents="3"', 'NumberOfComponents="7"'),
    ],
)
def test_counts_and_offsets_that_vtk_believes(tmp_path, suffix, old, new, capfd):
    path = vtk(tmp_path, suffix, old, new)
    with refused(FileError, what=str(path)) as caught:
        pcmc.read(path)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("suffix", [".vtp", ".vtu"])
def test_field_data_without_a_value_are_none(tmp_path, suffix):
    path = vtk(tmp_path, suffix, 'NumberOfTuples="1"', 'NumberOfTuples="0"')
    with pytest.warns(FileWarning):
        assert pcmc.io.read_bare(path)[0].m == 4


def test_a_reader_that_dies_is_an_error_and_the_next_file_is_read(tmp_path, monkeypatch):
    pcmc.write(tmp_path / "a.vtp", expected())
    dying = "import sys; sys.stdin.buffer.read(100); sys.exit(3)"
    real = child_script.__file__
    monkeypatch.setattr(libraries, "_processes", {})
    (tmp_path / "dying.py").write_text(dying, encoding="utf-8")
    monkeypatch.setattr(child_script, "__file__", str(tmp_path / "dying.py"))
    with pytest.raises(FileError, match=r"it ends its reader, code"):
        pcmc.read(tmp_path / "a.vtp")
    monkeypatch.setattr(child_script, "__file__", real)
    assert pcmc.read(tmp_path / "a.vtp").m == 4
    for process in libraries._processes.values():
        process.close()


def test_a_reader_that_takes_too_long_is_stopped(tmp_path, monkeypatch):
    pcmc.write(tmp_path / "a.3dm", expected())
    monkeypatch.setattr(libraries, "_processes", {})
    monkeypatch.setattr(libraries, "SECONDS", 0.2)
    (tmp_path / "slow.py").write_text("import time; time.sleep(600)", encoding="utf-8")
    monkeypatch.setattr(child_script, "__file__", str(tmp_path / "slow.py"))
    with pytest.raises(FileError, match="stopped after"):
        pcmc.read(tmp_path / "a.3dm")


def test_a_reader_may_not_fill_the_memory(tmp_path):
    code = (
        "import numpy as np\n"
        "from pcmc.base.child_script import limit_memory\n"
        "limit_memory(1000)\n"
        "np.ones(2**31)\n"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "MemoryError" in told.stderr or sys.platform != "linux"  # others cannot limit it


# ---- many groups


@pytest.mark.parametrize("negative", [False, True])
def test_very_many_groups_are_read_in_one_pass(tmp_path, negative, monkeypatch):
    from pcmc.io import obj

    n, passes = 300, []
    monkeypatch.setattr(obj, "VERTEX", Counted(obj.VERTEX, passes))
    vertices = "".join(f"v {k // 2} {k % 2} 0\n" for k in range(n + 2))
    faces = ""
    for k in range(n):
        a, b, c = (k, k + 1, k + 2) if k % 2 else (k + 1, k, k + 2)
        shift = -(n + 2) if negative else 1
        faces += f"g g{k}\nf {a + shift} {b + shift} {c + shift}\n"
    (tmp_path / "a.obj").write_text(vertices + faces, encoding="utf-8")
    surface = pcmc.read(tmp_path / "a.obj")
    assert [p.name for p in surface.patches] == [f"g{k}" for k in range(n)]
    np.testing.assert_array_equal(surface.patch_of_face, np.arange(n))
    assert len(passes) == 1 + negative  # over the whole text


class Counted:
    """A pattern that notes each search with it."""

    def __init__(self, pattern, passes):
        self.pattern, self.passes = pattern, passes

    def __getattr__(self, name):
        def search(*arguments):
            self.passes.append(name)
            return getattr(self.pattern, name)(*arguments)

        return search
