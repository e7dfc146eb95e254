"""The part of the reading process that reads surfaces, with VTK, rhino3dm and IfcOpenShell: arrays.

``libraries`` loads this file by its path, so it imports nothing of pcmc; only the library that the file
needs, and only those parts of VTK that read.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any


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
    import numpy as np
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
    unit = str(model.Settings.ModelUnitSystem.name)
    return {"layers": layers, "objects": objects, "unit": unit}


def ifc_arrays(path: str) -> dict[str, Any]:
    """The face sets of a roof that pcmc wrote, their names and supports, and pcmc's texts."""
    import ifcopenshell
    import numpy as np
    from ifcopenshell.util import element, placement

    get_pset, get_local_placement = element.get_pset, placement.get_local_placement
    model: Any = ifcopenshell.open(path)
    found: dict[str, Any] = {"text": None, "walls": None, "parts": []}
    for roof in model.by_type("IfcRoof"):
        texts = get_pset(roof, "Pcmc_Surface")
        if not texts:
            continue
        found["text"], found["walls"] = texts["Description"], texts.get("Walls")
        for part in (part for whole in roof.IsDecomposedBy for part in whole.RelatedObjects):
            if part.is_a("IfcTendon"):
                continue
            item = part.Representation.Representations[0].Items[0]
            points = np.array(item.Coordinates.CoordList, dtype=np.float64).reshape(-1, 3)
            place = get_local_placement(part.ObjectPlacement)
            found["parts"].append(
                {
                    "name": part.Name,
                    "points": points @ place[:3, :3].T + place[:3, 3],
                    "faces": np.array(item.CoordIndex, dtype=np.int64).reshape(-1, 3) - 1,
                    "supports": get_pset(part, "Pcmc_Patch", "Supports"),
                }
            )
        break
    return found
