"""Sparse symmetric factorisation with inertia, behind one small interface.

A matrix is the upper triangle of a fixed pattern (``pattern.Pattern``) with values. A factoriser
does the symbolic work once per pattern; ``factor`` then takes new values. Backends, fastest first:
``"pardiso"`` (MKL, extra ``fast``) and ``"superlu"`` (scipy, everywhere).
"""

from __future__ import annotations

import ctypes
import importlib.util
import math
import os
import re
import threading
import weakref
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import metadata
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import splu

from ..base import validate
from ..base.arrays import Floats, Ints
from ..base.errors import MissingExtra, PcmcError
from ..forces.pattern import Pattern
from .diagonal_pivots import ZERO, SingularMatrix, count_negative

__all__ = ("BACKENDS", "Factor", "Factoriser", "Linear", "SingularMatrix", "factoriser", "installed")
BACKENDS = ("pardiso", "superlu")
Linear = Callable[[Floats], Floats]
"""A linear map, such as A⁻¹, of one vector (N,) or several (N,k)."""
TINY = float(np.finfo(float).tiny)
ONE_THREAD = 10_000  # rows; up to here MKL is fastest with one thread
ONE, SYMMETRIC, SILENT = (ctypes.byref(ctypes.c_int32(number)) for number in (1, -2, 0))

IPARM = {  # MKL's parameters by their numbers from 1
    1: 1,  # the values below instead of the defaults
    2: 2,  # fill-in reduced by METIS
    8: 0,  # steps of iterative refinement: at most two, where a pivot was replaced
    10: round(-math.log10(ZERO)),  # pivots below 10 to minus this are replaced
    11: 0,  # no scaling
    13: 0,  # no weighted matching
    21: 1,  # pivots of one and two rows: Bunch and Kaufman
    24: 1,  # two-level parallel factorisation
}


@dataclass(frozen=True, eq=False)
class Factor:
    """A factorised matrix A."""

    solve: Linear
    count: Callable[[], int]
    lu: Any = None  # SuperLU's factors, if it made them

    @cached_property
    def negative(self) -> int:
        """Number of negative eigenvalues (Sylvester: negative pivots of D in L D Lᵀ)."""
        return self.count()


class Factoriser(Protocol):
    """Factorises matrices of one pattern."""

    def factor(self, data: Floats) -> Factor:
        """Factorise the matrix with these upper-triangle values.

        A new factor replaces the last: with PARDISO, that one then solves no more (``PcmcError``).
        """


@cache
def installed() -> tuple[str, ...]:
    """Backends that are installed here, fastest first."""
    return BACKENDS if importlib.util.find_spec("pypardiso") is not None else ("superlu",)


def factoriser(pattern: Pattern, backend: str | None = None, units: Floats | None = None) -> Factoriser:
    """A factoriser for the pattern, by the fastest backend installed or the one named.

    With ``units`` u (N,), U A U is factorised in place of A, U = diag(u) > 0, so that weak parts are not
    taken for zero beside strong ones. Neither the solution nor the inertia depends on them.

    >>> from scipy.sparse import csr_array
    >>> pattern = Pattern(np.array([0, 2, 3]), np.array([0, 1, 1]), np.empty((0, 3)))
    >>> factor = factoriser(pattern, "superlu").factor(np.array([1.0, 2.0, 1.0]))
    >>> factor.negative, factor.solve(np.array([3.0, 3.0])).round(12).tolist()
    (1, [1.0, 1.0])
    """
    chosen = validate.choice("backend", backend or installed()[0], BACKENDS)
    if chosen not in installed():
        raise MissingExtra("pypardiso", "fast")
    # MKL refuses a matrix without rows
    plain = _Pardiso(pattern) if chosen == "pardiso" and pattern.size else _SuperLU(pattern)
    return plain if units is None else _Scaled(plain, pattern, units)


class _Scaled:
    """Factorises U A U."""

    def __init__(self, plain: Factoriser, pattern: Pattern, units: Floats) -> None:
        self._plain, self._units = plain, units
        self._products = np.repeat(units, np.diff(pattern.indptr)) * units[pattern.indices]

    def factor(self, data: Floats) -> Factor:
        plain = self._plain.factor(self._products * data)

        def solve(right: Floats) -> Floats:
            units = self._units if right.ndim == 1 else self._units[:, None]
            return units * plain.solve(units * right)

        return Factor(solve, lambda: plain.negative)


def _finite(data: Floats) -> None:
    if not np.isfinite(data).all():
        raise SingularMatrix("the matrix has entries that are not finite")


class _SuperLU:
    """scipy's SuperLU in symmetric mode: pivots stay on the diagonal.

    After refinement neighbours have numbers far apart, and the minimum-degree ordering takes several times
    as long as the factorisation: rows in Cuthill-McKee order avoid this. The first matrix orders all.
    """

    def __init__(self, pattern: Pattern) -> None:
        self._full = pattern.symmetric(np.arange(1.0, 1 + len(pattern.indices)))
        self._ordering = "MMD_AT_PLUS_A"
        empty = np.empty(0, dtype=np.int32)
        self._arrange(reverse_cuthill_mckee(self._full, symmetric_mode=True) if pattern.size else empty)

    def _arrange(self, order: Ints) -> None:
        arranged = csc_array(self._full[order][:, order])
        arranged.sort_indices()
        self._order = order
        self._source = arranged.data.astype(np.int64) - 1
        self._indices, self._indptr = arranged.indices, arranged.indptr

    def factor(self, data: Floats) -> Factor:
        _finite(data)
        matrix = csc_array((data[self._source], self._indices, self._indptr), self._full.shape)
        try:
            lu = _superlu(matrix, self._ordering)
        except RuntimeError as error:
            raise SingularMatrix(str(error)) from None
        order = self._order
        if self._ordering != "NATURAL":
            self._ordering = "NATURAL"
            self._arrange(order[np.argsort(lu.perm_c)])

        def solve(right: Floats) -> Floats:
            right = right[order]
            first = lu.solve(right)
            out = np.empty_like(first)
            out[order] = first + lu.solve(right - matrix @ first)
            return out

        return Factor(solve, lambda: count_negative(matrix, lu, _superlu), lu)


def _superlu(matrix: csc_array, ordering: Any = "MMD_AT_PLUS_A") -> Any:
    return splu(matrix, ordering, 0.0, panel_size=4, options={"SymmetricMode": True})


class _Pardiso:
    """MKL PARDISO on the upper triangle: mtype -2, real symmetric indefinite."""

    def __init__(self, pattern: Pattern) -> None:
        self._pattern = pattern
        self._memory = _Memory(pattern)
        self._lock = threading.Lock()
        self._analysed = False
        self._made = 0  # factorisations so far: MKL keeps the last one only

    def factor(self, data: Floats) -> Factor:
        _finite(data)
        # scaled to entries below 1: MKL compares pivots with a fixed number
        unit = 0.5 ** math.frexp(np.abs(data).max(initial=TINY))[1]
        data = unit * data
        nothing = np.zeros(self._pattern.size)
        self._made += 1
        made = self._made
        if not self._analysed:
            self._run(11, data, nothing)
            self._analysed = True
            # the factor is memory of MKL's: freed with this object, not at exit
            weakref.finalize(self, self._memory.run, -1, np.zeros_like(data), nothing).atexit = False
        self._run(22, data, nothing)
        if replaced := self._memory.iparm[13]:
            raise SingularMatrix(f"{replaced} pivots are zero to rounding")
        negative = int(self._memory.iparm[22])
        return Factor(lambda right: self._run(33, data, unit * right, made), lambda: negative)

    def _run(self, phase: int, data: Floats, right: Floats, made: int | None = None) -> Floats:
        """A phase of MKL's, on one thread if the matrix is small; where it uses a factor, the ``made``-th."""
        set_threads = _mkl().MKL_Set_Num_Threads_Local
        with self._lock:
            if made not in (None, self._made):
                text = "this factorisation is out of date: its factoriser has made another one since;"
                raise PcmcError(f"{text} factorise its matrix again, or use a factoriser for each")
            before = set_threads(1) if self._pattern.size <= ONE_THREAD else None
            try:
                return self._memory.run(phase, data, right)
            finally:
                if before is not None:
                    set_threads(before)


class _Memory:
    """What PARDISO keeps of one pattern; pypardiso itself would copy the pattern for each solution."""

    def __init__(self, pattern: Pattern) -> None:
        self.iparm = np.zeros(64, dtype=np.int32)
        self.iparm[[number - 1 for number in IPARM]] = list(IPARM.values())
        rows, columns = (part.astype(np.int32) + 1 for part in (pattern.indptr, pattern.indices))
        self._arrays = np.zeros(64, dtype=np.int64), rows, columns, self.iparm
        self._places = [_place(array) for array in self._arrays]
        self._size = ctypes.byref(ctypes.c_int32(pattern.size))

    def run(self, phase: int, data: Floats, right: Floats) -> Floats:
        """A phase of MKL's with the upper triangle's values and right sides (N,) or (N,k)."""
        right = np.asfortranarray(right)
        out = np.zeros_like(right)
        handle, rows, columns, iparm = self._places
        step, sides, error = ctypes.c_int32(phase), ctypes.c_int32(right.size // len(right)), ctypes.c_int32()
        _mkl().pardiso(
            handle, ONE, ONE, SYMMETRIC, ctypes.byref(step), self._size, _place(data), rows, columns, None,
            ctypes.byref(sides), iparm, SILENT, _place(right), _place(out), ctypes.byref(error),
        )  # fmt: skip
        if error.value:
            raise SingularMatrix(f"MKL's PARDISO ended with its error {error.value}")
        return np.ascontiguousarray(out)


def _place(array: Floats | Ints) -> Any:
    return ctypes.c_void_p(array.ctypes.data)


@cache
def _mkl() -> Any:
    """MKL, loaded as pypardiso finds it: by its package's list of files."""
    with suppress(metadata.PackageNotFoundError):
        every = (Path(str(file.locate())) for file in metadata.files("mkl") or ())
        path = next((p for p in every if re.fullmatch(r"(lib)?mkl_rt[.\d]*\.(so[.\d]*|dll)", p.name)), None)
        if path is not None and path.is_file():
            # without this variable pypardiso searches the whole prefix, 0.2 s each time
            os.environ.setdefault("PYPARDISO_MKL_RT", str(path.resolve()))
    import pypardiso

    return ctypes.CDLL(pypardiso.PyPardisoSolver().libmkl._name)  # without its types of arguments
