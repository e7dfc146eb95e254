"""The certificate: what a surface is. Residual, balance, reactions, collapse, verdict.

Gives ``certify`` to the solvers' callers. Imports ``stability``, ``meshing``, ``contact`` and below.
"""

from .certificate import Certificate, Verdict, certify

__all__ = ["Certificate", "Verdict", "certify"]
