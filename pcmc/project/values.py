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
from ..surface.values import KINDS, all_values, sheets_below
from .file import Project, project_of
from .start import surface_of

SAME = 1e-11  # of the largest value of a kind: a difference that counts as none
DIGITS = 12  # of the values written
KEYS = {kind: field for kind, (parts, field, _) in KINDS.items() if parts == "patches"}
LINES = {"outline", "holes", "dividers", "supports", "cables"}  # of a plan: what may pass through a point
NO_POINTS = ("axes", "weights", "radius")  # of a curve
WEIGHT_KEYS = {"cable": "cable_weight", "tension": "weight"}  # of a cable, by the key of its tension
USUAL = {"tension": 0.0, "pressure": 1.0, "weight": 0.0}  # of a patch where its table has none
Name = tuple[str, str]  # kind and name of a value, such as ("tensions", "west")


def changeable_values(surface: Surface) -> dict[str, dict[str, Any]]:
    """The values of a surface that can be changed, by kind and name; points are [x, y, z].

    Not those that follow from others: tension and pressure of the lower sheets of cushions, pressures around
    rooms of given volume and of walls, snow of walls.
    """
    values, lower = all_values(surface), {*sheets_below(surface).values()}
    computed = lower | {p.name for p in surface.patches if p.wall} | _of_rooms(surface)
    points = surface.vertices[single_points(surface)].tolist()
    return {
        **values,
        "tensions": {name: alpha for name, alpha in values["tensions"].items() if name not in lower},
        "pressures": {name: p for name, p in values["pressures"].items() if name not in computed},
        "snows": {p.name: p.snow for p in surface.patches if p.snow and not p.wall},
        **{kind: {name: w for name, w in values[kind].items() if w} for kind in ("weights", "cable_weights")},
        "points": {f"point {k}": place for k, place in enumerate(points, 1)},
    }


def single_points(surface: Surface) -> Ints:
    """The vertices that are held alone, such as masts: no vertex beside them is."""
    edges, alone = surface.topology.edges, surface.pinned.copy()
    alone[edges[surface.supported[edges].all(axis=1)]] = False
    return np.flatnonzero(alone)


def differences(surface: Surface, asked: Surface, left: Collection[Name] = ()) -> dict[Name, float]:
    """The values of ``asked`` that ``surface`` has not, but for ``left``; OptionError for other parts."""
    ours, theirs = _by_name(surface), _by_name(asked)
    if ours.keys() != theirs.keys():
        names = sorted({name for _, name in ours.keys() ^ theirs.keys()})
        text = f"the project makes other parts than the surface has: {', '.join(names[:5])}"
        raise OptionError(text, what="surface", found=names)
    most = {kind: max(abs(theirs[key]) for key in theirs if key[0] == kind) for kind, _ in theirs}
    asked_for = ((key, value) for key, value in theirs.items() if key not in left)
    return {key: value for key, value in asked_for if abs(value - ours[key]) > SAME * most[key[0]]}


def _of_rooms(surface: Surface) -> set[str]:
    """The names of the patches whose pressure keeps a volume."""
    return {surface.patches[k].name for k in np.flatnonzero(surface.room_signs.any(axis=0))}


def _by_name(surface: Surface) -> dict[Name, float]:
    """Every value by kind and name, also the pressures of walls; not the pressures that are results."""
    values = {(kind, name): v for kind, own in all_values(surface).items() for name, v in own.items()}
    for name in _of_rooms(surface):
        del values["pressures", name]
    for name, place in changeable_values(surface)["points"].items():
        values |= {("points", f"{axis} of {name}"): x for axis, x in zip("xyz", place, strict=True)}
    return values


def data_with_values(
    path: Path, given: Mapping[str, Any], asked: Surface, left: Collection[Name] = ()
) -> tuple[dict[str, Any], Project, Surface]:
    """The data of a project with the values of the surface ``asked``, the project, and its start shape.

    Each number is in the form that the project has it in; the values in ``left`` stay. OptionError for values
    that a project cannot hold, such as two tensions of one divider.

    >>> path = Path("notebooks/roof.toml")
    >>> from .file import read_data
    >>> data = read_data(path)[1]
    >>> asked = surface_of(project_of(path, data)).retensioned({"corner": 9.0})
    >>> data_with_values(path, data, asked)[0]["plan"]["patches"]["corner"]["tension"]
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
        if project.mesh is not None:
            mesh: dict[str, Any] = {"file": data["mesh"]} if isinstance(data["mesh"], str) else data["mesh"]
            data["mesh"] = mesh
            for (kind, name), value in missing.items():
                if kind in KEYS:  # it holds no others
                    mesh.setdefault("patches", {}).setdefault(name, {})[KEYS[kind]] = _number(value)
                    _drop(mesh, RISES if kind == "tensions" else ())
        else:  # walls that a project leaves open follow its patches, so they come last
            _Writer(data["plan"], project, start, asked).write(first or missing, shared=len(tried) == 1)


class Source(NamedTuple):
    """The part of a plan that gives a wall or a cable its tension: ``where`` is the key of its list."""

    where: str
    number: int
    key: str


def sources_of(plan: Plan) -> dict[Name, Source]:
    """What gives each wall and cable of a plan its tension, found by building the plan with others.

    >>> hall = Plan([[0, 0], [8, 0], [8, 4], [0, 4]], [[[4, 0], [4, 4]]], edge_length=1.0, tension=4.0)
    >>> sources_of(hall)
    {('tensions', 'wall 1'): Source(where='dividers', number=0, key='wall')}
    """
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


class _Writer(NamedTuple):
    """Writes values of the surface ``asked`` into the table of a plan, whose start shape is ``start``."""

    plan: dict[str, Any]
    project: Project
    start: Surface
    asked: Surface

    def write(self, values: Mapping[Name, float], shared: bool) -> None:
        """Write values; if ``shared``, one for all patches where all have the same."""
        walls = {p.name for p in self.asked.patches if p.wall}
        kinds = ("cables", "cable_weights")
        lines = {key: value for key, value in values.items() if key[0] in kinds or key[1] in walls}
        if lines:
            self.write_lines(lines)
        for kind in dict.fromkeys(kind for kind, _ in values):
            wanted = {name: v for (k, name), v in values.items() if k == kind and (k, name) not in lines}
            if kind == "points":
                self.write_points({label.partition(" of ")[2] for label in wanted})
            elif kind == "volumes":
                for name, value in wanted.items():
                    own = self.plan.get("patches", {}).get(name, {})
                    table = own if "volume" in own else self.plan["rooms"][name]
                    table["volume"] = _number(value)
            elif wanted:
                self.write_patches(KEYS[kind], wanted, shared)

    def write_points(self, names: Collection[str]) -> None:
        for name in names:
            places = (changeable_values(surface)["points"][name] for surface in (self.start, self.asked))
            old, new = (self.asked.plane.to_local(np.array([place]))[0] for place in places)
            for key in LINES & self.plan.keys():
                self.plan[key] = _with_point(self.plan[key], old, [_number(x) for x in new.tolist()], key)

    def write_patches(self, key: str, wanted: Mapping[str, float], shared: bool) -> None:
        """Values of patches, in the table of each or in that of the plan; of lower sheets by the factor."""
        plan, lower = self.plan, sheets_below(self.asked) if "cushion" in self.plan else {}
        patches = [p for p in self.asked.patches if not p.wall and p.name not in lower.values()]
        if key == "tension" and lower:
            tensions = {p.name: p.tension for p in self.asked.patches}
            plan["cushion"] = _number(tensions[lower[patches[0].name]] / tensions[patches[0].name])
        wanted = {name: value for name, value in wanted.items() if name not in lower.values()}
        if not wanted:
            return
        whole = "drawing" not in plan and not plan.get("patches")  # the plan has one value for all patches
        if shared and (whole or key in plan) and len({getattr(p, key) for p in patches}) == 1:
            if key == "tension":
                _drop(plan, WHOLE)
            plan[key] = _number(next(iter(wanted.values())))
            return
        tables = plan.setdefault("patches", {})
        _drop(plan, WHOLE)  # each patch has its own tension now
        if whole:
            usual = USUAL | {"snow": plan.get("snow", 0.0)}
            for patch in patches:
                own = {name: _number(getattr(patch, name)) for name in usual}
                tables[patch.name] = {name: v for name, v in own.items() if v != usual[name]}
            _drop(plan, USUAL)
            return
        for name, value in wanted.items():
            table = tables.setdefault(name, {})
            _drop(table, RISES if key == "tension" else ())
            table[key] = _number(value)
        if all("snow" in tables.get(patch.name, ()) for patch in patches):  # the plan's counts for nothing
            _drop(plan, ["snow"])

    def write_lines(self, wanted: Mapping[Name, float]) -> None:
        """Tensions of walls and cables, and weights of cables, in the lines of the plan that carry them."""
        assert self.project.plan is not None
        values, sources = _by_name(self.asked), sources_of(self.project.plan)
        for (kind, name), value in wanted.items():
            weighed = kind == "cable_weights"
            source = sources.get(("cables" if weighed else kind, name))
            if source is None:
                continue
            parts = [part for (_, part), other in sources.items() if other == source]
            if all(abs(values[kind, part] - value) <= SAME * abs(value) for part in parts):
                table = self.plan if source.where == "cable" else self.line(source)
                table[WEIGHT_KEYS[source.key] if weighed else source.key] = _number(value)
            elif source.where == "cable":
                self.split_cables(parts, values)
            else:
                text = f"{', '.join(parts)}: parts of one line, which has one"
                text += f" {'weight' if weighed else 'tension'} in a project; give them the same"
                raise OptionError(text, what=source.key, where=name, found=value)

    def split_cables(self, names: Collection[str], values: Mapping[Name, float]) -> None:
        """Lines for the cables along the outline, which have one tension there, with a tension for each."""
        for name in names:
            drawn = self.start  # where a mirror cuts a cable at rest, its end has left the line
            ends, times = np.unique(drawn.cables[drawn.cable_index(name)].edges, return_counts=True)
            tips = drawn.plane.to_local(drawn.vertices[ends[times == 1]])[:, :2]
            if len(tips) != 2:
                text = f"{name}: it has no two ends, so it cannot have a tension of its own in a project"
                raise OptionError(text, what="cable", where=name)
            curve = [[float(f"{x:.9g}") for x in point] for point in tips.tolist()]
            line = {"name": name, "curve": curve, "tension": _number(values["cables", name])}
            self.plan.setdefault("cables", []).append(line)

    def line(self, source: Source) -> dict[str, Any]:
        """The table of a line; one for a line of the drawing is added if it is missing."""
        table: dict[str, Any]
        entries: list[Any] = self.plan.setdefault(source.where, [])
        drawing = self.project.drawing
        drawn = [] if drawing is None else list(getattr(drawing, source.where, {}))
        if source.number < len(drawn):
            name = drawn[source.number]
            for entry in entries:
                if isinstance(entry, dict) and entry.get("name") == name and "curve" not in entry:
                    return entry
            entries.append(table := {"name": name})
            return table
        own = [k for k, e in enumerate(entries) if not drawn or not isinstance(e, Mapping) or "curve" in e]
        place = own[source.number - len(drawn)]
        table = entries[place]
        if not isinstance(table, dict) or "curve" not in table:
            entries[place] = table = {"curve": table}
        return table


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
