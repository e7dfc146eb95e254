"""Drawings for those who build: plan, elevations, sections, setting-out points, panels at true size.

Gives ``drawing_set``, ``net_drawings`` and their values to pictures and the command. May import ``panelling``
and the rooms below.
"""

from .drawing_set import DrawingSet, drawing_set, net_drawings
from .sheet import FORMATS, Sheet

__all__ = ["FORMATS", "DrawingSet", "Sheet", "drawing_set", "net_drawings"]
