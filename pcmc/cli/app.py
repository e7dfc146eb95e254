"""The list of commands."""

from __future__ import annotations

from importlib.metadata import version
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from ..base.errors import OptionError
from .arguments import with_groups
from .building import pattern, structure
from .drawing import draw_, panels_, report_
from .files import cache_, convert, explore, plan, plot, repair_, schema
from .solving import certify_, equilibria_, remesh_, solve_, sweep


class Command(TyperCommand):
    """A command that refuses an option given twice. Typer itself takes the last one."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        *_, order = self.make_parser(ctx).parse_args(args=[*args])
        for option in order:
            if order.count(option) > 1 and not getattr(option, "multiple", True):  # an argument has none
                raise OptionError(f"{option.opts[-1]} is given twice; keep one", what=option.opts[-1])
        return super().parse_args(ctx, args)


app = typer.Typer(
    add_completion=False,
    no_args_is_help=False,
    rich_markup_mode=None,  # plain text, the same on a terminal and in a pipe
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="""Roofs of patches in equilibrium: solve, certify, remesh, convert, draw, report, sweep, explore.

    Exit codes: 0 the result is certified (or the command has done its work and certifies nothing), 1 the
    result is not certified, 2 bad input, 130 stopped by Ctrl-C.
    """,
    epilog="To begin: pcmc solve roof.toml, or pcmc solve hall.dxf --rise 2 -o hall.3dm."
    " pcmc COMMAND --help explains a command.",
)


def _show_version(wanted: bool) -> None:
    if wanted:
        print("pcmc", version("pcmc-surfaces"))
        raise typer.Exit


SHOW = typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")


@app.callback()
def _options(version: Annotated[bool, SHOW] = False) -> None:
    pass


for name, command, summary in (
    ("solve", solve_, "Solve a surface or a project, certify and write it."),
    ("certify", certify_, "Check a surface: forces, curvature, stability."),
    ("remesh", remesh_, "Change the triangle size, solve and certify again."),
    ("convert", convert, "Write a surface in another format."),
    ("plot", plot, "Draw a surface."),
    ("repair", repair_, "Repair a dirty mesh."),
    ("plan", plan, "Write the project file for a drawing."),
    ("schema", schema, "Print the JSON Schema of project files, for editors."),
    ("structure", structure, "Write a structural model for CalculiX."),
    ("pattern", pattern, "Cut a roof into strips of cloth; write sheets and tables."),
    ("panels", panels_, "Sort the panels of a roof into families; write a schedule."),
    ("draw", draw_, "Draw plan, elevations, sections and panels for those who build."),
    ("report", report_, "Write a report with pictures, plan, verdict, forces and panels."),
    ("equilibria", equilibria_, "Search for all equilibria of a roof, and the barriers between them."),
    ("sweep", sweep, "Solve every combination of some values; write a table."),
    ("explore", explore, "Change tensions and pressures with sliders, in the browser."),
    ("cache", cache_, "Show or remove the roofs that are kept."),
):
    app.command(name, cls=Command, short_help=summary)(with_groups(command))
