"""Which code a study's numbers come from, and hashes of it that comments and docstrings do not change.

The code that matters for a study: of its own file what ``data`` reaches, and every module of this checkout
that this imports, and so on. What only draws, keeps files or runs several cases at once does not count.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

HOME = Path(__file__).resolve().parent.parent
PACKAGES = ("pcmc", "generators", "studies")
NO_MATTER = (  # module and all below it
    "pcmc.drawings",
    "pcmc.plot",
    "pcmc.report",
    "pcmc.sweep",
    "studies.cases",
    "studies.folder",
    "studies.figure_panels",
    "studies.study",
)
PROJECTS = ("roof.toml",)  # files in notebooks/ that some studies solve
START = "data"  # the step of a study that computes
DIGITS = 10  # of a hash, hexadecimal


def code_of(study: str) -> dict[str, str]:
    """Hashes of the code that matters for a study's numbers, by folder; of studies by file.

    ``study`` is the study's module.

    >>> code = code_of("studies.examples.equilibria")
    >>> [folder in code for folder in ("pcmc/solvers", "studies/examples/equilibria.py", "pcmc/plot")]
    [True, True, False]
    """
    parts: dict[str, list[str]] = {}
    for name, digest in files_of(study).items():
        folder = name if name.startswith(("studies/", "notebooks/")) else name.rpartition("/")[0]
        parts.setdefault(folder, []).append(f"{name} {digest}")
    return {folder: _short("\n".join(lines)) for folder, lines in sorted(parts.items())}


def files_of(study: str) -> dict[str, str]:
    """The hash of each file that matters for a study's numbers, by its path."""
    own = _reached(_tree(_path(study)), START)
    found = {_name(_path(study)): _hash(own)}
    waiting = list(_imports(own, study))
    while waiting:
        module = waiting.pop()
        path = _path(module)
        if _name(path) not in found and not module.startswith(NO_MATTER):
            found[_name(path)] = _file_hash(path)
            waiting += _file_imports(module)
    words = {node.value for node in ast.walk(own) if isinstance(node, ast.Constant)}
    for project in words.intersection(PROJECTS):
        path = HOME / "notebooks" / str(project)
        found[_name(path)] = _short(path.read_text(encoding="utf-8"))
    return dict(sorted(found.items()))


def _reached(tree: ast.Module, start: str) -> ast.Module:
    """A module's definitions that ``start`` uses, directly or through others; and its imports of them."""
    named = {name: node for node in tree.body for name in _binds(node)}
    used, waiting = set(), [start]
    while waiting:
        name = waiting.pop()
        if name in named and name not in used:
            used.add(name)
            waiting += [part.id for part in ast.walk(named[name]) if isinstance(part, ast.Name)]
    body: list[ast.stmt] = []
    for node in tree.body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [alias for alias in node.names if (alias.asname or alias.name).split(".")[0] in used]
            body += [_with_names(node, names)] if names else []
        elif used.intersection(_binds(node)):
            body.append(node)
    return ast.Module(body, [])


def _with_names(node: ast.Import | ast.ImportFrom, names: list[ast.alias]) -> ast.Import | ast.ImportFrom:
    if isinstance(node, ast.Import):
        return ast.Import(names)
    return ast.ImportFrom(node.module, names, node.level)


def _binds(node: ast.stmt) -> list[str]:
    """The names that a statement on top of a module gives something to."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return [node.name]
    if isinstance(node, ast.Import | ast.ImportFrom):
        return [(alias.asname or alias.name).split(".")[0] for alias in node.names]
    stored = (part for part in ast.walk(node) if isinstance(part, ast.Name))
    return [part.id for part in stored if isinstance(part.ctx, ast.Store)]


def _imports(tree: ast.Module, module: str) -> Iterator[str]:
    """The modules of this checkout that a module's code imports."""
    package = module if _path(module).name == "__init__.py" else module.rpartition(".")[0]
    aliases = {}
    for node in _run(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.split(".")[0] in PACKAGES:
                    aliases[alias.asname or alias.name] = alias.name
        elif isinstance(node, ast.ImportFrom):
            source = _absolute(node, package)
            for alias in node.names if source.split(".")[0] in PACKAGES else ():
                yield from _home(source, alias.name)
        elif isinstance(node, ast.Call) and _is_import_module(node):
            yield from _imported_by_call(node, package)
    for node in _run(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in aliases:
            yield from _home(aliases[node.value.id], node.attr)


def _run(tree: ast.AST) -> Iterator[ast.AST]:
    """All nodes but those that only a type checker reads."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            continue
        yield node
        waiting += ast.iter_child_nodes(node)


def _absolute(node: ast.ImportFrom, package: str) -> str:
    if not node.level:
        return node.module or ""
    base = package.split(".")[: len(package.split(".")) - node.level + 1]
    return ".".join([*base, *filter(None, [node.module])])


def _home(source: str, name: str) -> Iterator[str]:
    """The modules that ``from source import name`` needs: a package hands on what others define."""
    below = f"{source}.{name}"
    if _exists(below):
        yield below
    elif _path(source).name == "__init__.py" and name in _handed_on(source):
        module, original = _handed_on(source)[name]
        if module == source:
            yield f"{source}.{original}"
        else:
            yield from _home(module, original)
    elif _exists(source):
        yield source


@cache
def _handed_on(package: str) -> dict[str, tuple[str, str]]:
    """Of the names that a package imports, also for type checkers alone: the module, and the name there."""
    return {
        alias.asname or alias.name: (_absolute(node, package), alias.name)
        for node in ast.walk(_tree(_path(package)))
        if isinstance(node, ast.ImportFrom) and _absolute(node, package).split(".")[0] in PACKAGES
        for alias in node.names
    }


def _is_import_module(node: ast.Call) -> bool:
    called = node.func
    return (
        called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")
    ) == "import_module"


def _imported_by_call(node: ast.Call, package: str) -> Iterator[str]:
    """A module named in full, or all of the package where the name is only known as the code runs."""
    named = node.args[0]
    if isinstance(named, ast.Constant):
        yield from [str(named.value)] if str(named.value).split(".")[0] in PACKAGES else []
    elif package != "pcmc" and len(node.args) > 1:
        for path in sorted(_path(package).parent.glob("*.py")):
            yield package if path.name == "__init__.py" else f"{package}.{path.stem}"
        for path in sorted(_path(package).parent.glob("*/__init__.py")):
            yield f"{package}.{path.parent.name}"


def _path(module: str) -> Path:
    folder = HOME.joinpath(*module.split("."))
    return folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")


def _exists(module: str) -> bool:
    return _path(module).is_file()


def _name(path: Path) -> str:
    return path.relative_to(HOME).as_posix()


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def _file_imports(module: str) -> tuple[str, ...]:
    return tuple(_imports(_tree(_path(module)), module))


@cache
def _file_hash(path: Path) -> str:
    return _hash(_tree(path))


def _hash(tree: ast.Module) -> str:
    """Of the code as it would be written without comments and docstrings."""
    bare = ast.parse(ast.unparse(tree))
    for node in ast.walk(bare):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and node.body:
            first = node.body[0]
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
                node.body = node.body[1:] or [ast.Pass()]
    return _short(ast.unparse(bare))


def _short(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:DIGITS]
