"""The command repair. Returns the exit code."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Annotated

import typer

from .. import project as projects
from ..base.errors import FileError, FileWarning
from ..base.interrupts import defer_interrupts
from ..io import write
from ..io.repairing import HOLES, repair
from . import OK, arguments
from .arguments import number, option
from .progress import working

MESH = "A mesh: .obj .ply .stl .off .dae .3ds .x3d and others."
WELD = "Vertices nearer to each other than this become one; by default 1e-5 of the mesh's size."
CLOSED = "Edges of the largest hole that is closed; 0 closes none."
NEW_LENGTH = "Edge length of new triangles, for a scan; otherwise the triangles stay."


def repair_(
    file: Annotated[Path, typer.Argument(metavar="FILE", help=MESH)],
    output: Annotated[Path, option("FILE", "File to write.", "-o", "--output")],
    weld: Annotated[float | None, option("LENGTH", WELD, parser=number)] = None,
    holes: Annotated[int, option("NUMBER", CLOSED, parser=arguments.integer)] = HOLES,
    edge_length: Annotated[float | None, option("LENGTH", NEW_LENGTH, parser=number)] = None,
) -> int:
    """Repair a dirty mesh: weld, remove what is double or flat, close small holes. FILE stays as it is.

    \b
    Examples:
      pcmc repair mesh.obj -o clean.obj
      pcmc repair scan.ply -o clean.ply --weld 0.01 --edge-length 0.5
    """
    projects.check_names([output])
    projects.check_outputs([output])
    if output.resolve() == file.resolve():
        raise FileError(f"{output}: this is the mesh to repair; name another file", what=str(output))
    with working() as say:
        say("repairing")
        repaired = repair(file, weld=weld, holes=holes, edge_length=edge_length)
    with defer_interrupts(), warnings.catch_warnings():
        warnings.simplefilter("ignore", FileWarning)
        write(output, repaired.surface)
    print(repaired)
    print(f"written: {output}")
    return OK
