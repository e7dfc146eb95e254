"""Panelling: the flat triangles that a roof is built from and how many different ones there are; or quads and
hexagons, planar along lines of curvature.

Gives ``panels``, ``fewer_families``, ``panel_net`` and their values to drawings, pictures and the command.
May import ``accuracy`` and the rooms below it.
"""

from .fewer import FewerFamilies, fewer_families
from .panel_net import PanelNet, panel_net
from .schedule import Panels, panels

__all__ = ["FewerFamilies", "PanelNet", "Panels", "fewer_families", "panel_net", "panels"]
