"""The meshes themselves as arrays: vertices, faces and cables. Every error names the mesh."""

from __future__ import annotations

import math
import re
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
from ..surface import Cable, Patch

HELD = ("is_support", "is_anchor", "is_fixed")  # names that COMPAS packages use for a held vertex
SLIDES, GUIDE, PLANES = "is_sliding", "guide", "planes"  # further attributes of vertices
CABLE, TENSION = "cable", "tension"  # attributes of edges

Places = Mapping[str, Mapping[int, int]]  # by mesh name and key, the index of the vertex


def mesh_class() -> Any:
    """``compas.datastructures.Mesh``, or MissingExtra."""
    try:
        from compas.datastructures import Mesh
    except ImportError:
        raise MissingExtra("compas", "compas") from None
    return Mesh


def named_meshes(meshes: Any) -> dict[str, Any]:
    """The meshes by name, which no two share."""
    kind = mesh_class()
    listed = [meshes] if isinstance(meshes, kind) else meshes
    if not isinstance(listed, Sequence) or not listed or not all(isinstance(mesh, kind) for mesh in listed):
        validate.refuse("meshes", meshes, "a COMPAS Mesh or a list of them", error=SurfaceError)
    named: dict[str, Any] = {}
    for number, mesh in enumerate(listed):
        if not isinstance(mesh.name, str):
            validate.refuse(f"meshes[{number}].name", mesh.name, "a text", error=SurfaceError)
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
            refuse(key, name, f"it has no {key}; set mesh.attributes[{key!r}], or pass {key}s=")
        patches.append(Patch(name, **values))
    return patches


@dataclass(frozen=True, eq=False)
class Vertices:
    """The vertices of all meshes that faces use, one mesh after the other.

    Attributes
    ----------
    X : (v,3) coordinates.
    keys : (v,) their keys.
    start : (k+1,) where each mesh begins.
    support : (v,) FREE, SLIDING or FIXED; None if no mesh has an attribute for it.
    guide : (v,) number of the line or circle along which the vertex slides, or -1.
    planes : (v,) the numbers of the planes besides Π that the vertex slides on.
    unused : how many more vertices there are.
    """

    X: Floats
    keys: Ints
    start: Ints
    support: Ints | None
    guide: Ints
    planes: list[Sequence[int]]
    unused: int


def read_vertices(named: Mapping[str, Any]) -> Vertices:
    """The vertices of all meshes."""
    keys: list[int] = []
    rows: list[tuple[list[float], int, int, Sequence[int]]] = []
    start, unused, marked = [0], 0, False
    for name, mesh in named.items():
        used = set(chain.from_iterable(mesh.face.values()))
        lost = used - set(mesh.vertex)
        if lost:
            refuse("faces", name, f"a face names vertex {min(lost)}, which the mesh does not have")
        mine = [key for key in mesh.vertex if key in used]
        unused += len(mesh.vertex) - len(mine)
        for key in mine:
            row = mesh.default_vertex_attributes | mesh.vertex[key]
            held = any(row.get(mark) for mark in HELD)
            support = FIXED if held else SLIDING if row.get(SLIDES) else FREE
            guide, planes = row.get(GUIDE), row.get(PLANES) or ()
            if not (guide is None or _is_index(guide)):
                refuse(GUIDE, name, f"vertex {key}: {GUIDE!r} must be the number of a line or circle")
            if not (isinstance(planes, Sequence) and all(map(_is_index, planes))):
                refuse(PLANES, name, f"vertex {key}: {PLANES!r} must be a list of numbers of planes")
            rows.append((_position(row, name, key), support, -1 if guide is None else guide, planes))
            marked |= any(mark in row for mark in (SLIDES, *HELD))
        keys += mine
        start.append(len(keys))
    if not keys:
        validate.refuse("meshes", list(named), "meshes with faces", error=SurfaceError)
    X, supports, guides, planes_of = zip(*rows, strict=True)
    held_by = np.array(supports) if marked else None
    return Vertices(
        np.array(X), np.array(keys), np.array(start), held_by, np.array(guides), list(planes_of), unused
    )


def shared_vertices(vertices: Vertices, named: Mapping[str, Any], weld: bool) -> tuple[Ints, Places]:
    """Which vertices to keep, and the index among them of every key of each mesh.

    Vertices of one key are one, and must lie at one place; with ``weld``, vertices at one place are one.
    """
    names, X, start = list(named), vertices.X, vertices.start
    if weld:
        keep, place = coincident(X)
    else:
        _, keep, place = np.unique(vertices.keys, return_index=True, return_inverse=True)
        apart = np.flatnonzero((X[keep][place] != X).any(axis=1))
        if len(apart):
            one, two = int(keep[place[apart[0]]]), int(apart[0])
            owner, other = (names[k] for k in np.searchsorted(start, [one, two], side="right") - 1)
            text = f"vertex {vertices.keys[two]} is at {X[two].tolist()}, and in mesh {owner!r} at"
            text = f"{text} {X[one].tolist()}; give a key to a common vertex only, or pass weld=True"
            refuse("vertices", other, text)
    pairs = list(zip(vertices.keys.tolist(), place.tolist(), strict=True))
    return keep, {name: dict(pairs[start[k] : start[k + 1]]) for k, name in enumerate(names)}


def read_faces(named: Mapping[str, Any], X: Floats, places: Places) -> tuple[Ints, Ints, tuple[str, ...]]:
    """Triangles (m,3) of the vertices X (n,3), the mesh of each, and a note if polygons were cut.

    They are in the order of the faces' keys; if two meshes use a key, mesh by mesh.
    """
    faces = [
        (key, number, [places[name][v] for v in face])
        for number, (name, mesh) in enumerate(named.items())
        for key, face in mesh.face.items()
    ]
    if len({key for key, _, _ in faces}) == len(faces):
        faces.sort(key=lambda face: face[0])
    mesh_of_face = np.array([number for _, number, _ in faces])
    corners = np.array(list(chain.from_iterable(face for _, _, face in faces)), dtype=np.int64)
    try:
        F, source, notes = triangulate(X, corners, np.array([len(face) for _, _, face in faces]))
    except FileError as error:
        at = int(str(error.where))
        text = str(error).replace(f"face {at}", f"face {faces[at][0]}", 1)
        refuse("faces", list(named)[mesh_of_face[at]], text)
    return F, mesh_of_face[source], notes


def read_cables(named: Mapping[str, Any], places: Places, names: Sequence[str]) -> tuple[Cable, ...]:
    """A cable for each value of the edges' attribute ``cable``; their attribute ``tension`` is its force.

    ``names`` lists cables that come first.
    """
    edges: dict[str, set[tuple[int, int]]] = {name: set() for name in names}
    tensions: dict[str, float] = {}
    for name, mesh in named.items():
        for ends, values in mesh.edgedata.items():
            cable, tension = values.get(CABLE), values.get(TENSION)
            if cable is None:
                continue
            if not isinstance(cable, str):
                refuse(CABLE, name, f"edge {ends}: {CABLE!r} must be a name, found {validate.shown(cable)}")
            one, two = sorted(places[name].get(int(key), -1) for key in re.findall(r"\d+", ends))
            if one < 0:
                refuse(CABLE, name, f"the cable {cable!r} has the edge {ends}, which the mesh does not have")
            if tension is None or tensions.setdefault(cable, tension) != tension:
                text = f"the edges of the cable {cable!r} need one and the same edge attribute {TENSION!r}"
                refuse(CABLE, name, f"{text}; that of edge {ends} is {tension}")
            edges.setdefault(cable, set()).add((one, two))
    return tuple(Cable(name, tensions[name], np.array(sorted(ends))) for name, ends in edges.items() if ends)


def refuse(what: str, name: str, problem: str) -> NoReturn:
    """Raise the error about a mesh."""
    raise SurfaceError(f"mesh {name!r}: {problem}", what=what, where=name)


def damaged_mesh(error: Exception) -> SurfaceError:
    """The error for a mesh that is wrong in a way that none checks."""
    reason = " ".join(f"{type(error).__name__}: {error}".split())[:120]
    return SurfaceError(f"meshes: one is damaged ({reason}); check it with mesh.is_valid()", what="meshes")


def _is_index(value: Any) -> bool:
    """Whether it is a whole number ≥ 0."""
    return isinstance(value, int | np.integer) and int(value) >= 0


def _position(row: Mapping[str, Any], name: str, key: int) -> list[float]:
    """The coordinates in the attributes of a vertex."""
    point = [row.get(axis) for axis in "xyz"]
    if not all(isinstance(x, int | float | np.number) and math.isfinite(x) for x in point):
        refuse("vertices", name, f"vertex {key} is at {point}; set its x, y and z to finite numbers")
    return [float(x) for x in point if x is not None]
