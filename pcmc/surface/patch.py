"""A part of a surface with one tension, one pressure and one weight."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..base import validate
from ..base.errors import SurfaceError
from ..base.names import checked_name
from . import checks


@dataclass(frozen=True)
class Patch:
    """A part of the surface with one tension and one pressure.

    Parameters
    ----------
    name : unique in its surface; 1 to 100 printable characters, no blank at either end.
    tension : α ≥ 0, force per length. At rest the patch has mean curvature pressure / (2 α).
    pressure : p, force per area along the positive normal: the pressure below the patch minus the one
        above it. A wall between rooms of pressures p_1 and p_2 has pressure p_1 - p_2, its normal
        pointing from room 1 to room 2; ``pcmc.energy`` describes E for other wall pressures.
    wall : whether the patch is a wall between rooms: its cone is not part of the volume, and it may
        pinch. A patch without pressure that hangs below a junction is a wall, too: see ``Surface.walls``.
    weight : w, force per area of the patch, against Π's normal; negative for a lift.

    >>> Patch("roof", tension=2.0).target_curvature
    0.25
    """

    name: str
    tension: float
    pressure: float = 1.0
    wall: bool = field(default=False, repr=False)
    weight: float = field(default=0.0, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", checked_name("Patch.name", self.name, error=SurfaceError))
        if not isinstance(self.wall, bool | np.bool_):
            validate.refuse("wall", self.wall, "True or False", self.name, error=SurfaceError)
        object.__setattr__(self, "wall", bool(self.wall))
        tension = self._number("tension", least=0.0, hint="only a wall may have 0")
        pressure, weight = self._number("pressure"), self._number("weight")
        if tension == 0.0 and pressure != 0.0:
            hint = f"a patch under pressure {pressure:g} must pull; a wall (pressure=0) may have tension 0"
            validate.refuse("tension", 0.0, "> 0", self.name, hint, SurfaceError)
        if tension == 0.0 and weight != 0.0:
            hint = "a patch that weighs something must pull; give it a tension"
            validate.refuse("tension", 0.0, "> 0", self.name, hint, SurfaceError)
        if 0.0 < tension < checks.SMALLEST:
            hint = "use a smaller unit of force"
            validate.refuse("tension", tension, f"0 or ≥ {checks.SMALLEST:g}", self.name, hint, SurfaceError)

    def _number(self, key: str, least: float | None = None, hint: str = "") -> float:
        value, where, most = getattr(self, key), self.name, checks.LARGEST
        number = validate.number(key, value, least=least, where=where, hint=hint, error=SurfaceError)
        hint = "use a larger unit of force"
        validate.number(key, number, least=-most, most=most, where=where, hint=hint, error=SurfaceError)
        object.__setattr__(self, key, number)
        return number

    @property
    def auxiliary(self) -> bool:
        """Whether the energy and the solvers treat it as a wall: declared as one, or without pressure."""
        return self.wall or self.pressure == 0.0

    @property
    def target_curvature(self) -> float:
        """H̄ = p / (2 α), 1/length; NaN for a wall without tension, whose shape is arbitrary."""
        return self.pressure / (2.0 * self.tension) if self.tension > 0.0 else math.nan
