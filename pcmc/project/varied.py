"""A project with other numbers: tensions and pressures by patch, all else by its key in the file."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from .. import io
from ..base.errors import OptionError, PcmcError, unknown
from ..surface import Surface
from ..surface.wall_pressures import with_pressures
from .file import PathLike, Project, project_of, read_data, surface_of

WHAT = ("tension", "pressure")
Way = tuple[str | int, ...]


def numbers(data: Mapping[str, Any]) -> dict[str, Way]:
    """The keys of a project that hold a number, by dotted name, and the way to each.

    Entries of a list go by their name where they have one, else by their number from 1.

    >>> list(numbers({"plan": {"rise": 1, "edge": "free", "holes": [{"name": "yard", "r": 2.0}, [3]]}}))
    ['plan.rise', 'plan.holes.yard.r', 'plan.holes.2.1']
    """
    return {".".join(names): way for names, way in _leaves(data, (), ())}


def _leaves(value: Any, names: tuple[str, ...], way: Way) -> Iterator[tuple[tuple[str, ...], Way]]:
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _leaves(item, (*names, key), (*way, key))
    elif isinstance(value, list):
        for place, item in enumerate(value):
            named = item.get("name") if isinstance(item, Mapping) else None
            name = named if isinstance(named, str) else str(place + 1)
            yield from _leaves(item, (*names, name), (*way, place))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield names, way


def varied(path: PathLike, values: Mapping[str, float]) -> tuple[Project, Surface]:
    """A project with some of its numbers replaced, and the surface that it starts from.

    Parameters
    ----------
    path : of a project (``.toml``), or of a surface, which has no keys.
    values : by ``NAME.tension`` and ``NAME.pressure`` of a patch or wall, or by the dotted name of a
        number in the file, such as ``plan.edge_length``. These are replaced before the plan is meshed,
        tensions and pressures afterwards.

    Raises
    ------
    FileError, PlanError, OptionError : as of ``load`` and ``build``; for a name that is none of these.

    Examples
    --------
    >>> project, surface = varied("notebooks/roof.toml", {"plan.edge_length": 2, "corner.tension": 9})
    >>> project.plan.edge_length, surface.patches[0].tension
    (2, 9.0)
    """
    path = Path(path)
    project = _project(path, values)
    return project, _retensioned(path, surface_of(project), values)


def check_varied(path: PathLike, values: Mapping[str, Sequence[Any]]) -> None:
    """Refuse every name and value that ``varied`` would, the nearest name said; meshes the plan once."""
    path = Path(path)
    surface = surface_of(_project(path, {}))
    keys = numbers(_data(path))
    known = [f"{patch.name}.{what}" for what in WHAT for patch in surface.patches]
    for name, given in values.items():
        if name not in keys and name not in known:
            shown = known + [k for k, way in keys.items() if _listed(way)]
            near = get_close_matches(name, keys, n=1, cutoff=0.8)  # a coordinate, perhaps
            raise OptionError(f"{path}: {unknown('number', name, dict.fromkeys(shown + near))}")
        for value in given:
            if isinstance(value, bool | str | None) or not math.isfinite(value):
                raise OptionError(f"{path}: {name} must be a finite number, found {value!r}")
            _project(path, {name: value})
            _retensioned(path, surface, {name: value})


def digest(path: PathLike) -> str:
    """SHA-256 of a project file, or of the surface in any other, hexadecimal.

    A project reads no other file. A surface may (a ``.gltf`` its buffers), so what was read counts.
    """
    if is_project(path):
        return hashlib.sha256(read_data(Path(path))[0].encode()).hexdigest()
    surface = io.read(path)
    told = hashlib.sha256(repr((surface.patches, surface.plane)).encode())
    for name in ("vertices", "faces", "patch_of_face", "fixed", "on_plane"):
        told.update(getattr(surface, name).tobytes())
    return told.hexdigest()


def is_project(path: PathLike) -> bool:
    """Whether a file is a project by its name; all others hold a surface."""
    return Path(path).suffix.lower() == ".toml"


def _listed(way: Way) -> bool:
    """Whether a key is among those shown: coordinates are too many, patches go by their names."""
    return isinstance(way[-1], str) and way[1] != "patches"


def _data(path: Path) -> dict[str, Any]:
    return read_data(path)[1] if is_project(path) else {}


def _project(path: Path, values: Mapping[str, float]) -> Project:
    """The project with other numbers; values that are not of the file are passed over."""
    if not is_project(path):
        return Project(path)
    data: Any = _data(path)
    for name, way in numbers(data).items():
        if name in values:
            place = data
            for step in way[:-1]:
                place = place[step]
            place[way[-1]] = values[name]
    return project_of(path, data)


def _retensioned(path: Path, surface: Surface, values: Mapping[str, float]) -> Surface:
    """The surface with other tensions and pressures; values of the file are passed over."""
    keys = numbers(_data(path))
    given: dict[str, dict[str, float]] = {what: {} for what in WHAT}
    for name in values.keys() - keys.keys():
        patch, _, what = name.rpartition(".")
        if what not in given:
            raise OptionError(f"{path}: {unknown('number', name, keys)}")
        given[what][patch] = values[name]
    try:
        return with_pressures(surface, given["tension"], given["pressure"])
    except PcmcError as error:
        raise OptionError(f"{path}: {error}") from None
