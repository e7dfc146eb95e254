"""The checks that stand between a caller's arrays and a Surface. Each names the first offender."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import SurfaceError
from .geometry import Vector, bounding_size, edge_vectors, face_areas
from .topology import Topology

ZERO_AREA = 1e-14  # of the squared longest edge: below this a triangle has no direction in floats
LARGEST = 1e50  # of a coordinate, tension or pressure: the squares of forces stay finite
RESTING = 1e-12  # height, relative to the size, at which a vertex counts as lying on Π
ROUNDED = 8.0 * float(np.finfo(float).eps)  # the same, relative to the coordinates


def finite_vector(value: Any, what: str) -> Vector:
    """Three finite numbers, or an error that says ``what`` they were to be."""
    try:
        vector = tuple(float(c) for c in value)
    except (TypeError, ValueError):
        vector = ()
    if len(vector) != 3 or not all(np.isfinite(vector)):
        raise SurfaceError(f"{what}: expected three finite numbers, found {value!r}")
    return vector[0], vector[1], vector[2]


def positions(vertices: npt.ArrayLike) -> Floats:
    """(n,3) finite floats, a copy of its own."""
    X = _array(vertices, "vertices", np.float64)
    if X.ndim != 2 or X.shape[1] != 3 or not len(X):
        raise SurfaceError(f"vertices: expected shape (n, 3) with n > 0, found {X.shape}")
    bad = np.flatnonzero(~np.isfinite(X).all(axis=1))
    if len(bad):
        raise SurfaceError(
            f"vertices[{bad[0]}] = {X[bad[0]].tolist()} is not finite ({len(bad)} such vertices);"
            " replace or remove it"
        )
    return X


def within_reach(X: Floats) -> None:
    """Coordinates up to LARGEST: a solver may run beyond, but not start there."""
    bad = np.flatnonzero((np.abs(X) > LARGEST).any(axis=1))
    if len(bad):
        raise SurfaceError(
            f"vertices[{bad[0]}] = {X[bad[0]].tolist()} is farther out than {LARGEST:g}"
            f" ({len(bad)} such vertices); use a larger unit of length"
        )


def face_array(faces: npt.ArrayLike, n: int) -> Ints:
    """(m,3) int32 vertex indices within 0..n-1, no vertex twice in a face."""
    F = _integers(faces, "faces")
    if F.ndim != 2 or F.shape[1] != 3 or not len(F):
        raise SurfaceError(f"faces: expected shape (m, 3) with m > 0, found {F.shape}")
    bad = np.flatnonzero(((F < 0) | (n <= F)).any(axis=1))
    if len(bad):
        raise SurfaceError(
            f"faces[{bad[0]}] = {F[bad[0]].tolist()} names a vertex outside 0..{n - 1}"
            f" ({len(bad)} such faces)"
        )
    twice = (F[:, 0] == F[:, 1]) | (F[:, 1] == F[:, 2]) | (F[:, 2] == F[:, 0])
    bad = np.flatnonzero(twice)
    if len(bad):
        raise SurfaceError(
            f"faces[{bad[0]}] = {F[bad[0]].tolist()} has a vertex twice ({len(bad)} such faces);"
            " remove the face"
        )
    return F.astype(np.int32)


def patch_array(patch_of_face: npt.ArrayLike, m: int, patches: Sequence[Any]) -> Ints:
    """(m,) int32 indices into ``patches``, every patch used, names unique."""
    names = [getattr(p, "name", None) for p in patches] if isinstance(patches, Iterable) else []
    if not names or None in names:
        raise SurfaceError(f"patches: expected a sequence of Patch, found {patches!r}")
    double = [name for place, name in enumerate(names) if name in names[:place]]
    if double:
        raise SurfaceError(f"patches: the name {double[0]!r} is used twice; names must be unique")
    P = _integers(patch_of_face, "patch_of_face")
    if P.shape != (m,):
        raise SurfaceError(f"patch_of_face: expected shape ({m},), one per face, found {P.shape}")
    bad = np.flatnonzero((P < 0) | (len(names) <= P))
    if len(bad):
        raise SurfaceError(f"patch_of_face[{bad[0]}] = {P[bad[0]]} is outside 0..{len(names) - 1}")
    empty = np.flatnonzero(np.bincount(P, minlength=len(names)) == 0)
    if len(empty):
        raise SurfaceError(f"patch {names[empty[0]]!r} (index {empty[0]}) has no faces; remove it")
    return P.astype(np.int32)


def mask(chosen: Any, n: int, what: str) -> Bools:
    """(n,) bool from such a mask or from an array of indices."""
    given = np.asarray(list(chosen) if isinstance(chosen, range | set | frozenset) else chosen)
    if given.dtype == bool:
        if given.shape != (n,):
            raise SurfaceError(f"{what}: a mask must have shape ({n},), found {given.shape}")
        return given.copy()
    result = np.zeros(n, dtype=bool)
    if given.size:
        indices = _integers(given, what).ravel()
        bad = np.flatnonzero((indices < 0) | (indices >= n))
        if len(bad):
            raise SurfaceError(f"{what}[{bad[0]}] = {indices[bad[0]]} is outside 0..{n - 1}")
        result[indices] = True
    return result


def mesh(
    X: Floats,
    F: Ints,
    patch: Ints,
    topo: Topology,
    patches: Sequence[Any],
    held: Bools,
    height: Floats,
) -> None:
    """Unreferenced vertices, zero areas, double faces, and each patch an oriented manifold."""
    names = [p.name for p in patches]
    unused = np.flatnonzero(np.bincount(F.ravel(), minlength=len(X)) == 0)
    if len(unused):
        raise SurfaceError(
            f"vertex {unused[0]} belongs to no face ({len(unused)} such vertices); remove it and"
            " renumber the faces"
        )
    longest = (edge_vectors(X[F]) ** 2).sum(axis=2).max(axis=1)
    flat = 2.0 * face_areas(X[F]) <= ZERO_AREA * longest
    if flat.any():
        low = lying(height, X)
        flat &= ~_vanished(F, patch, patches, held, low)
    bad = np.flatnonzero(flat)
    if len(bad):
        raise SurfaceError(
            f"face {bad[0]} = {F[bad[0]].tolist()} of patch {names[patch[bad[0]]]!r} has zero area"
            f" ({len(bad)} such faces); merge its vertices or remesh"
        )
    pair = np.sort(topo.edge_of_face, axis=1).astype(np.int64)  # two edges make a triangle
    same = _first_double(pair[:, 0] * len(topo.edges) + pair[:, 1])
    if same is not None:
        first, second = same
        raise SurfaceError(
            f"faces {first} and {second} are the same triangle {F[first].tolist()}; remove one"
        )
    _oriented(F, patch, topo, names)


def _vanished(F: Ints, patch: Ints, patches: Sequence[Any], held: Bools, low: Bools) -> Bools:
    """(m,) faces of a wall that has no height there, because its junction rests on Π.

    Such a wall has a vertex on Π that nothing holds there and that a sheet under pressure shares. Of
    its faces those may have no area that have two vertices on Π, one of them not held.
    """
    wall = np.array([p.auxiliary for p in patches])[patch]
    rests = low & ~held
    outer = np.zeros(len(low), dtype=bool)
    outer[F[~wall]] = True
    pinched = np.zeros(len(patches), dtype=bool)
    pinched[patch[wall & (rests & outer)[F].any(axis=1)]] = True
    return wall & pinched[patch] & (low[F].sum(axis=1) >= 2) & rests[F].any(axis=1)


def lying(height: Floats, X: Floats) -> Bools:
    """(n,) whether vertices at these heights over Π lie on it, to rounding of their coordinates."""
    return np.abs(height) <= max(
        RESTING * bounding_size(X), ROUNDED * float(np.abs(X).max(initial=0.0))
    )


def on_plane(height: Floats, sliding: Bools, X: Floats, size: float) -> None:
    """Sliding vertices must lie on Π to 1e-9 of the size, or to rounding of their coordinates."""
    near = max(1e-9 * size, ROUNDED * float(np.abs(X).max(initial=0.0)))
    bad = np.flatnonzero(sliding & (np.abs(height) > near))
    if len(bad):
        raise SurfaceError(
            f"vertex {bad[0]} slides on the plane but lies {height[bad[0]]:.3g} away from it"
            f" ({len(bad)} such vertices); move it onto the plane or hold it with fixed="
        )


def _oriented(F: Ints, patch: Ints, topo: Topology, names: Sequence[str]) -> None:
    """Within a patch an edge has at most two faces, and those run along it in opposite directions."""
    edge = topo.edge_of_face.ravel().astype(np.int64)
    start, end = F[:, [1, 2, 0]].ravel(), F[:, [2, 0, 1]].ravel()
    within = np.repeat(patch, 3).astype(np.int64)
    key = (edge * len(names) + within) * 2 + (start < end)
    double = _first_double(key)
    if double is None:
        return
    one, two = double
    ends = sorted((int(start[one]), int(end[one])))
    many = np.count_nonzero(key // 2 == key[one] // 2)
    if many > 2:
        raise SurfaceError(
            f"patch {names[within[one]]!r}: {many} of its faces share edge {ends} (faces"
            f" {one // 3} and {two // 3} among them); split it into patches that each have at"
            " most two faces at an edge"
        )
    raise SurfaceError(
        f"patch {names[within[one]]!r} is not consistently oriented: faces {one // 3} and"
        f" {two // 3} run along edge {ends} the same way; reverse one of them"
    )


def _first_double(key: Ints) -> tuple[int, int] | None:
    """Places of the first value that comes twice (by place of the second), or None."""
    order = np.argsort(key, kind="stable")
    ranked = key[order]
    again = np.flatnonzero(ranked[1:] == ranked[:-1])
    if not len(again):
        return None
    nearest = again[np.argmin(order[again + 1])]
    return int(order[nearest]), int(order[nearest + 1])


def _array(values: npt.ArrayLike, what: str, dtype: Any) -> Any:
    try:
        return np.array(values, dtype=dtype, order="C")
    except (TypeError, ValueError) as error:
        raise SurfaceError(f"{what}: expected a regular array of numbers ({error})") from None


def _integers(values: npt.ArrayLike, what: str) -> Ints:
    found = _array(values, what, None)
    if not np.issubdtype(found.dtype, np.integer):
        as_float = _array(found, what, np.float64)
        flat = as_float.ravel()
        bad = np.flatnonzero((flat != np.floor(flat)) | (np.abs(flat) > 2**53))
        if len(bad):
            raise SurfaceError(
                f"{what}: expected whole numbers, found {flat[bad[0]]} at place {bad[0]}"
            )
        found = as_float.astype(np.int64)
    return found.astype(np.int64)
