"""Moving held curves apart, from near each other to where they are, with the film between them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from ..base.arrays import Bools, Floats
from ..certificate.neck import held_groups
from ..certificate.proof import Attempt
from ..continuation import BoundaryMotion
from ..surface import Surface
from .attempts import Attempts
from .folding import Arrival, Further, way
from .starts import low_start

SHARES = (0.5, 0.25, 0.1, 0.03)  # of the distance, at which to begin
FLAT = 1e-6  # of the size: curves whose middles are nearer to each other are not moved
STEPS = 80
SMALLEST = 1e-4


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

        None without two curves to be moved apart, or where the end of a junction or cable slides along one.
        The other vertices that slide so are held meanwhile, which changes no shape.
        """
        for _, along in surface.on_line:
            if (along & surface.topology.on_junction).any() or along[surface.cable_edges.ends].any():
                return None
        if surface.on_line and not surface.on_planes:
            surface = surface.rebuilt(fixed=surface.fixed, on_line=())
        groups, lengths = held_groups(surface)
        fixed = np.isfinite(lengths)
        X, plane = surface.vertices, surface.plane
        held = (groups >= 0) & surface.fixed
        if len(lengths) < 2 or not fixed.any() or (surface.fixed & ~held).any() or surface.on_planes:
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

    def boundary(self, share: float) -> Floats:
        """(k,3) the fixed vertices with their curves at a share of the distance."""
        X = self.surface.vertices + ((share - 1.0) * self.along)[:, None] * self.line
        return X[self.held]

    def at(self, share: float, shape: Floats) -> Surface:
        """The surface at a share of the distance; its free vertices are those of a shape (n,3), nearer."""
        X = shape + ((share - 1.0) * ((shape - self.middle) @ self.line))[:, None] * self.line
        X[self.held] = self.boundary(share)
        return self.surface.moved(X)


def move_apart(surface: Surface, attempts: Attempts) -> Further:
    """Follow the film as the distance between the held curves grows to that of the surface.

    The branch begins at the largest of a few distances at which a minimum is found, from the given shape or
    a low start, both pressed together.
    """
    spread = Spread.of(surface)
    if spread is None:
        return Further()
    shapes = [start.vertices for start in (surface, low_start(surface)) if start is not None]
    for begin, shape in product(SHARES, shapes):
        result = attempts.solve(spread.at(begin, shape), levels=0, target="minimum")
        if result.converged:
            break
    else:
        return Further(attempt=Attempt("distance", "no start"))
    motion = BoundaryMotion(spread.boundary, start=begin)
    branch = attempts.follow(result.surface, motion, 1.0, steps=STEPS, smallest=SMALLEST)
    if branch is None:
        return Further(attempt=Attempt("distance", "no start"))
    end = way(branch)
    if end.arrival is Arrival.REACHED:
        X = branch.last.vertices.copy()
        X[spread.held] = surface.vertices[spread.held]
        return Further(surface.moved(X), "by moving the held curves apart", "distance")
    return Further(attempt=Attempt("distance", end.arrival.name.lower(), end.farthest, begin))
