"""Records as pandas tables; the columns that a reader wants first, as a table and as a picture; files."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.errors import OptionError
from ..base.files import PathLike, atomic_write, suffix_of, writing
from ..base.libraries import require
from .case_script import WORDS
from .store import Record

if TYPE_CHECKING:
    import pandas as pd

    from ..plot.scene import Image

TABLES = (".csv", ".parquet")
FIRST = ("status", "verdict", "extent", "mesh_verdict", "targets_met", "accuracy_reached")
USUAL = ("apex", "rise", "area", "reaction per length")  # the first of each patch, the others of the roof
GOOD = ("stable", "neutral")


def table(records: Iterable[Record]) -> pd.DataFrame:
    """One row per case, in their order: parameters, status, verdict, message, numbers.

    The same cases give the same table, in whatever order and wherever they ran. Wall times, which differ
    from run to run, are in ``provenance``. A number that a case did not return is missing.
    """
    return _frame(
        {"case": r.case, **r.parameters} | {word: getattr(r, word) for word in WORDS} | r.numbers
        for r in records
    )


def provenance(records: Iterable[Record]) -> pd.DataFrame:
    """One row per case: wall time in seconds, when and where, versions, output of failures.

    >>> from pcmc.sweep import Record
    >>> done = Record(0, {"wall": 1.0}, "converged", "stable", "", {"rise": 1.5}, 0.2, {"computer": "mine"})
    >>> provenance([done]).to_dict("list"), table([done])["rise"].tolist()
    ({'wall_time': [0.2], 'computer': ['mine']}, [1.5])
    """
    return _frame({"case": r.case, "wall_time": r.wall_time} | r.provenance for r in records)


def _frame(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    import pandas as pd  # here: the processes of a sweep do not need it

    ordered = sorted(rows, key=lambda row: int(row["case"]))
    return pd.DataFrame(ordered, columns=None if ordered else ["case"]).set_index("case")


def write_table(path: PathLike, frame: pd.DataFrame) -> None:
    """Write a table to ``.csv`` or ``.parquet``; the file is complete or not there at all.

    Floats are written with the digits that give the same float back. In Parquet, which has one type per
    column, a column of mixed types is written as text. FileError for another suffix, or a file that cannot be
    written; MissingExtra for ``.parquet`` without pyarrow.

    >>> import tempfile
    >>> import pandas as pd
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_table(folder + "/walls.csv", pd.DataFrame({"wall": [1.0, 2.0], "rise": [1.5, 1.25]}))
    ...     print(Path(folder, "walls.csv").read_text(encoding="utf-8"))
    ,wall,rise
    0,1.0,1.5
    1,2.0,1.25
    <BLANKLINE>
    """
    path = Path(path)
    suffix = suffix_of(path, TABLES, "a table")
    with writing(path), atomic_write(path) as temporary:
        if suffix == ".csv":
            frame.to_csv(temporary, lineterminator="\n")
            return
        require("pyarrow")
        import pyarrow as pa
        import pyarrow.parquet as pq

        columns = {}
        for name, column in frame.reset_index().items():
            try:
                columns[name] = pa.Array.from_pandas(column)
            except (pa.ArrowInvalid, pa.ArrowTypeError, OverflowError):
                texts = [None if value is None else str(value) for value in column]
                columns[name] = pa.array(texts, pa.string())
        pq.write_table(pa.table(columns), temporary)


def columns_of(table: pd.DataFrame, name: str, parameters: Container[str] = ()) -> list[str]:
    """The columns that a name stands for: one of its own, or all those of a quantity, the roof's last.

    >>> import pandas as pd
    >>> columns_of(pd.DataFrame({"a.apex": [1.0], "b.apex": [2.0], "apex": [2.0]}), "apex")
    ['a.apex', 'b.apex', 'apex']
    """
    columns = [str(column) for column in table.select_dtypes("number") if str(column) not in parameters]
    columns.sort(key=lambda column: "." not in column)
    return [c for c in columns if name in (c, c.rpartition(".")[2].replace("_", " "))]


def short_table(table: pd.DataFrame, parameters: Sequence[str], show: Sequence[str] = ()) -> pd.DataFrame:
    """The parameters, how each case ended, and quantities, each as of ``columns_of``, in the surface's units.

    By default these are the apex of each patch over Π; the rise of the highest apex over the lowest support
    of a sheet, the area and the largest reaction per length of the roof; and the margins, with their ends.

    >>> import pandas as pd
    >>> frame = pd.DataFrame({"a": [1.0], "verdict": ["stable"], "residual": [1e-12], "west.apex": [2.0]})
    >>> list(short_table(frame, ["a"])), list(short_table(frame, ["a"], ["residual"]))
    (['a', 'verdict', 'west.apex'], ['a', 'verdict', 'residual'])
    """
    margins = [c for c in table if str(c).endswith((".margin", ".margin_value", ".margin_ends_by"))]
    usual = [*(c for c in columns_of(table, USUAL[0], parameters) if "." in c), *USUAL[1:], *margins]
    shown = [column for name in show for column in columns_of(table, name, parameters)] if show else usual
    wanted = dict.fromkeys([*parameters, *FIRST, *shown])
    return table[[name for name in wanted if name in table]]


def draw_sweep(
    table: pd.DataFrame,
    parameters: Sequence[str],
    path: PathLike | None = None,
    labels: Mapping[str, str] | None = None,
    show: str = "",
) -> Image:
    """A picture of a sweep over one or two varied numbers, × where not certified.

    ``labels`` are the names of columns as they are shown, such as ``with_units`` gives; ``show`` is what is
    drawn, as of ``columns_of``; over two numbers the last of its columns. By default it is the apexes over
    one number, the rise over two. OptionError if not one or two numbers vary, or no case has a shape.

    >>> import pandas as pd
    >>> rows = {"wall": [1.0, 2.0], "verdict": ["stable", "stable"], "roof.apex": [1.5, 1.2]}
    >>> draw_sweep(pd.DataFrame(rows), ["wall"]).shape[2]
    3
    """
    from ..plot import heatmap, lines

    varied = [name for name in parameters if table[name].nunique() > 1]
    if len(varied) not in (1, 2) or not all(table[name].dtype.kind in "if" for name in varied):
        text = f"a sweep is drawn over one or two varied numbers, and {len(varied)} vary here"
        text += f": {', '.join(varied) or 'none'}; fix the others"
        raise OptionError(text, what="plot", found=len(varied))
    names, good = labels or {}, table["verdict"].isin(GOOD)
    quantity = show or ("apex" if len(varied) == 1 else "rise")
    columns = [c for c in columns_of(table, quantity, parameters) if table[c].notna().any()]
    if not columns:
        raise OptionError(f"no case of this sweep has a shape with {quantity} to draw", what="plot", found=0)
    last, shown = columns[-1], [names.get(name, name) for name in varied]
    certified = table[columns].where(good).astype(float)
    if len(varied) == 1:
        frame = certified.set_index(table[varied[0]]).sort_index().dropna(axis="columns", how="all")
        x = frame.index.to_numpy(float)
        curves = {str(c).rpartition(".")[0]: (x, y.to_numpy()) for c, y in frame.items()}
        if not show:
            curves.pop("", None)  # that of the roof, the highest of the others
        if not curves:
            raise OptionError("no case of this sweep is certified; see its table", what="plot", found=0)
        label = names.get(last, last).removeprefix(f"{last.rpartition('.')[0]}.")
        return lines({of or "roof": y for of, y in curves.items()}, path, x=shown[0], y=label, markers=True)
    places = [table[name] for name in reversed(varied)]
    value = certified[last].groupby(places).mean().unstack()
    lost = (~good).groupby(places).any().unstack(fill_value=True)
    title = f"{last} of the certified cases (×: not certified)"
    xs, ys = value.columns.to_numpy(float), value.index.to_numpy(float)
    tables, marks = {title: value.to_numpy()}, {title: lost.to_numpy(bool)}
    (across, up), label = shown, names.get(last, "")
    return heatmap(xs, ys, tables, path, marks=marks, xlabel=across, ylabel=up, label=label, width=900)
