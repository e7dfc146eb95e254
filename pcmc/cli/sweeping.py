"""sweep: every combination of a generator's parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import FileError
from .arguments import values_of
from .codes import INTERRUPTED, NOT_CERTIFIED, OK
from .progress import sweeping


def sweep(
    generator: Annotated[
        str,
        typer.Argument(metavar="GENERATOR", help="package.module:function that returns a Surface."),
    ],
    values: Annotated[list[str], typer.Argument(metavar="NAME=V1,V2,...")],
    method: Annotated[
        str, typer.Option(metavar="NAME", help="newton, nesterov or lbfgs.")
    ] = "newton",
    store: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Keeps finished cases; run again to go on from there."),
    ] = None,
    csv: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Table to write (.csv or .parquet).")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(metavar="NUMBER", help="Local processes; default: all.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Dask scheduler, tcp://HOST:8786.")
    ] = None,
) -> int:
    """Solve a generator's surface for every combination of the values; exit code 0 if all are certified.

    \b
    Example:
      pcmc sweep generators:two_caps alpha_large=3,4,5 --csv caps.csv
    """
    from ..sweep import Sweep, run, solve_case, write_table

    given = dict(values_of(text) for text in values)
    grid = {name: found for name, found in given.items() if len(found) > 1}
    fixed = {name: found[0] for name, found in given.items() if len(found) == 1}
    cases = Sweep(solve_case, grid, {"generator": generator, "method": method, **fixed})
    if csv is not None and csv.suffix not in (".csv", ".parquet"):
        raise FileError(f"{csv}: a table is written as .csv or .parquet; name it so")
    for path in filter(None, (csv, store)):
        if not path.parent.is_dir():
            raise FileError(f"{path}: there is no folder {path.parent}; make it first")
    with sweeping() as draw:
        table = run(cases, store, scheduler=scheduler, workers=workers, on_record=draw)
    if csv is not None:
        write_table(csv, table)
    columns = [c for c in (*grid, "status", "verdict") if c in table]
    print(table[columns].to_string())
    if len(table) < len(cases):
        return INTERRUPTED
    return OK if table["verdict"].isin(["stable", "neutral"]).all() else NOT_CERTIFIED
