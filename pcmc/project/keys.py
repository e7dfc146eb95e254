"""Every section and key of a project file: the table behind its checks, the manual and the JSON Schema."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from functools import cache
from inspect import cleandoc
from typing import Any

from ..advice.rises import RISES
from ..advice.rises import WHOLE as WHOLE_RISES
from ..base.units import FORCES, LENGTHS
from ..cloth.settings import CuttingOptions
from ..design import Parameter, Target
from ..design.targets import KINDS as KINDS_OF_PARAMETER
from ..design.targets import MEASURES
from ..io.georeference import Georeference
from ..plan import CableLine, Divider, Hole, PatchSpec, Plan
from ..plan.parts import BALANCED, WALL, RoomData
from ..solvers import METHODS, find_method
from ..structure.section import MATERIAL, MemberSection, Structure, Zone
from ..surface import Plane
from ..surface.curve_data import CURVES
from .settings import PATCH_KEYS, AccuracyWanted, MeshFile, Output, Remeshing

CHECKED = "whether to solve on finer meshes, too, for error bars; see ``pcmc.check_mesh``"
MARGIN = "how far it is from the edge: pressure, snow or such as tension of NAME; see ``pcmc.margin``"
PROVED = "whether to prove that an exact equilibrium is near; see ``pcmc.verify``"
VARIED = "what may change; a name is a patch or cable whose tension may, a list of names all that share one"
REQUIRED = MISSING  # the default of a key that must be given
EXAMPLES = {  # what to type for keys that must be given, and for some that a beginner takes for others
    "plan": "[plan] with outline = [[0, 0], [12, 0], [12, 8], [0, 8]] and tension = 4.0",
    "plan.outline": "outline = [[0, 0], [12, 0], [12, 8], [0, 8]]",
    "plan.dividers": "dividers = [[[6, 0], [6, 8]]]",
    "plan.holes": "holes = [{circle = {centre = [6, 4], radius = 1}}]",
    "plan.supports": "supports = [[0, 0], [12, 8, 3]]",
    "plan.mirrors": "mirrors = [[[12, 0], [12, 8]]]",
    "plan.rise": "rise = 2.0",
    "plan.cushion": "cushion = 1.0, for two sheets of one tension",
    "plan.patches.NAME.tension": "tension = 4.0",
    "plan.dividers.curve": "curve = [[6, 0], [6, 8]]",
    "plan.dividers.wall": "wall = 1.5",
    "plan.holes.curve": "curve = {circle = {centre = [6, 4], radius = 1}}",
    "plan.cables.curve": "curve = [[0, 0], [12, 0]]",
    "plan.cables.tension": "tension = 10.0",
    "plan.rooms.NAME.patches": 'patches = ["west", "east"]',
    "plan.rooms.NAME.volume": "volume = 150.0",
    "mesh.file": 'file = "mesh.obj"',
    "remesh.edge_length": "edge_length = 0.5",
    "structure.zones.case": 'case = "drift"',
    "targets.meet": 'meet = [{quantity = "apex", value = 3.0}]',
    "targets.vary": 'vary = ["west"]',
    "targets.meet.quantity": 'quantity = "apex"',
    "targets.vary.patch": 'patch = "west"',
    "output.files": 'files = ["roof.3dm"]',
    "output.georeference.crs": 'crs = "EPSG:25832"',
}
OR_CURVE = ("plan.dividers", "plan.holes")  # a curve may replace these sections

Schema = dict[str, Any]  # in the terms of JSON Schema
TABLE: Schema = {"type": "object"}
_NUMBER: Schema = {"type": "number"}
_NAME: Schema = {"type": "string"}
_LIST: Schema = {"type": "array"}


def _any_of(*schemas: Schema) -> Schema:
    return {"anyOf": list(schemas)}


def _list_of(*schemas: Schema) -> Schema:
    return {"type": "array", "items": _any_of(*schemas)}


KINDS: dict[str, Schema] = {  # what the value of a key may be, in words and as a JSON Schema
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
    "a list of pairs of points": _list_of(_LIST),
    "a list of lines": _list_of(_LIST),
    "a number or a table": _any_of(_NUMBER, TABLE),
    "two numbers or a table": _any_of(_list_of(_NUMBER) | {"minItems": 2, "maxItems": 2}, TABLE),
    "two numbers": _list_of(_NUMBER) | {"minItems": 2, "maxItems": 2},
    "a curve": _any_of(_LIST, TABLE),
    "a point [x, y, z]": _list_of(_NUMBER) | {"minItems": 3, "maxItems": 3},
    "a point [x, y] or a list of points": _LIST,
    "a name or a point [x, y]": _any_of(_NAME, _LIST),
    "a list of views": _list_of(_NAME, _LIST),
    "a name or two angles": _any_of(_NAME, _LIST),
}

_TYPES: dict[str, Any] = {"number": int | float, "integer": int, "boolean": bool, "string": str}
_TYPES |= {"array": list, "object": Mapping}
_KIND_OF_TYPE = {"float": "a number", "int": "a whole number", "bool": "true or false", "Plane": "a table"}
_KIND_OF_TYPE |= {"str": "a text", "PathLike": "a text", "Mapping": "a table"}
_KIND_OF_TYPE |= {"Sequence": "a list of names", "tuple": "a list of names"}
_CHOICES = {"target": ("minimum", "stationary"), "armijo": ("printed", "sufficient")}  # of solvers' options


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
    name: str
    kind: str  # one of ``KINDS``
    default: Any  # where the key is left out; ``REQUIRED`` if it must not be, None for none
    help: str
    choices: tuple[str, ...] = ()  # the texts that are allowed; empty if any is
    unless: tuple[str, ...] = ()  # the keys that may stand for a required one


@dataclass(frozen=True)
class Section:
    """A table of a project file."""

    name: str  # as in TOML, such as "plan.holes"; NAME stands for any name, "" is the file itself
    help: str
    keys: tuple[Key, ...] = field(repr=False)
    condition: str = ""  # when these are its keys; empty for always

    @property
    def title(self) -> str:
        """What a message calls it."""
        condition = self.condition and f" with {self.condition}"
        return f"[{self.name}]{condition}" if self.name else "the file itself"

    def example(self, key: str) -> str:
        """The end of a message about a key: what to type for it; empty where ``EXAMPLES`` have none."""
        example = EXAMPLES.get(f"{self.name}.{key}".lstrip("."), "")
        return example and f", such as {example}"

    def is_curve(self, table: Mapping[str, Any]) -> bool:
        """Whether the table of a divider or hole is a curve itself."""
        return self.name in OR_CURVE and "curve" not in table and any(name in CURVES for name in table)


def _of_class(cls: Any, **special: str | Sequence[str]) -> tuple[Key, ...]:
    """A key for each field of a dataclass, with its sentence in the docstring; ``special``: kinds and choices
    of names that have others elsewhere."""
    help_of: dict[str, str] = {}
    for entry in re.finditer(r"^([\w, ]+) : (.*(?:\n    .*)*)", cleandoc(cls.__doc__ or ""), re.M):
        help_of.update(dict.fromkeys(entry[1].split(", "), " ".join(entry[2].split())))
    keys = []
    for f in fields(cls):
        usual = _KIND_OF_TYPE.get(str(f.type).removesuffix(" | None").partition("[")[0], "a value")
        about = special.get(f.name) or f.metadata.get("kind", usual)
        kind, choices = (about, ()) if isinstance(about, str) else ("a text", tuple(about))
        default = None if f.default_factory is not MISSING else f.default
        keys.append(Key(f.name, kind, default, help_of.get(f.name, ""), choices))
    return tuple(keys)


def _rise_keys(how: str, names: Sequence[str] = RISES) -> tuple[Key, ...]:
    """Keys for the height of a roof, from which its tension is found."""
    meanings = {"rise": "the height over a level outline", "apex": "the greatest height over the plane"}
    meanings["span_ratio"] = "the span of the plan, the diameter of the largest circle in it, over the rise"
    return tuple(Key(name, "a number", None, f"{meanings[name]}, {how}") for name in names)


@cache
def main_sections() -> tuple[Section, ...]:
    """The file itself, and all sections but [solve] and [targets]."""
    root = (
        Key("units", "a text", None, "of lengths: plan, heights, files and pictures", LENGTHS),
        Key("force", "a text", None, "of forces; tensions are in ``force`` / ``units``", FORCES),
        Key("plan", "a table", REQUIRED, "the roof, by the lines of its plan", unless=("mesh",)),
        Key("mesh", "a name or a table", None, "the roof, by the triangles in a file beside it"),
        Key("solve", "a table", None, "the solver and its options"),
        Key("remesh", "a table or a list of tables", None, "other triangles, once or more"),
        Key("targets", "a table", None, "heights, areas, sags or other quantities to be met"),
        Key("structure", "a table", None, "material, thickness and loads of the structural model"),
        Key("pattern", "a table", None, "the cutting pattern of the cloth"),
        Key("output", "a table", None, "the files, the picture and the documents to write"),
    )
    drawing = "a .dxf or .3dm file beside the project: its layers are the lines, instead of ``outline``"
    gap = "gaps between its lines up to this length are closed; by default a thousandth of its size"
    outline, *others = _of_class(Plan)
    plan = [replace(outline, unless=("drawing",)), Key("drawing", "a text", None, drawing)]
    plan += [Key("gap", "a number", None, gap)]
    others = [key for key in others if key.name != "rise"]  # of the initial surface
    plan += [replace(key, default=None) if key.name == "edge_length" else key for key in others]
    plan += _rise_keys("instead of a tension: for the whole roof", WHOLE_RISES)
    specs = [key for key in _of_class(PatchSpec) if key.name != "name"]
    patch = [replace(key, unless=RISES) if key.name == "tension" else key for key in specs]
    patch += _rise_keys("instead of a tension, which is found")
    plane = [Key("point", "a point [x, y, z]", Plane().point, "a point of Π")]
    plane += [Key("normal", "a point [x, y, z]", Plane().normal, "its normal, of any length")]
    mesh = [key for key in _of_class(MeshFile) if key.name != "rises"]
    mesh += _rise_keys("found by one tension of all patches under pressure")
    mesh_patch = [replace(key, default=None) for key in specs if key.name in PATCH_KEYS]
    mesh_patch.append(Key("wall", "true or false", None, "whether it is a wall between rooms"))
    structure = {key.name: key for key in _of_class(Structure)}
    own: dict[str, Any] = {"default": None, "help": "as in [structure], for this patch."}
    material = [replace(structure[name], **own) for name in MATERIAL]
    material.append(Key("thickness", "a number", **own))
    rooms, cables = _of_class(RoomData), _of_class(CableLine)
    help_of = {
        "divider": "A line between patches, with a wall below it. A curve alone is a divider, too.",
        "cable": "A part of the outline or of a hole that is free and carries a cable.",
        "remesh": "Other triangles, before or after solving; [[remesh]] if there are several.",
        "structure": "The structural model that `pcmc structure` writes, in the units of the surface.",
        "material": "The material of a patch, where it is another one; NAME is the patch's name.",
        "member": "An arch, a beam or a cable; NAME is what dividers and holes call it.",
        "zone": "Snow or wind on a part of the roof; those with the same case act together.",
        "pattern": "The cutting pattern that `pcmc pattern` writes, in the units of the surface.",
        "output": "What to write: all of it, or nothing. Without it nothing is written.",
        "georeference": "Where the .ifc files are on a map.",
    }
    return (
        Section("", "The file: a plan and what to do with it.", root),
        Section("plan", "The roof, by the lines of its plan.", tuple(plan)),
        Section("plan.patches.NAME", "A patch; NAME is its name.", tuple(patch)),
        Section("plan.dividers", help_of["divider"], _of_class(Divider)),
        Section("plan.holes", "An opening. A curve alone is a hole, too.", _of_class(Hole)),
        Section("plan.cables", help_of["cable"], cables),
        Section("plan.rooms.NAME", "A room under several patches; NAME is its name.", rooms),
        Section("plan.plane", "The plane Π.", tuple(plane)),
        Section("mesh", "The roof, by the triangles in a file.", tuple(mesh)),
        Section("mesh.patches.NAME", "A patch of the mesh; NAME is its name.", tuple(mesh_patch)),
        Section("remesh", help_of["remesh"], _of_class(Remeshing)),
        Section("structure", help_of["structure"], tuple(structure.values())),
        Section("structure.patches.NAME", help_of["material"], tuple(material)),
        Section("structure.members.NAME", help_of["member"], _of_class(MemberSection)),
        Section("structure.zones", help_of["zone"], _of_class(Zone)),
        Section("pattern", help_of["pattern"], _of_class(CuttingOptions)),
        Section("output", help_of["output"], _of_class(Output)),
        Section("output.georeference", help_of["georeference"], _of_class(Georeference)),
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
    if method not in METHODS:
        return Section("solve", "The solver and its options.", keys)
    keys += _of_class(find_method(method).options, **_CHOICES)
    keys += _of_class(AccuracyWanted) if method == "newton" else ()
    return Section("solve", "The solver and its options.", keys, f'method = "{method}"')


@cache
def target_sections() -> tuple[Section, ...]:
    """[targets] and its tables."""
    wanted = _of_class(Target, quantity=tuple(MEASURES), of="a name or a point [x, y]")
    changing = _of_class(Parameter, patch="a name or a list of names", kind=KINDS_OF_PARAMETER)
    meet = Key("meet", "a list of tables", REQUIRED, "the quantities and their values")
    vary = Key("vary", "a list of names, lists of names, or tables", REQUIRED, VARIED)
    misfit = Key("tolerance", "a number", 1e-7, "largest relative misfit of a target that counts as met")
    help = "Quantities to be met by changing tensions, pressures, cables, weights or volumes."
    targets = Section("targets", help, (meet, vary, misfit))
    quantity = Section("targets.meet", "A quantity and what it is to be.", wanted)
    return (targets, quantity, Section("targets.vary", "What may change.", changing))


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
    ['units', 'force', 'plan', 'mesh', 'solve', 'remesh', 'targets', 'structure', 'pattern', 'output']
    """
    return (*main_sections(), *map(solve_section, METHODS), *target_sections(), CURVE)


def reference() -> str:
    """All sections and keys as Markdown, a table for each section."""
    lines = []
    for section in sections():
        condition = f" with `{section.condition}`" if section.condition else ""
        title = f"`[{section.name}]`" if section.name else "First lines"
        title = f"`{section.name}`" if section is CURVE else title
        lines += [f"## {title}{condition}", "", section.help, ""]
        lines += ["| key | value | default | meaning |", "|---|---|---|---|"]
        for key in section.keys:
            value = ", ".join(f'`"{c}"`' for c in key.choices) or key.kind
            shown = json.dumps(key.default, ensure_ascii=False) if _has_default(key) else ""
            default = "required" if key.default is REQUIRED else shown and f"`{shown}`"
            meaning = key.help.replace("``", "`").replace("|", "\\|")
            lines.append(f"| `{key.name}` | {value} | {default} | {meaning} |")
        lines.append("")
    return "\n".join(lines)


def _has_default(key: Key) -> bool:
    return key.default is not None and key.default is not REQUIRED and key.default != ()


def json_schema() -> Schema:
    """The JSON Schema of a project file, from which editors complete keys and show what they mean.

    A key of [solve] may be that of any method.

    >>> json_schema()["properties"]["plan"]["properties"]["edge_length"]["type"]
    'number'
    """
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "pcmc project", **_table("")}


def _table(name: str) -> Schema:
    known = [section for section in sections() if section.name == name]
    keys = [*(key for section in known for key in section.keys), *(CURVE.keys if name in OR_CURVE else ())]
    properties: Schema = {}
    for key in keys:
        place = f"{name}.{key.name}".lstrip(".")
        entry = KINDS[key.kind]
        for one in {section.name for section in sections()} & {place, f"{place}.NAME"}:
            inner = _table(one)
            entry = _filled(entry, inner if one == place else TABLE | {"additionalProperties": inner})
        entry = entry | {"description": key.help.replace("``", "`")}
        entry |= {"enum": list(key.choices)} if key.choices else {}
        properties[key.name] = entry | ({"default": key.default} if _has_default(key) else {})
    return TABLE | {"description": known[0].help, "properties": properties, "additionalProperties": False}


def _filled(schema: Schema, table: Schema) -> Schema:
    if schema == TABLE:
        return table
    items = {"items": _filled(schema["items"], table)} if "items" in schema else {}
    choices = {"anyOf": [_filled(one, table) for one in schema["anyOf"]]} if "anyOf" in schema else {}
    return schema | items | choices
