"""Surfaces from files and to files, by suffix."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.arrays import Floats
from ..base.errors import FileError, FileWarning, LostWarning, PcmcError, unknown
from ..base.files import atomic_write
from ..contact.pinching import standing_part
from ..surface import Plane, Surface
from .contents import Contents, merged, to_surface, without_unused
from .suspect import suspicions

FORMATS = {
    ".pcmc": "native",
    ".fe": "evolver",
    ".dmp": "evolver",
    ".obj": "obj",
    ".ply": "ply",
    ".stl": "stl",
    ".vtp": "vtk",
    ".vtu": "vtk",
    ".glb": "gltf",
    ".gltf": "gltf",
    ".3dm": "rhino",
}
"""Suffix and the module here that reads and writes it."""

BARE = (
    "it tells of no supports: its boundary is held, and tensions and pressures are 1 where none are"
    " given"
)


def read(
    path: str | os.PathLike[str],
    *,
    tensions: Mapping[str, float] | float | None = None,
    pressures: Mapping[str, float] | float | None = None,
    fixed: npt.ArrayLike | str | None = None,
    on_plane: npt.ArrayLike | None = None,
    plane: Plane | None = None,
) -> Surface:
    """The Surface in a file, read as its suffix says.

    Parameters
    ----------
    path : the file; ``pcmc.io.FORMATS`` lists the suffixes.
    tensions, pressures : by patch name, or one number for all, in place of the file's. Formats that
        carry neither give 1 for both.
    fixed, on_plane : as in Surface, in place of the file's; ``fixed="boundary"`` holds all boundary
        vertices, and is what happens where the format carries no supports.
    plane : Π in place of the file's, or the plane z = 0 where it has none.

    Warns
    -----
    FileWarning : once, saying what was changed (polygons cut into triangles, unused vertices left
        out, ...), and what is probably not meant in a mesh from another program (a seam left open,
        patches turned against each other, an axis up that is not z).

    Raises
    ------
    FileError : in one line, naming file and line or element, for a file that is missing, cut off,
        not of its suffix's format, or not a surface.
    MissingExtra : when the format needs a library that is not installed.
    """
    return _read(path, load(path), (tensions, pressures, fixed, on_plane, plane), ())


def read_bare(path: str | os.PathLike[str]) -> Surface:
    """``read``, for who has not said what a file lacks: that it tells of no supports is warned of too."""
    contents = load(path)
    return _read(path, contents, (), (BARE,) if contents.support is None else ())


def _read(
    path: str | os.PathLike[str], contents: Contents, given: tuple[Any, ...], notes: tuple[str, ...]
) -> Surface:
    try:
        surface = to_surface(contents, *given)
    except PcmcError as error:
        raise type(error)(f"{os.fspath(path)}: {error}") from None
    notes = (*contents.notes, *suspicions(contents), *notes)
    if notes:
        warnings.warn(f"{os.fspath(path)}: {'; '.join(notes)}", FileWarning, stacklevel=3)
    return surface


def load(path: str | os.PathLike[str]) -> Contents:
    """All that a file holds, scalars and certificate too; see Contents. Errors as in ``read``."""
    path = Path(path)
    module = _module(path)
    try:
        with path.open("rb"):
            pass
        contents = without_unused(module.read(path))
        if not getattr(module, "MERGE", False):
            return contents
        contents = merged(contents)
        if contents.walls is not None:
            from .flat import with_walls  # needs scipy.spatial, as merging does

            contents = with_walls(contents)
        return contents
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror or error})") from None
    except UnicodeDecodeError as error:
        raise FileError(
            f"{path}: byte {error.start} is not text; is it a {path.suffix} file?"
        ) from None
    except PcmcError as error:
        raise _located(path, error) from None


def write(
    path: str | os.PathLike[str],
    surface: Surface,
    *,
    scalars: Mapping[str, Floats] | None = None,
    certificate: object | None = None,
) -> None:
    """Write a surface as the suffix says; the file appears whole or not at all.

    A wall below a junction that rests on Π has triangles without area. Formats that write every patch
    apart (.stl, .glb, .gltf, .3dm) show the surface as it stands, without them; .glb, .gltf and .3dm say
    beside it how those walls are, which ``read`` puts back. From .stl, and where the surface was changed
    in between, the junction comes back sliding on Π.

    Parameters
    ----------
    path : the file; ``pcmc.io.FORMATS`` lists the suffixes.
    scalars : (n,) or (m,) arrays by name (curvature, error, ...), kept where the format can.
    certificate : a Certificate, or values by name, kept where the format can (.pcmc).

    Warns
    -----
    LostWarning : once, naming what the format cannot carry.
    FileWarning : where coordinates are written relative to another origin (.stl).
    """
    path = Path(path)
    module = _module(path)
    broken = [p.name for p in surface.patches if "\n" in p.name or "\r" in p.name]
    if broken:
        raise FileError(f"{path}: the patch name {broken[0]!r} has a line break in it; rename it")
    scalars = {name: _scalar(surface, name, value) for name, value in (scalars or {}).items()}
    kept = (getattr(module, "SCALARS", False), getattr(module, "FACE_SCALARS", True))
    lost = [k for k, v in scalars.items() if not (kept[0] and (kept[1] or len(v) == surface.n))]
    if certificate is not None and not getattr(module, "CERTIFICATE", False):
        lost.append("certificate")
    told = None
    if getattr(module, "APART", False):
        shown = standing_part(surface).surface
        if shown.m < surface.m and getattr(module, "WALLS", False):
            from .flat import walls_told

            told = walls_told(surface, shown)
        elif shown.m < surface.m:
            lost.append(f"{surface.m - shown.m} triangles of walls without height")
        surface = shown
    try:
        with atomic_write(path) as temporary:
            moved = module.write(
                temporary, surface, scalars=scalars, certificate=_values(certificate), walls=told
            )
    except OSError as error:
        raise FileError(f"{path}: cannot be written ({error.strerror or error})") from None
    except PcmcError as error:
        raise _located(path, error) from None
    if lost:
        lost += getattr(module, "NEVER", ())
        text = f"{path}: a {path.suffix} file cannot carry {', '.join(lost)}; left out"
        warnings.warn(text, LostWarning, stacklevel=2)
    if moved:
        warnings.warn(f"{path}: {moved}", FileWarning, stacklevel=2)


def _located(path: Path, error: PcmcError) -> FileError:
    """The error with the file's name in front."""
    text = str(error)
    return FileError(text if text.startswith(str(path)) else f"{path}: {text}")


def _module(path: Path) -> ModuleType:
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise FileError(f"{path}: {unknown('suffix', suffix, FORMATS)}")
    return import_module(f".{FORMATS[suffix]}", __name__)


def _values(certificate: Any) -> Mapping[str, Any]:
    """The certificate's public values by name."""
    if certificate is None or isinstance(certificate, Mapping):
        return certificate or {}
    if not is_dataclass(certificate):
        raise FileError(f"certificate: expected a Certificate, found {type(certificate).__name__}")
    shown = [f.name for f in fields(certificate) if f.repr and not f.name.startswith("_")]
    return {name: getattr(certificate, name) for name in shown}


def _scalar(surface: Surface, name: str, value: npt.ArrayLike) -> Floats:
    array = np.asarray(value, dtype=float)
    if array.shape not in ((surface.n,), (surface.m,)):
        raise FileError(
            f"scalars[{name!r}]: expected shape ({surface.n},) for vertices or ({surface.m},) for"
            f" faces, found {array.shape}"
        )
    return array
