"""Piecewise constant-mean-curvature surfaces: triangle meshes of patches in equilibrium."""

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

from . import explore
from .base import errors
from .energy.curvature import curvature_error, mean_curvature, target_curvature
from .energy.functional import energy, gradient, hessian
from .solvers import solve
from .surface import Patch, Plane, Surface

if TYPE_CHECKING:
    from .certificate import Certificate, Verdict, certify
    from .continuation import Direction, follow
    from .design import Design, Parameter, Target, meet, sensitivities
    from .io import read, write

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
    "errors",
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

# Imported when first asked for: they bring pandas and much of scipy, which take longer than all else.
_LATER = {
    "certificate": ("Certificate", "Verdict", "certify"),
    "continuation": ("Direction", "follow"),
    "design": ("Design", "Parameter", "Target", "meet", "sensitivities"),
    "io": ("read", "write"),
}

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        for module, names in _LATER.items():
            if name in names:
                globals()[name] = found = getattr(import_module(f".{module}", __name__), name)
                return found
        if find_spec(f"{__name__}.{name}") is not None:
            return import_module(f".{name}", __name__)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
