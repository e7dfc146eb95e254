"""Compiling loops over arrays, and running them on several threads."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numba
import numpy as np
import platformdirs

from . import validate

BLOCK = 32_768  # below this many triangles a second thread costs more than it gains
CONFIG: Any = numba.config


def sources() -> list[Path]:
    """The files whose text is in compiled code: those of loops, and of the constants that they read."""
    files = sorted(Path(__file__).parents[1].rglob("*.py"))
    return [path for path in files if b"compiled" in path.read_bytes() or path.stem == "tolerances"]


def kept_in() -> str:
    """The folder of this code, below NUMBA_CACHE_DIR or the user's cache.

    numba keeps a function for as long as its own file is the same. What it calls is part of it, and an index
    that names a class of former code cannot be read: other code needs another folder.
    """
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in sources())).hexdigest()
    return str(Path(CONFIG.CACHE_DIR or platformdirs.user_cache_path("pcmc") / "compiled") / digest[:12])


KEPT_IN = kept_in()


def compiled(function: Callable[..., Any], **options: Any) -> Any:
    """Compile a function of numbers and arrays at its first call, without Python's lock, and keep it."""
    given, CONFIG.CACHE_DIR = CONFIG.CACHE_DIR, KEPT_IN
    try:
        return numba.njit(cache=True, nogil=True, error_model="numpy", **options)(function)
    finally:
        CONFIG.CACHE_DIR = given


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a short function into those that call it."""
    return compiled(function, forceinline=True)


def threads() -> int:
    """Threads used on large meshes: the processors this process may run on, at most eight.

    The environment variable PCMC_THREADS sets another number, as sweeps do for their workers; OptionError if
    that is not a whole number ≥ 1.
    """
    wish = os.environ.get("PCMC_THREADS", "")
    if wish:
        if not wish.isdecimal() or int(wish) < 1:
            validate.refuse("PCMC_THREADS", wish, "a whole number ≥ 1")
        return int(wish)
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return max(1, min(8, usable or 1))


def blocks(count: int, workers: int | None = None) -> list[tuple[int, int]]:
    """Cut ``count`` triangles into equal ranges of at least BLOCK, one a worker; by default ``threads``.

    >>> blocks(100_000, 2)
    [(0, 50000), (50000, 100000)]
    >>> blocks(1000)
    [(0, 1000)]
    """
    parts = max(1, count // BLOCK)
    if parts > 1:  # asking the system for processors takes as long as the loops of a small mesh
        parts = min(parts, workers or threads())
    return [(count * k // parts, count * (k + 1) // parts) for k in range(parts)]


def sum_blocks(work: Callable[[int, int, Any], None], count: int, shape: tuple[int, ...]) -> Any:
    """The sum of what ``work(first, last, out)`` adds to arrays of this shape, one for each block.

    They are added in order: the same number of workers gives the same bytes.
    """
    out = [np.zeros(shape) for _ in blocks(count)]
    run_blocks(lambda part, first, last: work(first, last, out[part]), count)
    for other in out[1:]:
        out[0] += other
    return out[0]


def run_blocks(work: Callable[[int, int, int], None], count: int, workers: int | None = None) -> int:
    """Call ``work(part, first, last)`` for each block, on threads if there are several; return how many.

    The first block is done by the caller: its processor is awake, and the others' threads go elsewhere.
    """
    first, *others = blocks(count, workers)
    if not others:
        work(0, *first)
        return 1
    with ThreadPoolExecutor(len(others)) as pool:
        waiting = [pool.submit(work, part, *block) for part, block in enumerate(others, start=1)]
        work(0, *first)
        for each in waiting:
            each.result()
    return 1 + len(others)
