"""Libraries that read and write formats: brought in on demand, their failures made ours."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from ..base.errors import FileError, MissingExtra, PcmcError


def library(name: str, extra: str = "files") -> Any:
    """The module of that name, or MissingExtra."""
    try:
        return import_module(name)
    except ImportError:
        raise MissingExtra(name, extra) from None


@contextmanager
def reading(kind: str) -> Iterator[None]:
    """Turns whatever a library raises on a bad file into one line."""
    try:
        yield
    except (PcmcError, OSError, MissingExtra, MemoryError):
        raise
    except Exception as error:  # libraries raise anything, from KeyError to struct.error
        said = " ".join(str(error).split())[:120]
        reason = f"{type(error).__name__}: {said}" if said else type(error).__name__
        raise FileError(f"not a readable {kind} file, or cut off ({reason})") from None
