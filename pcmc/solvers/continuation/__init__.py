"""Following a branch of equilibria as tensions, pressures or the boundary change, and others that leave it.

Gives ``follow``, ``Direction`` and ``BoundaryMotion``. May import ``solvers`` and below.
"""

from .branch import Branch, follow
from .options import Ending, FollowOptions
from .parameters import BoundaryMotion, Direction

__all__ = ["BoundaryMotion", "Branch", "Direction", "Ending", "FollowOptions", "follow"]
