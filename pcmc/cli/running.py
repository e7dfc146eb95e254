"""Run the command: errors in one line on stderr, and the exit code."""

from __future__ import annotations

import codecs
import gc
import os
import sys
import warnings
from collections.abc import Callable
from functools import cache
from itertools import repeat
from typing import Any

from ..base import errors
from ..base.errors import MissingExtra, PcmcError
from ..base.interrupts import termination_as_interrupt
from ..base.libraries import require
from . import BAD_INPUT, INTERRUPTED, NOT_CERTIFIED, OK

SHOWN = (errors.BalanceWarning, errors.FileWarning, errors.FreeSurfaceWarning, errors.LoadWarning)
SHOWN += (errors.PlanWarning,)
FAILING = ("strict", "surrogateescape", "backslashreplace")  # error handlers; the second is the locale C's
SIGNS = "²³±°×·≥≤–…→αλΠ"  # of the field
TYPED = "^2|^3|+-| deg|x|*|>=|<=|-|...|->|alpha|lambda|Pi"  # each as one types it in ASCII
PLAIN = {ord(sign): typed for sign, typed in zip(SIGNS, TYPED.split("|"), strict=True)}


def run_command(arguments: list[str]) -> int:
    """Run the command; an error becomes one line on stderr; return the exit code."""
    with warnings.catch_warnings(action="ignore"):
        for kind in SHOWN:
            warnings.simplefilter("always", kind)
        said = dict[str, None]()

        def tell(message: Warning | str, *_: object, **__: object) -> None:
            if str(message) not in said:
                said[str(message)] = _say(f"note: {message}")

        warnings.showwarning = tell
        # letters that an encoding lacks as one types them (m^2), others as \xf6: printing never fails
        codecs.register_error("pcmc.plain", _plain)
        for stream in (sys.stdout, sys.stderr):
            if getattr(stream, "errors", None) in FAILING and hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="pcmc.plain")
        with termination_as_interrupt():
            return _run(arguments)


def _run(arguments: list[str]) -> int:
    try:
        for library in ("typer", "rich"):
            require(library, extra="cli")
        command = _command()
        if not gc.isenabled():  # ``main`` pauses it
            gc.freeze()
            gc.enable()
        arguments = ["--allow-uncertified" if one == "--anyway" else one for one in arguments]
        code = command(args=arguments or ["--help"], prog_name="pcmc", standalone_mode=False)
        if sys.stdout is not None:  # None if the shell closed it
            sys.stdout.flush()
        if not arguments:  # the help, with the exit code of typer where a command is missing
            return BAD_INPUT
        return _interrupted() if code == INTERRUPTED else int(code or OK)
    except KeyboardInterrupt:
        return _interrupted()
    except BrokenPipeError:  # the reader closed the pipe: pcmc ... | head
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return NOT_CERTIFIED
    except (PcmcError, MissingExtra) as error:
        _say(f"error: {error}")
        return BAD_INPUT
    except OSError as error:
        where = "" if error.filename is None else f"{error.filename}: "
        _say(f"error: {where}{error.strerror or error}")
        return BAD_INPUT
    except Exception as error:
        import typer

        if isinstance(error, typer.Abort):
            return _interrupted()
        if isinstance(error, typer.Exit):
            return int(error.exit_code)
        if not hasattr(error, "format_message"):  # typer's errors have it
            raise
        path = getattr(getattr(error, "ctx", None), "command_path", "pcmc")
        _say(f"error: {error.format_message()} (see {path} --help)")
        return BAD_INPUT


@cache
def _command() -> Callable[..., Any]:
    """The command with its options, which takes as long to build as a small file to read."""
    import typer

    from .app import app

    return typer.main.get_command(app)


def _plain(error: UnicodeError) -> tuple[bytes, int]:
    """The letters that cannot be encoded, in ASCII, or the bytes of a file's name; and where to go on."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    letters = error.object[error.start : error.end].translate(PLAIN)
    raw = ("surrogateescape" if "\udc80" <= one <= "\udcff" else "backslashreplace" for one in letters)
    return b"".join(map(str.encode, letters, repeat("ascii"), raw)), error.end


def _interrupted() -> int:
    _say("stopped")
    return INTERRUPTED


def _say(text: str) -> None:
    """Print one line to stderr, which is None if the shell closed it."""
    if sys.stderr is not None:
        print("pcmc: " + " ".join(text.split()), file=sys.stderr)
