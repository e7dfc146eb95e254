"""Meeting a goal: the tensions and pressures that give a surface what is wanted of it."""

from .meeting import meet
from .outcome import Design, Reach
from .quantities import Parameter, Target
from .sensitivity import sensitivities

__all__ = ["Design", "Parameter", "Reach", "Target", "meet", "sensitivities"]
