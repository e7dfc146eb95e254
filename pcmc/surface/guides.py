"""Planes, lines and circles: what vertices slide on."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar, TypeVar

import numpy as np
import numpy.typing as npt

from ..base import validate
from ..base.arrays import Floats, Vector, cached_array
from ..base.errors import SurfaceError
from ..base.tolerances import PARALLEL
from ..base.validate import checked_name

Placed = TypeVar("Placed", bound="_Placed")


@dataclass(frozen=True)
class _Placed:
    """A point and a unit vector, in the two fields that ``KEYS`` names."""

    KEYS: ClassVar[tuple[str, str]]
    distance: ClassVar[Any]

    def __post_init__(self) -> None:
        for key in self.KEYS:
            vector = validate.triple(f"{type(self).__name__}.{key}", getattr(self, key), error=SurfaceError)
            object.__setattr__(self, key, vector)
        key, axis = self.KEYS[1], getattr(self, self.KEYS[1])
        _, exponent = math.frexp(max(map(abs, axis)))
        scaled = [math.ldexp(c, -exponent) for c in axis]  # so that no square is too large or small
        length = math.sqrt(sum(c * c for c in scaled))
        if length == 0.0:
            expected = "a vector of positive length"
            validate.refuse(f"{type(self).__name__}.{key}", axis, expected, error=SurfaceError)
        object.__setattr__(self, key, tuple(c / length for c in scaled))

    @property
    def _origin(self) -> Floats:
        return np.array(getattr(self, self.KEYS[0]))

    @property
    def _axis(self) -> Floats:
        return np.array(getattr(self, self.KEYS[1]))

    def _away(self, points: npt.ArrayLike) -> Floats:
        """From the own point to points (…,3)."""
        return np.asarray(points, dtype=float) - self._origin

    def mapped(self: Placed, R: Floats, t: Floats) -> Placed:
        """Where the isometry x → R x + t takes it."""
        places: tuple[Floats, Floats] = self._origin @ R.T + t, R @ self._axis
        moved: dict[str, Any] = {k: tuple(p.tolist()) for k, p in zip(self.KEYS, places, strict=True)}
        return replace(self, **moved)

    def same_as(self, other: object, near: float) -> bool:
        """Whether the other one is the same set of points, up to the length ``near``."""
        if type(other) is not type(self):
            return False
        parallel = np.linalg.norm(np.cross(self._axis, other._axis)) <= PARALLEL
        return bool(parallel and self._apart(other) <= near)

    def lies_in(self, plane: Plane) -> bool:
        """Whether a line or circle through a point of the plane stays in it."""
        if isinstance(self, Circle):
            return bool(np.linalg.norm(np.cross(self.normal, plane.normal)) <= PARALLEL)
        return bool(abs(np.dot(self._axis, plane.normal)) <= PARALLEL)

    def _apart(self, other: Any) -> float:
        return float(np.abs(self.distance(other._origin)))


@dataclass(frozen=True)
class Plane(_Placed):
    """The plane through ``point`` with unit ``normal`` (normalised on the way in).

    As Π of a surface it also has the point that volumes are measured from, so with the boundary on Π the
    volume is the one enclosed between surface and Π.

    Parameters
    ----------
    point, normal : a point of the plane, and a vector across it of any length > 0.
    name : how messages and tables call the plane.
    mirror : whether the surface goes on behind the plane as its mirror image, instead of ending there.

    >>> Plane(normal=(0, 0, 2)).normal
    (0.0, 0.0, 1.0)
    """

    KEYS = ("point", "normal")
    point: Vector = (0.0, 0.0, 0.0)
    normal: Vector = (0.0, 0.0, 1.0)
    name: str = field(default="", repr=False)
    mirror: bool = field(default=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if max(map(abs, self.point)) > validate.LARGEST:
            limit = f"coordinates up to {validate.LARGEST:g}"
            validate.refuse("Plane.point", self.point, limit, error=SurfaceError)
        name = checked_name("Plane.name", self.name, empty=True, error=SurfaceError)
        object.__setattr__(self, "name", name)
        if not isinstance(self.mirror, bool):
            validate.refuse("Plane.mirror", self.mirror, "True or False", error=SurfaceError)

    def __str__(self) -> str:
        kind = "mirror plane" if self.mirror else "plane"
        if self.name:
            return f"{kind} {self.name!r}"
        point, normal = (", ".join(f"{c + 0.0:.4g}" for c in v) for v in (self.point, self.normal))
        return f"{kind} through ({point}) across ({normal})"

    def __getstate__(self) -> dict[str, object]:
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @cached_array
    def axes(self) -> Floats:
        """(3,3) rows: two unit vectors along the plane and its normal; the identity for z = 0."""
        normal = self._axis
        axis = np.eye(3)[1 if abs(normal[0]) > 0.9 else 0]
        first = axis - (axis @ normal) * normal
        first /= np.linalg.norm(first)
        return np.stack([first, np.cross(normal, first), normal])

    def to_local(self, points: npt.ArrayLike) -> Floats:
        """(…,3) two coordinates on the plane and the height above it, of points (…,3).

        >>> Plane(point=(1, 2, 3)).to_local([1, 3, 5]).tolist()
        [0.0, 1.0, 2.0]
        """
        return self._away(points) @ self.axes.T

    def height(self, points: npt.ArrayLike) -> Floats:
        """(…) signed distance of points (…,3) from the plane, positive along the normal."""
        return self._away(points) @ self._axis

    distance = height

    def oblique_to(self, direction: npt.ArrayLike) -> bool:
        """Whether a direction (3,) is neither along the plane nor square to it: a mirror makes it another.

        >>> [Plane().oblique_to(direction) for direction in ([1, 1, 0], [0, 0, 2], [1, 0, 1])]
        [False, False, True]
        """
        along = np.asarray(direction, dtype=float)
        square = along @ self._axis
        both = np.linalg.norm(along - square * self._axis), abs(square)
        return bool(min(both) > 1e-6 * np.linalg.norm(along))

    def nearest(self, points: npt.ArrayLike) -> Floats:
        """(…,3) the points of the plane nearest to points (…,3).

        >>> Plane(point=(0, 0, 1)).nearest([2, 3, 5]).tolist()
        [2.0, 3.0, 1.0]
        """
        return np.asarray(points, dtype=float) - self.height(points)[..., None] * self._axis

    def along(self, vectors: Floats, points: Floats | None = None) -> Floats:
        """(…,3) the components of vectors (…,3) parallel to the plane: v - ⟨v, n⟩ n, Eq. (19)."""
        return np.asarray(vectors - (vectors @ self._axis)[..., None] * self._axis)

    def same_as(self, other: object, near: float) -> bool:
        """Whether the other one is the same plane up to ``near``, and a mirror or not as this one is."""
        return super().same_as(other, near) and self.mirror == getattr(other, "mirror", None)


@dataclass(frozen=True)
class Line(_Placed):
    """The straight line through ``point`` along the unit vector ``direction`` (normalised on the way in).

    >>> Line((0, 0, 1), (0, 3, 0)).direction
    (0.0, 1.0, 0.0)
    """

    KEYS = ("point", "direction")
    point: Vector
    direction: Vector

    def place(self, points: npt.ArrayLike) -> Floats:
        """(…) how far along the line points (…,3) are, length."""
        return self._away(points) @ self._axis

    def nearest(self, points: npt.ArrayLike) -> Floats:
        """(…,3) the points of the line nearest to points (…,3).

        >>> Line((1, 0, 0), (1, 0, 0)).nearest([3, 4, 0]).tolist()
        [3.0, 0.0, 0.0]
        """
        return np.asarray(self._origin + self.along(self._away(points)))

    def distance(self, points: npt.ArrayLike) -> Floats:
        """(…) the distance of points (…,3) from the line.

        >>> Line((1, 0, 0), (1, 0, 0)).distance([3, 4, 0]).item()
        4.0
        """
        away = np.asarray(points, dtype=float) - self.nearest(points)
        return np.asarray(np.linalg.norm(away, axis=-1))

    def directions(self, points: Floats) -> Floats:
        """(…,3) the unit tangents at points (…,3), all the same."""
        return np.broadcast_to(self._axis, points.shape)

    def along(self, vectors: Floats, points: Floats | None = None) -> Floats:
        """(…,3) the components of vectors (…,3) along the line, the same at all points: ⟨v, t⟩ t."""
        return np.asarray((vectors @ self._axis)[..., None] * self._axis)


@dataclass(frozen=True)
class Circle(_Placed):
    """The circle around ``centre`` in the plane across the unit ``normal`` (normalised on the way in).

    Its tangent at the point x is t = n × (x - c) / |n × (x - c)|: counter-clockwise seen from the side that
    the normal n points to.

    >>> Circle((0, 0, 1), (0, 0, 2), 3).normal
    (0.0, 0.0, 1.0)
    """

    KEYS = ("centre", "normal")
    centre: Vector
    normal: Vector
    radius: float

    def __post_init__(self) -> None:
        super().__post_init__()
        radius = validate.number("Circle.radius", self.radius, above=0.0, error=SurfaceError)
        object.__setattr__(self, "radius", radius)

    def nearest(self, points: npt.ArrayLike) -> Floats:
        """(…,3) the points of the circle nearest to points (…,3); NaN for its centre.

        >>> Circle((0, 0, 1), (0, 0, 1), 2).nearest([5, 0, 3]).tolist()
        [2.0, 0.0, 1.0]
        """
        outward = self._across(self._away(points))
        length = np.linalg.norm(outward, axis=-1, keepdims=True)
        with np.errstate(invalid="ignore"):
            return np.asarray(self._origin + self.radius * (outward / length))

    def distance(self, points: npt.ArrayLike) -> Floats:
        """(…) the distance of points (…,3) from the circle.

        >>> Circle((0, 0, 0), (0, 0, 1), 2).distance([5, 0, 4]).item()
        5.0
        """
        away = self._away(points)
        outward = np.linalg.norm(self._across(away), axis=-1) - self.radius
        return np.asarray(np.hypot(outward, away @ self._axis))

    def directions(self, points: Floats) -> Floats:
        """(…,3) the unit tangents t at points (…,3)."""
        tangent = np.cross(self._axis, self._away(points))
        return np.asarray(tangent / np.linalg.norm(tangent, axis=-1, keepdims=True))

    def along(self, vectors: Floats, points: Floats) -> Floats:
        """(…,3) the components of vectors (…,3) along the circle at points (…,3): ⟨v, t⟩ t."""
        tangent = self.directions(points)
        return np.asarray((vectors * tangent).sum(axis=-1, keepdims=True) * tangent)

    def turning(self, points: Floats, forces: Floats) -> Floats:
        """(…,3) the gradient of ⟨f, t(x)⟩ at points x (…,3) for forces f (…,3): the tangent turns.

        A motion d turns it by Dt[d] = (n × d - t ⟨t, n × d⟩) / |n × (x - c)|; on the circle Dt[t] is the
        curvature vector (c - x) / r².
        """
        reach = np.linalg.norm(np.cross(self._axis, self._away(points)), axis=-1, keepdims=True)
        return np.asarray(np.cross(forces - self.along(forces, points), self._axis) / reach)

    def _apart(self, other: Any) -> float:
        centres = np.linalg.norm(np.subtract(self.centre, other.centre))
        return float(centres + abs(self.radius - other.radius))

    def _across(self, vectors: Floats) -> Floats:
        """(…,3) the components of vectors (…,3) in the circle's plane."""
        return np.asarray(vectors - (vectors @ self._axis)[..., None] * self._axis)


Guide = Line | Circle  # what a vertex can slide along
