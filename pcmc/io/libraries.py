"""Libraries that read and write formats: imported on demand, their errors translated."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from ..base.errors import FileError, MissingExtra, PcmcError

SILENT = logging.NullHandler()  # a library's log of a bad file goes to those who ask for it, not to stderr


def load_library(name: str, extra: str = "files") -> Any:
    """The module of that name, or MissingExtra."""
    logging.getLogger(name).addHandler(SILENT)
    try:
        return import_module(name)
    except ImportError:
        raise MissingExtra(name, extra) from None


@contextmanager
def translated_errors(kind: str) -> Iterator[None]:
    """Turn whatever a library raises on a bad file into a FileError of one line."""
    try:
        yield
    except (PcmcError, OSError, MissingExtra):
        raise
    except Exception as error:  # libraries raise anything, from KeyError to struct.error
        raise unreadable(kind, error) from None


def unreadable(kind: str, error: Exception) -> FileError:
    """The error in one line, for a file that is not of its kind."""
    text = " ".join(str(error).split())[:120]
    if isinstance(error, MemoryError):
        text = "its numbers ask for more memory than there is"
    reason = f"{type(error).__name__}: {text}" if text else type(error).__name__
    return FileError(f"not a readable {kind} file, or cut off ({reason})")
