"""How a surface at rest answers to its tensions and pressures, exactly and for one factorisation.

At rest the residual r(X, λ) = Bᵀ∇E vanishes and stays zero along the solutions X(λ):

    J s = -Bᵀ ∂(∇E)/∂λ,   dX/dλ = B s,   ∂(∇E)/∂α_i = ∇A_i,   ∂(∇E)/∂p_i = -∇V_i

(E is linear in tensions and pressures). J differs from Bᵀ(∂²E)B by how the frames B turn while the surface
moves (``linearise``); that part is small, so J s = b is solved by a few GMRES steps on the
factor of Bᵀ(∂²E)B. A quantity q(X, λ) then changes by ⟨∂q/∂X, dX/dλ⟩ + ∂q/∂λ.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.sparse.linalg import LinearOperator, gmres

from ..base.arrays import Floats
from ..base.errors import OptionError, SurfaceError
from ..certificate.certificate import TOLERANCE
from ..contact.pinching import StandingPart, excess_pull, place_wall_rows, standing_part
from ..energy import kernels
from ..energy.functional import energy_and_gradient
from ..energy.jacobian import Linearisation, linearise
from ..energy.motion_space import MotionSpace, force_scale, motion_space
from ..energy.projected_hessian import assemble, hessian_pattern
from ..stability.factorisation import Factor, SingularMatrix, factoriser
from ..surface import Surface
from ..surface.wall_pressures import wall_pressure_changes
from .quantities import Measure, Parameter, Target, measure

ACCURACY = 1e-9  # relative, to which J s = b is solved
LEFT = 1e-6  # the same, above which there is no solution
TARGET, PARAMETER = "a Target", "a Parameter or the name of a patch"
AT_FOLD = "sensitivities: the surface stands at a fold, where they are infinite"


def sensitivities(
    surface: Surface, of: Target | Iterable[Target], to: Parameter | str | Iterable[Parameter | str]
) -> pd.DataFrame:
    """Derivatives dq/dλ of quantities with respect to tensions and pressures, at rest.

    They hold for the surface as the solver moves it, mesh and all, to about 1e-9 of their size; a
    difference of two solutions shows the same.

    Parameters
    ----------
    surface : a surface at rest, as ``pcmc.solve`` returns it.
    of : one or several quantities; whether their targets have values does not matter.
    to : one or several parameters, or names of patches for their tensions.

    Returns
    -------
    DataFrame : a row per quantity, a column per parameter, by their labels; units of q over those
        of λ.

    Raises
    ------
    SurfaceError : the surface is not at rest, or stands exactly at a fold.
    OptionError : none of them, a patch that does not exist, a quantity that cannot be measured.

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
        raise SurfaceError(f"sensitivities: expected a Surface, found {type(surface).__name__}")
    targets, parameters = as_targets(of), as_parameters(to)
    shown, directions = _answers(surface, parameters)
    return pd.DataFrame(
        [slopes(shown, measure(shown, t), parameters, directions) for t in targets],
        index=[t.label for t in targets], columns=[p.label for p in parameters], dtype=float,
    )  # fmt: skip


def as_parameters(given: Parameter | str | Iterable[Parameter | str]) -> list[Parameter]:
    """One parameter or several as a list; a name stands for that patch's tension."""
    made = [
        Parameter(p) if isinstance(p, str) else p
        for p in _listed(given, (str, Parameter), PARAMETER)
    ]
    for p in made:
        if not isinstance(p, Parameter):
            raise OptionError(f"expected {PARAMETER}, found {p!r}")
    labels = [p.label for p in made]
    for k, label in enumerate(labels):
        if label in labels[:k]:
            raise OptionError(f"the {label} is given twice; keep one")
    return made


def as_targets(given: Target | Iterable[Target]) -> list[Target]:
    """One target or several as a list."""
    targets = _listed(given, (Target,), TARGET)
    for t in targets:
        if not isinstance(t, Target):
            raise OptionError(f"expected {TARGET}, found {t!r}")
    return targets


def _listed(given: Any, single: tuple[type, ...], what: str) -> list[Any]:
    """What is given alone, or by anything that can be gone through, even once only."""
    if isinstance(given, single):
        return [given]
    if isinstance(given, str | bytes) or not isinstance(given, Iterable):
        raise OptionError(f"expected {what}, or several of them, found {given!r}")
    listed = list(given)
    if not listed:
        raise OptionError(f"expected {what}, or several of them, found none")
    return listed


def slopes(
    surface: Surface, found: Measure, parameters: Sequence[Parameter], directions: Floats
) -> Floats:
    """(parameters,) dq/dλ of a measured quantity, given dX/dλ (parameters,n,3)."""
    slope = np.einsum("pnd,nd->p", directions, found.position)
    for k, parameter in enumerate(parameters):
        explicit = found.tension if parameter.kind == "tension" else found.pressure
        if explicit is not None:
            slope[k] += explicit @ _shares(surface, parameter, parameters)
    return slope


def _shares(surface: Surface, parameter: Parameter, parameters: Sequence[Parameter]) -> Floats:
    """(k,) how the patches' tensions or pressures change with a parameter: walls follow their rooms'."""
    one = np.zeros(len(surface.patches))
    one[surface.patch_index(parameter.patch)] = 1.0
    if parameter.kind == "tension":
        return one
    named = {surface.patch_index(p.patch) for p in parameters if p.kind == "pressure"}
    return one + wall_pressure_changes(surface, one, named)


def _answers(surface: Surface, parameters: Sequence[Parameter]) -> tuple[Surface, Floats]:
    """The surface with its pinched walls gone, and dX/dλ (parameters,n,3)."""
    for parameter in parameters:
        surface.patch_index(parameter.patch)
    at_rest = _AtRest.of(surface)
    return at_rest.part.surface, np.stack([at_rest.answer(p, parameters) for p in parameters])


@dataclass(frozen=True, eq=False)
class _AtRest:
    """What stands of a surface at rest, its linearisation factorised.

    ``follows``: whether walls hang from a crest that moves.
    """

    part: StandingPart
    follows: bool
    space: MotionSpace
    linear: Linearisation
    factor: Factor

    @classmethod
    def of(cls, surface: Surface) -> _AtRest:
        part = standing_part(surface)
        shown, walls, resting, classes = part.surface, part.walls, part.resting, part.classes
        X = shown.vertices
        space = motion_space(shown, classes, X)
        gradient = energy_and_gradient(shown, X)[1]
        unheld = np.linalg.norm(excess_pull(shown, walls, resting))
        left = np.hypot(np.linalg.norm(space.to_coordinates(gradient)), unheld)
        residual = float(left) / force_scale(shown, classes, X)
        if residual > TOLERANCE:
            raise SurfaceError(
                f"sensitivities: the surface is not at rest (relative residual {residual:.1e});"
                " solve it first"
            )
        pattern = hessian_pattern(classes, space)
        try:
            factor = factoriser(pattern).factor(assemble(shown, classes, space, pattern, X))
        except SingularMatrix:
            raise SurfaceError(AT_FOLD) from None
        follows = bool((walls.top_free & ~resting).any())
        linear = linearise(shown, classes, space, X, gradient)
        return cls(part, follows, space, linear, factor)

    def answer(self, parameter: Parameter, parameters: Sequence[Parameter]) -> Floats:
        """dX/dλ (n,3) for one of the parameters."""
        right = -self.space.to_coordinates(self._force(parameter, parameters))
        if not np.any(right):
            return np.zeros_like(self.part.surface.vertices)
        size = self.space.size
        steps: list[float] = []
        s, _ = gmres(
            LinearOperator((size, size), lambda s: self.linear.times(self._moved(s)), dtype=float), right,
            M=LinearOperator((size, size), self.factor.solve, dtype=float),
            rtol=ACCURACY, restart=40, maxiter=1, callback=steps.append, callback_type="pr_norm",
        )  # fmt: skip
        if not steps or steps[-1] > LEFT:
            raise SurfaceError(AT_FOLD)
        return self._moved(s)

    def _force(self, parameter: Parameter, parameters: Sequence[Parameter]) -> Floats:
        """∂(∇E)/∂λ (n,3)."""
        shown = self.part.surface
        one, zero = _shares(shown, parameter, parameters), np.zeros(len(shown.patches))
        tension, pressure = (one, zero) if parameter.kind == "tension" else (zero, one)
        return kernels.measure(kernels.energy_mesh(shown, tension, pressure), shown.vertices)[2]

    def _moved(self, s: Floats) -> Floats:
        """B s (n,3) with walls that hang from their crest following it, as they do in the solver."""
        d = self.space.to_vectors(s)
        if not self.follows:
            return d
        shown, walls = self.part.surface, self.part.walls
        ahead = place_wall_rows(shown, walls, shown.vertices + d, self.space)
        return ahead - place_wall_rows(shown, walls, shown.vertices, self.space)
