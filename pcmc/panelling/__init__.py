"""Panelling: the flat triangles that a roof is built from, and how many different ones there are.

Gives ``panels``, ``fewer_families`` and their values to drawings, pictures and the command. May import
``accuracy`` and the rooms below it.
"""

from .fewer import FewerFamilies, fewer_families
from .schedule import Panels, panels

__all__ = ["FewerFamilies", "Panels", "fewer_families", "panels"]
