"""VTK's XML files (.vtp, .vtu), which ParaView reads: only the certificate is lost.

Cells carry ``patch``, points ``support``, both the scalars; the metadata are field data.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ..base.errors import FileError
from ..base.libraries import load_library, read_arrays, require
from ..surface import Surface
from .formats import Content
from .mesh_data import MeshData, support_of
from .metadata import parse_metadata
from .polygons import from_polygons

FLAT = (5, 7, 9)  # VTK_TRIANGLE, VTK_POLYGON, VTK_QUAD
ITEMS = 100  # of an array, for each byte of a file; those of one value compress so far
FIRST_SOLID = 10  # VTK_TETRA; the kinds above it are solid or curved


def write(path: Path, surface: Surface, content: Content) -> None:
    pyvista = load_library("pyvista")
    mesh = pyvista.PolyData.from_regular_faces(surface.vertices, surface.faces)
    mesh.point_data["support"] = support_of(surface)
    mesh.cell_data["patch"] = surface.patch_of_face
    for name, values in content.scalars.items():
        (mesh.point_data if len(values) == surface.n else mesh.cell_data)[name] = values
    mesh.field_data["pcmc"] = [content.metadata]
    if content.mark:
        mesh.field_data["mark"] = [content.mark]
    library, flat = load_library("vtkmodules.vtkIOXML"), path.suffix.lower() == ".vtp"
    writer = library.vtkXMLPolyDataWriter() if flat else library.vtkXMLUnstructuredGridWriter()
    writer.SetInputData(mesh if flat else mesh.cast_to_unstructured_grid())
    writer.SetDataModeToBinary()
    writer.WriteToOutputStringOn()  # where a disk is full, VTK crashes
    writer.Write()
    path.write_text(writer.GetOutputString(), encoding="utf-8", newline="\n")


def read(path: Path) -> MeshData:
    """Triangles, quads and polygons of either; lines and points are left out."""
    require("vtkmodules", "pyvista")
    data = path.read_bytes()
    if not data[-64:].rstrip().endswith(b"</VTKFile>"):
        raise FileError("not a VTK XML file, or cut off before '</VTKFile>'", expected="</VTKFile>")
    for match in re.finditer(rb"\bNumberOf\w+=[\"'](\d+)[\"']", data):
        if len(match[1]) > 18 or int(match[1]) > ITEMS * len(data):
            text = f"{match[0][:60].decode()}, but the file has only {len(data)} bytes"
            raise FileError(text, where=1 + data.count(b"\n", 0, match.start()), found=match[1][:60].decode())
    arrays = read_arrays("io/reading_scripts.py", "vtk_arrays", path)
    types, offsets, connected = (np.asarray(arrays[name]) for name in ("types", "offsets", "corners"))
    if len(solid := np.flatnonzero(types >= FIRST_SOLID)):
        at, kind = int(solid[0]), int(types[solid[0]])
        text = f"cell {at} is of VTK's type {kind}; pcmc reads triangles, quads and polygons"
        raise FileError(text, where=at, found=kind)
    if len(types):
        sound = len(offsets) == len(types) + 1 and offsets[0] == 0 and offsets[-1] <= len(connected)
        if not sound or (np.diff(offsets) < 0).any():
            raise FileError("the offsets of its cells do not fit their corners", where="offsets")
    chosen = np.flatnonzero(np.isin(types, FLAT))
    counts = np.diff(offsets)[chosen] if len(chosen) else np.zeros(0, dtype=np.int64)
    start = np.repeat(offsets[chosen] - np.cumsum(counts) + counts, counts)
    corners = connected[start + np.arange(counts.sum())]
    points = np.asarray(arrays["points"]).reshape(-1, 3)
    cell_data = {name: values[chosen] for name, values in arrays["cell data"].items()}
    metadata = parse_metadata(arrays["text"])
    return from_polygons(points, corners, counts, arrays["point data"], cell_data, metadata, path.stem)
