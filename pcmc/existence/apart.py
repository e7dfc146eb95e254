"""Moving held curves apart, from near each other to where they are, with the film between them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from ..base.arrays import Bools, Floats
from ..certificate.neck import held_groups
from ..certificate.proof import Fold
from ..stability.factorisation import SingularMatrix
from ..stability.modes import lowest, second_variation
from ..surface import Surface
from .attempts import Attempts
from .starts import low_start

SHARES = (0.5, 0.25, 0.1, 0.03)  # of the distance, at which to begin
CLOSE = 6e-3  # relative distance between the last equilibrium and the first failure that ends the search
STEPS = 40
SOFTENED = 0.25  # of its eigenvalue at the start: the last equilibrium's, if a fold follows
FLAT = 1e-6  # of the size: curves whose middles are nearer to each other are not moved
AGREE = 0.02  # relative difference of the fold extrapolated from the eigenvalues, and of the last equilibrium


@dataclass(frozen=True, eq=False)
class Apart:
    """What moving the curves apart has shown: a surface at the full distance, or a fold on the way."""

    surface: Surface | None = None
    fold: Fold | None = None


@dataclass(frozen=True, eq=False)
class Spread:
    """A surface whose held curves can be moved along one line, the distances between them in proportion.

    Attributes
    ----------
    surface : at the full distance.
    line : (3,) unit vector along which the middles of the curves lie most apart.
    middle : (3,) a point that stays. along : (n,) how far each held vertex's curve is from it.
    held : (n,) the vertices that move with their curves.
    """

    surface: Surface
    line: Floats
    middle: Floats
    along: Floats
    held: Bools

    @classmethod
    def of(cls, surface: Surface) -> Spread | None:
        """The line through the middles of the fixed curves; that across Π where the surface slides there.

        None without two curves to be moved apart.
        """
        groups, lengths = held_groups(surface)
        fixed = np.isfinite(lengths)
        X, plane = surface.vertices, surface.plane
        held = (groups >= 0) & surface.fixed
        if len(lengths) < 2 or not fixed.any() or (surface.fixed & ~held).any():
            return None
        centres = np.array([X[groups == number].mean(axis=0) for number in range(len(lengths))])
        if surface.on_plane.any():
            line, middle = np.array(plane.normal), np.array(plane.point)
            apart = np.where(fixed, (centres - middle) @ line, 0.0)
        else:
            middle = centres.mean(axis=0)
            line = np.linalg.svd(centres - middle)[2][0]
            apart = (centres - middle) @ line
        if np.ptp(apart) < FLAT * surface.size:
            return None
        return cls(surface, line, middle, np.where(held, apart[groups], 0.0), held)

    def at(self, share: float, shape: Floats, of: float) -> Surface:
        """The surface at a share of the distance, its free vertices from a shape (n,3) at another share."""
        X = shape.copy()
        free = ~self.held
        X[free] += ((share / of - 1.0) * ((X[free] - self.middle) @ self.line))[:, None] * self.line
        given = self.surface.vertices[self.held]
        X[self.held] = given + ((share - 1.0) * self.along[self.held])[:, None] * self.line
        return self.surface.moved(X)


def move_apart(surface: Surface, attempts: Attempts) -> Apart:
    """Follow the film's minimum as the distance between the held curves grows to that of the surface.

    The lowest eigenvalue λ of a film falls to zero at a fold, as the square root of the distance that is
    left: λ² is linear there. Where films end, a fold is claimed if λ has fallen and if the line through
    its last squares meets zero near the end.
    """
    spread = Spread.of(surface)
    if spread is None:
        return Apart()
    shapes = [start.vertices for start in (surface, low_start(surface)) if start is not None]
    for begin, shape in product(SHARES, shapes):
        result = attempts.solve(spread.at(begin, shape, 1.0), levels=0, target="minimum")
        if result.converged:
            break
    else:
        return Apart()
    here, film, failed, step = begin, result.surface, np.inf, 0.5 * begin
    known = [(here, _softest(film))]
    for _ in range(STEPS):
        ahead = min(1.0, here + step) if failed == np.inf else 0.5 * (here + failed)
        result = attempts.solve(spread.at(ahead, film.vertices, here), levels=0, target="minimum")
        if result.converged:
            here, film = ahead, result.surface
            known.append((here, _softest(film)))
            if here == 1.0:
                return Apart(surface=film)
        else:
            failed = ahead
        if failed - here <= CLOSE * here:
            return Apart(fold=_fold(known, failed, begin))
    return Apart()


def _softest(surface: Surface) -> float:
    """The lowest eigenvalue of a film, force/length³; NaN if it cannot be computed."""
    try:
        return float(lowest(second_variation(surface), 1)[0][0])
    except SingularMatrix:
        return np.nan


def _fold(known: list[tuple[float, float]], failed: float, begin: float) -> Fold | None:
    """The fold between the last equilibrium and the first failure, if the eigenvalues lead there."""
    shares, values = np.array(known).T
    if len(shares) < 3 or not 0.0 <= values[-1] < SOFTENED * values[0]:
        return None
    (x0, x1), (y0, y1) = shares[-2:], values[-2:] ** 2
    at = x1 + y1 * (x1 - x0) / (y0 - y1) if y0 > y1 else np.inf
    if abs(at - shares[-1]) > AGREE * shares[-1]:
        return None
    return Fold("distance", float(np.clip(at, shares[-1], failed)), begin)
