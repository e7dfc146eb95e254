"""How a surface at rest answers to its tensions and pressures, exactly and for one factorisation.

At rest the residual r(X, λ) = Bᵀ∇E vanishes and stays zero along the solutions X(λ):

    J s = -Bᵀ ∂(∇E)/∂λ,   dX/dλ = B s,   ∂(∇E)/∂α_i = ∇A_i,   ∂(∇E)/∂p_i = -∇V_i

(E is linear in tensions and pressures). J differs from Bᵀ(∂²E)B by how the frames B turn while the surface
moves (``linearise``); that part is small, so J s = b is solved by a few GMRES steps on the
factor of Bᵀ(∂²E)B. A quantity q(X, λ) then changes by ⟨∂q/∂X, dX/dλ⟩ + ∂q/∂λ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.sparse.linalg import LinearOperator, gmres

from .. import kernels
from ..arrays import Floats
from ..assemble import assemble, pattern
from ..certificate import TOLERANCE
from ..contact import Walls, hung, pinched, resting, standing_structure, walls
from ..energy import energy_and_gradient
from ..errors import OptionError, SurfaceError
from ..factor import Factor, SingularMatrix, factoriser
from ..linearise import Linearisation, linearise
from ..motion import MotionSpace, force_scale, motion_space
from ..surface import Surface
from .quantities import Measure, Parameter, Target, measure

ACCURACY = 1e-9  # relative, to which J s = b is solved
LEFT = 1e-6  # the same, above which there is no solution
AT_FOLD = "sensitivities: the surface stands at a fold, where they are infinite"


def sensitivities(
    surface: Surface, of: Sequence[Target], to: Sequence[Parameter | str]
) -> pd.DataFrame:
    """Derivatives dq/dλ of quantities with respect to tensions and pressures, at rest.

    They hold for the surface as the solver moves it, mesh and all, to about 1e-9 of their size; a
    difference of two solutions shows the same.

    Parameters
    ----------
    surface : a surface at rest, as ``pcmc.solve`` returns it.
    of : quantities; whether their targets have values does not matter.
    to : parameters, or names of patches for their tensions.

    Returns
    -------
    DataFrame : a row per quantity, a column per parameter, by their labels; units of q over those
        of λ.

    Raises
    ------
    SurfaceError : the surface is not at rest, or stands exactly at a fold.
    OptionError : a patch that does not exist, a quantity that cannot be measured.

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
    parameters = as_parameters(to)
    standing, directions = _answers(surface, parameters)
    rows = [
        slopes(standing, measure(standing, target), parameters, directions)
        for target in as_targets(of)
    ]
    return pd.DataFrame(
        rows, index=[t.label for t in of], columns=[p.label for p in parameters], dtype=float
    )


def as_parameters(given: Sequence[Parameter | str]) -> list[Parameter]:
    """Parameters; a name stands for that patch's tension."""
    if isinstance(given, str | Parameter):
        given = [given]
    made = [Parameter(p) if isinstance(p, str) else p for p in given]
    for p in made:
        if not isinstance(p, Parameter):
            raise OptionError(f"expected a Parameter or the name of a patch, found {p!r}")
    labels = [p.label for p in made]
    for k, label in enumerate(labels):
        if label in labels[:k]:
            raise OptionError(f"the {label} is given twice; keep one")
    return made


def as_targets(given: Sequence[Target]) -> list[Target]:
    """The targets, checked for their type."""
    targets: list[Target] = [given] if isinstance(given, Target) else list(given)
    for t in targets:
        if not isinstance(t, Target):
            raise OptionError(f"expected a Target, found {t!r}")
    return targets


def slopes(
    standing: Surface, found: Measure, parameters: Sequence[Parameter], directions: Floats
) -> Floats:
    """(parameters,) dq/dλ of a measured quantity, given dX/dλ (parameters,n,3)."""
    slope = np.einsum("pnd,nd->p", directions, found.position)
    for k, parameter in enumerate(parameters):
        explicit = found.tension if parameter.kind == "tension" else found.pressure
        if explicit is not None:
            slope[k] += explicit[standing.patch_index(parameter.patch)]
    return slope


def _answers(surface: Surface, parameters: Sequence[Parameter]) -> tuple[Surface, Floats]:
    """The surface with its pinched walls gone, and dX/dλ (parameters,n,3)."""
    for parameter in parameters:
        surface.patch_index(parameter.patch)
    at_rest = _AtRest.of(surface)
    return at_rest.standing, np.stack([at_rest.answer(p) for p in parameters])


@dataclass(frozen=True, eq=False)
class _AtRest:
    """A surface at rest, its linearisation factorised."""

    standing: Surface
    below: Walls
    follows: bool
    space: MotionSpace
    linear: Linearisation
    factor: Factor

    @classmethod
    def of(cls, surface: Surface) -> _AtRest:
        below = walls(surface)
        rests = resting(surface, below)
        standing = pinched(surface, below, rests)
        frame = standing_structure(standing, below, rests)
        X = standing.vertices
        space = motion_space(standing, frame, X)
        gradient = energy_and_gradient(standing, X)[1]
        left = np.linalg.norm(space.pull(gradient))
        if left > TOLERANCE * force_scale(standing, frame, X):
            raise SurfaceError(
                f"sensitivities: the surface is not at rest (relative residual"
                f" {left / force_scale(standing, frame, X):.1e}); solve it first"
            )
        kept = pattern(frame, space)
        try:
            factor = factoriser(kept).factor(assemble(standing, frame, space, kept, X))
        except SingularMatrix:
            raise SurfaceError(AT_FOLD) from None
        follows = bool((below.can_rest & ~rests).any())
        linear = linearise(standing, frame, space, X, gradient)
        return cls(standing, below, follows, space, linear, factor)

    def answer(self, parameter: Parameter) -> Floats:
        """dX/dλ (n,3)."""
        right = -self.space.pull(self._force(parameter))
        if not np.any(right):
            return np.zeros_like(self.standing.vertices)
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

    def _force(self, parameter: Parameter) -> Floats:
        """∂(∇E)/∂λ (n,3)."""
        one, zero = np.zeros((2, len(self.standing.patches)))
        one[self.standing.patch_index(parameter.patch)] = 1.0
        tension, pressure = (one, zero) if parameter.kind == "tension" else (zero, one)
        return kernels.measure(
            self.standing.vertices, self.standing.faces, self.standing.patch_of_face,
            self.standing.origin, tension, pressure,
        )[2]  # fmt: skip

    def _moved(self, s: Floats) -> Floats:
        """B s (n,3) with walls that hang from their crest following it, as they do in the solver."""
        d = self.space.push(s)
        if not self.follows:
            return d
        X = self.standing.vertices
        ahead = hung(self.standing, self.below, X + d, self.space)
        return ahead - hung(self.standing, self.below, X, self.space)
