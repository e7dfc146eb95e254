"""Checks of the arrays that a Surface is made of. Each error names the first wrong entry."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from ..base import validate
from ..base.arrays import Bools, Floats, Ints
from ..base.errors import SurfaceError
from .geometry import bounding_size, edge_vectors, face_areas
from .topology import Topology

ZERO_AREA = 1e-14  # of the squared longest edge: below this a triangle has no direction in floats
LARGEST = 1e50  # of a coordinate, tension or pressure: the squares of forces stay finite
RESTING = 1e-12  # height, relative to the size, at which a vertex counts as lying on Π
ROUNDED = 8.0 * float(np.finfo(float).eps)  # the same, relative to the coordinates


def positions(vertices: npt.ArrayLike) -> Floats:
    """(n,3) finite floats, a copy of its own."""
    X = _array(vertices, "vertices", np.float64)
    if X.ndim != 2 or X.shape[1] != 3 or not len(X):
        refuse_shape("vertices", X, "(n, 3) with n > 0")
    bad = np.flatnonzero(~np.isfinite(X).all(axis=1))
    if len(bad):
        _refuse_rows("vertices", X, bad, "is not finite", hint="replace or remove it")
    return X


def within_reach(X: Floats) -> None:
    """Coordinates up to LARGEST: a solver may run beyond, but not start there."""
    bad = np.flatnonzero((np.abs(X) > LARGEST).any(axis=1))
    if len(bad):
        _refuse_rows(
            "vertices", X, bad, f"is farther out than {LARGEST:g}", hint="use a larger unit of length"
        )


def face_array(faces: npt.ArrayLike, n: int) -> Ints:
    """(m,3) int32 vertex indices within 0..n-1, no vertex twice in a face."""
    F = _integers(faces, "faces")
    if F.ndim != 2 or F.shape[1] != 3 or not len(F):
        refuse_shape("faces", F, "(m, 3) with m > 0")
    bad = np.flatnonzero(((F < 0) | (n <= F)).any(axis=1))
    if len(bad):
        _refuse_rows("faces", F, bad, "names a vertex outside the range", f"0..{n - 1}")
    bad = np.flatnonzero((F[:, [1, 2, 0]] == F).any(axis=1))
    if len(bad):
        _refuse_rows("faces", F, bad, "has a vertex twice", hint="remove the face")
    return F.astype(np.int32)


def patch_array(patch_of_face: npt.ArrayLike, m: int, patches: Sequence[Any]) -> Ints:
    """(m,) int32 indices into ``patches``, every patch used, names unique."""
    names = [getattr(p, "name", None) for p in patches] if isinstance(patches, Iterable) else []
    if not names or None in names:
        validate.refuse("patches", patches, "a sequence of Patch", error=SurfaceError)
    double = [name for name, times in Counter(map(str, names)).items() if times > 1]
    if double:
        message = f"patches: the name {double[0]!r} is used twice; names must be unique"
        raise SurfaceError(message, what="patches", found=double[0])
    P = _integers(patch_of_face, "patch_of_face")
    if P.shape != (m,):
        refuse_shape("patch_of_face", P, f"({m},), one entry per face")
    bad = np.flatnonzero((P < 0) | (len(names) <= P))
    if len(bad):
        _refuse_rows("patch_of_face", P, bad, "names a patch outside the range", f"0..{len(names) - 1}")
    empty = np.flatnonzero(np.bincount(P, minlength=len(names)) == 0)
    if len(empty):
        message = f"patch {names[empty[0]]!r} (index {empty[0]}) has no faces; remove it"
        raise SurfaceError(message, what="patches", where=names[empty[0]])
    return P.astype(np.int32)


def mask(chosen: Any, n: int, what: str) -> Bools:
    """(n,) bool from such a mask or from an array of indices."""
    given = np.asarray(list(chosen) if isinstance(chosen, range | set | frozenset) else chosen)
    if given.dtype == bool:
        if given.shape != (n,):
            refuse_shape(what, given, f"({n},) for a mask")
        return given.copy()
    result = np.zeros(n, dtype=bool)
    if given.size:
        indices = _integers(given, what).ravel()
        bad = np.flatnonzero((indices < 0) | (indices >= n))
        if len(bad):
            _refuse_rows(what, indices, bad, "names a vertex outside the range", f"0..{n - 1}")
        result[indices] = True
    return result


def mesh(
    X: Floats, F: Ints, patch: Ints, topo: Topology, patches: Sequence[Any], held: Bools, height: Floats
) -> None:
    """Every vertex is used, no triangle is flat or doubled, each patch is an oriented manifold."""
    names = [p.name for p in patches]
    unused = np.flatnonzero(np.bincount(F.ravel(), minlength=len(X)) == 0)
    if len(unused):
        _refuse_rows("vertices", X, unused, "belongs to no face", hint="remove it and renumber the faces")
    longest = (edge_vectors(X[F]) ** 2).sum(axis=2).max(axis=1)
    flat = 2.0 * face_areas(X[F]) <= ZERO_AREA * longest
    if flat.any():
        flat &= ~_vanished(F, patch, patches, held, lying(height, X))
    bad = np.flatnonzero(flat)
    if len(bad):
        fault = f"of patch {names[patch[bad[0]]]!r} has zero area"
        _refuse_rows("faces", F, bad, fault, hint="merge its vertices or remesh")
    pair = np.sort(topo.edge_of_face, axis=1).astype(np.int64)  # two edges make a triangle
    same = _first_double(pair[:, 0] * len(topo.edges) + pair[:, 1])
    if same is not None:
        first, second = same
        message = f"faces[{second}] is the same triangle as faces[{first}] = {F[first].tolist()}; remove one"
        raise SurfaceError(message, what="faces", where=second, found=F[second].tolist())
    _oriented(F, patch, topo, names)


def _vanished(F: Ints, patch: Ints, patches: Sequence[Any], held: Bools, low: Bools) -> Bools:
    """(m,) faces of a wall without height, because its junction rests on Π.

    Such a wall shares a vertex on Π, which no support holds, with a sheet under pressure. A face of it
    may have no area if two of its vertices are on Π and one of these is not held.
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
    return np.abs(height) <= max(RESTING * bounding_size(X), ROUNDED * float(np.abs(X).max(initial=0.0)))


def on_plane(height: Floats, sliding: Bools, X: Floats, size: float) -> None:
    """Sliding vertices must lie on Π to 1e-9 of the size, or to rounding of their coordinates."""
    near = max(1e-9 * size, ROUNDED * float(np.abs(X).max(initial=0.0)))
    bad = np.flatnonzero(sliding & (np.abs(height) > near))
    if len(bad):
        fault = f"slides on the plane, but is {height[bad[0]]:.3g} away from it"
        hint = "move it onto the plane or hold it with fixed="
        _refuse_rows("vertices", X, bad, fault, hint=hint)


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
    fault = (
        f": {many} of its faces share edge {ends} (faces {one // 3} and {two // 3} among them);"
        " split it into patches that each have at most two faces at an edge"
        if many > 2
        else f" is not consistently oriented: faces {one // 3} and {two // 3} run along edge {ends}"
        " the same way; reverse one of them"
    )
    raise SurfaceError(f"patch {names[within[one]]!r}{fault}", what="faces", where=two // 3)


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
        raise SurfaceError(f"{what}: expected a regular array of numbers ({error})", what=what) from None


def _integers(values: npt.ArrayLike, what: str) -> Ints:
    given = _array(values, what, None)
    if not np.issubdtype(given.dtype, np.integer):
        given = _array(given, what, np.float64)
        bad = np.argwhere((given != np.floor(given)) | (np.abs(given) > 2**53))
        if len(bad):
            place = tuple(bad[0].tolist())
            message = f"{what}{list(place)}: expected a whole number, found {given[place]}"
            raise SurfaceError(message, what=what, where=place if len(place) > 1 else place[0])
    return np.asarray(given.astype(np.int64))


def refuse_shape(what: str, array: Any, expected: object) -> NoReturn:
    """Refuse an array of another shape than expected."""
    message = f"{what}: expected shape {expected}, found {array.shape}"
    raise SurfaceError(message, what=what, found=array.shape, expected=expected)


def _refuse_rows(
    what: str, rows: Any, bad: Ints, fault: str, expected: str | None = None, hint: str = ""
) -> NoReturn:
    """Refuse the first of the bad rows, with their number."""
    first = int(bad[0])
    limits = "" if expected is None else f" {expected}"
    count = f" ({len(bad)} such entries)" if len(bad) > 1 else ""
    message = f"{what}[{first}] = {rows[first].tolist()} {fault}{limits}{count}{hint and f'; {hint}'}"
    raise SurfaceError(message, what=what, where=first, found=rows[first].tolist(), expected=expected)
