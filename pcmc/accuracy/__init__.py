"""Accuracy: how far an answer depends on its mesh.

Gives ``check_mesh`` and its values. May import ``solvers`` and ``continuation`` and the rooms below them.
"""

from .mesh_check import MeshCheck, check_mesh
from .persistence import MeshVerdict

__all__ = ["MeshCheck", "MeshVerdict", "check_mesh"]
