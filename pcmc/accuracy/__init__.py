"""Accuracy: how far an answer depends on its mesh.

Gives ``check_mesh``, ``solve_to_accuracy`` and their values. May import ``existence`` and the rooms below.
"""

from .adaptive import AccuracyStatus, AccurateResult, solve_to_accuracy
from .mesh_check import MeshCheck, check_mesh
from .persistence import MeshVerdict

__all__ = [
    "AccuracyStatus",
    "AccurateResult",
    "MeshCheck",
    "MeshVerdict",
    "check_mesh",
    "solve_to_accuracy",
]
