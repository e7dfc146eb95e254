"""A mesh per patch, as formats and trimesh have them: those of a surface, and back to one mesh.

Below a junction on Π a wall's triangles have no area, and readers that join patches by position would merge
its vertices. So the file has the meshes without them, and a text from which the reader puts the walls back.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import FileError
from ..surface import Patch, Surface
from ..surface.colours import patch_colors
from ..surface.geometry import bounding_size
from .mesh_data import ROUNDING, MeshData, checked_data, support_of, without_unused
from .metadata import Metadata, row_of

WALLS = "pcmc walls"  # the key of their text in a file
CHANGED = "walls without height were left out: the surface has changed since they were written"


def patch_meshes(surface: Surface) -> Iterator[tuple[int, Floats, Ints, Ints]]:
    """For each patch with triangles: its number, colour (3,), vertices (v,), and triangles (t,3) of these."""
    for k, color in enumerate(patch_colors(surface)):
        used, local = np.unique(surface.faces[surface.patch_of_face == k], return_inverse=True)
        if len(used):
            yield k, color, used, local.reshape(-1, 3)


def from_scene(scene: Any, default: str, metadata: Metadata) -> MeshData:
    """Every mesh of a scene of trimesh, placed by its node; meshes of one name are one patch."""
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


def encode_walls(surface: Surface, shown: Surface) -> str:
    """The walls of a surface as text; ``shown`` is the surface without the triangles that have no area."""
    wall = surface.auxiliary[surface.patch_of_face]
    used, local = np.unique(surface.faces[wall], return_inverse=True)
    values = {
        "vertices": surface.vertices[used].tolist(),
        "support": support_of(surface)[used].tolist(),
        "above": np.isin(used, surface.faces[~wall]).tolist(),
        "faces": local.reshape(-1, 3).tolist(),
        "patch": surface.patch_of_face[wall].tolist(),
        "patches": [row_of(p) for p in surface.patches],
        "shown": int(np.count_nonzero(shown.auxiliary[shown.patch_of_face])),
    }
    return json.dumps(values)


def restore_walls(data: MeshData) -> MeshData:
    """The same, joined, with the walls of ``data.walls``; without them, with a note, if it has changed."""
    if data.walls is None:
        return data
    walls, above, shown = _parsed(data.walls)
    names = {walls.patches[k].name for k in walls.patch_of_face}
    is_wall = np.array([p.name in names for p in data.patches])[data.patch_of_face]
    sheets = np.unique(data.faces[~is_wall])
    reach = ROUNDING * bounding_size(data.vertices)
    far, near = cKDTree(data.vertices[sheets]).query(walls.vertices[above])
    if np.count_nonzero(is_wall) != shown or np.any(far > reach):
        return replace(data, walls=None, notes=(*data.notes, CHANGED))
    n, below = len(data.vertices), ~above
    place = np.empty(len(below), dtype=np.int64)
    place[above], place[below] = sheets[near], n + np.arange(np.count_nonzero(below))
    X = np.concatenate([data.vertices, walls.vertices[below]])
    X[place] = walls.vertices  # those above too: to rest on Π they must lie on it to the last digit
    support = np.zeros(len(X), dtype=np.int8)
    support[:n] = 0 if data.support is None else data.support
    support[place] = np.asarray(walls.support)
    patches = list(data.patches)
    patches += [p for p in walls.patches if p.name in names - {q.name for q in patches}]
    number = {p.name: k for k, p in enumerate(patches)}
    patch = np.array([number.get(p.name, -1) for p in walls.patches])[walls.patch_of_face]
    beside = cKDTree(data.vertices).query(walls.vertices[below])[1]
    whole = replace(
        data,
        vertices=X,
        faces=np.concatenate([data.faces[~is_wall], place[walls.faces]]),
        patch_of_face=np.concatenate([data.patch_of_face[~is_wall], patch]),
        patches=tuple(patches),
        support=support,
        scalars={k: np.concatenate([v, v[beside]]) for k, v in data.scalars.items()},
        walls=None,
    )
    return replace(without_unused(whole), notes=data.notes)


def _parsed(text: str) -> tuple[MeshData, Bools, int]:
    """The walls, which of their vertices lie on other patches, and how many of their faces are shown."""
    try:
        values = json.loads(text)
        X, F, patch, support = (values[key] for key in ("vertices", "faces", "patch", "support"))
        walls = checked_data(MeshData(X, F, patch, tuple(Patch(*p) for p in values["patches"]), support))
        above, shown = np.array(values["above"], dtype=bool), int(values["shown"])
        if len(above) != len(walls.vertices):
            raise ValueError
    except (ValueError, KeyError, TypeError):
        raise FileError(f"the description of walls in it is damaged: {text!r:.60}", where=WALLS) from None
    return walls, above, shown
