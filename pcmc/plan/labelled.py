"""From any triangle mesh with face labels to a Surface: patches, supports, walls."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import OptionError, SurfaceError, unknown
from ..surface import Patch, Plane, Surface, checks
from ..surface.geometry import area_vectors
from ..surface.topology import topology
from .parts import EDGES
from .walls import add_walls


def surface_from_labels(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    labels: npt.ArrayLike | None = None,
    *,
    tension: float | Mapping[str, float],
    pressure: float | Mapping[str, float] = 1.0,
    boundary: str = "fixed",
    walls: float | Mapping[tuple[str, str], float] | None = None,
    bottom: str = "sliding",
    plane: Plane | None = None,
    weld: float = 0.0,
) -> Surface:
    """A Surface whose patches are the labels of a triangle mesh.

    Faces of a label are turned to agree with each other, and outwards: towards Π's normal; in a
    mesh without boundary, away from its middle. Vertices that no face uses are left out.

    Parameters
    ----------
    vertices, faces : (n,3) and (m,3).
    labels : (m,) one per face, of any kind; a patch is named by ``str`` of its label. Without them
        the mesh is one patch, "surface".
    tension, pressure : of all patches, or by name.
    boundary : what holds the mesh's boundary: "fixed", "sliding" on Π, or "free".
    walls : tension of walls to put under the borders between labels (see ``add_walls``).
    bottom : of those walls.
    plane : Π; z = 0 by default.
    weld : vertices nearer to each other than this become one, length.

    Raises
    ------
    OptionError
        For an unknown name or option.
    SurfaceError
        For arrays that are no such mesh, naming the first offending index.

    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> s = surface_from_labels(square, [[0, 1, 2], [0, 3, 2]], ["a", "b"], tension=2.0)
    >>> [p.name for p in s.patches], s.faces.tolist()
    (['a', 'b'], [[0, 1, 2], [2, 3, 0]])
    """
    if boundary not in EDGES:
        raise OptionError(unknown("boundary", boundary, EDGES))
    plane = Plane() if plane is None else plane
    X = checks.positions(vertices)
    F: Ints = checks.face_array(faces, len(X)).astype(np.int64)
    X, F = _welded(X, F, weld)
    names, patch = _names(labels, len(F))
    F = _oriented(X, F, patch, plane)
    edge = topology(F, patch, len(X)).on_boundary
    alpha, p = (_by_name(v, names, w) for v, w in ((tension, "tension"), (pressure, "pressure")))
    patches = tuple(Patch(name, alpha[name], p[name]) for name in names)
    held, sliding = edge & (boundary == "fixed"), edge & (boundary == "sliding")
    surface = Surface(X, F, patch, patches, held, sliding, plane)
    return surface if walls is None else add_walls(surface, walls, bottom)


def _welded(X: Floats, F: Ints, distance: float) -> tuple[Floats, Ints]:
    """Without unused vertices, and with those nearer than ``distance`` made one."""
    if not (np.isfinite(distance) and distance >= 0.0):
        raise OptionError(f"weld must be a finite number ≥ 0, found {distance}")
    group = np.arange(len(X))
    if distance > 0.0:
        pairs = cKDTree(X).query_pairs(distance, output_type="ndarray")
        graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(X), len(X)))
        label = connected_components(graph, directed=False)[1]
        group = np.unique(label, return_index=True)[1][label]
    F = group[F]
    flat = (F[:, [1, 2, 0]] == F).any(axis=1)
    if flat.any():
        raise SurfaceError(
            f"faces[{np.argmax(flat)}] vanishes when vertices nearer than weld={distance:g} are"
            " made one; use a smaller weld"
        )
    used, inverse = np.unique(F, return_inverse=True)
    return X[used], inverse.reshape(-1, 3)


def _names(labels: npt.ArrayLike | None, m: int) -> tuple[list[str], Ints]:
    """Patch names in the order in which they first come, and each face's."""
    if labels is None:
        return ["surface"], np.zeros(m, dtype=np.int64)
    found = np.asarray(labels)
    if found.shape != (m,):
        raise SurfaceError(f"labels: expected shape ({m},), one per face, found {found.shape}")
    known, first, inverse = np.unique(found, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return [str(known[k]) for k in order], np.argsort(order)[inverse]


def _by_name(value: Any, names: list[str], what: str) -> dict[str, float]:
    if not isinstance(value, Mapping):
        return dict.fromkeys(names, float(value))
    for name in value:
        if name not in names:
            raise OptionError(unknown("patch", name, names))
    missing = [name for name in names if name not in value]
    if missing:
        raise OptionError(f"{what}: no value for patch {missing[0]!r}")
    return {name: float(value[name]) for name in names}


def _oriented(X: Floats, F: Ints, patch: Ints, plane: Plane) -> Ints:
    """Faces turned so that neighbours in a patch agree, and the patch faces outwards.

    Every face has two sides; sides that are the same side of the patch are connected in a graph of
    2 m nodes, so that its parts are the patch's sides.
    """
    m = len(F)
    one, two, same = _neighbours(F, patch, len(X))
    # running along the shared edge the same way, one of the two is turned over
    start = np.concatenate([one, one + m])
    end = np.concatenate([np.where(same, two + m, two), np.where(same, two, two + m)])
    graph = coo_array((np.ones(len(start)), (start, end)), shape=(2 * m, 2 * m))
    side = connected_components(graph, directed=False)[1]
    both = np.flatnonzero(side[:m] == side[m:])
    if len(both):
        raise SurfaceError(
            f"the patch of face {both[0]} has only one side (like a Möbius strip); cut it into two"
            " patches"
        )
    part = np.minimum(side[:m], side[m:])
    turned = side[:m] != part
    weight = _outwardness(X, F, patch, plane) * np.where(turned, -1.0, 1.0)
    flip = turned ^ (np.bincount(part, weight, 2 * m)[part] < 0.0)
    return np.where(flip[:, None], F[:, ::-1], F)


def _neighbours(F: Ints, patch: Ints, n: int) -> tuple[Ints, Ints, Bools]:
    """Pairs of faces at an edge of theirs alone in their patch; whether both run along it alike."""
    edge = F[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)
    face = np.repeat(np.arange(len(F)), 3)
    key = (patch[face] * n + edge.min(axis=1)) * n + edge.max(axis=1)
    order = np.argsort(key, kind="stable")
    _, first, count = np.unique(key[order], return_index=True, return_counts=True)
    one, two = order[first[count == 2]], order[first[count == 2] + 1]
    return face[one], face[two], edge[one, 0] == edge[two, 0]


def _outwardness(X: Floats, F: Ints, patch: Ints, plane: Plane) -> Floats:
    """(m,) area seen along Π's normal; in a closed mesh, volume seen from its middle."""
    corner = X[F] - X.mean(axis=0)
    vector = area_vectors(corner)
    if topology(F, patch, len(X)).boundary_edge.any():
        return vector @ np.array(plane.normal)
    return np.einsum("ij,ij->i", corner[:, 0], vector) / 3.0
