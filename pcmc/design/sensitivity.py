"""How a surface at rest responds to its tensions and pressures: exact derivatives, one factorisation.

At rest the residual r(X, λ) = Bᵀ∇E vanishes and stays zero along the solutions X(λ):

    J s = -Bᵀ ∂(∇E)/∂λ,   dX/dλ = B s,   ∂(∇E)/∂α_i = ∇A_i,   ∂(∇E)/∂p_i = -∇V_i

(E is linear in tensions and pressures). J differs from Bᵀ(∂²E)B because the bases B turn while the surface
moves (``linearise``); that part is small, so J s = b is solved by a few GMRES steps with the factor of
Bᵀ(∂²E)B as preconditioner. A quantity q(X, λ) then changes by ⟨∂q/∂X, dX/dλ⟩ + ∂q/∂λ.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.sparse.linalg import LinearOperator, gmres

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import SurfaceError
from ..certificate.certificate import TOLERANCE
from ..contact.pinching import StandingPart, excess_pull, place_wall_rows, standing_part
from ..energy.functional import energy_and_gradient, weighted
from ..energy.jacobian import Linearisation, linearise
from ..energy.motion_space import MotionSpace, force_scale, motion_space
from ..energy.projected_hessian import assemble, hessian_pattern
from ..stability.factorisation import Factor, SingularMatrix, factoriser
from ..surface import Surface
from ..surface.wall_pressures import wall_pressure_changes
from .quantities import Measurement
from .targets import Parameter, Target, as_parameters, as_targets, measure

ACCURACY = 1e-9  # relative residual to which J s = b is solved
NO_SOLUTION = 1e-6  # relative residual above which J is singular
AT_FOLD = "sensitivities: the surface is at a fold, where they are infinite"


def sensitivities(
    surface: Surface, of: Target | Iterable[Target], to: Parameter | str | Iterable[Parameter | str]
) -> pd.DataFrame:
    """Derivatives dq/dλ of quantities with respect to tensions and pressures, at rest.

    They are those of the discrete surface as the solver moves it, to about 1e-9 of their size: the
    limit of the difference of two solutions.

    Parameters
    ----------
    surface : a surface at rest, as ``pcmc.solve`` returns it.
    of : one or several quantities; values and limits are ignored.
    to : one or several parameters, or names of patches for their tensions.

    Returns
    -------
    DataFrame : a row per quantity, a column per parameter, by their labels; units of q over those
        of λ.

    Raises
    ------
    SurfaceError : the surface is not at rest, or exactly at a fold.
    OptionError : no quantity or parameter, an unknown patch, a quantity that cannot be measured.

    Examples
    --------
    The pyramid's height h obeys α h / √(1 + h²) = p / 3, so at h² = 1/8 dh/dα = -h (1 + h²):

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 8**-0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> table = sensitivities(roof, [Target("apex", "roof"), Target("curvature", "roof")], ["roof"])
    >>> table.round(6)
                       tension of roof
    apex of roof             -0.397748
    curvature of roof        -0.500000
    """
    if not isinstance(surface, Surface):
        validate.refuse("surface", type(surface).__name__, "a Surface", error=SurfaceError)
    targets, parameters = as_targets(of), as_parameters(to)
    for parameter in parameters:
        surface.patch_index(parameter.patch)
    response = _LinearResponse.of(surface)
    shown = response.part.surface
    motions = np.stack([response.motion(p, parameters) for p in parameters])
    slopes = [_slopes(shown, measure(shown, t), parameters, motions) for t in targets]
    rows, columns = [t.label for t in targets], [p.label for p in parameters]
    return pd.DataFrame(slopes, rows, columns, dtype=float)


def _slopes(
    surface: Surface, quantity: Measurement, parameters: Sequence[Parameter], motions: Floats
) -> Floats:
    """(parameters,) dq/dλ of a measured quantity, given dX/dλ (parameters,n,3)."""
    slope = np.einsum("pnd,nd->p", motions, quantity.by_position)
    for k, parameter in enumerate(parameters):
        by_patch = quantity.by_tension if parameter.kind == "tension" else quantity.by_pressure
        if by_patch is not None:
            slope[k] += by_patch @ _patch_rates(surface, parameter, parameters)
    return slope


def _patch_rates(surface: Surface, parameter: Parameter, parameters: Sequence[Parameter]) -> Floats:
    """(k,) d/dλ of each patch's tension or pressure; wall pressures change with those of the rooms."""
    one = np.zeros(len(surface.patches))
    one[surface.patch_index(parameter.patch)] = 1.0
    if parameter.kind == "tension":
        return one
    named = {surface.patch_index(p.patch) for p in parameters if p.kind == "pressure"}
    return one + wall_pressure_changes(surface, one, named)


@dataclass(frozen=True, eq=False)
class _LinearResponse:
    """The equations of a surface at rest, factorised; ``walls_follow``: walls hang from a moving crest."""

    part: StandingPart
    walls_follow: bool
    space: MotionSpace
    jacobian: Linearisation
    factor: Factor

    @classmethod
    def of(cls, surface: Surface) -> _LinearResponse:
        part = standing_part(surface)
        shown, walls, resting, classes = part.surface, part.walls, part.resting, part.classes
        X = shown.vertices
        space = motion_space(shown, classes, X)
        gradient = energy_and_gradient(shown, X)[1]
        unheld = np.linalg.norm(excess_pull(shown, walls, resting))
        left = np.hypot(np.linalg.norm(space.to_coordinates(gradient)), unheld)
        residual = float(left) / force_scale(shown, classes, X)
        if residual > TOLERANCE:
            message = f"sensitivities: the surface is not at rest (residual {residual:.1e}); solve it first"
            raise SurfaceError(message, what="surface", found=residual, expected=TOLERANCE)
        pattern = hessian_pattern(classes, space)
        try:
            factor = factoriser(pattern).factor(assemble(shown, classes, space, pattern, X))
        except SingularMatrix:
            raise SurfaceError(AT_FOLD, what="surface") from None
        walls_follow = bool((walls.top_free & ~resting).any())
        jacobian = linearise(shown, classes, space, X, gradient)
        return cls(part, walls_follow, space, jacobian, factor)

    def motion(self, parameter: Parameter, parameters: Sequence[Parameter]) -> Floats:
        """dX/dλ (n,3) for one of the parameters."""
        shown = self.part.surface
        rates = _patch_rates(shown, parameter, parameters)
        force = weighted(shown, rates) if parameter.kind == "tension" else weighted(shown, 0.0, rates)
        right = -self.space.to_coordinates(force[2])
        if not np.any(right):
            return np.zeros_like(shown.vertices)
        size = self.space.size
        residuals: list[float] = []
        s, _ = gmres(
            LinearOperator((size, size), lambda s: self.jacobian.times(self._vertex_motion(s)), dtype=float),
            right,
            M=LinearOperator((size, size), self.factor.solve, dtype=float),
            rtol=ACCURACY,
            restart=40,
            maxiter=1,
            callback=residuals.append,
            callback_type="pr_norm",
        )
        if not residuals or residuals[-1] > NO_SOLUTION:
            raise SurfaceError(AT_FOLD, what="surface")
        return self._vertex_motion(s)

    def _vertex_motion(self, s: Floats) -> Floats:
        """B s (n,3); walls that hang from their crest follow it, as in the solver."""
        d = self.space.to_vectors(s)
        if not self.walls_follow:
            return d
        shown, walls = self.part.surface, self.part.walls
        ahead = place_wall_rows(shown, walls, shown.vertices + d, self.space)
        return ahead - place_wall_rows(shown, walls, shown.vertices, self.space)
