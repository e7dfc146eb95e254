"""Files appear whole or not at all, one or several together."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .interrupts import defer_interrupts


@contextmanager
def atomic_write(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A path beside ``path`` to write to, which takes its place when the block ends without error.

    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> with atomic_write(folder / "a.txt") as temporary:
    ...     _ = temporary.write_text("all of it")
    >>> [p.name for p in folder.iterdir()]
    ['a.txt']
    """
    with atomic_writes([path]) as (temporary,):
        yield temporary


@contextmanager
def atomic_writes(paths: Iterable[str | os.PathLike[str]]) -> Iterator[list[Path]]:
    """Paths beside ``paths`` to write to, which take their places together when the block ends.

    No file system replaces several files at once. So each is written first, then each takes its place,
    and where one cannot (it is open in another program, say), those before it are put back as they were.
    """
    wanted = [Path(path) for path in paths]
    written = [_beside(path) for path in wanted]
    kept = [_beside(path) for path in wanted]
    try:
        yield written
        with defer_interrupts():
            for path, old in zip(wanted, kept, strict=True):
                _keep(path, old)
            _replace(wanted, written, kept)
    finally:
        for path in (*written, *kept):
            path.unlink(missing_ok=True)


@contextmanager
def folder(path: Path) -> Iterator[None]:
    """A folder, made with those above it if it is missing; gone again if the block ends in an error."""
    missing = [p for p in (path, *path.parents) if not p.exists()]
    try:
        path.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        for made in missing:
            with suppress(OSError):  # it holds something by now
                made.rmdir()
        raise


def _beside(path: Path) -> Path:
    """A new name in the same folder, with the same suffix."""
    return path.with_name(f".{path.stem}-{secrets.token_hex(4)}{path.suffix}")


def _keep(path: Path, old: Path) -> None:
    """A second name for what is at ``path`` now, if anything is."""
    if not path.is_file():
        return
    try:
        os.link(path, old)
    except OSError:  # not every file system has links
        shutil.copy2(path, old)


def _replace(wanted: list[Path], written: list[Path], kept: list[Path]) -> None:
    done = 0
    try:
        for new, path in zip(written, wanted, strict=True):
            done += 1  # before it: what Ctrl-C cuts short counts as begun
            os.replace(new, path)
    except BaseException:
        for new, path, old in zip(written[:done], wanted, kept, strict=False):
            if new.exists():
                continue  # it was never moved
            if old.exists():
                os.replace(old, path)
            else:
                path.unlink(missing_ok=True)
        raise
