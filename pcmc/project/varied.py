"""A project with other numbers: in its file, of patches, cables and rooms, and with lines shifted."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import replace
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import io
from ..base.arrays import Floats
from ..base.errors import OptionError, unknown
from ..base.files import PathLike, as_path, read_bytes
from ..base.units import Units
from ..certificate.quantities import dimension_of
from ..forces.rooms import refuse_varied_pressure
from ..plan import Curve, Divider, Hole, Plan
from ..surface import Plane, Surface
from ..surface.surface import FIELDS
from ..surface.values import KINDS, all_values, sheets_below
from .cache import plain_bytes
from .checking import in_file
from .drawn import files_of
from .file import Project, is_project, project_of, read_data
from .keys import WALL, main_sections, solve_section
from .settings import MeshFile
from .start import start_of

AXES = ("x", "y", "z")
CABLE = "cable "  # before the name of a cable, where a patch has the same
LATER = ("structure", "pattern", "output")  # sections that no shape depends on
NUMERIC = ("a number", "a whole number", WALL)  # kinds of keys
KeyPath = tuple[str | int, ...]
Item = tuple[tuple[str, ...], KeyPath, Any]  # names, path and value of something in a file

DIMENSIONS = dict.fromkeys(("edge_length", "near_curves", "radius", "x", "y", "z"), "length")
# of numbers of a project that are no quantities of a roof
DIMENSIONS |= {"wall": "tension", "cable_weight": "tension"}
OF_CABLES = {kind.field: kind.dimension for kind in KINDS.values() if kind.parts == "cables"}


def varied(path: PathLike, values: Mapping[str, float]) -> tuple[Project, Surface]:
    """A project with some of its numbers replaced, and its initial surface.

    Parameters
    ----------
    path : of a project (``.toml``), or of a surface, which has no keys.
    values : by the dotted name of a number that the file has or may have, such as ``plan.edge_length``; by
        ``NAME.tension``, ``NAME.pressure``, ``NAME.weight`` and ``NAME.snow`` of a patch or wall,
        ``NAME.tension`` and ``NAME.weight`` of a cable, ``NAME.volume`` of a room; or by ``NAME.x``,
        ``NAME.y`` and ``NAME.z`` of a divider, a hole, a support or a named point of the plan: all of it is
        shifted by the value, so 0 leaves it where it is drawn. Numbers of the file are replaced, and lines
        are shifted, before the plan is meshed, the others afterwards. Where several things have one name, put
        what is meant before it: ``cable NAME.tension``, ``hole NAME.x``. Lines without a name are ``divider
        1``, ``wall 1``, ``hole 1``, ``support 1``, …

    Errors as in ``load`` and ``build``; OptionError for an unknown name.

    >>> project, surface = varied("notebooks/roof.toml", {"plan.edge_length": 2, "corner.tension": 9})
    >>> project.plan.edge_length, surface.patches[0].tension
    (2, 9.0)
    """
    source = _Source.of(path)
    project = source.project(values)
    start = start_of(project)
    return start.project or project, source.loaded(start.surface, values)


def check_varied(path: PathLike, values: Mapping[str, Sequence[Any]]) -> None:
    """Refuse every name and value that ``varied`` refuses; the plan is meshed once at most."""
    source = _Source.of(path)
    project = source.project({})
    start = start_of(project) if project.mesh is not None else None
    project = (start and start.project) or project
    found_by_search: dict[str, str] = {}  # with what each is
    table = "mesh" if project.plan is None else "plan"
    for parameter in project.vary:
        parts, kind, _ = KINDS[parameter.key]
        for one in parameter.names:
            bare = one.removeprefix(CABLE) if parts == "cables" else one
            names = [f"{bare}.{kind}", f"{CABLE}{bare}.{kind}", f"{table}.patches.{bare}.{kind}"]
            names += [f"{table}.{kind}"] if project.plan is None or not project.plan.patches else []
            found_by_search |= dict.fromkeys(names, parameter.label)
    for name, given in values.items():
        if label := found_by_search.get(name):
            text = f"{path}: {name}: the {label} is found by the search for the targets, so the roof"
            text += " would have another than the sweep's; sweep another number, or take it out of vary"
            raise OptionError(text, what=name, where=label)
        for value in given:
            if isinstance(value, bool | str | None) or not math.isfinite(value):
                text = f"{path}: {name} must be a finite number, found {value!r}"
                raise OptionError(text, what=name, found=value)
            if source.is_load(name):
                start = start or start_of(project)
                source.loaded(start.surface, {name: value})
            else:
                source.project({name: value})
    if start is not None:  # refuses two names of one number
        source.loaded(start.surface, {name: given[0] for name, given in values.items()})


class _Source(NamedTuple):
    """A file, read once: its text and data, empty for a surface, and the paths of its numbers by name."""

    path: Path
    text: str
    data: Mapping[str, Any]
    keys: Mapping[str, KeyPath]

    @classmethod
    def of(cls, path: PathLike) -> _Source:
        path = as_path(path)
        text, data = read_data(path) if is_project(path) else ("", {})
        return cls(path, text, data, numbers_by_name(data) if data else {})

    def is_load(self, name: str) -> bool:
        """Whether a name is neither a number of the file nor a shift of a line of its plan."""
        return name not in self.keys and (name.rpartition(".")[2] not in AXES or "plan" not in self.data)

    def project(self, values: Mapping[str, float]) -> Project:
        """The project with other numbers and shifted lines; loads are ignored."""
        if not self.data:
            return Project(self.path, mesh=MeshFile(self.path.name))
        data: Any = deepcopy(self.data)
        shifts: dict[str, dict[str, float]] = {}
        for name, value in values.items():
            if name in self.keys:
                *steps, key = self.keys[name]
                table = data
                for step in steps:
                    table = table.setdefault(step, {}) if isinstance(step, str) else table[step]
                table[key] = value
            elif not self.is_load(name):
                stem, _, axis = name.rpartition(".")
                shifts.setdefault(stem, {})[axis] = value
        return project_of(self.path, data, self.text, partial(shifted, shifts=shifts))

    def loaded(self, surface: Surface, values: Mapping[str, float]) -> Surface:
        """The surface with other tensions and pressures; numbers of the file and shifts are ignored."""
        known = {
            f"{CABLE}{cable.name}.{KINDS[kind][1]}": (kind, cable.name)
            for kind in ("cables", "cable_weights")
            for cable in surface.cables
        }
        for kind, named in reversed(all_values(surface).items()):  # a patch comes after a cable of its name
            known |= {f"{name}.{KINDS[kind][1]}": (kind, name) for name in named}
        given: dict[str, dict[str, float]] = {kind: {} for kind in KINDS}
        for name in filter(self.is_load, values):
            if name not in known:  # shows no coordinates but one that is near; patches have shorter names
                keys = [k for k, at in self.keys.items() if isinstance(at[-1], str) and at[1] != "patches"]
                near = get_close_matches(name, self.keys, n=1, cutoff=0.8)
                names = tuple(dict.fromkeys([*known, *keys, *near]))
                text, section = unknown("number", name, names), name.partition(".")[0]
                if section in LATER:
                    text = f"{name}: no shape depends on [{section}]; sweep another number"
                raise OptionError(f"{self.path}: {text}", what=name, expected=names)
            kind, part = known[name]
            parts, field, _ = KINDS[kind]
            same = [f"{table}.{parts}.{part}.{field}" for table in ("plan", "mesh")]
            if kind == "tensions":
                same += [f"plan.dividers.{line}.wall" for line in (part, part.removeprefix("wall "))]
            same += [other for other in values if other != name and known.get(other) == known[name]]
            following = {p.name for p in surface.patches if p.wall} | {*sheets_below(surface).values()}
            named = {known[other][1] for other in values if other in known and known[other][0] == kind}
            if part not in following and {p.name for p in getattr(surface, parts)} <= named | following:
                same += [f"{table}.{kind.removesuffix('s')}" for table in ("plan", "mesh")]
            if twice := [other for other in same if other in values]:
                text = f"{self.path}: {name} and {twice[0]} set the same number; give one of them"
                raise OptionError(text, what=name, found=twice[0])
            given[kind][part] = values[name]
        with in_file(self.path, OptionError):
            return with_loads(surface, given)


def with_loads(surface: Surface, given: Mapping[str, Mapping[str, float]]) -> Surface:
    """The surface with other values by kind and name; OptionError for a pressure that is a result."""
    refuse_varied_pressure(surface, map(surface.patch_index, given.get("pressures", {})))
    return surface.retensioned(**given)


def numbers_by_name(data: Mapping[str, Any]) -> dict[str, KeyPath]:
    """The numbers that a shape may depend on: the dotted name of each, and its path in the data of a project;
    then those it may have.

    Entries of a list are named by their key "name" if they have one, otherwise by their number from 1.

    >>> list(numbers_by_name({"plan": {"edge": "free", "holes": [{"name": "yard", "cable": 2.0}, [3]]}}))[:3]
    ['plan.holes.yard.cable', 'plan.holes.2.1', 'plan.gap']
    """
    shaping = {key: value for key, value in data.items() if key not in LATER}
    items: list[Item] = list(_items({**shaping, "solve": data.get("solve", {})}, (), ()))
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
    for key, item in value.items() if isinstance(value, Mapping) else enumerate(value):
        named = item.get("name") if isinstance(item, Mapping) and isinstance(key, int) else None
        own = key if isinstance(key, str) else named if isinstance(named, str) else str(key + 1)
        yield (*names, own), (*path, key), item
        if isinstance(item, Mapping | list):
            yield from _items(item, (*names, own), (*path, key))


def shifted(plan: Plan, shifts: Mapping[str, Mapping[str, float]]) -> Plan:
    """The plan with dividers, holes, supports and points moved by lengths along x, y and z.

    >>> plan = Plan([[0, 0], [8, 0], [8, 4], [0, 4]], [[[4, 0], [4, 4]]], edge_length=1.0, tension=2.0)
    >>> shifted(plan, {"wall 1": {"x": 1.0}}).dividers[0].curve.at(0.0).tolist()
    [[5.0, 0.0]]
    """
    labels: dict[tuple[str, Any], str] = {("points", name): f"point {name}" for name in plan.points}
    labels |= {("dividers", k): f"divider {part.name}" for k, part in enumerate(plan.dividers)}
    labels |= {("holes", k): re.sub("['\"]", "", part.name) for k, part in enumerate(plan.holes)}
    labels |= {("supports", k): f"support {k + 1}" for k in range(len(plan.supports))}
    changed: dict[str, Any] = {}
    for name, by in shifts.items():
        found = [at for at, label in labels.items() if name in (label, label.partition(" ")[2])]
        axis = next(iter(by))
        if len(found) != 1:
            several = " or ".join(f"{labels[at]}.{axis}" for at in found)
            lost = unknown("number", f"{name}.{axis}", (f"{label}.{axis}" for label in labels.values()))
            text = f"{name} is the name of several lines; type {several}" if found else lost
            raise OptionError(text, what=f"{name}.{axis}")
        field, key = found[0]
        given = getattr(plan, field)
        parts = changed.setdefault(field, dict(given) if isinstance(given, Mapping) else list(given))
        try:
            parts[key] = _moved(parts[key], np.array([by.get(axis, 0.0) for axis in AXES]), plan.plane)
        except OptionError as error:
            raise OptionError(f"{name}: {error}", what=f"{name}.{axis}") from None
    return replace(plan, **changed)


def _moved(part: Any, by: Floats, plane: Plane) -> Any:
    """A divider, hole, curve or point at another place; what is on Π rises above it."""
    if by[2] and isinstance(part, Divider | tuple):
        raise OptionError("only its place in plan counts; shift it along x or y", what="z")
    if isinstance(part, Divider | Hole):
        return replace(part, curve=_moved(part.curve, by, plane))

    def moved(points: Floats, of_arc: bool = False) -> Floats:
        if by[2] and points.shape[1] == 2:
            if plane != Plane():
                raise OptionError("give it three coordinates, as the plane is not z = 0", what="z")
            points = np.pad(points, ((0, 0), (0, 1)))
        shift = by[: points.shape[1]]
        return np.concatenate([points[:1] + shift, points[1:] + shift * (not of_arc)])  # vectors stay

    if not isinstance(part, Curve):
        return moved(np.array([part]))[0].tolist()
    return replace(part, pieces=tuple(replace(p, points=moved(p.points, bool(p.sweep))) for p in part.pieces))


def with_units(names: Iterable[str], units: Units, cables: Container[str] = ()) -> dict[str, str]:
    """The names of numbers with their units in brackets, as far as these are known.

    ``cables`` are names of cables, whose tension is a force.

    >>> list(with_units(["west.tension", "hem.tension", "verdict"], Units("m", "kN"), ["hem"]).values())
    ['west.tension [kN/m]', 'hem.tension [kN]']
    """
    shown = {}
    for name in names if units else ():
        stem, _, last = name.rpartition(".")
        quantity = stem.partition(" of ")[0] if last == "margin_value" else last
        cable = OF_CABLES.get(quantity) if stem in cables or stem.startswith("plan.cables.") else None
        with suppress(OptionError):
            dimension = cable or DIMENSIONS.get(quantity) or dimension_of(quantity)
            shown[name] = f"{name} [{units.behind(dimension).strip()}]"
    return shown


def digest(path: PathLike) -> str:
    """SHA-256, hexadecimal, of a project with its drawing, or of the surface that any other file holds."""
    if not is_project(path):
        surface = io.read_bare(path)[0]
        return hashlib.sha256(plain_bytes([getattr(surface, name) for name in FIELDS])).hexdigest()
    text, _ = read_data(Path(path))
    others = map(read_bytes, files_of(path)[1 if text else 0 :])
    return hashlib.sha256(b"".join([text.encode(), *others])).hexdigest()
