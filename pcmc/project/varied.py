"""A project with other numbers: in its file, of patches, cables and rooms, and with lines shifted."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from .. import io
from ..base.errors import OptionError, unknown
from ..base.files import PathLike, as_path, read_bytes
from ..forces.rooms import refuse_varied_pressure
from ..surface import Surface
from ..surface.values import KINDS, all_values
from .checking import in_file
from .drawn import files_of, is_drawing
from .file import Project, is_project, project_of, read_data
from .keys import WALL, main_sections, solve_section
from .settings import MeshFile
from .shifts import AXES, shifted
from .start import start_of

CABLE = "cable "  # before the name of a cable, where a patch has the same
NUMERIC = ("a number", "a whole number", WALL)  # kinds of keys
KeyPath = tuple[str | int, ...]
Item = tuple[tuple[str, ...], KeyPath, Any]  # names, path and value of something in a file


class _Source(NamedTuple):
    """A file, read once: its text and data, empty for a surface, and the paths of its numbers by name."""

    path: Path
    text: str
    data: Mapping[str, Any]
    keys: Mapping[str, KeyPath]

    def is_load(self, name: str) -> bool:
        """Whether a name is neither a number of the file nor a shift of a line of its plan."""
        return name not in self.keys and (name.rpartition(".")[2] not in AXES or "plan" not in self.data)


def _source(path: PathLike) -> _Source:
    path = as_path(path)
    text, data = read_data(path) if is_project(path) else ("", {})
    return _Source(path, text, data, numbers(data) if data else {})


def numbers(data: Mapping[str, Any]) -> dict[str, KeyPath]:
    """The numbers of a project: the dotted name of each, and its path in the data.

    Entries of a list are named by their key "name" if they have one, otherwise by their number from 1.
    Numbers that a table of the file may have and has not come last.

    >>> list(numbers({"plan": {"edge": "free", "holes": [{"name": "yard", "cable": 2.0}, [3]]}}))[:3]
    ['plan.holes.yard.cable', 'plan.holes.2.1', 'plan.gap']
    """
    items: list[Item] = list(_items({**data, "solve": data.get("solve", {})}, (), ()))
    given = {".".join(n): p for n, p, v in items if isinstance(v, int | float) and not isinstance(v, bool)}
    method = str(data.get("solve", {}).get("method", "newton"))
    sections = {section.name: section for section in (*main_sections(), solve_section(method))}
    possible: dict[str, KeyPath] = {}
    for names, path, table in items:
        steps = ["NAME" if path[k - 1 : k] in (("patches",), ("rooms",)) else p for k, p in enumerate(path)]
        section = sections.get(".".join(step for step in steps if isinstance(step, str)))
        if section is not None and isinstance(table, Mapping) and not section.is_curve(table):
            known = (key.name for key in section.keys if key.kind in NUMERIC)
            possible |= {".".join((*names, key)): (*path, key) for key in known}
    return given | {name: path for name, path in possible.items() if name not in given}


def _items(value: Any, names: tuple[str, ...], path: KeyPath) -> Iterator[Item]:
    """All that is in a table or list."""
    for key, item in value.items() if isinstance(value, Mapping) else enumerate(value):
        named = item.get("name") if isinstance(item, Mapping) and isinstance(key, int) else None
        own = key if isinstance(key, str) else named if isinstance(named, str) else str(key + 1)
        yield (*names, own), (*path, key), item
        if isinstance(item, Mapping | list):
            yield from _items(item, (*names, own), (*path, key))


def varied(path: PathLike, values: Mapping[str, float]) -> tuple[Project, Surface]:
    """A project with some of its numbers replaced, and its initial surface.

    Parameters
    ----------
    path : of a project (``.toml``), or of a surface, which has no keys.
    values : by the dotted name of a number that the file has or may have, such as ``plan.edge_length``; by
        ``NAME.tension``, ``NAME.pressure``, ``NAME.weight`` and ``NAME.snow`` of a patch or wall,
        ``NAME.tension`` of a cable, ``NAME.volume`` of a room; or by ``NAME.x``, ``NAME.y`` and ``NAME.z`` of
        a divider, a hole, a support or a named point of the plan: all of it is shifted by the value, so 0
        leaves it where it is drawn. Numbers of the file are replaced, and lines are shifted, before the plan
        is meshed, the others afterwards. Where several things have one name, put what is meant before it:
        ``cable NAME.tension``, ``hole NAME.x``. Lines without a name are ``divider 1``, ``wall 1``,
        ``hole 1``, ``support 1``, …

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
    source = _source(path)
    start = start_of(_project(source, values))
    return start.project, _retensioned(source, start.surface, values)


def check_varied(path: PathLike, values: Mapping[str, Sequence[Any]]) -> None:
    """Refuse every name and value that ``varied`` refuses; the file is read once.

    A plan is meshed once for the names of patches, cables and rooms, and not at all without them.
    """
    source = _source(path)
    project = _project(source, {})
    start = start_of(project) if project.mesh is not None else None
    sought = _sought(project if start is None else start.project)
    for name, given in values.items():
        if name in sought:
            text = f"{path}: {name}: the {sought[name]} is found by the search for the targets, so the roof"
            text += " would have another than the sweep's; sweep another number, or take it out of vary"
            raise OptionError(text, what=name, where=sought[name])
        for value in given:
            if isinstance(value, bool | str | None) or not math.isfinite(value):
                text = f"{path}: {name} must be a finite number, found {value!r}"
                raise OptionError(text, what=name, found=value)
            if source.is_load(name):
                start = start or start_of(project)
                _retensioned(source, start.surface, {name: value})
            else:
                _project(source, {name: value})


def _sought(project: Project) -> dict[str, str]:
    """The names of the numbers that the search for targets finds, with what each is."""
    sought: dict[str, str] = {}
    for parameter in project.vary:
        for one in parameter.names:
            bare = one.removeprefix(CABLE) if parameter.kind == "cable" else one
            kind = "tension" if parameter.kind == "cable" else parameter.kind
            table = "mesh" if project.plan is None else "plan"
            names = [f"{bare}.{kind}", f"{CABLE}{bare}.{kind}", f"{table}.patches.{bare}.{kind}"]
            if project.plan is None or not project.plan.patches:
                names.append(f"{table}.{kind}")
            sought |= dict.fromkeys(names, parameter.label)
    return sought


def digest(path: PathLike) -> str:
    """SHA-256, hexadecimal, of a project file with its drawing, or of the surface that any other file holds.

    A surface may be spread over several files (a ``.gltf`` has buffers), so its data are hashed.
    """
    if is_project(path):
        sha = hashlib.sha256(read_data(Path(path))[0].encode())
        for drawing in files_of(path)[0 if is_drawing(Path(path)) else 1 :]:
            sha.update(read_bytes(drawing))
        return sha.hexdigest()
    surface = io.read_bare(path)[0]
    about = [list(map(vars, surface.patches)), surface.plane, surface.rooms]
    sha = hashlib.sha256(repr(about).encode())
    for name in ("vertices", "faces", "patch_of_face", "fixed", "on_plane"):
        sha.update(getattr(surface, name).tobytes())
    sha.update(repr([curve.plain() for curve in surface.curves]).encode() if surface.curves else b"")
    for cable in surface.cables:
        sha.update(repr((cable.name, cable.tension)).encode() + cable.edges.tobytes())
    for held, on in (*surface.on_planes, *surface.given_supports.on_line):
        sha.update(repr(vars(held)).encode() + on.tobytes())
    return sha.hexdigest()


def _project(source: _Source, values: Mapping[str, float]) -> Project:
    """The project with other numbers and shifted lines; loads are ignored."""
    if not source.data:
        return Project(source.path, mesh=MeshFile(source.path.name))
    data: Any = deepcopy(source.data)
    shifts: dict[str, dict[str, float]] = {}
    for name, value in values.items():
        stem, _, last = name.rpartition(".")
        if name in source.keys:
            table = data
            for step in source.keys[name][:-1]:
                table = table.setdefault(step, {}) if isinstance(step, str) else table[step]
            table[source.keys[name][-1]] = value
        elif not source.is_load(name):
            shifts.setdefault(stem, {})[last] = value
    return project_of(source.path, data, source.text, partial(shifted, shifts=shifts))


def _retensioned(source: _Source, surface: Surface, values: Mapping[str, float]) -> Surface:
    """The surface with other tensions and pressures; numbers of the file and shifts are ignored."""
    known = _names(surface)
    given: dict[str, dict[str, float]] = {kind: {} for kind in KINDS}
    for name in filter(source.is_load, values):
        if name not in known:
            # no coordinates, and patches have shorter names
            keys = [k for k, at in source.keys.items() if isinstance(at[-1], str) and at[1] != "patches"]
            near = get_close_matches(name, source.keys, n=1, cutoff=0.8)  # a coordinate, perhaps
            names = tuple(dict.fromkeys([*known, *keys, *near]))
            text = f"{source.path}: {unknown('number', name, names)}"
            raise OptionError(text, what=name, expected=names)
        kind, part = known[name]
        given[kind][part] = values[name]
    with in_file(source.path, OptionError):
        refuse_varied_pressure(surface, map(surface.patch_index, given["pressures"]))
        return surface.retensioned(**given)


def _names(surface: Surface) -> dict[str, tuple[str, str]]:
    """The names of what may vary besides numbers of the file: the kind of each, and its patch, cable or
    room."""
    values = reversed(
        all_values(surface).items()
    )  # where a patch and a cable share a name, the patch comes last
    names = {f"{name}.{KINDS[kind][1]}": (kind, name) for kind, named in values for name in named}
    return {f"{CABLE}{cable.name}.tension": ("cables", cable.name) for cable in surface.cables} | names
