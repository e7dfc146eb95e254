"""Piecewise constant-mean-curvature surfaces: triangle meshes of patches in equilibrium."""

from .certificate import Certificate, Verdict, certify
from .curvature import curvature_error, mean_curvature, target_curvature
from .energy import energy, gradient, hessian
from .io import read, write
from .solvers import solve
from .surface import Patch, Plane, Surface

__all__ = [
    "Certificate",
    "Patch",
    "Plane",
    "Surface",
    "Verdict",
    "certify",
    "curvature_error",
    "energy",
    "gradient",
    "hessian",
    "mean_curvature",
    "read",
    "solve",
    "target_curvature",
    "write",
]
