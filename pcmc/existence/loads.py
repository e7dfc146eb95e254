"""Raising the loads along the branch of equilibria, from low ones to those asked for."""

from __future__ import annotations

from ..certificate.balance import load_name, load_ratio
from ..certificate.proof import Attempt
from ..continuation import Direction
from ..surface import Surface
from .attempts import Attempts
from .folding import Arrival, Further, way

SHARES = (0.5, 0.2, 0.05, 0.01)  # of the loads, or of what the boundary carries, at which to begin
STEPS = 80
SMALLEST = 1e-4


def raise_loads(low: Surface, attempts: Attempts) -> Further:
    """Follow the equilibria from low loads, all net pressures and weights growing in proportion.

    What grows is p - s, so the snow is not there at the start and comes with the pressure. The branch begins
    at the highest of a few loads at which a minimum is found from the low start.
    """
    load = load_name(low)
    gross, snows = ({p.name: getattr(p, key) for p in low.patches} for key in ("pressure", "snow"))
    pressures = {patch.name: patch.net_pressure for patch in low.patches if patch.net_pressure != 0.0}
    weights = {patch.name: patch.weight for patch in low.patches if patch.weight != 0.0}

    def loaded(share: float) -> Surface:
        net = dict.fromkeys(gross, 0.0) | {name: share * p for name, p in pressures.items()}
        heavy = {name: share * w for name, w in weights.items()}
        return low.retensioned(None, net, weights=heavy, snows=dict.fromkeys(snows, 0.0))

    carried = min(1.0, 1.0 / max(load_ratio(low), 1e-300))
    for share in SHARES:
        begin = share * carried
        result = attempts.solve(loaded(begin), levels=0, target="minimum")
        if result.converged:
            break
    else:
        return Further(attempt=Attempt(load, "no start"))
    # λ is the load over what the boundary carries, so that a fold is near 1 however weak the patches
    direction = Direction(
        pressures={name: carried * p for name, p in pressures.items()},
        weights={name: carried * w for name, w in weights.items()},
    )
    branch = attempts.follow(result.surface, direction, 1.0 / carried, steps=STEPS, smallest=SMALLEST)
    if branch is None:
        return Further(attempt=Attempt(load, "no start"))
    end = way(branch)
    if end.arrival is Arrival.REACHED:
        last = branch.last.retensioned(None, gross, weights=weights, snows=snows)
        return Further(last, f"by raising the {load} from {begin:.3g} of it", load)
    return Further(attempt=Attempt(load, end.arrival.name.lower(), end.farthest * carried, begin))
