"""A project with other numbers: those of patches, cables and rooms by name, all others by their key."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from .. import io
from ..base.errors import OptionError, unknown
from ..energy.rooms import refuse_varied_pressure
from ..surface import Surface
from ..surface.renewed import KINDS
from ..surface.wall_pressures import with_pressures
from .drawn import files_of, is_drawing
from .file import PathLike, Project, in_file, is_project, load, project_of, read_data
from .start import surface_of

QUANTITIES = ("tension", "pressure", "weight", "snow")  # of a patch
CABLE = "cable "  # before the name of a cable, where a patch has the same
KeyPath = tuple[str | int, ...]


def numbers(data: Mapping[str, Any]) -> dict[str, KeyPath]:
    """The numbers of a project: the dotted name of each, and its path in the data.

    Entries of a list are named by their key "name" if they have one, otherwise by their number from 1.

    >>> list(numbers({"plan": {"rise": 1, "edge": "free", "holes": [{"name": "yard", "r": 2.0}, [3]]}}))
    ['plan.rise', 'plan.holes.yard.r', 'plan.holes.2.1']
    """
    return {".".join(names): path for names, path in _leaves(data, (), ())}


def _leaves(value: Any, names: tuple[str, ...], path: KeyPath) -> Iterator[tuple[tuple[str, ...], KeyPath]]:
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _leaves(item, (*names, key), (*path, key))
    elif isinstance(value, list):
        for place, item in enumerate(value):
            named = item.get("name") if isinstance(item, Mapping) else None
            name = named if isinstance(named, str) else str(place + 1)
            yield from _leaves(item, (*names, name), (*path, place))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield names, path


def varied(path: PathLike, values: Mapping[str, float]) -> tuple[Project, Surface]:
    """A project with some of its numbers replaced, and its initial surface.

    Parameters
    ----------
    path : of a project (``.toml``), or of a surface, which has no keys.
    values : by ``NAME.tension``, ``NAME.pressure``, ``NAME.weight`` and ``NAME.snow`` of a patch or wall, by
        ``NAME.tension`` of a cable, ``NAME.volume`` of a room, or by the dotted name of a number in the file,
        such as ``plan.edge_length``. Numbers of the file are replaced before the plan is meshed, those of
        patches, cables and rooms afterwards. For a cable with the name of a patch write
        ``cable NAME.tension``.

    Raises
    ------
    FileError, PlanError, OptionError
        As in ``load`` and ``build``; for an unknown name.

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
    """Refuse every name and value that ``varied`` refuses; the plan is meshed only once."""
    path = Path(path)
    surface = surface_of(_project(path, {}))
    keys = numbers(_data(path))
    known = list(_names(surface))
    _check_not_sought(path, values)
    for name, given in values.items():
        if name not in keys and name not in known:
            # no coordinates, and patches have shorter names
            shown = known + [k for k, at in keys.items() if isinstance(at[-1], str) and at[1] != "patches"]
            near = get_close_matches(name, keys, n=1, cutoff=0.8)  # a coordinate, perhaps
            raise _unknown_number(path, name, shown + near)
        for value in given:
            if isinstance(value, bool | str | None) or not math.isfinite(value):
                text = f"{path}: {name} must be a finite number, found {value!r}"
                raise OptionError(text, what=name, found=value)
            _project(path, {name: value})
            _retensioned(path, surface, {name: value})


def _check_not_sought(path: Path, values: Iterable[str]) -> None:
    """Refuse values that the search for targets replaces by those that it finds."""
    project = _project(path, {})
    sought: dict[str, str] = {}
    for parameter in project.vary:
        for one in parameter.names:
            bare = one.removeprefix(CABLE) if parameter.kind == "cable" else one
            kind = "tension" if parameter.kind == "cable" else parameter.kind
            names = [f"{bare}.{kind}", f"{CABLE}{bare}.{kind}", f"plan.patches.{bare}.{kind}"]
            if project.plan is not None and not project.plan.patches:
                names.append(f"plan.{kind}")
            sought |= dict.fromkeys(names, parameter.label)
    for name in values:
        if name in sought:
            text = f"{path}: {name}: the {sought[name]} is found by the search for the targets, so the roof"
            text += " would have another than the sweep's; sweep another number, or take it out of vary"
            raise OptionError(text, what=name, where=sought[name])


def digest(path: PathLike) -> str:
    """SHA-256, hexadecimal, of a project file with its drawing, or of the surface that any other file holds.

    A surface may be spread over several files (a ``.gltf`` has buffers), so its data are hashed.
    """
    if is_project(path):
        sha = hashlib.sha256(read_data(Path(path))[0].encode())
        for drawing in files_of(path)[0 if is_drawing(Path(path)) else 1 :]:
            sha.update(drawing.read_bytes())
        return sha.hexdigest()
    surface = io.read_bare(path)[0]
    sha = hashlib.sha256(repr((surface.patches, surface.plane)).encode())
    for name in ("vertices", "faces", "patch_of_face", "fixed", "on_plane"):
        sha.update(getattr(surface, name).tobytes())
    for cable in surface.cables:
        sha.update(repr((cable.name, cable.tension)).encode() + cable.edges.tobytes())
    for plane, on in surface.on_planes:
        sha.update(repr((plane, plane.name, plane.mirror)).encode() + on.tobytes())
    if surface.rooms or surface.weights.any():
        sha.update(repr((surface.rooms, surface.weights.tolist())).encode())
    if surface.snows.any():
        sha.update(repr(("snow", surface.snows.tolist())).encode())
    return sha.hexdigest()


def _unknown_number(path: Path, name: str, known: Iterable[str]) -> OptionError:
    names = tuple(dict.fromkeys(known))
    return OptionError(f"{path}: {unknown('number', name, names)}", what=name, expected=names)


def _data(path: Path) -> dict[str, Any]:
    return read_data(path)[1] if is_project(path) else {}


def _project(path: Path, values: Mapping[str, float]) -> Project:
    """The project with other numbers; names that are not in the file are ignored."""
    if not is_project(path):
        return load(path)
    text, data = read_data(path)
    for name, place in numbers(data).items():
        if name in values:
            table: Any = data
            for step in place[:-1]:
                table = table[step]
            table[place[-1]] = values[name]
    return project_of(path, data, text)


def _retensioned(path: Path, surface: Surface, values: Mapping[str, float]) -> Surface:
    """The surface with other tensions and pressures; names that are in the file are ignored."""
    keys, known = numbers(_data(path)), _names(surface)
    given: dict[str, dict[str, float]] = {kind: {} for kind in KINDS}
    for name in values.keys() - keys.keys():
        if name not in known:
            raise _unknown_number(path, name, known)
        kind, part = known[name]
        given[kind][part] = values[name]
    with in_file(path, OptionError):
        refuse_varied_pressure(surface, map(surface.patch_index, given["pressures"]))
        return with_pressures(surface, **given)


def _names(surface: Surface) -> dict[str, tuple[str, str]]:
    """The names of what may vary besides numbers of the file: the kind of each, and its patch, cable or
    room."""
    patches = [patch.name for patch in surface.patches]
    names = {f"{name}.{what}": (f"{what}s", name) for what in QUANTITIES for name in patches}
    names |= {f"{room.name}.volume": ("volumes", room.name) for room in surface.rooms}
    cables = [cable.name for cable in surface.cables]
    short = {f"{name}.tension": ("cables", name) for name in cables}
    return {f"{CABLE}{name}.tension": ("cables", name) for name in cables} | short | names
