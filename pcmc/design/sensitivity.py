"""How a surface at rest responds to its tensions and pressures: exact derivatives, one factorisation.

At rest the residual r(X, λ) = Bᵀ∇E vanishes and stays zero along the solutions X(λ):

    J s = -Bᵀ ∂(∇E)/∂λ,   dX/dλ = B s,   ∂(∇E)/∂α_i = ∇A_i,   ∂(∇E)/∂p_i = -∇V_i

(E is linear in tensions and pressures). J differs from Bᵀ(∂²E)B because the bases B turn while the surface
moves (``linearise``); that part is small, so J s = b is solved by a few GMRES steps with the factor of
Bᵀ(∂²E)B as preconditioner. A quantity q(X, λ) then changes by ⟨∂q/∂X, dX/dλ⟩ + ∂q/∂λ.

Where rooms prescribe volumes, their pressures δ change with λ, too, and J is bordered:

    [ J   -G ] [ s     ]     [ -Bᵀ ∂(∇E)/∂λ ]
    [ Gᵀ   0 ] [ dδ/dλ ]  =  [  dV̄/dλ       ]        G = Bᵀ ∂V/∂X
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
from ..contact.pinching import StandingPart, place_wall_rows, standing_part
from ..contact.pull import excess_pull
from ..forces.functional import energy_and_gradient
from ..forces.jacobian import Linearisation, linearise
from ..forces.motion_space import MotionSpace, force_scale, motion_space
from ..forces.parameters import gradient_by
from ..forces.pattern import hessian_pattern
from ..forces.rooms import prescribed_volumes, volume_defects, volume_gradients_at
from ..forces.second_variation import assemble
from ..stability.factorisation import BorderedFactor, Factor, SingularMatrix, factoriser
from ..surface import Surface
from ..surface.values import rates_of
from .quantities import Measurement
from .targets import Parameter, Target, as_parameters, as_targets, measure

ACCURACY = 1e-9  # relative residual to which J s = b is solved
NO_SOLUTION = 1e-6  # relative residual above which J is singular
SAME = 1e-6  # of q/λ and of themselves: derivatives this near on both sides of a kink are one
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
        of λ. A largest lean, pull, height or sag that several places share has a kink: while λ grows the
        place where it grows most leads, while λ falls another. Where both differ there are two rows,
        "… as they fall" and "… as they grow", with the derivatives on either side.

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
        parameter.check(surface)
    rows: dict[str, Floats] = {}
    for target, (slope, falling, growing) in zip(targets, slopes(surface, targets, parameters), strict=True):
        if np.array_equal(falling, growing):
            rows[target.label] = slope
        else:
            rows |= {f"{target.label} as they fall": falling, f"{target.label} as they grow": growing}
    return pd.DataFrame.from_dict(rows, orient="index", columns=[p.label for p in parameters], dtype=float)


def slopes(
    surface: Surface, targets: Sequence[Target], parameters: Sequence[Parameter]
) -> list[tuple[Floats, Floats, Floats]]:
    """dq/dλ (parameters,) of each target: of one branch, and of those leading while λ falls and grows."""
    response = _LinearResponse.of(surface)
    shown = response.part.surface
    changes = [response.motion(p, parameters) for p in parameters]
    return [_slopes(shown, measure(shown, target), parameters, changes) for target in targets]


def _slopes(
    surface: Surface,
    quantity: Measurement,
    parameters: Sequence[Parameter],
    changes: Sequence[tuple[Floats, Floats]],
) -> tuple[Floats, Floats, Floats]:
    """``slopes`` of a measured quantity, given dX/dλ (n,3) and dδ/dλ (r,) of each parameter."""
    motions = np.stack([motion for motion, _ in changes])
    slope = np.einsum("pnd,nd->p", motions, quantity.by_position)
    falling, growing = np.zeros((2, len(parameters)))
    for k, parameter in enumerate(parameters):
        by_part = quantity.by(parameter.kind)
        if by_part is not None:
            slope[k] += by_part @ _rates(surface, parameter, parameters)
        if quantity.by_pressure is not None and surface.rooms:
            slope[k] += quantity.by_pressure @ (changes[k][1] @ surface.room_signs)
        falling[k] = growing[k] = slope[k]
        if quantity.ties is not None:
            each = quantity.ties.by_position @ motions[k].ravel()
            if parameter.kind in quantity.ties.by:
                each += quantity.ties.by[parameter.kind] @ _rates(surface, parameter, parameters)
            rounding = SAME * (np.abs(each).max() + abs(quantity.value / (parameter.value(surface) or 1.0)))
            if np.ptp(each) > rounding:
                falling[k], growing[k] = each.min(), each.max()
    return slope, falling, growing


def _rates(surface: Surface, parameter: Parameter, parameters: Sequence[Parameter]) -> Floats:
    """(k,) d/dλ of each patch's, cable's or room's own number; walls follow unless they are parameters."""
    alike = [one for one in parameters if one.kind == parameter.kind]
    named = {name: float(name in parameter.names) for one in alike for name in one.names}
    return rates_of(surface, f"{parameter.kind}s", named)


@dataclass(frozen=True, eq=False)
class _LinearResponse:
    """The equations of a surface at rest, factorised; ``walls_follow``: walls hang from a moving crest."""

    part: StandingPart
    walls_follow: bool
    space: MotionSpace
    jacobian: Linearisation
    inverse: Factor | BorderedFactor
    volume_units: Floats
    volume_gradients: Floats

    @classmethod
    def of(cls, surface: Surface) -> _LinearResponse:
        part = standing_part(surface)
        shown, walls, resting, classes = part.surface, part.walls, part.resting, part.classes
        X = shown.vertices
        space = motion_space(shown, classes, X)
        gradient = energy_and_gradient(shown, X)[1]
        unheld = np.linalg.norm(excess_pull(shown, walls, resting))
        left = np.hypot(np.linalg.norm(space.to_coordinates(gradient)), unheld)
        scale = force_scale(shown, classes, X)
        residual = float(np.hypot(left / scale, np.linalg.norm(volume_defects(shown))))
        if residual > TOLERANCE:
            message = f"sensitivities: the surface is not at rest (residual {residual:.1e}); solve it first"
            raise SurfaceError(message, what="surface", found=residual, expected=TOLERANCE)
        pattern = hessian_pattern(classes, space)
        try:
            factor = factoriser(pattern).factor(assemble(shown, classes, space, pattern, X))
        except SingularMatrix:
            raise SurfaceError(AT_FOLD, what="surface") from None
        inverse: Factor | BorderedFactor = factor
        units = scale / np.abs(prescribed_volumes(shown))
        gradients = units[:, None, None] * volume_gradients_at(shown, X)
        if shown.rooms:
            columns = np.stack([space.to_coordinates(gradient) for gradient in gradients], axis=1)
            inverse = BorderedFactor(factor, columns)
        walls_follow = bool((walls.top_free & ~resting).any())
        jacobian = linearise(shown, classes, space, X, gradient)
        return cls(part, walls_follow, space, jacobian, inverse, units, gradients)

    def motion(self, parameter: Parameter, parameters: Sequence[Parameter]) -> tuple[Floats, Floats]:
        """dX/dλ (n,3) and dδ/dλ (r,) for one of the parameters."""
        shown, rooms = self.part.surface, len(self.volume_units)
        rates = _rates(shown, parameter, parameters)
        force = gradient_by(shown, {f"{parameter.kind}s": rates})
        volumes = self.volume_units * rates if parameter.kind == "volume" else np.zeros(rooms)
        right = np.append(-self.space.to_coordinates(force), volumes)
        if not np.any(right):
            return np.zeros_like(shown.vertices), np.zeros(rooms)
        size = self.space.size + rooms
        residuals: list[float] = []
        z, _ = gmres(
            LinearOperator((size, size), self._times, dtype=float),
            right,
            M=LinearOperator((size, size), self.inverse.solve, dtype=float),
            rtol=ACCURACY,
            restart=40,
            maxiter=1,
            callback=residuals.append,
            callback_type="pr_norm",
        )
        if not residuals or residuals[-1] > NO_SOLUTION:
            raise SurfaceError(AT_FOLD, what="surface")
        return self._vertex_motion(z[: self.space.size]), self.volume_units * z[self.space.size :]

    def _times(self, z: Floats) -> Floats:
        """J, or the bordered matrix, times z (N+r,)."""
        size = self.space.size
        motion = self._vertex_motion(z[:size])
        change = self.jacobian.times(motion)
        if not len(self.volume_units):
            return change
        push = self.space.to_coordinates(np.tensordot(z[size:], self.volume_gradients, axes=1))
        return np.append(change - push, np.einsum("rnd,nd->r", self.volume_gradients, motion))

    def _vertex_motion(self, s: Floats) -> Floats:
        """B s (n,3); walls that hang from their crest follow it, as in the solver."""
        d = self.space.to_vectors(s)
        if not self.walls_follow:
            return d
        shown, walls = self.part.surface, self.part.walls
        ahead = place_wall_rows(shown, walls, shown.vertices + d, self.space)
        return ahead - place_wall_rows(shown, walls, shown.vertices, self.space)
