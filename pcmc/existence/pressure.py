"""Raising the pressure along the branch of equilibria, from a low one to the one asked for, net of snow."""

from __future__ import annotations

from ..certificate.balance import load_name, load_ratio
from ..certificate.proof import Fold
from ..continuation import Direction
from ..surface import Surface
from .attempts import Attempts
from .folding import Arrival, Further, way

SHARES = (0.5, 0.2, 0.05, 0.01)  # of the pressure, or of what the boundary carries, at which to begin
STEPS = 80
SMALLEST = 1e-4


def raise_pressure(low: Surface, attempts: Attempts) -> Further:
    """Follow the equilibria from a low pressure, all net pressures growing in proportion.

    What grows is p - s, so the snow is not there at the start and comes with the pressure. The branch begins
    at the highest of a few pressures at which a minimum is found from the low start.
    """
    load = load_name(low)
    gross, snows = ({p.name: getattr(p, key) for p in low.patches} for key in ("pressure", "snow"))
    pressures = {patch.name: patch.net_pressure for patch in low.patches if patch.net_pressure != 0.0}
    low = low.retensioned(None, dict.fromkeys(gross, 0.0) | pressures, snows=dict.fromkeys(snows, 0.0))
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
        last = branch.last.retensioned(None, gross, snows=snows)
        return Further(last, f"by raising the {load} from {begin:.3g} of it")
    if end.arrival is Arrival.FOLD:
        return Further(fold=Fold(load, end.farthest * carried, begin))
    return Further()
