"""Cutting patterns: strips of cloth for a roof, laid flat, with seams of equal sides, and their sheets.

Gives ``cutting_pattern`` and its values to pictures, projects and the command. May import ``drawings`` and
the subpackages below it.
"""

from .pattern import cutting_pattern, cutting_pattern_of
from .settings import CuttingOptions
from .sheets import pattern_drawings
from .strips import CuttingPattern, Seam, Side, Strip

__all__ = ["CuttingOptions", "CuttingPattern", "Seam", "Side", "Strip", "cutting_pattern"]
__all__ += ["cutting_pattern_of", "pattern_drawings"]
