"""What VTK, rhino3dm, IfcOpenShell and MeshLab do in a process of their own: read files, and repair.

``base.libraries`` loads this file by its path: it imports nothing of pcmc, each function only its library.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

FLAT = 1e-12  # area over the squared longest edge: a triangle below has none
T_VERTEX = 1e6  # longest edge over height: such a triangle is taken out by flipping its longest edge
ROUNDS = 10  # of isotropic remeshing


def vtk_arrays(path: str) -> dict[str, Any]:
    """Points, cells, their data and pcmc's metadata in a VTK file; RuntimeError with VTK's reason."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow
    from vtkmodules.vtkFiltersCore import vtkAppendFilter, vtkTriangleFilter
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLUnstructuredGridReader

    said = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(said)
    flat = Path(path).suffix.lower() == ".vtp"
    reader = vtkXMLPolyDataReader() if flat else vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = mesh = reader.GetOutput()
    if flat:
        if mesh.GetNumberOfStrips():
            triangles = vtkTriangleFilter()
            triangles.SetInputData(mesh)
            triangles.Update()
            mesh = triangles.GetOutput()
        joined = vtkAppendFilter()
        joined.AddInputData(mesh)
        joined.Update()
        grid = joined.GetOutput()
    reasons = re.findall(r"^\w+ \(\w+\): (.+)$", said.GetOutput(), re.M) or said.GetOutput().split("\n")[:1]
    if reasons[0] or reader.GetErrorCode():
        raise RuntimeError(reasons[0] or f"VTK's error {reader.GetErrorCode()}")

    def numbers(array: Any, dtype: str) -> Any:
        return [] if array is None else vtk_to_numpy(array).astype(dtype, copy=False)

    def columns(data: Any) -> dict[str, Any]:
        listed = [data.GetArray(k) for k in range(data.GetNumberOfArrays())]
        return {a.GetName(): vtk_to_numpy(a) for a in listed if a is not None and a.GetName()}

    points, cells = grid.GetPoints(), grid.GetCells()
    text = reader.GetOutput().GetFieldData().GetAbstractArray("pcmc")
    return {
        "points": numbers(None if points is None else points.GetData(), "f8"),
        "corners": numbers(cells and cells.GetConnectivityArray(), "i8"),
        "offsets": numbers(cells and cells.GetOffsetsArray(), "i8"),
        "types": numbers(cells and grid.GetCellTypesArray(), "i8"),
        "point data": columns(grid.GetPointData()),
        "cell data": columns(grid.GetCellData()),
        "text": None if text is None or not text.GetNumberOfValues() else str(text.GetValue(0)),
    }


def rhino_arrays(path: str) -> dict[str, Any]:
    """Layers and objects of a Rhino file, names, user texts, meshes, points and lines; its unit system."""
    import rhino3dm

    rhino: Any = rhino3dm

    def coordinates(points: Any) -> Any:
        return np.array([(p.X, p.Y, p.Z) for p in points], dtype=np.float64).reshape(-1, 3)

    model = rhino.File3dm.Read(path)
    if model is None:
        raise RuntimeError("not a Rhino file, or cut off")
    layers = [{"name": layer.Name, "texts": dict(layer.GetUserStrings())} for layer in model.Layers]
    objects: list[dict[str, Any]] = []
    for item in model.Objects:
        geometry = item.Geometry
        held: dict[str, Any] = {"layer": item.Attributes.LayerIndex}
        if isinstance(geometry, rhino.Mesh):
            faces = [geometry.Faces[k] for k in range(geometry.Faces.Count)]
            held["faces"] = np.array(faces, dtype=np.int64).reshape(-1, 4)
            held["points"] = coordinates(geometry.Vertices.ToPoint3dArray())
        elif isinstance(geometry, rhino.PointCloud):
            held["points"] = coordinates(geometry.GetPoints())
        elif isinstance(geometry, rhino.PolylineCurve):
            held["line"] = coordinates(geometry.Point(k) for k in range(geometry.PointCount))
        objects.append(held)
    return {"layers": layers, "objects": objects, "unit": str(model.Settings.ModelUnitSystem.name)}


def ifc_arrays(path: str) -> dict[str, Any]:
    """The face sets of a roof that pcmc wrote, their names and supports, and pcmc's texts."""
    import ifcopenshell
    from ifcopenshell.util import element, placement

    get_pset: Any = element.get_pset
    model: Any = ifcopenshell.open(path)
    placed = bool(model.by_type("IfcMapConversion"))
    found: dict[str, Any] = {"text": None, "walls": None, "parts": [], "placed": placed}
    for roof in model.by_type("IfcRoof"):
        texts = get_pset(roof, "Pcmc_Surface")
        if not texts:
            continue
        found["text"], found["walls"] = texts["Description"], texts.get("Walls")
        for part in (part for whole in roof.IsDecomposedBy for part in whole.RelatedObjects):
            if not get_pset(part, "Pcmc_Patch"):  # a cable or a member
                continue
            item = part.Representation.Representations[0].Items[0]
            points = np.array(item.Coordinates.CoordList, dtype=np.float64).reshape(-1, 3)
            place = placement.get_local_placement(part.ObjectPlacement)
            mesh: dict[str, Any] = {"points": points @ place[:3, :3].T + place[:3, 3]}
            mesh["faces"] = np.array(item.CoordIndex, dtype=np.int64).reshape(-1, 3) - 1
            supports = get_pset(part, "Pcmc_Patch", "Supports")
            found["parts"].append({"name": part.Name, "supports": supports, **mesh})
        break
    return found


def meshlab_arrays(path: str) -> dict[str, Any]:
    """The meshes in a file that MeshLab reads: points, triangles and a name each."""
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(path)
    parts = [meshes.mesh(k) for k in range(meshes.mesh_number())]
    return {"meshes": [(one.label(), one.transformed_vertex_matrix(), one.face_matrix()) for one in parts]}


def repaired_arrays(path: str) -> dict[str, Any]:
    """The repaired mesh of an .npz with points, faces, patch and options, and what was changed."""
    import pymeshlab

    with np.load(path, allow_pickle=False) as data:
        X, F, patch = data["points"], data["faces"], data["patch"]
        weld, holes, edge_length = float(data["weld"]), int(data["holes"]), float(data["edge_length"])
    changes: Any = Counter()
    X, F, patch = _cleaned(X, F, patch, weld, changes)
    size = int(F.max()) + 1
    keys, count = np.unique(_edge_keys(F, size), return_counts=True)

    def single(faces: Any) -> Any:
        """(m,3) the edges that belong to one face of the whole mesh."""
        return np.isin(_edge_keys(faces, size), keys[count == 1])

    n, points, faces, owner = len(X), [X], [], []
    for number in np.unique(patch):
        local, vertex = _repaired_patch(X, F[patch == number], single, holes, changes)
        if edge_length > 0.0:  # the only patch: the curves between patches would tear
            meshes = _meshset(X, vertex[local])
            meshes.meshing_remove_unreferenced_vertices()
            length = pymeshlab.PureValue(edge_length)
            options = {"iterations": ROUNDS, "targetlen": length, "checksurfdist": False}
            meshes.meshing_isotropic_explicit_remeshing(**options)
            mesh = meshes.current_mesh()
            X, F = mesh.vertex_matrix(), mesh.face_matrix()
            return {"points": X, "faces": F, "patch": np.full(len(F), number), "changes": dict(changes)}
        first = np.zeros(len(vertex), dtype=bool)
        first[np.unique(vertex, return_index=True)[1]] = True
        new = np.where(first, vertex, 0)
        new[~first] = n + np.arange(np.count_nonzero(~first))  # copies where an edge was split
        points.append(X[vertex[~first]])
        n += int(np.count_nonzero(~first))
        faces.append(new[local])
        owner.append(np.full(len(local), number))
    used, inverse = np.unique(np.concatenate(faces), return_inverse=True)
    X, F = np.concatenate(points)[used], inverse.reshape(-1, 3)
    return {"points": X, "faces": F, "patch": np.concatenate(owner), "changes": dict(changes)}


def _meshset(X: Any, F: Any, **data: Any) -> Any:
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(np.ascontiguousarray(X), np.ascontiguousarray(F, dtype=np.int32), **data))
    return meshes


def _cleaned(X: Any, F: Any, patch: Any, weld: float, changes: Any) -> Any:
    """Without points that are no numbers, near copies of vertices, and repeated triangles."""
    import pymeshlab

    sound = np.isfinite(X).all(axis=1)
    known = sound[F].all(axis=1)
    changes["triangles at points that are no numbers left out"] = int(np.count_nonzero(~known))
    X, label = np.where(sound[:, None], X, 0.0), patch[known].astype(float)
    meshes = _meshset(X, F[known], f_scalar_array=label)
    before = len(np.unique(F[known]))
    meshes.meshing_remove_unreferenced_vertices()
    if weld > 0.0:
        meshes.meshing_merge_close_vertices(threshold=pymeshlab.PureValue(weld))
    mesh = meshes.current_mesh()
    changes["vertices welded"] = before - mesh.vertex_number()
    faces = mesh.face_matrix()
    whole = (faces != faces[:, [1, 2, 0]]).all(axis=1)
    changes["triangles without area left out"] = len(label) - int(np.count_nonzero(whole))
    meshes = _meshset(mesh.vertex_matrix(), faces[whole], f_scalar_array=mesh.face_scalar_array()[whole])
    before = meshes.current_mesh().face_number()
    meshes.meshing_remove_duplicate_faces()
    mesh = meshes.current_mesh()
    changes["repeated triangles left out"] = before - mesh.face_number()
    if not mesh.face_number():
        raise RuntimeError("no triangle is left; is its weld distance larger than its triangles?")
    return mesh.vertex_matrix(), mesh.face_matrix(), mesh.face_scalar_array().astype(np.int64)


def _edge_keys(F: Any, n: int) -> Any:
    """(m,3) a number for each edge of each face."""
    ends = np.stack([F, np.roll(F, -1, axis=1)])
    return ends.min(axis=0).astype(np.int64) * n + ends.max(axis=0)


def _area_vectors(X: Any, F: Any) -> Any:
    a, b, c = (X[F[:, k]] for k in range(3))
    return 0.5 * np.cross(b - a, c - a)


def _repaired_patch(X: Any, F: Any, single: Any, holes: int, changes: Any) -> tuple[Any, Any]:
    """Triangles (m,3) of a patch, and the vertex of the whole mesh (n,) that each of its vertices is."""
    used, local = np.unique(F, return_inverse=True)
    meshes = _meshset(X[used], local.reshape(-1, 3), v_scalar_array=used.astype(float))
    before = _flat(X, F)
    if before.any():
        meshes.meshing_remove_t_vertices(method="Edge Flip", threshold=T_VERTEX, repeat=True)
        mesh = meshes.current_mesh()
        vertex, faces = _vertices(mesh), mesh.face_matrix()
        flat = _flat(mesh.vertex_matrix(), faces)
        changes["triangles without area left out"] += np.count_nonzero(flat)
        away = np.count_nonzero(before) - np.count_nonzero(flat)
        changes["triangles without area flipped away"] += max(away, 0)
        meshes = _meshset(mesh.vertex_matrix(), faces[~flat], v_scalar_array=vertex.astype(float))
    mesh = meshes.current_mesh()
    count = np.unique(_edge_keys(mesh.face_matrix(), mesh.vertex_number()), return_counts=True)[1]
    changes["edges of three or more triangles of one patch split"] += np.count_nonzero(count > 2)
    if (count > 2).any():
        meshes.meshing_repair_non_manifold_edges(method="Split Vertices")
    old = _area_vectors(meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix())
    meshes.meshing_re_orient_faces_coherently()
    mesh = meshes.current_mesh()
    turned = np.einsum("ij,ij->i", old, _area_vectors(mesh.vertex_matrix(), mesh.face_matrix())) < 0.0
    changes["triangles turned"] += min(np.count_nonzero(turned), np.count_nonzero(~turned))
    over = bool(2 * np.count_nonzero(turned) > len(turned))
    faces = mesh.face_matrix()
    if holes >= 3:
        meshes.meshing_close_holes(maxholesize=holes, newfaceselected=True, selfintersection=False)
        mesh = meshes.current_mesh()
        faces = _without_large_fills(mesh, len(faces), _vertices(mesh), single, changes)
    up = _area_vectors(mesh.vertex_matrix(), faces)[:, 2]
    if abs(up.sum()) > 0.01 * np.abs(up).sum() and up.sum() < 0.0:  # a roof that looks down
        faces, over = faces[:, ::-1], not over
    changes["patches turned over"] += int(over)
    return faces, _vertices(mesh)


def _vertices(mesh: Any) -> Any:
    return np.rint(mesh.vertex_scalar_array()).astype(np.int64)


def _flat(X: Any, F: Any) -> Any:
    corner = X[F]
    edges = np.linalg.norm(corner - np.roll(corner, -1, axis=1), axis=2)
    return np.linalg.norm(_area_vectors(X, F), axis=1) <= FLAT * edges.max(axis=1) ** 2


def _without_large_fills(mesh: Any, size: int, vertex: Any, single: Any, changes: Any) -> Any:
    """The faces without fills of what is no small hole: a curve where another patch is, an outer edge."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    X, faces = mesh.vertex_matrix(), mesh.face_matrix()
    fill = faces[size:]
    if not len(fill):
        return faces
    keys = _edge_keys(fill, len(X))
    order = np.argsort(keys, axis=None, kind="stable")
    flat, owner = keys.ravel()[order], order // 3
    pair = np.flatnonzero(flat[1:] == flat[:-1])
    graph = coo_array((np.ones(len(pair)), (owner[pair], owner[pair + 1])), shape=(len(fill), len(fill)))
    count, part = connected_components(graph, directed=False)
    rim = ~np.isin(keys, flat[pair])
    whole = np.where(rim, single(vertex[fill]), True).all(axis=1)
    length = np.where(rim, np.linalg.norm(X[fill] - X[np.roll(fill, -1, axis=1)], axis=2), 0.0).sum(axis=1)
    reach = np.sqrt(np.linalg.norm(_area_vectors(X, faces[:size]), axis=1).sum())
    good = (np.bincount(part, ~whole, count) == 0) & (np.bincount(part, length, count) <= reach)
    changes["holes closed"] += np.count_nonzero(good)
    changes["triangles added in holes"] += np.count_nonzero(good[part])
    return np.concatenate([faces[:size], fill[good[part]]])
