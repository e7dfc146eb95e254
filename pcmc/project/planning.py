"""The project file for a drawing, to go on with: readable, with comments."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.errors import FileError, MissingExtra
from ..curves.curves import Curve
from ..plan import plan_from
from .drawn import FALLBACK, LENGTHS, height_targets, read
from .file import Project
from .start import surface_of

if TYPE_CHECKING:
    from ..plan.drawing import Drawing

DEFAULTS = {"bottom": "held"}


def drawing_reference(drawing: Path, project: Path) -> str:
    """The name by which a project refers to its drawing, which lies in the project's folder or below it.

    Raises
    ------
    FileError : for a drawing elsewhere; the message has the line to type.
    """
    try:
        name = Path(os.path.relpath(drawing, project.parent))
    except ValueError:  # another drive
        name = drawing.absolute()
    if name.is_absolute() or ".." in name.parts:
        beside = drawing.with_name(project.name)
        text = f"{project}: the drawing {drawing} is outside the folder of this project; to refer"
        text += f" to it, save the project beside the drawing: pcmc plan {drawing} -o {beside} --refer"
        raise FileError(text, what=str(project), found=str(drawing), expected=str(drawing.parent))
    return name.as_posix()


def project_text(
    path: str | os.PathLike[str],
    folder: str | os.PathLike[str] | None = None,
    *,
    units: str = "",
    gap: float | None = None,
    refer: bool = False,
) -> tuple[str, Drawing]:
    """The text of the project for a drawing, and the drawing.

    Parameters
    ----------
    path : of the drawing, .dxf or .3dm.
    folder : of the project, which refers to the drawing from there; by default the drawing's.
    units : the unit of length of the project; "" for the drawing's.
    gap : gaps between lines up to this length are closed, in that unit.
    refer : refer to the drawing by name, so that the project follows it, instead of holding its lines.

    Raises
    ------
    FileError, PlanError : for a drawing that cannot be read, is no plan, or is outside the folder of a
        project that refers to it.
    MissingExtra : without tomlkit or the library that reads the drawing.
    """
    try:
        import tomlkit
    except ModuleNotFoundError:
        raise MissingExtra("tomlkit", "cad") from None
    from ..plan.proposal import proposed

    path = Path(path)
    project = Path(folder or path.parent) / path.with_suffix(".toml").name
    name = drawing_reference(path, project) if refer else ""
    drawing = read(path, units, gap)
    values = proposed(drawing)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # no project is written that cannot be meshed
        surface_of(Project(path, plan_from(values), drawing=drawing))
    document = tomlkit.document()
    document.add(tomlkit.comment(f"The roof of {drawing.path.name}, written by pcmc plan"))
    for note in drawing.notes:
        document.add(tomlkit.comment(note))
    if drawing.units in LENGTHS:
        document["units"] = drawing.units
        document["units"].comment("of all lengths here")
    else:
        document.add(tomlkit.comment(f'units = "{FALLBACK}"  # the drawing has no unit of length'))
    document.add(tomlkit.nl())
    plan = tomlkit.table()
    if refer:
        plan["drawing"] = name
        plan["drawing"].comment("its layers are the lines; save it, and the roof follows")
        if gap is not None:
            plan["gap"] = gap
    plan["edge_length"] = values["edge_length"]
    plan["edge_length"].comment("of the triangles")
    if "plane" in values and not refer:
        plan["plane"] = _inline(tomlkit, values["plane"])
    if not refer:
        plan["outline"] = _curve(tomlkit, values["outline"], outline=True)
        if values["supports"]:
            plan["supports"] = _list(tomlkit, [_curve(tomlkit, s) for s in values["supports"]])
        if "mirrors" in values:
            plan["mirrors"] = _list(tomlkit, [_curve(tomlkit, m) for m in values["mirrors"]])
        if "edge" in values:
            plan["edge"], plan["cable"] = values["edge"], values["cable"]
            plan["cable"].comment("tension of the cables along the outline, between its supports")
    plan.add(tomlkit.nl())
    patches = tomlkit.table()
    patches.comment("a larger tension gives a flatter roof")
    for name, area in values["patches"].items():
        patches[name] = _inline(tomlkit, {k: v for k, v in area.items() if not (refer and k == "at")})
    plan["patches"] = patches
    for kind in ("holes", "dividers", "cables"):
        if values.get(kind):
            plan[kind] = _entries(tomlkit, values[kind], refer)
    document["plan"] = plan
    if len(drawing.heights) and not refer:
        document["targets"] = _targets(tomlkit, drawing, list(values["patches"]))
    output = tomlkit.table()
    output["files"] = [f"{drawing.path.stem}-roof.3dm"]
    output["picture"] = f"{drawing.path.stem}-roof.png"
    document["output"] = output
    return tomlkit.dumps(document), drawing


def proposal_text(project: Project) -> str:
    """What was chosen for a drawing that is solved without a project, in one line.

    >>> from tempfile import mkdtemp
    >>> import ezdxf
    >>> from .file import load
    >>> drawing = ezdxf.new()
    >>> _ = drawing.modelspace().add_circle((0, 0), 4, dxfattribs={"layer": "outline"})
    >>> path = Path(mkdtemp()) / "round.dxf"
    >>> drawing.saveas(path)
    >>> proposal_text(load(path)).split(";")[0]
    'proposed: tension 3.2, edges of 0.28'
    """
    assert project.plan is not None
    tensions = sorted({area.tension for area in project.plan.patches})
    walls = sorted(
        {divider.wall for divider in project.plan.dividers if isinstance(divider.wall, int | float)}
    )
    parts = [f"tension {' or '.join(f'{value:g}' for value in tensions)}"]
    parts += [f"walls of {' or '.join(f'{value:g}' for value in walls)}"] if walls else []
    parts.append(f"edges of {project.plan.edge_length:g}")
    name = project.path.with_suffix(".toml").name
    change = f"to change them: pcmc plan {project.path.name} -o {name}"
    return f"proposed: {', '.join(parts)}; {change}"


def _targets(tomlkit: Any, drawing: Drawing, names: list[str]) -> Any:
    table = tomlkit.table()
    table["meet"] = _list(tomlkit, [_inline(tomlkit, entry) for entry in height_targets(drawing)])
    table["vary"] = names
    table["vary"].comment("the tensions that may change for it")
    return table


def _entries(tomlkit: Any, entries: Any, refer: bool) -> Any:
    """The array of tables of dividers or holes; with ``refer`` without their curves."""
    array = tomlkit.aot()
    for entry in entries:
        table = tomlkit.table()
        table["name"] = entry["name"]
        if not refer:
            table["curve"] = _curve(tomlkit, entry["curve"])
        for key, value in entry.items():
            if key not in ("name", "curve") and DEFAULTS.get(key) != value:
                table[key] = value
                if key == "wall" and value:
                    table[key].comment("tension of the wall; more gives a sharper valley")
        array.append(table)
    return array


def _curve(tomlkit: Any, curve: Any, outline: bool = False) -> Any:
    """A curve as plain data, a line for each of its parts."""
    from ..curves.curve_data import curve_data

    data = curve_data(curve) if isinstance(curve, Curve) else [float(f"{x:.12g}") for x in curve]
    if outline and isinstance(data, Mapping) and data.get("closed"):
        data = data["polyline"]  # an outline is closed anyway
    if isinstance(data, list) and data and isinstance(data[0], Mapping):
        return _list(tomlkit, [_inline(tomlkit, part) for part in data])
    return _inline(tomlkit, data)


def _list(tomlkit: Any, items: Any) -> Any:
    array = tomlkit.array()
    for item in items:
        array.append(item)
    return array.multiline(True)


def _inline(tomlkit: Any, value: Any) -> Any:
    """Plain data in one line; long lists of points in several."""
    if isinstance(value, Mapping):
        table = tomlkit.inline_table()
        for key, item in value.items():
            table[key] = _inline(tomlkit, item)
        return table
    if isinstance(value, list):
        array = tomlkit.array()
        for item in value:
            array.append(_inline(tomlkit, item))
        return array
    return value
