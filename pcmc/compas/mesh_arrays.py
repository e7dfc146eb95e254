"""What COMPAS meshes hold, checked, as arrays and values. Every error names the mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from itertools import chain
from typing import Any, NoReturn

import numpy as np

from ..base import validate
from ..base.arrays import Floats, Ints
from ..base.errors import FileError, MissingExtra, OptionError, SurfaceError, unknown
from ..io.mesh_data import FIXED, FREE, SLIDING, coincident
from ..io.polygons import triangulate
from ..surface import Circle, Guide, Line, Patch, Plane

KEY = "pcmc"  # attribute of one mesh, the first in general: what belongs to the whole surface
GUIDES: dict[str, type[Guide]] = {"line": Line, "circle": Circle}
HELD = ("is_support", "is_anchor", "is_fixed")  # names that COMPAS packages use for a held vertex
SLIDES, GUIDE = "is_sliding", "guide"


def mesh_class() -> Any:
    """``compas.datastructures.Mesh``, or MissingExtra."""
    try:
        from compas.datastructures import Mesh
    except ImportError:
        raise MissingExtra("compas", "compas") from None
    return Mesh


@dataclass(frozen=True, eq=False)
class Vertices:
    """The vertices of all meshes, one after the other.

    Attributes
    ----------
    X : (v,3) coordinates.
    keys : (v,) their keys.
    start : (k+1,) where each mesh begins.
    support : (v,) FREE, SLIDING or FIXED; None if no mesh has an attribute for it.
    guide : (v,) number of the line or circle along which the vertex slides, or -1.
    """

    X: Floats
    keys: Ints
    start: Ints
    support: Ints | None
    guide: Ints


def named_meshes(meshes: Any) -> dict[str, Any]:
    """The meshes by name, which no two share."""
    kind = mesh_class()
    listed = [meshes] if isinstance(meshes, kind) else meshes
    if not isinstance(listed, Sequence) or not listed or not all(isinstance(mesh, kind) for mesh in listed):
        validate.refuse("meshes", meshes, "a COMPAS Mesh or a list of them", error=SurfaceError)
    named: dict[str, Any] = {}
    for number, mesh in enumerate(listed):
        if mesh.name in named:
            text = f"meshes[{number}]: {mesh.name!r} is another mesh's name; set mesh.name, a name per patch"
            raise SurfaceError(text, what="meshes", where=mesh.name, found=mesh.name)
        named[mesh.name] = mesh
    return named


def read_patches(named: Mapping[str, Any], tensions: Any, pressures: Any) -> list[Patch]:
    """A patch per mesh, from its attributes or the values given in their place."""
    given: dict[str, dict[str, Any]] = {}
    for key, values in (("tension", tensions), ("pressure", pressures)):
        if values is None:
            continue
        by_name = values if isinstance(values, Mapping) else dict.fromkeys(named, values)
        for name, value in by_name.items():
            if name not in named:
                raise OptionError(unknown("mesh", name, named), what=f"{key}s", where=name, found=name)
            given.setdefault(name, {})[key] = value
    patches = []
    for name, mesh in named.items():
        known = {f.name: f.default for f in fields(Patch) if f.name != "name"}
        values = {key: mesh.attributes[key] for key in known if key in mesh.attributes} | given.get(name, {})
        for key in [key for key, default in known.items() if default is MISSING and key not in values]:
            text = f"mesh {name!r} has no {key}; set mesh.attributes[{key!r}], or pass {key}s="
            raise SurfaceError(text, what=key, where=name)
        patches.append(Patch(name, **values))
    return patches


def read_vertices(named: Mapping[str, Any]) -> Vertices:
    """The vertices of all meshes."""
    start = np.cumsum([0, *(len(mesh.vertex) for mesh in named.values())])
    X, support, guide = np.empty((start[-1], 3)), np.full(start[-1], FREE), np.full(start[-1], -1)
    marked = False
    for name, mesh, first in zip(named, named.values(), start[:-1], strict=True):
        default, rows = mesh.default_vertex_attributes, list(mesh.vertex.values())
        here = slice(first, first + len(rows))
        names = set(default).union(*rows)

        def column(key: str, rows: list[Any] = rows, default: Any = default) -> list[Any]:
            return [row.get(key, default.get(key)) for row in rows]

        try:
            X[here] = np.array([column(axis) for axis in "xyz"], dtype=np.float64).T
        except (TypeError, ValueError):
            _refuse("vertices", name, "a coordinate is no number; set x, y and z of each vertex")
        bad = np.flatnonzero(~np.isfinite(X[here]).all(axis=1))
        if len(bad):
            key = list(mesh.vertex)[bad[0]]
            _refuse("vertices", name, f"vertex {key} is at {X[here][bad[0]].tolist()}, which is not finite")
        for key in filter(names.__contains__, (SLIDES, *HELD)):
            marks = np.array([bool(value) for value in column(key)], dtype=bool)
            support[here][marks] = SLIDING if key == SLIDES else FIXED
            marked = True
        if GUIDE in names:
            numbers = column(GUIDE)
            if not all(one is None or (isinstance(one, int) and one >= 0) for one in numbers):
                text = f"the vertex attribute {GUIDE!r} must be the number of a line or circle, or None"
                _refuse(GUIDE, name, text)
            guide[here] = [-1 if one is None else one for one in numbers]
    keys = np.array(list(chain.from_iterable(mesh.vertex for mesh in named.values())), dtype=np.int64)
    return Vertices(X, keys, start, support if marked else None, guide)


def shared_vertices(vertices: Vertices, names: Sequence[str], weld: bool) -> tuple[Ints, Ints]:
    """Which vertices to keep, and the index among them of every vertex.

    Vertices of one key are one, and must lie at one place; with ``weld``, vertices at one place are one.
    """
    if weld:
        return coincident(vertices.X)
    _, keep, place = np.unique(vertices.keys, return_index=True, return_inverse=True)
    apart = np.flatnonzero((vertices.X[keep][place] != vertices.X).any(axis=1))
    if len(apart):
        one, two = int(keep[place[apart[0]]]), int(apart[0])
        owner = np.searchsorted(vertices.start, [one, two], side="right") - 1
        name = names[owner[1]]
        text = (
            f"vertex {vertices.keys[two]} is at {vertices.X[one].tolist()} in mesh {names[owner[0]]!r} and at"
            f" {vertices.X[two].tolist()} in mesh {name!r}: the meshes do not share their keys; give the same"
            " key to a common vertex only, or pass weld=True"
        )
        raise SurfaceError(text, what="vertices", where=name, found=int(vertices.keys[two]))
    return keep, place


def read_faces(
    named: Mapping[str, Any], vertices: Vertices, place: Ints
) -> tuple[Ints, Ints, tuple[str, ...]]:
    """Triangles (m,3) of the kept vertices, the mesh of each, and a note if polygons were cut.

    They are in the order of the faces' keys; if two meshes use a key, mesh by mesh.
    """
    keys: list[int] = list(chain.from_iterable(mesh.face for mesh in named.values()))
    polygons: list[Any] = list(chain.from_iterable(mesh.face.values() for mesh in named.values()))
    if not polygons:
        validate.refuse("meshes", list(named), "meshes with faces", error=SurfaceError)
    mesh = np.repeat(np.arange(len(named)), [len(one.face) for one in named.values()])
    counts = np.array([len(polygon) for polygon in polygons])
    corners = np.array(list(chain.from_iterable(polygons)), dtype=np.int64)
    owner = np.repeat(mesh, counts)
    index = np.empty(len(corners), dtype=np.int64)
    for number, name in enumerate(named):
        mine, here = owner == number, slice(*vertices.start[number : number + 2])
        order = np.argsort(vertices.keys[here])
        sorted_keys = vertices.keys[here][order]
        at = np.minimum(np.searchsorted(sorted_keys, corners[mine]), len(sorted_keys) - 1)
        lost = np.flatnonzero(sorted_keys[at] != corners[mine]) if len(sorted_keys) else np.arange(mine.sum())
        if len(lost):
            _refuse("faces", name, f"a face names vertex {corners[mine][lost[0]]}, which it does not have")
        index[mine] = place[vertices.start[number] + order[at]]
    if len(set(keys)) == len(keys):
        order = np.argsort(keys)
        begin = np.cumsum(counts) - counts
        index = np.concatenate([index[begin[k] : begin[k] + counts[k]] for k in order])
        counts, mesh = counts[order], mesh[order]
    X = np.empty((place.max() + 1, 3))
    X[place] = vertices.X
    try:
        F, polygon, notes = triangulate(X, index, counts)
    except FileError as error:
        name = list(named)[mesh[error.where]] if isinstance(error.where, int) else None
        raise SurfaceError(f"mesh {name!r}: {error}", what="faces", where=name, found=error.found) from None
    return F, mesh[polygon], notes


def read_whole(named: Mapping[str, Any]) -> tuple[Plane, list[Guide]]:
    """The plane Π, and the lines and circles, of the one mesh that has them; without it z = 0 and none."""
    owners = [name for name, mesh in named.items() if KEY in mesh.attributes]
    if not owners:
        return Plane(), []
    name = owners[0]
    if len(owners) > 1 and any(named[one].attributes[KEY] != named[name].attributes[KEY] for one in owners):
        _refuse(KEY, owners[1], f"it is of another surface than mesh {name!r}: attributes[{KEY!r}] differ")
    try:
        values = named[name].attributes[KEY]
        plane = Plane(tuple(values["plane"]["point"]), tuple(values["plane"]["normal"]))
        guides = [_guide(*one) for one in values["guides"]]
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:120]
        _refuse(KEY, name, f"attributes[{KEY!r}] is damaged ({reason}); without it Π is z = 0")
    return plane, guides


def _guide(kind: str, *values: Any) -> Guide:
    """The line or circle of its values."""
    return GUIDES[kind](*(tuple(one) if isinstance(one, Sequence) else one for one in values))


def _refuse(what: str, name: str, problem: str) -> NoReturn:
    """Raise the error about a mesh."""
    raise SurfaceError(f"mesh {name!r}: {problem}", what=what, where=name)
