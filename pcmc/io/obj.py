"""Wavefront OBJ (.obj), text. A group is a patch; supports are the points of groups "fixed" and
"sliding"; tensions, pressures and plane are a comment."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from ..base.arrays import Floats, Ints, format_rows
from ..base.errors import FileError
from ..base.validate import parsed
from ..surface import Surface
from .formats import Content
from .mesh_data import FREE, HELD, MeshData, support_of
from .metadata import parse_metadata
from .polygons import triangulate
from .text import escaped, numbers

MARK = "# pcmc "
SPECIAL = "\\"
VERTEX = re.compile(r"^[^\S\n]*v[^\S\n]+(\S+)[^\S\n]+(\S+)[^\S\n]+(\S+)[^\n]*$", re.M)
FACE = re.compile(r"^[^\S\n]*f[^\S\n]+([^\n]+)$", re.M)
POINT = re.compile(r"^[^\S\n]*p[^\S\n]+(\d[\d \t]*)$", re.M)
CORNER = re.compile(r"[-+]?[0-9]{1,18}(/\S*)?")


def write(path: Path, surface: Surface, content: Content) -> None:
    """Vertices with all digits, supports, then the faces group by group; a backslash would join lines."""
    support = support_of(surface)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"{MARK}{content.metadata}\n")
        file.write(format_rows("v %r %r %r\n", *surface.vertices.T))
        for name, kind in HELD.items():
            held = np.flatnonzero(support == kind) + 1
            if len(held):
                file.write(f"g {name}\n" + format_rows("p %d\n", held))
        for k, patch in enumerate(surface.patches):
            file.write(f"g {escaped(patch.name, SPECIAL)}\n")
            file.write(format_rows("f %d %d %d\n", *(surface.faces[surface.patch_of_face == k].T + 1)))


def read(path: Path) -> MeshData:
    """Groups (``g``, else ``o``, else ``usemtl``) as patches."""
    text = re.sub(r"\\[^\S\n]*\n", " \f", path.read_text(encoding="utf-8-sig"))
    comment = re.search(rf"^{MARK}(.*)$", text, re.M)
    metadata = parse_metadata(comment[1] if comment else None)
    X = _vertices(text)
    key = next((k for k in ("g", "o", "usemtl") if re.search(rf"^[^\S\n]*{k}\s", text, re.M)), "g")
    starts = cache(lambda: np.array([m.start() for m in VERTEX.finditer(text)], dtype=np.int64))
    names: dict[str, int] = {}
    corners, counts, groups = [], [], []
    support = np.full(len(X), FREE, dtype=np.int8)
    for group, part, offset in _parts(text, key, path.stem):
        name = unquote(group) if comment else group
        count, corner = _faces(text, part, offset, len(X), starts)
        if len(count):
            counts.append(count)
            corners.append(corner)
            groups.append(np.full(len(count), names.setdefault(name, len(names))))
        if name in HELD:
            points = np.array(" ".join(POINT.findall(part)).split(), dtype=np.float64)
            if len(points) and not (points.min() >= 1 and points.max() <= len(X)):
                raise _error(text, offset + 1, f"a point here is outside 1..{len(X)}", "p")
            support[points.astype(np.int64) - 1] = HELD[name]
    if not names:
        raise FileError("the file has no faces", where="faces", found=0)
    F, source, notes = triangulate(X, np.concatenate(corners), np.concatenate(counts))
    metadata.check_counts(len(X), len(F))
    known = support if comment or support.any() else None
    patch, joined = np.concatenate(groups)[source], metadata.counts is not None
    return metadata.mesh_data(X, F, patch, list(names), notes, support=known, joined=joined)


def _vertices(text: str) -> Floats:
    coordinates = VERTEX.findall(text)
    lines = len(re.findall(r"^[^\S\n]*v(?=\s)", text, re.M))
    try:
        if len(coordinates) == lines:
            return numbers([c for row in coordinates for c in row]).reshape(-1, 3)
    except ValueError:
        pass
    for line in re.finditer(r"^[^\S\n]*v(?=\s)[^\n]*$", text, re.M):
        try:
            [parsed(c) for c in line[0].split()[1:4]][2]
        except (ValueError, IndexError):
            raise _error(text, line.start(), "expected three coordinates", line[0]) from None
    raise FileError("its vertices cannot be read", where="vertices")


def _parts(text: str, key: str, default: str) -> Iterator[tuple[str, str, int]]:
    """Name, text and offset of each stretch between statements of the key."""
    heads = list(re.finditer(rf"^[^\S\n]*{key}(?:[^\S\n]+([^\n]*))?$", text, re.M))
    starts = [0, *(h.end() for h in heads)]
    ends = [*(h.start() for h in heads), len(text)]
    names = [default, *((h[1] or default).strip() for h in heads)]
    for name, start, end in zip(names, starts, ends, strict=True):
        yield name, text[start:end], start


def _faces(text: str, part: str, offset: int, n: int, starts: Callable[[], Ints]) -> tuple[Ints, Ints]:
    """Corners per face, and the vertex index at each. ``starts`` gives the vertices' places in the text."""
    faces = FACE.findall(part)
    bare = re.sub(r"/[^\s]*", "", "\n".join(faces)).split("\n") if faces else []
    counts = np.array([len(face.split()) for face in bare], dtype=np.int64)
    try:
        corner = numbers(" ".join(bare).split(), np.int64)
    except (ValueError, OverflowError):
        lines = list(FACE.finditer(part))
        at = next((m for m in lines if not all(map(CORNER.fullmatch, m[1].split()))), lines[0])
        raise _error(text, offset + at.start(), "expected vertex numbers", at[0]) from None
    if (corner < 0).any():  # counted back from the vertices seen so far
        at_face = np.array([offset + m.start() for m in FACE.finditer(part)])
        before = np.repeat(np.searchsorted(starts(), at_face), counts)
        corner = np.where(corner < 0, before + corner + 1, corner)
    bad = np.flatnonzero((corner < 1) | (corner > n))
    short = np.flatnonzero(counts < 3)
    if len(bad) or len(short):
        face = int(np.searchsorted(np.cumsum(counts), bad[0], side="right") if len(bad) else short[0])
        line = list(FACE.finditer(part))[face]
        wrong = f"names a vertex outside 1..{n}" if len(bad) else "has fewer than three corners"
        raise _error(text, offset + line.start(), f"the face {wrong}", line[0])
    return counts, corner - 1


def _error(text: str, offset: int, wrong: str, found: str) -> FileError:
    before = text[:offset]
    line = 1 + before.count("\n") + before.count("\f")
    found = " ".join(found.split())[:60]
    return FileError(f"line {line}: {wrong}, found {found!r}", where=line, found=found)
