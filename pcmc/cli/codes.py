"""What the command returns, and says, when it ends."""

from __future__ import annotations

from pathlib import Path

from ..certificate.certificate import Certificate

OK, NOT_CERTIFIED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


def code(found: Certificate) -> int:
    """The exit code for a certificate."""
    return OK if found.certified else NOT_CERTIFIED


def report(found: Certificate, written: list[Path]) -> None:
    """Print the verdict, and the files written."""
    print(*filter(None, (found.verdict.value, found.detail)), sep="\n")
    if written:
        print(f"written: {names(written)}")


def names(paths: list[Path]) -> str:
    """The names of files in a line."""
    return ", ".join(str(path) for path in paths)
