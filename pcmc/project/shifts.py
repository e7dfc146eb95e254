"""Lines and points of a plan, shifted as they are."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
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
    labels: dict[tuple[str, Any], str] = {("points", name): f"point {name}" for name in plan.points}
    labels |= {("dividers", k): f"divider {part.name}" for k, part in enumerate(plan.dividers)}
    labels |= {("holes", k): re.sub("['\"]", "", part.name) for k, part in enumerate(plan.holes)}
    labels |= {("supports", k): f"support {k + 1}" for k in range(len(plan.supports))}
    changed: dict[str, Any] = {}
    for name, by in shifts.items():
        found = [at for at, label in labels.items() if name in (label, label.partition(" ")[2])]
        axis = next(iter(by))
        if len(found) != 1:
            several = " or ".join(f"{labels[at]}.{axis}" for at in found)
            lost = unknown("number", f"{name}.{axis}", (f"{label}.{axis}" for label in labels.values()))
            text = f"{name} is the name of several lines; type {several}" if found else lost
            raise OptionError(text, what=f"{name}.{axis}")
        field, key = found[0]
        given = getattr(plan, field)
        parts = changed.setdefault(field, dict(given) if isinstance(given, Mapping) else list(given))
        try:
            parts[key] = _moved(parts[key], [by.get(axis, 0.0) for axis in AXES], plan.plane)
        except OptionError as error:
            raise OptionError(f"{name}: {error}", what=f"{name}.{axis}") from None
    return replace(plan, **changed)


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
