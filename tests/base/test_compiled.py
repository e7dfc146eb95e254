"""Compiled loops are kept per state of the code that they are made of."""

import ast
import sys
from pathlib import Path

import numba
from numba.core.dispatcher import Dispatcher

import pcmc  # noqa: F401
from pcmc.base import compiled as kept
from pcmc.certificate import lipschitz  # noqa: F401


def dispatchers():
    """(module, function) of all loops that are imported."""
    for name, module in sorted(sys.modules.items()):
        if name.startswith("pcmc."):
            for value in vars(module).values():
                if isinstance(value, Dispatcher) and value.py_func.__module__ == name:
                    yield module, value


def test_other_code_is_kept_elsewhere(tmp_path, monkeypatch):
    loop = tmp_path / "loop.py"
    monkeypatch.setattr(kept, "sources", lambda: [loop])
    folders = []
    for text in ("x = 1", "x = 2", "x = 1"):
        loop.write_text(text, encoding="utf-8")
        folders.append(kept.kept_in())
    assert folders[0] == folders[2] != folders[1]


def test_every_loop_is_kept_there_and_nothing_of_others():
    found = list(dispatchers())
    assert len(found) > 30
    assert all(loop._cache.cache_path.startswith(kept.KEPT_IN) for _, loop in found)
    theirs = numba.njit(cache=True)(test_other_code_is_kept_elsewhere)
    assert not theirs._cache.cache_path.startswith(kept.KEPT_IN)


def test_what_loops_read_is_in_the_sources():
    files = {str(path) for path in kept.sources()}
    for module, loop in dispatchers():
        assert module.__file__ in files
        tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8"))
        imported = {
            alias.asname or alias.name: f"{module.__package__.rsplit('.', node.level - 1)[0]}.{node.module}"
            for node in tree.body
            if isinstance(node, ast.ImportFrom) and node.level
            for alias in node.names
        }
        for name in set(loop.py_func.__code__.co_names) & imported.keys():
            if isinstance(vars(module)[name], int | float):
                assert sys.modules[imported[name]].__file__ in files, f"{name} of {module.__name__}"
