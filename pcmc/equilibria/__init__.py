"""All equilibria of a surface that a search finds: branches, deflation, ways down; and barriers.

Gives ``find_equilibria`` and ``Equilibria``. May import ``accuracy`` and below.
"""

from .found import Equilibria, FoundEquilibrium
from .search import SearchOptions, find_equilibria
from .shapes import shape_distance

__all__ = ["Equilibria", "FoundEquilibrium", "SearchOptions", "find_equilibria", "shape_distance"]
