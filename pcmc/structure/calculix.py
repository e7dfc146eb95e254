"""Run CalculiX, the program ``ccx``, on input files and on structural models."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..base.errors import PcmcError
from .inp import write_structure
from .model import StructuralModel
from .results import StepResults, read_results

PROGRAM = "ccx"
MISSING = (
    f"{PROGRAM} is not installed: the load cases need CalculiX "
    "(Debian, Ubuntu: apt install calculix-ccx; else https://www.calculix.de), found as ccx on the path"
)


class CalculixError(PcmcError):
    """The program is absent, took too long, or did not come to an end."""


def available() -> bool:
    """Whether the program is installed."""
    return shutil.which(PROGRAM) is not None


def expect_program() -> None:
    """Refuse to go on without the program, in one line that says what to install."""
    if not available():
        raise CalculixError(MISSING, what=PROGRAM)


def run(
    model: StructuralModel, timeout: float | None = None, suffix: str = ".dat"
) -> tuple[StepResults, ...]:
    """The results of each step of a structural model, all in one analysis; an error where it stops.

    ``pcmc.analyse`` answers what is overloaded, too.
    """
    with folder_for_input() as path:
        write_structure(path, model)
        run_file(path, timeout)
        return read_results(path.with_suffix(suffix), model)


@contextmanager
def folder_for_input() -> Iterator[Path]:
    """The path of an input file in a folder of its own, which goes when the block ends."""
    with tempfile.TemporaryDirectory(prefix="pcmc-") as folder:
        yield Path(folder) / "model.inp"


def run_file(path: Path, timeout: float | None = None) -> str:
    """What the program prints for an input file; its results go beside the file.

    One thread: with several, sums of forces differ in their last digits from run to run. ``timeout`` is in
    seconds. CalculixError, in one line with what the program says, where it stops.
    """
    threads = dict.fromkeys(("OMP_NUM_THREADS", "CCX_NPROC_STIFFNESS", "NUMBER_OF_CPUS"), "1")
    try:
        done = subprocess.run(
            [PROGRAM, path.stem],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=timeout,
            cwd=path.parent,
            env={**os.environ, **threads},
            check=False,
        )
    except OSError:  # not there, or no program
        raise CalculixError(MISSING, what=PROGRAM) from None
    except subprocess.TimeoutExpired:
        raise CalculixError(f"{PROGRAM} did not finish within {timeout:g} s") from None
    if "Job finished" not in done.stdout:
        errors = [line.strip() for line in done.stdout.splitlines() if "*ERROR" in line]
        raise CalculixError(f"{PROGRAM}: {'; '.join(errors) or f'it stopped, code {done.returncode}'}")
    return done.stdout
