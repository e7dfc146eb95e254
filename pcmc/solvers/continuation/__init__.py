"""Following a branch of equilibria as tensions, pressures or the boundary change, and others that leave it.

Gives ``follow``, ``Direction`` and ``BoundaryMotion``. May import ``solvers`` and below.
"""

from .boundary_motion import BoundaryMotion
from .branch import Branch, follow
from .direction import Direction
from .options import Ending, FollowOptions

__all__ = ["BoundaryMotion", "Branch", "Direction", "Ending", "FollowOptions", "follow"]
