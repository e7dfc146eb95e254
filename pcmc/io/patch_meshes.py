"""Meshes with vertices of their own: those of a surface's patches, and those of a trimesh scene."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..base.arrays import Floats, Ints
from ..surface import Surface
from ..surface.colours import patch_colors
from .mesh_data import MeshData
from .metadata import Metadata


def patch_meshes(surface: Surface) -> Iterator[tuple[int, Floats, Ints, Ints]]:
    """For each patch with triangles: its number, colour (3,), vertices (v,), and triangles (t,3) of these."""
    for k, color in enumerate(patch_colors(surface)):
        used, local = np.unique(surface.faces[surface.patch_of_face == k], return_inverse=True)
        if len(used):
            yield k, color, used, local.reshape(-1, 3)


def from_scene(scene: Any, default: str, metadata: Metadata) -> MeshData:
    """Every mesh of the scene, placed by its node; meshes of one name are one patch."""
    data: dict[str, list[Any]] = {}
    meshes, order = [], list(scene.geometry)
    for node in sorted(scene.graph.nodes_geometry, key=lambda n: order.index(scene.graph[n][1])):
        transform, key = scene.graph[node]
        mesh = scene.geometry[key]
        if not len(getattr(mesh, "faces", ())):
            continue
        unnamed = len(order) == 1 and (node.startswith("geometry_") or "." in node)
        points = np.asarray(mesh.vertices, dtype=np.float64)
        if not np.array_equal(transform, np.eye(4)):
            points = points @ transform[:3, :3].T + transform[:3, 3]
        known = node if node in metadata.patches or key not in metadata.patches else key
        meshes.append((default if unnamed else known, points, mesh.faces))
        for attribute, values in mesh.vertex_attributes.items():
            if np.size(values) == len(points):
                data.setdefault(attribute, []).append(np.asarray(values, dtype=np.float64).ravel())
    size = sum(len(points) for _, points, _ in meshes)
    scalars = {k: np.concatenate(v) for k, v in data.items() if sum(map(len, v)) == size}
    return metadata.of_meshes(meshes, scalars=scalars)
