"""Read the meshes of a trimesh scene, each with its own vertices."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.errors import FileError
from .mesh_data import MeshData
from .metadata import Metadata


def from_meshes(scene: Any, default: str, metadata: Metadata | None = None) -> MeshData:
    """Every mesh of the scene, placed by its node; meshes of one name are one patch."""
    metadata = metadata or Metadata()
    X, F, patch, names = [], [], [], []
    data: dict[str, list[Any]] = {}
    start, order = 0, list(scene.geometry)
    for node in sorted(scene.graph.nodes_geometry, key=lambda n: order.index(scene.graph[n][1])):
        transform, key = scene.graph[node]
        mesh = scene.geometry[key]
        if not len(getattr(mesh, "faces", ())):
            continue
        unnamed = len(order) == 1 and (node.startswith("geometry_") or "." in node)
        name = default if unnamed else node
        names += [] if name in names else [name]
        points = np.asarray(mesh.vertices, dtype=np.float64)
        if not np.array_equal(transform, np.eye(4)):
            points = points @ transform[:3, :3].T + transform[:3, 3]
        X.append(points)
        F.append(np.asarray(mesh.faces) + start)
        patch.append(np.full(len(mesh.faces), names.index(name)))
        for attribute, values in mesh.vertex_attributes.items():
            data.setdefault(attribute, []).append(np.asarray(values, dtype=np.float64).ravel())
        start += len(points)
    if not X:
        raise FileError("the file has no triangles", where="faces", found=0)
    scalars = {k: np.concatenate(v) for k, v in data.items() if sum(map(len, v)) == start}
    return MeshData(
        np.concatenate(X),
        np.concatenate(F),
        np.concatenate(patch),
        metadata.named(names),
        plane=metadata.plane,
        scalars=scalars,
    )
