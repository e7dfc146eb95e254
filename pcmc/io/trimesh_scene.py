"""Read the meshes of a trimesh scene, each with its own vertices."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from ..base.errors import FileError
from .mesh_data import MeshData, within
from .metadata import Metadata


def from_meshes(scene: Any, default: str, metadata: Metadata) -> MeshData:
    """Every mesh of the scene, placed by its node; meshes of one name are one patch."""
    X, F, named = [], [], []
    data: dict[str, list[Any]] = {}
    start, order = 0, list(scene.geometry)
    for node in sorted(scene.graph.nodes_geometry, key=lambda n: order.index(scene.graph[n][1])):
        transform, key = scene.graph[node]
        mesh = scene.geometry[key]
        if not len(getattr(mesh, "faces", ())):
            continue
        unnamed = len(order) == 1 and (node.startswith("geometry_") or "." in node)
        points = np.asarray(mesh.vertices, dtype=np.float64)
        if not np.array_equal(transform, np.eye(4)):
            points = points @ transform[:3, :3].T + transform[:3, 3]
        X.append(points)
        F.append(within(mesh.faces, f"faces of {node!r}", len(points)) + start)
        known = node if node in metadata.patches or key not in metadata.patches else key
        named += [default if unnamed else known] * len(mesh.faces)
        for attribute, values in mesh.vertex_attributes.items():
            if np.size(values) == len(points):
                data.setdefault(attribute, []).append(np.asarray(values, dtype=np.float64).ravel())
        start += len(points)
    if not X:
        raise FileError("the file has no triangles", where="faces", found=0)
    scalars = {k: np.concatenate(v) for k, v in data.items() if sum(map(len, v)) == start}
    patch, names = pd.factorize(np.array(named, dtype=object))
    return metadata.mesh_data(np.concatenate(X), np.concatenate(F), patch, names.tolist(), scalars=scalars)
