"""The command plan: a project file from a drawing. Returns the exit code."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Annotated

import typer

from .. import project as projects
from ..base.errors import FileError, FileWarning
from ..base.files import atomic_write, suffix_of
from ..base.units import LENGTHS
from . import OK
from .arguments import TOML, number, option
from .progress import working

GAP = "Gaps between lines up to this length are closed; by default a thousandth of the outline's diagonal."
LAYERS = "Layers: outline, divider NAME, hole NAME, support, mast NAME, height, patch NAME."


def plan(
    file: Annotated[Path, typer.Argument(metavar="DRAWING", help=f"A .dxf or .3dm. {LAYERS}")],
    output: Annotated[Path, option("FILE", "Project to write (.toml).", "-o", "--output")],
    units: Annotated[str, option("NAME", f"Unit of the project: {', '.join(LENGTHS)}.")] = "",
    gap: Annotated[float | None, option("LENGTH", GAP, parser=number)] = None,
    refer: Annotated[
        bool, typer.Option("--refer", help="Refer to the drawing, so that the project follows it.")
    ] = False,
) -> int:
    """Write the project file for a drawing: its lines, and tensions to begin with.

    \b
    Examples:
      pcmc plan hall.dxf -o hall.toml
      pcmc plan hall.3dm -o hall.toml --refer --units m
    """
    suffix_of(output, (TOML,), "a project")
    if output.exists():
        text = f"{output}: is there already; delete it, or name another file"
        raise FileError(text, what=str(output))
    projects.check_outputs([output])
    if refer:
        projects.drawing_reference(file, output)  # refuses a drawing elsewhere
    with working() as say:
        say("reading the drawing")
        text, drawing = projects.project_text(file, output.parent, units=units, gap=gap, refer=refer)
    for note in drawing.notes:
        warnings.warn(f"{file}: {note}", FileWarning, stacklevel=1)
    with atomic_write(output) as temporary:
        temporary.write_text(text, encoding="utf-8")
    print(f"written: {output}; solve it with: pcmc solve {output}")
    return OK
