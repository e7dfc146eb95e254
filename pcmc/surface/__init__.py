"""The surface itself: patches, plane, mesh, their checks, topology, and the geometry of triangles.

Gives ``Patch``, ``Plane``, ``Line``, ``Circle`` and ``Surface`` to all other rooms. Imports only ``base``.
"""

from .circle import Circle, Guide
from .line import Line
from .surface import Patch, Plane, Surface, expect_surface

__all__ = ["Circle", "Guide", "Line", "Patch", "Plane", "Surface", "expect_surface"]
