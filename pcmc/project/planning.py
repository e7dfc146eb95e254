"""The project file for a drawing, to go on with: readable, with comments."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..base.arrays import toml, toml_key
from ..base.errors import FileError
from ..base.files import PathLike
from ..plan import plan_from
from ..plan.drawing import Drawing
from ..plan.proposal import proposed
from ..surface.curve_data import curve_data
from ..surface.curves import Curve
from .drawn import FALLBACK, LENGTHS, drawing_of, height_targets
from .file import Project
from .start import surface_of

SHARPER = " # tension of the wall; more gives a sharper valley"


def drawing_reference(drawing: Path, project: Path) -> str:
    """The name by which a project refers to its drawing; FileError for one outside the project's folder."""
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
    path: PathLike,
    folder: PathLike | None = None,
    *,
    units: str = "",
    gap: float | None = None,
    refer: bool = False,
) -> tuple[str, Drawing]:
    """The text of the project for a drawing, .dxf or .3dm, and the drawing.

    ``units``: by default the drawing's. ``gap``: gaps up to it are closed. ``refer``: by name, instead of
    its lines; ``folder`` is the project's, by default the drawing's. FileError, PlanError, MissingExtra.
    """
    path = Path(path)
    project = Path(folder or path.parent) / path.with_suffix(".toml").name
    name = drawing_reference(path, project) if refer else ""
    drawing = drawing_of(path, units, gap)
    values = proposed(drawing)
    with warnings.catch_warnings(action="ignore"):  # no project is written that cannot be meshed
        surface_of(Project(path, plan_from(values), drawing=drawing))
    return _text(drawing, values, name, gap), drawing


def _text(drawing: Drawing, values: Mapping[str, Any], name: str, gap: float | None) -> str:
    """The project of these values; with the ``name`` of a drawing it refers to that for its lines."""
    lines = [f"# The roof of {drawing.path.name}, written by pcmc plan", *(f"# {n}" for n in drawing.notes)]
    unit = f'units = "{drawing.units}" # of all lengths here'
    missing = f'# units = "{FALLBACK}"  # the drawing has no unit of length'
    lines += [unit if drawing.units in LENGTHS else missing, "", "[plan]"]
    if name:
        lines.append(f"drawing = {toml(name)} # its layers are the lines; save it, and the roof follows")
        lines += [] if gap is None else [f"gap = {toml(gap)}"]
    lines.append(f"edge_length = {toml(values['edge_length'])} # of the triangles")
    if not name:
        lines += [f"plane = {toml(values['plane'])}"] if "plane" in values else []
        lines.append(f"outline = {_curve(values['outline'], closed=True)}")
        for key in ("supports", "mirrors"):
            if values.get(key):
                lines.append(f"{key} = {_list(map(_curve, values[key]))}")
        if "edge" in values:
            comment = "tension of the cables along the outline, between its supports"
            lines += [f"edge = {toml(values['edge'])}", f"cable = {toml(values['cable'])} # {comment}"]
    lines += ["", "[plan.patches] # a larger tension gives a flatter roof"]
    for patch, area in values["patches"].items():
        own = {key: value for key, value in area.items() if not (name and key == "at")}
        lines.append(f"{toml_key(patch)} = {toml(own)}")
    for kind in ("holes", "dividers", "cables"):
        for entry in values.get(kind, ()):
            lines += ["", f"[[plan.{kind}]]", f"name = {toml(entry['name'])}"]
            for key, value in entry.items():
                if key == "name" or (key == "curve" and name) or (key, value) == ("bottom", "held"):
                    continue
                comment = SHARPER if key == "wall" and value else ""
                lines.append(f"{key} = {_curve(value) if key == 'curve' else toml(value)}{comment}")
    if len(drawing.heights) and not name:
        lines += ["", "[targets]", f"meet = {_list(height_targets(drawing))}"]
        lines.append(f"vary = {toml(list(values['patches']))} # the tensions that may change for it")
    roof = f"{drawing.path.stem}-roof"
    lines += ["", "[output]", f"files = {toml([f'{roof}.3dm'])}", f"picture = {toml(f'{roof}.png')}", ""]
    return "\n".join(lines)


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
    walls = {divider.wall for divider in project.plan.dividers if isinstance(divider.wall, int | float)}
    values = {"tension": {area.tension for area in project.plan.patches}, "walls of": walls}
    values["edges of"] = {project.plan.edge_length}
    parts = [f"{what} {' or '.join(f'{v:g}' for v in sorted(own))}" for what, own in values.items() if own]
    return f"proposed: {', '.join(parts)}; to change them: {project.plan_command}"


def _curve(curve: Any, closed: bool = False) -> str:
    """A curve, or a point, in TOML, a line for each part; where all are ``closed``, none says it."""
    data = curve_data(curve) if isinstance(curve, Curve) else [float(f"{x:.12g}") for x in curve]
    if closed and isinstance(data, Mapping) and data.get("closed"):
        data = data["polyline"]
    return _list(data) if isinstance(data, list) and isinstance(data[0], Mapping) else toml(data)


def _list(items: Iterable[Any]) -> str:
    """A list in TOML, a line for each item; texts are TOML already."""
    return "[\n" + "".join(f"    {i if isinstance(i, str) else toml(i)},\n" for i in items) + "]"
