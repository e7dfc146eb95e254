"""The surface itself: patches, supports, cables, rooms, mesh, checks, topology, triangle geometry, curves.

Gives ``Patch``, ``Plane``, ``Line``, ``Circle``, ``Curve``, ``Cable``, ``Room``, ``Surface``, ``cut`` and
``mirrored`` to all other subpackages. Imports only ``base``.
"""

from .guides import Circle, Guide, Line, Plane
from .halving import cut
from .held_curve import HeldCurve
from .images import images_in
from .parts import Cable, Patch, Room
from .surface import Surface, expect_surface
from .symmetry import mirrored, unfolded

__all__ = ["Cable", "Circle", "Guide", "HeldCurve", "Line", "Patch", "Plane", "Room", "Surface"]
__all__ += ["cut", "expect_surface", "images_in", "mirrored", "unfolded"]
