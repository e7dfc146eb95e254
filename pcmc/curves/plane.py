"""A plane: Π, one that vertices slide on, or a mirror."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ..base import validate
from ..base.arrays import Floats, Vector, cached_array
from ..base.errors import SurfaceError
from ..base.validate import checked_name


@dataclass(frozen=True)
class Plane:
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

    point: Vector = (0.0, 0.0, 0.0)
    normal: Vector = (0.0, 0.0, 1.0)
    name: str = field(default="", repr=False)
    mirror: bool = field(default=False, repr=False)

    def __post_init__(self) -> None:
        for key in ("point", "normal"):
            vector = validate.vector(f"Plane.{key}", getattr(self, key), error=SurfaceError)
            object.__setattr__(self, key, vector)
        if max(map(abs, self.point)) > validate.LARGEST:
            limit = f"coordinates up to {validate.LARGEST:g}"
            validate.refuse("Plane.point", self.point, limit, error=SurfaceError)
        _, exponent = math.frexp(max(map(abs, self.normal)))
        scaled = [math.ldexp(c, -exponent) for c in self.normal]  # so that no square is too large or small
        length = math.sqrt(sum(c * c for c in scaled))
        if length == 0.0:
            validate.refuse("Plane.normal", self.normal, "a vector of positive length", error=SurfaceError)
        object.__setattr__(self, "normal", tuple(c / length for c in scaled))
        object.__setattr__(
            self, "name", checked_name("Plane.name", self.name, empty=True, error=SurfaceError)
        )
        if not isinstance(self.mirror, bool):
            validate.refuse("Plane.mirror", self.mirror, "True or False", error=SurfaceError)

    def __str__(self) -> str:
        kind = "mirror plane" if self.mirror else "plane"
        if self.name:
            return f"{kind} {self.name!r}"
        point, normal = (", ".join(f"{c + 0.0:.4g}" for c in v) for v in (self.point, self.normal))
        return f"{kind} through ({point}) across ({normal})"

    @cached_array
    def axes(self) -> Floats:
        """(3,3) rows: two unit vectors along the plane and its normal; the identity for z = 0."""
        normal = np.array(self.normal)
        axis = np.eye(3)[1 if abs(normal[0]) > 0.9 else 0]
        first = axis - (axis @ normal) * normal
        first /= np.linalg.norm(first)
        return np.stack([first, np.cross(normal, first), normal])

    def __getstate__(self) -> dict[str, object]:
        return {"point": self.point, "normal": self.normal, "name": self.name, "mirror": self.mirror}

    def to_local(self, points: npt.ArrayLike) -> Floats:
        """(…,3) two coordinates on the plane and the height above it, of points (…,3).

        >>> Plane(point=(1, 2, 3)).to_local([1, 3, 5]).tolist()
        [0.0, 1.0, 2.0]
        """
        return (np.asarray(points, dtype=float) - np.array(self.point)) @ self.axes.T

    def height(self, points: npt.ArrayLike) -> Floats:
        """(…) signed distance of points (…,3) from the plane, positive along the normal."""
        return (np.asarray(points, dtype=float) - np.array(self.point)) @ np.array(self.normal)

    def nearest(self, points: npt.ArrayLike) -> Floats:
        """(…,3) the points of the plane nearest to points (…,3).

        >>> Plane(point=(0, 0, 1)).nearest([2, 3, 5]).tolist()
        [2.0, 3.0, 1.0]
        """
        return np.asarray(points, dtype=float) - self.height(points)[..., None] * np.array(self.normal)

    def along(self, vectors: Floats) -> Floats:
        """(…,3) the components of vectors (…,3) parallel to the plane: v - ⟨v, n⟩ n, Eq. (19)."""
        normal = np.array(self.normal)
        return vectors - (vectors @ normal)[..., None] * normal
