"""From a trimesh scene, named meshes each with vertices of its own, to Contents."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.errors import FileError
from .contents import Contents, Description


def from_meshes(scene: Any, default: str, about: Description | None = None) -> Contents:
    """Every mesh of the scene where its node places it; meshes of one name are one patch."""
    about = about or Description()
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
        raise FileError("it holds no triangles")
    scalars = {k: np.concatenate(v) for k, v in data.items() if sum(map(len, v)) == start}
    return Contents(
        np.concatenate(X), np.concatenate(F), np.concatenate(patch), about.named(names),
        plane=about.plane, scalars=scalars,
    )  # fmt: skip
