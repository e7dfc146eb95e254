"""Lines and points of a plan, shifted as they are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..base.arrays import Floats
from ..base.errors import OptionError, unknown
from ..plan import Curve, Divider, Hole, Plan
from ..surface import Plane

AXES = ("x", "y", "z")


def shifted(plan: Plan, shifts: Mapping[str, Mapping[str, float]]) -> Plan:
    """The plan with dividers, holes, supports and points moved by lengths along x, y and z.

    >>> plan = Plan([[0, 0], [8, 0], [8, 4], [0, 4]], [[[4, 0], [4, 4]]], edge_length=1.0, tension=2.0)
    >>> shifted(plan, {"wall 1": {"x": 1.0}}).dividers[0].curve.at(0.0).tolist()
    [[5.0, 0.0]]
    """
    movable, changed = list(_movable(plan)), dict[str, Any]()
    for name, by in shifts.items():
        found = [(field, key) for field, key, names in movable if name in names]
        what = f"{name}.{next(iter(by))}"
        if not found:
            known = (f"{names[0]}.{axis}" for _, _, names in movable for axis in by)
            raise OptionError(unknown("number", what, known), what=what)
        if len(found) > 1:
            several = " or ".join(f"{field[:-1]} {what}" for field, _ in found)
            raise OptionError(f"{name} is the name of several lines; type {several}", what=what)
        field, key = found[0]
        given = getattr(plan, field)
        parts = changed.setdefault(field, dict(given) if isinstance(given, Mapping) else list(given))
        try:
            parts[key] = _moved(parts[key], [by.get(axis, 0.0) for axis in AXES], plan.plane)
        except OptionError as error:
            raise OptionError(f"{what}: {error}", what=what) from None
    return replace(plan, **changed)


def _movable(plan: Plan) -> Iterator[tuple[str, Any, tuple[str, ...]]]:
    """The field of the plan, key or index in it, and names of each line and point that can be shifted."""
    for name in plan.points:
        yield "points", name, (name, f"point {name}")
    for k, divider in enumerate(plan.dividers):
        yield "dividers", k, (divider.name, f"divider {divider.name}", f"divider {k + 1}")
    for k, hole in enumerate(plan.holes):
        name = hole.name.removeprefix("hole ").strip("'\"")
        yield "holes", k, (name, f"hole {name}", f"hole {k + 1}")
    for k in range(len(plan.supports)):
        yield "supports", k, (f"support {k + 1}",)


def _moved(part: Any, by: Sequence[float], plane: Plane) -> Any:
    """A divider, hole, curve or point at another place."""
    if by[2] and isinstance(part, Divider | tuple):
        raise OptionError("only its place in plan counts; shift it along x or y", what="z")
    if isinstance(part, Divider | Hole):
        return replace(part, curve=_moved(part.curve, by, plane))
    if not isinstance(part, Curve):
        return _added(np.array([part]), np.ones(1), by, plane)[0].tolist()
    of_arc = np.array([1.0, 0.0, 0.0])  # the centre; what follows are vectors from it
    pieces = (
        replace(p, points=_added(p.points, of_arc if p.sweep else np.ones(len(p.points)), by, plane))
        for p in part.pieces
    )
    return replace(part, pieces=tuple(pieces))


def _added(points: Floats, share: Floats, by: Sequence[float], plane: Plane) -> Floats:
    """Points (k,2) or (k,3) moved by a share (k,) of a vector; those on Π rise above it."""
    if by[2] and points.shape[1] == 2:
        if plane != Plane():
            raise OptionError("give it three coordinates, as the plane is not z = 0", what="z")
        points = np.pad(points, ((0, 0), (0, 1)))
    return points + share[:, None] * np.array(by[: points.shape[1]])
