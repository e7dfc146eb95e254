"""The command line: which commands there are."""

from __future__ import annotations

from importlib.metadata import version
from typing import Annotated

import typer

from .showing import convert, explore, plot
from .solving import certify_, remesh_, solve_
from .sweeping import sweep

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


def _version(asked: bool) -> None:
    if asked:
        print("pcmc", version("pcmc-surfaces"))
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Say it and leave."),
    ] = False,
) -> None:
    pass


for name, act, what in (
    ("solve", solve_, "Solve a surface or a project, certify and write it."),
    ("certify", certify_, "Say what a finished surface is."),
    ("remesh", remesh_, "Other triangles, then solve and certify again."),
    ("convert", convert, "Write a surface in another format."),
    ("plot", plot, "Draw a surface."),
    ("sweep", sweep, "Solve every combination of some values, as a table."),
    ("explore", explore, "Move tensions and pressures by sliders, in the browser."),
):
    app.command(name, short_help=what)(act)
