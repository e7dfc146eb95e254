"""Checks of the arrays that a Surface is made of. Each error names the first wrong entry."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from numbers import Real
from typing import Any, NoReturn

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats, Ints, mask_of
from ..base.compiled import compiled
from ..base.errors import SurfaceError
from ..base.tolerances import NO_AREA, RESTING, RESTING_ROUNDED
from .geometry import bounding_size, cross, dot, norm, point, sub
from .topology import Topology

MANY = 16  # faces at one edge
LARGEST = validate.LARGEST
SMALLEST = 1e-50  # of a size or tension: the squares of forces and areas stay above zero
NUMBERS = "iuf"  # kinds of arrays of numbers


def positions(vertices: Any, what: str = "vertices") -> Floats:
    """(n,3) floats up to LARGEST, beyond which they cannot hold the forces; a copy of its own."""
    X = np.array(_plain(vertices, what), dtype=np.float64, order="C")
    if X.ndim != 2 or X.shape[1] != 3 or not len(X):
        refuse_shape(what, X, "(n, 3) with n > 0")
    if not reachable(X):
        refuse_rows(what, X, ~np.isfinite(X).all(axis=1), "is not finite", "replace or remove it")
        far = (np.abs(X) > LARGEST).any(axis=1)
        refuse_rows(what, X, far, f"is farther out than {LARGEST:g}", "use a larger unit of length")
    return X


@compiled
def reachable(X: Floats) -> bool:
    """Whether all coordinates are numbers up to LARGEST."""
    for v in range(len(X)):
        for d in range(X.shape[1]):
            if not abs(X[v, d]) <= LARGEST:
                return False
    return True


def large_enough(X: Floats) -> float:
    """The size, which must be 0 or at least SMALLEST: floats cannot hold the squares of smaller areas."""
    size = bounding_size(X)
    if 0.0 < size < SMALLEST:
        message = f"vertices: the surface is only {size:g} across; use a smaller unit of length"
        raise SurfaceError(message, what="vertices", found=size, expected=f"≥ {SMALLEST:g}")
    return size


def face_array(faces: Any, n: int) -> Ints:
    """(m,3) int32 vertex indices within 0..n-1, no vertex twice in a face."""
    F = _integers(faces, "faces")
    if F.ndim != 2 or F.shape[1] != 3 or not len(F):
        refuse_shape("faces", F, "(m, 3) with m > 0")
    _within("faces", F, n, "vertex")
    refuse_rows("faces", F, (F[:, [1, 2, 0]] == F).any(axis=1), "has a vertex twice", "remove the face")
    return F.astype(np.int32, order="C")


def patch_array(patch_of_face: Any, m: int, names: Sequence[str]) -> Ints:
    """(m,) int32 indices into the patches of these names, every patch used."""
    P = _integers(patch_of_face, "patch_of_face")
    if P.shape != (m,):
        refuse_shape("patch_of_face", P, f"({m},), one entry per face")
    _within("patch_of_face", P, len(names), "patch")
    empty = np.flatnonzero(np.bincount(P, minlength=len(names)) == 0)
    if len(empty):
        message = f"patch {names[empty[0]]!r} (index {empty[0]}) has no faces; remove it"
        raise SurfaceError(message, what="patches", where=names[empty[0]])
    return P.astype(np.int32)


def mask(chosen: Any, n: int, what: str) -> Bools:
    """(n,) bool from such a mask or from an array of indices."""
    given = _plain(chosen, what)
    if given.dtype == bool:
        if given.shape != (n,):
            refuse_shape(what, given, f"({n},) for a mask")
        return given.copy()
    indices = _integers(given, what).ravel() if given.size else np.zeros(0, dtype=np.int64)
    _within(what, indices, n, "vertex")
    if len(indices) == n > 2 and indices.max() <= 1:
        raise SurfaceError(f"{what}: {n} numbers that are 0 or 1; give a mask as booleans", what=what)
    return mask_of(indices, n)


def pair_array(pairs: Any, n: int) -> Ints:
    """(k,2) int64 pairs of an image and its vertex, within 0..n-1."""
    E = _integers(pairs, "images")
    E = E if E.size else E.reshape(0, 2)
    if E.ndim != 2 or E.shape[1] != 2:
        refuse_shape("images", E, "(k, 2), pairs of an image and its vertex")
    _within("images", E, n, "vertex")
    return E


def edge_array(edges: Any, what: str) -> Ints:
    """(k,2) int32 pairs of vertices, the smaller first, in ascending order, none twice."""
    E = _integers(edges, what)
    if E.ndim != 2 or E.shape[1] != 2 or not len(E):
        refuse_shape(what, E, "(k, 2) with k > 0")
    E, times = np.unique(np.sort(E, axis=1), axis=0, return_counts=True)
    refuse_rows(what, E, times > 1, "is given twice", "remove one")
    return E.astype(np.int32)


def mesh(
    X: Floats, F: Ints, patch: Ints, topo: Topology, patches: Sequence[Any], held: Bools, height: Floats
) -> None:
    """Every vertex is used, no triangle is flat or doubled, each patch is an oriented manifold.

    Within a patch an edge has at most two faces, and those run along it in opposite directions.
    """
    names = [p.name for p in patches]
    unused = np.bincount(F.ravel(), minlength=len(X)) == 0
    refuse_rows("vertices", X, unused, "belongs to no face", "remove it and renumber the faces")
    flat = _flat(X, F)
    if flat.any():
        from scipy.spatial import cKDTree  # here, as few surfaces have flat faces

        # a wall whose junction rests has no height: it shares a vertex on Π or at one of a held bottom, which
        # no support holds, with a sheet under pressure; its faces with two such, one not held, may be flat
        low = lying(height, X)
        wall = np.array([p.auxiliary for p in patches])[patch]
        bottom = X[np.intersect1d(F[wall], np.flatnonzero(held))]
        if len(bottom):
            low |= lying(np.asarray(cKDTree(bottom).query(X)[0]), X)
        rests = low & ~held
        outer = mask_of(F[~wall], len(low))
        pinched = mask_of(patch[wall & (rests & outer)[F].any(axis=1)], len(patches))
        flat &= ~(wall & pinched[patch] & (low[F].sum(axis=1) >= 2) & rests[F].any(axis=1))
    if flat.any():
        fault = f"of patch {names[patch[flat.argmax()]]!r} has zero area"
        refuse_rows("faces", F, flat, fault, "merge its vertices or remesh")
    if not _perhaps_at_fault(topo.faces, patch, topo.edge_of_face, len(topo.edges)):
        return
    F = topo.faces  # images and their vertices as one
    pair = np.sort(topo.edge_of_face, axis=1).astype(np.int64)  # two edges make a triangle
    for first, second in _first_double(pair[:, 0] * len(topo.edges) + pair[:, 1]):
        message = f"faces[{second}] is the same triangle as faces[{first}] = {F[first].tolist()}; remove one"
        raise SurfaceError(message, what="faces", where=second, found=F[second].tolist())
    start, end = F[:, [1, 2, 0]].ravel(), F[:, [2, 0, 1]].ravel()
    within = np.repeat(patch, 3).astype(np.int64)
    key = (topo.edge_of_face.ravel().astype(np.int64) * len(names) + within) * 2 + (start < end)
    for one, two in _first_double(key):
        ends = sorted((int(start[one]), int(end[one])))
        many, faces = np.count_nonzero(key // 2 == key[one] // 2), f"faces {one // 3} and {two // 3}"
        fault = f" is not consistently oriented: {faces} run along edge {ends} the same way;"
        fault += " reverse one of them"
        if many > 2:
            fault = f": {many} of its faces share edge {ends} ({faces} among them);"
            fault += " split it into patches that each have at most two faces at an edge"
        raise SurfaceError(f"patch {names[within[one]]!r}{fault}", what="faces", where=two // 3)


@compiled
def _flat(X: Floats, F: Ints) -> Bools:
    """(m,) triangles without an area that floats could tell from zero."""
    out = np.zeros(len(F), dtype=np.bool_)
    for f in range(len(F)):
        a, b, c = point(X, F[f, 0]), point(X, F[f, 1]), point(X, F[f, 2])
        u, v, w = sub(b, a), sub(c, b), sub(a, c)
        out[f] = norm(cross(u, w)) <= NO_AREA * max(dot(u, u), dot(v, v), dot(w, w))
    return out


@compiled
def _perhaps_at_fault(F: Ints, patch: Ints, edge_of_face: Ints, edge_count: int) -> bool:
    """Whether two faces at an edge are the same, or of one patch and run along it the same way.

    True also where an edge has so many faces that sorting them all shows it sooner.
    """
    last = np.full(edge_count, -1, dtype=np.int32)
    before = np.empty((len(F), 3), dtype=np.int32)  # the face seen last at the same edge
    for f in range(len(F)):
        for k in range(3):
            edge = edge_of_face[f, k]
            other, seen = last[edge], 0
            while other >= 0:
                j = 0
                while edge_of_face[other, j] != edge:
                    j += 1
                if F[other, j] == F[f, k] or seen == MANY:
                    return True
                if patch[other] == patch[f] and F[other, j - 2] == F[f, k - 2]:
                    return True
                other, seen = before[other, j], seen + 1
            before[f, k], last[edge] = last[edge], f
    return False


def lying(height: Floats, X: Floats) -> Bools:
    """(n,) whether vertices at these heights over Π lie on it, to rounding of their coordinates."""
    rounding = RESTING_ROUNDED * float(np.abs(X).max(initial=0.0))
    return np.abs(height) <= max(RESTING * bounding_size(X), rounding)


def _first_double(key: Ints) -> list[tuple[int, int]]:
    """Places of the first value that comes twice (by place of the second), if there is one."""
    order = np.argsort(key, kind="stable")
    again = np.flatnonzero(key[order[1:]] == key[order[:-1]])
    nearest = again[np.argsort(order[again + 1])[:1]]
    return [(int(order[k]), int(order[k + 1])) for k in nearest]


def _plain(values: Any, what: str) -> Any:
    """Any array, sequence or other collection as an array of numbers or of truth values."""
    if isinstance(values, Iterable) and not isinstance(values, Sequence | Mapping | str | bytes):
        values = values if hasattr(values, "__array__") else list(values)
    masked = values if isinstance(values, list | tuple) else [values]
    if any(np.ma.is_masked(part) for part in masked):
        raise SurfaceError(f"{what}: some entries are masked; fill or remove them", what=what)
    try:
        array = np.asarray(values)
        if array.dtype.kind == "O" and all(isinstance(value, Real) for value in array.flat):
            array = array.astype(np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise SurfaceError(f"{what}: expected a regular array of numbers ({error})", what=what) from None
    if array.dtype.kind not in NUMBERS + "b" and array.size:
        message = f"{what}: expected an array of real numbers, found one of {array.dtype}"
        raise SurfaceError(message, what=what, found=str(array.dtype), expected="real numbers")
    return array


def _integers(values: Any, what: str) -> Ints:
    given = _plain(values, what)
    if given.dtype.kind not in "iu" or (given.dtype.kind == "u" and (given > 2**53).any()):
        given = given.astype(np.float64)
        bad = np.argwhere((given != np.floor(given)) | (np.abs(given) > 2**53))
        if len(bad):
            place = tuple(bad[0].tolist())
            message = f"{what}{list(place) or ''}: expected a whole number, found {given[place]}"
            raise SurfaceError(message, what=what, where=place[0] if len(place) == 1 else place)
    return np.asarray(given.astype(np.int64))


def _within(what: str, rows: Ints, count: int, kind: str) -> None:
    """Refuse the first row (k,) or (k,d) with a number outside 0..count - 1."""
    span, outside = f"0..{count - 1}", (rows < 0) | (rows >= count)
    bad = outside.any(axis=tuple(range(1, rows.ndim)))
    refuse_rows(what, rows, bad, f"names a {kind} outside the range {span}", expected=span)


def refuse_shape(what: str, array: Any, expected: object) -> NoReturn:
    message = f"{what}: expected shape {expected}, found {array.shape}"
    raise SurfaceError(message, what=what, found=array.shape, expected=expected)


def refuse_rows(
    what: str, rows: Any, bad: Any, fault: str, hint: str = "", expected: str | None = None
) -> None:
    """Refuse the first of the rows that are ``bad`` (k,) bool, with their number; none may be."""
    if bad.any():
        first, number = int(bad.argmax()), int(bad.sum())
        count = f" ({number} such entries)" if number > 1 else ""
        message = f"{what}[{first}] = {rows[first].tolist()} {fault}{count}{hint and f'; {hint}'}"
        raise SurfaceError(message, what=what, where=first, found=rows[first].tolist(), expected=expected)


def refuse_snow(surface: Any, edges: Ints) -> NoReturn:
    """Refuse the snow of a Surface that ends at some edges (k,), as there it is no change of pressure."""
    topo = surface.topology
    i, j = topo.edges[edges[0]].tolist()
    beside = np.unique(surface.patch_of_face[(topo.edge_of_face == edges[0]).any(axis=1)])
    seam = (topo.seam_edge & ~topo.one_way_edge)[edges].all() and not surface.walls[beside].any()
    some = [surface.patches[k] for k in beside] if seam else surface.patches
    most, *others = sorted(some, key=lambda patch: -abs(patch.snow))
    snow, patch = most.snow, most.name
    if seam:
        other = others[0].name
        text = f"snow differs between {patch!r} and {other!r}, and no wall stands there; give both the same:"
        text += f" {other!r} = {{snow = {snow:g}}} under patches in a project, or --snow {other!r}={snow:g},"
        text += f" or retensioned(snows={{{other!r}: {snow:g}}})"
    else:
        text = f"snow: {len(edges)} edges are free or the end of it, the first from vertex {i} to {j}, and"
        text += " there a change of pressure is not the same as snow; give a weight instead"
        text += f" (--weight {patch!r}={snow:g}, or retensioned(weights={{{patch!r}: {snow:g}}}))"
    raise SurfaceError(text, what="snow", where=(i, j))
