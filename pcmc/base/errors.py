"""The exceptions of pcmc. Each message names the problem, its place, and what to do."""

from __future__ import annotations

import os
from collections.abc import Iterable
from difflib import get_close_matches


class PcmcError(ValueError):
    """Base of every error that pcmc raises on purpose. The attributes are for programs.

    Attributes
    ----------
    what : the argument, option, key, patch or file that is wrong.
    where : the index, line, key or owner of the wrong value, if there is one.
    found, expected : the wrong value, and the values allowed.

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

    def in_file(
        self, path: str | os.PathLike[str], kind: type[PcmcError] | None = None, what: str | None = None
    ) -> PcmcError:
        """The same error with the name of a file in front of its message; of another ``kind`` if given.

        >>> PcmcError("line 3: no number", what="x", where=3).in_file("roof.obj", FileError)
        FileError('roof.obj: line 3: no number')
        """
        text, what = f"{os.fspath(path)}: {self}", self.what if what is None else what
        about = {"where": self.where, "found": self.found, "expected": self.expected}
        return (kind or type(self))(text, what=what, **about)


class SurfaceError(PcmcError):
    """The arrays given do not describe a surface that can be solved."""


class CurvedContactError(SurfaceError):
    """Curved elements would have to rest on Π, which only flat triangles do."""


class OptionError(PcmcError):
    """A parameter has a value that is not allowed."""


class NoBranch(SurfaceError, OptionError):
    """No branch of equilibria starts here: not at rest, not held, or nothing depends on the parameter."""


class FileError(PcmcError):
    """A file cannot be read or written as the format its suffix names."""


class FileWarning(UserWarning):
    """A file was read or written with changes to its content."""


class LostWarning(FileWarning):
    """Data were left out of a file because its format cannot store them."""


class PlanError(PcmcError):
    """The lines of a plan do not divide it into patches."""


class PlanWarning(UserWarning):
    """A plan can be meshed, but its roof is unlikely to have an equilibrium."""


class BalanceWarning(UserWarning):
    """The tensions at a junction cannot balance, whatever its shape."""


class CurveWarning(UserWarning):
    """Held vertices were moved off the curves that they were drawn on."""


class LoadWarning(UserWarning):
    """A load is taken as it is drawn, and may be meant otherwise."""


class SweepError(PcmcError):
    """The executor, scheduler or workers of a sweep failed; the cases stored before are safe."""


class MissingExtra(ImportError):
    """A library that this part of pcmc needs is not installed."""

    def __init__(self, library: str, extra: str) -> None:
        command = f"python -m pip install 'pcmc-surfaces[{extra}]'"
        super().__init__(f"{library} is not installed; install it with: {command}")


class FreeSurfaceWarning(UserWarning):
    """No support holds the surface: translations cost no energy."""


def unknown(what: str, found: object, known: Iterable[str], note: str = "") -> str:
    """Message for an unknown name, with the nearest known one, and a ``note``, a sentence of its own.

    >>> unknown("method", "newtn", ["newton", "lbfgs"])
    "unknown method 'newtn'; did you mean 'newton'? Known: newton, lbfgs"
    >>> unknown("method", "flow", ["newton", "lbfgs"])
    "unknown method 'flow'; known: newton, lbfgs"
    """
    names = list(known)
    near = [name for name in names if name.casefold() == str(found).casefold()]
    near = near or get_close_matches(str(found), names, n=1)
    near = near or [name for name in names if name.startswith(f"{found} ")]
    notes = [f"did you mean {name!r}?" for name in near[:1]] + [note] * bool(note)
    listed = f"{'Known' if notes else 'known'}: {', '.join(names) or '(none)'}"
    return f"unknown {what} {found!r}; {' '.join([*notes, listed])}"
