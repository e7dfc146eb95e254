"""The parts of a plan: dividers between patches, holes, patches; made from plain data and checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from ..base import validate
from ..base.errors import OptionError, unknown
from ..surface import Plane
from .curves import Curve, curve

EDGES = ("fixed", "sliding", "free")
BOTTOMS = ("sliding", "held", "sloped")
BALANCED = "balanced"  # in place of a wall's tension: chosen from those of its neighbours


@dataclass(frozen=True, eq=False)
class Divider:
    """A line between patches, with a wall below it.

    Only its course in plan counts: the height is that of the surface.

    Attributes
    ----------
    curve : the line. Each end is on the outline, a hole or another divider; parts outside the outline
        or inside a hole are left out.
    wall : tension of the wall, force/length, ≥ 0; "balanced", chosen so that the junction balances with room
        to spare: the difference of the neighbours' tensions and 0.3 of the smaller one, less where the wall
        runs into a corner; None for no wall. Between patches of different pressures the wall takes the
        difference.
    name : of the wall's patch; by default "wall 1", "wall 2", … in order. Where the difference of
        pressure changes along the divider, each part is a patch of its own: "wall 1-1", "wall 1-2".
    bottom : "held" on Π in all directions; "sliding" on Π; or "sloped": held in all directions on the
        surface that the boundary curves span (for boundaries that leave Π). A junction over a sliding
        bottom is held at its ends by the mesh alone: on finer meshes it slips, or the shape is a saddle.
    upright : whether a vertical plane holds the wall and the junction on it, in which they slide; the line
        must be straight. The plane takes the pull across it.
    """

    curve: Any
    wall: float | str | None = BALANCED
    name: str = ""
    bottom: str = "held"
    upright: bool = False


@dataclass(frozen=True, eq=False)
class Hole:
    """An opening in the plan.

    Attributes
    ----------
    curve : its closed edge.
    edge : the support of the edge: "fixed" at the height of the curve, "sliding" on Π, or "free".
    name : for messages.
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
    tension : α, force/length.
    pressure : p, force/area.
    at : a point [x, y] inside the patch, or a point in each of its parts. If no patch has one, the
        patches are given to the parts from left to right (by centroid).
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
            validate.refuse("at", self.at, "a point [x, y] or a list of points", self.name)


def curve_of(spec: Any, what: str, closed: bool = False) -> Curve:
    """A Curve from plain data; ``what`` names it in errors."""
    try:
        return curve(spec, closed=closed)
    except OptionError as error:
        raise OptionError(
            f"{what}: {error}", what=what, where=error.where, found=error.found, expected=error.expected
        ) from None


def divider_of(spec: Any, number: int) -> Divider:
    """A Divider from a mapping of its attributes or a curve; ``number`` counts from 1."""
    what = f"divider {number}"
    part = _part_of(Divider, spec, what)
    validate.choice(f"bottom of {what}", part.bottom, BOTTOMS)
    if isinstance(part.wall, str):
        validate.choice(f"wall of {what}", part.wall, (BALANCED,))
    if not isinstance(part.upright, bool):
        validate.refuse("upright", part.upright, "True or False", what)
    return replace(part, curve=curve_of(part.curve, what), name=part.name or f"wall {number}")


def hole_of(spec: Any, number: int) -> Hole:
    """A Hole from a mapping of its attributes or a curve; ``number`` counts from 1."""
    what = f"hole {number}"
    part = _part_of(Hole, spec, what)
    validate.choice(f"edge of {what}", part.edge, EDGES)
    name = f"hole {part.name!r}" if part.name else what
    return Hole(curve_of(part.curve, what, closed=True), part.edge, name)


def _part_of(kind: Any, spec: Any, what: str) -> Any:
    if isinstance(spec, Mapping) and "curve" in spec:
        check_keys(spec, kind, what)
        return kind(**spec)
    return spec if isinstance(spec, kind) else kind(spec)


def areas_of(spec: Any) -> tuple[Area, ...]:
    """Areas from a mapping from names to their attributes, or from a sequence of Areas."""
    if not isinstance(spec, Mapping):
        return tuple(spec)
    areas = []
    for name, values in spec.items():
        check_keys(values, Area, f"patch {name!r}")
        if "tension" not in values:
            raise OptionError(f"patch {name!r} needs a tension", what="tension", where=name)
        areas.append(Area(name, **values))
    return tuple(areas)


def support_of(spec: Any, number: int) -> Any:
    """A point (2,) or (3,), or a Curve; ``number`` counts from 1."""
    if isinstance(spec, Sequence | np.ndarray) and len(spec) in (2, 3) and np.ndim(spec) == 1:
        point = np.array(spec, dtype=float)
        if not np.isfinite(point).all():
            raise OptionError(f"support {number}: {point.tolist()} is not finite", what=f"support {number}")
        return point
    return curve_of(spec, f"support {number}")


def check_keys(values: Any, kind: Any, what: str) -> None:
    """Refuse a mapping with a key that is no attribute of the class ``kind``."""
    if not isinstance(values, Mapping):
        raise OptionError(f"{what}: expected a table, found {values!r}", what=what, found=values)
    known = tuple(f.name for f in fields(kind))
    for key in values:
        if key not in known:
            raise OptionError(unknown(f"{what} key", key, known), what=what, where=key, expected=known)


@dataclass(frozen=True, eq=False)
class PlanData:
    """The values of a plan; ``Plan`` explains and checks them."""

    outline: Any
    dividers: Sequence[Any] = ()
    holes: Sequence[Any] = ()
    patches: Any = ()
    edge_length: float = 1.0
    edge: str = "fixed"
    supports: Sequence[Any] = ()
    plane: Plane = field(default_factory=Plane)
    rise: float | None = None
    tension: float | None = None
