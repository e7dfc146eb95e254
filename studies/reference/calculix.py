"""CalculiX as the reference: a finite-element program's answer to a structural model of ours.

The program ``ccx`` (Debian package ``calculix-ccx``) reads the file that ``pcmc.write_structure`` makes.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import pcmc
from pcmc.base.errors import PcmcError
from pcmc.structure import StepResults, StructuralModel

PROGRAM = "ccx"


class CalculixError(PcmcError):
    """The program is absent, took too long, or did not come to an end."""


def available() -> bool:
    """Whether the program is installed."""
    return shutil.which(PROGRAM) is not None


def run(model: StructuralModel, timeout: float = 600.0, suffix: str = ".dat") -> tuple[StepResults, ...]:
    """The results of each step of a structural model."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.inp"
        pcmc.write_structure(path, model)
        run_file(path, timeout)
        return pcmc.read_results(path.with_suffix(suffix), model)


def run_file(path: Path, timeout: float = 600.0) -> str:
    """What the program prints for an input file; its results go beside the file.

    One thread: with several, sums of forces differ in their last digits from run to run.
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
    except FileNotFoundError:
        raise CalculixError(f"{PROGRAM} is not installed (Debian: calculix-ccx)") from None
    except subprocess.TimeoutExpired:
        raise CalculixError(f"{PROGRAM} did not finish within {timeout:g} s") from None
    if "Job finished" not in done.stdout:
        errors = [line.strip() for line in done.stdout.splitlines() if "*ERROR" in line]
        raise CalculixError(f"{PROGRAM}: {'; '.join(errors) or 'it stopped'}")
    return done.stdout
