"""Several studies side by side, each in a process of its own, with a progress bar."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from .study import STEPS, Study

# One thread per worker: two workers share two cores, and sums have the same order in every run.
THREADS = ("PCMC_THREADS", "NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
# Kernels that every x86-64 processor has. Others round otherwise, and the answer of a roof at the edge of its
# existence hangs on that: with its own kernels each machine would have other numbers.
KERNELS = {"MKL_CBWR": "COMPATIBLE", "OPENBLAS_CORETYPE": "Nehalem"}
OFF = "NPY_DISABLE_CPU_FEATURES"  # numpy's, by name

WORKER = (sys.executable, "-m", "studies.worker")


def environment(study: Study) -> dict[str, str]:
    """The variables of a study's process: one thread, and unless its times are the answer, common kernels."""
    variables = os.environ | dict.fromkeys(THREADS, "1")
    if study.timed:
        return variables
    beyond = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    off = " ".join([os.environ.get(OFF, ""), *beyond]).strip()
    return variables | KERNELS | ({OFF: off} if off else {})


@dataclass(frozen=True)
class Outcome:
    """How a study ended: ``error`` is empty, or the last line that it printed to stderr."""

    study: str
    seconds: float
    error: str = ""


def run_all(
    studies: Sequence[Study],
    results: Path,
    console: Console,
    *,
    workers: int = 2,
    short: bool = False,
    steps: Sequence[str] = STEPS,
    worker: Sequence[str] = WORKER,
) -> list[Outcome]:
    """Run the studies, longest first, ``workers`` at a time; the outcomes in the order given.

    A study that fails is an outcome with an error, and the others go on. Ctrl-C ends the running processes
    and raises KeyboardInterrupt; every file that is left is complete.
    """
    extra = ["--results", str(results), "--steps", *steps, *(["--short"] if short else [])]
    outcomes: dict[str, Outcome] = {}
    with _progress(console) as progress, ThreadPoolExecutor(workers) as pool:
        crew = Crew(progress, steps, len(studies), worker)
        futures = [
            pool.submit(crew.run, study, extra) for study in sorted(studies, key=lambda study: -study.seconds)
        ]
        try:
            for future in as_completed(futures):
                outcome = future.result()
                outcomes[outcome.study] = outcome
                if outcome.error:
                    console.print(f"[red]{outcome.study} failed:[/red]", outcome.error, markup=True)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            crew.stop()
            raise
    return [outcomes[study.name] for study in studies]


@dataclass
class Crew:
    """The running processes, and the bar that shows their steps."""

    progress: Progress
    steps: Sequence[str]
    studies: int
    worker: Sequence[str]
    doing: dict[str, str] = field(default_factory=dict)
    processes: set[subprocess.Popen[str]] = field(default_factory=set)
    finished: int = 0
    stopped: bool = False

    def __post_init__(self) -> None:
        self.task = self.progress.add_task("", total=self.studies * len(self.steps))

    def run(self, study: Study, extra: Sequence[str]) -> Outcome:
        """Run one study to its end in a process."""
        start, name = time.perf_counter(), study.name
        command = [*self.worker, name, *extra]
        with tempfile.TemporaryFile("w+") as words:
            with subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=words, text=True, env=environment(study)
            ) as process:
                self.processes.add(process)
                if self.stopped:
                    process.terminate()
                assert process.stdout is not None
                for line in process.stdout:
                    self.show(name, line.strip())
            words.seek(0)
            error = "" if process.returncode == 0 else _last_line(words.read(), process.returncode)
        self.processes.discard(process)
        self.finished += 1
        self.show(name, None)
        return Outcome(name, time.perf_counter() - start, error)

    def show(self, name: str, step: str | None) -> None:
        """Show that a study has begun a step; None: that it has ended."""
        if step is None:
            self.doing.pop(name, None)
        elif step in self.steps:
            self.doing[name] = step
        doing = dict(self.doing)
        taken = sum(self.steps.index(step) for step in doing.values())
        self.progress.update(
            self.task,
            completed=self.finished * len(self.steps) + taken,
            description=", ".join(f"{study} ({step})" for study, step in sorted(doing.items())),
        )

    def stop(self) -> None:
        """End every running process."""
        self.stopped = True
        for process in list(self.processes):
            process.terminate()


def _progress(console: Console) -> Progress:
    return Progress(
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.description}"),
        console=console,
    )


def _last_line(text: str, code: int) -> str:
    """The last line that a failed process printed."""
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else f"exit code {code}, without a message"
