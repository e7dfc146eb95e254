"""Surfaces from files, with warnings about meshes of other programs: open seams, patches turned against each
other or a wrong axis up can be solved, but probably give another roof than the one drawn."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..base.errors import FileError, FileWarning, MissingExtra, OptionError, PcmcError, SurfaceError
from ..base.files import PathLike, as_path, check_regular, system_error
from ..base.libraries import unreadable
from ..base.units import MICROMETRES, Units
from ..base.validate import choice, refuse
from ..surface import Plane, Surface
from ..surface.geometry import area_vectors, segment_lengths
from ..surface.topology import topology
from .formats import FORMATS, READ_ONLY, Format, format_of
from .mesh_data import MeshData, checked_data, converted, merged, to_surface, without_unused
from .metadata import restore_walls, with_parts

GAP = 0.05  # of the boundary edges next to it: closer vertices are one, drawn twice
FACES_ONE_WAY = 0.5  # part of the area: then it is a roof, and not a column or a ball
FACES_UP = 1e-2  # part of the projected area: less, and another axis is up
FLAT = 0.5  # smallest spread of the boundary over the next: below, it has a plane
UPRIGHT = 0.9  # of the normal of that plane along x or y: more, and another axis is up


def read(
    path: PathLike,
    *,
    tensions: Mapping[str, float] | float | None = None,
    pressures: Mapping[str, float] | float | None = None,
    fixed: npt.ArrayLike | str | None = None,
    on_plane: npt.ArrayLike | None = None,
    plane: Plane | None = None,
    units: str = "m",
) -> Surface:
    """The Surface in a file, read as its suffix says.

    Parameters
    ----------
    path : the file; ``pcmc.io.FORMATS`` lists the suffixes.
    tensions, pressures : by patch name, or one number for all, in place of the file's, or of 1.
    fixed, on_plane : as in Surface, in place of the file's; ``fixed="boundary"`` fixes all boundary
        vertices, and is the default for formats without supports.
    plane : Π in place of the file's, or of z = 0.
    units : the unit of length of the Surface, to which coordinates, tensions and pressures of the file are
        converted; the numbers of a file without a unit stay. A Surface has no unit: give it to ``write``.

    Warns
    -----
    FileWarning : once, with all that was changed (another unit, polygons cut into triangles, unused
        vertices left out, ...) and all probable mistakes in a mesh from another program.

    Raises
    ------
    FileError : for a file that is missing, cut off or not of its format; ``where`` is the line or element.
    SurfaceError : for a mesh that is not a surface.
    MissingExtra, OptionError : for a library that is not installed, and an unknown unit.

    Examples
    --------
    A mesh in millimetres with a patch of one triangle:

    >>> import tempfile, warnings
    >>> folder = tempfile.TemporaryDirectory()
    >>> path = Path(folder.name, "flat.obj")
    >>> _ = path.write_text("v 0 0 0\\nv 1000 0 0\\nv 0 1000 0\\ng roof\\nf 1 2 3\\n", encoding="utf-8")
    >>> surface = read(path, tensions={"roof": 2.0}, pressures=0.0, fixed=[0, 1])
    >>> surface.patches[0], surface.fixed.tolist()
    (Patch(name='roof', tension=2.0, pressure=0.0), [True, True, False])
    >>> folder.cleanup()
    """
    choice("units", units, tuple(MICROMETRES))
    if not isinstance(plane, Plane | None):
        refuse("plane", plane, "a Plane or None")
    return _surface(path, converted(load(path), units), (tensions, pressures, fixed, on_plane, plane))


def read_bare(path: PathLike, units: str = "", assumed: str = "") -> tuple[Surface, MeshData]:
    """The Surface in a file and all its data; a note if it lacks supports, tensions or a unit.

    ``units`` is the unit of length wanted, by default the file's own; ``assumed`` that of a file without one;
    OptionError for a file that has another.

    >>> import tempfile
    >>> from pcmc import Patch, write
    >>> film = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("film", 2.0)], fixed=[0])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write(Path(folder, "film.pcmc"), film, units="m")
    ...     surface, data = read_bare(Path(folder, "film.pcmc"))
    >>> surface.patches, data.units.length
    ((Patch(name='film', tension=2.0, pressure=1.0),), 'm')
    """
    data = load(path)
    if assumed and data.units.length not in ("", assumed):
        text = f"units: {os.fspath(path)} is in {data.units.length} itself, not in {assumed}; leave units out"
        raise OptionError(text, what="units", found=assumed, expected=data.units.length)
    data = converted(data, units, assumed or units)
    return _surface(path, data, ()), data


def _surface(path: PathLike, data: MeshData, given: tuple[Any, ...]) -> Surface:
    """The Surface of a file's data; warns of all that was changed."""
    try:
        surface = to_surface(data, *given)
    except PcmcError as error:
        raised = error.in_file(path)
        if isinstance(error, SurfaceError):
            raised.args = (f"{raised}; or try: pcmc repair {os.fspath(path)} -o clean.obj",)
        raise raised from None
    notes = [*data.notes, *import_warnings(data, path)]
    if not given:
        some = f" of {', '.join(map(repr, data.bare))}" if len(data.bare) < len(data.patches) else ""
        hints = {
            "no supports in the file: its boundary is taken as fixed": data.support is None,
            f"tensions and pressures{some} are 1 unless given": data.bare,
            "no unit of length in the file; name it with --units mm, say": data.bare and not data.units,
        }
        notes += [text for text, true in hints.items() if true]
    if notes:
        warnings.warn(f"{os.fspath(path)}: {'; '.join(notes)}", FileWarning, stacklevel=3)
    return surface


def load(path: PathLike) -> MeshData:
    """Everything in a file, scalars and certificate too. Errors as in ``read``.

    >>> import tempfile
    >>> from pcmc import Patch, write
    >>> film = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("film", 2.0)], fixed=[0])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write(Path(folder, "film.pcmc"), film, scalars={"height": film.vertices[:, 2]}, units="m")
    ...     data = load(Path(folder, "film.pcmc"))
    >>> data.scalars["height"].tolist(), data.units.length
    ([0.0, 0.0, 0.0], 'm')
    """
    path = as_path(path)
    with format_opened(path) as form:
        data = without_unused(checked_data(contents(form, path)))
        return with_parts(data if form.shared else restore_walls(merged(data)))


def contents(form: Format, path: Path) -> MeshData:
    """What the reader of a format finds in a file, in the unit that the format prescribes."""
    data: MeshData = form.functions.read(path)
    return replace(data, units=Units(form.unit, data.units.force)) if form.unit else data


@contextmanager
def format_opened(path: Path) -> Iterator[Format]:
    """The format of a file that is read in the block; what goes wrong there is a FileError with its name."""
    check_regular(path)
    form = format_of(path, {**FORMATS, **READ_ONLY})
    if not form.reads:
        text = f"{path}: pcmc writes {path.suffix} files and does not read them; read the surface's .pcmc"
        raise FileError(f"{text} file", what=str(path), found=path.suffix)
    try:
        path.open("rb").close()  # the libraries' errors for a missing file differ
        yield form
    except OSError as error:
        raise system_error(path, "read", error) from None
    except UnicodeDecodeError as error:
        text = f"{path}: byte {error.start} is not text; is it a {path.suffix} file?"
        raise FileError(text, what=str(path), where=error.start) from None
    except PcmcError as error:
        raise error.in_file(path, FileError, str(path)) from None
    except MissingExtra:
        raise
    except Exception as error:  # the net under the readers: a file may be wrong in a way that none checks
        raise unreadable(path.suffix, error).in_file(path, FileError, str(path)) from error


def import_warnings(data: MeshData, path: PathLike = "FILE") -> tuple[str, ...]:
    """A sentence for each probable mistake in the file ``path``; none where the format has supports.

    >>> from pcmc import Patch
    >>> X = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    >>> pair = MeshData(X, np.array([[0, 1, 2], [0, 3, 2]]), np.array([0, 1]), (Patch("a", 1), Patch("b", 1)))
    >>> import_warnings(pair)[0].split(":")[0]
    "patches 'a' and 'b' are turned against each other"
    """
    if data.support is not None or not len(data.faces):
        return ()
    topo = topology(data.faces, data.patch_of_face, len(data.vertices))
    outer = topo.edges[topo.boundary_edge]
    opposed, wrong = "", np.flatnonzero(topo.one_way_edge & topo.seam_edge)
    if len(wrong):
        faces = np.flatnonzero((topo.edge_of_face == wrong[0]).any(axis=1))
        a, b = (data.patches[k].name for k in data.patch_of_face[faces])
        opposed = f"patches {a!r} and {b!r} are turned against each other: their pressures act to opposite"
        opposed += " sides; unless you want that, reverse the faces of one"
    seam, turned = _open_seam(data.vertices, outer), _turned(data, outer, os.fspath(path))
    return tuple(filter(None, (seam, opposed, turned)))


def _open_seam(X: Floats, outer: Ints) -> str:
    if not len(outer):
        return ""
    rim, beside = np.unique(outer), np.full(len(X), np.inf)
    np.minimum.at(beside, outer.ravel(), np.repeat(segment_lengths(X, outer), 2))
    apart, near = (np.asarray(found)[:, 1] for found in cKDTree(X[rim]).query(X[rim], k=2))
    close = apart < GAP * np.minimum(beside[rim], beside[rim[near]])
    if not close.any():
        return ""
    far, place = f"{apart[close].max():.2g}", X[rim[close][0]].round(4).tolist()
    text = f"a seam is open: {np.count_nonzero(close)} boundary vertices are within {far} of another one, the"
    return f"{text} first at {place}; join them in the program that drew the mesh, or with pcmc repair --weld"


def _turned(data: MeshData, outer: Ints, path: str) -> str:
    """A sentence where x or y was up, by the sum of area vectors and the best plane of the boundary, or where
    most triangles of a roof look down."""
    vectors = area_vectors(data.vertices[data.faces])
    total, area = vectors.sum(axis=0), float(np.linalg.norm(vectors, axis=1).sum())
    size, rim, across = float(np.linalg.norm(total)), data.vertices[np.unique(outer)], np.zeros(3)
    if size > FACES_ONE_WAY * area and abs(total[2]) <= FACES_UP * size:
        across = np.abs(total)
    elif len(rim) >= 3:
        _, spread, axes = np.linalg.svd(rim - rim.mean(axis=0), full_matrices=False)
        if spread[2] < FLAT * spread[1] and np.abs(axes[2, :2]).max() > UPRIGHT:
            across = np.abs(axes[2])
    if across.any():
        axis = "xy"[int(across[:2].argmax())]
        turn = f"the surface faces {axis}, but z is up here; if {axis} was up, turn it: pcmc repair"
        return f"{turn} {path} -o turned.obj --up {axis}"
    if -total[2] <= FACES_ONE_WAY * area:
        return ""
    turn = f"turn them: pcmc repair {path} -o turned.obj"
    return f"the triangles face down, so a pressure above 0 pushes the roof down; if it is to rise, {turn}"
