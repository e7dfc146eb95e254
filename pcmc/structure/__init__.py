"""Structural models: a surface as prestressed membranes with loads, and a finite-element program's answer."""

from .analysis import Analysis, Case, analyse
from .gas import Gas
from .inp import write_structure
from .loads import SelfWeight, Snow, Step, Wind
from .model import Material, StructuralModel
from .results import StepResults, read_results

__all__ = [
    "Analysis",
    "Case",
    "Gas",
    "Material",
    "SelfWeight",
    "Snow",
    "Step",
    "StepResults",
    "StructuralModel",
    "Wind",
    "analyse",
    "read_results",
    "write_structure",
]
