"""The surface itself: patches, plane, mesh, their checks, topology, and the geometry of triangles.

Gives ``Patch``, ``Plane``, ``Line`` and ``Surface`` to all other rooms. Imports only ``base``.
"""

from .line import Line
from .surface import Patch, Plane, Surface, expect_surface

__all__ = ["Line", "Patch", "Plane", "Surface", "expect_surface"]
