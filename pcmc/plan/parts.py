"""The parts of a plan: the lines between its patches, its openings, its patches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.errors import OptionError

EDGES = ("fixed", "sliding", "free")
BOTTOMS = ("sliding", "held", "sloped")


@dataclass(frozen=True, eq=False)
class Divider:
    """A line between patches, with the wall that stands under it.

    Only its course in plan counts: the height is the surface's.

    Attributes
    ----------
    curve : a Curve or its plain data; each end on the outline, a hole or another divider. What is
        drawn beyond the outline or across a hole is left out.
    wall : tension of the wall, force/length, ≥ 0; None for no wall. Between areas of different
        pressures the difference acts on it, so that the shape is that of rooms under those pressures.
    name : of the wall's patch; by default "wall 1", "wall 2", … in order. Where the difference of
        pressure changes along the divider, each part is a patch of its own: "wall 1-1", "wall 1-2".
    bottom : "sliding" on Π; "held" on Π in all directions; or "sloped": held in all directions on
        the surface that the boundary curves span (for boundaries that leave Π). A sliding wall
        that ends on a straight edge tends to slip along it to where it is shorter; hold it, or end
        it in re-entrant corners.
    """

    curve: Any
    wall: float | None = 1.0
    name: str = ""
    bottom: str = "sliding"


@dataclass(frozen=True, eq=False)
class Hole:
    """An opening in the plan.

    Attributes
    ----------
    curve : a closed Curve or its plain data.
    edge : "fixed", at the height of its curve; "sliding" on Π; or "free" (see ``Plan.edge``).
    name : used in messages.
    """

    curve: Any
    edge: str = "fixed"
    name: str = ""


@dataclass(frozen=True)
class Area:
    """A patch of the plan.

    Attributes
    ----------
    name : of the patch.
    tension, pressure : α, force/length, and p, force/area.
    at : a point (x, y) inside it, or several points if several parts are to be one patch. If no
        area of a plan has one, they are given to its parts from left to right (by centroid).
    """

    name: str
    tension: float
    pressure: float = 1.0
    at: Any = None

    def __post_init__(self) -> None:
        if self.at is None:
            return
        try:
            points = np.atleast_2d(np.asarray(self.at, dtype=float))
        except (TypeError, ValueError):
            points = np.empty(0)
        if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
            raise OptionError(
                f"patch {self.name!r}: at must be a point [x, y] or a list of points, found {self.at!r}",
                what="at",
                where=self.name,
                found=self.at,
            )
