"""Exit codes, and the last lines that a command prints."""

from __future__ import annotations

from pathlib import Path

from ..certificate.certificate import Certificate

OK, NOT_CERTIFIED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


def report(certificate: Certificate, written: list[Path]) -> None:
    """Print the verdict, and the files written."""
    print(*filter(None, (certificate.verdict.value, certificate.detail)), sep="\n")
    if written:
        print(f"written: {names(written)}")


def names(paths: list[Path]) -> str:
    """The names of files, with commas."""
    return ", ".join(str(path) for path in paths)
