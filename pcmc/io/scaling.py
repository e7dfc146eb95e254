"""The same surface in another unit of length: coordinates, and all that is per length, area or volume.

With the factor f, lengths become f times as large, tensions (force/length) 1/f, pressures, weights and snow
(force/length²) 1/f², volumes f³. Forces stay, so the shape at rest stays the same.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from ..base.units import Units, conversion_note, length_factor
from ..surface import Circle, HeldCurve, Line, Patch, Plane, Room, Surface
from .mesh_data import MeshData


def scaled(value: Any, factor: float) -> Any:
    """A part of a surface, or a tuple of parts, in a unit of which ``factor`` make one of the old unit.

    >>> scaled(Patch("roof", tension=2.0, pressure=3.0), 10.0)
    Patch(name='roof', tension=0.2, pressure=0.03)
    """
    match value:
        case tuple():
            return tuple(scaled(part, factor) for part in value)
        case Patch():
            per_area = {key: getattr(value, key) / factor**2 for key in ("pressure", "weight", "snow")}
            return replace(value, tension=value.tension / factor, **per_area)
        case Plane() | Line():
            return replace(value, point=_point(value.point, factor))
        case Circle():
            return replace(value, centre=_point(value.centre, factor), radius=factor * value.radius)
        case HeldCurve():
            return value.mapped(factor * np.eye(3), np.zeros(3))
        case Room():
            return replace(value, volume=factor**3 * value.volume)
    return value


def scaled_surface(surface: Surface, factor: float) -> Surface:
    """The surface in a unit of which ``factor`` make one of the old unit."""
    if factor == 1.0:
        return surface
    parts = {f.name: scaled(getattr(surface, f.name), factor) for f in fields(surface) if f.init}
    supports = {name: scaled(part, factor) for name, part in surface.given_supports._asdict().items()}
    moved = {"vertices": factor * surface.vertices, "curves": scaled(surface.held_curves, factor)}
    return Surface(**parts | supports | moved)


def stated(data: MeshData, length: str) -> MeshData:
    """A file's data, taken to be in this unit of length if the file names none."""
    return data if data.units else replace(data, units=Units(length, data.units.force))


def converted(data: MeshData, length: str) -> MeshData:
    """A file's data in another unit of length, if any is given, with a note if that changes them.

    Tensions and pressures change only where the file has them; scalars stay.
    """
    factor = length_factor(data.units.length, length)
    if factor == 1.0:
        return data
    parts = {f.name: scaled(getattr(data, f.name), factor) for f in fields(data)}
    parts["patches"] = tuple(p if p.name in data.bare else scaled(p, factor) for p in data.patches)
    parts["vertices"] = factor * np.asarray(data.vertices, dtype=np.float64)
    parts["units"] = Units(length, data.units.force)
    parts["notes"] = (*data.notes, conversion_note(data.units.length, length))
    return replace(data, **parts)


def _point(point: tuple[float, float, float], factor: float) -> tuple[float, float, float]:
    x, y, z = point
    return factor * x, factor * y, factor * z
