"""Accuracy: how far an answer depends on its mesh, and how far a roof is from the edge.

Gives ``check_mesh``, ``solve_to_accuracy``, ``margin`` (the factor on a load or a tension up to which a roof
stays stable), their values, and the quantity "margin" to targets. May import ``solvers`` and the rooms below.
"""

from .adaptive import AccuracyStatus, AccurateResult, solve_to_accuracy
from .margins import Margin, MarginEnd, margin
from .mesh_check import MeshCheck, check_mesh
from .persistence import MeshVerdict

__all__ = ["AccuracyStatus", "AccurateResult", "Margin", "MarginEnd", "MeshCheck", "MeshVerdict"]
__all__ += ["check_mesh", "margin", "solve_to_accuracy"]
