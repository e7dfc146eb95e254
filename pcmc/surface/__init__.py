"""The surface itself: patches, supports, cables, rooms, mesh, their checks, topology, and triangle geometry.

Gives ``Patch``, ``Plane``, ``Line``, ``Circle``, ``Cable``, ``Room``, ``Surface``, ``cut`` and
``mirrored`` to all other rooms. Imports ``curves`` and ``base``.
"""

from ..curves.plane import Plane
from .cable import Cable
from .circle import Circle, Guide
from .cutting import cut
from .held_curve import HeldCurve
from .line import Line
from .mirroring import mirrored, unfolded
from .patch import Patch
from .room import Room
from .surface import Surface, expect_surface

__all__ = [
    "Cable",
    "Circle",
    "Guide",
    "HeldCurve",
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
