"""Drawings for those who build: plan, elevations, sections, setting-out points, panels at true size.

Gives ``drawing_set`` and its values to pictures and the command. May import ``panels`` and the rooms below.
"""

from .drawing_set import DrawingSet, drawing_set
from .sheet import FORMATS, Sheet

__all__ = ["FORMATS", "DrawingSet", "Sheet", "drawing_set"]
