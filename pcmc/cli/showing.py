"""convert, plot, explore: a surface for other programs and for the eye. Each returns the exit code."""

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
    retensioned,
    surface_in,
    values_of,
    view_of,
    whole,
)
from .codes import OK
from .progress import working


def convert(
    file: Input,
    output: Annotated[Path, typer.Argument(metavar="OUT", help="The suffix says the format.")],
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
    kept = _kept(file) if not (tension or pressure) else {}
    with defer_interrupts():
        write(output, surface, **kept)
    print(f"written: {output}")
    return OK


def _kept(file: Path) -> dict[str, Any]:
    """What a file says about its surface: scalars and certificate."""
    if file.suffix.lower() == TOML:
        return {}
    told = load(file)
    return {"scalars": told.scalars, "certificate": told.certificate or None}


def plot(
    file: Input,
    picture: Annotated[Path, typer.Argument(metavar="PNG")],
    view: ViewName = "diagonal",
    colour: Colour = "patches",
) -> int:
    """Draw a surface, coloured by patches, mean curvature or its relative error; or its reactions.

    \b
    Example:
      pcmc plot roof.pcmc roof.png --colour error
    """
    if picture.suffix.lower() != ".png":
        raise FileError(f"{picture}: a picture is written as .png; name it so")
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
        str | None, typer.Option(metavar="NAME", help="Such as two_caps, instead of a file.")
    ] = None,
    parameter: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="Of the example.")
    ] = None,
    host: Annotated[str, typer.Option(metavar="ADDRESS", help="To listen on.")] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(parser=whole, metavar="NUMBER", help="0 for any that is free.")
    ] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page.")] = True,
) -> int:
    """Explore a surface in the browser until Ctrl-C.

    \b
    Examples:
      pcmc explore roof.pcmc
      pcmc explore --example two_caps --set edge_length=1.2
    """
    from ..explore import open_and_wait, start

    if (file is None) == (example is None):
        raise OptionError("explore: give a file or --example, one of them")
    with working() as say:
        say("building")
        if file is not None:
            surface, title = surface_in(file), file.name
        else:
            given = dict(values_of(text) for text in parameter or ())
            values = {name: found[0] for name, found in given.items()}
            surface, title = _example(str(example), values), str(example)
        say("solving")
        explorer = start(surface, host, port, title)
    open_and_wait(explorer, browser)
    return OK


def _example(name: str, parameters: dict[str, Any]) -> Surface:
    """The surface of a generator, found by its name when it is asked for."""
    from ..sweep.case_script import resolve

    try:
        if ":" not in name:
            known: Any = resolve("generators:__all__")
            if name not in known:
                raise OptionError(unknown("example", name, known))
        build = resolve(name if ":" in name else f"generators:{name}")
        inspect.signature(build).bind(**parameters)
    except OptionError:
        raise
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        raise OptionError(f"--example {name}: {error}") from None
    surface: Surface = build(**parameters)
    return surface
