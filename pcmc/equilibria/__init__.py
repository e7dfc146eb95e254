"""All equilibria of a surface that a search finds, and barriers between them.

Gives ``find_equilibria`` and ``Equilibria``; of cells whose size is free ``free_cell`` and ``cell_stress``.
May import ``accuracy`` and below.
"""

from .found import Equilibria, FoundEquilibrium
from .free_cell import FreeCell, cell_stress, free_cell
from .search import SearchOptions, find_equilibria
from .shapes import shape_distance

__all__ = ["Equilibria", "FoundEquilibrium", "FreeCell", "SearchOptions", "cell_stress", "find_equilibria"]
__all__ += ["free_cell", "shape_distance"]
