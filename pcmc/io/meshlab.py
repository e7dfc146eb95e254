"""Formats that MeshLab reads for pcmc (.off, .3ds, .dae, .x3d): a patch per mesh. They are not written."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pandas as pd

from ..base.errors import FileError, MissingExtra
from .mesh_data import MeshData, within
from .metadata import Metadata
from .reading_process import read_arrays


def read(path: Path) -> MeshData:
    """Every mesh of the file; meshes of one name are one patch."""
    require_meshlab()
    X, F, named = [], [], []
    start = 0
    for number, mesh in enumerate(read_arrays("meshlab", path)["meshes"], 1):
        faces = np.asarray(mesh["faces"]).reshape(-1, 3)
        if not len(faces):
            continue
        X.append(np.asarray(mesh["points"], dtype=np.float64).reshape(-1, 3))
        F.append(within(faces, f"faces of mesh {number}", len(X[-1])) + start)
        named += [Path(mesh["name"]).stem or f"mesh {number}"] * len(faces)
        start += len(X[-1])
    if not X:
        raise FileError("the file has no triangles", where="faces", found=0)
    patch, names = pd.factorize(np.array(named, dtype=object))
    listed = [path.stem] if len(names) == 1 else names.tolist()
    return Metadata().mesh_data(np.concatenate(X), np.concatenate(F), patch, listed)


def require_meshlab() -> None:
    """MissingExtra without pymeshlab."""
    if find_spec("pymeshlab") is None:
        raise MissingExtra("pymeshlab", "repair")
