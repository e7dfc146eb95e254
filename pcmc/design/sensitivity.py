"""How a surface at rest responds to its tensions and pressures: exact derivatives, one factorisation.

At rest the residual r(X, λ) = Bᵀ∇E vanishes and stays zero along the solutions X(λ):

    J s = -Bᵀ ∂(∇E)/∂λ,   dX/dλ = B s,   ∂(∇E)/∂α_i = ∇A_i,   ∂(∇E)/∂p_i = -∇V_i

(E is linear in tensions and pressures). J differs from Bᵀ(∂²E)B because the bases B turn while the surface
moves (``linearise``); that part is small, so J s = b is solved by a few GMRES steps with the factor of
Bᵀ(∂²E)B as preconditioner. A quantity q(X, λ) then changes by ⟨∂q/∂X, dX/dλ⟩ + ∂q/∂λ.

Where rooms prescribe volumes, their pressures change with λ, too: ``Equilibrium.times`` stands for J.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from ..base.arrays import Floats
from ..base.errors import OptionError, SurfaceError
from ..base.tolerances import AT_REST
from ..certificate.balance import pressures_left_over
from ..certificate.measures import Measurement
from ..forces.functional import by_rates
from ..stability.bordered import solve_preconditioned
from ..stability.equilibrium import Equilibrium
from ..stability.factorisation import SingularMatrix
from ..surface import Surface, expect_surface
from ..surface.lagrange import expect_flat
from ..surface.values import rates_of
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
    SurfaceError : the surface is not at rest, or exactly at a fold; snow at a free edge.
    OptionError : no quantity or parameter, an unknown patch, a quantity that cannot be measured, a pressure
        at a free edge, where its change would depend on Π's point.

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
    expect_surface(surface)
    expect_flat(surface, "sensitivities")
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
    at, rates = Equilibrium.of(surface), list[Floats]()
    for parameter in parameters:  # walls follow their neighbours unless they are parameters themselves
        alike = (one for one in parameters if one.kind == parameter.kind)
        named = {name: float(name in parameter.names) for one in alike for name in one.names}
        rates.append(rates_of(at.surface, parameter.key, named))
        if parameter.key in ("pressures", "snows") and not surface.uncancelled.any():
            value = parameter.value(surface)
            changed = dict.fromkeys(parameter.names, value + (abs(value) or 1.0))
            if left := pressures_left_over(surface.retensioned(**{parameter.key: changed})):
                message = f"{parameter.label}: where it changes, {left}, or hold these edges"
                raise OptionError(message, what=parameter.label)
    responses = _responses(at, [{p.key: own} for p, own in zip(parameters, rates, strict=True)])
    changes = list(zip(parameters, rates, responses, strict=True))
    return [_slopes(at.surface, measure(at.surface, target), changes) for target in targets]


def _slopes(
    surface: Surface, quantity: Measurement, changes: list[tuple[Parameter, Floats, tuple[Floats, Floats]]]
) -> tuple[Floats, Floats, Floats]:
    """``slopes`` of a quantity; ``changes`` are a parameter, its rates, dX/dλ (n,3) and dδ/dλ (r,) each."""
    slope = np.array([(motion * quantity.by_position).sum() for _, _, (motion, _) in changes])
    falling, growing = np.zeros((2, len(changes)))
    for k, (parameter, own, (motion, pressures)) in enumerate(changes):
        if parameter.key in quantity.by:
            slope[k] += quantity.by[parameter.key] @ own
        if "pressures" in quantity.by and surface.rooms:
            slope[k] += quantity.by["pressures"] @ (pressures @ surface.room_signs)
        falling[k] = growing[k] = slope[k]
        if quantity.ties is not None:
            each = quantity.ties.by_position @ motion.ravel()
            if parameter.key in quantity.ties.by:
                each += quantity.ties.by[parameter.key] @ own
            rounding = SAME * (np.abs(each).max() + abs(quantity.value / (parameter.value(surface) or 1.0)))
            if np.ptp(each) > rounding:
                falling[k], growing[k] = each.min(), each.max()
    return slope, falling, growing


def _responses(at: Equilibrium, rates: Sequence[dict[str, Floats]]) -> list[tuple[Floats, Floats]]:
    """dX/dλ (n,3) and dδ/dλ (r,) while values change at these rates."""
    if at.residual_with_pull > AT_REST:
        found = at.residual_with_pull
        message = f"sensitivities: the surface is not at rest (residual {found:.1e}); solve it first"
        raise SurfaceError(message, what="surface", found=found, expected=AT_REST)
    try:
        inverse = at.factorised(soften=False).bordered
    except SingularMatrix:
        raise SurfaceError(AT_FOLD, what="surface") from None
    surface, space = at.surface, at.space
    count, units = space.size, at.volume_units

    def motion(s: Floats) -> Floats:  # walls that hang from their junction follow it, as in the solver
        d = space.to_vectors(s)
        if not at.part.standing.any():
            return d
        return at.part.follow(at.X + d, space) - at.part.follow(at.X, space)

    def times(z: Floats) -> Floats:
        return at.times(motion(z[:count]), z[count:])

    def response(of: dict[str, Floats]) -> tuple[Floats, Floats]:
        right = np.append(-space.to_coordinates(by_rates(surface, of)[1]), units * of.get("volumes", 0.0))
        if not np.any(right):
            return np.zeros_like(at.X), np.zeros(len(units))
        z, residuals = solve_preconditioned(times, inverse, right, ACCURACY, restart=40)
        unit = np.linalg.norm(inverse(right)) / np.linalg.norm(right)  # that of the residuals
        if not residuals or residuals[-1] > NO_SOLUTION * unit:
            raise SurfaceError(AT_FOLD, what="surface")
        return motion(z[:count]), units * z[count:]

    return [response(of) for of in rates]
