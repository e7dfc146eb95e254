"""All equilibria of a surface that a search finds, barriers between them, and swaps of neighbours.

Gives ``find_equilibria``, ``Equilibria`` and ``swap_neighbours``. May import ``accuracy`` and below.
"""

from .found import Equilibria, FoundEquilibrium
from .neighbours import NeighbourSwap, swap_neighbours
from .search import SearchOptions, find_equilibria
from .shapes import shape_distance

__all__ = [
    "Equilibria",
    "FoundEquilibrium",
    "NeighbourSwap",
    "SearchOptions",
    "find_equilibria",
    "shape_distance",
    "swap_neighbours",
]
