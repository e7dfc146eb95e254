"""The reader of Surface Evolver datafiles.

It takes datafiles as ``evolver`` writes them, those that the program's ``dump`` writes, and others whose
sections list elements by number.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pandas as pd

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import FileError
from ..base.validate import names_from_file
from ..surface import Cable, Patch, Plane, Room
from .mesh_data import FIXED, FREE, SLIDING, MeshData
from .polygons import triangulate
from .text import constant, linear, numbers

WRITTEN = "written by pcmc"
ROUNDING = 1e-12  # of the largest pressure: what is left of differences


def read(path: Path) -> MeshData:
    """The mesh, tensions, pressures and supports of a datafile; errors name the line."""
    header, file = _open(path)
    if WRITTEN in header:
        file["read"]  # its last line: without it the file is cut off
    known = _parameters(file["top"])
    ids, X, support, constraints = _vertices(file["vertices"], known)
    edges, faces = file["edges"], file["faces"]
    edge_ids, ends, edge_rest = _edges(edges, ids)
    face_ids, corners, counts, rest = _faces(faces, edge_ids, ends)
    F, source, notes = triangulate(X, corners, counts)
    pressure, prescribed, more = _pressures(file, face_ids, known)
    patch_of_face, patches = _patches(header, faces, rest, (pressure, *prescribed.values()), known)
    given = re.search(r"^// origin (\S+) (\S+) (\S+)$", header, re.M)
    place = _Section(header, 1)
    origin = np.array([_numbers((c,), known, place, 0)[0] for c in given.groups()] if given else np.zeros(3))
    plane, planes = _planes(header, file["top"], constraints, support, origin, known)
    rooms = _rooms(header, prescribed, patch_of_face, patches)
    unset = _names(header, "bare").values()
    X, notes = X + origin, (*notes, *more)
    return MeshData(
        X,
        F,
        patch_of_face[source],
        patches,
        support,
        plane,
        notes=notes,
        planes=planes,
        rooms=rooms,
        cables=_cables(header, edges, ends, edge_rest, known),
        bare=tuple(p.name for p in patches if p.name in unset and p.tension == p.pressure == 1.0),
    )


@dataclass(frozen=True)
class _Section:
    """A part of the file. A form feed stands for a line end that does not end an element."""

    text: str
    first_line: int

    def error(self, text: str, row: int | None = None, offset: int = 0) -> FileError:
        """An error at the given element (counting from 0), or at an offset into the text."""
        if row is not None:
            starts = [m.start() for m in re.finditer(r"^[^\S\n]*\S", self.text, re.M)]
            offset = starts[min(row, len(starts) - 1)]
        before = self.text[:offset]
        line = self.first_line + before.count("\n") + before.count("\f")
        return FileError(f"line {line}: {text}", where=line)

    def elements(self, pattern: str, what: str) -> list[tuple[str, ...]]:
        """Groups of the pattern for each line that is not blank."""
        matches = re.findall(rf"^[^\S\n]*{pattern}$", self.text, re.M)
        lines = re.findall(r"^[^\S\n]*\S[^\n]*$", self.text, re.M)
        if len(matches) != len(lines):
            one = re.compile(rf"[^\S\n]*{pattern}")
            row = next(k for k, line in enumerate(lines) if not one.fullmatch(line))
            raise self.error(f"expected {what}, found {' '.join(lines[row].split())[:60]!r}", row)
        return matches


class _Sections(dict[str, _Section]):
    """The sections by name."""

    def __missing__(self, name: str) -> _Section:
        known = ", ".join(k for k in self if k != "top") or "none"
        text = f"no {name} section (found: {known}); the file is cut off or no Surface Evolver datafile"
        raise FileError(text, where=name)


def _open(path: Path) -> tuple[str, _Sections]:
    """The text before the vertices with its comments, and the sections without theirs."""
    text = path.read_text(encoding="utf-8-sig")
    bare = re.sub(r"/\*.*?(?:\*/|\Z)", lambda m: "\f" * m[0].count("\n") + " ", text, flags=re.S)
    bare = re.sub(r"//[^\n]*", "", bare)
    bare = re.sub(r"\\[^\S\n]*\n", "\f", bare)
    heads = list(re.finditer(r"^[^\S\n]*(vertices|edges|faces|facets|bodies|read)\b", bare, re.I | re.M))
    starts = [0, *(h.end() for h in heads)]
    ends = [*(h.start() for h in heads), len(bare)]
    names = ["top", *("faces" if h[1].lower() == "facets" else h[1].lower() for h in heads)]
    sections = _Sections()
    for name, start, end in zip(names, starts, ends, strict=True):
        line = 1 + bare[:start].count("\n") + bare[:start].count("\f")
        sections.setdefault(name, _Section(bare[start:end], line))
        if name == "read":
            break  # what follows are commands
    header = re.split(r"^[^\S\n]*vertices\b", text, maxsplit=1, flags=re.I | re.M)[0]
    return header, sections


UNREADABLE = (
    "string|quadratic|lagrange|simplex_representation|torus|torus_filled|symmetry_group|#include|#define"
)


def _parameters(top: _Section) -> dict[str, float]:
    """Named constants of the top section, which coordinates and tensions may use."""
    foreign = re.search(rf"^[^\S\n]*({UNREADABLE})\b", top.text, re.I | re.M)
    if foreign:
        text = f"{foreign[1].lower()} is not supported; load the file in Surface Evolver and `dump` it"
        raise top.error(f"{text}; read the dump", offset=foreign.start())
    known = {"pi": math.pi}
    for hit in re.finditer(r"^[^\S\n]*parameter\s+(\w+)\s*=\s*([^\n]+)", top.text, re.I | re.M):
        known[hit[1].lower()] = constant(hit[2], known, partial(top.error, offset=hit.start()))
    return known


def _vertices(section: _Section, known: Mapping[str, float]) -> tuple[Ints, Floats, Ints, dict[int, Bools]]:
    """Ids, positions, support, and by the number of each constraint the vertices that lie on it."""
    what = "a vertex number and three coordinates"
    listed = section.elements(r"(\d+)[^\S\n]+(\S+)[^\S\n]+(\S+)[^\S\n]+(\S+)([^\n]*)", what)
    columns = list(zip(*listed, strict=True)) or [()] * 5
    X = np.stack([_numbers(column, known, section) for column in columns[1:4]], axis=1)
    code, kinds = pd.factorize(np.array(columns[4], dtype=object))
    first = np.unique(code, return_index=True)[1]
    support = np.zeros(len(kinds), dtype=np.int8)
    constraints: dict[int, Bools] = {}
    for k, rest in enumerate(kinds):
        row, words = int(first[k]), rest.lower()
        if re.search(r"\bboundary\b", words):
            raise section.error("a vertex on a parametric boundary is not supported", row)
        named = re.search(r"\bconstraints?((?:\s+\d+)+)", words)
        numbers = _whole(named[1].split(), section, row).tolist() if named else []
        support[k] = FIXED if re.search(r"\bfixed\b", words) else SLIDING if numbers else FREE
        for number in numbers:
            constraints.setdefault(number, np.zeros(len(kinds), dtype=bool))[k] = True
    of_vertex = {number: mask[code] for number, mask in sorted(constraints.items())}
    return _whole(columns[0], section), X, support[code], of_vertex


def _edges(section: _Section, vertex_ids: Ints) -> tuple[Ints, Ints, list[str]]:
    """Ids, vertices (e,2), and what follows them on the line of each edge."""
    pattern, what = r"(\d+)[^\S\n]+(\d+)[^\S\n]+(\d+)(?!\S)([^\n]*)", "an edge number and two vertices"
    *columns, rest = list(zip(*section.elements(pattern, what), strict=True)) or [()] * 4
    ids, *ends = (_whole(column, section) for column in columns)
    return ids, np.stack([_places(vertex_ids, end, section, "vertex") for end in ends], axis=1), list(rest)


def _faces(faces: _Section, edge_ids: Ints, ends: Ints) -> tuple[Ints, Ints, Ints, list[str]]:
    """Ids, vertices of face after face, corners of each face, and what follows the edges on its line."""
    listed = faces.elements(r"(\d+)((?:[^\S\n]+-?\d+)+)([^\n]*)", "a face number and its edges")
    counts = np.array([len(f[1].split()) for f in listed], dtype=np.int64)
    row = np.repeat(np.arange(len(listed)), counts)
    signed = _whole(" ".join(f[1] for f in listed).split(), faces, row)
    place = _places(edge_ids, np.abs(signed), faces, "edge", row)
    tail = np.where(signed > 0, ends[place, 0], ends[place, 1])
    head = np.where(signed > 0, ends[place, 1], ends[place, 0])
    last = np.cumsum(counts) - 1
    following = np.arange(1, len(signed) + 1)
    following[last] = last - counts + 1
    open_at = np.flatnonzero(head != tail[following])
    if len(open_at):
        raise faces.error("the edges of the face do not follow each other head to tail", row[open_at[0]])
    ids = _whole([f[0] for f in listed], faces)
    return ids, tail, counts, [f[2] for f in listed]


def _names(header: str, kind: str) -> dict[str, str]:
    """The names that comments give to patches, rooms or cables, by number."""
    rows = re.findall(rf"^// {kind} (\d+) ([^\n]+)$", header, re.M)
    names = names_from_file(name for _, name in rows)[0]
    return {number: unquote(names[name]) if WRITTEN in header else names[name] for number, name in rows}


def _values(
    section: _Section, rest: Sequence[str], key: str, known: Mapping[str, float], default: float = 0.0
) -> tuple[Floats, Bools]:
    """(k,) the number after a key in what follows each element, and where there is one."""
    pattern = re.compile(rf"\b(?:{key})\s+\{{?([^\s{{}}]+)", re.I)
    if not pattern.search("\n".join(set(rest))):
        return np.full(len(rest), default), np.zeros(len(rest), dtype=bool)
    code, kinds = pd.factorize(np.array(rest, dtype=object))
    first = np.unique(code, return_index=True)[1]
    value, given = np.full(len(kinds), default), np.zeros(len(kinds), dtype=bool)
    for k, words in enumerate(kinds):
        if hit := pattern.search(words):
            value[k], given[k] = _numbers((hit[1],), known, section, int(first[k]))[0], True
    return value[code], given[code]


def _cables(
    header: str, section: _Section, ends: Ints, rest: Sequence[str], known: Mapping[str, float]
) -> tuple[Cable, ...]:
    """The edges (e,2) with a line tension as cables, those of one number and tension together."""
    names = _names(header, "cable")
    tension, _ = _values(section, rest, "tension|density", known)
    number, given = _values(section, rest, "cable", known)
    chosen = np.flatnonzero((tension != 0.0) | (given & np.isin(number, [float(name) for name in names])))
    kinds, kind = np.unique(np.stack([number, tension], axis=1)[chosen], axis=0, return_inverse=True)
    once = len(np.unique(kinds[:, 0])) == len(kinds)
    return tuple(
        Cable(names.get(str(int(a)), f"cable {k}") if once else f"cable {k}", t, ends[chosen[kind == k - 1]])
        for k, (a, t) in enumerate(kinds.tolist(), 1)
    )


def _places(ids: Ints, wanted: Ints, section: _Section, what: str, row: Ints | None = None) -> Ints:
    """Where each wanted id stands among the ids."""
    order = np.argsort(ids, kind="stable")
    place = order[np.minimum(np.searchsorted(ids, wanted, sorter=order), len(ids) - 1)]
    bad = np.flatnonzero(ids[place] != wanted)
    if len(bad):
        at = int(bad[0] if row is None else row[bad[0]])
        raise section.error(f"there is no {what} {wanted[bad[0]]}", at)
    return place


def _pressures(
    file: _Sections, face_ids: Ints, known: Mapping[str, float]
) -> tuple[Floats, dict[tuple[str, float], Ints], tuple[str, ...]]:
    """(m,) pressure along each face's normal: the sum over the bodies on its two sides.

    And the bodies of prescribed volume: by number and volume, (m,) 1 or -1 where a face bounds them.
    """
    pressure = np.zeros(len(face_ids))
    prescribed: dict[tuple[str, float], Ints] = {}
    if "bodies" not in file:
        return pressure, prescribed, ("the file has no bodies, so no patch is under pressure",)
    section = file["bodies"]
    listed = section.elements(r"(\d+)((?:[^\S\n]+-?\d+)*)([^\n]*)", "a body number and its faces")
    rest = [words for *_, words in listed]
    inside, given = _values(section, rest, "pressure|lagrange_multiplier", known, 1.0)
    volume, limited = _values(section, rest, "volume", known)
    of_body = np.repeat(np.arange(len(listed)), [len(members.split()) for _, members, _ in listed])
    signed = _whole(" ".join(members for _, members, _ in listed).split(), section, of_body)
    place = _places(face_ids, np.abs(signed), section, "face", of_body)
    np.add.at(pressure, place, np.sign(signed) * inside[of_body])
    for row in np.flatnonzero(limited):
        sides = np.zeros(len(face_ids), dtype=np.int64)
        np.add.at(sides, place[of_body == row], np.sign(signed[of_body == row]))
        prescribed[listed[row][0], float(volume[row])] = sides
    if prescribed:  # the difference of two rooms' pressures is 0 but for rounding
        pressure[np.abs(pressure) <= ROUNDING * np.abs(pressure).max(initial=0.0)] = 0.0
    without = ", ".join(number for (number, *_), there in zip(listed, given, strict=True) if not there)
    note = f"body {without} has no pressure in the file; 1 is used"
    return pressure, prescribed, (note,) if without else ()


def _patches(
    header: str,
    section: _Section,
    rest: list[str],
    of_face: Sequence[Floats | Ints],
    known: Mapping[str, float],
) -> tuple[Ints, tuple[Patch, ...]]:
    """Faces alike in patch number, tension, weight, snow and all (m,) ``of_face`` are a patch."""
    columns = {"patch": 0.0, "tension|density": 1.0, "weight": 0.0, "snow": 0.0}
    given = [_values(section, rest, key, known, default)[0] for key, default in columns.items()]
    laws = np.stack([*given, *of_face], axis=1)
    rows_, patch_of_face = np.unique(laws, axis=0, return_inverse=True)
    names = _names(header, "patch")
    walls = {float(k) for k in re.findall(r"^// wall (\d+)$", header, re.M)}
    once = len(np.unique(rows_[:, 0])) == len(rows_)
    patches = [
        Patch(names.get(str(int(a)), f"patch {k}") if once else f"patch {k}", t, p + s, a in walls, w, s)
        for k, (a, t, w, s, p, *_) in enumerate(rows_, 1)
    ]
    return patch_of_face.ravel(), tuple(patches)


def _rooms(
    header: str, prescribed: Mapping[tuple[str, float], Ints], patch_of_face: Ints, patches: tuple[Patch, ...]
) -> tuple[Room, ...]:
    """The bodies of prescribed volume as rooms, with the names that pcmc has given them."""
    names = _names(header, "room")
    rooms = []
    for (number, volume), sides in prescribed.items():
        of_patch = np.zeros(len(patches), dtype=np.int64)
        of_patch[patch_of_face] = sides
        signs = tuple((patches[k].name, int(of_patch[k])) for k in np.flatnonzero(of_patch))
        rooms.append(Room(names.get(number, f"body {number}"), signs, volume))
    return tuple(rooms)


def _planes(
    header: str,
    top: _Section,
    constraints: Mapping[int, Bools],
    support: Ints,
    origin: Floats,
    known: Mapping[str, float],
) -> tuple[Plane | None, tuple[tuple[Plane, Bools], ...]]:
    """Π and the other planes with their vertices, seen from the file's origin; ``support`` is changed to fit.

    Π is constraint 1, or the first that sliding vertices lie on; sliding vertices on others alone are free of
    it.
    """
    used = [number for number, mask in constraints.items() if (mask & (support == SLIDING)).any()]
    described = {int(k): (kind, name) for k, kind, name in re.findall(DESCRIBED, header, re.M)}
    first = 1 if described or 1 in used or not used else used[0]
    ground = _plane(top, first, origin, known, needed=first in used)
    if first in constraints:
        support[(support == SLIDING) & ~constraints[first]] = FREE
    elif used:
        support[support == SLIDING] = FREE
    others = []
    for number in sorted({*used, *described} & set(constraints) - {first}):
        kind, name = described.get(number, ("support", ""))
        plane = _plane(top, number, origin, known, needed=True)
        assert plane is not None
        others.append(
            (replace(plane, name=unquote(name.strip()), mirror=kind == "mirror"), constraints[number])
        )
    return ground, tuple(others)


DESCRIBED = r"^// plane (\d+) (mirror|support)\b([^\n]*)$"


def _plane(
    top: _Section, number: int, origin: Floats, known: Mapping[str, float], needed: bool
) -> Plane | None:
    """The plane of this constraint; None if it is not needed and not there."""
    pattern = rf"^[^\S\n]*constraint\s+{number}\b[^\n]*\s+(?:formula|function)\s*:?\s*([^\n]+)"
    hit = re.search(pattern, top.text, re.I | re.M)
    if hit is None and not needed:
        return None
    if hit is None:
        raise top.error(f"constraint {number} has no formula here")
    left, _, right = hit[1].partition("=")

    def fail(text: str) -> FileError:
        return top.error(f"constraint {number} is not a plane: {text}", offset=hit.start(1))

    formula = linear(left, known, fail) - linear(right or "0", known, fail)
    normal = formula[1:]
    if not normal.any():
        raise fail(f"{hit[1].strip()!r} names no coordinate")
    point = origin - formula[0] * normal / (normal @ normal)
    return Plane(tuple(point), tuple(normal))


def _whole(words: Sequence[str], section: _Section, row: int | Ints | None = None) -> Ints:
    """Whole numbers from words of the given rows, by default one of each row."""
    try:
        return np.array(words, dtype=np.int64)
    except (OverflowError, ValueError):
        bad = next((k for k, word in enumerate(words) if len(word.lstrip("-0")) > 18), 0)
        at = bad if row is None else int(np.broadcast_to(row, len(words))[bad])
        text = f"expected whole numbers below 2^63, found {words[bad][:40]!r}"
        raise section.error(text, at) from None


def _numbers(
    words: tuple[str, ...], known: Mapping[str, float], section: _Section, row: int | None = None
) -> Floats:
    """Floats from words: numbers, or expressions of numbers and parameters."""
    try:
        return numbers(words)
    except ValueError:
        rows = range(len(words)) if row is None else [row]
        values = [
            constant(word, known, partial(section.error, row=k)) for k, word in zip(rows, words, strict=True)
        ]
        return np.array(values)
