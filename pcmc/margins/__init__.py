"""How far a roof at rest is from the edge: the factor on a load or a tension up to which it stays stable.

Gives ``margin`` and ``Margin``, and the quantity "margin" to targets. May import ``accuracy`` and the rooms
below it.
"""

from .edge import Margin, MarginEnd, margin

__all__ = ["Margin", "MarginEnd", "margin"]
