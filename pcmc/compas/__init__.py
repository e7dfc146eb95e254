"""Surfaces as COMPAS meshes, for Rhino, Grasshopper and Blender.

Gives ``to_meshes``, ``from_meshes``, functions of meshes and plain data, and their service for
``compas.rpc.Proxy`` (``python -m pcmc.compas``). May import ``certificate``, ``io`` and those below them.
"""

from .meshes import certify, from_meshes, read, solve, to_meshes, write

__all__ = ["certify", "from_meshes", "read", "solve", "to_meshes", "write"]
