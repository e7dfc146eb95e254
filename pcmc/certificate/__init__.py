"""The certificate of a surface: residual, balance, reactions, collapse, verdict; a theorem by ``verify``.

Gives ``certify`` to the solvers' callers. Imports ``stability``, ``meshing`` and below.
"""

from .certificate import Certificate, certify
from .proof import Attempt, Overload, UnbalancedJunction, Unheld, WeakCable
from .verdict import Evidence, Verdict

__all__ = ["Attempt", "Certificate", "Evidence", "Overload", "UnbalancedJunction", "Unheld", "Verdict"]
__all__ += ["WeakCable", "certify"]
