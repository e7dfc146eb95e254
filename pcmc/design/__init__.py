"""Design: the tensions and pressures with which a surface meets its targets.

Gives ``meet``, ``sensitivities`` and their values. May import ``accuracy`` and the rooms below it.
"""

from .outcome import Design, DesignStatus, NoStart
from .search import meet
from .sensitivity import sensitivities
from .targets import Parameter, Target

__all__ = ["Design", "DesignStatus", "NoStart", "Parameter", "Target", "meet", "sensitivities"]
