"""What the ``pcmc`` command can do. Each function is a command; it returns the exit code."""

from __future__ import annotations

import ast
import inspect
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from . import project as projects
from .certificate import Certificate, certify
from .errors import FileError, OptionError
from .io import read, write
from .solvers import solve
from .surface import Surface

OK, NOT_CERTIFIED, INTERRUPTED = 0, 1, 130
TOML = ".toml"

app = typer.Typer(
    add_completion=False,
    no_args_is_help=False,
    rich_markup_mode=None,  # plain text, the same on a terminal and in a pipe
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="""Roofs of patches in equilibrium: solve, certify, remesh, convert, draw, sweep, explore.

    Exit codes: 0 certified (or done, of a command that certifies nothing), 1 not certified, 2 bad input,
    130 stopped by Ctrl-C.
    """,
)

Input = Annotated[Path, typer.Argument(metavar="FILE", help="A surface, or a project (.toml).")]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--tension",
        metavar="NAME=VALUE",
        help="Tension of a patch; VALUE alone: of all under pressure.",
    ),
]
Pressures = Annotated[
    list[str] | None,
    typer.Option(
        "--pressure",
        metavar="NAME=VALUE",
        help="Pressure on a patch; VALUE alone: on all under pressure.",
    ),
]
View = Annotated[
    str, typer.Option(help="diagonal, elevation, plan, or AZIMUTH,ELEVATION in degrees.")
]
Colour = Annotated[str, typer.Option("--colour", "--color", help="patches, curvature or error.")]


@app.command("solve", short_help="Solve a surface or a project, certify and write it.")
def solve_(
    file: Input,
    output: Annotated[
        list[Path] | None, typer.Option("-o", "--output", help="File to write; may be repeated.")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="PNG to draw.")] = None,
    method: Annotated[str | None, typer.Option(help="newton, nesterov or lbfgs.")] = None,
    target: Annotated[
        str | None, typer.Option(help="minimum, or stationary for saddles too (newton).")
    ] = None,
    tension: Settings = None,
    pressure: Pressures = None,
    folder: Annotated[Path | None, typer.Option(help="Where a project's output goes.")] = None,
    anyway: Annotated[
        bool, typer.Option("--anyway", help="Write the output even if it is not certified.")
    ] = False,
) -> int:
    """Solve a surface or a project, certify it, and write it: all files, or none.

    \b
    Examples:
      pcmc solve roof.toml
      pcmc solve mesh.obj --tension 4 --tension wall=1.5 --pressure wall=0 -o roof.3dm --picture roof.png
    """
    if file.suffix.lower() == TOML:
        project = projects.load(file)
    else:
        project = projects.Project(file, None, "newton", {})
    options = dict(project.options)
    if method is not None and method != project.method:
        options = {}
    if target is not None:
        options["target"] = target
    base = file.parent if folder is None else folder
    files = list(output or [base / name for name in project.files])
    drawn = picture or (base / project.picture if project.picture else None)
    projects.check_outputs([*files, *([drawn] if drawn else [])])
    project = replace(project, method=method or project.method, options=options)
    with working() as say:
        say("reading")
        start = _retensioned(projects.surface_of(project), tension, pressure)
        result, design = projects.settle(project, start, say)
        good = result.certificate.certified and (design is None or design.met)
        if (good or anyway) and (files or drawn):
            if folder is not None:
                folder.mkdir(parents=True, exist_ok=True)
            written = projects.save(
                result, files, drawn, view=project.view, colour=project.colour, progress=say
            )
        else:
            written = []
    print(result.message)
    if design is not None:
        print(f"targets {design.message}")
    _report(result.certificate, written)
    if (files or drawn) and not written:
        print("nothing written (--anyway writes it all the same)")
    return OK if good else NOT_CERTIFIED


@app.command("certify", short_help="Say what a finished surface is.")
def certify_(file: Input, tension: Settings = None, pressure: Pressures = None) -> int:
    """Say what a surface is: forces left, curvature errors, stability, reactions.

    \b
    Example:
      pcmc certify roof.pcmc
    """
    with working() as say:
        say("certifying")
        found = certify(_retensioned(_read(file), tension, pressure))
    print(found)
    return _code(found)


@app.command("remesh", short_help="Other triangles, then solve and certify again.")
def remesh_(
    file: Input,
    edge_length: Annotated[float, typer.Option(help="Of the triangles, length.")],
    output: Annotated[list[Path], typer.Option("-o", "--output", help="File; may be repeated.")],
    near_curves: Annotated[
        float | None, typer.Option(help="Edge length at junctions and boundaries.")
    ] = None,
    solved: Annotated[
        bool, typer.Option("--solve/--no-solve", help="Solve and certify the new mesh.")
    ] = True,
) -> int:
    """Remesh a surface to an edge length, keeping patches and supports; solve and certify it again.

    \b
    Example:
      pcmc remesh roof.pcmc --edge-length 0.25 -o fine.pcmc
    """
    from .remesh import remesh

    projects.check_outputs(output)
    with working() as say:
        say("remeshing")
        surface = remesh(_read(file), edge_length, near_curves=near_curves)
        if not solved:
            for path in output:
                write(path, surface)
            print(f"{surface.m} triangles, not solved; written: {_names(output)}")
            return OK
        result = projects.uninterrupted(solve(surface, callback=projects.reporter(say)))
        say("certifying")
        written = (
            projects.save(result, output, progress=say) if result.certificate.certified else []
        )
    print(f"{surface.m} triangles; {result.message}")
    _report(result.certificate, written)
    return _code(result.certificate)


@app.command("convert", short_help="Write a surface in another format.")
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
    write(output, _retensioned(_read(file), tension, pressure))
    print(f"written: {output}")
    return OK


@app.command("plot", short_help="Draw a surface.")
def plot(
    file: Input,
    picture: Annotated[Path, typer.Argument(metavar="PNG")],
    view: View = "diagonal",
    colour: Colour = "patches",
) -> int:
    """Draw a surface, coloured by patches, mean curvature or its relative error.

    \b
    Example:
      pcmc plot roof.pcmc roof.png --view elevation --colour error
    """
    if picture.suffix.lower() != ".png":
        raise FileError(f"{picture}: a picture is written as .png; name it so")
    projects.paint(_read(file), picture, _view(view), colour)
    print(f"written: {picture}")
    return OK


@app.command("sweep", short_help="Solve every combination of a generator's parameters.")
def sweep(
    generator: Annotated[
        str, typer.Argument(help="package.module:function that returns a Surface.")
    ],
    values: Annotated[list[str], typer.Argument(metavar="NAME=V1,V2,...")],
    method: Annotated[str, typer.Option(help="newton, nesterov or lbfgs.")] = "newton",
    store: Annotated[
        Path | None, typer.Option(help="Keeps finished cases; run again to go on from there.")
    ] = None,
    csv: Annotated[Path | None, typer.Option(help="Table to write (.csv or .parquet).")] = None,
    workers: Annotated[int | None, typer.Option(help="Local processes; default: all.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Dask scheduler, tcp://HOST:8786.")] = None,
) -> int:
    """Solve a generator's surface for every combination of the values; exit code 0 if all are certified.

    \b
    Example:
      pcmc sweep generators:two_caps edge_length=1.2 alpha_large=2,4,8 --store caps.jsonl --csv caps.csv
    """
    from .sweep import Sweep, run, solve_case, write_table

    given = dict(_values(text) for text in values)
    grid = {name: found for name, found in given.items() if len(found) > 1}
    fixed = {name: found[0] for name, found in given.items() if len(found) == 1}
    cases = Sweep(solve_case, grid, {"generator": generator, "method": method, **fixed})
    if csv is not None and csv.suffix not in (".csv", ".parquet"):
        raise FileError(f"{csv}: a table is written as .csv or .parquet; name it so")
    with _bar() as draw:
        table = run(cases, store, scheduler=scheduler, workers=workers, on_record=draw)
    if csv is not None:
        write_table(csv, table)
    columns = [c for c in (*grid, "status", "verdict") if c in table]
    print(table[columns].to_string())
    if len(table) < len(cases):
        return INTERRUPTED
    return OK if table["verdict"].isin(["stable", "neutral"]).all() else NOT_CERTIFIED


@app.command("explore", short_help="Move tensions and pressures by sliders, in the browser.")
def explore(
    file: Annotated[Path | None, typer.Argument(metavar="[FILE]")] = None,
    example: Annotated[
        str | None, typer.Option(help="Such as two_caps, instead of a file.")
    ] = None,
    parameter: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="Of the example.")
    ] = None,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="0 for any that is free.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page.")] = True,
) -> int:
    """Explore a surface in the browser until Ctrl-C.

    \b
    Examples:
      pcmc explore roof.pcmc
      pcmc explore --example two_caps --set edge_length=1.2
    """
    from .explore import serve

    if (file is None) == (example is None):
        raise OptionError("explore: give a file or --example, one of them")
    if file is not None:
        serve(_read(file), host, port, browser, file.name)
    else:
        given = dict(_values(text) for text in parameter or ())
        surface = _example(str(example), {name: found[0] for name, found in given.items()})
        serve(surface, host, port, browser, str(example))
    return OK


@contextmanager
def working() -> Iterator[Callable[[str], None]]:
    """A function that shows what is being done, on stderr and only where that is a terminal."""
    if not _live():
        yield lambda words: None
        return
    from rich import progress
    from rich.console import Console

    columns = (
        progress.BarColumn(20),
        progress.TimeElapsedColumn(),
        progress.TextColumn("{task.description}", markup=False),
    )
    with progress.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)
        yield lambda words: bar.update(task, description=words)


@contextmanager
def _bar() -> Iterator[Any]:
    """The bar of a sweep, where stderr is a terminal."""
    from .sweep.bar import bar

    if not _live():
        yield None
        return
    from rich.console import Console

    with bar(Console(stderr=True)) as draw:
        yield draw


def _live() -> bool:
    """Whether stderr is a terminal that can redraw a line."""
    return sys.stderr.isatty() and os.environ.get("TERM") != "dumb"


def _read(file: Path) -> Surface:
    """A surface from its file, or the one that a project starts from."""
    return projects.build(file) if file.suffix.lower() == TOML else read(file)


def _retensioned(
    surface: Surface, tension: list[str] | None, pressure: list[str] | None
) -> Surface:
    loaded = [patch.name for patch in surface.patches if patch.pressure != 0.0]
    return surface.retensioned(
        _by_name(loaded, tension, "--tension"), _by_name(loaded, pressure, "--pressure")
    )


def _by_name(names: list[str], given: list[str] | None, option: str) -> dict[str, float]:
    """Values by patch from NAME=VALUE, and VALUE for those named; the later ones win."""
    found: dict[str, float] = {}
    for text in given or ():
        name, _, value = text.rpartition("=")
        try:
            number = float(value)
        except ValueError:
            raise OptionError(f"{option}: expected NAME=NUMBER or NUMBER, found {text!r}") from None
        found |= {name: number} if name else dict.fromkeys(names, number)
    return found


def _values(text: str) -> tuple[str, list[Any]]:
    """A name and its values from NAME=V1,V2.

    >>> _values("alpha=2,4.5"), _values("wall=upright")
    (('alpha', [2, 4.5]), ('wall', ['upright']))
    """
    name, sign, values = text.partition("=")
    if not (name and sign and values):
        raise OptionError(f"expected NAME=VALUE or NAME=V1,V2, found {text!r}")
    return name, [_value(one) for one in values.split(",")]


def _value(text: str) -> Any:
    words = {"true": True, "false": False, "none": None}
    if text.lower() in words:
        return words[text.lower()]
    try:
        number = ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text
    return number if isinstance(number, int | float) else text


def _view(text: str) -> Any:
    """The name of a view, or (azimuth, elevation)."""
    try:
        azimuth, elevation = (float(part) for part in text.split(","))
    except ValueError:
        return text
    return azimuth, elevation


def _example(name: str, parameters: dict[str, Any]) -> Surface:
    """The surface of a generator, found by its name when it is asked for."""
    from .sweep.child import resolve

    try:
        build = resolve(name if ":" in name else f"generators:{name}")
        inspect.signature(build).bind(**parameters)
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        raise OptionError(f"--example {name}: {error}") from None
    surface: Surface = build(**parameters)
    return surface


def _report(found: Certificate, written: list[Path]) -> None:
    print(*filter(None, (found.verdict.value, found.detail)), sep="\n")
    if written:
        print(f"written: {_names(written)}")


def _names(paths: list[Path]) -> str:
    return ", ".join(str(path) for path in paths)


def _code(found: Certificate) -> int:
    return OK if found.certified else NOT_CERTIFIED
