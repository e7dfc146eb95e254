"""sweep: every combination of some numbers of a project, a surface or a generator."""

from __future__ import annotations

import os
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

import typer

from ..base.errors import FileError, MissingExtra, OptionError
from ..io import FORMATS
from .arguments import TOML, number, values_of, whole
from .codes import INTERRUPTED, NOT_CERTIFIED, OK
from .progress import sweeping


def sweep(
    what: Annotated[
        str,
        typer.Argument(
            metavar="WHAT",
            help="A project (.toml), a surface, or package.module:function that returns a Surface.",
        ),
    ],
    values: Annotated[list[str], typer.Argument(metavar="NAME=V1,V2,...")],
    method: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="newton, nesterov or lbfgs, instead of the project's."),
    ] = None,
    store: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Keeps finished cases; run again to go on from there."),
    ] = None,
    csv: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Table to write (.csv or .parquet).")
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(parser=whole, metavar="NUMBER", help="Local processes; default: all."),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Dask scheduler, tcp://HOST:8786.")
    ] = None,
    time_limit: Annotated[
        float,
        typer.Option(parser=number, metavar="SECONDS", help="After so long a case is stopped."),
    ] = 600.0,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Run stored cases that failed once more.")
    ] = False,
) -> int:
    """Solve for every combination of the values; exit code 0 if all are certified.

    Of a project or a surface, NAME is PATCH.tension or PATCH.pressure of a patch or wall; of a project
    also any number that stands in the file, by its keys: plan.edge_length, plan.outline.3.1 (the first
    coordinate of the third corner). Of a generator it is a parameter, or an option of the method. A store
    belongs to the values and to the file as it is: when the file has changed, name a new store.

    \b
    Examples:
      pcmc sweep roof.toml corner.tension=6,6.2 "wall 1.tension=1,2" --csv roof.csv
      pcmc sweep generators:two_caps alpha_large=3,4,5 --csv caps.csv
    """
    from ..sweep import run, write_table
    from ..sweep.store import FAILED

    for path, suffixes in ((csv, (".csv", ".parquet")), (store, ())):
        _check_place(path, suffixes)
    if csv is not None and store is not None and csv.resolve() == store.resolve():
        raise OptionError(f"{csv} cannot be both the store and the table; name two files")
    if csv is not None and csv.suffix == ".parquet" and find_spec("pyarrow") is None:
        raise MissingExtra("pyarrow", "files")
    given: dict[str, list[Any]] = {}
    for name, found in map(values_of, values):
        if name in given:
            raise OptionError(f"{name} is given twice; list its values with commas: {name}=1,2")
        given[name] = found
    grid = {name: found for name, found in given.items() if len(found) > 1}
    fixed = {name: found[0] for name, found in given.items() if len(found) == 1}
    with sweeping() as draw:
        cases = _cases(what, grid, fixed, method)
        table = run(
            cases, store, scheduler=scheduler, workers=workers, time_limit=time_limit,
            retry_failed=retry_failed, on_record=draw,
        )  # fmt: skip
    if table.empty:
        return INTERRUPTED
    if csv is not None:
        write_table(csv, table)
    columns = [c for c in (*grid, "status", "verdict", "targets_met") if c in table]
    print(table[columns].to_string())
    _say_failures(table[table["status"].isin(FAILED)])
    if len(table) < len(cases):
        return INTERRUPTED
    good = table["verdict"].isin(["stable", "neutral"]) & table.get("targets_met", True)
    return OK if good.all() else NOT_CERTIFIED


def _cases(what: str, grid: dict[str, Any], fixed: dict[str, Any], method: str | None) -> Any:
    from ..sweep import Sweep, solve_case
    from ..sweep.projects import project_sweep

    if Path(what).suffix.lower() in (TOML, *FORMATS):
        return project_sweep(what, grid, fixed, method=method)
    if ":" not in what:
        raise OptionError(
            f"{what}: expected a project (.toml), a surface ({' '.join(FORMATS)}), or a generator such"
            " as generators:two_caps"
        )
    return Sweep(solve_case, grid, {"generator": what, "method": method or "newton", **fixed})


def _say_failures(failed: Any) -> None:
    """Why cases failed, each reason once."""
    for message, cases in failed.groupby("message", sort=False):
        others = f" and {len(cases) - 1} more" if len(cases) > 1 else ""
        print(f"case {cases.index[0]}{others}: {cases['status'].iloc[0]}: {message}")


def _check_place(path: Path | None, suffixes: tuple[str, ...]) -> None:
    """Refuse a file that cannot be written, before any case is run."""
    if path is None:
        return
    if suffixes and path.suffix not in suffixes:
        raise FileError(f"{path}: a table is written as {' or '.join(suffixes)}; name it so")
    if path.is_dir():
        raise FileError(f"{path}: is a folder; give the name of a file")
    if not path.parent.is_dir():
        raise FileError(f"{path}: there is no folder {path.parent}; make it first")
    if not os.access(path.parent, os.W_OK):
        raise FileError(f"{path}: cannot be written (the folder {path.parent} is read-only)")
