"""Running the command: errors in a line, and the exit code."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

from ..base.errors import (
    BalanceWarning,
    FileWarning,
    FreeSurfaceWarning,
    MissingExtra,
    PcmcError,
    PlanWarning,
)
from ..base.interrupts import termination_as_interrupt
from .codes import BAD_INPUT, INTERRUPTED, NOT_CERTIFIED, OK

NARROW = ("strict", "surrogateescape")  # the second in the locale C


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    arguments : of the command line, without the command's own name; by default those given to it.

    Returns
    -------
    int : the exit code. 0 for a certified result (or, of a command that certifies nothing, for one that
        did its work), 1 for a result that is not certified, 2 for bad input, 130 after Ctrl-C.

    >>> main(["certify", "roof.obk"])
    2
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for kind in (BalanceWarning, FileWarning, FreeSurfaceWarning, PlanWarning):
            warnings.simplefilter("always", kind)
        warnings.showwarning = lambda message, *_, **__: _say(f"note: {message}")
        _any_letter(sys.stdout)
        with termination_as_interrupt():
            return _run(sys.argv[1:] if arguments is None else list(arguments))


def _run(arguments: list[str]) -> int:
    try:
        command, exits = _command()
        code = command(args=arguments, prog_name="pcmc", standalone_mode=False)
        if sys.stdout is not None:  # it is where the shell closed it
            sys.stdout.flush()
        return _interrupted() if code == INTERRUPTED else int(code or OK)
    except KeyboardInterrupt:
        return _interrupted()
    except BrokenPipeError:  # the reader of a pipe has seen enough
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
        if isinstance(error, exits.Abort):
            return _interrupted()
        if isinstance(error, exits.Exit):
            return int(error.exit_code)
        if not hasattr(error, "format_message"):  # those of the command line have it
            raise
        path = getattr(getattr(error, "ctx", None), "command_path", "pcmc")
        _say(f"error: {error.format_message()} ({path} --help shows what there is)")
        return BAD_INPUT


def _command() -> tuple[Callable[..., Any], ModuleType]:
    """The command line, and the module with the exceptions that end it."""
    for library in ("typer", "rich"):
        try:
            __import__(library)
        except ModuleNotFoundError as error:
            raise MissingExtra(error.name or library, "cli") from None
    import typer

    from .app import app

    return typer.main.get_command(app), typer


def _any_letter(stream: Any) -> None:
    r"""Have letters that the terminal's or a pipe's encoding lacks written as \\xf6 instead of failing."""
    if getattr(stream, "errors", None) in NARROW and hasattr(stream, "reconfigure"):
        stream.reconfigure(errors="backslashreplace")


def _interrupted() -> int:
    _say("stopped")
    return INTERRUPTED


def _say(text: str) -> None:
    """One line on stderr, which is None where the shell closed it."""
    if sys.stderr is None:
        return
    print("pcmc: " + " ".join(text.split()), file=sys.stderr)
