"""The surface itself: patches, planes, cables, rooms, mesh, their checks, topology, and triangle geometry.

Gives ``Patch``, ``Plane``, ``Line``, ``Circle``, ``Cable``, ``Room``, ``Surface``, ``cut`` and
``mirrored`` to all other rooms. Imports only ``base``.
"""

from .cable import Cable
from .circle import Circle, Guide
from .cutting import cut
from .line import Line
from .mirroring import mirrored, unfolded
from .patch import Patch
from .plane import Plane
from .room import Room
from .surface import Surface, expect_surface

__all__ = [
    "Cable",
    "Circle",
    "Guide",
    "Line",
    "Patch",
    "Plane",
    "Room",
    "Surface",
    "cut",
    "expect_surface",
    "mirrored",
    "unfolded",
]
