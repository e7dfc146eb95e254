"""Stanford PLY (.ply): written binary in double precision, read in any form.

Faces carry ``patch``, vertices ``support`` and both the scalars, as properties; the rest is a comment. The
usual libraries lose precision and properties (VTK), cannot read properties of faces (meshio), or refuse
polygons of different sizes in binary files and accept a text file that is cut off (trimesh).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import FileError
from ..surface import Surface
from .formats import Content
from .mesh_data import MeshData, support_of
from .metadata import parse_metadata
from .polygons import from_polygons
from .text import parsed_numbers

MARK = "comment pcmc "
TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "int64": "i8", "uint64": "u8", "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
NAMES = {"u1": "uchar", "i4": "int", "f8": "double"}


def write(path: Path, surface: Surface, content: Content) -> None:
    vertex = {c: surface.vertices[:, d].astype("<f8") for d, c in enumerate("xyz")}
    vertex["support"] = support_of(surface).astype("u1")
    face = {"patch": surface.patch_of_face.astype("<i4")}
    for name, values in content.scalars.items():
        columns = vertex if len(values) == surface.n else face
        columns[re.sub(r"\s+", "_", name)] = np.asarray(values, dtype="<f8")
    announced = [
        "".join(f"property {NAMES[column.dtype.str[1:]]} {key}\n" for key, column in columns.items())
        for columns in (vertex, face)
    ]
    comment = f"comment {content.mark}\n" if content.mark else ""
    header = (
        f"ply\nformat binary_little_endian 1.0\n{MARK}{content.metadata}\n{comment}"
        f"element vertex {surface.n}\n{announced[0]}element face {surface.m}\n"
        f"property list uchar int vertex_indices\n{announced[1]}end_header\n"
    )
    corners = {"count": np.full(surface.m, 3, dtype="u1")}
    corners |= {f"corner {k}": surface.faces[:, k].astype("<i4") for k in range(3)}
    with path.open("wb") as file:
        file.write(header.encode())
        for columns in (vertex, corners | face):
            dtype = [(f"{k} {name}", column.dtype) for k, (name, column) in enumerate(columns.items())]
            file.write(np.rec.fromarrays(list(columns.values()), dtype=np.dtype(dtype)).tobytes())


@dataclass(frozen=True)
class _Element:
    """An element of the header; a property is (name, type), at most one is (name, type, type of items)."""

    name: str
    size: int
    properties: list[tuple[str, ...]]

    @property
    def count(self) -> str | None:
        """The column with the number of items of each row's list."""
        return next((f"{p[0]} count" for p in self.properties if len(p) == 3), None)

    def row(self, count: int) -> np.dtype[Any]:
        """dtype of a row whose list has ``count`` items."""
        fields: list[tuple[Any, ...]] = []
        for name, kind, *items in self.properties:
            fields += [(f"{name} count", kind), (name, items[0], (count,))] if items else [(name, kind)]
        return np.dtype(fields)


def read(path: Path) -> MeshData:
    """Binary or text, with triangles, quads or polygons."""
    data = path.read_bytes()
    end = re.search(rb"end_header[^\S\n]*\n", data[: 1 << 20])
    if not data.startswith(b"ply") or end is None:
        raise FileError("not a PLY file, or cut off in its header", where="header")
    header, start = data[: end.start()].decode("utf-8", "replace").replace("\r", ""), end.end()
    form = re.search(r"^format (ascii|binary_(?:little|big)_endian) ", header, re.M)
    if form is None:
        raise FileError("its header names no known format", where="header")
    comment = re.search(rf"^{MARK}(.*)$", header, re.M)
    order = ">" if form[1] == "binary_big_endian" else "<"
    kinds = {name: "<f8" if form[1] == "ascii" else order + kind for name, kind in TYPES.items()}
    elements = _elements(header, kinds)
    if form[1] == "ascii":
        try:
            data, start = parsed_numbers(data[start:].decode("ascii").split()).tobytes(), 0
        except ValueError as error:
            raise FileError(f"its body is not all numbers ({error})", where="body") from None
    tables: dict[str, dict[str, Any]] = {}
    for element in elements:
        tables[element.name], start = _rows(element, data, start)
        if element.name == "face":
            break
    vertex, face = tables["vertex"], tables["face"]
    X = np.stack([np.asarray(vertex.pop(c, None), dtype=np.float64) for c in "xyz"], axis=1)
    key = next((k for k in ("vertex_indices", "vertex_index") if f"{k} count" in face), None)
    if key is None:
        raise FileError("its faces have no list vertex_indices", where="face")
    corners, counts = face.pop(key), face.pop(f"{key} count")
    metadata = parse_metadata(comment[1] if comment else None)
    return from_polygons(X, corners, counts, vertex, face, metadata, path.stem)


def _elements(header: str, kinds: Mapping[str, str]) -> list[_Element]:
    elements: list[_Element] = []
    for number, line in enumerate(header.split("\n"), 1):
        try:
            match line.split():
                case ["element", name, count]:
                    if not count.isdecimal() or len(count) > 18:
                        raise ValueError
                    elements.append(_Element(name, int(count), []))
                case ["property", "list", of_count, of_items, name]:
                    if elements[-1].count:
                        text = f"line {number}: pcmc reads one list per element, this is a second"
                        raise FileError(text, where=number)
                    elements[-1].properties.append((name, kinds[of_count], kinds[of_items]))
                case ["property", kind, name]:
                    elements[-1].properties.append((name, kinds[kind]))
        except FileError:
            raise
        except (KeyError, IndexError, ValueError):
            text = f"line {number}: not a line of a PLY header: {line[:60]!r}"
            raise FileError(text, where=number) from None
    names = [e.name for e in elements]
    if "vertex" not in names or "face" not in names[names.index("vertex") :]:
        text = f"its header must list vertices, then faces; found {', '.join(names) or 'none'}"
        raise FileError(text, where="header")
    for element in elements:
        columns = [p[0] for p in element.properties]
        if len(set(columns)) < len(columns):
            text = f"two properties of its element {element.name} have the same name"
            raise FileError(text, where="header", found=element.name)
    missing = set("xyz") - {p[0] for p in elements[names.index("vertex")].properties if len(p) == 2}
    if missing:
        raise FileError(f"its vertices have no property {min(missing)}", where="vertex")
    return elements


def _rows(element: _Element, data: bytes, start: int) -> tuple[dict[str, Any], int]:
    """Columns of an element that starts at a byte, a list's items one after the other; and its end."""
    row, column = cache(element.row), element.count

    def need(end: int) -> None:
        if end > len(data):
            text = f"cut off: the file ends before its {element.size} {element.name} elements do"
            raise FileError(text, where=element.name)

    def row_at(offset: int, number: int) -> Any:
        """The row that starts at a byte, as an array of one."""
        need(offset + row(0).itemsize)
        found = np.frombuffer(data, row(0), 1, offset)
        if column is None:
            return found
        count = found[column][0]
        if not 0 <= count <= len(data) or count != int(count):
            raise FileError(f"{element.name} {number} lists {count} items", where=number, found=count.item())
        need(offset + row(int(count)).itemsize)
        return np.frombuffer(data, row(int(count)), 1, offset)

    need(element.size)  # a row has at least a byte
    first = row_at(start, 0) if element.size else np.empty(0, row(0))
    end = start + element.size * first.itemsize
    if column is None:
        need(end)
    if end <= len(data):
        table = np.frombuffer(data, first.dtype, element.size, start)
        if column is None or (table[column] == first[column]).all():  # all lists of one length
            return {name: table[name].ravel() for name in table.dtype.names or ()}, end
    rows = []
    for number in range(element.size):  # each row says only where the next one starts
        rows.append(row_at(start, number))
        start += rows[-1].nbytes
    names = first.dtype.names or ()
    return {name: np.concatenate([one[name].ravel() for one in rows]) for name in names}, start
