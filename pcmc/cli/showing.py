"""The commands convert, plot and explore. Each returns the exit code."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Annotated, Any

import typer

from .. import project as projects
from ..base.errors import FileError, OptionError, unknown
from ..base.interrupts import defer_interrupts
from ..io import load, write
from ..surface import Surface
from .arguments import (
    TOML,
    Colour,
    Input,
    Pressures,
    Settings,
    ViewName,
    integer,
    retensioned,
    surface_in,
    values_of,
    view_of,
)
from .codes import OK
from .progress import working


def convert(
    file: Input,
    output: Annotated[
        Path, typer.Argument(metavar="OUT", help="File to write; its suffix selects the format.")
    ],
    tension: Settings = None,
    pressure: Pressures = None,
) -> int:
    """Write a surface in another format: .pcmc .fe .obj .ply .stl .vtp .vtu .glb .gltf .3dm.

    \b
    Example:
      pcmc convert roof.pcmc roof.3dm
    """
    projects.check_names([output])
    projects.check_outputs([output])
    surface = retensioned(surface_in(file), tension, pressure)
    data = _data(file) if not (tension or pressure) else {}
    with defer_interrupts():
        write(output, surface, **data)
    print(f"written: {output}")
    return OK


def _data(file: Path) -> dict[str, Any]:
    """The scalars and the certificate in a file."""
    if file.suffix.lower() == TOML:
        return {}
    content = load(file)
    return {"scalars": content.scalars, "certificate": content.certificate or None}


def plot(
    file: Input,
    picture: Annotated[Path, typer.Argument(metavar="PNG")],
    view: ViewName = "diagonal",
    colour: Colour = "patches",
) -> int:
    """Draw a surface, coloured by patch, mean curvature or curvature error, or with its reactions.

    \b
    Example:
      pcmc plot roof.pcmc roof.png --colour error
    """
    if picture.suffix.lower() != ".png":
        raise FileError(
            f"{picture}: a picture is written as .png; change the suffix",
            what=str(picture),
            found=picture.suffix,
            expected=".png",
        )
    seen = view_of(view)
    projects.check_picture(seen, colour)
    projects.check_outputs([picture])
    surface = surface_in(file)
    projects.write_all([(picture, lambda path: projects.paint(surface, path, seen, colour))])
    print(f"written: {picture}")
    return OK


def explore(
    file: Annotated[Path | None, typer.Argument(metavar="[FILE]")] = None,
    example: Annotated[
        str | None, typer.Option(metavar="NAME", help="A generator, such as two_caps, instead of a file.")
    ] = None,
    parameter: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Parameter of the example; may be repeated."),
    ] = None,
    host: Annotated[str, typer.Option(metavar="ADDRESS", help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(parser=integer, metavar="NUMBER", help="Port; 0 for any free one.")
    ] = 0,
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
            surface, title = surface_in(file), file.name
        else:
            given = dict(values_of(text) for text in parameter or ())
            values = {name: listed[0] for name, listed in given.items()}
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
    surface: Surface = build(**parameters)
    return surface
