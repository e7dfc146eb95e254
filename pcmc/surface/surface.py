"""Patch, Plane and Surface: frozen values, checked once on the way in."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from ..base import validate
from ..base.arrays import Bools, Floats, Ints, cached_array, read_only
from ..base.errors import FreeSurfaceWarning, SurfaceError
from . import checks
from .circle import Circle, Guide
from .geometry import Vector, bounding_size
from .topology import Topology, topology

FIELDS = ("vertices", "faces", "patch_of_face", "patches", "fixed", "on_plane", "plane", "on_line")
FAR = 30.0  # sizes from the point of Π: farther, volumes seen from it lose over three digits


@dataclass(frozen=True)
class Patch:
    """A part of the surface with one tension and one pressure.

    Parameters
    ----------
    name : str, unique in its surface.
    tension : α ≥ 0, force per length. At rest the patch has mean curvature pressure / (2 α).
    pressure : p, force per area along the positive normal: the pressure below the patch minus the one
        above it. A wall between rooms of pressures p_1 and p_2 has pressure p_1 - p_2, its normal
        pointing from room 1 to room 2; ``pcmc.energy`` describes E for other wall pressures.
    wall : whether the patch is a wall between rooms: its cone is not part of the volume, and it may
        pinch. A patch without pressure is always a wall.

    >>> Patch("roof", tension=2.0).target_curvature
    0.25
    """

    name: str
    tension: float
    pressure: float = 1.0
    wall: bool = field(default=False, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            validate.refuse("Patch.name", self.name, "a text", error=SurfaceError)
        object.__setattr__(self, "name", str(self.name))
        if not isinstance(self.wall, bool | np.bool_):
            validate.refuse("wall", self.wall, "True or False", self.name, error=SurfaceError)
        object.__setattr__(self, "wall", bool(self.wall))
        tension = self._number("tension", least=0.0, hint="0 makes a wall that does not pull")
        pressure = self._number("pressure")
        if tension == 0.0 and pressure != 0.0:
            hint = f"a patch under pressure {pressure:g} must pull; a wall (pressure=0) may have tension 0"
            validate.refuse("tension", 0.0, "> 0", self.name, hint, SurfaceError)
        if 0.0 < tension < checks.SMALLEST:
            hint = "use a smaller unit of force"
            validate.refuse("tension", tension, f"0 or ≥ {checks.SMALLEST:g}", self.name, hint, SurfaceError)

    def _number(self, key: str, least: float | None = None, hint: str = "") -> float:
        value, where, most = getattr(self, key), self.name, checks.LARGEST
        number = validate.number(key, value, least=least, where=where, hint=hint, error=SurfaceError)
        hint = "use a larger unit of force"
        validate.number(key, number, least=-most, most=most, where=where, hint=hint, error=SurfaceError)
        object.__setattr__(self, key, number)
        return number

    @property
    def auxiliary(self) -> bool:
        """Whether the patch is a wall: declared as one, or without pressure."""
        return self.wall or self.pressure == 0.0

    @property
    def target_curvature(self) -> float:
        """H̄ = p / (2 α), 1/length; NaN for a wall without tension, whose shape is arbitrary."""
        return self.pressure / (2.0 * self.tension) if self.tension > 0.0 else math.nan


@dataclass(frozen=True)
class Plane:
    """The plane Π through ``point`` with unit ``normal`` (normalised on the way in).

    Volumes are measured from its point, so with the boundary on Π the volume is the one enclosed
    between surface and Π.

    >>> Plane(normal=(0, 0, 2)).normal
    (0.0, 0.0, 1.0)
    """

    point: Vector = (0.0, 0.0, 0.0)
    normal: Vector = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        for key in ("point", "normal"):
            vector = validate.vector(f"Plane.{key}", getattr(self, key), error=SurfaceError)
            object.__setattr__(self, key, vector)
        if max(map(abs, self.point)) > checks.LARGEST:
            limit = f"coordinates up to {checks.LARGEST:g}"
            validate.refuse("Plane.point", self.point, limit, error=SurfaceError)
        _, exponent = math.frexp(max(map(abs, self.normal)))
        scaled = [math.ldexp(c, -exponent) for c in self.normal]  # so that no square is too large or small
        length = math.sqrt(sum(c * c for c in scaled))
        if length == 0.0:
            validate.refuse("Plane.normal", self.normal, "a vector of positive length", error=SurfaceError)
        object.__setattr__(self, "normal", tuple(c / length for c in scaled))

    @cached_array
    def axes(self) -> Floats:
        """(3,3) rows: two unit vectors along the plane and its normal; the identity for z = 0."""
        normal = np.array(self.normal)
        axis = np.eye(3)[1 if abs(normal[0]) > 0.9 else 0]
        first = axis - (axis @ normal) * normal
        first /= np.linalg.norm(first)
        return np.stack([first, np.cross(normal, first), normal])

    def __getstate__(self) -> dict[str, object]:
        return {"point": self.point, "normal": self.normal}

    def to_local(self, points: npt.ArrayLike) -> Floats:
        """(…,3) two coordinates on the plane and the height above it, of points (…,3).

        >>> Plane(point=(1, 2, 3)).to_local([1, 3, 5]).tolist()
        [0.0, 1.0, 2.0]
        """
        return (np.asarray(points, dtype=float) - np.array(self.point)) @ self.axes.T

    def height(self, points: npt.ArrayLike) -> Floats:
        """(…) signed distance of points (…,3) from the plane, positive along the normal."""
        return (np.asarray(points, dtype=float) - np.array(self.point)) @ np.array(self.normal)

    def along(self, vectors: Floats) -> Floats:
        """(…,3) the components of vectors (…,3) parallel to the plane: v - ⟨v, n⟩ n, Eq. (19)."""
        normal = np.array(self.normal)
        return vectors - (vectors @ normal)[..., None] * normal


def expect_surface(value: object) -> None:
    """Refuse anything but a Surface.

    >>> expect_surface(None)
    Traceback (most recent call last):
    ...
    pcmc.base.errors.SurfaceError: surface: expected a Surface, found 'NoneType'
    """
    if not isinstance(value, Surface):
        validate.refuse("surface", type(value).__name__, "a Surface", error=SurfaceError)


@dataclass(frozen=True, eq=False)
class Surface:
    """A triangle mesh of several patches, with its supports.

    Parameters
    ----------
    vertices : (n,3) float, positions.
    faces : (m,3) int, counter-clockwise seen from the side the pressure pushes towards.
    patch_of_face : (m,) int, index into ``patches``.
    patches : sequence of Patch, names unique.
    fixed : index array or (n,) bool mask: vertices that do not move.
    on_plane : index array or (n,) bool mask: vertices that slide on ``plane`` (fixed wins).
    plane : Π.
    on_line : mapping from a Line or a Circle to an index array or (n,) mask: vertices that slide along it
        and are fixed but for that. On a straight or round boundary the end of a junction can slide so; let
        the other vertices of the boundary slide too, but for its corners, so that they can make room.

    Raises
    ------
    SurfaceError
        Naming the first offending index, for arrays that are not such a mesh.

    Examples
    --------
    >>> square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]],
    ...                  [0, 0], [Patch("floor", 1.0)], fixed=range(4))
    >>> square.n, square.m, square.size
    (4, 2, 1.4142135623730951)
    """

    vertices: Floats
    faces: Ints
    patch_of_face: Ints
    patches: tuple[Patch, ...]
    fixed: Bools = field(default=cast(Bools, ()))
    on_plane: Bools = field(default=cast(Bools, ()))
    plane: Plane = Plane()
    on_line: tuple[tuple[Guide, Bools], ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.plane, Plane):
            validate.refuse("plane", self.plane, "a Plane", error=SurfaceError)
        X = checks.positions(self.vertices)
        checks.large_enough(X)
        F = checks.face_array(self.faces, len(X))
        patches = tuple(self.patches) if isinstance(self.patches, Iterable) else ()
        if not patches or not all(isinstance(patch, Patch) for patch in patches):
            validate.refuse("patches", self.patches, "a sequence of Patch", error=SurfaceError)
        patch = checks.patch_array(self.patch_of_face, len(F), patches)
        fixed = checks.mask(self.fixed, len(X), "fixed")
        on_line = checks.on_line(self.on_line, X)
        for _, along in on_line:
            fixed |= along
        object.__setattr__(self, "on_line", tuple((line, read_only(along)) for line, along in on_line))
        sliding = checks.mask(self.on_plane, len(X), "on_plane") & ~fixed
        arrays = {"vertices": X, "faces": F, "patch_of_face": patch, "fixed": fixed}
        for key, value in (arrays | {"on_plane": sliding}).items():
            object.__setattr__(self, key, read_only(value))
        object.__setattr__(self, "patches", patches)
        height = self.plane.height(X)
        checks.mesh(X, F, patch, self.topology, self.patches, fixed | sliding, height)
        checks.on_plane(height, sliding, X, self.size)
        if not (fixed.any() or sliding.any()):
            message = "no vertex is fixed or on the plane: translations are free, so only closed surfaces"
            message += " have an equilibrium; pass fixed= or on_plane= to hold it"
            warnings.warn(message, FreeSurfaceWarning, stacklevel=3)

    @property
    def n(self) -> int:
        """Number of vertices."""
        return len(self.vertices)

    @property
    def m(self) -> int:
        """Number of triangles."""
        return len(self.faces)

    @cached_property
    def size(self) -> float:
        """Diagonal of the bounding box, length: the scale of every relative tolerance."""
        return bounding_size(self.vertices)

    @cached_property
    def topology(self) -> Topology:
        """Edges, curves and points, from the faces alone; shared by all moved copies."""
        return topology(self.faces, self.patch_of_face, len(self.vertices))

    @cached_array
    def uncancelled(self) -> Floats:
        """(e,) the sum of the pressures at each edge that is not held, force/area.

        A triangle's pressure counts with the sense in which the triangle runs along the edge. Where all
        sums are zero, no force depends on the point of Π that volumes are seen from.
        """
        topo = self.topology
        pressure = self.pressures[self.patch_of_face, None] * topo.sense
        left = np.bincount(topo.edge_of_face.ravel(), pressure.ravel(), len(topo.edges))
        held = (self.fixed | self.on_plane)[topo.edges].all(axis=1)
        rounding = 1e-12 * np.abs(self.pressures).max(initial=0.0)
        return np.where(held | (np.abs(left) <= rounding), 0.0, left)

    @cached_array
    def origin(self) -> Floats:
        """(3,) the point that volumes are seen from: that of Π.

        Far from that point, as in survey coordinates, volumes would lose their digits. There the origin
        is the point of Π below the middle of the surface, so that a volume over Π does not depend on
        where it is drawn; or the middle itself, if that is far above Π and nothing slides. Forces do not
        change as long as the pressures cancel along all edges that are not held; where they do not
        cancel, the origin stays the point of Π.
        """
        point, middle = np.array(self.plane.point), self.vertices.mean(axis=0)
        near = np.linalg.norm(middle - point) <= FAR * self.size
        if near or self.uncancelled.any():
            return point
        height = float(self.plane.height(middle))
        if self.on_plane.any() or abs(height) <= FAR * self.size:
            middle = middle - height * np.array(self.plane.normal)
        return np.asarray(middle)

    @cached_array
    def walls(self) -> Bools:
        """(k,) bool: which patches are walls."""
        return np.array([p.auxiliary for p in self.patches])

    @cached_array
    def tensions(self) -> Floats:
        """(k,) tension α of each patch."""
        return np.array([p.tension for p in self.patches])

    @cached_array
    def pressures(self) -> Floats:
        """(k,) pressure p of each patch."""
        return np.array([p.pressure for p in self.patches])

    @property
    def free(self) -> Bools:
        """(n,) vertices that no support holds at all."""
        return ~(self.fixed | self.on_plane)

    @property
    def on_circle(self) -> tuple[tuple[Circle, Bools], ...]:
        """The part of ``on_line`` that is round."""
        return tuple((line, along) for line, along in self.on_line if isinstance(line, Circle))

    def patch_index(self, name: str) -> int:
        """Index of the patch called ``name``."""
        names = [p.name for p in self.patches]
        return names.index(validate.choice("patch", name, names))

    def moved(self, vertices: npt.ArrayLike) -> Surface:
        """The same surface with its vertices elsewhere, (n,3); faces, supports, patches are shared.

        Sliding vertices must stay on Π or on their lines and circles. Triangles may collapse; ``solve``
        can repair many of them.
        """
        X = checks.positions(vertices)
        if X.shape != self.vertices.shape:
            checks.refuse_shape("vertices", X, self.vertices.shape)
        checks.on_plane(self.plane.height(X), self.on_plane, X, self.size)
        checks.on_lines(self.on_line, X)
        return self._with(vertices=read_only(X))

    def retensioned(
        self,
        tensions: Mapping[str, float] | None = None,
        pressures: Mapping[str, float] | None = None,
        walls: Iterable[str] = (),
    ) -> Surface:
        """The same surface with other tensions or pressures, given by patch name.

        ``walls`` names patches that are walls whatever their pressure.
        """
        for key, given in (("tensions", tensions), ("pressures", pressures)):
            if not isinstance(given or {}, Mapping):
                validate.refuse(key, given, "a mapping from patch names to numbers", error=SurfaceError)
        if isinstance(walls, str) or not isinstance(walls, Iterable):
            validate.refuse("walls", walls, "a sequence of patch names", error=SurfaceError)
        patches = list(self.patches)
        changes: dict[int, dict[str, Any]] = {self.patch_index(name): {"wall": True} for name in walls}
        for key, given in (("tension", tensions), ("pressure", pressures)):
            for name, value in (given or {}).items():
                changes.setdefault(self.patch_index(name), {})[key] = value
        for index, both in changes.items():
            patches[index] = replace(patches[index], **both)
        return self._with(patches=tuple(patches))

    def __copy__(self) -> Surface:
        """The surface itself: it never changes."""
        return self

    def __deepcopy__(self, memo: dict[int, object]) -> Surface:
        """The surface itself: it never changes."""
        return self

    def __getstate__(self) -> dict[str, object]:
        """What describes the surface, and the point it is seen from; the rest is computed anew."""
        return {name: vars(self)[name] for name in (*FIELDS, "origin") if name in vars(self)}

    def __setstate__(self, state: dict[str, object]) -> None:
        for name, value in state.items():
            vars(self)[name] = read_only(value) if isinstance(value, np.ndarray) else value
        for _, along in self.on_line:
            read_only(along)

    def patch_faces(self, patches: Sequence[int]) -> Bools:
        """(m,) mask of the triangles of the given patches."""
        return np.isin(self.patch_of_face, patches)

    def _with(self, **changes: object) -> Surface:
        """A copy that skips the checks already made; the topology travels along."""
        other = object.__new__(type(self))
        for name in (*FIELDS, "topology"):
            other.__dict__[name] = changes.get(name, getattr(self, name))
        if "patches" not in changes:  # seen from one point all along a solver's way
            other.__dict__["origin"] = self.origin
        return other
