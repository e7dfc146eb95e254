"""Write files atomically: one or several together are complete, or unchanged. Check what is to be read."""

from __future__ import annotations

import os
import secrets
import shutil
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import FileError
from .interrupts import defer_interrupts
from .validate import refuse

PathLike = str | os.PathLike[str]


def system_error(path: PathLike, act: str, error: OSError) -> FileError:
    """The error for a file that the system does not let be read, written or opened.

    >>> system_error("roof.obj", "read", FileNotFoundError(2, "No such file or directory"))
    FileError('roof.obj: cannot be read (No such file or directory)')
    """
    name = os.fspath(path)
    return FileError(f"{name}: cannot be {act} ({error.strerror or error})", what=name)


def as_path(path: object) -> Path:
    """The path that a caller gives; OptionError for anything else."""
    if isinstance(path, str | os.PathLike):
        return Path(path)
    refuse("path", path, "the path of a file")


def check_regular(path: Path) -> None:
    """Refuse a folder, a pipe and a device before they are opened: reading them may never end.

    FileError also for a name that no file can have and a path that the system refuses; a missing file passes.

    >>> check_regular(Path("/"))
    Traceback (most recent call last):
    ...
    pcmc.base.errors.FileError: /: is no regular file but a folder; name a file on a disk
    """
    check_name(path)
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return
    except OSError as error:
        raise system_error(path, "opened", error) from None
    if stat.S_ISREG(mode):
        return
    kind = "a folder" if stat.S_ISDIR(mode) else "a pipe or a device"
    text = f"{path}: is no regular file but {kind}; name a file on a disk"
    raise FileError(text, what=str(path), found=kind, expected="a regular file")


def read_bytes(path: Path) -> bytes:
    """The bytes of a regular file; others are refused as in ``check_regular``."""
    check_regular(path)
    return path.read_bytes()


def check_name(path: Path) -> None:
    """Refuse a name that no file can have."""
    if "\0" in str(path):
        text = f"{str(path)!r}: a file name cannot have the character NUL"
        raise FileError(text, what=str(path), found="\0")
    try:
        os.fsencode(path)
    except UnicodeEncodeError:
        text = f"{str(path)!a}: a file name cannot have half a surrogate pair"
        raise FileError(text, what=str(path)) from None


def suffix_of(path: PathLike, known: Iterable[str], thing: str) -> str:
    """The suffix of a path in small letters; FileError unless it is one of those known for a thing.

    >>> suffix_of("roof.CSV", (".csv", ".parquet"), "a table")
    '.csv'
    >>> suffix_of("roof.xls", (".csv", ".parquet"), "a table")
    Traceback (most recent call last):
    ...
    pcmc.base.errors.FileError: roof.xls: the suffix of a table is .csv or .parquet, found '.xls'; change it
    """
    suffix, endings = os.path.splitext(path)[1].lower(), tuple(known)
    if suffix not in endings:
        listed = " or ".join(filter(None, (", ".join(endings[:-1]), endings[-1])))
        text = f"{os.fspath(path)}: the suffix of {thing} is {listed}, found {suffix!r}; change it"
        raise FileError(text, what=os.fspath(path), found=suffix, expected=endings)
    return suffix


@contextmanager
def atomic_write(path: PathLike) -> Iterator[Path]:
    """A temporary path beside ``path``. It replaces ``path`` when the block ends without error."""
    with atomic_writes([path]) as (temporary,):
        yield temporary


@contextmanager
def atomic_writes(paths: Iterable[PathLike]) -> Iterator[list[Path]]:
    """Temporary paths beside ``paths``. They replace ``paths`` together when the block ends.

    No file system replaces several files at once. So all are written first, and then replaced one by one. If
    one cannot be replaced (because another program has it open, say), those before it are restored.
    """
    wanted = [Path(path) for path in paths]
    written, backups = (
        [path.with_name(f".{secrets.token_hex(8)}{path.suffix}") for path in wanted]  # as long as any name
        for _ in range(2)
    )
    done = 0
    try:
        yield written
        with defer_interrupts():
            for path, old in zip(wanted, backups, strict=True):
                if path.is_file():
                    try:
                        os.link(path, old)
                    except OSError:  # not every file system has links
                        shutil.copy2(path, old)
            try:
                for new, path in zip(written, wanted, strict=True):
                    done += 1  # before it: a move that Ctrl-C interrupts counts too
                    os.replace(new, path)
            except BaseException:
                for new, path, old in zip(written[:done], wanted, backups, strict=False):
                    if not new.exists() and old.exists():  # it was moved
                        os.replace(old, path)
                    elif not new.exists():
                        path.unlink(missing_ok=True)
                raise
    finally:
        for path in (*written, *backups):
            path.unlink(missing_ok=True)


@contextmanager
def writing(path: PathLike) -> Iterator[None]:
    """Name the file, as a FileError, if the system refuses to write it in the block."""
    try:
        yield
    except OSError as error:
        raise system_error(path, "written", error) from None


@contextmanager
def folder(path: Path) -> Iterator[None]:
    """Make a folder and those above it if they are missing; remove them if the block raises."""
    missing = [p for p in (path, *path.parents) if not p.exists()]
    try:
        path.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        for made in missing:
            with suppress(OSError):  # it is not empty
                made.rmdir()
        raise
