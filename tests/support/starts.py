"""Starting surfaces and their stationary points, each made once however many tests look at it.

The generators here are those of ``generators``, with a memory: surfaces are values and can be shared.
"""

from dataclasses import replace
from functools import cache, partial

import generators
from pcmc import Plane, Surface, solve
from pcmc.solvers.result import Result

bezier_hall = cache(generators.bezier_hall)
double_bubble = cache(generators.double_bubble)
four_fans = cache(generators.four_fans)
joined_caps = cache(generators.joined_caps)
sphere = cache(generators.sphere)
spherical_cap = cache(generators.spherical_cap)
three_patches = cache(generators.three_patches)
two_caps = cache(generators.two_caps)
two_squares = cache(generators.two_squares)


def uneven(squares: Surface, drop: float) -> Surface:
    """Two squares with less pressure on the right one, by ``drop``, which the wall takes; seen from aside."""
    if not drop:
        return squares
    left, right, wall = squares.patches
    patches = [left, replace(right, pressure=1.0 - drop), replace(wall, pressure=drop, wall=True)]
    return squares.rebuilt(plane=Plane(point=(3.0, 1.0, 0.0)), patches=patches)


def stationary(make: partial) -> Result:
    """The stationary point that ``make``, a partial of one of the generators here, leads to."""
    return _stationary(make.func, *make.args, **make.keywords)


@cache
def _stationary(func, *arguments, **named) -> Result:
    return solve(func(*arguments, **named), target="stationary")
