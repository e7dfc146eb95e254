"""Panels: the flat triangles that a roof is built from, and how many different ones there are.

Gives ``panels``, ``fewer_families`` and their values to drawings, pictures and the command. May import
``accuracy`` and the rooms below it.
"""

from .schedule import Panels, panels

__all__ = ["Panels", "panels"]
