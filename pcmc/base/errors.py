"""The exceptions of pcmc. Every message says what was expected, what was found, where, and what to do."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


class PcmcError(ValueError):
    """Base of every error that pcmc raises on purpose.

    The message is a sentence for a person; the attributes say the same to a program.

    Attributes
    ----------
    what : the argument, option, key, patch or file that is wrong.
    where : where in it: an index, a line, a key; None where there is no such place.
    found, expected : what it holds, and what it may hold.

    >>> error = PcmcError("tension: expected a number ≥ 0, found -1", what="tension", found=-1)
    >>> error.what, error.where, error.found
    ('tension', None, -1)
    """

    def __init__(
        self,
        message: str = "",
        *,
        what: str | None = None,
        where: object = None,
        found: object = None,
        expected: object = None,
    ) -> None:
        super().__init__(message)
        self.what, self.where, self.found, self.expected = what, where, found, expected


class SurfaceError(PcmcError):
    """The arrays given do not describe a surface that can be solved."""


class OptionError(PcmcError):
    """A parameter of a function or solver is outside what it may be."""


class FileError(PcmcError):
    """A file cannot be read or written as the format its suffix names."""


class FileWarning(UserWarning):
    """A file was read or written, but not everything in it could be kept as it was."""


class LostWarning(FileWarning):
    """What the format of a file cannot carry was left out."""


class PlanError(PcmcError):
    """The lines of a plan do not divide it into patches."""


class PlanWarning(UserWarning):
    """A plan can be meshed, but its roof will hardly come to rest."""


class BalanceWarning(UserWarning):
    """The tensions at a junction cannot balance, whatever its shape."""


class SweepError(PcmcError):
    """The executor, scheduler or workers of a sweep failed; the cases stored before are safe."""


class MissingExtra(ImportError):
    """A part of pcmc was asked for whose libraries are not installed."""

    def __init__(self, library: str, extra: str) -> None:
        super().__init__(
            f"{library} is not installed; install it with: python -m pip install 'pcmc-surfaces[{extra}]'"
        )


class FreeSurfaceWarning(UserWarning):
    """Nothing holds the surface: translations cost no energy."""


def unknown(what: str, found: object, known: Iterable[str]) -> str:
    """Message for a name that is not known, with the nearest known one.

    >>> unknown("method", "newtn", ["newton", "lbfgs"])
    "unknown method 'newtn'; did you mean 'newton'? Known: newton, lbfgs"
    """
    names = list(known)
    near = get_close_matches(str(found), names, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    return f"unknown {what} {found!r}; {hint}Known: {', '.join(names) or '(none)'}"
