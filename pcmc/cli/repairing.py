"""The command repair. Returns the exit code."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .. import project as projects
from ..base.interrupts import defer_interrupts
from ..io import metres_note, write
from ..io.repairing import HOLES, repair
from . import OK, arguments
from .arguments import number, option
from .progress import working

MESH = "A mesh: .obj .ply .stl .off .dae .3ds .x3d and others."
WELD = "Vertices nearer to each other than this become one; by default 1e-5 of the mesh's size."
UNITS = "Unit of length wanted: m, cm, mm, ft or in; a file without one is taken to be in it."
CLOSED = "Edges of the largest hole that is closed; 0 closes none."
UP = "The axis that was up where the mesh was drawn: x, y or z; it is turned to be z."
NEW_LENGTH = "Edge length of new triangles, for a scan; otherwise the triangles stay."


def repair_(
    file: Annotated[Path, typer.Argument(metavar="FILE", help=MESH)],
    output: Annotated[Path, option("FILE", "File to write.", "-o", "--output")],
    weld: Annotated[float | None, option("LENGTH", WELD, parser=number)] = None,
    holes: Annotated[int, option("NUMBER", CLOSED, parser=arguments.integer)] = HOLES,
    edge_length: Annotated[float | None, option("LENGTH", NEW_LENGTH, parser=number)] = None,
    units: Annotated[str, option("NAME", UNITS)] = "",
    up: Annotated[str, option("AXIS", UP)] = "z",
) -> int:
    """Repair a dirty mesh: weld, remove what is double or flat, close small holes. FILE stays as it is.

    \b
    Examples:
      pcmc repair mesh.obj -o clean.obj
      pcmc repair scan.ply -o clean.ply --weld 0.01 --edge-length 0.5
      pcmc repair blender.obj -o hall.obj --units mm --up y
    """
    projects.check_names([output])
    projects.check_outputs([output], inputs=[file])
    with working() as say:
        say("repairing")
        repaired = repair(file, weld=weld, holes=holes, edge_length=edge_length, units=units, up=up)
    with defer_interrupts():
        write(output, repaired, units=repaired.units)
    print(repaired, *metres_note([output], repaired.units.length), f"written: {output}", sep="\n")
    return OK
