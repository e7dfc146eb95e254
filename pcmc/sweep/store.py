"""The file of a sweep: a header and a line per finished case, readable after a crash at any time.

A store is a text file of JSON lines. Each line ends with the CRC-32 of what stands before it, and
is written by one call as soon as its case has finished: whatever ends the sweep after that does not
lose it. The disk is made to hold what was written at most ten times a second, so when the power
fails, a tenth of a second is lost. A crash leaves whole lines and at most one broken last line,
which is cut off when the sweep resumes. (A data base does
not survive being cut off in the middle; lines do, and every program reads them.) Floats are written
with the shortest digits that give the same float back.
"""

from __future__ import annotations

import json
import os
import sys
import time
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from warnings import warn

from ..base.errors import FileError, FileWarning
from .child import version
from .grid import Sweep

FORMAT = 1
FORCE_EVERY = 0.1  # seconds
FAILED = ("raised", "timed out", "killed")  # statuses the engine gives; all others are the case's


@dataclass(frozen=True)
class Record:
    """One finished case.

    Attributes
    ----------
    case : its number in the sweep.
    parameters : what it was run at.
    status : ``"finished"`` or the case's own word; ``"raised"``, ``"timed out"`` or ``"killed"``
        for a case that failed. ``verdict`` is the case's; ``message`` says why a case failed.
    numbers : what the case returned.
    wall_time : seconds it took. ``provenance``: when and where it ran, with which versions, and
        what a failed case printed last.
    """

    case: int
    parameters: dict[str, Any]
    status: str
    verdict: str
    message: str
    numbers: dict[str, Any]
    wall_time: float
    provenance: dict[str, Any]

    @property
    def failed(self) -> bool:
        """Whether the case raised, was stopped at its time limit or killed its worker."""
        return self.status in FAILED


class Store:
    """An open store: ``records`` by case number, ``append`` for the next, ``force`` now and then."""

    def __init__(self, path: Path, descriptor: int, records: dict[int, Record], end: int) -> None:
        self.path, self.records = path, records
        self._descriptor, self._end = descriptor, end
        self._forced, self._held = time.monotonic(), len(records)  # when last, and how many then

    def append(self, record: Record) -> None:
        """Write one record.

        Raises
        ------
        FileError : the disk is full or fails. What was stored before stays whole.
        """
        self._write(_line(vars(record)))
        self.records[record.case] = record
        if time.monotonic() - self._forced > FORCE_EVERY:
            self.force()

    def force(self) -> None:
        """Return when the disk holds all that was written. FileError as ``append``."""
        if len(self.records) == self._held:
            return
        with self._told(self._held):
            os.fsync(self._descriptor)
        self._forced, self._held = time.monotonic(), len(self.records)

    def _write(self, line: bytes) -> None:
        written = 0
        with self._told(len(self.records)):
            while written < len(line):
                written += os.write(self._descriptor, line[written:])
        self._end += written

    @contextmanager
    def _told(self, safe: int) -> Iterator[None]:
        """Cut off what was written of a line when the disk fails, and say how many are safe."""
        try:
            yield
        except OSError as error:
            with suppress(OSError):
                os.ftruncate(self._descriptor, self._end)
            raise FileError(
                f"{self.path}: a record could not be written ({error.strerror or error}); the"
                f" {safe} cases stored before it are safe; make room and run the same sweep again"
                " to go on from there"
            ) from error


_open: set[int] = set()  # descriptors of this process's stores


def _let_go() -> None:
    """In a fork of this process, a pool's worker say: it would hold the lock for as long as it lives."""
    nothing = os.open(os.devnull, os.O_RDWR)
    for descriptor in _open:
        os.dup2(nothing, descriptor, False)
    os.close(nothing)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_let_go)


@contextmanager
def open_store(path: str | os.PathLike[str], sweep: Sweep) -> Iterator[Store]:
    """Open the store of ``sweep`` for appending, making it or recovering what a crash left.

    Raises
    ------
    FileError : the file is no store, is another sweep's or another version's, is in use, or cannot
        be opened.
    """
    path, header = Path(path), _line(_header(sweep))
    _regular(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
    except OSError as error:
        raise FileError(f"{path}: cannot be opened for writing ({error.strerror})") from error
    _open.add(descriptor)
    try:
        _lock(path, descriptor)
        data = path.read_bytes()
        new = header.startswith(data) and data != header  # an empty file, or a crash in the header
        if not new:
            _check_header(path, data, sweep)
        records, end = ({}, 0) if new else _records(path, data)
        os.ftruncate(descriptor, end)
        store = Store(path, descriptor, records, end)
        if new:
            store._write(header)
        try:
            yield store
        finally:
            store.force()
    finally:
        _open.discard(descriptor)
        os.close(descriptor)


def read_store(path: str | os.PathLike[str]) -> list[Record]:
    """The records of a store in the order of their case numbers; a sweep may be running on it.

    Raises
    ------
    FileError : the file cannot be read, or is no store.
    """
    path = Path(path)
    _regular(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror})") from error
    _check_header(path, data, None)
    records, _ = _records(path, data)
    return [records[number] for number in sorted(records)]


def _regular(path: Path) -> None:
    """Refuse a folder, a pipe or a device, of which some can be read without end."""
    try:
        found = path.exists() and not path.is_file()
    except OSError as error:
        raise FileError(f"{path}: cannot be opened ({error.strerror})") from error
    if found or "\0" in str(path):
        raise FileError(f"{path}: is no regular file; name a file on a disk")


def _header(sweep: Sweep) -> dict[str, Any]:
    return {
        "pcmc sweep": FORMAT,
        "version": version("pcmc"),
        "fingerprint": sweep.fingerprint,
        "case": sweep.case,
        "grid": dict(sweep.grid),
        "fixed": dict(sweep.fixed),
    }


def _line(fields: dict[str, Any]) -> bytes:
    r"""One JSON line that ends with the checksum of what stands before it.

    >>> _line({"case": 0})
    b'{"case": 0, "crc": "7e7fc89a"}\n'
    """
    body = json.dumps(fields)[:-1].encode("ascii")
    return body + b', "crc": "%08x"}\n' % zlib.crc32(body)


def _parse(line: bytes) -> dict[str, Any] | None:
    """The fields of a whole line, or None if a byte of it is wrong."""
    body, _, _ = line.rpartition(b', "crc": ')
    if line != body + b', "crc": "%08x"}' % zlib.crc32(body):
        return None
    fields: dict[str, Any] = json.loads(body + b"}")
    return fields


def _check_header(path: Path, data: bytes, sweep: Sweep | None) -> None:
    """Refuse a file that is no store, or not the store of ``sweep``."""
    found = _parse(data.partition(b"\n")[0])
    if found is None or "pcmc sweep" not in found:
        raise FileError(f"{path}: line 1 is not the header of a sweep's store; name another file")
    if found["pcmc sweep"] != FORMAT:
        raise FileError(
            f"{path}: written in store format {found['pcmc sweep']}, this is format {FORMAT}; read"
            f" it with pcmc {found.get('version')}"
        )
    if sweep is None:
        return
    wanted = _header(sweep)
    if found["version"] != wanted["version"]:
        raise FileError(
            f"{path}: written by pcmc {found['version']}, this is pcmc {wanted['version']}; numbers"
            " of two versions do not mix: name a new file, or delete this one"
        )
    if found["fingerprint"] != wanted["fingerprint"]:
        raise FileError(
            f"{path}: written for another sweep ({_difference(found, wanted)}); name a new file, or"
            " delete this one"
        )


def _difference(found: dict[str, Any], wanted: dict[str, Any]) -> str:
    """Where two declarations first differ."""
    for part in ("case", "grid", "fixed"):
        old, new = found[part], wanted[part]
        if old == new:
            continue
        if part == "case":
            return f"its case is {old!r}, this one's {new!r}"
        for name in [*old, *new]:
            if old.get(name) != new.get(name):
                was, now = repr(old.get(name)), repr(new.get(name))
                return f"its {part} has {name}={was:.60}, this one's {now:.60}"
    return "its parameters stand in another order"


def _records(path: Path, data: bytes) -> tuple[dict[int, Record], int]:
    """The records after the header, and the length of the data up to the last whole line."""
    *lines, cut_off = data.split(b"\n")
    found = {}
    for number, line in enumerate(lines[1:], start=2):
        told = _parse(line)
        if told is not None and told.keys() == Record.__annotations__.keys():
            found[told["case"]] = Record(**told)
        else:
            text = (
                f"{path}: line {number} is damaged; unless a later line has its case, it is not run"
            )
            warn(text, FileWarning, stacklevel=4)
    return found, len(data) - len(cut_off)


def _lock(path: Path, descriptor: int) -> None:
    """Keep a second sweep off the store for as long as this process has it open."""
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(descriptor, 2**30, os.SEEK_SET)  # one byte far behind the data
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError) as error:
        raise FileError(
            f"{path}: another sweep is writing to it; wait for it, or name another file"
        ) from error
    except OSError as error:
        raise FileError(
            f"{path}: cannot be locked ({error.strerror}); name a file on another disk"
        ) from error
