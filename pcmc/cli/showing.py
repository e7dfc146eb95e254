"""The commands convert, plot and explore. Each returns the exit code."""

from __future__ import annotations

import inspect
from functools import partial
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from ..base.errors import OptionError, unknown
from ..io import metres_note
from ..project import Outcome
from ..project.writing import draw_picture, surface_files, write_all
from ..surface import Surface
from . import NOT_CERTIFIED, OK, arguments, reports
from .arguments import Cache, FileUnits, Input, Shown, Start, ViewName, Whole, count, flag, load, option
from .progress import working

OUT = "File to write; its suffix selects the format."
SCALAR = "Scalar of the file that colours the vertices of a .glb or .usda."
EXAMPLE = "A generator, such as two_caps, instead of a file."
PARAMETER = "Parameter of the example; may be repeated."
WATCH = "Follow the file: when it, or a drawing that it refers to, is saved, the page shows the new roof."
COLOUR = "--colour", "--color"


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
    roof = _good(file, what, whole, units)
    if roof is None:
        return NOT_CERTIFIED
    written = write_all(surface_files(roof, [output], colour))
    print(*(f"{note}\n" for note in metres_note([output], roof.units.length)), sep="", end="")
    return reports.ended(True, written)


def _good(file: Path, what: Shown, whole: bool, units: str = "") -> Outcome | None:
    """What is to be written or drawn. Print how the design of a project ended; None if it is not good."""
    with working() as progress:
        roof = what.roof(load(file, units), progress, whole)
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
    view: ViewName = "diagonal",
    colour: Annotated[str, option("NAME", "patches, curvature, error or reactions.", *COLOUR)] = "patches",
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
    seen = arguments.parsed_view(view)
    arguments.output_of(file, picture=picture, view=seen, colour=colour)
    roof = _good(file, what, whole)
    if roof is None:
        return NOT_CERTIFIED
    painting = partial(draw_picture, roof.shown.surface, views=[seen], colour=colour, units=roof.units)
    return reports.ended(True, write_all([(picture, painting)]))


def explore(
    file: Annotated[Path | None, typer.Argument(metavar="[FILE]")] = None,
    example: Annotated[str | None, option("NAME", EXAMPLE)] = None,
    parameter: Annotated[list[str] | None, option("NAME=VALUE", PARAMETER, "--set")] = None,
    host: Annotated[str, option("ADDRESS", "Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, count("Port; 0 for any free one.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in a browser.")] = True,
    watch: Annotated[bool, flag("--watch", WATCH)] = False,
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
    from ..explore import open_and_wait, start
    from ..explore.roof import ShownRoof, read_roof

    if (file is None) == (example is None):
        raise OptionError("explore: give a file or --example, one of them", what="--example")
    if watch and file is None:
        raise OptionError("explore: --watch needs a file", what="--watch")
    again = None
    with working() as progress:
        progress("building")
        if file is not None:
            arguments.check_suffix(file)
            read = partial(read_roof, file, start_shape=start_shape, use_cache=cache)
            roof, again = read(progress=progress, report=reports.report), read if watch else None
        else:
            values = {name: listed[0] for name, listed in map(arguments.named_values, parameter or ())}
            roof = ShownRoof.of(_example(str(example), values), str(example))
        progress("solving")
        explorer = start(roof, host, port, watch=again)
    open_and_wait(explorer, browser)
    return OK


def _example(name: str, parameters: dict[str, Any]) -> Surface:
    """The surface of a generator, named 'two_caps' or 'package.module:function'."""
    from ..sweep.case_script import resolve

    try:
        known: Any = () if ":" in name else resolve("generators:__all__")
        if ":" not in name and name not in known:
            raise OptionError(unknown("example", name, known), what="--example", found=name)
        build = resolve(name if ":" in name else f"generators:{name}")
        inspect.signature(build).bind(**parameters)
    except OptionError:
        raise
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        raise OptionError(f"--example {name}: {error}", what="--example", found=name) from None
    return cast("Surface", build(**parameters))
