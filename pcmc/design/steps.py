"""The points of a search for targets, and the steps between them.

At a fold solutions end: the quantity still changes but the parameter does not, λ_fold - λ ~ (q_fold - q)².
The slopes at two points show the fold before it is reached: they give the right length of the step, and
the reachable limit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..base.arrays import Floats
from ..certificate.proof import Overload
from ..solvers.result import Result
from ..surface import Surface
from .targets import Target

FOLD_GAP = 1e-3  # relative distance of the misfit from its value at a fold where the search ends
FOLD_SHARE = 0.97  # of the parameters' way to a fold is tried next


@dataclass(frozen=True, eq=False)
class Trial:
    """A point that was tried; at rest with its quantities, relative misfits r, φ = ‖r‖, and J = ∂r/∂x.

    ``aims`` are the quantities whose misfits these are: the targets', but at a held top (``Search.aimed``).
    """

    x: Floats  # the unknowns
    result: Result | Overload  # a load beyond what the boundary carries, where no solve was tried
    quantities: Floats = field(default_factory=lambda: np.empty(0))
    r: Floats = field(default_factory=lambda: np.empty(0))
    phi: float = math.nan
    aims: list[Target] = field(default_factory=list)  # empty where no equilibrium was found
    jacobian: Floats = field(default_factory=lambda: np.empty(0))
    trust: float = 1.0  # longest step from here, as a part of the unknowns' sizes

    @property
    def surface(self) -> Surface:
        assert isinstance(self.result, Result)
        return self.result.surface

    @property
    def status(self) -> str:
        """How the solve ended, as in the history."""
        return self.result.status.name.lower() if isinstance(self.result, Result) else "overloaded"

    @property
    def reason(self) -> str:
        """Why there is no equilibrium."""
        return self.result.certificate.detail if isinstance(self.result, Result) else str(self.result)


@dataclass(frozen=True, eq=False)
class StepPlan:
    """A Gauss-Newton step, and how the misfit bends along it.

    Along the step let g = dt/dφ be linear in φ, from the slopes here and at the iterate before, and
    ρ = φ (g_before/g - 1) / (φ_before - φ). Then the misfit vanishes after 1 - ρ/2 of the way that the
    slope alone predicts. If ρ > 1, a fold comes first, after 1/(2ρ) of that way, where the misfit has
    fallen by φ/ρ.
    """

    step: Floats  # the Gauss-Newton step, t = 1
    first: float = 1.0  # t to try first
    to_fold: float | None = None  # φ/ρ over the slope: t at the fold, if that is too near for a further solve

    @classmethod
    def of(cls, before: Trial | None, here: Trial, step: Floats) -> StepPlan:
        """The plan for a step from here; ``before`` is the last iterate."""
        if before is None or not before.phi > here.phi:
            return cls(step)
        run = here.x - before.x
        cosine = run @ step / (np.linalg.norm(run) * np.linalg.norm(step))
        slope, slope_before = (-float(p.r @ p.jacobian @ step) / p.phi for p in (here, before))
        if cosine < 0.9 or slope <= 0.0 or slope_before <= 0.0:
            return cls(step)
        full = here.phi / slope
        bend = here.phi * (slope / slope_before - 1.0) / (before.phi - here.phi)
        if bend <= 1.0:
            return cls(step, min(1.0, full * (1.0 - 0.5 * bend)) if bend > 0.0 else 1.0)
        gap = here.phi / bend
        first = min(1.0, FOLD_SHARE * 0.5 * full / bend)
        return cls(step, first, gap / slope if gap < FOLD_GAP else None)
