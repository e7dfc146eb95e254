"""Following a branch of equilibria as tensions or pressures change, through folds.

Gives ``follow`` and ``Direction``. May import ``design`` and the rooms below it.
"""

from .branch import Branch, follow
from .direction import Direction
from .options import Ending, FollowOptions

__all__ = ["Branch", "Direction", "Ending", "FollowOptions", "follow"]
