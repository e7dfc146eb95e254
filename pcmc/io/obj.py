"""Wavefront OBJ (.obj), text. A group is a patch; supports are the points of groups "fixed" and
"sliding"; tensions, pressures and plane are a comment."""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from itertools import chain, pairwise
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pandas as pd

from ..base.arrays import Floats, Ints, format_rows
from ..base.errors import FileError
from ..base.validate import parsed
from ..surface import Surface
from .formats import Content
from .mesh_data import FREE, HELD, MeshData, support_of
from .metadata import parse_metadata
from .polygons import cut_polygons
from .text import TextSection, escaped, parsed_numbers

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
        mark = f"# {content.mark}\no {content.mark}\n" if content.mark else ""  # programs show the object
        file.write(f"{MARK}{content.metadata}\n{mark}")
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
    file = TextSection(re.sub(r"\\[^\S\n]*\n", " \f", path.read_text(encoding="utf-8-sig")))
    comment = re.search(rf"^{MARK}(.*)$", file.text, re.M)
    metadata = parse_metadata(comment[1] if comment else None)
    X = _vertices(file)
    key = next((k for k in ("g", "o", "usemtl") if re.search(rf"^[^\S\n]*{k}\s", file.text, re.M)), "g")
    heads = list(re.finditer(rf"^[^\S\n]*{key}(?:[^\S\n]+([^\n]*))?$", file.text, re.M))
    names = [path.stem, *((head[1] or path.stem).strip() for head in heads)]
    groups = np.array([unquote(name) if comment else name for name in names], dtype=object)
    starts = _places(heads)  # before the first: the file's name
    parts = [FACE.findall(file.text, *ends) for ends in pairwise((0, *starts.tolist(), len(file.text)))]
    corners, counts = _faces(file, list(chain.from_iterable(parts)), len(X))
    if not len(counts):
        raise FileError("the file has no faces", where="faces", found=0)
    support = np.full(len(X), FREE, dtype=np.int8)
    points = list(POINT.finditer(file.text)) if HELD.keys() & set(groups.tolist()) else []
    for point, group in zip(points, groups[np.searchsorted(starts, _places(points))], strict=True):
        if group not in HELD:
            continue
        numbered = np.array(point[1].split(), dtype=np.float64)
        if not (numbered.min() >= 1 and numbered.max() <= len(X)):
            outside = f"a point here is outside 1..{len(X)}"
            raise file.error(outside, offset=point.start(), found=point[0])
        support[numbered.astype(np.int64) - 1] = HELD[group]
    sizes = np.array([len(part) for part in parts])
    patch, patches = pd.factorize(np.repeat(groups, sizes))
    F, source, notes = cut_polygons(X, corners, counts)
    metadata.check_counts(len(X), len(F))
    known = support if comment or support.any() else None
    about: dict[str, Any] = {"support": known, "joined": metadata.counts is not None}
    return metadata.mesh_data(X, F, patch[source], patches.tolist(), notes, **about)


def _places(statements: Iterable[re.Match[str]]) -> Ints:
    return np.array([one.start() for one in statements], dtype=np.int64)


def _vertices(file: TextSection) -> Floats:
    coordinates = VERTEX.findall(file.text)
    if len(coordinates) == len(re.findall(r"^[^\S\n]*v(?=\s)", file.text, re.M)):
        with suppress(ValueError):
            return parsed_numbers([c for row in coordinates for c in row]).reshape(-1, 3)
    for line in re.finditer(r"^[^\S\n]*v(?=\s)[^\n]*$", file.text, re.M):
        try:
            [parsed(c) for c in line[0].split()[1:4]][2]
        except (ValueError, IndexError):
            raise file.error("expected three coordinates", offset=line.start(), found=line[0]) from None
    raise FileError("its vertices cannot be read", where="vertices")


def _faces(file: TextSection, faces: list[str], n: int) -> tuple[Ints, Ints]:
    """The vertex at each corner of face after face, and corners per face."""
    bare = re.sub(r"/[^\s]*", "", "\n".join(faces)).split("\n") if faces else []
    counts = np.array([len(face.split()) for face in bare], dtype=np.int64)
    try:
        corner = parsed_numbers(" ".join(bare).split(), np.int64)
    except (ValueError, OverflowError):
        every = list(FACE.finditer(file.text))
        odd = next((one for one in every if not all(map(CORNER.fullmatch, one[1].split()))), every[0])
        raise file.error("expected vertex numbers", offset=odd.start(), found=odd[0]) from None
    if (corner < 0).any():  # counted back from the vertices seen so far
        vertices, lines = (_places(pattern.finditer(file.text)) for pattern in (VERTEX, FACE))
        seen = np.searchsorted(vertices, lines)
        corner = np.where(corner < 0, np.repeat(seen, counts) + corner + 1, corner)
    bad = np.flatnonzero((corner < 1) | (corner > n))
    short = np.flatnonzero(counts < 3)
    if len(bad) or len(short):
        number = int(np.searchsorted(np.cumsum(counts), bad[0], side="right") if len(bad) else short[0])
        wrong = f"names a vertex outside 1..{n}" if len(bad) else "has fewer than three corners"
        line = list(FACE.finditer(file.text))[number]
        raise file.error(f"the face {wrong}", offset=line.start(), found=line[0])
    return corner - 1, counts
