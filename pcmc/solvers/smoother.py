"""A smooth way down: the energy gradient seen through the α-weighted cotangent Laplacian.

    L_α d = - B Bᵀ ∇E

A step of length 1 along d lowers the residual by about the same factor on every mesh, and moves the
mesh as one: a junction that travels takes the sheets around it along. (Pinkall and Polthier 1993 minimise
area this way; d is the gradient of E in the H¹ metric.)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base.arrays import Bools, Floats
from ..energy.motion_space import MotionSpace, VertexClasses, perpendicular
from ..energy.projected_hessian import Pattern, assemble, hessian_pattern
from ..stability.factorisation import Factor, Factoriser, factoriser
from ..surface import Surface
from ..surface.topology import SHEET

FLOOR = 1e-2  # tension, relative to the largest, that walls without tension get in L_α
PIN = 1e8  # weight, relative to its stiffness, that holds a vertex to its given motion
SHIFT = 1e-9  # of the diagonal, so that a surface that nothing holds has a Laplacian to solve with


class Smoother:
    """Solves with L_α at one shape, for any right-hand side.

    The coordinates along Π are held at fixed vertices only, the one normal to Π also where vertices
    slide; each of the two sets has a factorisation of its own.
    """

    def __init__(
        self, surface: Surface, classes: VertexClasses, backend: str | None = None
    ) -> None:
        floor = FLOOR * float(surface.tensions.max())
        tensions = {p.name: max(p.tension, floor) for p in surface.patches}
        self._surface = surface.retensioned(tensions, dict.fromkeys(tensions, 0.0))
        self._frame = replace(
            classes, active=np.ones(surface.m, dtype=bool), faces=surface.faces,
            patch_of_face=surface.patch_of_face, topology=surface.topology,
        )  # fmt: skip
        used = np.bincount(surface.faces.ravel(), minlength=surface.n) > 0
        normal = np.array(surface.plane.normal)
        first, second = perpendicular(normal[None])
        self._axes = np.stack([first[0], second[0], normal])
        along = used & ~surface.fixed
        across = along & ~surface.on_plane
        self._along = _Coordinate(self._surface, self._frame, along, backend)
        same = bool((along == across).all())
        self._across = self._along if same else _Coordinate(
            self._surface, self._frame, across, backend
        )  # fmt: skip

    @property
    def factorisations(self) -> int:
        """Matrices factorised for each ``refresh``."""
        return 1 if self._across is self._along else 2

    def refresh(self, X: Floats) -> None:
        """Take L_α at the shape X (n,3)."""
        self._along.refresh(X)
        if self._across is not self._along:
            self._across.refresh(X)

    def solve(self, forces: Floats) -> Floats:
        """L_α⁻¹ forces (n,3), zero where a support holds the coordinate."""
        local = forces @ self._axes.T
        out = np.empty_like(local)
        out[:, :2] = self._along.solve(local[:, :2])
        out[:, 2:] = self._across.solve(local[:, 2:])
        return out @ self._axes


class _Coordinate:
    """L_α over the vertices whose coordinate is free."""

    def __init__(
        self, surface: Surface, classes: VertexClasses, free: Bools, backend: str | None
    ) -> None:
        basis = np.zeros((surface.n, 3, 3))
        basis[:, 0, 0] = 1.0
        self._space = MotionSpace.of(basis, free.astype(np.int64))
        self._surface, self._frame, self._free = surface, classes, free
        self._pattern: Pattern = hessian_pattern(classes, self._space)
        self._factoriser: Factoriser = factoriser(self._pattern, backend)
        self._factor: Factor | None = None

    def refresh(self, X: Floats) -> None:
        data = assemble(
            self._surface, self._frame, self._space, self._pattern, X, hessian=0.0, stiffness=1.0
        )
        data[self._pattern.indptr[:-1]] *= 1.0 + SHIFT
        self._factor = self._factoriser.factor(data)

    def solve(self, forces: Floats) -> Floats:
        assert self._factor is not None, "refresh before solve"
        out = np.zeros_like(forces)
        out[self._free] = self._factor.solve(forces[self._free])
        return out


class HarmonicExtension:
    """Carries the inside of the sheets along with their curves.

    The motion of curves and points is extended harmonically into the sheets (L_α w = 0 there, w given on
    the curves); of w each sheet vertex takes the part along its sheet, so the shape is not touched.
    """

    def __init__(
        self, surface: Surface, classes: VertexClasses, X: Floats, backend: str | None = None
    ) -> None:
        used = ~classes.idle
        basis = np.zeros((surface.n, 3, 3))
        basis[:, 0, 0] = 1.0
        space = MotionSpace.of(basis, used.astype(np.int64))
        equal = surface.retensioned({p.name: 1.0 for p in surface.patches})
        pattern = hessian_pattern(classes, space)
        data = assemble(equal, classes, space, pattern, X, hessian=0.0, stiffness=1.0)
        diagonal = pattern.indptr[:-1]
        data[diagonal] *= 1.0 + SHIFT
        self._used = used
        self._led = (classes.kind != SHEET) | surface.fixed
        self._weight = np.where(self._led[used], PIN * data[diagonal], 0.0)
        data[diagonal] += self._weight
        # to a diagonal of ones: beside held vertices of thin triangles no pivot then looks like zero
        self._scale = 1.0 / np.sqrt(data[diagonal])
        data *= np.repeat(self._scale, np.diff(pattern.indptr)) * self._scale[pattern.indices]
        self._factor = factoriser(pattern, backend).factor(data)

    def extend(self, space: MotionSpace, motion: Floats) -> Floats:
        """The motion (n,3) with the sheets' vertices carried along."""
        lead = np.where(self._led[:, None], motion, 0.0)[self._used]
        follow = np.zeros_like(motion)
        pull = (self._scale * self._weight)[:, None] * lead
        follow[self._used] = self._scale[:, None] * self._factor.solve(pull)
        follow[self._led] = 0.0
        return motion + follow - space.project(follow)
