"""Run CalculiX, the program ``ccx``, on input files and on structural models."""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from ..base.errors import FileError, PcmcError
from ..base.files import writing
from .inp import text_of
from .loads import Step
from .member_forces import floating, members_at_rest
from .model import StructuralModel
from .results import StepResults, read_steps

PROGRAM = "ccx"
USUAL_SIZE = 10.0  # of a surface in the files that it gets; a larger one gets a larger unit of length
MISSING = (
    f"{PROGRAM} is not installed: the load cases need CalculiX "
    "(Debian, Ubuntu: apt install calculix-ccx; else https://www.calculix.de), found as ccx on the path"
)
# in what the program prints where it finds no equilibrium; other errors are of the model or of the program
NOT_CONVERGED = ("too many cutbacks", "increment size smaller than minimum", "nonpositive jacobian")

# an error with the lines that go on, up to a blank one or a *
ERRORS = re.compile(r"\*ERROR.*(?:\n(?! ?\*)[ \t]*\S.*)*")


class CalculixError(PcmcError):
    """The program is absent, took too long, or did not come to an end."""


class NotConverged(CalculixError):
    """The program found no equilibrium under all of the loads."""


def available() -> bool:
    """Whether the program is installed."""
    return shutil.which(PROGRAM) is not None


def expect_program() -> None:
    """Refuse to go on without the program, in one line that says what to install."""
    if not available():
        raise CalculixError(MISSING, what=PROGRAM)


def run_as_far(
    model: StructuralModel, steps: Sequence[Step], timeout: float | None = None
) -> tuple[StepResults, ...]:
    """The results of these steps of a model, as far as the program finds equilibria; see ``read_steps``.
    CalculixError where it finds none even for the first of them, the form-finding load; OptionError where a
    material's law does not hold."""
    # where beams meet the program compares 1e-5 to terms of 1/length: in mm it misses what it finds in m
    unit = 10.0 ** max(round(math.log10(model.surface.size / USUAL_SIZE)), 0)
    with folder_for_input() as path:
        with writing(path):
            path.write_text(text_of(model, steps, every=True, unit=unit), encoding="utf-8", newline="\n")
        with suppress(NotConverged):
            run_file(path, timeout)
        results = path.with_suffix(".dat")
        try:
            found = read_steps(results, model, steps, unit)
        except FileError as error:
            text = str(error).removeprefix(f"{results}: ")
            raise CalculixError(f"{PROGRAM}: the results of step {steps[0].name!r}: {text}") from None
    if not found or found[0].share < 1.0:
        text = f"{PROGRAM} finds no equilibrium under the form-finding load alone; is the surface certified?"
        if model.lines:
            share = 100.0 * found[0].share if found else 0.0
            unheld = [floating(model, beam, model.units) for beam in members_at_rest(model)]
            text = f"the members carry only {share:.0f} % of what walls and supports do; "
            text += "; ".join(filter(None, unheld)) or "make them stiffer"
        raise CalculixError(text, what=steps[0].name)
    for result in found:
        result.thicknesses  # noqa: B018 — refuses strains that leave none
    return found


@contextmanager
def folder_for_input() -> Iterator[Path]:
    """The path of an input file in a folder of its own, which goes when the block ends."""
    with tempfile.TemporaryDirectory(prefix="pcmc-") as folder:
        yield Path(folder) / "model.inp"


def run_file(path: Path, timeout: float | None = None) -> str:
    """What the program prints for an input file; its results go beside the file. One thread: with several,
    sums of forces differ in their last digits from run to run. ``timeout`` is in seconds. CalculixError, in
    one line with what the program says, where it stops."""
    one = dict.fromkeys(("OMP_NUM_THREADS", "CCX_NPROC_STIFFNESS", "NUMBER_OF_CPUS"), "1")
    how: Any = {"stdin": subprocess.DEVNULL, "capture_output": True, "text": True, "errors": "replace"}
    how |= {"timeout": timeout, "cwd": path.parent, "env": {**os.environ, **one}, "check": False}
    try:
        done = subprocess.run([PROGRAM, path.stem], **how)
    except OSError:  # not there, or no program
        raise CalculixError(MISSING, what=PROGRAM) from None
    except subprocess.TimeoutExpired:
        raise CalculixError(f"{PROGRAM} did not finish within {timeout:g} s") from None
    if "Job finished" not in done.stdout:
        errors = [" ".join(text.split()) for text in ERRORS.findall(done.stdout)]
        stopped = NotConverged if any(text in done.stdout for text in NOT_CONVERGED) else CalculixError
        raise stopped(f"{PROGRAM}: {'; '.join(errors) or f'it stopped, code {done.returncode}'}")
    return done.stdout
