"""Raising the pressure along the branch of equilibria, from a low pressure to the one asked for."""

from __future__ import annotations

from ..certificate.balance import load_ratio
from ..certificate.proof import Fold
from ..continuation import Direction
from ..surface import Surface
from .attempts import Attempts
from .folding import Arrival, Further, way

SHARES = (0.5, 0.2, 0.05, 0.01)  # of the pressure, or of what the boundary carries, at which to begin
STEPS = 80
SMALLEST = 1e-4


def raise_pressure(low: Surface, attempts: Attempts) -> Further:
    """Follow the equilibria from a low pressure, all pressures growing in proportion.

    The branch begins at the highest of a few pressures at which a minimum is found from the low start.
    """
    pressures = {patch.name: patch.pressure for patch in low.patches if patch.pressure != 0.0}
    carried = min(1.0, 1.0 / max(load_ratio(low), 1e-300))
    for share in SHARES:
        begin = share * carried
        less = low.retensioned(None, {name: begin * p for name, p in pressures.items()})
        result = attempts.solve(less, levels=0, target="minimum")
        if result.converged:
            break
    else:
        return Further()
    # λ is the pressure over what the boundary carries, so that a fold is near 1 however weak the patches
    direction = Direction(pressures={name: carried * p for name, p in pressures.items()})
    branch = attempts.follow(result.surface, direction, 1.0 / carried, steps=STEPS, smallest=SMALLEST)
    if branch is None:
        return Further()
    end = way(branch)
    if end.arrival is Arrival.REACHED:
        last = branch.last.retensioned(None, pressures)
        return Further(last, f"by raising the pressure from {begin:.3g} of it")
    if end.arrival is Arrival.FOLD:
        return Further(fold=Fold("pressure", end.farthest * carried, begin))
    return Further()
