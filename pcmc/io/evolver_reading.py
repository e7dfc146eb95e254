"""The reader of Surface Evolver datafiles: those that ``evolver`` and the program's ``dump`` write, and
others whose sections list elements by number.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pandas as pd

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import FileError
from ..base.validate import names_from_file
from ..surface import Cable, Patch, Plane, Room
from . import text
from .mesh_data import FIXED, FREE, SLIDING, MeshData
from .polygons import triangulate

WRITTEN = "written by pcmc"
ROUNDING = 1e-12  # of the largest pressure: what is left of differences
UNREADABLE = (
    "string|quadratic|lagrange|simplex_representation|torus|torus_filled|symmetry_group|#include|#define"
)


def read(path: Path) -> MeshData:
    """The mesh, tensions, pressures and supports of a datafile; errors name the line."""
    file = _Datafile(path.read_text(encoding="utf-8-sig"))
    if WRITTEN in file.header:
        file["read"]  # its last line: without it the file is cut off
    vertex_ids, X, support, constraints = _vertices(file["vertices"])
    edges, faces = file["edges"], file["faces"]
    edge_ids, ends, edge_rest = _edges(edges, vertex_ids)
    face_ids, corners, counts, face_rest = _faces(faces, edge_ids, ends)
    F, source, notes = triangulate(X, corners, counts)
    pressure, prescribed, more = _pressures(file, face_ids)
    patch_of_face, patches = _patches(file, face_rest, (pressure, *prescribed.values()))
    plane, planes, origin = _planes(file, constraints, support)
    names, rooms = file.names("room"), []
    for (number, volume), sides in prescribed.items():
        of_patch = np.zeros(len(patches), dtype=np.int64)
        of_patch[patch_of_face] = sides
        signs = tuple((patches[k].name, int(of_patch[k])) for k in np.flatnonzero(of_patch))
        rooms.append(Room(names.get(number, f"body {number}"), signs, volume))
    unset = file.names("bare").values()
    return MeshData(
        X + origin,
        F,
        patch_of_face[source],
        patches,
        support,
        plane,
        notes=(*notes, *more),
        planes=planes,
        rooms=tuple(rooms),
        cables=_cables(file.names("cable"), edges, ends, edge_rest),
        bare=tuple(p.name for p in patches if p.name in unset and p.tension == p.pressure == 1.0),
    )


@dataclass(frozen=True)
class _Section:
    """A part of the file. A form feed stands for a line end that does not end an element."""

    text: str
    first_line: int
    known: dict[str, float]  # the file's parameters by name

    def error(self, problem: str, row: int | None = None, offset: int = 0) -> FileError:
        """An error at the given element (counting from 0), or at an offset into the text."""
        if row is not None:
            starts = [m.start() for m in re.finditer(r"^[^\S\n]*\S", self.text, re.M)]
            offset = starts[min(row, len(starts) - 1)]
        line = self.first_line + _line_ends(self.text[:offset])
        return FileError(f"line {line}: {problem}", where=line)

    def columns(self, pattern: str, what: str) -> list[tuple[str, ...]]:
        """For each group of the pattern its texts on all lines that are not blank."""
        matches = re.findall(rf"^[^\S\n]*{pattern}$", self.text, re.M)
        lines = re.findall(r"^[^\S\n]*\S[^\n]*$", self.text, re.M)
        one = re.compile(rf"[^\S\n]*{pattern}")
        if len(matches) != len(lines):
            row = next(k for k, line in enumerate(lines) if not one.fullmatch(line))
            raise self.error(f"expected {what}, found {' '.join(lines[row].split())[:60]!r}", row)
        return list(zip(*matches, strict=True)) or [()] * one.groups

    def integers(self, words: Sequence[str], row: int | Ints | None = None) -> Ints:
        """Integers from words of the given rows, by default one of each row."""
        try:
            return np.array(words, dtype=np.int64)
        except (OverflowError, ValueError):
            bad = next((k for k, word in enumerate(words) if len(word.lstrip("-0")) > 18), 0)
            at = bad if row is None else int(np.broadcast_to(row, len(words))[bad])
            problem = f"expected whole numbers below 2^63, found {words[bad][:40]!r}"
            raise self.error(problem, at) from None

    def numbers(self, words: Sequence[str], row: int | None = None) -> Floats:
        """Floats from words of the given row, by default one of each row: numbers, or expressions."""
        try:
            return text.numbers(words)
        except ValueError:
            rows = range(len(words)) if row is None else [row]
            fails = (partial(self.error, row=k) for k in rows)
            values = [text.constant(w, self.known, fail) for w, fail in zip(words, fails, strict=True)]
            return np.array(values)

    def values(self, rest: Sequence[str], key: str, default: float = 0.0) -> tuple[Floats, Bools]:
        """(k,) the number after a key in what follows each element, and where there is one."""
        pattern = re.compile(rf"\b(?:{key})\s+\{{?([^\s{{}}]+)", re.I)
        if not pattern.search("\n".join(set(rest))):
            return np.full(len(rest), default), np.zeros(len(rest), dtype=bool)
        code, kinds, first = _kinds(rest)
        value, given = np.full(len(kinds), default), np.zeros(len(kinds), dtype=bool)
        for k, words in enumerate(kinds):
            if hit := pattern.search(words):
                value[k], given[k] = self.numbers((hit[1],), int(first[k]))[0], True
        return value[code], given[code]

    def places(self, ids: Ints, wanted: Ints, what: str, row: Ints | None = None) -> Ints:
        """Where each wanted id stands among the ids."""
        order = np.argsort(ids, kind="stable")
        place = order[np.minimum(np.searchsorted(ids, wanted, sorter=order), len(ids) - 1)]
        bad = np.flatnonzero(ids[place] != wanted)
        if len(bad):
            raise self.error(
                f"there is no {what} {wanted[bad[0]]}", int(bad[0] if row is None else row[bad[0]])
            )
        return place


class _Datafile(dict[str, _Section]):
    """The sections by name without their comments, and ``header``, what stands before the vertices."""

    def __init__(self, content: str) -> None:
        bare = re.sub(r"/\*.*?(?:\*/|\Z)", lambda m: "\f" * m[0].count("\n") + " ", content, flags=re.S)
        bare = re.sub(r"//[^\n]*", "", bare)
        bare = re.sub(r"\\[^\S\n]*\n", "\f", bare)
        heads = list(re.finditer(r"^[^\S\n]*(vertices|edges|faces|facets|bodies|read)\b", bare, re.I | re.M))
        starts = [0, *(h.end() for h in heads)]
        ends = [*(h.start() for h in heads), len(bare)]
        names = ["top", *(h[1].lower().replace("facets", "faces") for h in heads)]
        known = {"pi": math.pi}
        for name, start, end in zip(names, starts, ends, strict=True):
            self.setdefault(name, _Section(bare[start:end], 1 + _line_ends(bare[:start]), known))
            if name == "read":
                break  # what follows are commands
        self.header = re.split(r"^[^\S\n]*vertices\b", content, maxsplit=1, flags=re.I | re.M)[0]
        top = self["top"]
        if foreign := re.search(rf"^[^\S\n]*({UNREADABLE})\b", top.text, re.I | re.M):
            problem = f"{foreign[1].lower()} is not supported; load the file in Surface Evolver and `dump` it"
            raise top.error(f"{problem}; read the dump", offset=foreign.start())
        for hit in re.finditer(r"^[^\S\n]*parameter\s+(\w+)\s*=\s*([^\n]+)", top.text, re.I | re.M):
            known[hit[1].lower()] = text.constant(hit[2], known, partial(top.error, offset=hit.start()))

    def __missing__(self, name: str) -> _Section:
        known = ", ".join(k for k in self if k != "top") or "none"
        problem = f"no {name} section (found: {known}); the file is cut off or no Surface Evolver datafile"
        raise FileError(problem, where=name)

    def names(self, kind: str) -> dict[str, str]:
        """The names that comments give to patches, rooms or cables, by number."""
        rows = re.findall(rf"^// {kind} (\d+) ([^\n]+)$", self.header, re.M)
        names = names_from_file(name for _, name in rows)[0]
        shown = unquote if WRITTEN in self.header else str
        return {number: shown(names[name]) for number, name in rows}


def _line_ends(content: str) -> int:
    return content.count("\n") + content.count("\f")


def _kinds(rest: Sequence[str]) -> tuple[Ints, Any, Ints]:
    """The number of each text, the different texts, and where each is first."""
    code, kinds = pd.factorize(np.array(rest, dtype=object))
    return code, kinds, np.unique(code, return_index=True)[1]


def _vertices(section: _Section) -> tuple[Ints, Floats, Ints, dict[int, Bools]]:
    """Ids, positions, support, and by the number of each constraint the vertices that lie on it."""
    pattern = r"(\d+)[^\S\n]+(\S+)[^\S\n]+(\S+)[^\S\n]+(\S+)([^\n]*)"
    ids, *coordinates, rest = section.columns(pattern, "a vertex number and three coordinates")
    X = np.stack([section.numbers(column) for column in coordinates], axis=1)
    code, kinds, first = _kinds(rest)
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


def _edges(section: _Section, vertex_ids: Ints) -> tuple[Ints, Ints, Sequence[str]]:
    """Ids, vertices (e,2), and what follows them on the line of each edge."""
    pattern = r"(\d+)[^\S\n]+(\d+)[^\S\n]+(\d+)(?!\S)([^\n]*)"
    *columns, rest = section.columns(pattern, "an edge number and two vertices")
    ids, *ends = map(section.integers, columns)
    return ids, np.stack([section.places(vertex_ids, end, "vertex") for end in ends], axis=1), rest


def _faces(section: _Section, edge_ids: Ints, ends: Ints) -> tuple[Ints, Ints, Ints, Sequence[str]]:
    """Ids, vertices of face after face, corners of each face, and what follows the edges on its line."""
    pattern, what = r"(\d+)((?:[^\S\n]+-?\d+)+)([^\n]*)", "a face number and its edges"
    numbers, edges, rest = section.columns(pattern, what)
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
    names: Mapping[str, str], section: _Section, ends: Ints, rest: Sequence[str]
) -> tuple[Cable, ...]:
    """The edges (e,2) with a line tension as cables, those of one number and tension together."""
    tension, _ = section.values(rest, "tension|density")
    number, given = section.values(rest, "cable")
    chosen = np.flatnonzero((tension != 0.0) | (given & np.isin(number, [float(name) for name in names])))
    kinds, kind = np.unique(np.stack([number, tension], axis=1)[chosen], axis=0, return_inverse=True)
    known = names if len(np.unique(kinds[:, 0])) == len(kinds) else {}
    return tuple(
        Cable(known.get(str(int(a)), f"cable {k}"), t, ends[chosen[kind == k - 1]])
        for k, (a, t) in enumerate(kinds.tolist(), 1)
    )


def _pressures(
    file: _Datafile, face_ids: Ints
) -> tuple[Floats, dict[tuple[str, float], Ints], tuple[str, ...]]:
    """(m,) pressure along each face's normal: the sum over the bodies on its two sides; and the bodies of
    prescribed volume: by number and volume, (m,) 1 or -1 where a face bounds them.
    """
    pressure = np.zeros(len(face_ids))
    prescribed: dict[tuple[str, float], Ints] = {}
    if "bodies" not in file:
        return pressure, prescribed, ("the file has no bodies, so no patch is under pressure",)
    section = file["bodies"]
    pattern = r"(\d+)((?:[^\S\n]+-?\d+)*)([^\n]*)"
    bodies, faces, rest = section.columns(pattern, "a body number and its faces")
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
    without = ", ".join(number for number, there in zip(bodies, given, strict=True) if not there)
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
    header = _Section(file.header, 1, file["top"].known)
    origin = np.array([header.numbers((c,), 0)[0] for c in given.groups()] if given else np.zeros(3))
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
        plane = _plane(file["top"], number, origin, needed=True)
        assert plane is not None
        plane = replace(plane, name=unquote(name.strip()), mirror=kind == "mirror")
        others.append((plane, constraints[number]))
    return ground, tuple(others), origin


def _plane(top: _Section, number: int, origin: Floats, needed: bool) -> Plane | None:
    """The plane of this constraint; None if it is not needed and not there."""
    pattern = rf"^[^\S\n]*constraint\s+{number}\b[^\n]*\s+(?:formula|function)\s*:?\s*([^\n]+)"
    hit = re.search(pattern, top.text, re.I | re.M)
    if hit is None and not needed:
        return None
    if hit is None:
        raise top.error(f"constraint {number} has no formula here")
    left, _, right = hit[1].partition("=")

    def fail(problem: str) -> FileError:
        return top.error(f"constraint {number} is not a plane: {problem}", offset=hit.start(1))

    formula = text.linear(left, top.known, fail) - text.linear(right or "0", top.known, fail)
    normal = formula[1:]
    if not normal.any():
        raise fail(f"{hit[1].strip()!r} names no coordinate")
    return Plane(tuple(origin - formula[0] * normal / (normal @ normal)), tuple(normal))
