"""The file of a sweep: an SQLite database with one row per finished case.

A row's key is the parameters of its case, so a grid may grow or shrink. The journal is SQLite's rollback
journal: a write-ahead log fails on network drives. So a store is one file between transactions, and a program
that is killed loses only the transaction it was in. The sweep that runs holds SQLite's write lock, which ends
with its process: others can read, and a second sweep is refused.
"""

from __future__ import annotations

import json
import sqlite3
import time
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from warnings import warn

import numpy as np

from ..base.errors import FileError, FileWarning
from ..base.files import PathLike, check_regular, system_error
from .case_script import WORDS, answer, version
from .grid import Sweep

FORMAT = 2
COLUMNS = ["parameters", "record", "crc"]  # of the table of cases
FIELDS = (*WORDS, "numbers", "wall_time", "provenance")  # of a Record, in the second of them
SQLITE = b"SQLite format 3\0"  # how its files begin
READERS = 60.0  # seconds that a commit waits for programs that read the store
FAILED = ("raised", "timed out", "killed")  # statuses that ``run`` gives; a case gives all others


@dataclass(frozen=True)
class Record:
    """One finished case."""

    case: int  # its number in the sweep
    parameters: dict[str, Any]  # the values it was run with
    status: str  # one of FAILED; otherwise what the case returned, or "finished"
    verdict: str  # that the case returned
    message: str  # that the case returned; of a failed one, the reason
    numbers: dict[str, Any]  # all else that the case returned
    wall_time: float  # in seconds
    provenance: dict[str, Any]  # when and where it ran, with which versions; output of a failed case

    @property
    def failed(self) -> bool:
        """Whether the case raised, reached its time limit or killed its worker."""
        return self.status in FAILED


@dataclass
class Store:
    """An open store: ``records`` by case number, and ``append`` for more."""

    path: Path
    database: sqlite3.Connection
    records: dict[int, Record]

    def append(self, records: Iterable[Record]) -> None:
        """Write records in one transaction, and return when the disk holds them.

        FileError if the disk is full or fails; the records stored before stay.
        """
        new = {record.case: record for record in records}
        rows = []
        for record in new.values():
            key, text = _key(record.parameters), json.dumps({name: getattr(record, name) for name in FIELDS})
            rows.append((key, text, zlib.crc32((key + text).encode())))  # SQLite has no checksums
        try:
            self.database.executemany("INSERT OR REPLACE INTO cases VALUES (?, ?, ?)", rows)
            self.database.execute("COMMIT")
            self.database.execute("BEGIN IMMEDIATE")
        except sqlite3.Error as error:
            text = f"{self.path}: a record could not be written ({error}); the {len(self.records)} cases"
            text += " stored before it are safe; make room and run the same sweep again to go on from there"
            raise FileError(text, what=str(self.path), found=len(self.records)) from error
        self.records |= new


@contextmanager
def open_store(path: PathLike, sweep: Sweep) -> Iterator[Store]:
    """Open the store of ``sweep`` for writing; make the file if it is missing.

    FileError if it is no store, of another sweep or another version of pcmc, in use, or cannot be opened.
    """
    path = Path(path)
    declared = {"case": sweep.case, "grid": dict(sweep.grid), "fixed": dict(sweep.fixed)}
    with _connected(path, "rwc") as database:
        _lock(path, database)
        if not database.execute("SELECT count(*) FROM sqlite_schema").fetchone()[0]:
            database.execute("CREATE TABLE sweep (version TEXT, declaration TEXT)")
            database.execute("CREATE TABLE cases (parameters TEXT PRIMARY KEY, record TEXT, crc INTEGER)")
            database.execute("INSERT INTO sweep VALUES (?, ?)", (version("pcmc"), "{}"))
            database.execute(f"PRAGMA user_version = {FORMAT}")
        else:
            _check_declaration(path, _declaration(path, database), declared)
        database.execute("UPDATE sweep SET declaration = ?", (json.dumps(declared),))
        database.execute("COMMIT")
        database.execute("BEGIN IMMEDIATE")
        yield Store(path, database, _records(path, database, sweep.grid, sweep.fixed))


def read_store(path: PathLike) -> list[Record]:
    """The records of a store, in the order of the last sweep's grid; a sweep may be running on it.

    FileError if the file cannot be read, or is no store.

    >>> import tempfile
    >>> from pcmc.sweep import Sweep, run
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     case = Sweep("fractions:Fraction", {"numerator": [1], "denominator": [0]})  # raises
    ...     _ = run(case, folder + "/bad.store", workers=1)
    ...     [record.message for record in read_store(folder + "/bad.store")]
    ['ZeroDivisionError: Fraction(1, 0)']
    """
    with _connected(Path(path), "rw") as database:
        database.execute("BEGIN")
        declared = _declaration(Path(path), database)
        return [*_records(Path(path), database, declared["grid"], declared["fixed"]).values()]


@contextmanager
def _connected(path: Path, mode: str) -> Iterator[sqlite3.Connection]:
    """A connection to the file, in mode "rwc" also to a new one; errors of SQLite as FileError.

    Refuses a folder, a pipe, a device (some can be read without end), and a file of another kind.
    """
    check_regular(path)
    start = b""
    try:
        if mode == "rwc":
            path.parent.mkdir(parents=True, exist_ok=True)
        if mode == "rw" or path.exists():
            with path.open("rb") as file:
                start = file.read(len(SQLITE))
    except OSError as error:
        raise system_error(path, "opened for writing" if mode == "rwc" else "read", error) from None
    if start not in (b"", SQLITE):
        raise FileError(f"{path}: is not the store of a sweep; name another file", what=str(path))
    try:
        address = f"{path.absolute().as_uri()}?mode={mode}"
        with closing(sqlite3.connect(address, timeout=READERS, isolation_level=None, uri=True)) as database:
            yield database
    except sqlite3.Error as error:
        raise FileError(f"{path}: cannot be used as a sweep's store ({error})", what=str(path)) from error


def _lock(path: Path, database: sqlite3.Connection) -> None:
    """Begin a transaction that keeps a second sweep off the store.

    A sweep frees the lock for microseconds between transactions: free three times, no sweep is running.
    """
    try:
        database.execute("PRAGMA busy_timeout = 0")
        for pause in (0.01, 0.017):
            database.execute("BEGIN IMMEDIATE")
            database.execute("ROLLBACK")
            time.sleep(pause)
        database.execute("BEGIN IMMEDIATE")
        database.execute(f"PRAGMA busy_timeout = {1000 * READERS:.0f}")
    except sqlite3.OperationalError as error:
        if error.sqlite_errorcode != sqlite3.SQLITE_BUSY:
            raise
        text = f"{path}: another sweep is writing to it (or its disk has no file locks); wait for it, or"
        raise FileError(f"{text} name another file", what=str(path)) from error


def _declaration(path: Path, database: sqlite3.Connection) -> dict[str, Any]:
    """The case function, grid and fixed values in the store, and the ``version`` that wrote it."""
    tables = {name for (name,) in database.execute("SELECT name FROM sqlite_schema")}
    if not {"sweep", "cases"} <= tables:
        raise FileError(f"{path}: is not the store of a sweep; name another file", what=str(path))
    (damage,) = database.execute("PRAGMA integrity_check(1)").fetchone()
    if damage != "ok":
        raise FileError(f"{path}: is damaged ({damage}); name another file", what=str(path))
    (found,) = database.execute("PRAGMA user_version").fetchone()
    written_by, text = database.execute("SELECT version, declaration FROM sweep").fetchone() or ("", "")
    if found != FORMAT:
        text = f"{path}: written in store format {found}, this is format {FORMAT}; read it with pcmc"
        raise FileError(f"{text} {written_by}", what=str(path), found=found, expected=FORMAT)
    columns = [row[1] for row in database.execute("PRAGMA table_info(cases)")]
    try:
        declared: dict[str, Any] = {**json.loads(text), "version": written_by}
        axes = declared["grid"].values()
        sound = isinstance(declared["case"], str) and isinstance(declared["fixed"], dict)
        if columns != COLUMNS or not sound or not all(isinstance(axis, list) for axis in axes):
            raise ValueError
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        text = f"{path}: is damaged (it does not say which sweep it belongs to); name another file"
        raise FileError(text, what=str(path), where="declaration") from None
    return declared


def _check_declaration(path: Path, stored: dict[str, Any], new: dict[str, Any]) -> None:
    """Refuse a store of another sweep. The values in the grid may differ."""
    old, own = stored["version"], version("pcmc")
    if old != own:
        text = f"{path}: written by pcmc {old}, this is pcmc {own}; numbers of two versions do not mix:"
        text += " name a new file, or delete this one"
        raise FileError(text, what=str(path), where="version", found=old, expected=own)
    was, now = (
        {("case", ""): declared["case"]}
        | {("grid ", name): "varied" for name in declared["grid"]}
        | {("fixed ", name): value for name, value in declared["fixed"].items()}
        for declared in (stored, new)
    )
    for part, name in [*was, *now]:
        before, after = was.get((part, name), "missing"), now.get((part, name), "missing")
        if before != after:
            place = f"{part}{name!r}" if name else part
            text = f"{path}: written for another sweep (its {place} is {before!r:.60}, this one's is"
            text += f" {after!r:.60}); name a new file, or delete this one"
            raise FileError(text, what=str(path), where=name or part, found=before, expected=after)


def _key(value: Any) -> str:
    return json.dumps(value, sort_keys=True)


def _records(
    path: Path, database: sqlite3.Connection, grid: Mapping[str, Sequence[Any]], fixed: Mapping[str, Any]
) -> dict[int, Record]:
    """The stored records of the grid's cases by case number; a record that is not sound is left out."""
    axes = dict(grid) | {name: [value] for name, value in fixed.items()}
    places = {name: {_key(value): place for place, value in enumerate(axis)} for name, axis in axes.items()}
    records = {}
    for key, text, crc in database.execute("SELECT parameters, record, crc FROM cases"):
        try:
            values = {name: _key(value) for name, value in json.loads(key).items()}
            if values.keys() != axes.keys():
                continue  # no case of the grid
            case = {name: places[name][values[name]] for name in axes}
        except (ValueError, TypeError, AttributeError, KeyError, RecursionError):
            continue
        number = int(np.ravel_multi_index(tuple(case.values()), [len(axis) for axis in axes.values()]))
        parameters = {name: axes[name][place] for name, place in case.items()}
        try:
            record = Record(case=number, parameters=parameters, **json.loads(text))
            words, tables = [getattr(record, word) for word in WORDS], (record.numbers, record.provenance)
            sound = {*map(type, words)} == {str} and {*map(type, tables)} == {dict}
            sound = sound and type(record.wall_time) in (int, float)
            if not sound or zlib.crc32((key + str(text)).encode()) != crc:
                raise ValueError
            if {*WORDS, "case"} & record.numbers.keys() or {"case", "wall_time"} & record.provenance.keys():
                raise ValueError
            answer(record.numbers, parameters)
            records[number] = record
        except (ValueError, TypeError, RecursionError):
            text = f"{path}: the record of case {number} is damaged; the next sweep on this store runs the"
            warn(f"{text} case again", FileWarning, stacklevel=4)
    return dict(sorted(records.items()))
