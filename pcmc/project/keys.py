"""Every section and key of a project file: the table behind the checks and the manual."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from functools import cache
from inspect import cleandoc
from typing import Any

from ..accuracy.adaptive import ACCURACY_OF
from ..advice.rises import RISES
from ..advice.rises import WHOLE as WHOLE_RISES
from ..base.units import FORCES, LENGTHS
from ..drawings import FORMATS
from ..meshing.walls import EDGES
from ..plan import Area, CableLine, Divider, Hole, Plan
from ..plan.parts import BALANCED, BOTTOMS, RoomData
from ..solvers import METHODS, find_method
from ..structure.model import Structure
from ..surface import Plane
from .accuracy import AccuracyWanted
from .documents import Documents
from .mesh import PATCH_KEYS, MeshFile
from .output import COLOURS
from .remeshing import WHEN, Remeshing

CHECKED = "whether to solve on finer meshes, too, for error bars; see ``pcmc.check_mesh``"
MARGIN = "how far it is from the edge: pressure, snow or such as tension of NAME; see ``pcmc.margin``"
PROVED = "whether to prove that an exact equilibrium is near; see ``pcmc.verify``"
WHOLE = "whether to write and draw the whole roof that a plan with mirrors is a part of, and to certify it"
FIRST = "First lines"  # the keys before any table
WALL = 'a number, "balanced" or false'
REQUIRED = MISSING  # the default of a key that must be given


@dataclass(frozen=True)
class Key:
    """A key of a project file.

    Attributes
    ----------
    name : in its section.
    kind : what its value may be, such as "a number"; one of ``KINDS``.
    default : the value where the key is left out; ``REQUIRED`` if it must not be, None for none.
    help : what it means.
    choices : the texts that are allowed; empty if any is.
    unless : the keys that may stand for a required one.
    """

    name: str
    kind: str
    default: Any
    help: str
    choices: tuple[str, ...] = ()
    unless: tuple[str, ...] = ()


@dataclass(frozen=True)
class Section:
    """A table of a project file.

    Attributes
    ----------
    name : as in TOML, such as "plan.holes"; NAME stands for any name, "" is the file itself.
    help : what it is for.
    keys : all that it may have.
    condition : when these are its keys; empty for always.
    """

    name: str
    help: str
    keys: tuple[Key, ...] = field(repr=False)
    condition: str = ""


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _list_of(*kinds: type) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, list) and all(isinstance(v, kinds) for v in value)


KINDS: dict[str, Callable[[Any], bool]] = {
    "a value": lambda value: True,
    "a number": _number,
    WALL: lambda value: value is False or _number(value) or value == BALANCED,
    "a whole number": lambda value: _number(value) and isinstance(value, int),
    "true or false": lambda value: isinstance(value, bool),
    "a text": lambda value: isinstance(value, str),
    "a table": lambda value: isinstance(value, Mapping),
    "a table or a list of tables": lambda value: isinstance(value, Mapping) or _list_of(Mapping)(value),
    "a list of tables": _list_of(Mapping),
    "a list of curves or tables": _list_of(list, Mapping),
    "a list of points and curves": _list_of(list, Mapping),
    "a list of names": _list_of(str),
    "a list of names or tables": _list_of(str, Mapping),
    "a list of names, lists of names, or tables": _list_of(str, list, Mapping),
    "a name or a table": lambda value: isinstance(value, str | Mapping),
    "a name or a list": lambda value: isinstance(value, str | list),
    "a name or a list of names": lambda value: isinstance(value, str) or _list_of(str)(value),
    "a list of points": _list_of(list),
    "a curve": lambda value: isinstance(value, list | Mapping),
    "a point [x, y, z]": lambda value: _list_of(int, float)(value) and len(value) == 3,
    "a point [x, y] or a list of points": lambda value: isinstance(value, list),
    "a name or a point [x, y]": lambda value: isinstance(value, str | list),
    "a list of views": _list_of(str, list),
    "a name or two angles": lambda value: isinstance(value, str | list),
}

_KIND_OF_TYPE = {"float": "a number", "int": "a whole number", "bool": "true or false", "str": "a text"}


def _of_class(
    cls: Any, kinds: Mapping[str, str] | None = None, choices: Mapping[str, tuple[str, ...]] | None = None
) -> tuple[Key, ...]:
    """A key for each field of a dataclass: its default, and its sentence from the docstring."""
    help_of = {}
    for entry in re.finditer(r"^([\w, ]+) : (.*(?:\n    .*)*)", cleandoc(cls.__doc__ or ""), re.M):
        help_of.update(dict.fromkeys(entry[1].split(", "), " ".join(entry[2].split())))
    return tuple(
        Key(
            f.name,
            (kinds or {}).get(f.name) or _KIND_OF_TYPE.get(str(f.type).removesuffix(" | None"), "a value"),
            None if f.default_factory is not MISSING else f.default,
            help_of.get(f.name, ""),
            (choices or {}).get(f.name, ()),
        )
        for f in fields(cls)
    )


def _plan_keys(kinds: Mapping[str, str]) -> tuple[Key, ...]:
    """The keys of [plan]: those of a Plan, and the drawing that may stand for its lines."""
    outline, *others = _of_class(Plan, kinds, {"edge": EDGES})
    drawing = "a .dxf or .3dm file beside the project: its layers are the lines, instead of ``outline``"
    gap = "gaps between its lines up to this length are closed; by default a thousandth of its size"
    return (
        replace(outline, unless=("drawing",)),
        Key("drawing", "a text", None, drawing),
        Key("gap", "a number", None, gap),
        *others,
        *_rise_keys("instead of a tension: for the whole roof", WHOLE_RISES[1:]),
    )


def _mesh_keys() -> tuple[Key, ...]:
    """The keys of [mesh]."""
    kinds = {"file": "a text", "tension": "a number", "patches": "a table", "supports": "a name or a list"}
    keys = _of_class(MeshFile, kinds, {"units": LENGTHS})
    own = (
        replace(key, default=REQUIRED) if key.name == "file" else key for key in keys if key.name != "rises"
    )
    return (*own, *_rise_keys("found by one tension of all patches under pressure", RISES))


def _mesh_patch_keys() -> tuple[Key, ...]:
    """The keys of a patch of a mesh, with the sentences of a plan's."""
    wall = Key("wall", "true or false", None, "whether it is a wall between rooms")
    return (*(Key(k.name, k.kind, None, k.help) for k in _of_class(Area) if k.name in PATCH_KEYS), wall)


def _rise_keys(how: str, names: Sequence[str]) -> tuple[Key, ...]:
    """Keys for the height of a roof, from which its tension is found."""
    meanings = {
        "rise": "the height over a level outline",
        "apex": "the greatest height over the plane",
        "span_ratio": "the span of the plan, the diameter of the largest circle in it, over the rise",
    }
    return tuple(Key(name, "a number", None, f"{meanings[name]}, {how}") for name in names)


@cache
def main_sections() -> tuple[Section, ...]:
    """The file itself, and all sections but [solve] and [targets]."""
    curve, curves = {"curve": "a curve"}, "a list of curves or tables"
    plan = {"outline": "a curve", "dividers": curves, "holes": curves, "patches": "a table"}
    plan |= {"supports": "a list of points and curves", "plane": "a table", "cables": "a list of tables"}
    plan |= {"mirrors": "a list of curves or tables", "rooms": "a table", "points": "a table"}
    area = _of_class(Area, {"at": "a point [x, y] or a list of points"})
    directions = "of the picture: diagonal, elevation, plan, or [azimuth, elevation] in degrees"
    documents = {"drawings": "a list of names", "panels": "a text", "structure": "a text", "report": "a text"}
    return (
        Section(
            "",
            "The file: a plan and what to do with it.",
            (
                Key("units", "a text", None, "of lengths: plan, heights, files and pictures", LENGTHS),
                Key("force", "a text", None, "of forces; tensions are in ``force`` / ``units``", FORCES),
                Key("plan", "a table", REQUIRED, "the roof, by the lines of its plan", unless=("mesh",)),
                Key(
                    "mesh",
                    "a name or a table",
                    None,
                    "the roof, by the triangles in a file beside it",
                ),
                Key("solve", "a table", None, "the solver and its options"),
                Key("remesh", "a table or a list of tables", None, "other triangles, once or more"),
                Key("targets", "a table", None, "heights, areas, sags or other quantities to be met"),
                Key("structure", "a table", None, "material, thickness and loads of the structural model"),
                Key("output", "a table", None, "the files, the picture and the documents to write"),
            ),
        ),
        Section("plan", "The roof, by the lines of its plan.", _plan_keys(plan)),
        Section(
            "plan.patches.NAME",
            "A patch; NAME is its name.",
            (
                *(replace(k, unless=RISES) if k.name == "tension" else k for k in area if k.name != "name"),
                *_rise_keys("instead of a tension, which is found", RISES),
            ),
        ),
        Section(
            "plan.dividers",
            "A line between patches, with a wall below it. A curve alone is a divider, too.",
            _of_class(Divider, curve | {"wall": WALL}, {"bottom": BOTTOMS}),
        ),
        Section(
            "plan.holes", "An opening. A curve alone is a hole, too.", _of_class(Hole, curve, {"edge": EDGES})
        ),
        Section(
            "plan.cables",
            "A part of the outline or of a hole that is free and carries a cable.",
            _of_class(CableLine, curve | {"tension": "a number"}),
        ),
        Section(
            "plan.rooms.NAME",
            "A room under several patches; NAME is its name.",
            _of_class(RoomData, {"patches": "a list of names"}),
        ),
        Section(
            "plan.plane",
            "The plane Π.",
            (
                Key("point", "a point [x, y, z]", Plane().point, "a point of Π"),
                Key("normal", "a point [x, y, z]", Plane().normal, "its normal, of any length"),
            ),
        ),
        Section("mesh", "The roof, by the triangles in a file.", _mesh_keys()),
        Section("mesh.patches.NAME", "A patch of the mesh; NAME is its name.", _mesh_patch_keys()),
        Section(
            "remesh",
            "Other triangles, before or after solving; [[remesh]] if there are several.",
            _of_class(Remeshing, choices={"when": WHEN}),
        ),
        Section(
            "structure",
            "The structural model that `pcmc structure` writes, in the units of the surface.",
            _of_class(Structure, {"young": "a number", "wind": "a table"}),
        ),
        Section(
            "output",
            "What to write: all of it, or nothing. Without it nothing is written.",
            (
                Key("files", "a list of names", [], "files of the surface; the suffix names the format"),
                Key("picture", "a text", None, "name of a picture, .png, .svg or .pdf"),
                Key("view", "a name or two angles", "diagonal", directions),
                Key("views", "a list of views", None, "of the picture, side by side, instead of ``view``"),
                Key("colour", "a text", "patches", "of the picture", COLOURS),
                Key("whole", "true or false", False, WHOLE),
                *_of_class(Documents, documents, {"sheet": tuple(FORMATS)}),
            ),
        ),
    )


@cache
def solve_section(method: str) -> Section:
    """The keys of [solve] for a method; for one that does not exist ``method`` alone."""
    known = (
        Key("method", "a text", "newton", "the solver", tuple(METHODS)),
        Key("mesh_check", "true or false", None, CHECKED),
        Key("margin", "a list of names", [], MARGIN),
        Key("verify", "true or false", False, PROVED),
    )
    if method not in METHODS:
        return Section("solve", "The solver and its options.", known)
    choices = {"target": ("minimum", "stationary"), "armijo": ("printed", "sufficient")}
    options = _of_class(find_method(method).options, choices=choices)
    keys = (*known, *options)
    if method == "newton":
        keys += _of_class(AccuracyWanted, {"accuracy": "a table"}, {"accuracy_of": ACCURACY_OF})
    return Section("solve", "The solver and its options.", keys, f'method = "{method}"')


@cache
def target_sections() -> tuple[Section, ...]:
    """[targets] and its tables."""
    from ..design import Parameter  # needed by projects with targets only
    from ..design.quantities import MEASURES
    from ..design.targets import KINDS as KINDS_OF_PARAMETER
    from ..design.targets import SHORT
    from ..margins.targets import Target

    changing = _of_class(
        Parameter, {"patch": "a name or a list of names"}, choices={"kind": KINDS_OF_PARAMETER}
    )
    varied = "what may change; a name is a patch whose tension may, a list of names several with one tension"
    wanted = _of_class(Target, {"of": "a name or a point [x, y]"}, {"quantity": (*MEASURES, *SHORT)})
    return (
        Section(
            "targets",
            "Quantities to be met by changing tensions, pressures, cables, weights or volumes.",
            (
                Key("meet", "a list of tables", REQUIRED, "the quantities and their values"),
                Key("vary", "a list of names, lists of names, or tables", REQUIRED, varied),
                Key("tolerance", "a number", 1e-7, "largest relative misfit of a target that counts as met"),
            ),
        ),
        Section("targets.meet", "A quantity and what it is to be.", wanted),
        Section("targets.vary", "What may change.", changing),
    )


ELLIPSE = "{centre = [x, y], axes = [[a, b], [c, d]], sweep = degrees}; without sweep the whole ellipse"
_CURVE = Section(
    "CURVE",
    "Any curve is a list of points, or a table with one of these keys, or a list of such tables, each"
    " starting where the one before ends. Points [x, y] are on Π, points [x, y, z] in space.",
    (
        Key("polyline", "a list of points", None, "straight segments from point to point"),
        Key("closed", "true or false", False, "whether a polyline returns to its first point"),
        Key("bezier", "a list of points", None, "the control points of a Bézier curve"),
        Key("weights", "a value", None, "of the control points of a rational Bézier curve; each > 0"),
        Key("arc", "a list of points", None, "start, a point on the way, and end of a circular arc"),
        Key("circle", "a table", None, "{centre = [x, y], radius = r}"),
        Key("ellipse", "a table", None, ELLIPSE),
    ),
)  # its keys are checked where curves are made


def sections() -> tuple[Section, ...]:
    """Every section that a project file may have, with its keys.

    >>> [key.name for key in sections()[0].keys]
    ['units', 'force', 'plan', 'mesh', 'solve', 'remesh', 'targets', 'structure', 'output']
    """
    solve = (solve_section(method) for method in METHODS)
    return (*main_sections(), *solve, *target_sections(), _CURVE)


def reference() -> str:
    """All sections and keys as Markdown, a table for each section."""
    lines = []
    for section in sections():
        condition = f" with `{section.condition}`" if section.condition else ""
        title = f"`{section.name}`" if section is _CURVE else f"`[{section.name}]`" if section.name else FIRST
        lines += [f"## {title}{condition}", "", section.help, ""]
        lines += ["| key | value | default | meaning |", "|---|---|---|---|"]
        for key in section.keys:
            value = ", ".join(f'`"{c}"`' for c in key.choices) or key.kind
            none = key.default is None or key.default == ()
            default = "required" if key.default is REQUIRED else "" if none else _toml(key.default)
            meaning = key.help.replace("``", "`").replace("|", "\\|")
            lines.append(f"| `{key.name}` | {value} | {default} | {meaning} |")
        lines.append("")
    return "\n".join(lines)


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    shown = list(value) if isinstance(value, tuple) else value
    return f"`{shown!r}`".replace("'", '"')
