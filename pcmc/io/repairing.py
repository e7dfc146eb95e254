"""Repair of meshes that other programs left dirty, with MeshLab (pymeshlab, licence GPL)."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ..base import validate
from ..base.errors import FileError, PcmcError, unknown
from ..base.files import check_regular, system_error
from ..surface import Surface
from . import FORMATS, READ_ONLY, meshlab
from .libraries import unreadable
from .mesh_data import MeshData, to_surface, within
from .reading_process import read_arrays

WELD = 1e-5  # of the size
HOLES = 8  # edges of a hole
MESHLAB_READS = (".obj", ".ply", ".stl")


@dataclass(frozen=True, eq=False)
class Repaired:
    """A repaired mesh.

    Attributes
    ----------
    surface : a patch per group of the file, its boundary fixed; tensions and pressures are the file's, or 1.
    changes : what was done and how often, as in {"vertices welded": 12}; empty if the mesh was clean.
    notes : other changes, a sentence each, as that the mesh was cut into new triangles.
    """

    surface: Surface
    changes: Mapping[str, int]
    notes: Sequence[str] = ()

    def __str__(self) -> str:
        """The changes and notes in one line."""
        counts = (f"{number} {done}" for done, number in self.changes.items())
        return "; ".join([*counts, *self.notes]) or "nothing to repair"


def repair(
    path: str | os.PathLike[str],
    *,
    weld: float | None = None,
    holes: int = HOLES,
    edge_length: float | None = None,
) -> Repaired:
    """Repair the mesh in a file, which stays as it is.

    Polygons are cut into triangles; vertices nearer to each other than ``weld`` become one; repeated
    triangles, those without area and those at points that are no numbers are left out; edges with three or
    more triangles of one patch are split (with triangles of three patches they are junctions and stay);
    triangles of a patch are turned alike, towards z; small holes within a patch are closed. Groups of the
    file stay patches.

    Parameters
    ----------
    path : the file; of any format that ``read`` reads, or that MeshLab reads.
    weld : distance, length; by default 1e-5 of the mesh's size. 0 welds nothing.
    holes : edges of the largest hole that is closed; 0 closes none. The outer edge is no hole.
    edge_length : of new triangles, for a scan; None keeps the triangles. A mesh of several patches needs the
        extra ``remesh`` for this.

    Raises
    ------
    FileError : for a file that cannot be read, or is beyond repair.
    SurfaceError : where the repaired mesh is still no surface, such as a Möbius strip.
    MissingExtra : without pymeshlab.

    Examples
    --------
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
    meshlab.require_meshlab()
    path = Path(path)
    data = _loaded(path)
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
    values: dict[str, Any] = {
        "points": X,
        "faces": F,
        "patch": data.patch_of_face,
        "weld": WELD * size if weld is None else weld,
        "holes": holes,
        "edge_length": 0.0 if edge_length is None or several else edge_length,
    }
    with tempfile.TemporaryDirectory() as folder:
        request = Path(folder) / "mesh.npz"
        np.savez(request, **values)
        answer = read_arrays("repair", request)
    kept, patch = np.unique(answer["patch"], return_inverse=True)  # one may have vanished
    clean = MeshData(
        answer["points"], answer["faces"], patch, tuple(data.patches[k] for k in kept), plane=data.plane
    )
    surface = to_surface(clean)
    changes = {done: number for done, number in answer["changes"].items() if number}
    notes = tuple(data.notes)
    if edge_length is not None:
        if several:
            from ..meshing.remeshing import remesh  # needs the extra remesh

            surface = remesh(surface, edge_length)
        notes = (*notes, f"{len(F)} triangles became {surface.m}")
    return Repaired(surface, changes, notes)


def _loaded(path: Path) -> MeshData:
    """The mesh of a file as it is; MeshLab reads what pcmc's readers refuse."""
    check_regular(path)
    suffix = path.suffix.lower()
    known = {**FORMATS, **READ_ONLY}
    if suffix not in known:
        text = f"{path}: {unknown('suffix', suffix, known)}"
        raise FileError(text, what=str(path), found=suffix, expected=list(known))
    try:
        path.open("rb").close()
        return _read(path, known[suffix].module)
    except OSError as error:
        raise system_error(path, "read", error) from None
    except UnicodeDecodeError as error:
        raise FileError(
            f"{path}: byte {error.start} is not text", what=str(path), where=error.start
        ) from None
    except FileError as error:
        raise error.in_file(path, what=str(path)) from None


def _read(path: Path, module: str) -> MeshData:
    suffix = path.suffix.lower()
    try:
        data: MeshData = import_module(f".{module}", __package__).read(path)
        return data
    except (PcmcError, ValueError, IndexError) as error:
        if suffix not in MESHLAB_READS:
            raise error if isinstance(error, PcmcError) else unreadable(suffix, error) from None
        try:
            data = meshlab.read(path)
        except FileError:
            raise error if isinstance(error, PcmcError) else unreadable(suffix, error) from None
        note = (
            f"read by MeshLab, without groups, as pcmc's reader stops ({' '.join(str(error).split())[:100]})"
        )
        return replace(data, notes=(*data.notes, note))
