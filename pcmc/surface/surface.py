"""Surface: a frozen value, checked once on the way in."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from ..base import validate
from ..base.arrays import Bools, Floats, Ints, cached_array, hand_over, read_only
from ..base.errors import FreeSurfaceWarning, SurfaceError
from ..base.tolerances import FAR, FORCE_ROUNDING
from . import checks, supports
from .checked import checked_parts
from .geometry import bounding_size
from .guides import Guide, Plane
from .held_curve import EdgesOnCurves, HeldCurve, followed
from .images import Imaged, check_translations
from .lagrange import element_nodes
from .parts import Cable, CableEdges, Patch, Room, cable_edges, room_signs, summary
from .values import in_the_open, part_index, wall_patches, with_values


def _of_patches(field: str) -> cached_property[Any]:
    """The values of a field of the patches of a Surface, as a cached (k,) array."""

    def values(surface: Surface) -> Any:
        return np.array([getattr(patch, field) for patch in surface.patches])

    return cached_array(values)


def expect_surface(value: object) -> None:
    """Refuse anything but a Surface.

    >>> expect_surface("roof.toml")
    Traceback (most recent call last):
        ...
    pcmc.base.errors.SurfaceError: surface: expected a Surface, found 'str'
    """
    if not isinstance(value, Surface):
        validate.refuse("surface", type(value).__name__, "a Surface", error=SurfaceError)


@dataclass(frozen=True, eq=False, repr=False)
class Surface(supports.Supported, Imaged):
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
        and are fixed but for that, such as the end of a junction on a straight or round boundary; let the
        other vertices of that boundary slide too, but for its corners, so that they can make room.
    on_planes : mapping from a Plane to an index array or (n,) mask: vertices that slide on a plane other than
        Π. Those on two slide along their common line; those on three are fixed. At a plane with
        ``mirror=True`` the surface goes on as its mirror image.
    cables : sequence of Cable, names unique: edges with a line tension.
    rooms : sequence of Room, names unique: volumes that are prescribed instead of pressures.
    curves : sequence of HeldCurve: the curves that fixed vertices were drawn on. The new vertices of finer
        meshes are fixed on them; of other edges between fixed vertices it is guessed whether they are held.
        Where fixed vertices are moved, see ``held_curves``.
    order : 1 for flat triangles; 2, 4 or 8 for curved elements of this order (``pcmc.surface.lagrange``),
        each of order² triangles in a row, as ``pcmc.meshing.elevation.elevate`` makes them.
    images : (k,2) int: an image, and the vertex that it is a translated copy of, as ``pcmc.images_in`` gives
        them. The surface goes on there: it is periodic.

    Attributes
    ----------
    given_supports : ``fixed``, ``on_plane`` and ``on_line`` as given. Those of the surface also count the
        vertices that cannot move, or along a line only, because they slide on several planes; and ``fixed``
        those on lines.

    Raises
    ------
    SurfaceError : with the first offending index, for arrays that are not such a mesh.

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
    plane: Plane = field(default=Plane())
    on_line: tuple[tuple[Guide, Bools], ...] = ()
    on_planes: tuple[tuple[Plane, Bools], ...] = ()
    cables: tuple[Cable, ...] = ()
    rooms: tuple[Room, ...] = ()
    curves: tuple[HeldCurve, ...] = ()
    order: int = 1
    images: Ints = field(default=cast(Ints, ()))
    given_supports: supports.Supports = field(init=False, repr=False)

    def __post_init__(self) -> None:
        vars(self).update(checked_parts({name: getattr(self, name) for name in PARTS}))
        self._warn_if_free(stacklevel=4)

    def _warn_if_free(self, stacklevel: int) -> None:
        if not (self.held.any() or self.rooms or self.periodic):
            message = "no vertex is fixed or on the plane: translations are free, so only closed surfaces"
            message += " have an equilibrium; pass fixed= or on_plane= to hold it"
            warnings.warn(message, FreeSurfaceWarning, stacklevel=stacklevel)

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
    def nodes(self) -> Ints:
        """(e,k) the nodes of the elements, their corners first; of flat triangles ``faces``."""
        return self.faces if self.order == 1 else element_nodes(self.faces, self.order)

    @cached_array
    def uncancelled(self) -> Floats:
        """(e,) the sum of the net pressures at each edge that no support holds, force/area."""
        return self._uncancelled(self.net_pressures)

    def _uncancelled(self, pressures: Floats) -> Floats:
        masks = [self.fixed | self.on_plane, *(mask for _, mask in self.on_planes)]
        left = supports.uncancelled_pressures(self.topology, pressures[self.patch_of_face], masks)
        # where all pressures are next to none, as in a honeycomb, they are rounding themselves
        return np.where(np.abs(left) * self.size <= FORCE_ROUNDING * self.tensions.max(), 0.0, left)

    @cached_array
    def origin(self) -> Floats:
        """(3,) the point that volumes are seen from: that of Π, or one near a surface far from it.

        Forces do not change with it where the pressures cancel along all edges that are not held; elsewhere
        it stays the point of Π. Far from that, as in survey coordinates, volumes would lose digits: there it
        is the point of Π below the middle of the fixed vertices, or the middle itself, if that is far above Π
        and nothing slides there. It lies on as many other planes as possible: they add nothing to volumes.
        """
        X = self.vertices[self.pinned if self.pinned.any() else slice(None)]  # one point for all equilibria
        point, middle = np.array(self.plane.point), 0.5 * (X.min(axis=0) + X.max(axis=0))
        if self.uncancelled.any():
            return point
        if np.linalg.norm(middle - point) > FAR * self.size:
            low = abs(self.plane.height(middle)) <= FAR * self.size
            point = self.plane.nearest(middle) if low or self.given_supports.on_plane.any() else middle
        planes = [self.plane, *(plane for plane, _ in self.on_planes)]
        return supports.common_point(point, planes) if self.on_planes else point

    @cached_array
    def mirror_edge(self) -> Bools:
        """(e,) edges of the boundary in a mirror plane, where the surface goes on behind it."""
        return supports.mirror_edges(self.on_planes, self.topology)

    @cached_property
    def edges_on_curves(self) -> EdgesOnCurves:
        """The edges of the mesh, and where their ends are on ``held_curves``."""
        return EdgesOnCurves.of(self.held_curves, self.topology)

    @cached_property
    def held_curves(self) -> tuple[HeldCurve, ...]:
        """The curves with their vertices where these are now.

        Warns
        -----
        CurveWarning : fixed vertices were moved otherwise than by an affine map; their curves are left out.
        """
        return followed(self.curves, self.vertices, self.size)

    def with_mesh(self, columns: Bools, **changes: Any) -> Surface:
        """``rebuilt`` on another mesh, with its ``support_columns`` (n,c)."""
        fixed, sliding, *others = np.ascontiguousarray(columns.T)
        lines, split = self.given_supports.on_line, len(self.on_planes)
        on_planes = [(plane, mask) for (plane, _), mask in zip(self.on_planes, others[:split], strict=True)]
        on_line = [(line, mask) for (line, _), mask in zip(lines, others[split:], strict=True)]
        return self.rebuilt(fixed=fixed, on_plane=sliding, on_planes=on_planes, on_line=on_line, **changes)

    @cached_array
    def walls(self) -> Bools:
        """(k,) bool: which patches are walls, in every file, table and picture: see ``wall_patches``."""
        return wall_patches(self)

    @property
    def roof(self) -> Bools:
        """(k,) bool: the patches that are no walls."""
        return ~self.walls

    auxiliary = _of_patches("auxiliary")  # (k,) bool: declared as walls, or without pressure: these may pinch
    tensions = _of_patches("tension")  # (k,) α
    pressures = _of_patches("pressure")  # (k,) p, that of the air: snow is not taken off
    snows = _of_patches("snow")  # (k,) s, force per area of the plan
    net_pressures = _of_patches("net_pressure")  # (k,) p - s, the pressure in the energy
    weights = _of_patches("weight")  # (k,) w, force/area

    @cached_property
    def heavy(self) -> bool:
        """Whether a patch or a cable has a weight."""
        return bool(self.weights.any() or self.cable_edges.weight.any())

    @cached_property
    def cable_edges(self) -> CableEdges:
        """The edges that carry a line tension, and how much."""
        return cable_edges(self.cables)

    @cached_property
    def cable_sides(self) -> CableEdges:
        """The same as sides of elements, with all their nodes; of flat ones the edges."""
        return self.cable_edges if self.order == 1 else cable_edges(self.cables, self.nodes, self.order)

    @cached_array
    def room_signs(self) -> Floats:
        """(r,k) 1 or -1 where a patch bounds a room, by the sense of its normal; 0 elsewhere."""
        return room_signs(self.rooms, [patch.name for patch in self.patches])

    def patch_index(self, name: str) -> int:
        """Index of the patch called ``name``."""
        return part_index(self, "tensions", name)

    def cable_index(self, name: str) -> int:
        """Index of the cable called ``name``."""
        return part_index(self, "cables", name)

    def moved(self, vertices: npt.ArrayLike) -> Surface:
        """The same surface with its vertices elsewhere, (n,3); faces, supports, patches are shared.

        Sliding vertices must stay on Π or on their lines and circles. Triangles may collapse; ``solve``
        can repair many of them. Curves go along, see ``held_curves``.
        """
        X = checks.positions(vertices)
        if X.shape != self.vertices.shape:
            checks.refuse_shape("vertices", X, self.vertices.shape)
        supports.check_on(((self.plane, self.on_plane), *self.on_planes, *self.on_line), X, self.size)
        check_translations(self, X)
        return self._with(vertices=read_only(X))

    def rebuilt(self, **changes: Any) -> Surface:
        """The surface with other parts, checked anew; all others as they were given to this one.

        Parts with an entry per vertex (``fixed``, ``on_plane``, ``on_line``, ``on_planes``, ``cables``,
        ``curves``, ``images``) must be among the changes where the vertices are others. Curves stay along the
        edges that stay fixed. Of a surface that nothing holds the user was warned once, when it was made.

        >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        >>> flat = Surface(corners, [[0, 1, 2]], [0], [Patch("roof", 2.0)], fixed=range(3))
        >>> over = flat.rebuilt(faces=[[0, 2, 1]])
        >>> over.faces.tolist(), over.fixed.all()
        ([[0, 2, 1]], np.True_)
        """
        given = {name: getattr(self, name) for name in PARTS} | self.given_supports._asdict() | changes
        if self.curves and "curves" not in changes:  # along the edges that stay fixed
            X = checks.positions(given["vertices"])
            if len(X) != self.n:
                text = "curves: the vertices are others; give their curves, too, or curves=() to drop them"
                raise SurfaceError(text, what="curves", found=len(X), expected=self.n)
            held, edges = followed(self.curves, X, bounding_size(X)), self.topology.edges
            fixed = checks.mask(given["fixed"], self.n, "fixed")
            fixed &= ~supports.members(supports.checked_lines(given["on_line"], X), self.n)
            stay = np.all(fixed[edges], axis=1)
            given["curves"] = EdgesOnCurves.of(held, self.topology)[stay].joined(edges[stay])
        made = object.__new__(Surface)
        vars(made).update(given | checked_parts(given))
        if self.held.any() or self.rooms:
            made._warn_if_free(stacklevel=3)
        return made

    def retensioned(
        self,
        tensions: Mapping[str, float] | None = None,
        pressures: Mapping[str, float] | None = None,
        walls: Iterable[str] = (),
        *,
        weights: Mapping[str, float] | None = None,
        snows: Mapping[str, float] | None = None,
        cables: Mapping[str, float] | None = None,
        cable_weights: Mapping[str, float] | None = None,
        volumes: Mapping[str, float] | None = None,
    ) -> Surface:
        """The same surface with other tensions, pressures, weights or snow, given by patch name.

        ``walls`` names patches that are walls whatever their pressure; ``cables`` and
        ``cable_weights`` give tensions and weights per length by the name of the cable, ``volumes`` volumes
        by the name of the room. The pressure of a wall changes with the difference of its two rooms'
        pressures, and its snow with that of the snow over them, unless the wall itself is named. Of the
        two sheets of a cushion, ``roof`` and ``roof below``, one that is not named gets the other's pressure,
        and a tension of the upper one changes that of the lower one in proportion, unless it is named, too.

        Raises
        ------
        SurfaceError : an edge under one of the ``snows`` is free; see ``with_snow``.

        >>> from pcmc.plan import Divider, Plan
        >>> hall = Plan([[0, 0], [8, 0], [8, 4], [0, 4]], [Divider([[4, 0], [4, 4]])], edge_length=1.0,
        ...             patches={"west": {"tension": 4.0}, "east": {"tension": 4.0}}).surface()
        >>> hall.retensioned(pressures={"west": 1.25}).pressures.tolist()
        [1.25, 1.0, 0.25]
        """
        given = {"tensions": tensions, "pressures": pressures, "weights": weights, "snows": snows}
        given |= {"cables": cables, "cable_weights": cable_weights, "volumes": volumes}
        changed = self._with(**with_values(self, given, walls))
        snowed = bool(snows) and not np.array_equal(changed.snows, self.snows)
        return changed.with_held_snow() if snowed else changed

    __repr__ = summary

    def with_snow(self, snow: float, patches: Iterable[str] | None = None) -> Surface:
        """The same surface under snow, which acts as a lower pressure, p - s for p.

        A load s on the plan area has the potential s ∫ z dA_plan = s V, V the volume over Π, as a pressure
        lower by s has. This holds where the boundary of the patches is held, lies on Π, or meets other
        patches under the same snow: at a free edge V is that of cones to Π's point, whose sides carry snow.

        Parameters
        ----------
        snow : s, force per area of the plan; Π's normal points up.
        patches : names of the patches that it lies on; by default all that are no walls and under no other
            sheet, or all if there are no others.

        Raises
        ------
        SurfaceError : an edge of these patches is free; there ``retensioned(weights={"roof": s})`` can do.

        >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        >>> roof = Surface(corners, [[0, 1, 2]], [0], [Patch("roof", 2.0, 1.0)], fixed=range(3))
        >>> snowy = roof.with_snow(0.25)
        >>> snowy.pressures.tolist(), snowy.snows.tolist(), snowy.net_pressures.tolist()
        ([1.0], [0.25], [0.75])
        """
        snow = validate.number("snow", snow, error=SurfaceError)
        every = [patch.name for patch in self.patches]
        roof = [name for name, out in zip(every, in_the_open(self), strict=True) if out]
        names = list(patches) if patches is not None else roof or every
        snows = {patch.name: patch.snow for patch in self.patches} | dict.fromkeys(names, snow)
        return self.retensioned(snows=snows).with_held_snow()

    def with_held_snow(self) -> Surface:
        """The surface itself; SurfaceError where its snow ends at a free edge, as in ``with_snow``."""
        edges = np.flatnonzero(self._uncancelled(self.snows))
        if len(edges):
            checks.refuse_snow(self, edges)
        return self

    def __copy__(self, memo: object = None) -> Surface:
        """The surface itself: it never changes."""
        return self

    __deepcopy__ = __copy__

    def __getstate__(self) -> dict[str, object]:
        """What describes the surface, and the point it is seen from; the rest is computed anew."""
        return {name: vars(self)[name] for name in (*FIELDS, "origin") if name in vars(self)}

    def __setstate__(self, state: dict[str, object]) -> None:
        for name, value in state.items():
            vars(self)[name] = read_only(value) if isinstance(value, np.ndarray) else value
        for _, along in (*self.on_line, *self.on_planes):
            read_only(along)
        self.given_supports.frozen()

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
            if "faces" not in changes:
                hand_over(self, other, "flat_pieces")
        if "faces" not in changes:
            hand_over(self, other, "nodes")
        return other


PARTS = tuple(each.name for each in fields(Surface) if each.init)  # as they are given
FIELDS = (*PARTS, "given_supports")
