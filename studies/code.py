"""Which code a study's numbers come from, and hashes of it that comments and docstrings do not change.

The code that matters for a study: what its ``data`` reaches, in its own file and in every module of this
checkout that it imports names of, and so on; a class counts whole. What only draws, keeps files or runs
several cases at once does not count.
"""

from __future__ import annotations

import ast
import hashlib
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from functools import cache
from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

HOME = Path(__file__).resolve().parent.parent
PACKAGES = ("pcmc", "generators", "studies")
NO_MATTER = (  # module and all below it
    "pcmc.drawings.",
    "pcmc.plot.",
    "pcmc.report.",
    "pcmc.sweep.",
    "studies.cases.",
    "studies.folder.",
    "studies.figure_panels.",
    "studies.study.",
)
PROJECTS = ("roof.toml",)  # files in notebooks/ that some studies solve
START = "data"  # the step of a study that computes
IMPORT = ast.Import | ast.ImportFrom
ALL = "*"  # in place of a name: the whole module
THERE = """
import json, pathlib, sys
from studies import code
code.HOME = pathlib.Path(sys.argv[1])
print(json.dumps({name: code.code_of(name) if code._exists(name) else {} for name in sys.argv[2:]}))
"""  # a process of its own: what is read once is kept
PRIVATE = re.compile(r"\b_(?=[a-z])")  # a name that becomes public is no other code
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


def code_at(commit: str, studies: Sequence[str]) -> dict[str, dict[str, str]]:
    """``code_of`` of some studies' modules as it was at a commit; {} for a module that was not there.

    Computed by the rules of today, so that these may change without every result being stale.
    """
    paths = [*PACKAGES, *(f"notebooks/{project}" for project in PROJECTS)]
    words = ["git", "-C", str(HOME), "archive", "--format=zip", commit, "--", *paths]
    with tempfile.TemporaryDirectory() as folder:
        packed = subprocess.run(words, capture_output=True, check=True).stdout
        with ZipFile(BytesIO(packed)) as files:
            files.extractall(folder)
        words = [sys.executable, "-c", THERE, folder, *studies]
        found = subprocess.run(words, capture_output=True, check=True, cwd=HOME, text=True).stdout
    return dict(json.loads(found))


def files_of(study: str) -> dict[str, str]:
    """The hash of what matters for a study's numbers of each file, by its path."""
    wanted: dict[str, set[str]] = {}
    waiting = [(study, START)]
    while waiting:
        module, name = waiting.pop()
        names = wanted.setdefault(module, set())
        if name not in names and not f"{module}.".startswith(NO_MATTER):
            names.add(name)
            waiting += _needs(module, name)
    found = {
        _name(_path(module)): _hash(_path(module), frozenset(names))
        for module, names in wanted.items()
        if names
    }
    own = _reached(_tree(_path(study)), frozenset({START}))
    words = {node.value for node in ast.walk(own) if isinstance(node, ast.Constant)}
    for project in words.intersection(PROJECTS):
        path = HOME / "notebooks" / str(project)
        found[_name(path)] = _short(path.read_text(encoding="utf-8"))
    return dict(sorted(found.items()))


@cache
def _needs(module: str, name: str) -> tuple[tuple[str, str], ...]:
    """The names that a name of a module needs directly, of this module and of others."""
    tree, named = _tree(_path(module)), _named(_path(module))
    if name not in named:
        return tuple(_imports(tree, module))
    nodes = [node for node in (named[name], *_loose(_path(module))) if not isinstance(node, IMPORT)]
    used = {name}.union(*map(_names_in, nodes))
    imports = [_with_names(node, used) for node in tree.body if isinstance(node, IMPORT)]
    own = {other for other in used & named.keys() if not isinstance(named[other], IMPORT)}
    return (*((module, other) for other in own), *_imports(ast.Module([*imports, *nodes], []), module))


@cache
def _named(path: Path) -> dict[str, ast.stmt]:
    """The statements on top of a module by the names that they bind."""
    return {name: node for node in _tree(path).body for name in _binds(node)}


def _reached(tree: ast.Module, starts: frozenset[str]) -> ast.Module:
    """A module's definitions that these names use, directly or through others; and its imports of them.

    What runs whenever the module is imported belongs to them. A name that the module does not bind stands for
    all of it, as ALL does.
    """
    named = {name: node for node in tree.body for name in _binds(node)}
    if not starts <= named.keys():
        return tree
    loose = [node for node in tree.body if _runs(node)]
    used: set[str] = set()
    waiting = [*starts, *(part.id for node in loose for part in _run(node) if isinstance(part, ast.Name))]
    while waiting:
        name = waiting.pop()
        if name in named and name not in used:
            used.add(name)
            waiting += _names_in(named[name])
    body: list[ast.stmt] = []
    for node in tree.body:
        if isinstance(node, IMPORT):
            kept = _with_names(node, used)
            body += [kept] if kept.names else []
        elif node in loose or used.intersection(_binds(node)):
            body.append(node)
    return ast.Module(body, [])


@cache
def _loose(path: Path) -> list[ast.stmt]:
    """The statements on top of a module that run whenever it is imported."""
    return [node for node in _tree(path).body if _runs(node)]


def _runs(node: ast.stmt) -> bool:
    """Whether a statement on top of a module does more than give names to something."""
    if isinstance(node, ast.Assign):
        return any(not isinstance(target, ast.Name | ast.Tuple) for target in node.targets)
    plain = ast.Import | ast.ImportFrom | ast.FunctionDef | ast.ClassDef | ast.AnnAssign
    return not (isinstance(node, plain) or _is_words(node) or _for_types(node))


def _with_names(node: ast.Import | ast.ImportFrom, used: set[str]) -> ast.Import | ast.ImportFrom:
    """An import of those names alone that are used."""
    names = [alias for alias in node.names if (alias.asname or alias.name).split(".")[0] in used]
    if isinstance(node, ast.Import):
        return ast.Import(names)
    return ast.ImportFrom(node.module, names, node.level)


def _binds(node: ast.stmt) -> list[str]:
    """The names that a statement on top of a module gives something to."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return [node.name]
    if isinstance(node, IMPORT):
        return [(alias.asname or alias.name).split(".")[0] for alias in node.names]
    stored = (part for part in ast.walk(node) if isinstance(part, ast.Name))
    return [part.id for part in stored if isinstance(part.ctx, ast.Store)]


def _imports(tree: ast.Module, module: str) -> Iterator[tuple[str, str]]:
    """The names of other modules of this checkout that a module's code imports: (module, name or ALL)."""
    package = module if _path(module).name == "__init__.py" else module.rpartition(".")[0]
    modules = {}  # by the name that stands for one here
    nodes = [part for statement in tree.body for part in _run(statement)]
    for node in nodes:
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.split(".")[0] in PACKAGES:
                    modules[alias.asname or alias.name] = alias.name
        elif isinstance(node, ast.ImportFrom):
            source = _absolute(node, package)
            for alias in node.names if source.split(".")[0] in PACKAGES else ():
                if _exists(f"{source}.{alias.name}"):
                    modules[alias.asname or alias.name] = f"{source}.{alias.name}"
                else:
                    yield from _home(source, alias.name)
        elif isinstance(node, ast.Call) and _is_import_module(node):
            yield from ((found, ALL) for found in _imported_by_call(node, package))
    parts = set()
    for node in nodes:
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in modules:
            parts.add(node.value)
            yield from _home(modules[node.value.id], node.attr)
    for node in nodes:  # a module handed on as it is
        if isinstance(node, ast.Name) and node.id in modules and node not in parts:
            yield modules[node.id], ALL


@cache
def _run(statement: ast.stmt) -> list[ast.AST]:
    """Its nodes but those that only a type checker reads."""
    found, waiting = list[ast.AST](), list[ast.AST]([statement])
    while waiting:
        node = waiting.pop()
        if not _for_types(node):
            found.append(node)
            waiting += ast.iter_child_nodes(node)
    return found


@cache
def _names_in(statement: ast.stmt) -> frozenset[str]:
    return frozenset(part.id for part in ast.walk(statement) if isinstance(part, ast.Name))


def _absolute(node: ast.ImportFrom, package: str) -> str:
    if not node.level:
        return node.module or ""
    base = package.split(".")[: len(package.split(".")) - node.level + 1]
    return ".".join([*base, *filter(None, [node.module])])


def _for_types(node: ast.AST) -> bool:
    """Whether only a type checker reads this."""
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def _home(source: str, name: str) -> Iterator[tuple[str, str]]:
    """Where ``from source import name`` finds it: a package hands on what others define."""
    below = f"{source}.{name}"
    if _exists(below):
        yield below, ALL
    elif _path(source).name == "__init__.py" and name in _handed_on(source):
        module, original = _handed_on(source)[name]
        if module == source:
            yield f"{source}.{original}", ALL
        else:
            yield from _home(module, original)
    elif _exists(source):
        yield source, name


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


@cache
def _path(module: str) -> Path:
    folder = HOME.joinpath(*module.split("."))
    return folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")


@cache
def _exists(module: str) -> bool:
    return _path(module).is_file()


def _name(path: Path) -> str:
    return path.relative_to(HOME).as_posix()


@cache
def _tree(path: Path) -> ast.Module:
    """The code of a file without docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            first, *rest = node.body or [ast.Pass()]
            node.body = (rest or [ast.Pass()]) if _is_words(first) else node.body
    return tree


@cache
def _hash(path: Path, names: frozenset[str]) -> str:
    """Of what these names reach of a file, without comments and docstrings, and with all names public."""
    return _short(PRIVATE.sub("", ast.unparse(_reached(_tree(path), names))))


def _is_words(node: ast.stmt) -> bool:
    """Whether a statement is a docstring."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _short(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:DIGITS]
