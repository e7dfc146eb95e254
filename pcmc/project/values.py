"""A project with the values of a surface: those that a page changes, written where the project has them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from copy import deepcopy
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..advice.rises import RISES, WHOLE
from ..base.arrays import Floats, Ints
from ..base.errors import OptionError
from ..plan import Plan
from ..surface import Surface
from ..surface.values import KINDS, all_values
from .file import Project, project_of
from .start import surface_of

SAME = 1e-11  # of the largest value of a kind: a difference that counts as none
DIGITS = 12  # of the values written
KEYS = {kind: field for kind, (parts, field) in KINDS.items() if parts == "patches"}
LINES = {"outline", "holes", "dividers", "supports", "cables"}  # of a plan: what may pass through a point
NO_POINTS = ("axes", "weights", "radius")  # of a curve
Name = tuple[str, str]  # kind and name of a value, such as ("tensions", "west")


def values_of(surface: Surface) -> dict[str, dict[str, Any]]:
    """The values of a surface that can be changed, by kind and name.

    The pressures around a room of prescribed volume are results, and a wall's follows from its rooms', as its
    snow does. Pressures are those of the air: snow is not taken off. Points are [x, y, z].
    """
    result = (surface.room_signs != 0.0).any(axis=0) | surface.walls
    free = {p.name for p, r in zip(surface.patches, result.tolist(), strict=True) if not r}
    points = surface.vertices[single_points(surface)].tolist()
    return {
        **(values := all_values(surface)),
        "pressures": {name: p for name, p in values["pressures"].items() if name in free},
        "snows": {p.name: p.snow for p in surface.patches if p.snow and not p.wall},
        "weights": {name: w for name, w in values["weights"].items() if w},
        "points": {f"point {k}": place for k, place in enumerate(points, 1)},
    }


def single_points(surface: Surface) -> Ints:
    """The vertices that are held alone, such as masts: no vertex beside them is."""
    edges, alone = surface.topology.edges, surface.pinned.copy()
    alone[edges[surface.held[edges].all(axis=1)]] = False
    return np.flatnonzero(alone)


def differences(surface: Surface, asked: Surface, left: Collection[Name] = ()) -> dict[Name, float]:
    """The values of ``asked`` that ``surface`` has not, those in ``left`` apart.

    Raises
    ------
    OptionError : for surfaces whose patches, cables or rooms are not the same.
    """
    ours, theirs = _by_name(surface), _by_name(asked)
    if ours.keys() != theirs.keys():
        names = sorted({name for _, name in ours.keys() ^ theirs.keys()})
        text = f"the project makes other parts than the surface has: {', '.join(names[:5])}"
        raise OptionError(text, what="surface", found=names)
    most = {kind: max(abs(theirs[key]) for key in theirs if key[0] == kind) for kind, _ in theirs}
    return {
        key: value
        for key, value in theirs.items()
        if key not in left and abs(value - ours[key]) > SAME * most[key[0]]
    }


def _by_name(surface: Surface) -> dict[Name, float]:
    """Every value by kind and name, also the pressures of walls; not the pressures that are results."""
    result = (surface.room_signs != 0.0).any(axis=0)
    values = {(kind, name): v for kind, named in all_values(surface).items() for name, v in named.items()}
    for p, computed in zip(surface.patches, result.tolist(), strict=True):
        if computed:
            del values["pressures", p.name]
    for name, place in values_of(surface)["points"].items():
        values |= {("points", f"{axis} of {name}"): x for axis, x in zip("xyz", place, strict=True)}
    return values


def with_values(
    path: Path, given: Mapping[str, Any], asked: Surface, left: Collection[Name] = ()
) -> tuple[dict[str, Any], Project, Surface]:
    """The data of a project whose start shape has the values of a surface.

    Parameters
    ----------
    path, given : of the project, and its data.
    asked : has the values wanted; its shape does not count.
    left : (kind, name) of the values that the project keeps as it finds them.

    Returns
    -------
    data : with other numbers where ``asked`` has others, each in the form that the project has it in.
    project, start : of these data.

    Raises
    ------
    OptionError : for values that a project cannot hold, such as two tensions of one divider.

    >>> path = Path("notebooks/roof.toml")
    >>> from .file import read_data
    >>> data = read_data(path)[1]
    >>> project = project_of(path, data)
    >>> asked = surface_of(project).retensioned({"corner": 9.0})
    >>> with_values(path, data, asked)[0]["plan"]["patches"]["corner"]["tension"]
    9.0
    """
    data: dict[str, Any] = deepcopy(dict(given))
    tried: list[dict[Name, float]] = []
    while True:
        project = project_of(path, data)
        start = surface_of(project)
        missing = differences(start, asked, left)
        if not missing:
            return data, project, start
        walls = {p.name for p in start.patches if p.wall}
        first = {key: value for key, value in missing.items() if key[1] not in walls}
        if missing in tried:
            labels = ", ".join(f"{kind.removesuffix('s')} of {name}" for kind, name in list(missing)[:5])
            raise OptionError(f"{path.name} cannot hold the {labels} of the surface shown", what="values")
        tried.append(missing)
        # walls that a project leaves open follow its patches, so they come last
        if project.mesh is not None:
            _put_on_mesh(data, missing)
        else:
            _put(data["plan"], project, start, asked, first or missing, shared=len(tried) == 1)


def _put(
    plan: dict[str, Any],
    project: Project,
    start: Surface,
    asked: Surface,
    values: Mapping[Name, float],
    shared: bool,
) -> None:
    """Write values into the table of a plan; if ``shared``, one for all patches where all have the same."""
    given = {kind: {name: v for (k, name), v in values.items() if k == kind} for kind, _ in values}
    sources = None
    for kind, wanted in given.items():
        if kind == "points":
            places = values_of(start)["points"], values_of(asked)["points"]
            for name in {label.partition(" of ")[2] for label in wanted}:
                old, new = (asked.plane.to_local(np.array([place[name]]))[0] for place in places)
                for key in LINES & plan.keys():
                    plan[key] = _with_point(plan[key], old, [_number(x) for x in new.tolist()], key)
            continue
        if kind == "volumes":
            for name, value in wanted.items():
                own = plan.get("patches", {}).get(name, {})
                table = own if "volume" in own else plan["rooms"][name]
                table["volume"] = _number(value)
            continue
        walls = {p.name for p in asked.patches if p.wall} & wanted.keys()
        if kind == "cables" or walls:
            sources = sources or sources_of(project.plan)
            _put_on_lines(plan, project, asked, sources, kind, wanted)
            wanted = {name: value for name, value in wanted.items() if name not in walls}
        if kind != "cables" and wanted:
            _put_on_patches(plan, asked, kind, wanted, shared)


def _put_on_mesh(data: dict[str, Any], values: Mapping[Name, float]) -> None:
    """Write values of patches into the table of a mesh; it holds no others."""
    mesh = data["mesh"] = {"file": data["mesh"]} if isinstance(data["mesh"], str) else data["mesh"]
    for (kind, name), value in values.items():
        if kind in KEYS:
            mesh.setdefault("patches", {}).setdefault(name, {})[KEYS[kind]] = _number(value)
            _drop(mesh, RISES if kind == "tensions" else ())


def _put_on_patches(
    plan: dict[str, Any], asked: Surface, kind: str, wanted: Mapping[str, float], shared: bool
) -> None:
    key, patches = KEYS[kind], [p for p in asked.patches if not p.wall]
    whole = "drawing" not in plan and not plan.get("patches")  # the plan has one value for all patches
    if shared and (whole or key in plan) and len({getattr(p, key) for p in patches}) == 1:
        if key == "tension" and key not in plan:
            _drop(plan, WHOLE)
        plan[key] = _number(next(iter(wanted.values())))
        return
    tables = plan.setdefault("patches", {})
    if whole:
        if "tension" not in plan:
            _drop(plan, WHOLE)
        usual = {"tension": 0.0, "pressure": 1.0, "weight": 0.0, "snow": plan.get("snow", 0.0)}
        for patch in patches:
            own = {name: _number(getattr(patch, name)) for name in usual}
            tables[patch.name] = {name: v for name, v in own.items() if v != usual[name]}
        _drop(plan, ("tension", "pressure", "weight"))
        return
    for name, value in wanted.items():
        table = tables.setdefault(name, {})
        if key == "tension":
            _drop(table, RISES)
        table[key] = _number(value)


def _with_point(value: Any, old: Floats, new: list[float], key: str = "") -> Any:
    """Lines of a plan with another point wherever ``old`` is one of theirs; both in the coordinates of Π."""
    if isinstance(value, Mapping):
        return {k: v if k in NO_POINTS else _with_point(v, old, new, k) for k, v in value.items()}
    if not isinstance(value, list):
        return value
    if len(value) in (2, 3) and all(isinstance(x, int | float) for x in value):
        same = np.allclose(value[:2], old[:2], rtol=0.0, atol=SAME * (1.0 + float(np.abs(old).max())))
        height = len(value) == 3 or (key == "supports" and new[2] != 0.0)
        return (new if height else new[:2]) if same else value
    return [_with_point(item, old, new, key) for item in value]


def _drop(table: dict[str, Any], keys: Collection[str]) -> None:
    for key in keys:
        table.pop(key, None)


def _number(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


class Source(NamedTuple):
    """The part of a plan that gives a wall or a cable its tension: ``where`` is the key of its list."""

    where: str
    number: int
    key: str


def sources_of(plan: Plan | None) -> dict[Name, Source]:
    """What gives each wall and cable of a plan its tension.

    The plan is built with another tension in each place, so that no rule of its names is repeated here.

    >>> hall = Plan([[0, 0], [8, 0], [8, 4], [0, 4]], [[[4, 0], [4, 4]]], edge_length=1.0, tension=4.0)
    >>> sources_of(hall)
    {('tensions', 'wall 1'): Source(where='dividers', number=0, key='wall')}
    """
    assert plan is not None
    numbers, known = count(1), dict[float, Source]()

    def mark(where: str, number: int, key: str, present: Any) -> Any:
        if present is None or present is False:
            return present
        known[float(next(numbers))] = Source(where, number, key)
        return float(len(known))

    def marked(where: str, *keys: str) -> list[Any]:
        parts = list(enumerate(getattr(plan, where)))
        return [replace(p, **{key: mark(where, k, key, getattr(p, key)) for key in keys}) for k, p in parts]

    changed = {
        "cable": mark("cable", 0, "cable", plan.cable),
        "holes": marked("holes", "cable"),
        "dividers": marked("dividers", "wall", "cable"),
        "cables": marked("cables", "tension"),
    }
    built = replace(plan, **changed).surface()
    walls = {("tensions", p.name): known[p.tension] for p in built.patches if p.wall}
    return walls | {("cables", c.name): known[c.tension] for c in built.cables}


def _put_on_lines(
    plan: dict[str, Any],
    project: Project,
    asked: Surface,
    sources: Mapping[Name, Source],
    kind: str,
    wanted: Mapping[str, float],
) -> None:
    """Tensions of walls and cables, in the lines of the plan that carry them."""
    values = _by_name(asked)
    for name, value in wanted.items():
        source = sources.get((kind, name))
        if source is None:
            continue
        parts = [key for key, other in sources.items() if other == source]
        if any(abs(values[part] - value) > SAME * abs(value) for part in parts):
            if source.where == "cable":
                _split_cables(plan, asked, [part for _, part in parts], values)
                continue
            names = ", ".join(part for _, part in parts)
            text = f"{names}: parts of one line, which has one tension in a project; give them the same"
            raise OptionError(text, what=source.key, where=name, found=value)
        if source.where == "cable":
            plan["cable"] = _number(value)
        else:
            _entry(plan, project, source)[source.key] = _number(value)


def _split_cables(
    plan: dict[str, Any], asked: Surface, names: Collection[str], values: Mapping[Name, float]
) -> None:
    """Lines for the cables along the outline, which have one tension there, with a tension for each."""
    lines = plan.setdefault("cables", [])
    for name in names:
        edges = asked.cables[asked.cable_index(name)].edges
        ends, times = np.unique(edges, return_counts=True)
        tips = asked.plane.to_local(asked.vertices[ends[times == 1]])[:, :2]
        if len(tips) != 2:
            text = f"{name}: it has no two ends, so it cannot have a tension of its own in a project"
            raise OptionError(text, what="cable", where=name)
        lines.append({"name": name, "curve": _rounded(tips), "tension": _number(values["cables", name])})


def _rounded(points: Floats) -> list[list[float]]:
    return [[float(f"{x:.9g}") for x in point] for point in points.tolist()]


def _entry(plan: dict[str, Any], project: Project, source: Source) -> dict[str, Any]:
    """The table of a line in the data of a plan; one for a line of the drawing is added if it is missing."""
    entries: list[Any] = plan.setdefault(source.where, [])
    number = source.number
    drawn = {} if project.drawing is None else getattr(project.drawing, source.where, {})
    if number < len(drawn):
        name = list(drawn)[number]
        for entry in entries:
            if isinstance(entry, dict) and entry.get("name") == name and "curve" not in entry:
                return entry
        added = {"name": name}
        entries.append(added)
        return added
    own = [k for k, e in enumerate(entries) if not drawn or not isinstance(e, Mapping) or "curve" in e]
    place = own[number - len(drawn)]
    table = entries[place]
    if not isinstance(table, dict) or "curve" not in table:
        entries[place] = table = {"curve": table}
    return table
