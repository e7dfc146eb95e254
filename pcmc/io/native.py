"""The native format (.pcmc): everything there is to a surface, to the last bit.

A zip archive of NumPy arrays that ``numpy.load`` opens: ``vertices``, ``faces``, ``patch_of_face``,
``support``, ``scalar <name>``, ``certificate <name>``, and ``meta``, a JSON text with the version, the
description of ``metadata``, the curves and the rest of the certificate.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..base.errors import FileError
from ..base.libraries import translated_errors
from ..surface import HeldCurve, Surface
from .formats import PARTS, Content
from .mesh_data import MeshData, numeric, support_of, within
from .metadata import DAMAGED, parse_metadata

VERSION = max(part.since for part in PARTS.values())
FORMAT = "pcmc surface"
HELD = {"format", "version", "description", "curves", "certificate", "scalar"}  # of meta and arrays
HELD |= {"vertices", "faces", "patch_of_face", "support"}
INFLATED = 100  # most bytes for each byte of the file; a flat grid of a million triangles has 7
ROOM = 64_000_000  # bytes that any file may become


def write(path: Path, surface: Surface, content: Content) -> None:
    """The archive; the same surface gives the same bytes."""
    tables = {k: v for k, v in content.certificate.items() if isinstance(v, np.ndarray) and v.dtype != object}
    since = [part.since for part in PARTS.values() if part.there(surface, content.units)]
    meta = {
        "format": FORMAT,
        "version": max(since, default=1),  # the oldest that will do
        "description": content.metadata,
        "curves": [one.plain() for one in surface.held_curves],
        "certificate": {k: v for k, v in content.certificate.items() if k not in tables},
    }
    arrays: dict[str, Any] = {f"scalar {name}": value for name, value in content.scalars.items()}
    arrays |= {f"certificate {name}": value for name, value in tables.items()}
    mesh = {name: getattr(surface, name) for name in ("vertices", "faces", "patch_of_face")}
    text = np.array(json.dumps(meta, default=_plain))
    with path.open("wb") as file:
        np.savez_compressed(file, meta=text, **mesh, support=support_of(surface), **arrays)


def read(path: Path) -> MeshData:
    with translated_errors("pcmc"), zipfile.ZipFile(path) as packed:
        size, given = sum(item.file_size for item in packed.infolist()), path.stat().st_size
        most = INFLATED * given + ROOM
        if size > most:  # it was made to fill the memory
            text = f"its {given} bytes would become {size} in memory, and {most} at most are read"
            raise FileError(text, where="size", found=size, expected=most)
    with translated_errors("pcmc"), path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
        meta = json.loads(str(arrays.pop("meta")))
        if not isinstance(meta, dict) or not isinstance(meta["certificate"], dict):
            raise FileError(f"its description is damaged: {str(meta)[:60]!r}", where="meta")
        version = meta["version"]
        if (kind := meta["format"]) != FORMAT:
            text = f"expected the format {FORMAT!r}, found {kind!r}"
            raise FileError(text, where="format", found=kind, expected=FORMAT)
        if version > VERSION:
            text = f"written by a newer pcmc (format {version}, this one reads up to {VERSION}); update pcmc"
            raise FileError(text, where="version", found=version, expected=VERSION)
        if odd := [name for name in (*meta, *arrays) if name.partition(" ")[0] not in HELD]:
            text = f"written by a pcmc before 0.1.0, with {odd[0]!r}; write the surface again from its source"
            raise FileError(text, where=odd[0])
        metadata = parse_metadata(meta["description"])
        X, F, patch, support = (arrays[key] for key in ("vertices", "faces", "patch_of_face", "support"))
        about: dict[str, Any] = {"support": support, "scalars": _under("scalar ", arrays)}
        about["curves"] = _curves(meta.get("curves", ()), len(X))
        about["certificate"] = {**meta["certificate"], **_under("certificate ", arrays)}
        return metadata.mesh_data(X, F, patch, list(metadata.patches), **about)


def _curves(rows: Any, n: int) -> tuple[HeldCurve, ...]:
    curves = list[HeldCurve]()
    try:
        for one in map(HeldCurve.from_plain, rows):
            V = within(numeric(one.vertices, "vertices", "iu", (None,)), "vertices", n)
            curves.append(replace(one, vertices=V))
    except DAMAGED as error:
        text = f"curve {len(curves)} is damaged: {error}"
        raise FileError(text, what="curves", where=len(curves)) from None
    return tuple(curves)


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
