"""The commands plan, repair, schema and cache: files before and beside a roof. Each returns the exit code."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Annotated

import typer

from .. import project as projects
from ..base.errors import FileError, FileWarning
from ..base.files import atomic_write, suffix_of
from ..base.interrupts import defer_interrupts
from ..base.units import LENGTHS
from ..io import metres_note, write
from ..io.repairing import HOLES, repair
from ..project import cache
from ..project.planning import drawing_reference
from ..project.settings import check_names
from ..project.writing import check_outputs
from . import OK
from .arguments import OUTPUT, TOML, count, flag, option, real
from .progress import working

GAP = "Gaps between lines up to this length are closed; by default a thousandth of the outline's diagonal."
LAYERS = "Layers: outline, divider NAME, hole NAME, support, mast NAME, height, patch NAME."
REFER = "Refer to the drawing, so that the project follows it."
MESH = "A mesh: .obj .ply .stl .off .dae .3ds .x3d and others."
WELD = "Vertices nearer to each other than this become one; by default 1e-5 of the mesh's size."
UNITS = "Unit of length wanted: m, cm, mm, ft or in; a file without one is taken to be in it."
CLOSED = "Edges of the largest hole that is closed; 0 closes none."
UP = "The axis that was up where the mesh was drawn: x, y or z; it is turned to be z."
NEW_LENGTH = "Edge length of new triangles, for a scan; otherwise the triangles stay."


def plan(
    file: Annotated[Path, typer.Argument(metavar="DRAWING", help=f"A .dxf or .3dm. {LAYERS}")],
    output: Annotated[Path, option("FILE", "Project to write (.toml).", *OUTPUT)],
    units: Annotated[str, option("NAME", f"Unit of the project: {', '.join(LENGTHS)}.")] = "",
    gap: Annotated[float | None, real("LENGTH", GAP)] = None,
    refer: Annotated[bool, flag("--refer", REFER)] = False,
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
    check_outputs([output])
    if refer:
        drawing_reference(file, output)  # refuses a drawing elsewhere
    with working() as progress:
        progress("reading the drawing")
        text, drawing = projects.project_text(file, output.parent, units=units, gap=gap, refer=refer)
    for note in drawing.notes:
        warnings.warn(f"{file}: {note}", FileWarning, stacklevel=1)
    with atomic_write(output) as temporary:
        temporary.write_text(text, encoding="utf-8")
    print(f"written: {output}; solve it with: pcmc solve {output}")
    return OK


def repair_(
    file: Annotated[Path, typer.Argument(metavar="FILE", help=MESH)],
    output: Annotated[Path, option("FILE", "File to write.", *OUTPUT)],
    weld: Annotated[float | None, real("LENGTH", WELD)] = None,
    holes: Annotated[int, count(CLOSED)] = HOLES,
    edge_length: Annotated[float | None, real("LENGTH", NEW_LENGTH)] = None,
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
    check_names([output])
    check_outputs([output], inputs=[file])
    with working() as progress:
        progress("repairing")
        repaired = repair(file, weld=weld, holes=holes, edge_length=edge_length, units=units, up=up)
    with defer_interrupts():
        write(output, repaired, units=repaired.units)
    print(repaired, *metres_note([output], repaired.units.length), f"written: {output}", sep="\n")
    return OK


def schema() -> int:
    """Print the JSON Schema of project files, from which editors complete their keys.

    \b
    Example:
      pcmc schema > pcmc.schema.json
    """
    print(json.dumps(projects.json_schema(), indent=1))
    return OK


def cache_(clear: Annotated[bool, flag("--clear", "Remove all roofs that are kept.")] = False) -> int:
    """Show where the roofs of projects solved before are kept, or remove them.

    The variable PCMC_CACHE names another folder; PCMC_CACHE=off keeps nothing.

    \b
    Example:
      pcmc cache --clear
    """
    folder = cache.cache_folder()
    if folder is None:
        print("no roofs are kept (PCMC_CACHE=off)")
    elif clear:
        print(f"{len(cache.clear_cache())} roofs removed from {folder}")
    else:
        files = cache.cached_files()
        print(f"{len(files)} roofs in {folder}, {sum(file.stat().st_size for file in files) / 1e6:.1f} MB")
    return OK
