"""A part of a surface with one tension, one pressure, one weight and one load of snow."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..base import validate
from ..base.errors import SurfaceError
from ..base.validate import checked_name
from . import checks


@dataclass(frozen=True)
class Patch:
    """A part of the surface with one tension and one pressure.

    Parameters
    ----------
    name : unique in its surface; 1 to 100 printable characters, no blank at either end.
    tension : α ≥ 0, force per length. At rest the patch has mean curvature (p - s) / (2 α).
    pressure : p, force per area along the positive normal: the pressure of the air below the patch minus
        that above it. A wall between rooms of pressures p_1 and p_2 has pressure p_1 - p_2, its normal
        pointing from room 1 to room 2; ``pcmc.energy`` describes E for other wall pressures.
    wall : whether the patch is a wall between rooms: its cone is not part of the volume, and it may
        pinch. A patch without pressure and snow that hangs below a junction is a wall, too: see
        ``Surface.walls``.
    weight : w, force per area of the patch, against Π's normal; negative for a lift.
    snow : s, force per area of the plan. It acts as a lower pressure, p - s: see ``Surface.with_snow``. The
        wall between rooms under snow s_1 and s_2 has s_1 - s_2, so that p - s is that of the rooms, too.

    >>> Patch("roof", tension=2.0).target_curvature
    0.25
    """

    name: str
    tension: float
    pressure: float = 1.0
    wall: bool = field(default=False, repr=False)
    weight: float = field(default=0.0, repr=False)
    snow: float = field(default=0.0, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", checked_name("Patch.name", self.name, error=SurfaceError))
        if not isinstance(self.wall, bool | np.bool_):
            validate.refuse("wall", self.wall, "True or False", self.name, error=SurfaceError)
        object.__setattr__(self, "wall", bool(self.wall))
        tension = self._number("tension", least=0.0, hint="only a wall may have 0")
        pressure, weight, snow = map(self._number, ("pressure", "weight", "snow"))
        if tension == 0.0 and pressure != 0.0:
            hint = f"a patch under pressure {pressure:g} must pull; a wall (pressure=0) may have tension 0"
            validate.refuse("tension", 0.0, "> 0", self.name, hint, SurfaceError)
        if tension == 0.0 and (weight != 0.0 or snow != 0.0):
            bears = "carries snow" if snow else "weighs something"
            hint = f"a patch that {bears} must pull; give it a tension"
            validate.refuse("tension", 0.0, "> 0", self.name, hint, SurfaceError)

    def _number(self, key: str, least: float | None = None, hint: str = "") -> float:
        value, where, most = getattr(self, key), self.name, checks.LARGEST
        number = validate.number(key, value, least=least, where=where, hint=hint, error=SurfaceError)
        hint = "use a larger unit of force"
        validate.number(key, number, least=-most, most=most, where=where, hint=hint, error=SurfaceError)
        if 0.0 < abs(number) < checks.SMALLEST:
            bound = f"≥ {checks.SMALLEST:g}" if number > 0.0 else f"≤ {-checks.SMALLEST:g}"
            hint = "use a smaller unit of force"
            validate.refuse(key, number, f"0 or {bound}", where, hint, SurfaceError)
        object.__setattr__(self, key, number)
        return number

    @property
    def auxiliary(self) -> bool:
        """Whether the energy and the solvers treat it as a wall: declared, or without pressure and snow."""
        return self.wall or (self.pressure == 0.0 and self.snow == 0.0)

    @property
    def net_pressure(self) -> float:
        """p - s, force per area: what the shape follows.

        >>> Patch("roof", 1.0, pressure=1.0, snow=0.25).net_pressure
        0.75
        """
        return self.pressure - self.snow

    @property
    def target_curvature(self) -> float:
        """H̄ = (p - s) / (2 α), 1/length; NaN for a wall without tension, whose shape is arbitrary."""
        return self.net_pressure / (2.0 * self.tension) if self.tension > 0.0 else math.nan
