"""A parameter λ of a surface that moves its boundary: the fixed vertices are at P(λ).

The inside follows harmonically, so that triangles keep their shape: a change of P by d moves the vertices
by w with L w = 0 inside and w = d at the fixed vertices, L the cotangent Laplacian. With v the w of dP/dλ,

    dr/dλ = Bᵀ Df[v],    dE/dλ = Σ ⟨∇E, dP/dλ⟩ over the fixed vertices,

f the forces that ``jacobian`` linearises.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...base import validate
from ...base.arrays import Floats
from ...base.errors import OptionError
from ...base.tolerances import ON
from ...forces.functional import energy_and_gradient
from ...surface import Surface
from .direction import ParameterLine

DIFFERENCE = 1e-5  # of the size of λ: step of the central difference for dP/dλ


@dataclass(frozen=True)
class BoundaryMotion:
    """λ moves the fixed vertices.

    Parameters
    ----------
    positions : P, a smooth function of λ; the positions (k,3) of the fixed vertices in the order of their
        numbers, ``surface.vertices[surface.pinned]``.
    start : λ of the surface that ``follow`` starts from.

    Examples
    --------
    Two rings move apart; λ is half their distance:

    >>> def rings(half_distance):
    ...     x, y, z = film.vertices[film.fixed].T
    ...     return np.stack([x, y, np.sign(z) * half_distance], axis=1)
    >>> distance = BoundaryMotion(rings, start=0.5)
    """

    positions: Callable[[float], npt.ArrayLike]
    start: float

    def __post_init__(self) -> None:
        if not callable(self.positions):
            validate.refuse("BoundaryMotion.positions", self.positions, "a function of the parameter")
        object.__setattr__(self, "start", validate.number("BoundaryMotion.start", self.start))

    def line(self, surface: Surface) -> BoundaryLine:
        """The boundary along this motion, which at its start must be that of the surface."""
        if not surface.pinned.any():
            message = "BoundaryMotion: the surface has no fixed vertex that could move"
            raise OptionError(message, what="parameter", found=0)
        if surface.rooms:
            name = surface.rooms[0].name
            message = f"BoundaryMotion: room {name!r} prescribes a volume, which is not followed as the"
            message += " boundary moves; remove the room, and give its pressure"
            raise OptionError(message, what="parameter", found=name)
        line = BoundaryLine(self.start, {}, {}, self.positions, int(surface.pinned.sum()))
        off = np.linalg.norm(line.boundary(self.start) - surface.vertices[surface.pinned], axis=1)
        if off.max() > ON * surface.size:
            worst = int(np.flatnonzero(surface.pinned)[off.argmax()])
            message = f"BoundaryMotion: positions({self.start:g}) is not the surface's boundary: fixed vertex"
            raise OptionError(
                f"{message} {worst} is {off.max():.3g} away; check start= and the order of the vertices",
                what="positions",
                where=worst,
                found=float(off.max()),
                expected=0.0,
            )
        return line


@dataclass(frozen=True, eq=False)
class BoundaryLine(ParameterLine):
    """The ``count`` fixed vertices as functions P of λ; no tension or pressure varies."""

    positions: Callable[[float], npt.ArrayLike]
    count: int

    @property
    def scale(self) -> float:
        """The size of λ in the metric of arclength: its value at the start, or 1."""
        return abs(self.value) or 1.0

    def surface_at(self, surface: Surface, value: float) -> Surface:
        return surface

    def boundary(self, value: float) -> Floats:
        """P(λ) (count,3)."""
        P = np.asarray(self.positions(value), dtype=float)
        if P.shape != (self.count, 3) or not np.isfinite(P).all():
            found = f"shape {P.shape}" if P.shape != (self.count, 3) else "numbers that are not finite"
            expected = f"({self.count}, 3) finite numbers, one row per fixed vertex"
            validate.refuse(f"BoundaryMotion.positions({value:g})", found, expected)
        return P

    def velocity(self, value: float) -> Floats:
        """dP/dλ (count,3)."""
        h = DIFFERENCE * self.scale
        return (self.boundary(value + h) - self.boundary(value - h)) / (2.0 * h)

    def energy_derivative(self, surface: Surface, X: Floats, value: float) -> float:
        """Σ ⟨∇E, dP/dλ⟩ over the fixed vertices at X (n,3), force·length per unit of λ."""
        forces = energy_and_gradient(surface, X, supports=False)[1]
        return float((forces[surface.pinned] * self.velocity(value)).sum())
