"""Sparse symmetric factorisation with inertia, behind one small interface.

A matrix is given by the upper triangle of a fixed pattern (``assemble.Pattern``). The symbolic work is
done once per pattern; ``factor`` then takes new values. Backends, fastest first: ``"pardiso"`` (MKL, extra
``fast``) and ``"superlu"`` (scipy, everywhere).
"""

from __future__ import annotations

import importlib.util
import os
import threading
import weakref
from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import splu

from .arrays import Floats, Ints
from .assemble import Pattern
from .errors import MissingExtra, OptionError, unknown

BACKENDS = ("pardiso", "superlu")


class SingularMatrix(ArithmeticError):
    """A pivot is zero: the matrix has no factorisation, or none that shows its inertia."""


class Factor(Protocol):
    """A factorised matrix."""

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues (Sylvester: negative pivots of D in L D Lᵀ)."""

    def solve(self, right: Floats) -> Floats:
        """A⁻¹ right, for one right-hand side (N,) or several (N,k)."""


class Factoriser(Protocol):
    """Factorises matrices of one pattern."""

    def factor(self, data: Floats) -> Factor:
        """Factorise the matrix with these upper-triangle values; a new factor replaces the last."""


@cache
def available() -> tuple[str, ...]:
    """Backends that can be used here, fastest first."""
    found = importlib.util.find_spec("pypardiso") is not None
    return BACKENDS if found else ("superlu",)


def factoriser(kept: Pattern, backend: str | None = None) -> Factoriser:
    """A factoriser for the pattern: the fastest backend available, or the one named.

    >>> import numpy as np
    >>> from scipy.sparse import csr_array
    >>> kept = Pattern(np.array([0, 2, 3]), np.array([0, 1, 1]), np.empty((0, 3)))
    >>> factor = factoriser(kept, "superlu").factor(np.array([1.0, 2.0, 1.0]))
    >>> factor.negative, factor.solve(np.array([3.0, 3.0])).round(12).tolist()
    (1, [1.0, 1.0])
    """
    chosen = backend or available()[0]
    if chosen not in BACKENDS:
        raise OptionError(unknown("factorisation backend", chosen, BACKENDS))
    if chosen not in available():
        raise MissingExtra("pypardiso", "fast")
    # MKL refuses a matrix without rows
    return _Pardiso(kept) if chosen == "pardiso" and kept.size else _SuperLU(kept)


def _finite(data: Floats) -> None:
    if not np.isfinite(data).all():
        raise SingularMatrix("the matrix has entries that are not finite")


class _SuperLU:
    """scipy's SuperLU, kept symmetric: no pivoting off the diagonal."""

    def __init__(self, kept: Pattern) -> None:
        entry = np.arange(1, len(kept.indices) + 1)
        upper = csr_array((entry, kept.indices, kept.indptr), shape=(kept.size, kept.size))
        rows = np.repeat(np.arange(kept.size), np.diff(kept.indptr))
        off = rows != kept.indices
        lower = csr_array((entry[off], (kept.indices[off], rows[off])), shape=upper.shape)
        full = csc_array(upper + lower)
        full.sort_indices()
        self._source: Ints = full.data - 1
        self._indices, self._indptr = full.indices, full.indptr
        self._shape = full.shape

    def factor(self, data: Floats) -> Factor:
        _finite(data)
        matrix = csc_array((data[self._source], self._indices, self._indptr), shape=self._shape)
        try:
            lu = splu(
                matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )  # fmt: skip
        except RuntimeError as error:
            raise SingularMatrix(str(error)) from None
        return _SuperLUFactor(matrix, lu)


@dataclass(frozen=True, eq=False)
class _SuperLUFactor:
    matrix: csc_array
    lu: Any

    @property
    def negative(self) -> int:
        if not np.array_equal(self.lu.perm_r, self.lu.perm_c):
            raise SingularMatrix("a zero pivot forced a row exchange, so the inertia is unknown")
        return int(np.count_nonzero(self.lu.U.diagonal() < 0.0))

    def solve(self, right: Floats) -> Floats:
        first = self.lu.solve(right)
        return first + self.lu.solve(right - self.matrix @ first)


class _Pardiso:
    """MKL PARDISO on the upper triangle: mtype -2, real symmetric indefinite."""

    def __init__(self, kept: Pattern) -> None:
        import pypardiso

        self._kept = kept
        self._solver = pypardiso.PyPardisoSolver(mtype=-2)
        # pypardiso looks for MKL in the whole prefix, 0.2 s each time, unless it is told where
        os.environ.setdefault("PYPARDISO_MKL_RT", self._solver.libmkl._name)
        self._error = pypardiso.pardiso_wrapper.PyPardisoError
        self._lock = threading.Lock()
        for place, value in ((1, 1), (2, 2), (8, 0), (10, 13), (11, 0), (13, 0), (21, 1), (24, 1)):
            self._solver.set_iparm(place, value)
        self._analysed = False

    def factor(self, data: Floats) -> Factor:
        _finite(data)
        matrix = self._kept.matrix(data)
        nothing = np.zeros((self._kept.size, 1), order="F")
        try:
            if not self._analysed:
                self.run(11, matrix, nothing)
                self._analysed = True
                # MKL keeps the factor outside Python: free it with this object, not at exit.
                weakref.finalize(self, _release, self._solver, self._kept).atexit = False
            self.run(22, matrix, nothing)
        except self._error as error:
            raise SingularMatrix(str(error)) from None
        iparm = self._solver.iparm
        if iparm[13]:  # MKL replaces a pivot below 1e-13 of the matrix and goes on
            raise SingularMatrix(f"{iparm[13]} pivots are zero to rounding")
        return _PardisoFactor(self, matrix, int(iparm[22]))

    def run(self, phase: int, matrix: csr_array, right: Floats) -> Floats:
        with self._lock:
            self._solver.set_phase(phase)
            return self._solver._call_pardiso(matrix, right)


def _release(solver: Any, kept: Pattern) -> None:
    solver.set_phase(-1)
    solver._call_pardiso(kept.matrix(np.zeros(len(kept.indices))), np.zeros((kept.size, 1)))


@dataclass(frozen=True, eq=False)
class _PardisoFactor:
    owner: _Pardiso
    matrix: csr_array
    negative: int

    def solve(self, right: Floats) -> Floats:
        return self.owner.run(33, self.matrix, np.asfortranarray(right))
