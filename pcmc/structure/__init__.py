"""Structural models: a surface as prestressed membranes with loads, and a finite-element program's answer."""

from .analysis import Analysis, Case, analyse
from .columns import drawn_members
from .gas import Gas
from .inp import write_structure
from .loads import SelfWeight, Snow, Step, Wind
from .material import Material, Profile
from .members import Member, PlacedMember
from .model import StructuralModel
from .results import StepResults, read_results

__all__ = ["Analysis", "Case", "Gas", "Material", "Member", "PlacedMember", "Profile", "SelfWeight", "Snow"]
__all__ += ["Step", "StepResults", "StructuralModel", "Wind", "analyse", "drawn_members", "read_results"]
__all__ += ["write_structure"]
