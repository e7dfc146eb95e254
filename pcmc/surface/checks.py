"""Checks of the arrays that a Surface is made of. Each error names the first wrong entry."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from numbers import Real
from typing import Any, NoReturn

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats, Ints
from ..base.compiled import compiled
from ..base.errors import SurfaceError
from .circle import Circle, Guide
from .geometry import bounding_size, cross, dot, norm, point, sub
from .topology import Topology

GUIDES = "a mapping from Lines or Circles to vertices"
ZERO_AREA = 1e-14  # of the squared longest edge: below this a triangle has no direction in floats
MANY = 16  # faces at one edge
LARGEST = validate.LARGEST
SMALLEST = 1e-50  # of a size or tension: the squares of forces and areas stay above zero
NUMBERS = "iuf"  # kinds of arrays of numbers
RESTING = 1e-12  # height, relative to the size, at which a vertex counts as lying on Π
ROUNDED = 8.0 * float(np.finfo(float).eps)  # the same, relative to the coordinates


def positions(vertices: Any) -> Floats:
    """(n,3) floats up to LARGEST, beyond which they cannot hold the forces; a copy of its own."""
    X = np.array(_plain(vertices, "vertices"), dtype=np.float64, order="C")
    if X.ndim != 2 or X.shape[1] != 3 or not len(X):
        refuse_shape("vertices", X, "(n, 3) with n > 0")
    if not reachable(X):
        bad = np.flatnonzero(~np.isfinite(X).all(axis=1))
        if len(bad):
            refuse_rows("vertices", X, bad, "is not finite", hint="replace or remove it")
        bad = np.flatnonzero((np.abs(X) > LARGEST).any(axis=1))
        hint = "use a larger unit of length"
        refuse_rows("vertices", X, bad, f"is farther out than {LARGEST:g}", hint=hint)
    return X


@compiled
def reachable(X: Floats) -> bool:
    """Whether all coordinates are numbers up to LARGEST."""
    for v in range(len(X)):
        for d in range(X.shape[1]):
            if not abs(X[v, d]) <= LARGEST:
                return False
    return True


def large_enough(X: Floats) -> None:
    """At least SMALLEST across: floats cannot hold the squares of areas of a smaller surface."""
    size = bounding_size(X)
    if 0.0 < size < SMALLEST:
        message = f"vertices: the surface is only {size:g} across; use a smaller unit of length"
        raise SurfaceError(message, what="vertices", found=size, expected=f"≥ {SMALLEST:g}")


def face_array(faces: Any, n: int) -> Ints:
    """(m,3) int32 vertex indices within 0..n-1, no vertex twice in a face."""
    F = _integers(faces, "faces")
    if F.ndim != 2 or F.shape[1] != 3 or not len(F):
        refuse_shape("faces", F, "(m, 3) with m > 0")
    bad = np.flatnonzero(((F < 0) | (n <= F)).any(axis=1))
    if len(bad):
        refuse_rows("faces", F, bad, "names a vertex outside the range", f"0..{n - 1}")
    bad = np.flatnonzero((F[:, [1, 2, 0]] == F).any(axis=1))
    if len(bad):
        refuse_rows("faces", F, bad, "has a vertex twice", hint="remove the face")
    return F.astype(np.int32)


def patch_array(patch_of_face: Any, m: int, patches: Sequence[Any]) -> Ints:
    """(m,) int32 indices into ``patches``, every patch used, names unique."""
    names = [p.name for p in patches]
    unique_names("patches", names)
    P = _integers(patch_of_face, "patch_of_face")
    if P.shape != (m,):
        refuse_shape("patch_of_face", P, f"({m},), one entry per face")
    bad = np.flatnonzero((P < 0) | (len(names) <= P))
    if len(bad):
        refuse_rows("patch_of_face", P, bad, "names a patch outside the range", f"0..{len(names) - 1}")
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
    result = np.zeros(n, dtype=bool)
    if given.size:
        indices = _integers(given, what).ravel()
        bad = np.flatnonzero((indices < 0) | (indices >= n))
        if len(bad):
            refuse_rows(what, indices, bad, "names a vertex outside the range", f"0..{n - 1}")
        result[indices] = True
    return result


def edge_array(edges: Any, what: str) -> Ints:
    """(k,2) int32 pairs of vertices, the smaller first, in ascending order, none twice."""
    E = _integers(edges, what)
    if E.ndim != 2 or E.shape[1] != 2 or not len(E):
        refuse_shape(what, E, "(k, 2) with k > 0")
    E = np.sort(E, axis=1)
    order = np.lexsort((E[:, 1], E[:, 0]))
    E = E[order]
    bad = np.flatnonzero((E[1:] == E[:-1]).all(axis=1))
    if len(bad):
        refuse_rows(what, E, bad, "is given twice", hint="remove one")
    return E.astype(np.int32)


def unique_names(what: str, names: Iterable[str]) -> None:
    """Refuse the first name that is used twice."""
    double = [name for name, times in Counter(names).items() if times > 1]
    if double:
        message = f"{what}: the name {double[0]!r} is used twice; names must be unique"
        raise SurfaceError(message, what=what, found=double[0])


def mesh(
    X: Floats, F: Ints, patch: Ints, topo: Topology, patches: Sequence[Any], held: Bools, height: Floats
) -> None:
    """Every vertex is used, no triangle is flat or doubled, each patch is an oriented manifold."""
    names = [p.name for p in patches]
    unused = np.flatnonzero(np.bincount(F.ravel(), minlength=len(X)) == 0)
    if len(unused):
        refuse_rows("vertices", X, unused, "belongs to no face", hint="remove it and renumber the faces")
    flat = _flat(X, F)
    if flat.any():
        flat &= ~_vanished(F, patch, patches, held, lying(height, X))
    bad = np.flatnonzero(flat)
    if len(bad):
        fault = f"of patch {names[patch[bad[0]]]!r} has zero area"
        refuse_rows("faces", F, bad, fault, hint="merge its vertices or remesh")
    if not _perhaps_at_fault(F, patch, topo.edge_of_face, len(topo.edges)):
        return
    pair = np.sort(topo.edge_of_face, axis=1).astype(np.int64)  # two edges make a triangle
    same = _first_double(pair[:, 0] * len(topo.edges) + pair[:, 1])
    if same is not None:
        first, second = same
        message = f"faces[{second}] is the same triangle as faces[{first}] = {F[first].tolist()}; remove one"
        raise SurfaceError(message, what="faces", where=second, found=F[second].tolist())
    _oriented(F, patch, topo, names)


@compiled
def _flat(X: Floats, F: Ints) -> Bools:
    """(m,) triangles without an area that floats could tell from zero."""
    out = np.zeros(len(F), dtype=np.bool_)
    for f in range(len(F)):
        a, b, c = point(X, F[f, 0]), point(X, F[f, 1]), point(X, F[f, 2])
        u, v, w = sub(b, a), sub(c, b), sub(a, c)
        out[f] = norm(cross(u, w)) <= ZERO_AREA * max(dot(u, u), dot(v, v), dot(w, w))
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


def on_plane(height: Floats, sliding: Bools, X: Floats, size: float, name: str = "plane") -> None:
    """Sliding vertices must lie on their plane to 1e-9 of the size, or to rounding of their coordinates."""
    near = max(1e-9 * size, ROUNDED * float(np.abs(X).max(initial=0.0)))
    bad = np.flatnonzero(sliding & (np.abs(height) > near))
    if len(bad):
        fault = f"slides on the {name}, but is {height[bad[0]]:.3g} away from it"
        hint = "move it onto the plane or hold it with fixed="
        refuse_rows("vertices", X, bad, fault, hint=hint)


def on_line(given: Any, X: Floats) -> list[tuple[Guide, Bools]]:
    """The lines and circles that vertices slide along, each with their (n,) mask; no vertex on two."""
    pairs = given.items() if isinstance(given, Mapping) else given
    lines, taken = [], np.zeros(len(X), dtype=bool)
    if not isinstance(pairs, Iterable):
        validate.refuse("on_line", given, GUIDES, error=SurfaceError)
    for pair in pairs:
        if not (isinstance(pair, Sequence) and len(pair) == 2 and isinstance(pair[0], Guide)):
            validate.refuse("on_line", given, GUIDES, error=SurfaceError)
        along = mask(pair[1], len(X), "on_line")
        bad = np.flatnonzero(along & taken)
        if len(bad):
            refuse_rows("vertices", X, bad, "slides along two lines", hint="hold it with fixed= instead")
        taken |= along
        lines.append((pair[0], along))
    on_lines(lines, X)
    return lines


def on_lines(lines: Iterable[tuple[Guide, Bools]], X: Floats) -> None:
    """Vertices must lie on the lines and circles they slide along to 1e-9 of the size, or to rounding."""
    for line, along in lines:
        near = max(1e-9 * bounding_size(X), ROUNDED * float(np.abs(X).max(initial=0.0)))
        distance = line.distance(X)
        bad = np.flatnonzero(along & (distance > near))
        if len(bad):
            name = "circle" if isinstance(line, Circle) else "line"
            place = f"around {line.centre}" if isinstance(line, Circle) else f"through {line.point}"
            fault = f"slides along the {name} {place}, but is {distance[bad[0]]:.3g} away from it"
            hint = f"move it onto the {name} or hold it with fixed="
            refuse_rows("vertices", X, bad, fault, hint=hint)


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
            message = f"{what}{list(place)}: expected a whole number, found {given[place]}"
            raise SurfaceError(message, what=what, where=place if len(place) > 1 else place[0])
    return np.asarray(given.astype(np.int64))


def refuse_shape(what: str, array: Any, expected: object) -> NoReturn:
    """Refuse an array of another shape than expected."""
    message = f"{what}: expected shape {expected}, found {array.shape}"
    raise SurfaceError(message, what=what, found=array.shape, expected=expected)


def refuse_rows(
    what: str, rows: Any, bad: Ints, fault: str, expected: str | None = None, hint: str = ""
) -> NoReturn:
    """Refuse the first of the bad rows, with their number."""
    first = int(bad[0])
    limits = "" if expected is None else f" {expected}"
    count = f" ({len(bad)} such entries)" if len(bad) > 1 else ""
    message = f"{what}[{first}] = {rows[first].tolist()} {fault}{limits}{count}{hint and f'; {hint}'}"
    raise SurfaceError(message, what=what, where=first, found=rows[first].tolist(), expected=expected)


def refuse_snow(snow: float, patch: str, free: int, edge: Ints, other: str = "") -> NoReturn:
    """Refuse snow as a change of pressure where edges are free; ``edge`` is the first of them.

    ``other`` is the patch beyond them if they are a seam and not free.
    """
    i, j = edge.tolist()
    if other:
        text = f"snow differs between {patch!r} and {other!r}, and no wall stands there; give both the same:"
        text += f" {other!r} = {{snow = {snow:g}}} under patches in a project, or --snow {other!r}={snow:g},"
        text += f" or retensioned(snows={{{other!r}: {snow:g}}})"
        raise SurfaceError(text, what="snow", where=(i, j))
    text = (
        f"snow: {free} edges are free or the end of it, the first from vertex {i} to {j}, and there a change"
    )
    text += f" of pressure is not the same as snow; give a weight instead (--weight {patch!r}={snow:g}, or"
    text += f" retensioned(weights={{{patch!r}: {snow:g}}}))"
    raise SurfaceError(text, what="snow", where=(i, j))
