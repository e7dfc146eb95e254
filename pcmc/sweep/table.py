"""Records as pandas tables, and tables as files."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.errors import MissingExtra
from ..base.files import atomic_write, suffix_of, writing
from .store import Record

TABLES = (".csv", ".parquet")

if TYPE_CHECKING:
    import pandas as pd


def table(records: Iterable[Record]) -> pd.DataFrame:
    """One row per case, in their order: parameters, status, verdict, message, numbers.

    The same cases give the same table, in whatever order and wherever they ran. Wall times, which differ
    from run to run, are in ``provenance``. A number that a case did not return is missing.
    """
    return _frame(
        {"case": r.case}
        | r.parameters
        | {"status": r.status, "verdict": r.verdict, "message": r.message}
        | r.numbers
        for r in records
    )


def provenance(records: Iterable[Record]) -> pd.DataFrame:
    """One row per case: wall time in seconds, when and where, versions, output of failures."""
    return _frame({"case": r.case, "wall_time": r.wall_time} | r.provenance for r in records)


def _frame(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    import pandas as pd  # here: the processes of a sweep do not need it

    ordered = sorted(rows, key=lambda row: int(row["case"]))
    return pd.DataFrame(ordered, columns=None if ordered else ["case"]).set_index("case")


def write_table(path: str | os.PathLike[str], frame: pd.DataFrame) -> None:
    """Write a table to ``.csv`` or ``.parquet``; the file is complete or not there at all.

    Floats are written with the digits that give the same float back. In Parquet, which has one
    type per column, a column of mixed types is written as text.

    Raises
    ------
    FileError : another suffix, or a file that cannot be written.
    MissingExtra : ``.parquet`` without pyarrow.
    """
    path = Path(path)
    suffix = suffix_of(path, TABLES, "a table")
    with writing(path), atomic_write(path) as temporary:
        if suffix == ".csv":
            frame.to_csv(temporary, lineterminator="\n")
        else:
            _to_parquet(temporary, frame)


def _to_parquet(path: Path, frame: pd.DataFrame) -> None:
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise MissingExtra("pyarrow", "files") from None
    columns = {}
    for name, column in frame.reset_index().items():
        try:
            columns[name] = pa.Array.from_pandas(column)
        except (pa.ArrowInvalid, pa.ArrowTypeError, OverflowError):
            texts = [None if value is None else str(value) for value in column]
            columns[name] = pa.array(texts, pa.string())
    pq.write_table(pa.table(columns), path)
