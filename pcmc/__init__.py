"""Piecewise constant-mean-curvature surfaces: triangle meshes of patches in equilibrium."""

from . import explore
from .certificate import Certificate, Verdict, certify
from .continuation import Direction, follow
from .curvature import curvature_error, mean_curvature, target_curvature
from .design import Design, Parameter, Target, meet, sensitivities
from .energy import energy, gradient, hessian
from .io import read, write
from .solvers import solve
from .surface import Patch, Plane, Surface

__all__ = [
    "Certificate",
    "Design",
    "Direction",
    "Parameter",
    "Patch",
    "Plane",
    "Surface",
    "Target",
    "Verdict",
    "certify",
    "curvature_error",
    "energy",
    "explore",
    "follow",
    "gradient",
    "hessian",
    "mean_curvature",
    "meet",
    "read",
    "sensitivities",
    "solve",
    "target_curvature",
    "write",
]
