"""Raising the pressure along the branch of equilibria, from a low pressure to the one asked for."""

from __future__ import annotations

from dataclasses import dataclass

from ..base.errors import OptionError, SurfaceError
from ..certificate.balance import load_ratio
from ..certificate.proof import Fold
from ..continuation import Direction
from ..surface import Surface
from .attempts import Attempts
from .folding import Arrival, way

SHARES = (0.5, 0.2, 0.05, 0.01)  # of the pressure, or of what the boundary carries, at which to begin
STEPS = 80
SMALLEST = 1e-4


@dataclass(frozen=True, eq=False)
class Raised:
    """What raising the pressure has shown: a surface at the end of the branch, or a fold on the way."""

    surface: Surface | None = None
    fold: Fold | None = None
    start: float = 0.0


def raise_pressure(low: Surface, attempts: Attempts) -> Raised:
    """Follow the equilibria from a low pressure, all pressures growing in proportion.

    The branch begins at the highest of a few pressures at which a minimum is found from the low start.
    """
    pressures = {patch.name: patch.pressure for patch in low.patches if patch.pressure != 0.0}
    walls = [patch.name for patch in low.patches if patch.auxiliary]
    carried = min(1.0, 1.0 / max(load_ratio(low), 1e-300))
    for share in SHARES:
        begin = share * carried
        less = low.retensioned(None, {name: begin * p for name, p in pressures.items()}, walls)
        result = attempts.solve(less, levels=0, target="minimum")
        if result.converged:
            break
    else:
        return Raised()
    # λ is the pressure over what the boundary carries, so that a fold is near 1 however weak the patches
    direction = Direction(pressures={name: carried * p for name, p in pressures.items()})
    try:
        branch = attempts.follow(
            result.surface, direction, 1.0 / carried, steps=STEPS, smallest=SMALLEST, min_quality=0.3
        )
    except (OptionError, SurfaceError):  # no branch: rigid motions are free, or the pressure moves nothing
        return Raised(start=begin)
    end = way(branch)
    if end.arrival is Arrival.REACHED:
        last = branch.last
        return Raised(surface=last.retensioned(None, pressures, walls), start=begin)
    if end.arrival is Arrival.FOLD:
        return Raised(fold=Fold("pressure", end.farthest * carried, begin), start=begin)
    return Raised(start=begin)
