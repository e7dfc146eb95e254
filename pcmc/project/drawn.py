"""Projects whose plan is a drawing: ``[plan] drawing = "hall.dxf"``, or the drawing itself as a project."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from pathlib import Path, PureWindowsPath
from typing import Any

from ..base.errors import FileError, MissingExtra, OptionError, PcmcError
from ..base.files import PathLike, as_path, check_name, check_regular
from ..base.units import LENGTHS
from ..plan.drawing import Drawing, read_drawing
from ..plan.plan import Chosen
from ..plan.proposal import proposal
from ..plan.strokes import layer_of, read_strokes
from .checking import in_file

DXF, RHINO = ".dxf", ".3dm"
FALLBACK = "m"  # the unit of a project whose drawing has one that projects do not have


def is_drawing(path: Path) -> bool:
    """Whether a file is the drawing of a plan: a .dxf, or a .3dm with curves on a layer "outline"."""
    suffix = path.suffix.lower()
    if suffix != RHINO:
        return suffix == DXF

    with suppress(PcmcError, MissingExtra, OSError):  # the reader of surfaces has the better error
        for stroke in read_strokes(path).strokes:
            layer = layer_of(stroke.layer)
            if stroke.curve is not None and layer is not None and layer.role == "outline":
                return True
    return False


def files_of(path: PathLike) -> list[Path]:
    """The files that a project depends on: itself, and its drawing or mesh if it can be read.

    >>> files_of("notebooks/roof.toml")
    [PosixPath('notebooks/roof.toml')]
    """
    path = as_path(path)
    with suppress(OSError, ValueError, RecursionError, PcmcError):  # of TOML, of UTF-8
        if path.suffix.lower() == ".toml":
            check_regular(path)
            data = tomllib.loads(path.read_text(encoding="utf-8-sig"))
            plan, mesh = data.get("plan"), data.get("mesh")
            name = plan.get("drawing") if isinstance(plan, Mapping) else mesh
            name = name.get("file") if isinstance(name, Mapping) else name
            return [path] if not isinstance(name, str) else [path, path.parent / name]
    return [path]


def with_drawing(path: Path, data: Mapping[str, Any]) -> tuple[Mapping[str, Any], Drawing | None, Chosen]:
    """The data of a project with its drawing's lines and what is proposed; the drawing; what was chosen.

    Points of the layer "height" become targets where the project has none. Errors as in ``load``.
    """
    plan = dict(data["plan"])
    name, gap = plan.pop("drawing", None), plan.pop("gap", None)
    with in_file(path):
        if name is None and gap is not None:
            raise FileError("plan.gap is for a drawing; add drawing = or remove it", what="plan.gap")
        if name is None:
            return data, None, Chosen()
        if "outline" in plan:
            text = "a plan has an outline or a drawing, not both; remove one of them"
            raise FileError(text, what="plan.outline")
        check_beside(name, "drawing")
    drawing = drawing_of(path.parent / name, str(data.get("units", "")), gap)

    try:
        lines, chosen = proposal(drawing, plan)
    except OptionError as error:
        raise error.in_file(path, FileError) from None
    full = {**data, "plan": lines} | ({"units": drawing.units} if drawing.units else {})
    if len(drawing.heights) and "targets" not in data:
        full["targets"] = {"meet": height_targets(drawing), "vary": list(lines["patches"])}
    return full, drawing, chosen


def height_targets(drawing: Drawing) -> list[dict[str, Any]]:
    """The points of the layer "height" as targets of a project."""
    points = (drawing.heights - [0.0, 0.0, drawing.level]).tolist()
    return [{"quantity": "height", "of": [x, y], "value": z} for x, y, z in points]


def leads_outside(name: str) -> bool:
    """Whether a name leads out of a folder; FileError for one that no file can have.

    >>> leads_outside("plans/hall.dxf"), leads_outside("../hall.dxf"), leads_outside("C:hall.dxf")
    (False, True, True)
    """
    check_name(Path(name))
    windows = PureWindowsPath(name)  # knows both kinds of slashes
    return bool(windows.drive or windows.root or ".." in windows.parts)


def check_beside(name: str, kind: str) -> None:
    """Refuse a drawing or mesh outside the folder of the project that refers to it."""
    if leads_outside(name):
        text = f"the {kind} {name!r} is outside the project's folder; put it beside the project"
        raise FileError(text, what=f"plan.{kind}" if kind == "drawing" else kind, found=name)


def drawing_of(path: Path, units: str, gap: float | None) -> Drawing:
    """The drawing in a project's unit of length; one without units takes the drawing's, or metres."""
    try:
        state = path.stat()
    except OSError as error:
        text = f"{path}: the drawing cannot be read ({error.strerror or error})"
        raise FileError(text, what="plan.drawing", found=str(path)) from None
    return _read(path, units, gap, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=8)  # a sweep loads its project for each case
def _read(path: Path, units: str, gap: float | None, time: int, size: int) -> Drawing:
    drawing = read_drawing(path, units, gap)
    unknown = drawing.units not in ("", *LENGTHS)
    return read_drawing(path, FALLBACK, gap) if unknown else drawing
