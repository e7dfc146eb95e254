"""Formats that MeshLab reads for pcmc (.off, .3ds, .dae, .x3d): a patch per mesh. They are not written."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from ..base.errors import MissingExtra
from .mesh_data import MeshData
from .metadata import Metadata
from .reading_process import read_arrays


def read(path: Path) -> MeshData:
    """Every mesh of the file; meshes of one name are one patch."""
    require_meshlab()
    found = enumerate(read_arrays("meshlab", path)["meshes"], 1)
    meshes = [(Path(m["name"]).stem or f"mesh {k}", m["points"], m["faces"]) for k, m in found]
    return Metadata().of_meshes(meshes, path.stem)


def require_meshlab() -> None:
    """MissingExtra without pymeshlab."""
    if find_spec("pymeshlab") is None:
        raise MissingExtra("pymeshlab", "repair")
