"""Vertices, faces, cables and common values from COMPAS meshes. Every error names the mesh."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from itertools import chain
from typing import Any, NamedTuple, NoReturn

import numpy as np

from ..base import validate
from ..base.arrays import Floats, Ints
from ..base.errors import FileError, SurfaceError
from ..base.libraries import require
from ..io.mesh_data import FIXED, FREE, SLIDING, coincident, given_values
from ..io.polygons import cut_polygons
from ..surface import Cable, Circle, Guide, HeldCurve, Line, Patch, Plane, Room

HELD = ("is_support", "is_anchor", "is_fixed")  # names that COMPAS packages use for a held vertex
SLIDES, GUIDE, PLANES = "is_sliding", "guide", "planes"  # further attributes of vertices
CABLE, TENSION = "cable", "tension"  # attributes of edges
KEY = "pcmc"  # attribute of the first mesh

Places = Mapping[str, Mapping[int, int]]  # by mesh name and key, the index of the vertex


def mesh_class() -> Any:
    """``compas.datastructures.Mesh``, or MissingExtra."""
    require("compas", extra="compas")
    from compas.datastructures import Mesh

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
    given, patches = given_values("mesh", named, tension=tensions, pressure=pressures), []
    known = {f.name: f.default for f in fields(Patch) if f.name != "name"}
    for name, mesh in named.items():
        values = {key: mesh.attributes[key] for key in known if key in mesh.attributes} | given[name]
        for key, default in known.items():
            if default is MISSING and key not in values:
                _refuse(key, name, f"it has no {key}; set mesh.attributes[{key!r}], or pass {key}s=")
        patches.append(Patch(name, **values))
    return patches


class WholeMesh(NamedTuple):
    """What belongs to the whole surface and not to a mesh: the first mesh's attribute ``pcmc``."""

    plane: Plane = Plane()
    guides: tuple[Guide, ...] = ()  # the lines and circles that vertices slide along
    planes: tuple[Plane, ...] = ()  # besides Π, that vertices slide on
    rooms: tuple[Room, ...] = ()
    cables: tuple[str, ...] = ()  # their names in order
    curves: tuple[HeldCurve, ...] = ()  # that held vertices were drawn on, by their keys


def read_whole(named: Mapping[str, Any]) -> WholeMesh:
    """That of the one mesh that has it; without it Π is z = 0, and there is nothing else."""
    owners = [name for name, mesh in named.items() if KEY in mesh.attributes]
    if not owners:
        return WholeMesh()
    values = named[owners[0]].attributes[KEY]
    for other in owners[1:]:
        if named[other].attributes[KEY] != values:
            text = f"attributes[{KEY!r}] differs from that of mesh {owners[0]!r}; keep one of the two"
            _refuse(KEY, other, text)

    def made(kind: Any, row: Mapping[str, Any]) -> Any:
        """A part of a surface, with tuples for lists."""
        vectors = {key: tuple(one) for key, one in row.items() if isinstance(one, list | tuple)}
        return kind(**{**row, **vectors})

    try:
        return WholeMesh(
            made(Plane, values["plane"]),
            tuple(made(Circle if "radius" in one else Line, one) for one in values.get("guides", ())),
            tuple(made(Plane, one) for one in values.get("planes", ())),
            tuple(Room(**one) for one in values.get("rooms", ())),
            tuple(str(one) for one in values.get("cables", ())),
            tuple(map(HeldCurve.from_plain, values.get("curves", ()))),
        )
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        _refuse(KEY, owners[0], f"attributes[{KEY!r}] is damaged ({_reason(error)}); without it Π is z = 0")


class Vertex(NamedTuple):
    mesh: str
    key: int
    point: list[float]
    support: int  # FREE, SLIDING or FIXED
    guide: int  # number of the line or circle along which it slides, or -1
    planes: Sequence[int]  # numbers of the planes besides Π that it slides on


def read_vertices(named: Mapping[str, Any], whole: WholeMesh) -> tuple[list[Vertex], bool, int]:
    """The vertices of all meshes, one mesh after the other; whether any has an attribute for its support.

    And how many more vertices there are, which no face uses.
    """
    vertices: list[Vertex] = []
    unused, marked = 0, False
    for name, mesh in named.items():
        used = set(chain.from_iterable(mesh.face.values()))
        if lost := used - set(mesh.vertex):
            _refuse("faces", name, f"a face names vertex {min(lost)}, which the mesh does not have")
        unused += len(mesh.vertex) - len(used)
        for key in (key for key in mesh.vertex if key in used):
            row = mesh.default_vertex_attributes | mesh.vertex[key]
            support = FIXED if any(map(row.get, HELD)) else SLIDING if row.get(SLIDES) else FREE
            marked |= any(mark in row for mark in (SLIDES, *HELD))
            guide, planes = row.get(GUIDE), row.get(PLANES) or ()
            if not (guide is None or _is_index(guide)):
                _refuse(GUIDE, name, f"vertex {key}: {GUIDE!r} must be the number of a line or circle")
            if not (isinstance(planes, Sequence) and all(map(_is_index, planes))):
                _refuse(PLANES, name, f"vertex {key}: {PLANES!r} must be a list of numbers of planes")
            given = [row.get(axis) for axis in "xyz"]
            point = [validate.real(x) for x in given]
            if not all(map(math.isfinite, point)):
                at = validate.shown(given)
                _refuse("vertices", name, f"vertex {key} is at {at}; set its x, y and z to finite numbers")
            vertices.append(Vertex(name, key, point, support, -1 if guide is None else guide, planes))
    if not vertices:
        validate.refuse("meshes", list(named), "meshes with faces", error=SurfaceError)
    for what, listed, numbers in (
        (GUIDE, len(whole.guides), [vertex.guide for vertex in vertices]),
        (PLANES, len(whole.planes), [number for vertex in vertices for number in vertex.planes]),
    ):
        if (largest := max(numbers, default=-1)) >= listed:
            text = f"a vertex has {what!r} {largest}, but attributes[{KEY!r}] lists only {listed} of them;"
            text = f"{text} keep the mesh that has this attribute, or remove {what!r} from the vertices"
            raise SurfaceError(text, what=what, found=largest, expected=listed)
    return vertices, marked, unused


def shared_vertices(vertices: Sequence[Vertex], weld: bool) -> tuple[Ints, Ints]:
    """Which vertices to keep, and the index among them of every vertex: those of one key are one, and must
    lie at one place; with ``weld``, those at one place are one."""
    X = np.array([vertex.point for vertex in vertices])
    if weld:
        return coincident(X)
    keys = np.array([vertex.key for vertex in vertices])
    _, keep, place = np.unique(keys, return_index=True, return_inverse=True)
    apart = np.flatnonzero((X[keep][place] != X).any(axis=1))
    if len(apart):
        one, two = vertices[keep[place[apart[0]]]], vertices[apart[0]]
        text = f"vertex {two.key} is at {two.point}, and in mesh {one.mesh!r} at {one.point};"
        _refuse("vertices", two.mesh, f"{text} give a key to a common vertex only, or pass weld=True")
    return keep, place


def read_faces(named: Mapping[str, Any], X: Floats, places: Places) -> tuple[Ints, Ints, tuple[str, ...]]:
    """Triangles (m,3) of the vertices X (n,3), the mesh of each, and a note if polygons were cut.

    They are in the order of the faces' keys; if two meshes use a key, mesh by mesh.
    """
    faces = []
    for number, (name, mesh) in enumerate(named.items()):
        faces += [(key, number, [places[name][v] for v in face]) for key, face in mesh.face.items()]
    if len({key for key, _, _ in faces}) == len(faces):
        faces.sort(key=lambda face: face[0])
    keys, mesh_of_face, loops = zip(*faces, strict=True)
    corners = np.array(list(chain.from_iterable(loops)), dtype=np.int64)
    try:
        F, source, notes = cut_polygons(X, corners, np.array([len(loop) for loop in loops]))
    except FileError as error:
        at = int(str(error.where))
        text = str(error).replace(f"face {at}", f"face {keys[at]}", 1)
        _refuse("faces", list(named)[mesh_of_face[at]], text)
    return F, np.array(mesh_of_face)[source], notes


def read_cables(named: Mapping[str, Any], places: Places, names: Sequence[str]) -> tuple[Cable, ...]:
    """A cable for each value of the edges' attribute ``cable``, those in ``names`` first; their attribute
    ``tension`` is its force."""
    edges: dict[str, set[tuple[int, int]]] = {name: set() for name in names}
    tensions: dict[str, float] = {}
    for name, mesh in named.items():
        for ends, values in mesh.edgedata.items():
            cable, tension = values.get(CABLE), values.get(TENSION)
            if cable is None:
                continue
            if not isinstance(cable, str):
                _refuse(CABLE, name, f"edge {ends}: {CABLE!r} must be a name, found {validate.shown(cable)}")
            one, two = sorted(places[name].get(int(key), -1) for key in re.findall(r"\d+", ends))
            if one < 0:
                _refuse(CABLE, name, f"the cable {cable!r} has the edge {ends}, which the mesh does not have")
            if tension is None or tensions.setdefault(cable, tension) != tension:
                text = f"the edges of the cable {cable!r} need one and the same edge attribute {TENSION!r}"
                _refuse(CABLE, name, f"{text}; that of edge {ends} is {tension}")
            edges.setdefault(cable, set()).add((one, two))
    return tuple(Cable(name, tensions[name], np.array(sorted(ends))) for name, ends in edges.items() if ends)


def _refuse(what: str, name: str, problem: str) -> NoReturn:
    raise SurfaceError(f"mesh {name!r}: {problem}", what=what, where=name)


def damaged_mesh(error: Exception) -> SurfaceError:
    """The error for a mesh that is wrong in a way that none checks."""
    text = f"meshes: one is damaged ({_reason(error)}); check it with mesh.is_valid()"
    return SurfaceError(text, what="meshes")


def _reason(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())[:120]


def _is_index(value: Any) -> bool:
    return isinstance(value, int | np.integer) and int(value) >= 0
