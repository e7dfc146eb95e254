"""The certificate of a surface: residual, balance, reactions, collapse, verdict.

Gives ``certify`` to the solvers' callers. Imports ``stability``, ``meshing``, ``contact`` and below.
"""

from .certificate import Certificate, certify
from .proof import Fold, Overload, UnbalancedJunction, Unheld
from .verdict import Evidence, Verdict

__all__ = [
    "Certificate",
    "Evidence",
    "Fold",
    "Overload",
    "UnbalancedJunction",
    "Unheld",
    "Verdict",
    "certify",
]
