"""The text of PDF files, read by another program."""

import shutil
import subprocess
from pathlib import Path

import pytest


def words_of(path: Path | str) -> list[str]:
    """The text of each page. Skips the rest of the test where pdftotext is not installed."""
    if shutil.which("pdftotext") is None:
        pytest.skip("pdftotext is not installed (Debian: apt install poppler-utils)")
    done = subprocess.run(["pdftotext", "-layout", path, "-"], capture_output=True, text=True, check=True)
    return done.stdout.removesuffix("\f").split("\f")
