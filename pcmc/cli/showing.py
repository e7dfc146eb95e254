"""The commands convert, plot and explore. Each returns the exit code."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from .. import project as projects
from ..base.errors import OptionError, unknown
from ..base.interrupts import defer_interrupts
from ..io import load, write
from ..surface import Surface, mirrored, unfolded
from . import OK, arguments
from .arguments import TOML, Colour, Input, Pressures, Settings, ViewName, Whole, option
from .progress import working


def convert(
    file: Input,
    output: Annotated[
        Path, typer.Argument(metavar="OUT", help="File to write; its suffix selects the format.")
    ],
    tension: Settings = None,
    pressure: Pressures = None,
    whole: Whole = False,
) -> int:
    """Write a surface in another format: .pcmc .fe .obj .ply .stl .vtp .vtu .glb .gltf .3dm.

    \b
    Example:
      pcmc convert roof.pcmc roof.3dm
    """
    projects.check_names([output])
    projects.check_outputs([output])
    surface = arguments.retensioned(arguments.surface_in(file), tension, pressure)
    data: dict[str, Any] = {}
    if file.suffix.lower() != TOML and not (tension or pressure):
        content = load(file)
        data = {"scalars": content.scalars, "certificate": content.certificate or None}
    if whole:
        unfold = unfolded(surface)
        scalars = data.get("scalars", {}).items()
        source = {surface.n: unfold.vertex, surface.m: unfold.face}
        surface, data = unfold.surface, {"scalars": {k: v[source[len(v)]] for k, v in scalars}}
    with defer_interrupts():
        write(output, surface, **data)
    print(f"written: {output}")
    return OK


def plot(
    file: Input,
    picture: Annotated[Path, typer.Argument(metavar="PNG")],
    view: ViewName = "diagonal",
    colour: Colour = "patches",
    whole: Whole = False,
) -> int:
    """Draw a surface, coloured by patch, mean curvature or curvature error, or with its reactions.

    \b
    Example:
      pcmc plot roof.pcmc roof.png --colour error
    """
    projects.check_names([], picture)
    seen = arguments.view_of(view)
    projects.check_picture(seen, colour)
    projects.check_outputs([picture])
    surface = arguments.surface_in(file)
    surface = mirrored(surface) if whole else surface
    projects.write_all([(picture, lambda path: projects.paint(surface, path, seen, colour))])
    print(f"written: {picture}")
    return OK


def explore(
    file: Annotated[Path | None, typer.Argument(metavar="[FILE]")] = None,
    example: Annotated[
        str | None, option("NAME", "A generator, such as two_caps, instead of a file.")
    ] = None,
    parameter: Annotated[
        list[str] | None, option("NAME=VALUE", "Parameter of the example; may be repeated.", "--set")
    ] = None,
    host: Annotated[str, option("ADDRESS", "Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, option("NUMBER", "Port; 0 for any free one.", parser=arguments.integer)] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in a browser.")] = True,
) -> int:
    """Explore a surface in the browser until Ctrl-C.

    \b
    Examples:
      pcmc explore roof.pcmc
      pcmc explore --example two_caps --set edge_length=1.2
    """
    from ..explore import open_and_wait, start

    if (file is None) == (example is None):
        raise OptionError("explore: give a file or --example, one of them", what="--example")
    with working() as say:
        say("building")
        if file is not None:
            surface, title = arguments.surface_in(file), file.name
        else:
            values = {name: listed[0] for name, listed in map(arguments.values_of, parameter or ())}
            surface, title = _example(str(example), values), str(example)
        say("solving")
        explorer = start(surface, host, port, title)
    open_and_wait(explorer, browser)
    return OK


def _example(name: str, parameters: dict[str, Any]) -> Surface:
    """The surface of a generator, named 'two_caps' or 'package.module:function'."""
    from ..sweep.case_script import resolve

    try:
        if ":" not in name:
            known: Any = resolve("generators:__all__")
            if name not in known:
                raise OptionError(unknown("example", name, known), what="--example", found=name)
        build = resolve(name if ":" in name else f"generators:{name}")
        inspect.signature(build).bind(**parameters)
    except OptionError:
        raise
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        raise OptionError(f"--example {name}: {error}", what="--example", found=name) from None
    return cast("Surface", build(**parameters))
