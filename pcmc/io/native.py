"""The native format (.pcmc): everything there is to a surface, to the last bit.

A zip archive of NumPy arrays (an .npz) that ``numpy.load`` opens: ``vertices``, ``faces``,
``patch_of_face``, ``support``; where vertices slide along lines, ``lines`` and ``on_line``, along circles,
``circles`` and ``on_circle``, on planes other than Π, ``planes`` and ``on_planes``; for each cable
``cable <k>``, its edges; one ``scalar <name>`` per scalar, one ``certificate <name>`` per array of the
certificate, and ``meta``, a JSON text with the format's version, the patches, the plane, the cables, the
rooms of prescribed volume and the rest of the certificate, its tables as lists of rows.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..base.arrays import Bools, Floats
from ..base.errors import FileError
from ..surface import Cable, Circle, Guide, Line, Plane, Room, Surface
from .libraries import translated_errors
from .mesh_data import MeshData, given_support
from .metadata import parse_metadata

VERSION = 5  # since 2 lines, 3 circles, 4 planes, weights, cables, rooms, 5 snow; the oldest that will do
FORMAT = "pcmc surface"
INFLATED = 100  # most bytes for each byte of the file; a flat grid of a million triangles has 7
ROOM = 64_000_000  # bytes that any file may become


def write(
    path: Path,
    surface: Surface,
    scalars: Mapping[str, Floats],
    certificate: Mapping[str, Any],
    metadata: str,
    **_: Any,
) -> None:
    """The archive; the same surface gives the same bytes."""
    tables = {k: v for k, v in certificate.items() if isinstance(v, np.ndarray) and v.dtype != object}
    meta = {
        "format": FORMAT,
        "version": _version(surface),
        "description": metadata,
        "certificate": {k: v for k, v in certificate.items() if k not in tables},
    }
    if surface.rooms:
        meta["rooms"] = [[room.name, room.patches, room.volume] for room in surface.rooms]
    arrays: dict[str, Any] = {f"scalar {name}": value for name, value in scalars.items()}
    arrays |= {f"certificate {name}": value for name, value in tables.items()}
    straight = [(line, along) for line, along in surface.given_supports.on_line if isinstance(line, Line)]
    if surface.on_planes:
        meta["planes"] = [{"name": plane.name, "mirror": plane.mirror} for plane, _ in surface.on_planes]
        arrays["planes"] = np.array([[plane.point, plane.normal] for plane, _ in surface.on_planes])
        arrays["on_planes"] = np.array([mask for _, mask in surface.on_planes])
    if surface.cables:
        meta["cables"] = [[cable.name, cable.tension] for cable in surface.cables]
        arrays |= {f"cable {k}": cable.edges for k, cable in enumerate(surface.cables)}
    if straight:
        arrays["lines"] = np.array([[line.point, line.direction] for line, _ in straight])
        arrays["on_line"] = np.array([along for _, along in straight])
    if surface.on_circle:
        round_ = [
            (guide, along) for guide, along in surface.given_supports.on_line if isinstance(guide, Circle)
        ]
        arrays["circles"] = np.array([[*c.centre, *c.normal, c.radius] for c, _ in round_])
        arrays["on_circle"] = np.array([along for _, along in round_])
    with path.open("wb") as file:
        np.savez_compressed(
            file,
            meta=np.array(json.dumps(meta, default=_plain)),
            vertices=surface.vertices,
            faces=surface.faces,
            patch_of_face=surface.patch_of_face,
            support=given_support(surface),
            **arrays,
        )


def read(path: Path) -> MeshData:
    """All of it."""
    with translated_errors("pcmc"):
        _check_size(path)
    with translated_errors("pcmc"), path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
        meta = json.loads(str(arrays.pop("meta")))
        if not isinstance(meta, dict) or not isinstance(meta["certificate"], dict):
            raise FileError(f"its description is damaged: {str(meta)[:60]!r}", where="meta")
        if meta["format"] != FORMAT:
            text = f"expected the format {FORMAT!r}, found {meta['format']!r}"
            raise FileError(text, where="format", found=meta["format"], expected=FORMAT)
        newer = meta["version"]
        if newer > VERSION:
            text = f"written by a newer pcmc (format {newer}, this one reads up to {VERSION}); update pcmc"
            raise FileError(text, where="version", found=newer, expected=VERSION)
        metadata = parse_metadata(meta["description"])
        return MeshData(
            arrays.pop("vertices"),
            arrays.pop("faces"),
            arrays.pop("patch_of_face"),
            tuple(metadata.patches.values()),
            arrays.pop("support"),
            metadata.plane,
            lines=_lines(arrays) + _circles(arrays),
            planes=_planes(arrays, meta.get("planes", [])),
            cables=_cables(arrays, meta.get("cables", [])),
            rooms=_rooms(meta),
            scalars=_under("scalar ", arrays),
            units=metadata.units,
            certificate={**meta["certificate"], **_under("certificate ", arrays)},
        )


def _version(surface: Surface) -> int:
    """The oldest version of the format that can hold a surface."""
    if surface.snows.any():
        return 5
    if surface.rooms or surface.on_planes or surface.cables or surface.weights.any():
        return 4
    return 3 if surface.on_circle else 2 if surface.on_line else 1


def _cables(arrays: dict[str, Any], rows: Any) -> tuple[Cable, ...]:
    """The cables in the description, name and tension of each, with their edges (k,2)."""
    fit = isinstance(rows, list) and all(isinstance(row, list) and len(row) == 2 for row in rows)
    names = [f"cable {k}" for k in range(len(rows))] if fit else []
    if not fit or any(name not in arrays for name in names):
        text = "cables: expected a name, a tension and edges for each"
        raise FileError(text, where="cables", found=str(rows)[:60])
    edges = [arrays.pop(name) for name in names]
    return tuple(Cable(name, pull, ends) for (name, pull), ends in zip(rows, edges, strict=True))


def _rooms(meta: Mapping[str, Any]) -> tuple[Room, ...]:
    """The rooms of prescribed volume in the description."""
    rows = meta.get("rooms", [])
    if not all(isinstance(row, list) and len(row) == 3 for row in rows):
        text = "rooms: expected a name, signs by patch and a volume for each"
        raise FileError(text, where="rooms", found=str(rows)[:60])
    return tuple(Room(*row) for row in rows)


def _lines(arrays: dict[str, Any]) -> tuple[tuple[Guide, Bools], ...]:
    """The lines (k,2,3) of the file with the masks (k,n) of their vertices."""
    ends, along = arrays.pop("lines", ()), arrays.pop("on_line", ())
    if len(ends) != len(along) or np.shape(ends)[1:] not in ((), (2, 3)):
        text = f"lines: expected a point and a direction for each of {len(along)} masks"
        raise FileError(text, where="lines", found=np.shape(ends), expected=(len(along), 2, 3))
    return tuple((Line(*one.tolist()), mask) for one, mask in zip(ends, along, strict=True))


def _circles(arrays: dict[str, Any]) -> tuple[tuple[Guide, Bools], ...]:
    """The circles (k,7) of the file, centre, normal and radius, with the masks (k,n) of their vertices."""
    rows, along = arrays.pop("circles", ()), arrays.pop("on_circle", ())
    if len(rows) != len(along) or np.shape(rows)[1:] not in ((), (7,)):
        text = f"circles: expected a centre, a normal and a radius for each of {len(along)} masks"
        raise FileError(text, where="circles", found=np.shape(rows), expected=(len(along), 7))
    circles = (Circle(tuple(row[:3]), tuple(row[3:6]), row[6]) for row in np.asarray(rows).tolist())
    return tuple(zip(circles, along, strict=True))


def _planes(arrays: dict[str, Any], described: Any) -> tuple[tuple[Plane, Bools], ...]:
    """The planes (k,2,3) of the file, point and normal, with the masks (k,n) of their vertices."""
    rows, masks = arrays.pop("planes", ()), arrays.pop("on_planes", ())
    alike = isinstance(described, list) and len(rows) == len(masks) == len(described)
    if not alike or np.shape(rows)[1:] not in ((), (2, 3)):
        text = f"planes: expected a point and a normal for each of {len(masks)} masks"
        raise FileError(text, where="planes", found=np.shape(rows), expected=(len(masks), 2, 3))
    planes = (
        Plane(tuple(point), tuple(normal), str(one["name"]), bool(one["mirror"]))
        for (point, normal), one in zip(np.asarray(rows).tolist(), described, strict=True)
    )
    return tuple(zip(planes, masks, strict=True))


def _check_size(path: Path) -> None:
    """Refuse an archive that becomes far larger than any surface does: it was made to fill the memory."""
    with zipfile.ZipFile(path) as archive:
        size = sum(item.file_size for item in archive.infolist())
    most = INFLATED * path.stat().st_size + ROOM
    if size > most:
        text = f"its {path.stat().st_size} bytes would become {size} in memory, and {most} at most are read"
        raise FileError(text, where="size", found=size, expected=most)


def _under(prefix: str, arrays: Mapping[str, Any]) -> dict[str, Any]:
    return {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}


def _plain(value: Any) -> Any:
    """A value of the certificate that JSON can hold."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Enum):
        return value.name.lower()
    if isinstance(value, pd.DataFrame):
        return value.to_dict(orient="records")
    if is_dataclass(value) and not isinstance(value, type):  # a proof
        return {"kind": type(value).__name__, **asdict(value)}
    found = type(value).__name__
    text = f"certificate: cannot write a {found}; use numbers, texts, arrays and tables"
    raise FileError(text, where="certificate", found=found)
