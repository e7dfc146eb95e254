"""Files that other programs write."""

import numpy as np
import pytest
from refusals import refused
from shapes import pyramid

import pcmc
from pcmc.base.errors import FileError, FileWarning, FreeSurfaceWarning
from pcmc.io import load
from pcmc.io.mesh_data import scaled_surface
from pcmc.io.polygons import cut_polygons

meshio = pytest.importorskip("meshio")
pyvista = pytest.importorskip("pyvista")
rhino3dm = pytest.importorskip("rhino3dm")
trimesh = pytest.importorskip("trimesh")

# Two unit squares side by side, with a step at the far end, in quads and in triangles.
X = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0.5]], dtype=float)
QUADS = [[0, 1, 4, 3], [1, 2, 5, 4]]
TRIANGLES = np.array([[0, 1, 4], [0, 4, 3], [1, 2, 4], [2, 5, 4]])


def check(surface, names=("left", "right")):
    """The two squares, all of their boundary held."""
    assert surface.n == 6
    assert surface.m == 4
    assert [p.name for p in surface.patches] == list(names)
    assert surface.fixed.all()
    assert set(surface.tensions) == {1.0} == set(surface.pressures)
    assert pcmc.energy(surface.moved(surface.vertices)) == pytest.approx(pcmc.energy(expected()))
    order = np.lexsort(surface.vertices.T)
    np.testing.assert_allclose(surface.vertices[order], X[np.lexsort(X.T)], atol=1e-7)


def expected():
    patches = [pcmc.Patch("left", 1.0), pcmc.Patch("right", 1.0)]
    return pcmc.Surface(X, TRIANGLES, [0, 0, 1, 1], patches, fixed=range(6))


def halves():
    """The two squares as trimesh meshes with vertices of their own."""
    meshes = [trimesh.Trimesh(X, TRIANGLES[k : k + 2], process=False) for k in (0, 2)]
    for mesh in meshes:
        mesh.remove_unreferenced_vertices()
    return meshes


@pytest.mark.parametrize("suffix", [".obj", ".glb", ".gltf", ".stl"])
def test_trimesh_scenes(tmp_path, suffix):
    scene = trimesh.Scene()
    up = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])  # glTF's y is up
    for name, mesh in zip(("left", "right"), halves(), strict=True):
        if suffix in (".glb", ".gltf"):
            mesh.apply_transform(up)
        scene.add_geometry(mesh, geom_name=name, node_name=name)
    path = tmp_path / f"two{suffix}"
    if suffix == ".gltf":
        for name, data in scene.export(file_type="gltf").items():
            (tmp_path / name.replace("model.gltf", path.name)).write_bytes(data)
    elif suffix == ".stl":
        path.write_text(
            "".join(
                m.export(file_type="stl_ascii").replace("solid", f"solid {n}", 1)
                for n, m in zip(("left", "right"), halves(), strict=True)
            )
        )
    else:
        path.write_bytes(
            trimesh.util.decode_text(scene.export(file_type=suffix[1:])).encode()
            if suffix == ".obj"
            else scene.export(file_type="glb")
        )
    check(pcmc.read(path))


@pytest.mark.parametrize("suffix", [".ply", ".stl"])
def test_trimesh_single_meshes(tmp_path, suffix):
    trimesh.Trimesh(X, TRIANGLES, process=False).export(tmp_path / f"roof{suffix}")
    check(pcmc.read(tmp_path / f"roof{suffix}"), names=["roof"])


@pytest.mark.parametrize("suffix", [".vtp", ".vtu", ".ply", ".stl", ".obj"])
@pytest.mark.parametrize("binary", [True, False])
def test_pyvista(tmp_path, suffix, binary):
    mesh = pyvista.PolyData.from_irregular_faces(X, QUADS)
    mesh.cell_data["RegionId"] = [3, 7]
    if suffix == ".vtu":
        mesh = mesh.cast_to_unstructured_grid()
    path = tmp_path / f"roof{suffix}"
    if suffix in (".stl", ".obj"):
        mesh = mesh.triangulate()
    if suffix == ".obj":
        pyvista.save_meshio(path, mesh)
    else:
        mesh.save(path, binary=binary)
    labelled = suffix in (".vtp", ".vtu")
    if suffix in (".stl", ".obj"):
        surface = pcmc.read(path)
    else:
        with pytest.warns(FileWarning, match=f"{path}: 2 quads were cut into triangles"):
            surface = pcmc.read(path)
    names = ("patch 3", "patch 7") if labelled else ("roof",)
    if suffix == ".stl" and not binary:
        names = ("Visualization Toolkit generated SLA File",)
    assert [p.name for p in surface.patches] == list(names)
    assert (surface.n, surface.m) == (6, 4)
    assert surface.fixed.all()


def test_vtk_cells_of_other_kinds(tmp_path):
    lines = pyvista.PolyData(X, faces=[3, 0, 1, 4, 3, 0, 4, 3], lines=[2, 0, 1])
    lines.cell_data["patch"] = [5, 1, 1]  # the line's comes first
    lines.save(tmp_path / "a.vtp")
    with pytest.warns(FileWarning, match="2 vertices that no face uses were left out"):
        surface = pcmc.read(tmp_path / "a.vtp")
    assert (surface.n, surface.m, surface.patches[0].name) == (4, 2, "patch 1")
    strip = pyvista.PolyData(X, strips=[4, 0, 1, 3, 4])
    strip.save(tmp_path / "s.vtp")
    with pytest.warns(FileWarning):
        assert pcmc.read(tmp_path / "s.vtp").m == 2
    solid = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: np.array([[0, 1, 3, 5]])}, X)
    solid.save(tmp_path / "a.vtu")
    with refused(FileError, where=0, found=10):
        pcmc.read(tmp_path / "a.vtu")


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".vtu", ".stl"])
@pytest.mark.parametrize("binary", [True, False])
def test_meshio(tmp_path, suffix, binary):
    cells = [("triangle", TRIANGLES[:2]), ("quad", np.array(QUADS[1:]))]
    if suffix == ".stl":
        cells = [("triangle", TRIANGLES)]
    path = tmp_path / f"roof{suffix}"
    options = {} if suffix == ".obj" else {"binary": binary}
    data = {} if suffix != ".vtu" else {"gmsh:physical": [[1, 1], [2]]}
    meshio.write(path, meshio.Mesh(X, cells, cell_data=data), **options)
    names = ("patch 1", "patch 2") if data else ("roof",)
    if suffix == ".stl":
        return check(pcmc.read(path), names)
    with pytest.warns(FileWarning, match="1 quads were cut into triangles"):
        surface = pcmc.read(path)
    check(surface, names)


@pytest.mark.parametrize(("factor", "tolerance"), [(1.0, 1e-6), (1e3, 1e-3), (1e-3, 1e-9)])
def test_rhino_works_with_a_tolerance_of_the_size_of_the_roof(tmp_path, factor, tolerance):
    pcmc.write(tmp_path / "a.3dm", scaled_surface(pyramid(), factor))
    model = rhino3dm.File3dm.Read(str(tmp_path / "a.3dm"))
    assert model.Settings.ModelAbsoluteTolerance == pytest.approx(tolerance)


def test_rhino_quads_on_layers(tmp_path):
    model = rhino3dm.File3dm()
    for name, quad in zip(("left", "right"), QUADS, strict=True):
        layer = rhino3dm.Layer()
        layer.Name = name
        mesh = rhino3dm.Mesh()
        for k in quad:
            mesh.Vertices.Add(*X[k])
        mesh.Faces.AddFace(0, 1, 2, 3)
        attributes = rhino3dm.ObjectAttributes()
        attributes.LayerIndex = model.Layers.Add(layer)
        model.Objects.AddMesh(mesh, attributes)
    model.Objects.AddPoint(rhino3dm.Point3d(0, 0, 0))
    model.Write(str(tmp_path / "a.3dm"), 7)
    with pytest.warns(FileWarning, match=r"2 quads were .*; 1 objects that are not meshes were"):
        check(pcmc.read(tmp_path / "a.3dm", units="mm"))  # the library's own unit
    empty = rhino3dm.File3dm()
    empty.Objects.AddPoint(rhino3dm.Point3d(0, 0, 0))
    empty.Write(str(tmp_path / "b.3dm"), 7)
    with refused(FileError, what=str(tmp_path / "b.3dm"), where="meshes", found=0):
        pcmc.read(tmp_path / "b.3dm")


def test_junctions_written_apart_are_joined(tmp_path):
    """Each patch with vertices of its own, nearly at the same places, as drawing programs do."""
    wall = np.array([[1, 0, 0], [1, 1, 0], [1, 1, -1], [1, 0, -1.0]])
    jitter = 1e-9 * np.random.default_rng(0).normal(size=(18, 3))
    parts = [X[[0, 1, 4, 3]], X[[1, 2, 5, 4]], wall]
    text = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in (np.concatenate(parts) + jitter[:12]).tolist())
    for k, name in enumerate(("left", "right", "wall")):
        text += f"g {name}\nf {4 * k + 1} {4 * k + 2} {4 * k + 3}\nf {4 * k + 1} {4 * k + 3} {4 * k + 4}\n"
    (tmp_path / "a.obj").write_text(text)
    surface = pcmc.read(tmp_path / "a.obj")
    assert surface.n == 8
    assert surface.topology.junction_edge.sum() == 1
    assert surface.topology.on_junction.sum() == 2


OBJ = {
    "names by o": ("o a\nf 1 2 5\no b\nf 1/1 5/2/3 4//1\n", ["a", "b"], 2),
    "names by material": ("usemtl red\nf 1 2 5\nusemtl blue\nf 1 5 4\n", ["red", "blue"], 2),
    "one group twice": ("g a\nf 1 2 5\ng b\nf 2 3 6\ng a\nf 1 5 4\n", ["a", "b"], 3),
    "counted back": ("g a\nf -6 -5 -2\nv 9 9 9\nf -7 -3 -4\n", ["a"], 2),
    "no names": ("s off\nf 1 2 5\nl 1 2\n", ["file"], 1),
    "a line that goes on": ("f 1 2 \\\n 5\n", ["file"], 1),
    "a pentagon": ("f 1 2 3 6 4\n", ["file"], 3),
}


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.FileWarning")
@pytest.mark.parametrize("case", OBJ)
def test_obj_dialects(tmp_path, case):
    text, names, faces = OBJ[case]
    head = "# other\nmtllib x.mtl\nvn 0 0 1\n" + "".join("v {} {} {}\n".format(*x) for x in X.tolist())
    (tmp_path / "file.obj").write_text(head + text)
    surface = pcmc.read(tmp_path / "file.obj")
    assert [p.name for p in surface.patches] == names
    assert surface.m == faces


PLY = """ply
format ascii 1.0
comment made by hand
element vertex 6
property float x
property float y
property float z
property uchar red
element edge 1
property int vertex1
property int vertex2
element face 3
property uchar flag
property list uchar int vertex_index
property float weight
end_header
0 0 0 255
1 0 0 255
2 0 0 255
0 1 0 255
1 1 0 255
2 1 0.5 255
0 1
7 3 0 1 4 1.5
7 3 0 4 3 2.5
8 4 1 2 5 4 3.5
"""


@pytest.mark.parametrize("order", ["ascii", "<", ">"])
def test_ply_in_every_form(tmp_path, order):
    path = tmp_path / "a.ply"
    path.write_text(PLY)
    if order != "ascii":
        name = "binary_little_endian" if order == "<" else "binary_big_endian"
        head = PLY[: PLY.index("0 0 0 255")].replace("ascii", name).encode()
        body = b"".join(np.array([*x], f"{order}f4").tobytes() + b"\xff" for x in X)
        body += np.array([0, 1], f"{order}i4").tobytes()
        for flag, face, weight in ((7, (0, 1, 4), 1.5), (7, (0, 4, 3), 2.5), (8, QUADS[1], 3.5)):
            body += bytes([flag, len(face)]) + np.array(face, f"{order}i4").tobytes()
            body += np.array([weight], f"{order}f4").tobytes()
        path.write_bytes(head + body)
    with pytest.warns(FileWarning, match="1 quads"):
        check(pcmc.read(path), names=["a"])
    contents = load(path)
    assert contents.scalars["weight"].tolist() == [1.5, 2.5, 3.5, 3.5]
    assert contents.scalars["flag"].tolist() == [7, 7, 8, 8]
    assert set(contents.scalars["red"]) == {255.0}


def test_a_face_of_a_binary_ply_without_corners_is_named_as_in_text(tmp_path):
    head = (
        PLY[: PLY.index("element face")]
        .replace("ascii", "binary_little_endian")
        .replace("comment", "comment")
    )
    head += "element face 2\nproperty list uchar int vertex_index\nend_header\n"
    body = b"".join(np.array([*x], "<f4").tobytes() + b"\xff" for x in X) + np.array([0, 1], "<i4").tobytes()
    (tmp_path / "a.ply").write_bytes(
        head.encode() + body + b"\3" + np.array([0, 1, 4], "<i4").tobytes() + b"\0"
    )
    with pytest.raises(FileError, match="face 1 has 0 corners; a face needs three or more"):
        pcmc.read(tmp_path / "a.ply")


def test_a_gltf_whose_numbers_are_beside_it_may_be_small(tmp_path):
    ball = trimesh.creation.icosphere(3)
    for name, data in trimesh.Scene({"ball": ball}).export(file_type="gltf").items():
        (tmp_path / name).write_bytes(data)
    with pytest.warns(FreeSurfaceWarning):
        assert pcmc.read(tmp_path / "model.gltf", tensions=0.5).m == len(ball.faces)


def test_polygons_are_cut_well():
    dart = np.array([[0, 0, 0], [2, 2, 0], [0, 1, 0], [-2, 2, 0.0]])  # concave at 2
    faces, origin, notes = cut_polygons(dart, np.arange(4), np.array([4]))
    assert sorted(sorted(f) for f in faces.tolist()) == [[0, 1, 2], [0, 2, 3]]
    assert origin.tolist() == [0, 0]
    assert notes == ("1 quads were cut into triangles",)
    normal = np.cross(dart[faces[:, 1]] - dart[faces[:, 0]], dart[faces[:, 2]] - dart[faces[:, 0]])
    assert (normal[:, 2] > 0).all()
    angle = 2 * np.pi * np.arange(6) / 6
    hexagon = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    corners = np.array([0, 1, 2, 0, 1, 2, 3, 4, 5])
    faces, origin, notes = cut_polygons(hexagon, corners, np.array([3, 6]))
    assert origin.tolist() == [0, 1, 1, 1, 1]
    assert notes == ("1 polygons were cut into triangles",)
    comb = np.array(
        [[0, 0], [5, 0], [5, 3], [4, 3], [4, 1], [3, 1], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]]
    )
    with refused(FileError, where=0, found=12):
        cut_polygons(np.pad(1.0 * comb, ((0, 0), (0, 1))), np.arange(12), np.array([12]))


def test_closed_mesh_is_free(tmp_path):
    trimesh.creation.icosphere(1).export(tmp_path / "ball.stl")
    with pytest.warns(FreeSurfaceWarning):
        ball = pcmc.read(tmp_path / "ball.stl", tensions=0.5)
    assert (ball.n, ball.m) == (42, 80)
    assert not ball.fixed.any()
    assert ball.patches == (pcmc.Patch("ball", 0.5),)
