"""The reader of Surface Evolver datafiles: those that ``evolver`` and the program's ``dump`` write, and
others whose sections list elements by number."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import FileError
from ..base.validate import names_from_file
from ..surface import Cable, Patch, Plane, Room
from .mesh_data import FIXED, FREE, SLIDING, MeshData
from .polygons import cut_polygons
from .text import TextSection, constant, kinds_of, line_ends, linear_expression

WRITTEN = "written by pcmc"
NUMBERED = r"(\d+)((?:[^\S\n]+-?\d+){})([^\n]*)"  # an element, the numbers of its parts, and the rest
ROUNDING = 1e-12  # of the largest pressure: what is left of differences
UNREADABLE = "string|quadratic|lagrange|simplex_representation|torus|torus_filled|symmetry_group"
UNREADABLE += "|#include|#define"


def read(path: Path) -> MeshData:
    """The mesh, tensions, pressures and supports of a datafile; errors name the line."""
    file = _Datafile(path.read_text(encoding="utf-8-sig"))
    if WRITTEN in file.header:
        file["read"]  # its last line: without it the file is cut off
    vertex_ids, X, support, constraints = _vertices(file["vertices"])
    edges, faces, pattern = file["edges"], file["faces"], r"(\d+)[^\S\n]+(\d+)[^\S\n]+(\d+)(?!\S)([^\n]*)"
    *columns, edge_rest = edges.columns(pattern, "an edge number and two vertices")
    edge_ids, *joined = map(edges.integers, columns)
    ends = np.stack([edges.places(vertex_ids, end, "vertex") for end in joined], axis=1)
    face_ids, corners, counts, face_rest = _faces(faces, edge_ids, ends)
    F, source, notes = cut_polygons(X, corners, counts)
    pressure, prescribed, more = _pressures(file, face_ids)
    patch_of_face, patches = _patches(file, face_rest, (pressure, *prescribed.values()))
    plane, planes, origin = _planes(file, constraints, support)
    names, rooms = file.names("room"), []
    for (number, volume), sides in prescribed.items():
        of_patch = np.zeros(len(patches), dtype=np.int64)
        of_patch[patch_of_face] = sides
        signs = tuple((patches[k].name, int(of_patch[k])) for k in np.flatnonzero(of_patch))
        rooms.append(Room(names.get(number, f"body {number}"), signs, volume))
    unset, cables = file.names("bare").values(), _cables(file.names("cable"), edges, ends, edge_rest)
    bare = tuple(p.name for p in patches if p.name in unset and p.tension == p.pressure == 1.0)
    about: dict[str, Any] = {"planes": planes, "rooms": tuple(rooms), "cables": cables, "bare": bare}
    mesh = X + origin, F, patch_of_face[source], patches, support, plane
    return MeshData(*mesh, notes=(*notes, *more), **about)


class _Datafile(dict[str, TextSection]):
    """The sections by name without their comments, and ``header``, what stands before the vertices."""

    def __init__(self, content: str) -> None:
        bare = re.sub(r"/\*.*?(?:\*/|\Z)", lambda m: "\f" * m[0].count("\n") + " ", content, flags=re.S)
        bare = re.sub(r"//[^\n]*", "", bare)
        bare = re.sub(r"\\[^\S\n]*\n", "\f", bare)
        heads = list(re.finditer(r"^[^\S\n]*(vertices|edges|faces|facets|bodies|read)\b", bare, re.I | re.M))
        named = [("top", 0), *((h[1].lower().replace("facets", "faces"), h.end()) for h in heads)]
        known = {"pi": math.pi}
        for (name, start), end in zip(named, [*(h.start() for h in heads), len(bare)], strict=True):
            self.setdefault(name, TextSection(bare[start:end], 1 + line_ends(bare[:start]), known))
            if name == "read":
                break  # what follows are commands
        self.header = re.split(r"^[^\S\n]*vertices\b", content, maxsplit=1, flags=re.I | re.M)[0]
        top = self["top"]
        if foreign := re.search(rf"^[^\S\n]*({UNREADABLE})\b", top.text, re.I | re.M):
            problem = f"{foreign[1].lower()} is not supported; load the file in Surface Evolver and `dump` it"
            raise top.error(f"{problem}; read the dump", offset=foreign.start())
        for hit in re.finditer(r"^[^\S\n]*parameter\s+(\w+)\s*=\s*([^\n]+)", top.text, re.I | re.M):
            known[hit[1].lower()] = constant(hit[2], known, partial(top.error, offset=hit.start()))

    def __missing__(self, name: str) -> TextSection:
        known = ", ".join(k for k in self if k != "top") or "none"
        problem = f"no {name} section (found: {known}); the file is cut off or no Surface Evolver datafile"
        raise FileError(problem, where=name)

    def names(self, kind: str) -> dict[str, str]:
        """The names that comments give to patches, rooms or cables, by number."""
        rows = re.findall(rf"^// {kind} (\d+) ([^\n]+)$", self.header, re.M)
        names, ours = names_from_file(name for _, name in rows)[0], WRITTEN in self.header
        return {number: unquote(names[name]) if ours else names[name] for number, name in rows}


def _vertices(section: TextSection) -> tuple[Ints, Floats, Ints, dict[int, Bools]]:
    """Ids, positions, support, and by the number of each constraint the vertices that lie on it."""
    pattern = r"(\d+)[^\S\n]+(\S+)[^\S\n]+(\S+)[^\S\n]+(\S+)([^\n]*)"
    ids, *coordinates, rest = section.columns(pattern, "a vertex number and three coordinates")
    X = np.stack([section.numbers(column) for column in coordinates], axis=1)
    code, kinds, first = kinds_of(rest)
    support = np.zeros(len(kinds), dtype=np.int8)
    constraints: dict[int, Bools] = {}
    for k, words in enumerate(kinds):
        row = int(first[k])
        if re.search(r"\bboundary\b", words, re.I):
            raise section.error("a vertex on a parametric boundary is not supported", row)
        named = re.search(r"\bconstraints?((?:\s+\d+)+)", words, re.I)
        numbers = section.integers(named[1].split(), row).tolist() if named else []
        support[k] = FIXED if re.search(r"\bfixed\b", words, re.I) else SLIDING if numbers else FREE
        for number in numbers:
            constraints.setdefault(number, np.zeros(len(kinds), dtype=bool))[k] = True
    of_vertex = {number: mask[code] for number, mask in sorted(constraints.items())}
    return section.integers(ids), X, support[code], of_vertex


def _faces(section: TextSection, edge_ids: Ints, ends: Ints) -> tuple[Ints, Ints, Ints, Sequence[str]]:
    """Ids, vertices of face after face, corners of each face, and what follows the edges on its line."""
    numbers, edges, rest = section.columns(NUMBERED.format("+"), "a face number and its edges")
    counts = np.array([len(listed.split()) for listed in edges], dtype=np.int64)
    row = np.repeat(np.arange(len(counts)), counts)
    signed = section.integers(" ".join(edges).split(), row)
    place = section.places(edge_ids, np.abs(signed), "edge", row)
    tail, head = np.where(signed > 0, ends[place].T, ends[place, ::-1].T)
    last = np.cumsum(counts) - 1
    following = np.arange(1, len(signed) + 1)
    following[last] = last - counts + 1
    open_at = np.flatnonzero(head != tail[following])
    if len(open_at):
        raise section.error("the edges of the face do not follow each other head to tail", row[open_at[0]])
    return section.integers(numbers), tail, counts, rest


def _cables(
    names: Mapping[str, str], section: TextSection, ends: Ints, rest: Sequence[str]
) -> tuple[Cable, ...]:
    """The edges (e,2) with a line tension as cables, those of one number and tension together."""
    tension, _ = section.values(rest, "tension|density")
    number, given = section.values(rest, "cable")
    chosen = np.flatnonzero((tension != 0.0) | (given & np.isin(number, [float(name) for name in names])))
    kinds, kind = np.unique(np.stack([number, tension], axis=1)[chosen], axis=0, return_inverse=True)
    known = names if len(np.unique(kinds[:, 0])) == len(kinds) else {}
    rows = [(known.get(str(int(a)), f"cable {k + 1}"), t, k) for k, (a, t) in enumerate(kinds.tolist())]
    return tuple(Cable(name, t, ends[chosen[kind == k]]) for name, t, k in rows)


def _pressures(
    file: _Datafile, face_ids: Ints
) -> tuple[Floats, dict[tuple[str, float], Ints], tuple[str, ...]]:
    """(m,) pressure along each face's normal: the sum over the bodies on its two sides; and the bodies of
    prescribed volume: by number and volume, (m,) 1 or -1 where a face bounds them."""
    pressure = np.zeros(len(face_ids))
    prescribed: dict[tuple[str, float], Ints] = {}
    if "bodies" not in file:
        return pressure, prescribed, ("the file has no bodies, so no patch is under pressure",)
    section = file["bodies"]
    bodies, faces, rest = section.columns(NUMBERED.format("*"), "a body number and its faces")
    inside, given = section.values(rest, "pressure|lagrange_multiplier", 1.0)
    volume, limited = section.values(rest, "volume")
    of_body = np.repeat(np.arange(len(bodies)), [len(members.split()) for members in faces])
    signed = section.integers(" ".join(faces).split(), of_body)
    place = section.places(face_ids, np.abs(signed), "face", of_body)
    np.add.at(pressure, place, np.sign(signed) * inside[of_body])
    for row in np.flatnonzero(limited):
        sides = np.zeros(len(face_ids), dtype=np.int64)
        np.add.at(sides, place[of_body == row], np.sign(signed[of_body == row]))
        prescribed[bodies[row], float(volume[row])] = sides
    if prescribed:  # the difference of two rooms' pressures is 0 but for rounding
        pressure[np.abs(pressure) <= ROUNDING * np.abs(pressure).max(initial=0.0)] = 0.0
    without = ", ".join(np.array(bodies)[~given])
    note = f"body {without} has no pressure in the file; 1 is used"
    return pressure, prescribed, (note,) if without else ()


def _patches(
    file: _Datafile, rest: Sequence[str], of_face: Sequence[Floats | Ints]
) -> tuple[Ints, tuple[Patch, ...]]:
    """Faces alike in patch number, tension, weight, snow and all (m,) ``of_face`` are a patch."""
    columns = {"patch": 0.0, "tension|density": 1.0, "weight": 0.0, "snow": 0.0}
    given = [file["faces"].values(rest, key, default)[0] for key, default in columns.items()]
    kinds, patch_of_face = np.unique(np.stack([*given, *of_face], axis=1), axis=0, return_inverse=True)
    walls = {float(k) for k in re.findall(r"^// wall (\d+)$", file.header, re.M)}
    known = file.names("patch") if len(np.unique(kinds[:, 0])) == len(kinds) else {}
    patches = [
        Patch(known.get(str(int(a)), f"patch {k}"), t, p + s, a in walls, w, s)
        for k, (a, t, w, s, p, *_) in enumerate(kinds, 1)
    ]
    return patch_of_face.ravel(), tuple(patches)


def _planes(
    file: _Datafile, constraints: Mapping[int, Bools], support: Ints
) -> tuple[Plane | None, tuple[tuple[Plane, Bools], ...], Floats]:
    """Π, the other planes with their vertices, and the file's origin; ``support`` is changed to fit.

    Π is constraint 1, or the first that sliding vertices lie on; those on others alone are free of it.
    """
    given = re.search(r"^// origin (\S+) (\S+) (\S+)$", file.header, re.M)
    header = TextSection(file.header, 1, file["top"].known)
    origin = header.numbers(given.groups(), 0) if given else np.zeros(3)
    used = [number for number, mask in constraints.items() if (mask & (support == SLIDING)).any()]
    rows = re.findall(r"^// plane (\d+) (mirror|support)\b([^\n]*)$", file.header, re.M)
    described = {int(k): (kind, name) for k, kind, name in rows}
    first = 1 if described or 1 in used or not used else used[0]
    ground = _plane(file["top"], first, origin, needed=first in used)
    if first in constraints:
        support[(support == SLIDING) & ~constraints[first]] = FREE
    elif used:
        support[support == SLIDING] = FREE
    others = []
    for number in sorted({*used, *described} & set(constraints) - {first}):
        kind, name = described.get(number, ("support", ""))
        plane: Any = _plane(file["top"], number, origin, needed=True)
        plane = replace(plane, name=unquote(name.strip()), mirror=kind == "mirror")
        others.append((plane, constraints[number]))
    return ground, tuple(others), origin


def _plane(top: TextSection, number: int, origin: Floats, needed: bool) -> Plane | None:
    """The plane of this constraint; None if it is not needed and not there."""
    pattern = rf"^[^\S\n]*constraint\s+{number}\b[^\n]*\s+(?:formula|function)\s*:?\s*([^\n]+)"
    hit = re.search(pattern, top.text, re.I | re.M)
    if hit is None:
        if needed:
            raise top.error(f"constraint {number} has no formula here")
        return None
    left, _, right = hit[1].partition("=")

    def fail(problem: str) -> FileError:
        return top.error(f"constraint {number} is not a plane: {problem}", offset=hit.start(1))

    formula = linear_expression(left, top.known, fail) - linear_expression(right or "0", top.known, fail)
    normal = formula[1:]
    if not normal.any():
        raise fail(f"{hit[1].strip()!r} names no coordinate")
    return Plane(tuple(origin - formula[0] * normal / (normal @ normal)), tuple(normal))
