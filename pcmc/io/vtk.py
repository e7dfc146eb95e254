"""VTK's XML files (.vtp, .vtu), which ParaView reads: only the certificate is lost.

Cells carry ``patch``, points ``support`` (0 free, 1 sliding, 2 fixed), both the scalars; names,
tensions, pressures and plane are field data.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.errors import FileError
from ..surface import Surface
from .libraries import load_library, translated_errors
from .mesh_data import MeshData, support_of
from .metadata import metadata_text, parse_metadata
from .polygons import from_polygons

RESERVED = ("support", "patch")
FLAT = (5, 7, 9)  # VTK_TRIANGLE, VTK_POLYGON, VTK_QUAD
FIRST_SOLID = 10  # VTK_TETRA; the kinds above it are solid or curved


def write(path: Path, surface: Surface, scalars: Mapping[str, Floats], **_: Any) -> None:
    """Polygons in a .vtp, cells in a .vtu."""
    pyvista = load_library("pyvista")
    mesh = pyvista.PolyData.from_regular_faces(surface.vertices, surface.faces)
    mesh.point_data["support"] = support_of(surface)
    mesh.cell_data["patch"] = surface.patch_of_face
    for name, values in scalars.items():
        if name in RESERVED:
            text = f"scalars: {path.suffix} files use the name {name!r} themselves; rename the scalar"
            raise FileError(text, where=name, found=name)
        (mesh.point_data if len(values) == surface.n else mesh.cell_data)[name] = values
    mesh.field_data["pcmc"] = [metadata_text(surface)]
    if path.suffix.lower() == ".vtu":
        mesh = mesh.cast_to_unstructured_grid()
    mesh.save(path)


def read(path: Path) -> MeshData:
    """Triangles, quads and polygons of either; lines and points are left out."""
    pyvista = load_library("pyvista")
    if not path.read_bytes()[-64:].rstrip().endswith(b"</VTKFile>"):
        raise FileError("not a VTK XML file, or cut off before '</VTKFile>'", expected="</VTKFile>")
    with translated_errors(path.suffix[1:]), pyvista.vtk_verbosity("off"), warnings.catch_warnings():
        warnings.simplefilter("error")  # VTK's errors come as warnings
        mesh = pyvista.read(path)
        if isinstance(mesh, pyvista.PolyData):
            mesh = (mesh.triangulate() if mesh.n_strips else mesh).cast_to_unstructured_grid()
        corners, counts, chosen = _cells(mesh)
        points, text = np.asarray(mesh.points), mesh.field_data.get("pcmc")
        point_data = {k: np.asarray(v) for k, v in mesh.point_data.items()}
        cell_data = {k: np.asarray(v)[chosen] for k, v in mesh.cell_data.items()}
    metadata = parse_metadata(None if text is None else str(text[0]))
    return from_polygons(points, corners, counts, point_data, cell_data, metadata, path.stem)


def _cells(mesh: Any) -> tuple[Ints, Ints, Ints]:
    """Corners, corners per face, and the faces' places among all cells."""
    solid = np.flatnonzero(mesh.celltypes >= FIRST_SOLID)
    if len(solid):
        kind = int(mesh.celltypes[solid[0]])
        text = f"cell {solid[0]} is of VTK's type {kind}; pcmc reads triangles, quads and polygons"
        raise FileError(text, where=int(solid[0]), found=kind)
    chosen = np.flatnonzero(np.isin(mesh.celltypes, FLAT))
    offsets = np.asarray(mesh.cell_offsets)
    counts = np.diff(offsets)[chosen]
    start = np.repeat(offsets[chosen] - np.cumsum(counts) + counts, counts)
    corners = np.asarray(mesh.cell_connectivity)[start + np.arange(counts.sum())]
    return corners, counts, chosen
