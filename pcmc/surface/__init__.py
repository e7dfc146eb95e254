"""The surface itself: patches, plane, mesh, their checks, topology, and the geometry of triangles.

Gives ``Patch``, ``Plane`` and ``Surface`` to all other rooms. Imports only ``base``.
"""

from .surface import Patch, Plane, Surface, expect_surface

__all__ = ["Patch", "Plane", "Surface", "expect_surface"]
