"""Plant small faults, one at a time, and list those that no test sees.

``python .ci/mutants.py`` takes all files of ``.ci/mutants.toml``, and
``python .ci/mutants.py pcmc/io/vtk.py --count 20`` one of them, with more faults.

A fault is an operator, a comparison, a sign, a condition or a number exchanged, or a call left out, in one
place of a copy of the checkout. In each file ``count`` places are drawn at random, the same ones in each run.
The doctests of the file look for them and the tests that the table names for it, the quickest first, without
the slow ones; all must pass without a fault. The table also lists faults that change nothing a user reads,
and why. Exit code 1 if another fault survives.

Where the file has compiled loops, all run as plain Python: those kept compiled would not have the fault.
"""

import argparse
import ast
import importlib
import multiprocessing
import os
import random
import shutil
import sys
import tempfile
import time
import tomllib
from collections.abc import Generator, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from copy import deepcopy
from dataclasses import dataclass
from multiprocessing import Queue
from pathlib import Path

import pytest

PAIRS = [(ast.Add, ast.Sub), (ast.Mult, ast.Div), (ast.And, ast.Or), (ast.Lt, ast.GtE), (ast.Gt, ast.LtE)]
PAIRS += [(ast.Eq, ast.NotEq), (ast.Is, ast.IsNot), (ast.In, ast.NotIn), (ast.USub, ast.UAdd)]
EXCHANGED = dict(PAIRS) | {there: here for here, there in PAIRS}
TABLE = Path(".ci/mutants.toml")
COPIED = ("pcmc", "generators", "studies", "tests", "results", "notebooks", "docs", ".ci")
COPIED += ("pyproject.toml", "README.md", "CHANGELOG.md", "CITATION.cff", "constraints.txt")
LOADED = ("hypothesis", "scipy.sparse.linalg", "scipy.spatial", "pandas", "numba", "typer")
LOADED += ("matplotlib.pyplot", "selenium.webdriver", "pyvista", "trimesh", "ezdxf", "ifcopenshell")
OPTIONS = ("-q", "-n", "0", "-p", "no:cacheprovider", "-W", "ignore::pytest.PytestAssertRewriteWarning")


@dataclass(frozen=True)
class Fault:
    """One place of a file, by its number in ``ast.walk``, and the change there."""

    file: Path
    number: int
    line: int
    change: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}  {self.change}"


def faulty(node: ast.AST) -> bool:
    """Change the node to a wrong one; False where it has no place for a fault."""
    if isinstance(node, ast.BinOp) and any(isinstance(x, ast.JoinedStr) for x in (node.left, node.right)):
        return False
    if isinstance(node, ast.BinOp | ast.BoolOp | ast.UnaryOp | ast.AugAssign) and type(node.op) in EXCHANGED:
        node.op = EXCHANGED[type(node.op)]()
    elif isinstance(node, ast.Compare) and type(node.ops[0]) in EXCHANGED:
        node.ops[0] = EXCHANGED[type(node.ops[0])]()
    elif isinstance(node, ast.If | ast.IfExp | ast.While) and not isinstance(node.test, ast.Compare):
        node.test = ast.UnaryOp(ast.Not(), node.test)
    elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        node.value = not node.value if isinstance(node.value, bool) else 2 * node.value or 1
    elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        node.value = ast.Constant(...)
    elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Yield):
        node.value = ast.YieldFrom(ast.Tuple([], ast.Load()))
    else:
        return False
    return True


def about_code(tree: ast.AST) -> Iterator[ast.AST]:
    """Annotations, decorators and ``strict=`` of zip, in which a fault changes no number."""
    for node in ast.walk(tree):
        kept = [getattr(node, "annotation", None), getattr(node, "returns", None)]
        kept += [node.value] if isinstance(node, ast.keyword) and node.arg == "strict" else []
        for part in filter(None, (*kept, *getattr(node, "decorator_list", []))):
            yield from ast.walk(part)


def faults(file: Path) -> list[Fault]:
    """All faults that the file has a place for."""
    tree, found = ast.parse(file.read_text(encoding="utf-8")), []
    left_out = set(map(id, about_code(tree)))
    for number, node in enumerate(ast.walk(tree)):
        usable = isinstance(node, ast.expr | ast.stmt) and id(node) not in left_out
        if usable and faulty(wrong := deepcopy(node)):
            here, there = (x.test if isinstance(x, ast.If | ast.While) else x for x in (node, wrong))
            found.append(Fault(file, number, node.lineno, f"{ast.unparse(here)}  →  {ast.unparse(there)}"))
    return found


def planted(source: str, fault: Fault) -> str:
    """The source with the fault."""
    tree = ast.parse(source)
    faulty(next(node for number, node in enumerate(ast.walk(tree)) if number == fault.number))
    return ast.unparse(tree)


def prepare(jobs: Path, numbers: Queue) -> None:
    """Make this process ready for its files: in a copy of the checkout, with the libraries loaded."""
    folder = jobs / str(numbers.get())
    folder.mkdir(parents=True, exist_ok=True)
    for part in COPIED:
        if Path(part).is_dir():
            shutil.rmtree(folder / part, ignore_errors=True)
            shutil.copytree(part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(part, folder)
    os.chdir(folder)
    os.environ |= {"PYTHONPATH": str(folder), "NUMBA_CACHE_DIR": str(folder / "numba")}
    sys.path[:] = [str(folder), *(path for path in sys.path if not Path(path, "pcmc").is_dir())]
    for library in LOADED:
        importlib.import_module(library)


class Clock:
    """A plugin of pytest: ``times.txt`` gets a line for each test, its processor time and its name."""

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        start = sum(os.times()[:4])  # with programs that it starts and waits for
        result = yield
        with open("times.txt", "a", encoding="utf-8") as times:
            times.write(f"{sum(os.times()[:4]) - start:.2f} {item.nodeid}\n")
        return result


def passed(arguments: list[str], plain: bool, seconds: float | None) -> bool:
    """Whether the tests pass, in no more than so long; ``output.txt`` has what pytest says."""

    def run() -> None:
        with open("output.txt", "wb") as output:
            os.dup2(output.fileno(), 1)
            os.dup2(output.fileno(), 2)
        if plain:
            os.environ["NUMBA_DISABLE_JIT"] = "1"
            importlib.import_module("numba").config.reload_config()
        code = pytest.main([*OPTIONS, *arguments], plugins=[Clock()])
        sys.stdout.flush()
        os._exit(int(code))

    process = multiprocessing.get_context("fork").Process(target=run)
    process.start()
    process.join(seconds)
    process.kill()
    process.join()
    return process.exitcode == 0


def survivors(file: Path, tests: list[str], longest: float, chosen: list[Fault]) -> list[Fault] | str:
    """The faults of one file that its tests do not see, planted in turn; or how these fail without."""
    source, start = file.read_text(encoding="utf-8"), time.monotonic()
    plain = "compiled" in source or "inlined" in source
    Path("times.txt").unlink(missing_ok=True)
    if not passed([str(file), *tests], plain, None):
        return Path("output.txt").read_text(encoding="utf-8", errors="replace")[-3000:]
    needed = [line.split(" ", 1) for line in Path("times.txt").read_text(encoding="utf-8").splitlines()]
    quick = sorted((float(seconds), test) for seconds, test in needed if float(seconds) <= longest)
    Path("tests.txt").write_text("\n".join(test for _, test in quick), encoding="utf-8")
    limit, missed = 60.0 + 5.0 * (time.monotonic() - start), []
    for fault in chosen:
        file.write_text(planted(source, fault), encoding="utf-8")
        if passed(["-x", "@tests.txt"], plain, limit):
            missed.append(fault)
    file.write_text(source, encoding="utf-8")
    return missed


def main() -> int:
    """Plant the faults and say which survive."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", type=Path, help="default: all of the table")
    parser.add_argument("--count", type=int, help="faults in a file; default: those of the table")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2, help="files at a time, each in a copy of its own")
    parser.add_argument("--folder", type=Path, help="keep the copies here: the next run need not compile")
    parser.add_argument(
        "--longest", type=float, help="s of a processor for a test; default: that of the table"
    )
    parser.add_argument("--tests", nargs="*", default=[], help="tests in addition to those of the table")
    asked = parser.parse_args()
    table = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    harmless = {(each["file"], each["line"], each["change"]) for each in table["harmless"]}
    chosen: dict[Path, list[Fault]] = {}
    for file in asked.files or map(Path, table["tests"]):
        every, draw = faults(file), random.Random(f"{asked.seed} {file.as_posix()}")
        chosen[file] = draw.sample(every, min(asked.count or table["count"], len(every)))
    total, missed, wrong = sum(map(len, chosen.values())), [], False
    fork = multiprocessing.get_context("fork")
    numbers = fork.Queue()
    for number in range(asked.jobs):
        numbers.put(number)
    with (
        tempfile.TemporaryDirectory() as folder,
        ProcessPoolExecutor(asked.jobs, fork, prepare, (asked.folder or Path(folder), numbers)) as pool,
    ):
        waiting = {}
        for file, of_file in chosen.items():
            tests = [*table["tests"].get(file.as_posix(), []), *asked.tests]
            waiting[pool.submit(survivors, file, tests, asked.longest or table["longest"], of_file)] = file
        for done in as_completed(waiting):
            file, found = waiting[done], done.result()
            if isinstance(found, str):
                print(f"{file}: its tests fail without a fault\n{found}", flush=True)
                wrong = True
                continue
            lines = file.read_text(encoding="utf-8").splitlines()
            known = [(file.as_posix(), lines[fault.line - 1].strip(), fault.change) for fault in found]
            unseen = [fault for fault, key in zip(found, known, strict=True) if key not in harmless]
            count, without = len(chosen[file]), len(found) - len(unseen)
            print(f"{file}: {count} faults, {count - len(found)} seen, {without} without harm", flush=True)
            for fault in unseen:
                print(f"    {fault}", flush=True)
            missed.extend(unseen)
    print(f"{len(missed)} of {total} faults survived", *missed, sep="\n")
    return bool(missed or wrong)


if __name__ == "__main__":
    sys.exit(main())
