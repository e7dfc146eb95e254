"""The command sweep: every combination of some numbers of a project, a surface or a generator."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..base.errors import MissingExtra, OptionError
from ..base.files import suffix_of
from ..io import FORMATS, READ_ONLY
from ..project.drawn import files_of
from ..project.settings import check_names
from ..project.writing import check_outputs
from . import INTERRUPTED, NOT_CERTIFIED, OK
from .arguments import DXF, TOML, count, flag, named_values, option, real
from .progress import sweeping

if TYPE_CHECKING:
    from ..sweep import Sweep

METHOD = "newton, nesterov or lbfgs; default: the project's."
MESH_CHECK = "Solve each case on two finer meshes, too, for error bars."
WHAT = "A project (.toml), a surface, or package.module:function that returns a Surface."
SEARCH = "Try further starts where the first leads to no equilibrium: slower, but tells what ends each way."
PLOT = "Picture over one varied number or two: of the first --show, else apexes or the rise."
SHOW = "What the table has: apex, area, volume, force, ..., or of one part: west.area. Repeat for several."
STORE = "File for finished cases. The same command again runs only the missing ones."


def sweep(
    what: Annotated[str, typer.Argument(metavar="WHAT", help=WHAT)],
    values: Annotated[list[str], typer.Argument(metavar="NAME=V1,V2,...")],
    method: Annotated[str | None, option("NAME", METHOD)] = None,
    store: Annotated[Path | None, option("FILE", STORE)] = None,
    csv: Annotated[Path | None, option("FILE", "Table to write (.csv or .parquet).")] = None,
    every: Annotated[bool, flag("--all", "Write all columns, not only the first ones.")] = False,
    plot: Annotated[Path | None, option("FILE", PLOT)] = None,
    show: Annotated[list[str] | None, option("QUANTITY", SHOW)] = None,
    workers: Annotated[int | None, count("Local processes; default: one per processor.")] = None,
    scheduler: Annotated[str | None, option("ADDRESS", "Dask scheduler to use: tcp://HOST:8786.")] = None,
    time_limit: Annotated[float, real("SECONDS", "Time limit per case, in seconds.")] = 600.0,
    mesh_check: Annotated[bool, flag("--mesh-check", MESH_CHECK)] = False,
    search: Annotated[bool, flag("--search", SEARCH)] = False,
    retry_failed: Annotated[bool, flag("--retry-failed", "Run the stored cases that failed again.")] = False,
) -> int:
    """Solve every combination of the values; exit code 0 if all are certified.

    For a project or a surface, NAME is PATCH.tension, PATCH.pressure, PATCH.weight or PATCH.snow of a patch
    or wall, CABLE.tension or CABLE.weight of a cable, or ROOM.volume of a room that has one. For a project it
    may also be the keys of a number in the file: plan.edge_length, plan.outline.3.1 (the first coordinate of
    the third corner); or the shift of a whole divider, hole, support or named point along x, y or z: "wall
    1.x". For a generator it is one of its parameters, or an option of the method. With a store, values may be
    added later: only new cases are run. If the project file has changed, name a new store.
    The table has the parameters, the verdict, the apex of each patch, the rise, the area, and the largest
    reaction per length, or what --show names; with --all it has every number of the certificate, too. Cells
    are empty where nothing is at rest.

    \b
    Examples:
      pcmc sweep roof.toml corner.tension=6,6.2 "wall 1.tension=1,2" --csv roof.csv
      pcmc sweep generators:two_caps alpha_large=3,4,5 --csv caps.csv
    """
    from ..certificate.quantities import dimension_of
    from ..sweep import draw_sweep, run, short_table, write_table
    from ..sweep.projects import column_labels
    from ..sweep.store import FAILED
    from ..sweep.tables import TABLES, columns_of

    inputs = files_of(what) if Path(what).exists() else ()
    check_outputs([path for path in (csv, store, plot) if path is not None], inputs=inputs)
    if csv is not None and suffix_of(csv, TABLES, "a table") == ".parquet" and not find_spec("pyarrow"):
        raise MissingExtra("pyarrow", "files")
    check_names((), plot)
    for name in show or ():
        dimension_of(name.rpartition(".")[2])  # refuses what is no quantity
    options = {"mesh_check": mesh_check, "search": search}

    def resume(kept: int, missing: int) -> None:
        if kept:
            print(f"{store}: {kept} cases are finished, {missing} to run")

    with sweeping() as draw:
        cases = _cases(what, values, method, options)
        table = run(
            cases,
            store,
            scheduler=scheduler,
            workers=workers,
            time_limit=time_limit,
            retry_failed=retry_failed,
            on_record=draw,
            on_resume=resume,
        )
    if table.empty:
        return INTERRUPTED
    first = short_table(table, list(cases.grid), show or ())
    if csv is not None:
        write_table(csv, table if every else first)
    labels = {} if ":" in what and not Path(what).exists() else column_labels(what, map(str, table))
    if plot is not None:
        draw_sweep(table, list(cases.grid), plot, labels, *(show or ())[:1])
    print(first.rename(columns=labels).to_string(float_format=lambda x: f"{x:.5g}", na_rep=""))
    for name in show or ():
        if not columns_of(table, name, list(cases.grid)):
            print(f"no case has {name}")
    failed = table[table["status"].isin(FAILED)]
    for message, alike in failed.groupby("message", sort=False):  # each reason once
        others = f" and {len(alike) - 1} more" if len(alike) > 1 else ""
        print(f"case {alike.index[0]}{others}: {alike['status'].iloc[0]}: {message}")
    if len(table) < len(cases):
        return INTERRUPTED
    good = table["verdict"].isin(["stable", "neutral"]) & table.get("targets_met", True)
    return OK if good.all() else NOT_CERTIFIED


def _cases(what: str, values: list[str], method: str | None, options: dict[str, bool]) -> Sweep:
    """Every combination of the values, each NAME=V1,V2,...; a name with one value is the same in all."""
    from ..sweep import Sweep, solve_case
    from ..sweep.projects import project_sweep

    given: dict[str, list[Any]] = {}
    for name, listed in map(named_values, values):
        if name in given:
            raise OptionError(f"{name} is given twice; list its values with commas: {name}=1,2", what=name)
        given[name] = listed
    grid = {name: listed for name, listed in given.items() if len(listed) > 1}
    grid = grid or given  # one case, whose names are checked as those of any other
    fixed = {name: listed[0] for name, listed in given.items() if name not in grid}
    if Path(what).suffix.lower() in (TOML, DXF, *FORMATS, *READ_ONLY):
        return project_sweep(what, grid, fixed, method=method, **options)
    if ":" not in what:
        kinds = f"a project (.toml), a surface ({' '.join(FORMATS)}), or a generator"
        raise OptionError(f"{what}: expected {kinds} such as generators:two_caps", what="WHAT", found=what)
    about: dict[str, Any] = {name: True for name, wanted in options.items() if wanted}
    return Sweep(solve_case, grid, about | {"generator": what, "method": method or "newton"} | fixed)
