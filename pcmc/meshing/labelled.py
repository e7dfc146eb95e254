"""A Surface from any triangle mesh with face labels: patches, supports, walls."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..base import validate
from ..base.arrays import Floats, Ints
from ..base.errors import OptionError, SurfaceError, unknown
from ..surface import Patch, Plane, Surface, checks
from ..surface.geometry import area_vectors
from ..surface.topology import SIDES, components, one_sided_copies, topology
from .planar import twins
from .walls import EDGES, add_walls


def surface_from_labels(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    labels: npt.ArrayLike | None = None,
    *,
    tension: float | Mapping[str, float],
    pressure: float | Mapping[str, float] = 1.0,
    boundary: str = "fixed",
    walls: float | Mapping[tuple[str, str], float] | None = None,
    bottom: str = "held",
    plane: Plane | None = None,
    weld: float = 0.0,
) -> Surface:
    """A Surface from a triangle mesh; each label of its faces is a patch.

    The faces of a patch are oriented alike, and outwards: towards the normal of Π, or, in a mesh
    without boundary, away from its centre. Unused vertices are left out.

    Parameters
    ----------
    vertices, faces : (n,3) and (m,3).
    labels : (m,) one per face, of any type; the name of a patch is ``str`` of its label. Without
        labels the mesh is one patch, "surface".
    tension, pressure : of all patches, or a mapping from their names.
    boundary : the support of the boundary: "fixed", "sliding" on Π, or "free".
    walls, bottom : tension of walls under the borders between patches, and their bottom; see ``add_walls``.
    plane : Π; z = 0 by default.
    weld : vertices nearer than this to each other are merged, length.

    Raises
    ------
    OptionError : an unknown name or option.
    SurfaceError : the arrays are no such mesh; names the first wrong index.

    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> s = surface_from_labels(square, [[0, 1, 2], [0, 3, 2]], ["a", "b"], tension=2.0)
    >>> [p.name for p in s.patches], s.faces.tolist()
    (['a', 'b'], [[0, 1, 2], [2, 3, 0]])
    """
    validate.choice("boundary", boundary, EDGES)
    plane = Plane() if plane is None else plane
    X = checks.positions(vertices)
    F: Ints = checks.face_array(faces, len(X)).astype(np.int64)
    validate.number("weld", weld, least=0.0)
    if weld > 0.0:
        label = components(cKDTree(X).query_pairs(weld, output_type="ndarray"), len(X))
        F = np.unique(label, return_index=True)[1][label][F]
    flat = (F[:, [1, 2, 0]] == F).any(axis=1)
    if flat.any():
        first = int(np.argmax(flat))
        merged = f"when vertices nearer than weld={weld:g} are merged; use a smaller weld"
        raise SurfaceError(f"faces[{first}] vanishes {merged}", what="faces", where=first)
    used, F = np.unique(F, return_inverse=True)
    X, F = X[used], F.reshape(-1, 3)
    names, patch = _names(labels, len(F))
    F = _oriented(X, F, patch, plane)
    edge = topology(F, patch, len(X)).on_boundary
    alpha, p = (_by_name(v, names, w) for v, w in ((tension, "tension"), (pressure, "pressure")))
    patches = tuple(Patch(name, alpha[name], p[name]) for name in names)
    held, sliding = edge & (boundary == "fixed"), edge & (boundary == "sliding")
    surface = Surface(X, F, patch, patches, held, sliding, plane)
    return surface if walls is None else add_walls(surface, walls, bottom)


def _names(labels: npt.ArrayLike | None, m: int) -> tuple[list[str], Ints]:
    """Patch names in order of first appearance, and the patch of each face."""
    if labels is None:
        return ["surface"], np.zeros(m, dtype=np.int64)
    given = np.asarray(labels)
    if given.shape != (m,):
        problem = f"labels: expected shape ({m},), one per face, found {given.shape}"
        raise SurfaceError(problem, what="labels", found=given.shape, expected=(m,))
    known, first, inverse = np.unique(given, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return [str(known[k]) for k in order], np.argsort(order)[inverse]


def _by_name(value: Any, names: list[str], what: str) -> dict[str, float]:
    if not isinstance(value, Mapping):
        return dict.fromkeys(names, float(value))
    for name in value:
        if name not in names:
            raise OptionError(unknown("patch", name, names), what=what, found=name, expected=tuple(names))
    for name in names:
        if name not in value:
            raise OptionError(f"{what}: no value for patch {name!r}", what=what, where=name)
    return {name: float(value[name]) for name in names}


def _oriented(X: Floats, F: Ints, patch: Ints, plane: Plane) -> Ints:
    """Faces oriented alike in a patch, and outwards: its area along Π, or the volume, is positive."""
    m, n = len(F), len(X)
    edge, place = F[:, SIDES].reshape(-1, 2), np.repeat(patch, 3)
    pairs = twins((place * n + edge.min(axis=1)) * n + edge.max(axis=1))
    # two faces that run along their edge the same way are oriented differently
    same = edge[pairs[:, 0], 0] == edge[pairs[:, 1], 0]
    one, two = pairs.T // 3
    side = one_sided_copies(one, two, same, m)
    both = side[:m] == side[m:]
    if both.any():
        face = int(np.argmax(both))
        problem = f"the patch of face {face} has only one side (like a Möbius strip)"
        raise SurfaceError(f"{problem}; cut it into two patches", what="faces", where=face)
    part = np.minimum(side[:m], side[m:])
    turned, corner = side[:m] != part, X[F] - X.mean(axis=0)
    closed = not topology(F, patch, n).boundary_edge.any()
    outward = (area_vectors(corner) * (corner[:, 0] if closed else plane.normal)).sum(axis=1)
    flip = turned ^ (np.bincount(part, np.where(turned, -outward, outward), 2 * m)[part] < 0.0)
    return np.where(flip[:, None], F[:, ::-1], F)
