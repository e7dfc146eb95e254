"""Meshes of other programs through MeshLab (pymeshlab, licence GPL), which repairs them and also reads .off,
.3ds, .dae and .x3d."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..base import validate
from ..base.errors import FileError, OptionError, PcmcError
from ..base.files import PathLike, as_path
from ..base.libraries import read_arrays, require, unreadable
from ..base.units import NO_UNITS, Units
from ..meshing.remeshing import MOST, remesh, triangles_for
from ..surface import Plane, Surface
from ..surface.geometry import face_areas
from .mesh_data import MeshData, converted, to_surface, within
from .metadata import Metadata
from .reading import contents, format_opened

WELD = 1e-5  # of the size
HOLES = 8  # edges of a hole
MESHLAB_READS = (".obj", ".ply", ".stl")
TURNS = {"x": [[0, 0, -1], [0, 1, 0], [1, 0, 0]], "y": [[1, 0, 0], [0, 0, -1], [0, 1, 0]], "z": np.eye(3)}
"""The rotations that turn an axis to be z."""


@dataclass(frozen=True, eq=False)
class Repaired:
    """A repaired mesh; ``write`` takes it like a Surface, and keeps what is bare."""

    surface: Surface  # a patch per group of the file, its boundary fixed
    changes: Mapping[str, int]  # what was done and how often, as in {"vertices welded": 12}
    notes: Sequence[str] = ()  # other changes, as that the mesh was cut into new triangles
    units: Units = NO_UNITS  # of its numbers; no unit where the file has none and none was given
    bare: Sequence[str] = ()  # the patches whose tension and pressure of 1 stand for none

    def __str__(self) -> str:
        """The changes and notes in one line."""
        counts = (f"{number} {done}" for done, number in self.changes.items())
        return "; ".join((*counts, *self.notes)) or "nothing to repair"


def repair(
    path: PathLike,
    *,
    weld: float | None = None,
    holes: int = HOLES,
    edge_length: float | None = None,
    units: str = "",
    up: str = "z",
) -> Repaired:
    """Repair the mesh in a file, which stays as it is.

    Groups stay patches. Polygons are cut into triangles; vertices nearer to each other than ``weld`` become
    one; repeated triangles, those without area and those at points that are no numbers are left out; edges
    with three or more triangles of one patch are split (with triangles of three patches they are junctions
    and stay); triangles of a patch are turned alike, towards z; small holes within a patch are closed.

    Parameters
    ----------
    path : the file; of any format that ``read`` reads, or that MeshLab reads.
    weld : distance, length; by default 1e-5 of the mesh's size. 0 welds nothing.
    holes : edges of the largest hole that is closed; 0 closes none. The outer edge is no hole.
    edge_length : of new triangles, for a scan; None keeps the triangles. A mesh of several patches needs the
        extra ``remesh`` for this.
    units : the unit of length wanted, by default the file's own; the numbers of a file without one are in it.
    up : the axis that was up in the program that drew the mesh, "x", "y" or "z"; it is turned to be z.

    Raises
    ------
    FileError : for a file that cannot be read, or is beyond repair.
    SurfaceError : where the repaired mesh is still no surface, such as a Möbius strip.
    MissingExtra : without pymeshlab.

    >>> import tempfile
    >>> mesh = Path(tempfile.mkdtemp()) / "twice.obj"
    >>> _ = mesh.write_text("v 0 0 0\\nv 1 0 0\\nv 0 1 0\\nf 1 2 3\\nf 2 3 1\\n")
    >>> print(repair(mesh))
    1 repeated triangles left out
    """
    if weld is not None:
        validate.number("weld", weld, least=0.0)
    validate.integer("holes", holes, least=0)
    if edge_length is not None:
        validate.positive("edge_length", edge_length)
    validate.choice("up", up, tuple(TURNS))
    require("pymeshlab", extra="repair")
    path = as_path(path)
    data = converted(_read(path), units, units)
    turn = np.array(TURNS[up], dtype=float)
    plane = data.plane and Plane(tuple(turn @ data.plane.point), tuple(turn @ data.plane.normal))
    data = replace(data, vertices=np.asarray(data.vertices) @ turn.T, plane=plane)
    try:
        return _repaired(data, weld, holes, edge_length)
    except PcmcError as error:
        raise error.in_file(path) from None


def _repaired(data: MeshData, weld: float | None, holes: int, edge_length: float | None) -> Repaired:
    X = np.asarray(data.vertices, dtype=np.float64)
    F = within(data.faces, "faces", len(X))
    finite = X[np.isfinite(X).all(axis=1)]
    size = float(np.linalg.norm(np.ptp(finite, axis=0))) if len(finite) else 0.0
    several = len(data.patches) > 1
    if edge_length is not None:
        least = math.sqrt(np.nansum(triangles_for(face_areas(X[F]), np.ones(len(F)))) / MOST)
        if edge_length < least:
            better = f"use {1.01 * least:.2g} or more"
            text = f"edge_length = {edge_length:g} would make more than {MOST} triangles; {better}"
            raise OptionError(text, what="edge_length", found=edge_length, expected=least)
    with tempfile.TemporaryDirectory() as folder:
        request, patch, near = Path(folder) / "mesh.npz", data.patch_of_face, WELD * size
        options: dict[str, Any] = {"weld": near if weld is None else weld, "holes": holes}
        options["edge_length"] = 0.0 if edge_length is None or several else edge_length
        np.savez(request, points=X, faces=F, patch=patch, **options)
        answer = read_arrays("io/reading_scripts.py", "repaired_arrays", request)
    kept, patch = np.unique(answer["patch"], return_inverse=True)  # one may have vanished
    patches = tuple(data.patches[k] for k in kept)
    surface = to_surface(MeshData(answer["points"], answer["faces"], patch, patches, plane=data.plane))
    changes = {done: number for done, number in answer["changes"].items() if number}
    given: dict[str, Any] = {"supports": data.support is not None and np.any(data.support)}
    for key in ("cables", "rooms", "planes", "lines"):
        given[key] = getattr(data, key) or data.parts.get(key)
    given["curved elements"] = max(data.order, data.parts.get("order", 1)) > 1
    given["images"] = len(data.images) + len(data.parts.get("images", ())) > 0
    left_out = ", ".join(name for name, there in given.items() if there)
    held = "; the boundary is fixed" if surface.fixed.any() else ""
    notes = (*data.notes, *([f"left out: {left_out}{held}"] if left_out else []))
    if edge_length is not None:
        if several:
            surface = remesh(surface, edge_length)
        notes = (*notes, f"{len(F)} triangles became {surface.m}")
    return Repaired(surface, changes, notes, data.units, data.bare)


def _read(path: Path) -> MeshData:
    """The mesh of a file as it is; MeshLab reads what pcmc's readers refuse."""
    with format_opened(path) as form:
        try:
            return contents(form, path)
        except (PcmcError, ValueError, IndexError) as error:
            refused = error if isinstance(error, PcmcError) else unreadable(path.suffix, error)
            if path.suffix.lower() not in MESHLAB_READS:
                raise refused from None
            with suppress(FileError):
                data = read(path)
                note = f"read by MeshLab, without groups, as pcmc's reader stops ({refused})"
                return replace(data, notes=(*data.notes, note))
            raise refused from None


def read(path: Path) -> MeshData:
    """Every mesh of the file; meshes of one name are one patch."""
    require("pymeshlab", extra="repair")
    found = enumerate(read_arrays("io/reading_scripts.py", "meshlab_arrays", path)["meshes"], 1)
    meshes = [(Path(name).stem or f"mesh {k}", X, F) for k, (name, X, F) in found]
    return Metadata().of_meshes(meshes, path.stem)
