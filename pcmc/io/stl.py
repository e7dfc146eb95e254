"""STL (.stl): written as text with one solid per patch, read in either form: only triangles and names.

Programs read the coordinates in single precision. So a surface far from the origin is written about its
middle, which the format has no place for.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ..base.arrays import format_rows
from ..base.errors import FileError
from ..base.libraries import load_library, translated_errors
from ..surface import Surface
from ..surface.geometry import area_vectors, file_origin
from .formats import Content
from .mesh_data import MeshData
from .metadata import Metadata, from_scene

SPECIAL = re.compile("solid|vertex", re.I)  # readers look for these words, in names too
FACET = (
    "facet normal %.6g %.6g %.6g\nouter loop\nvertex %.9g %.9g %.9g\nvertex %.9g %.9g %.9g\n"
    "vertex %.9g %.9g %.9g\nendloop\nendfacet\n"
)


def write(path: Path, surface: Surface, _: Content) -> str:
    """Coordinates with nine digits, more than readers of STL keep; returns a note if they are shifted."""
    middle = file_origin(surface.vertices, surface.size)
    moved = bool(middle.any())
    middle[np.abs(middle) <= surface.size] = 0.0  # heights stay what they are
    P = surface.vertices[surface.faces] - middle
    normal = area_vectors(P)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    lines = np.concatenate([normal, P.reshape(-1, 9)], axis=1)
    for patch in surface.patches:
        if word := SPECIAL.search(patch.name):
            text = f"the patch name {patch.name!r} has the word {word[0]!r} of the format; rename the patch"
            raise FileError(text, where="patches", found=patch.name)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        for k, patch in enumerate(surface.patches):
            chosen = lines[surface.patch_of_face == k]
            if len(chosen):
                file.write(f"solid {patch.name}\n{format_rows(FACET, *chosen.T)}endsolid {patch.name}\n")
    text = f"its coordinates are relative to {[int(c) for c in middle]}, because .stl keeps seven digits; add"
    text += " this point where you read the file, or write .obj or .3dm, which keep all digits"
    return text if moved else ""


def read(path: Path) -> MeshData:
    """Solids as patches. Text must end with ``endsolid``, binary must have all its triangles."""
    trimesh, data = load_library("trimesh"), path.read_bytes()
    if data[:5] == b"solid" and b"facet" in data[:2000]:
        lines = data.rstrip().split(b"\n")
        last = lines[-1].decode().strip()[:40]
        if odd := re.search(rb"^\s*vertex[^\n]*_[^\n]*", data, re.M):
            line = 1 + data[: odd.start()].count(b"\n")
            text = f"line {line}: expected three coordinates, found {odd[0].decode().strip()[:60]!r}"
            raise FileError(text, where=line)
        if not last.startswith("endsolid"):
            text = f"line {len(lines)}: cut off before 'endsolid', found {last!r}"
            raise FileError(text, where=len(lines))
    else:
        count = int.from_bytes(data[80:84], "little")
        if len(data) < (size := 84 + 50 * count):
            found = f"{count} triangles need {size} bytes, found {len(data)}"
            raise FileError(f"not an STL file, or cut off: {found}", where=count)
    with translated_errors("STL"):
        scene = trimesh.load_scene(path, file_type="stl", process=False)
    return from_scene(scene, path.stem, Metadata())
