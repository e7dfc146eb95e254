"""The size and structure of the package in numbers: ``python .ci/house.py [folder]``.

Lines by subpackage (Python and page), imports from one subpackage to another, names that two subpackages
define at their top level, private functions that are named once beside their definition, numeric constants.
"""

import ast
import re
import sys
from collections import Counter, defaultdict
from pathlib import Path

PAGE = {".js", ".css", ".html"}
root = Path(sys.argv[1] if len(sys.argv) > 1 else "pcmc")
package = root.name
lines: Counter[str] = Counter()
arrows: set[tuple[str, str]] = set()
places: dict[str, set[str]] = defaultdict(set)
private: list[str] = []
words: Counter[str] = Counter()
constants = 0


def imported(node: ast.AST, inside: tuple[str, ...]) -> list[str]:
    """The subpackages of the package that an import statement of a file in ``inside`` names."""
    if isinstance(node, ast.Import):
        dotted = [alias.name.split(".") for alias in node.names]
        return [name[1] for name in dotted if name[0] == package and len(name) > 1]
    if not isinstance(node, ast.ImportFrom):
        return []
    start = (package, *inside)[: len(inside) + 2 - node.level] if node.level else ()
    parts = [*start, *(node.module or "").split(".")] if node.module else list(start)
    if parts[:1] != [package]:
        return []
    return [parts[1]] if len(parts) > 1 else [alias.name for alias in node.names]


for path in sorted(root.rglob("*")):
    if path.suffix not in PAGE | {".py"}:
        continue
    parts = path.relative_to(root).parts
    room, text = (parts[0] if len(parts) > 1 else "."), path.read_text(encoding="utf-8")
    lines[room] += len(text.splitlines())
    if path.suffix != ".py":
        continue
    words.update(re.findall(r"\w+", text))
    tree = ast.parse(text)
    if room != ".":
        arrows |= {(room, other) for node in ast.walk(tree) for other in imported(node, parts[:-1])}
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and re.match(r"_[^_]", node.name):
            private.append(node.name)
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            places[node.name].add(room)
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            number = isinstance(node.value, ast.Constant | ast.UnaryOp | ast.BinOp | ast.Call)
            numeric = number and not any(
                isinstance(part, ast.Constant) and isinstance(part.value, str)
                for part in ast.walk(node.value)
            )
            constants += node.targets[0].id.isupper() and numeric

rooms = set(lines) - {"."}
arrows = {(one, other) for one, other in arrows if one != other and other in rooms}
twice = sorted(name for name, where in places.items() if len(where) > 1)
for room, count in lines.most_common():
    print(f"{room:<16}{count:>7}")
print(f"{'lines':<16}{lines.total():>7}")
print(f"arrows between {len(rooms)} subpackages: {len(arrows)}")
print(f"private functions with one caller: {sum(words[name] == 2 for name in private)} of {len(private)}")
print(f"numeric constants: {constants}")
print(f"names of two subpackages: {len(twice)} ({', '.join(twice)})")
