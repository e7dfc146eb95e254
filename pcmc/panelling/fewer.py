"""Fewer families of panels: vertices slide along the shape until more triangles are congruent.

Where a vertex lies within its sheet, or a junction's along its curve, is free: the shape is the same. A round
joins families within a wider tolerance and moves the vertices so that the panels' edges come near the middle
of their family's. It ends with a solve, so that forces balance on the moved mesh too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from ..base import validate
from ..base.arrays import Floats, Ints, block_rows
from ..forces.motion_space import motion_space, perpendicular
from ..forces.pinching import place_wall_rows, standing_part
from ..meshing.quality import turns_over, worst_quality
from ..solvers import solve_once
from ..solvers.result import unless_stopped
from ..surface import Surface
from ..surface.distance import distances
from ..surface.geometry import edge_vectors
from ..surface.supports import onto_circles
from .families import triangle_families
from .schedule import Panels, panels

WIDER = (1.25, 1.12, 1.6, 2.2)  # times the tolerance: families within it are joined
INSIDE = (0.3, 0.45)  # tolerances from the middle of its family that an edge may keep
STEPS = 6  # of Gauss-Newton in a round
DAMPING = 1e-3  # of motions along the shape; edges' equations have weight 1
STIFF = 1.0  # damping of motions that change the shape
QUALITY = 0.6  # of the worst triangle's quality that is kept
SHORTEST = 0.05  # part of a step that is tried

OnRound = Callable[[int, int], object]  # called with the round and the number of families


@dataclass(frozen=True, eq=False)
class FewerFamilies:
    """The panels of a surface before and after its vertices moved. ``print`` compares them."""

    before: Panels
    after: Panels
    change: float  # the largest distance of a panel's corner from the shape before, length
    moved: float  # the largest motion of a panel's corner, along the shape for the most part, length
    rounds: int  # how many were made
    steps: pd.DataFrame  # the ``families`` and ``change`` that no other had both fewer and less of

    @property
    def surface(self) -> Surface:
        """The surface after."""
        return self.after.surface

    def costs(self, family: float, panel: float = 0.0) -> pd.DataFrame:
        """The ``steps`` with their ``cost``, from that of a family, as of its mould, and of a panel.

        ``cheapest`` is True in one row. With the ``change`` of a row as its limit the search keeps to it.

        >>> from generators import two_squares
        >>> from pcmc.solvers import solve
        >>> fewer = fewer_families(solve(two_squares(4, alpha_aux=1.0)).surface, 0.02, change=0.05)
        >>> table = fewer.costs(100.0, 20.0)
        >>> bool((table["cost"] == 100 * table["families"] + 20 * len(fewer.after.panels)).all())
        True
        """
        family, panel = (validate.number(*one, least=0.0) for one in (("family", family), ("panel", panel)))
        cost = family * self.steps["families"] + panel * len(self.after.panels)
        return self.steps.assign(cost=cost, cheapest=cost.index == cost.idxmin())

    def __str__(self) -> str:
        columns = [("", "families", "at least", "residual", "curvature error", "triangle quality", "verdict")]
        for name, one in (("before", self.before), ("after", self.after)):
            c, counts = one.certificate, (str(one.count), str(one.at_least))
            numbers = f"{c.residual:.1e}", f"{c.curvature_error:.1e}", f"{c.quality:.3f}"
            columns.append((name, *counts, *numbers, c.verdict.name.lower()))
        rows = zip(*columns, strict=True)
        table = "\n".join(f"{name:>16}  {one:>13}  {other:>13}" for name, one, other in rows)
        return f"{table}\nchange of shape {self.change:.3g}, vertices moved up to {self.moved:.3g}"


def fewer_families(
    surface: Surface,
    tolerance: float,
    change: float,
    *,
    at_rest: bool = True,
    rounds: int = 24,
    callback: OnRound | None = None,
    mirror_images: str = "alike",
    walls: bool = False,
    anyway: bool = False,
) -> FewerFamilies:
    """Move the vertices of a surface so that its panels are of fewer families.

    Parameters
    ----------
    surface, tolerance, mirror_images, walls, anyway : as in ``panels``, with its errors.
    change : the most that a panel's corner may leave the shape before, length, > 0. Sliding along a curved
        shape takes a little of it: the shape before has flat triangles.
    at_rest : whether each round ends with a solve. The result is then as certified as the surface was.
        Without it, vertices also move across the shape: there are fewer families, and the certificate
        shows the forces and curvature errors left.
    rounds : the most that are made. It ends earlier where no way to join families helps.
    callback : called after each round with its number and the number of families so far.

    >>> from generators import two_squares
    >>> from pcmc.solvers import solve_once
    >>> result = fewer_families(solve_once(two_squares(4, alpha_aux=1.0)).surface, 0.02, change=0.05)
    >>> result.before.count > result.after.count, result.after.certificate.certified
    (True, True)
    """
    change = validate.positive("change", change)
    validate.flag("at_rest", at_rest)
    validate.integer("rounds", rounds, least=1)
    validate.callback("callback", callback, "a function of two numbers")
    options: dict[str, Any] = {"mirror_images": mirror_images, "walls": walls}
    before = after = panels(surface, tolerance, anyway=anyway, **options)
    search = _Search(before, change, at_rest)
    made = search.run(rounds, callback)
    if search.best is not surface:
        after = panels(search.best, tolerance, anyway=True, **options)
    moved = np.linalg.norm(after.surface.vertices - surface.vertices, axis=1)[search.corners].max()
    steps = pd.DataFrame(search.steps, columns=["families", "change"])
    least = steps["change"].iloc[::-1].cummin().iloc[::-1].shift(-1, fill_value=np.inf)  # with fewer families
    steps = steps[steps["change"] < least].reset_index(drop=True)
    return FewerFamilies(before, after, search.leaves(after.surface.vertices), float(moved), made, steps)


class _Search:
    """The best surface so far, and what a round needs."""

    def __init__(self, before: Panels, change: float, at_rest: bool) -> None:
        self.start = self.best = before.surface
        self.faces: Ints = self.start.faces[before.panels["face"].to_numpy()]
        self.corners = np.unique(self.faces)
        self.tolerance, self.change, self.at_rest = before.tolerance, change, at_rest
        self.apart = before.mirror_images == "apart"
        self.count = before.count
        self.steps = [(before.count, 0.0)]
        self.certified = before.certificate.certified
        self.quality = QUALITY * worst_quality(self.start.vertices, self.faces)

    def run(self, rounds: int, callback: OnRound | None) -> int:
        """Try the settings in turn; keep to one as long as it helps. Returns the rounds made."""
        settings = list(product(WIDER, INSIDE))
        current = misses = made = 0
        while made < rounds and misses < len(settings):
            surface, made, count = self._round(*settings[current]), made + 1, self.count
            if surface is not None:
                lengths = self._lengths(surface.vertices)
                count = int(triangle_families(lengths, self.tolerance, self.apart).family.max()) + 1
            if surface is not None and count < self.count:
                self.best, self.count, misses = surface, count, 0
                self.steps.append((count, self.leaves(surface.vertices)))
            else:
                current, misses = (current + 1) % len(settings), misses + 1
            if callback is not None:
                callback(made, self.count)
        return made

    def leaves(self, X: Floats) -> float:
        """The largest distance of a panel's corner from the shape before."""
        return float(distances(X[self.corners], self.start.vertices, self.faces).max())

    def _lengths(self, X: Floats) -> Floats:
        return np.asarray(np.linalg.norm(edge_vectors(X[self.faces]), axis=2))

    def _round(self, wider: float, inside: float) -> Surface | None:
        """The best surface, its edges moved towards the middle of the range that those of the family have,
        in families within a wider tolerance; None where that fails."""
        X = self.best.vertices
        lengths = self._lengths(X)
        family, order, _ = triangle_families(lengths, wider * self.tolerance, self.apart)
        aligned = np.take_along_axis(lengths, order, axis=1)
        low, high = np.full((2, family.max() + 1, 3), np.inf)
        np.minimum.at(low, family, aligned)
        np.minimum.at(high, family, -aligned)
        targets = np.empty_like(lengths)
        np.put_along_axis(targets, order, 0.5 * (low - high)[family], axis=1)
        for _ in range(STEPS):
            moved = self._step(X, targets, inside * self.tolerance)
            if moved is None:
                break
            X = moved
        if X is self.best.vertices:
            return None
        surface = self.best.moved(X)
        if self.at_rest:
            result = unless_stopped(solve_once(surface, target="stationary"))
            if not result.converged or result.certificate.certified is not self.certified:
                return None
            surface = result.surface
        return surface if self.leaves(surface.vertices) <= self.change else None

    def _step(self, X: Floats, targets: Floats, inside: float) -> Floats | None:
        """A damped Gauss-Newton step on the edges farther than ``inside`` from their targets, or None. It is
        shortened until no triangle turns over or is much worse, and no corner leaves the shape."""
        edges = edge_vectors(X[self.faces])
        lengths = np.linalg.norm(edges, axis=2)
        off = lengths - targets
        excess = off - np.clip(off, -inside, inside)
        face, side = np.nonzero(excess)
        if not len(face):
            return None
        part = standing_part(self.best)
        space = motion_space(part.surface, part.classes, X)
        # the directions (n,3,3) in which each vertex may move, rows, zero for none; their damping (n,3)
        basis, dimension = space.basis, space.dimension
        free = self.start.free & ~(part.resting | part.walls.held)
        frame, damping = np.zeros_like(basis), np.full((*dimension.shape, 3), STIFF)
        sheet, curve = free & (dimension == 1), free & (dimension == 2)
        frame[sheet, 0], frame[sheet, 1] = perpendicular(basis[sheet, 0])
        frame[curve, 0] = np.cross(basis[curve, 0], basis[curve, 1])
        damping[sheet, :2] = damping[curve, :1] = DAMPING
        if not self.at_rest:
            frame[sheet, 2] = basis[sheet, 0]
            frame[curve, 1:] = basis[curve, :2]
        unit = edges[face, side] / lengths[face, side][:, None]
        ends = self.faces[face[:, None], (side[:, None] + [2, 1]) % 3]  # J: the derivatives of the lengths
        slopes = np.einsum("ej,eakj,a->eak", unit, frame[ends], [1.0, -1.0])
        J = block_rows(slopes[:, :, None], ends, len(frame))
        system = csc_array(J.T @ J + diags_array(damping.ravel()))
        move = -splu(system, permc_spec="MMD_AT_PLUS_A").solve(J.T @ excess[face, side])
        motion = np.einsum("vk,vkj->vj", move.reshape(-1, 3), frame)
        share = 1.0
        while share >= SHORTEST:
            slid = onto_circles(self.best, X + share * motion)
            Y = place_wall_rows(self.best, part.walls, slid, space)
            turned, worst = turns_over(X, Y, self.faces), worst_quality(Y, self.faces)
            if not turned and worst >= self.quality and (self.at_rest or self.leaves(Y) <= self.change):
                return Y
            share *= 0.5
        return None
