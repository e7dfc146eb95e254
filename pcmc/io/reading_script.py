"""The script of the process in which libraries read files that could crash them: a path in, arrays out.

``reading_process`` starts this file as a script. It imports the library that the file needs, and only those
parts of VTK that read.
"""

from __future__ import annotations

import os
import pickle
import re
import sys
from collections.abc import Callable
from contextlib import suppress
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

GIGABYTE = 1 << 30  # bytes that a reader may use, besides
MEMORY = 100  # bytes for each byte of the file, which may be compressed


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


def limit_memory(size: int) -> None:
    """On Linux, refuse memory beyond what a sound file of this size needs."""
    if sys.platform == "linux":
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[0])
        most = pages * resource.getpagesize() + GIGABYTE + MEMORY * size
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        resource.setrlimit(resource.RLIMIT_AS, (most if hard < 0 else min(most, hard), hard))


def from_file(name: str, function: str) -> Callable[[str], dict[str, Any]]:
    """A reader in another file beside this one, which is loaded when it is first used."""

    def read(path: str) -> dict[str, Any]:
        module = sys.modules.get(name)
        if module is None:
            place = Path(__file__).with_name(f"{name}.py")
            spec = spec_from_file_location(name, place)
            assert spec is not None
            assert spec.loader is not None
            module = sys.modules[name] = module_from_spec(spec)
            spec.loader.exec_module(module)
        arrays: dict[str, Any] = getattr(module, function)(path)
        return arrays

    return read


READERS = {
    "vtk": vtk_arrays,
    "rhino": rhino_arrays,
    "ifc": ifc_arrays,
    "dxf drawing": from_file("reading_drawings", "dxf_entities"),
    "3dm drawing": from_file("reading_drawings", "rhino_entities"),
    "meshlab": from_file("reading_meshes", "meshlab_arrays"),
    "repair": from_file("reading_meshes", "repaired_arrays"),
}


def main() -> None:
    """Answer requests until the other side closes."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):  # what a library prints must not get between the answers
        os.dup2(nothing, stream)
    with suppress(EOFError, BrokenPipeError):
        sys.path[:] = pickle.load(requests)
        while True:
            kind, path, size = pickle.load(requests)
            answer: tuple[str, Any]
            try:
                limit_memory(size)
                answer = ("read", READERS[kind](path))
            except Exception as error:
                text = "more memory than there is" if isinstance(error, MemoryError) else str(error)
                answer = ("failed", text)
            pickle.dump(answer, answers, pickle.HIGHEST_PROTOCOL)
            answers.flush()


if __name__ == "__main__":
    main()
