"""Warnings about meshes of other programs: open seams, patches turned against each other, a wrong axis up.

Such a mesh can be solved, but probably gives another roof than the one drawn.
"""

from __future__ import annotations

import os

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..surface.geometry import area_vectors, segment_lengths
from ..surface.topology import Topology, topology
from .mesh_data import MeshData

GAP = 0.05  # of the boundary edges next to it: closer vertices are one, drawn twice
FACES_ONE_WAY = 0.5  # part of the area: then it is a roof, and not a column or a ball
FACES_UP = 1e-2  # part of the projected area: less, and another axis is up
FLAT = 0.5  # smallest spread of the boundary over the next: below, it has a plane
UPRIGHT = 0.9  # of the normal of that plane along x or y: more, and another axis is up


def import_warnings(data: MeshData, path: str | os.PathLike[str] = "FILE") -> tuple[str, ...]:
    """A sentence for each probable mistake; none where the format has supports, as pcmc's files do.

    ``path`` is the file, for the command to type.

    >>> from pcmc import Patch
    >>> X = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    >>> pair = MeshData(X, np.array([[0, 1, 2], [0, 3, 2]]), np.array([0, 1]), (Patch("a", 1), Patch("b", 1)))
    >>> import_warnings(pair)[0].split(":")[0]
    "patches 'a' and 'b' are turned against each other"
    """
    if data.support is not None or not len(data.faces):
        return ()
    topo = topology(data.faces, data.patch_of_face, len(data.vertices))
    outer = topo.edges[topo.boundary_edge]
    seam, axis = _open_seam(data.vertices, outer), _up(data, outer)
    turn = f"the surface faces {axis}, but z is up here; if {axis} was up, turn it: pcmc repair"
    wrong_up = f"{turn} {os.fspath(path)} -o turned.obj --up {axis}" if axis else ""
    return tuple(filter(None, (seam, _opposed_patches(data, topo), wrong_up)))


def _open_seam(X: Floats, outer: Ints) -> str:
    if not len(outer):
        return ""
    length = segment_lengths(X, outer)
    beside = np.full(len(X), np.inf)
    np.minimum.at(beside, outer.ravel(), np.repeat(length, 2))
    rim = np.unique(outer)
    distances, neighbours = map(np.asarray, cKDTree(X[rim]).query(X[rim], k=2))
    apart, near = distances[:, 1], neighbours[:, 1]
    close = apart < GAP * np.minimum(beside[rim], beside[rim[near]])
    if not close.any():
        return ""
    place = X[rim[close][0]].round(4).tolist()
    return (
        f"a seam is open: {np.count_nonzero(close)} boundary vertices are within"
        f" {apart[close].max():.2g} of another one, the first at {place}; join them in the program that"
        " drew the mesh, or with pcmc repair --weld"
    )


def _opposed_patches(data: MeshData, topo: Topology) -> str:
    wrong = np.flatnonzero(topo.one_way_edge & topo.seam_edge)
    if not len(wrong):
        return ""
    faces = np.flatnonzero((topo.edge_of_face == wrong[0]).any(axis=1))
    a, b = (data.patches[k].name for k in data.patch_of_face[faces])
    return (
        f"patches {a!r} and {b!r} are turned against each other: their pressures act to opposite"
        " sides; unless you want that, reverse the faces of one"
    )


def _up(data: MeshData, outer: Ints) -> str:
    """The axis that was up, "x" or "y", by the sum of area vectors and the best plane of the boundary."""
    vector = area_vectors(data.vertices[data.faces])
    total = np.abs(vector.sum(axis=0))
    size = float(np.linalg.norm(total))
    if size > FACES_ONE_WAY * float(np.linalg.norm(vector, axis=1).sum()) and total[2] <= FACES_UP * size:
        return "xy"[int(total[:2].argmax())]
    rim = data.vertices[np.unique(outer)]
    if len(rim) < 3:
        return ""
    _, spread, axes = np.linalg.svd(rim - rim.mean(axis=0), full_matrices=False)
    normal = np.abs(axes[2])
    upright = spread[2] < FLAT * spread[1] and normal[:2].max() > UPRIGHT
    return "xy"[int(normal[:2].argmax())] if upright else ""
