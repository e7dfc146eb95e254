"""The one table of quantities, and the key figures of a roof in its terms.

Gives ``QUANTITIES``, ``dimension_of`` and ``figures`` to targets, mesh check, page, report and sweep. May
import ``certificate`` and the rooms below it.
"""

from .figures import Figure, figures
from .table import QUANTITIES, Quantity, dimension_of

__all__ = ["QUANTITIES", "Figure", "Quantity", "dimension_of", "figures"]
