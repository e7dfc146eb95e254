"""The commands on files: convert, plot, explore, plan, repair, schema, cache. Each returns the exit code."""

from __future__ import annotations

import inspect
import json
import warnings
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from .. import project as projects
from ..base.errors import FileError, FileWarning, OptionError, unknown
from ..base.files import atomic_write, suffix_of
from ..base.interrupts import defer_interrupts
from ..base.units import LENGTHS
from ..explore import open_and_wait, start
from ..explore.roof import ShownRoof, read_roof
from ..io import metres_note, write
from ..io.repairing import HOLES, repair
from ..project import Outcome, cache
from ..project.planning import drawing_reference
from ..project.settings import check_names
from ..project.writing import check_outputs, picture_job, surface_files, write_all
from ..surface import Surface
from ..sweep.case_script import resolve
from . import NOT_CERTIFIED, OK, arguments, reports
from .arguments import OUTPUT, TOML, Cache, FileUnits, Input, Shown, Start, Whole, load_project
from .options import amount, count, option, parsed_unit, switch
from .reports import working

OUT = "File to write; its suffix selects the format."
SCALAR = "Scalar of the file that colours the vertices of a .glb or .usda."
EXAMPLE = "A generator, such as two_caps, instead of a file."
PARAMETER = "Parameter of the example; may be repeated."
WATCH = "Follow the file: when it, or a drawing that it refers to, is saved, the page shows the new roof."
COLOUR = "--colour", "--color"
SEEN = "diagonal, elevation, plan, or AZIMUTH,ELEVATION in degrees; by default the project's, or diagonal."
COLOURED = "patches, curvature, error or reactions; by default the project's, or patches."


def convert(
    *,
    file: Input,
    output: Annotated[Path, typer.Argument(metavar="OUT", help=OUT)],
    what: Shown,
    units: FileUnits = "",
    colour: Annotated[str, option("NAME", SCALAR, *COLOUR)] = "",
    whole: Whole = False,
) -> int:
    """Write a surface or a project's roof as .pcmc .fe .obj .ply .stl .vtp .vtu .glb .gltf .3dm .ifc .usda.

    \b
    Examples:
      pcmc convert roof.pcmc roof.3dm
      pcmc convert roof.toml roof.ifc
      pcmc convert roof.pcmc roof.glb --colour error
    """
    arguments.output_of(file, files=[output])
    if (roof := _good(file, what, whole, units)) is None:
        return NOT_CERTIFIED
    written = write_all(surface_files(roof, [output], colour))
    print(*(f"{note}\n" for note in metres_note([output], roof.units.length)), sep="", end="")
    return reports.ended(True, written)


def _good(file: Path, what: Shown, whole: bool, units: str = "") -> Outcome | None:
    """What is to be written or drawn. Print how the design of a project ended; None if it is not good."""
    with working() as progress:
        roof = what.roof(load_project(file, units), progress, whole)
    if roof.result is not None:
        reports.report(roof)
    if roof.result is None or roof.good:
        return roof
    print(f"nothing written (pcmc explore {file} shows this roof, --start the start shape)")
    return None


def plot(
    *,
    file: Input,
    picture: Annotated[Path, typer.Argument(metavar="PNG")],
    view: Annotated[str, option("NAME", SEEN)] = "",
    colour: Annotated[str, option("NAME", COLOURED, *COLOUR)] = "",
    what: Shown,
    whole: Whole = False,
) -> int:
    """Draw a surface or a project's roof, by patch, mean curvature, curvature error, or with its reactions.

    \b
    Examples:
      pcmc plot roof.pcmc roof.png --colour error
      pcmc plot roof.toml start.png --start
      pcmc plot half.pcmc roof.png --whole
    """
    given: dict[str, Any] = {"picture": picture} | ({"colour": colour} if colour else {})
    given |= {"view": arguments.parsed_view(view, picture), "views": None} if view else {}
    arguments.output_of(file, **given)
    if (roof := _good(file, what, whole)) is None:
        return NOT_CERTIFIED
    look = replace(roof.output, **given)
    return reports.ended(True, write_all([picture_job(roof, picture, look.all_views, look.colour)]))


def explore(
    file: Annotated[Path | None, typer.Argument(metavar="[FILE]")] = None,
    example: Annotated[str | None, option("NAME", EXAMPLE)] = None,
    parameter: Annotated[list[str] | None, option("NAME=VALUE", PARAMETER, "--set")] = None,
    host: Annotated[str, option("ADDRESS", "Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, count("Port; 0 for any free one.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in a browser.")] = True,
    watch: Annotated[bool, switch("--watch", WATCH)] = False,
    start_shape: Start = False,
    cache: Cache = True,
) -> int:
    """Explore a surface, or a project's roof, in the browser until Ctrl-C.

    \b
    Examples:
      pcmc explore roof.pcmc
      pcmc explore roof.toml --watch
      pcmc explore --example two_caps --set edge_length=1.2
    """
    if (file is None) == (example is None):
        raise OptionError("explore: give a file or --example, one of them", what="--example")
    needs: dict[str, Any] = {"--watch": (watch, file, "a file"), "--start": (start_shape, file, "a file")}
    needs["--set"] = parameter, example, "an --example"
    for flag, (given, wanted, need) in needs.items():
        if given and wanted is None:
            raise OptionError(f"explore: {flag} needs {need}", what=flag)
    again = None
    with working() as progress:
        progress("building")
        if file is not None:
            arguments.check_suffix(file)
            arguments.check_start(start_shape, file)
            read = partial(read_roof, file, start_shape=start_shape, use_cache=cache)
            roof, again = read(progress=progress, report=reports.report), read if watch else None
        else:
            values = dict[str, Any]()
            for name, listed in map(arguments.named_values, parameter or ()):
                if name in values or len(listed) > 1:
                    raise OptionError(f"--set {name}: give one value", what="--set", where=name)
                values[name] = listed[0]
            roof = ShownRoof.of(_example(str(example), values), str(example))
        progress("solving")
        explorer = start(roof, host, port, watch=again)
    open_and_wait(explorer, browser)
    return OK


def _example(name: str, parameters: dict[str, Any]) -> Surface:
    try:
        known: Any = [name] if ":" in name else resolve("generators:__all__")
        if name not in known:
            raise OptionError(unknown("example", name, known), what="--example", found=name)
        build = resolve(name if ":" in name else f"generators:{name}")
        inspect.signature(build).bind(**parameters)
    except OptionError:
        raise
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        raise OptionError(f"--example {name}: {error}", what="--example", found=name) from None
    return cast("Surface", build(**parameters))


GAP = "Gaps between lines up to this length are closed; by default a thousandth of the outline's diagonal."
LAYERS = "Layers: outline, divider NAME, hole NAME, upright NAME, cable NAME, free, mirror, support,"
LAYERS += " mast NAME, height, patch NAME."
REFER = "Refer to the drawing, so that the project follows it."
MESH = "A mesh: .obj .ply .stl .off .dae .3ds .x3d and others."
WELD = "Vertices nearer to each other than this become one; by default 1e-5 of the mesh's size."
UNITS = "Unit of length wanted: m, cm, mm, ft or in; a file without one is taken to be in it."
UP = "The axis that was up where the mesh was drawn: x, y or z; it is turned to be z."
NEW_LENGTH = "Edge length of new triangles, for a scan; otherwise the triangles stay."


def plan(
    file: Annotated[Path, typer.Argument(metavar="DRAWING", help=f"A .dxf or .3dm. {LAYERS}")],
    output: Annotated[Path, option("FILE", "Project to write (.toml).", *OUTPUT)],
    units: Annotated[
        str, option("NAME", f"Unit of the project: {', '.join(LENGTHS)}.", parser=parsed_unit)
    ] = "",
    gap: Annotated[float | None, amount("LENGTH", GAP)] = None,
    refer: Annotated[bool, switch("--refer", REFER)] = False,
) -> int:
    """Write the project file for a drawing: its lines, and tensions to begin with.

    \b
    Examples:
      pcmc plan hall.dxf -o hall.toml
      pcmc plan hall.3dm -o hall.toml --refer --units m
    """
    suffix_of(output, (TOML,), "a project")
    if output.exists():
        raise FileError(f"{output}: is there already; delete it, or name another file", what=str(output))
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
    weld: Annotated[float | None, amount("LENGTH", WELD)] = None,
    holes: Annotated[int, count("Edges of the largest hole that is closed; 0 closes none.")] = HOLES,
    edge_length: Annotated[float | None, amount("LENGTH", NEW_LENGTH)] = None,
    units: Annotated[str, option("NAME", UNITS, parser=parsed_unit)] = "",
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


def cache_(clear: Annotated[bool, switch("--clear", "Remove all roofs that are kept.")] = False) -> int:
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
