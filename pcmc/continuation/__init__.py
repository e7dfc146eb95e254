"""Following a branch of equilibria as tensions or pressures change, through folds."""

from .branch import Branch, follow
from .direction import Direction
from .options import Ending, FollowOptions

__all__ = ["Branch", "Direction", "Ending", "FollowOptions", "follow"]
