"""``python -m studies list | run NAME ... | reproduce | stale | check NAME ... | numbers | benchmark |
readme``."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pcmc.base.errors import MissingExtra, PcmcError

from .registry import STUDIES, chosen, of_the_paper
from .study import STEPS, Study

if TYPE_CHECKING:
    from rich.console import Console

WIDTH = 150  # columns of tables that go to a file or a log
HOME = Path(__file__).resolve().parent.parent


def main(words: Sequence[str] | None = None) -> int:
    """The exit code: 0 all went well, 1 a study failed, 2 a wrong command, 130 Ctrl-C."""
    asked = _parser().parse_args(words)
    try:
        return int(asked.act(asked))
    except (PcmcError, MissingExtra) as error:
        print(f"studies: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("studies: stopped; the files written so far are whole", file=sys.stderr)
        return 130


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m studies", description=__doc__)
    acts = parser.add_subparsers(required=True, metavar="COMMAND")
    act = acts.add_parser("list", help="the studies, a line each")
    act.set_defaults(act=_list)
    act = acts.add_parser("run", help="run the studies named, e.g. run example1 example2")
    act.add_argument("names", nargs="+", metavar="NAME")
    act.add_argument("--steps", nargs="+", choices=STEPS, default=list(STEPS))
    _running(act)
    act.set_defaults(act=lambda asked: _run(chosen(asked.names), asked, asked.steps))
    act = acts.add_parser("reproduce", help="every study of the paper, then the comparison")
    _running(act)
    act.set_defaults(act=lambda asked: _run(of_the_paper(), asked, STEPS))
    act = acts.add_parser("stale", help="which stored results come from other code than today's, and why")
    act.add_argument("--results", type=Path, help="where they are (default: results/)")
    act.set_defaults(act=_stale)
    act = acts.add_parser("check", help="run studies anew, elsewhere, and compare with the stored numbers")
    act.add_argument("names", nargs="+", metavar="NAME")
    act.add_argument("--results", type=Path, help="where they are (default: results/)")
    act.set_defaults(act=_check)
    act = acts.add_parser("numbers", help="the numbers of README, documentation and report with their keys")
    act.set_defaults(act=_numbers)
    act = acts.add_parser("benchmark", help="how fast it is on this machine, evolver beside it")
    act.add_argument("--quick", action="store_true", help="small meshes; within a minute")
    act.add_argument("--only", nargs="+", default=[], metavar="NAME", help='e.g. "to height": its rows anew')
    act.add_argument("--results", type=Path, help="where to write (default: results/)")
    act.set_defaults(act=_benchmark)
    act = acts.add_parser(
        "readme", help="write results/REPORT.md and the README's summary from the tables in results/"
    )
    act.set_defaults(act=_readme)
    return parser


def _running(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--short", action="store_true", help="least work; in a folder of its own")
    parser.add_argument("--results", type=Path, help="where to write (default: results/)")
    parser.add_argument("--workers", type=int, default=2, help="studies at the same time")


def _list(asked: argparse.Namespace) -> int:
    width = max(map(len, STUDIES))
    for study in STUDIES.values():
        print(f"{study.name:{width}}  {study.about}")
    return 0


def _console(stderr: bool = False) -> Console:
    try:
        from rich.console import Console
    except ImportError:
        raise MissingExtra("rich", "cli") from None
    return Console(width=None if sys.stdout.isatty() else WIDTH, stderr=stderr)


def _run(studies: Sequence[Study], asked: argparse.Namespace, steps: Sequence[str]) -> int:
    console = _console()
    from .report import write_comparison
    from .runner import run_all
    from .screen import show, show_outcomes

    start = time.perf_counter()
    results = asked.results or (_scratch() if asked.short else HOME / "results")
    outcomes = run_all(studies, results, console, workers=asked.workers, short=asked.short, steps=steps)
    tables = write_comparison(results)
    show_outcomes(outcomes, console)
    if any(study.paper for study in studies):
        show(*tables, console)
    console.print(f"{time.perf_counter() - start:.1f} s; written to {results}")
    return 1 if any(outcome.error for outcome in outcomes) else 0


def _stale(asked: argparse.Namespace) -> int:
    from .stored import ages

    found = ages(STUDIES.values(), asked.results or HOME / "results")
    width = max(map(len, found))
    for name, age in found.items():
        print(f"{name:{width}}  {age or 'no result'}")
    stale = [name for name, age in found.items() if age is None or age.changed != ()]
    if stale:
        print(
            "\nStale: code that its numbers may depend on reads otherwise today. The numbers may be the same:"
        )
        print(f"python -m studies check {stale[0]} computes one again, beside the stored one, and compares.")
        print(f"to compute them anew: python -m studies run {' '.join(stale)}")
    return 0


def _check(asked: argparse.Namespace) -> int:
    from .stored import check

    wrong, console = 0, _console(stderr=True)  # lines that differ alone are the output
    for study in chosen(asked.names):
        lines = check(study, asked.results or HOME / "results", console)
        wrong += len(lines)
        print("\n".join(lines) or f"{study.name}: every number is as stored")
    return 1 if wrong else 0


def _numbers(asked: argparse.Namespace) -> int:
    from .stated import listed_numbers

    rows = list(listed_numbers())
    page, number = (max(len(row[k]) for row in rows) for k in (0, 1))
    print("\n".join(f"{row[0]:{page}}  {row[1]:>{number}}  {row[2]}" for row in rows))
    return 0


def _benchmark(asked: argparse.Namespace) -> int:
    from .benchmarks.run import main as benchmark

    return benchmark(asked.results or HOME / "results", asked.quick, asked.only)


def _readme(asked: argparse.Namespace) -> int:
    from .readme import write_readme

    write_readme(HOME / "README.md", HOME / "results")
    return 0


def _scratch() -> Path:
    return Path(tempfile.mkdtemp(prefix="pcmc-studies-"))


if __name__ == "__main__":
    sys.exit(main())
