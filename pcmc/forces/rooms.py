"""The volumes of rooms that are prescribed, and their gradients.

The volume V of a room is that of the cones from ``Surface.origin`` to its patches, each with the sign of its
normal, and of what closes their boundary. Along edges on Π the cones' sides lie in Π; along edges on other
sliding planes flat pieces close it (``flat_pieces``). Any other boundary must be fixed; a flat fan about the
middle of its length, which is the same on every mesh, closes it, and adds a constant.

A pressure δ in all of the room adds -δ V to E. At rest the pressures δ are those at which V is as prescribed:
δ is the multiplier of the condition V = V̄ in

    L(X, δ) = E(X) - Σ δ_r (V_r(X) - V̄_r).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from ..base.arrays import Floats, hand_over, kept_with_owner
from ..base.errors import OptionError, SurfaceError
from ..base.tolerances import NO_CHANGE, ON, SAME_PRESSURE
from ..surface import Line, Surface, expect_surface
from ..surface.geometry import segment_lengths
from ..surface.images import lattice_of
from ..surface.lagrange import expect_flat
from ..surface.parts import Room
from ..surface.pieces import point_text
from ..surface.supports import apply_supports, members
from ..surface.topology import components
from .functional import energy, patch_volumes, weighted

CLEAR = 0.01  # of a sixth of a cell: beyond that a volume is no whole number of them


def room_volumes(surface: Surface, X: Floats | None = None) -> Floats:
    """(r,) the volume enclosed by each room of prescribed volume, length³, also with vertices at X (n,3).

    SurfaceError if the patches of a room leave an edge open that nothing holds.

    >>> from pcmc import Patch
    >>> tent = Surface([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]], [[0, 1, 2], [1, 3, 2], [3, 0, 2]],
    ...                [0, 0, 0], [Patch("tent", 2.0)], fixed=[0, 1, 3],
    ...                rooms=[Room("all", {"tent": 1}, 1.0)])
    >>> bool(abs(room_volumes(tent)[0] - 1 / 6) < 1e-15)
    True
    """
    expect_surface(surface)
    if not surface.rooms:
        return np.zeros(0)
    return surface.room_signs @ patch_volumes(surface, X) + closing_volumes(surface)


def room_volume_gradients(surface: Surface, X: Floats | None = None) -> Floats:
    """(r,n,3) ∂V_r/∂X at X (n,3) or where the surface is, supports applied, length².

    >>> from pcmc import Patch
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4), rooms=[Room("all", {"roof": 1}, 1.0)])
    >>> room_volume_gradients(roof)[0, 4].round(12).tolist()
    [0.0, 0.0, 1.333333333333]
    """
    expect_surface(surface)
    gradients = [apply_supports(surface, weighted(surface, 0.0, -s, X)[1], X) for s in surface.room_signs]
    return np.array(gradients).reshape(len(surface.rooms), surface.n, 3)


def prescribed_volumes(surface: Surface) -> Floats:
    """(r,) V̄ of each room, length³."""
    return np.array([room.volume for room in surface.rooms])


def room_pressures(surface: Surface) -> Floats:
    """(r,) the pressure of the air in each room, force/length²: that on its patches that are no walls.

    >>> from pcmc import Patch
    >>> flat = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("a", 3.0, 2.0)],
    ...                fixed=[0, 1, 2], rooms=[Room("all", {"a": -1}, 1.0)])
    >>> room_pressures(flat).round(12).tolist()
    [-2.0]
    """
    return np.asarray(pressure_shares(surface) @ surface.pressures)


def pressure_shares(surface: Surface) -> Floats:
    """(r,k) what of the patches' pressures is that of each room: a mean over its patches that are no walls.

    A wall has the difference to the air beyond it. It counts only where rooms have nothing else.
    """
    if not surface.rooms:  # numpy 2.1 refuses no rows
        return surface.room_signs
    signs = surface.room_signs * surface.roof
    whole = np.linalg.matrix_rank(signs) == len(signs)
    return np.asarray(np.linalg.pinv((signs if whole else surface.room_signs).T), dtype=np.float64)


def energy_at_volumes(surface: Surface) -> float:
    """E + Σ p V with the pressures p of the rooms: the energy at their volumes V, whatever the pressures are.

    >>> from pcmc import Patch
    >>> tent = Surface([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]], [[0, 1, 2], [1, 3, 2], [3, 0, 2]],
    ...                [0, 0, 0], [Patch("tent", 2.0, 9.0)], fixed=[0, 1, 3],
    ...                rooms=[Room("all", {"tent": 1}, 1.0)])
    >>> round(energy_at_volumes(tent), 9)  # α A = √3 + 2
    3.732050808
    """
    if not surface.rooms:
        return energy(surface)
    volumes = surface.room_signs @ patch_volumes(surface, surface.vertices)
    return energy(surface) + float(room_pressures(surface) @ volumes)


def with_room_pressures(surface: Surface, change: Floats) -> Surface:
    """The surface with the pressure of each room changed by ``change`` (r,); walls stay walls.

    >>> from pcmc import Patch
    >>> flat = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("a", 1.0)],
    ...                fixed=[0, 1, 2], rooms=[Room("all", {"a": 1}, 1.0)])
    >>> with_room_pressures(flat, np.array([0.5])).pressures.tolist()
    [1.5]
    """
    pressures = surface.pressures + change @ surface.room_signs
    pressures[surface.auxiliary & (np.abs(pressures) <= SAME_PRESSURE * np.abs(pressures).max())] = 0.0
    names = [patch.name for patch in surface.patches]
    walls = np.flatnonzero(surface.walls & surface.room_signs.any(axis=0))
    new = dict(zip(names, pressures.tolist(), strict=True))
    other = surface.retensioned(None, new, [names[k] for k in walls])
    hand_over(surface, other, "origin", "closing_volumes")  # no pressures in a closed room change them
    return other


def refuse_varied_pressure(surface: Surface, patches: Iterable[int]) -> None:
    """Refuse to vary the pressure of any of these patches if it is the result of a prescribed volume."""
    for k in patches:
        for room in np.flatnonzero(surface.room_signs[:, k]):
            name, patch = surface.rooms[room].name, surface.patches[k].name
            message = f"the pressure of {patch!r} follows from the volume of room {name!r}: vary that volume,"
            raise OptionError(f"{message} or remove the room", what="parameter", where=patch)


def check_rooms(surface: Surface) -> None:
    """Refuse rooms whose volume no solver can reach (SurfaceError).

    That is, if one does not close, no motion changes its volume, a patch around it does not pull, or it is
    closed on all sides and its volume is negative, or its normals point into it.
    """
    if not surface.rooms:
        return
    closing_volumes(surface)
    by_motion = np.abs(room_volume_gradients(surface)).max(axis=(1, 2))
    for room, change in zip(surface.rooms, by_motion, strict=True):
        if change <= NO_CHANGE * surface.size**2:
            message = f"room {room.name!r}: no motion changes its volume, as supports hold all its vertices"
            raise SurfaceError(f"{message}; free some, or remove the room", what="rooms", where=room.name)
    for room, row, volume in zip(surface.rooms, surface.room_signs, room_volumes(surface), strict=True):
        for patch, sign in zip(surface.patches, row, strict=True):
            if sign and not patch.tension:
                message = f"room {room.name!r}: patch {patch.name!r} has no tension and takes no pressure"
                raise SurfaceError(f"{message}; give it one", what="rooms", where=patch.name, found=0.0)
        if _left_over(surface, row).any():
            continue  # the room lies on either side of Π or of its fixed boundary
        if room.volume < 0.0:
            message = f"room {room.name!r} is closed on all sides: its volume cannot be {room.volume:g}"
            message += "; give a positive one"
            raise SurfaceError(message, what="volume", where=room.name, found=room.volume)
        if volume <= 0.0:
            message = f"room {room.name!r} has the volume {volume:g} at the start: the normals of its patches"
            message += " point into it; give them -1 in place of 1, and 1 in place of -1"
            raise SurfaceError(message, what="rooms", where=room.name, found=float(volume))


@kept_with_owner
def closing_volumes(surface: Surface) -> Floats:
    """(r,) what the fans over the fixed boundaries of each room add to its cones, length³.

    SurfaceError where a room has an open edge.
    """
    rows = zip(surface.rooms, surface.room_signs, strict=True)
    fans = np.array([sum(_fans(surface, room, row)) for room, row in rows], dtype=float)
    return fans + _whole_sixths(surface) if len(lattice_of(surface)) == 3 else fans


def _whole_sixths(surface: Surface) -> Floats:
    """(r,) what cones and pieces leave out of the volumes where a cell is periodic in three directions.

    It is a whole number of sixths of the cell, by which vertices stand for their images alone. In coordinates
    x, y, z along the lattice a room has the volume, but for whole cells,

        Σ_T ∫ x dy dz - Σ_e m (∫ y dz - k_b z_b + k_a z_a)

    over its triangles, each in one piece, and its edges from a to b. Over an edge x jumps by the whole number
    m from triangle to triangle; at its ends y differs from those of the vertices a and b by k_a and k_b.
    """
    T, topo = lattice_of(surface), surface.topology
    X = (surface.vertices - surface.origin) @ np.linalg.inv(T)
    corners, ends, vertices, edge = X[surface.faces], X[topo.sides], X[topo.edges], topo.edge_of_face
    x, (_, y, z) = corners[..., 0], np.moveaxis(corners - corners[:, :1], 2, 0)
    volume = 0.5 * x.mean(axis=1) * (y[:, 1] * z[:, 2] - y[:, 2] * z[:, 1])
    k = np.rint(ends - vertices)[..., 1]
    along = ends[..., 1].mean(axis=1) * np.diff(ends[..., 2])[:, 0] - np.diff(k * vertices[..., 2])[:, 0]
    start = np.where(topo.sense > 0, x[:, [1, 2, 0]], x[:, [2, 0, 1]])
    volume -= (topo.sense * np.rint(start - ends[edge, 0, 0]) * along[edge]).sum(axis=1)
    of_patch, cell = np.bincount(surface.patch_of_face, volume, len(surface.patches)), np.linalg.det(T)
    share, reached = (surface.room_signs @ of for of in (np.sign(cell) * of_patch, patch_volumes(surface)))
    sixths = 6.0 * (share % 1.0 - reached / abs(cell))
    for room, off in zip(surface.rooms, np.abs(sixths - np.round(sixths)), strict=True):
        if off > CLEAR:
            text = f"room {room.name!r}: its patches end along held edges; in a cell that goes on in three"
            raise SurfaceError(f"{text} directions name all that close it", what="rooms", where=room.name)
    return np.asarray(np.round(sixths) * abs(cell) / 6.0)


def _left_over(surface: Surface, signs: Floats) -> Floats:
    """(e,) how often the patches of a room run along each edge one way more than the other."""
    topo = surface.topology
    ways = signs[surface.patch_of_face, None] * topo.sense
    return np.bincount(topo.edge_of_face.ravel(), ways.ravel(), len(topo.edges)).astype(float)


def _fans(surface: Surface, room: Room, signs: Floats) -> Iterator[float]:
    """The volumes of the fans over the connected pieces of a room's fixed boundary off Π."""
    left = _left_over(surface, signs)
    grounded = np.asarray(np.abs(surface.plane.height(surface.vertices)) <= ON * surface.size)
    edges = surface.topology.edges
    lying = np.asarray(grounded[edges].all(axis=1))
    # what closes an edge: Π or another sliding plane, fixed ends, or one straight line
    fixed = surface.fixed & ~members(surface.on_line, surface.n)
    closed = fixed[edges].all(axis=1) | (lying & surface.held[edges].all(axis=1))
    for line, along in surface.on_line:
        if isinstance(line, Line):
            on_it = along | (fixed & (line.distance(surface.vertices) <= ON * surface.size))
            closed |= on_it[edges].all(axis=1)
    for _, mask in surface.on_planes:
        lying |= mask[edges].all(axis=1)
        closed |= mask[edges].all(axis=1)
    open_edges = np.flatnonzero((left != 0.0) & ~closed)
    if len(open_edges):
        ends = edges[open_edges[0]]
        place = point_text(surface.vertices[ends].mean(axis=0), surface.size)
        text = f"room {room.name!r} does not close: its patches end along {len(open_edges)} edges that are"
        text += f" neither held on a plane nor fixed down to Π, the first from vertex {ends[0]} to {ends[1]}"
        text += f" near {place}; name the patches that are missing, with 1 where the normal points out of the"
        text += " room and -1 where it points in, or hold that edge"
        raise SurfaceError(text, what="rooms", where=room.name, found=ends.tolist())
    off = np.flatnonzero((left != 0.0) & ~lying)
    if not len(off):
        return
    expect_flat(surface, f"the volume of room {room.name!r}, whose boundary is off Π")
    X, count, ends = surface.vertices - surface.origin, left[off], edges[off]
    piece = components(ends, surface.n)[ends[:, 0]]
    for k in np.unique(piece):
        a, b = ends[piece == k].T
        n = count[piece == k]
        middle = np.average(0.5 * (X[a] + X[b]), axis=0, weights=segment_lengths(X, ends[piece == k]))
        yield float((n * _cones(middle, X[b], X[a])).sum())
        net = np.zeros(surface.n)
        np.add.at(net, b, n)
        np.add.at(net, a, -n)
        tips = np.flatnonzero(net)  # where it comes down to Π: closed straight from tip to tip
        if not grounded[tips].all():
            place = surface.vertices[tips[~grounded[tips]][0]]
            at = point_text(place, surface.size)
            text = f"room {room.name!r} does not close: its fixed boundary ends at {at}, off Π;"
            text += " fix it down to Π, or choose Π (plane=) through it"
            raise SurfaceError(text, what="rooms", where=room.name, found=place.tolist())
        if len(tips):
            yield float((net[tips] * _cones(middle, X[tips].mean(axis=0), X[tips])).sum())


def _cones(a: Floats, b: Floats, c: Floats) -> Floats:
    """(k,) signed volumes of the tetrahedra over triangles a, b, c seen from the origin."""
    return np.asarray(np.einsum("...i,...i->...", a, np.cross(b, c)) / 6.0)
