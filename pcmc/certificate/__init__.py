"""The certificate of a surface: residual, balance, reactions, collapse, verdict.

Gives ``certify`` to the solvers' callers. Imports ``stability``, ``meshing``, ``contact`` and below.
"""

from .certificate import Certificate, certify
from .verdict import Evidence, Verdict

__all__ = ["Certificate", "Evidence", "Verdict", "certify"]
