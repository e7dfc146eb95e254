"""From equal tensions, at which the surface stands, along a line to the tensions asked for."""

from __future__ import annotations

from itertools import product

from ..certificate.balance import load_ratio
from ..certificate.proof import Attempt
from ..continuation import Direction
from ..surface import Surface
from .attempts import Attempts
from .folding import BACK, Arrival, Further, way

ROOM = 1.3  # of the load: at least so much the equal tensions could carry
RAISED = (1.0, 1.6)  # times these tensions, tried in turn
WALLS = (1.0, 0.6)  # of the equal tension: the most that a wall has at the start, tried in turn
STEPS = 40
SMALLEST = 3e-4


def relax_tensions(low: Surface, attempts: Attempts) -> Further:
    """Follow the equilibria from equal tensions of all patches under pressure to those of ``low``."""
    asked = {patch.name: patch.tension for patch in low.patches if patch.tension > 0.0}
    pressed = [patch.name for patch in low.patches if not patch.auxiliary]
    if len(pressed) < 2:
        return Further()
    strongest = max(asked[name] for name in pressed)
    overload = load_ratio(low.retensioned(dict.fromkeys(pressed, strongest)))
    for raised, most in product(RAISED, WALLS):
        equal = raised * strongest * max(1.0, ROOM * overload)
        start = {name: equal if name in pressed else min(t, most * equal) for name, t in asked.items()}
        result = attempts.solve(low.retensioned(start), levels=0)
        if result.converged:
            break
    else:
        return Further(attempt=Attempt("tensions", "no start"))
    change = {name: asked[name] - start[name] for name in asked if asked[name] != start[name]}
    direction = Direction(change, relative=True)
    branch = attempts.follow(result.surface, direction, 1.0, back=BACK, steps=STEPS, smallest=SMALLEST)
    if branch is None:
        return Further(attempt=Attempt("tensions", "no start"))
    end = way(branch, back=BACK)
    if end.arrival is Arrival.REACHED:
        return Further(branch.last.retensioned(asked), "along the branch from equal tensions", "tensions")
    at = tuple((name, start[name] + end.farthest * change.get(name, 0.0)) for name in asked)
    return Further(attempt=Attempt("tensions", end.arrival.name.lower(), end.farthest, 0.0, at))
