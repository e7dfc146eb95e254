"""Plant small faults, one at a time, and list those that no test sees.

``python .ci/mutants.py pcmc/base/units.py pcmc/certificate/verdict.py --count 20 --tests tests/project``

A fault is an operator, a comparison, a sign, a condition or a number exchanged in one place of a copy of the
checkout. In each file ``count`` places are drawn at random. The tests that look for a fault are the doctests
of its file, those in the tests' folder of its subpackage, and those named. Exit code 1 if a fault survives.
"""

import argparse
import ast
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PAIRS = [(ast.Add, ast.Sub), (ast.Mult, ast.Div), (ast.And, ast.Or), (ast.Lt, ast.GtE), (ast.Gt, ast.LtE)]
PAIRS += [(ast.Eq, ast.NotEq), (ast.Is, ast.IsNot), (ast.In, ast.NotIn), (ast.USub, ast.UAdd)]
EXCHANGED = dict(PAIRS) | {there: here for here, there in PAIRS}


def faulty(node: ast.AST) -> ast.AST | None:
    """The node with a fault; None where it has no place for one."""
    if isinstance(node, ast.BinOp | ast.BoolOp | ast.UnaryOp) and type(node.op) in EXCHANGED:
        if isinstance(node, ast.BinOp) and any(isinstance(x, ast.JoinedStr) for x in (node.left, node.right)):
            return None
        node.op = EXCHANGED[type(node.op)]()
        return node
    if isinstance(node, ast.Compare) and type(node.ops[0]) in EXCHANGED:
        node.ops[0] = EXCHANGED[type(node.ops[0])]()
        return node
    if isinstance(node, ast.If | ast.IfExp | ast.While):
        node.test = ast.UnaryOp(ast.Not(), node.test)
        return node
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        node.value = not node.value if isinstance(node.value, bool) else 2 * node.value or 1
        return node
    return None


def places(source: str) -> list[tuple[int, int]]:
    """(position in ``ast.walk``, line) of each possible fault."""
    found = []
    for number, node in enumerate(ast.walk(ast.parse(source))):
        if isinstance(node, ast.expr | ast.If | ast.While) and faulty(node) is not None:
            found.append((number, node.lineno))
    return found


def planted(source: str, number: int) -> str:
    """The source with the fault at a place."""
    tree = ast.parse(source)
    for at, node in enumerate(ast.walk(tree)):
        if at == number:
            faulty(node)
    return ast.unparse(tree)


def main() -> int:
    """Plant the faults and say which survive."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--tests", nargs="*", default=[])
    asked = parser.parse_args()
    survived = []
    with tempfile.TemporaryDirectory() as folder:
        for part in ("pcmc", "generators", "studies", "tests", "results", "notebooks", "docs"):
            shutil.copytree(part, Path(folder, part))
        for part in ("pyproject.toml", "README.md", "constraints.txt"):
            shutil.copy(part, folder)
        for file in asked.files:
            source, copy = file.read_text(encoding="utf-8"), Path(folder, file)
            every = places(source)
            chosen = sorted(random.Random(asked.seed).sample(every, min(asked.count, len(every))))
            tests = [str(file), f"tests/{file.parts[1]}", *asked.tests]
            for number, line in chosen:
                copy.write_text(planted(source, number), encoding="utf-8")
                command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
                code = subprocess.run(command, cwd=folder, capture_output=True, check=False).returncode
                print("survived" if code == 0 else "seen    ", f"{file}:{line}", flush=True)
                if code == 0:
                    survived.append(f"{file}:{line}  {source.splitlines()[line - 1].strip()}")
            copy.write_text(source, encoding="utf-8")
    print(f"{len(survived)} faults survived", *survived, sep="\n")
    return bool(survived)


if __name__ == "__main__":
    sys.exit(main())
