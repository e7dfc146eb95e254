"""Every section and key of a project file: the table behind its checks, the manual and the JSON Schema."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from functools import cache
from inspect import cleandoc
from typing import Any

from ..accuracy.adaptive import ACCURACY_OF
from ..advice.rises import RISES
from ..advice.rises import WHOLE as WHOLE_RISES
from ..base.units import FORCES, LENGTHS
from ..curves.curves import CURVES
from ..drawings import FORMATS
from ..meshing.walls import EDGES
from ..plan import CableLine, Divider, Hole, PatchSpec, Plan
from ..plan.parts import BALANCED, BOTTOMS, RoomData
from ..solvers import METHODS, find_method
from ..structure.wanted import Structure
from ..surface import Plane
from .settings import COLOURS, PATCH_KEYS, WHEN, AccuracyWanted, MeshFile, Output, Remeshing

CHECKED = "whether to solve on finer meshes, too, for error bars; see ``pcmc.check_mesh``"
MARGIN = "how far it is from the edge: pressure, snow or such as tension of NAME; see ``pcmc.margin``"
PROVED = "whether to prove that an exact equilibrium is near; see ``pcmc.verify``"
VARIED = "what may change; a name is a patch whose tension may, a list of names several with one tension"
REQUIRED = MISSING  # the default of a key that must be given
OR_CURVE = ("plan.dividers", "plan.holes")  # sections in place of which a curve may stand

Schema = dict[str, Any]  # in the terms of JSON Schema
WALL = 'a number, "balanced" or false'
TABLE: Schema = {"type": "object"}
_NUMBER: Schema = {"type": "number"}
_NAME: Schema = {"type": "string"}
_LIST: Schema = {"type": "array"}


def _any_of(*schemas: Schema) -> Schema:
    return {"anyOf": list(schemas)}


def _list_of(*schemas: Schema) -> Schema:
    return {"type": "array", "items": _any_of(*schemas)}


KINDS: dict[str, Schema] = {
    "a value": {},
    "a number": _NUMBER,
    WALL: _any_of(_NUMBER, {"enum": [BALANCED, False]}),
    "a whole number": {"type": "integer"},
    "true or false": {"type": "boolean"},
    "a text": _NAME,
    "a table": TABLE,
    "a table or a list of tables": _any_of(TABLE, _list_of(TABLE)),
    "a list of tables": _list_of(TABLE),
    "a list of curves or tables": _list_of(_LIST, TABLE),
    "a list of points and curves": _list_of(_LIST, TABLE),
    "a list of names": _list_of(_NAME),
    "a list of names, lists of names, or tables": _list_of(_NAME, _LIST, TABLE),
    "a name or a table": _any_of(_NAME, TABLE),
    "a name or a list": _any_of(_NAME, _LIST),
    "a name or a list of names": _any_of(_NAME, _list_of(_NAME)),
    "a list of points": _list_of(_LIST),
    "a curve": _any_of(_LIST, TABLE),
    "a point [x, y, z]": _list_of(_NUMBER) | {"minItems": 3, "maxItems": 3},
    "a point [x, y] or a list of points": _LIST,
    "a name or a point [x, y]": _any_of(_NAME, _LIST),
    "a list of views": _list_of(_NAME, _LIST),
    "a name or two angles": _any_of(_NAME, _LIST),
}
"""What the value of a key may be, in words and as a JSON Schema."""

_TYPES: dict[str, Any] = {
    "number": int | float,
    "integer": int,
    "boolean": bool,
    "string": str,
    "array": list,
    "object": Mapping,
}
_KIND_OF_TYPE = {"float": "a number", "int": "a whole number", "bool": "true or false", "str": "a text"}


def fits(value: Any, schema: Schema) -> bool:
    """Whether a value is of a kind.

    >>> fits([0, 0, 1], KINDS["a point [x, y, z]"]), fits(True, KINDS["a number"])
    (True, False)
    """
    if "anyOf" in schema:
        return any(fits(value, one) for one in schema["anyOf"])
    if "enum" in schema:
        return value in schema["enum"]
    kind = schema.get("type")
    if kind and (not isinstance(value, _TYPES[kind]) or isinstance(value, bool) != (kind == "boolean")):
        return False
    if not isinstance(value, list) or "items" not in schema:
        return True
    enough = schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value))
    return enough and all(fits(item, schema["items"]) for item in value)


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

    def is_curve(self, table: Mapping[str, Any]) -> bool:
        """Whether the table of a divider or hole is a curve itself."""
        return self.name in OR_CURVE and "curve" not in table and any(name in CURVES for name in table)


def _of_class(cls: Any, **about: str | Sequence[str]) -> tuple[Key, ...]:
    """A key for each field of a dataclass: its default, and its sentence from the docstring.

    ``about`` has the kinds that types do not tell, and the choices of texts.
    """
    help_of: dict[str, str] = {}
    for entry in re.finditer(r"^([\w, ]+) : (.*(?:\n    .*)*)", cleandoc(cls.__doc__ or ""), re.M):
        help_of.update(dict.fromkeys(entry[1].split(", "), " ".join(entry[2].split())))
    keys = []
    for f in fields(cls):
        given = about.get(f.name, ())
        kind = (
            given
            if isinstance(given, str) and given
            else _KIND_OF_TYPE.get(str(f.type).removesuffix(" | None"))
        )
        default = None if f.default_factory is not MISSING else f.default
        choices = () if isinstance(given, str) else tuple(given)
        keys.append(Key(f.name, kind or "a value", default, help_of.get(f.name, ""), choices))
    return tuple(keys)


def _rise_keys(how: str, names: Sequence[str]) -> tuple[Key, ...]:
    """Keys for the height of a roof, from which its tension is found."""
    meanings = {
        "rise": "the height over a level outline",
        "apex": "the greatest height over the plane",
        "span_ratio": "the span of the plan, the diameter of the largest circle in it, over the rise",
    }
    return tuple(Key(name, "a number", None, f"{meanings[name]}, {how}") for name in names)


def _plan_keys() -> tuple[Key, ...]:
    """The keys of [plan]: those of a Plan, and the drawing that may stand for its lines."""
    curves, tables = "a list of curves or tables", "a list of tables"
    outline, *others = _of_class(
        Plan,
        outline="a curve",
        dividers=curves,
        holes=curves,
        patches="a table",
        edge=EDGES,
        supports="a list of points and curves",
        plane="a table",
        cables=tables,
        mirrors=curves,
        rooms="a table",
        points="a table",
    )
    drawing = "a .dxf or .3dm file beside the project: its layers are the lines, instead of ``outline``"
    gap = "gaps between its lines up to this length are closed; by default a thousandth of its size"
    return (
        replace(outline, unless=("drawing",)),
        Key("drawing", "a text", None, drawing),
        Key("gap", "a number", None, gap),
        *others,
        *_rise_keys("instead of a tension: for the whole roof", WHOLE_RISES[1:]),
    )


@cache
def main_sections() -> tuple[Section, ...]:
    """The file itself, and all sections but [solve] and [targets]."""
    area = _of_class(PatchSpec, at="a point [x, y] or a list of points")
    mesh = _of_class(
        MeshFile,
        file="a text",
        units=LENGTHS,
        tension="a number",
        patches="a table",
        supports="a name or a list",
    )
    wall = Key("wall", "true or false", None, "whether it is a wall between rooms")
    output = _of_class(
        Output,
        files="a list of names",
        picture="a text",
        view="a name or two angles",
        views="a list of views",
        colour=COLOURS,
        drawings="a list of names",
        sheet=tuple(FORMATS),
        panels="a text",
        structure="a text",
        report="a text",
    )
    return (
        Section(
            "",
            "The file: a plan and what to do with it.",
            (
                Key("units", "a text", None, "of lengths: plan, heights, files and pictures", LENGTHS),
                Key("force", "a text", None, "of forces; tensions are in ``force`` / ``units``", FORCES),
                Key("plan", "a table", REQUIRED, "the roof, by the lines of its plan", unless=("mesh",)),
                Key("mesh", "a name or a table", None, "the roof, by the triangles in a file beside it"),
                Key("solve", "a table", None, "the solver and its options"),
                Key("remesh", "a table or a list of tables", None, "other triangles, once or more"),
                Key("targets", "a table", None, "heights, areas, sags or other quantities to be met"),
                Key("structure", "a table", None, "material, thickness and loads of the structural model"),
                Key("output", "a table", None, "the files, the picture and the documents to write"),
            ),
        ),
        Section("plan", "The roof, by the lines of its plan.", _plan_keys()),
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
            _of_class(Divider, curve="a curve", wall=WALL, bottom=BOTTOMS),
        ),
        Section(
            "plan.holes",
            "An opening. A curve alone is a hole, too.",
            _of_class(Hole, curve="a curve", edge=EDGES),
        ),
        Section(
            "plan.cables",
            "A part of the outline or of a hole that is free and carries a cable.",
            _of_class(CableLine, curve="a curve", tension="a number"),
        ),
        Section(
            "plan.rooms.NAME",
            "A room under several patches; NAME is its name.",
            _of_class(RoomData, patches="a list of names"),
        ),
        Section(
            "plan.plane",
            "The plane Π.",
            (
                Key("point", "a point [x, y, z]", Plane().point, "a point of Π"),
                Key("normal", "a point [x, y, z]", Plane().normal, "its normal, of any length"),
            ),
        ),
        Section(
            "mesh",
            "The roof, by the triangles in a file.",
            (
                *(key for key in mesh if key.name != "rises"),
                *_rise_keys("found by one tension of all patches under pressure", RISES),
            ),
        ),
        Section(
            "mesh.patches.NAME",
            "A patch of the mesh; NAME is its name.",
            (*(replace(key, default=None) for key in area if key.name in PATCH_KEYS), wall),
        ),
        Section(
            "remesh",
            "Other triangles, before or after solving; [[remesh]] if there are several.",
            _of_class(Remeshing, when=WHEN),
        ),
        Section(
            "structure",
            "The structural model that `pcmc structure` writes, in the units of the surface.",
            _of_class(Structure, young="a number", wind="a table"),
        ),
        Section("output", "What to write: all of it, or nothing. Without it nothing is written.", output),
    )


@cache
def solve_section(method: str) -> Section:
    """The keys of [solve] for a method; for one that does not exist ``method`` alone."""
    keys: tuple[Key, ...] = (
        Key("method", "a text", "newton", "the solver", tuple(METHODS)),
        Key("mesh_check", "true or false", None, CHECKED),
        Key("margin", "a list of names", (), MARGIN),
        Key("verify", "true or false", False, PROVED),
    )
    help = "The solver and its options."
    if method not in METHODS:
        return Section("solve", help, keys)
    target, armijo = ("minimum", "stationary"), ("printed", "sufficient")
    keys += _of_class(find_method(method).options, target=target, armijo=armijo)
    if method == "newton":
        keys += _of_class(AccuracyWanted, accuracy="a table", accuracy_of=ACCURACY_OF)
    return Section("solve", help, keys, f'method = "{method}"')


@cache
def target_sections() -> tuple[Section, ...]:
    """[targets] and its tables."""
    from ..design import Parameter, Target  # needed by projects with targets only
    from ..design.quantities import MEASURES
    from ..design.targets import KINDS as KINDS_OF_PARAMETER
    from ..design.targets import SHORT

    wanted = _of_class(Target, of="a name or a point [x, y]", quantity=(*MEASURES, *SHORT))
    changing = _of_class(Parameter, patch="a name or a list of names", kind=KINDS_OF_PARAMETER)
    return (
        Section(
            "targets",
            "Quantities to be met by changing tensions, pressures, cables, weights or volumes.",
            (
                Key("meet", "a list of tables", REQUIRED, "the quantities and their values"),
                Key("vary", "a list of names, lists of names, or tables", REQUIRED, VARIED),
                Key("tolerance", "a number", 1e-7, "largest relative misfit of a target that counts as met"),
            ),
        ),
        Section("targets.meet", "A quantity and what it is to be.", wanted),
        Section("targets.vary", "What may change.", changing),
    )


ELLIPSE = "{centre = [x, y], axes = [[a, b], [c, d]], sweep = degrees}; without sweep the whole ellipse"
CURVE = Section(
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
    return (*main_sections(), *solve, *target_sections(), CURVE)
