"""All equilibria of a surface that a search finds, barriers between them, and swaps of neighbours.

Gives ``find_equilibria`` and ``Equilibria``; of cells whose size is free ``free_cell`` and ``cell_stress``;
and ``swap_neighbours``. May import ``accuracy`` and below.
"""

from .found import Equilibria, FoundEquilibrium
from .free_cell import FreeCell, cell_stress, free_cell
from .neighbours import NeighbourSwap, swap_neighbours
from .search import SearchOptions, find_equilibria
from .shapes import shape_distance

__all__ = [
    "Equilibria",
    "FoundEquilibrium",
    "FreeCell",
    "NeighbourSwap",
    "SearchOptions",
    "cell_stress",
    "find_equilibria",
    "free_cell",
    "shape_distance",
    "swap_neighbours",
]
