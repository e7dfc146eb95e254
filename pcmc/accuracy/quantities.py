"""What a designer reads from a surface at rest: heights, areas, volume, energy, reactions, softest mode."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.tolerances import ON
from ..certificate import Certificate
from ..certificate.supports import FORCE, line_rows, support_vertices
from ..forces.rooms import closing_volumes, prescribed_volumes, room_pressures
from ..forces.volume_below import volume_below
from ..surface import Surface
from ..surface.pieces import point_text

ROUNDING = 1e-10  # of a quantity's size: what solving to rest leaves open
SAME = 1e-6  # of the size, cubed: volumes this near are one, up to what solving to rest leaves open
RESIDUALS = 10.0  # that a quantity may change with the forces left, relative
EIGENVALUES = 1e-12  # of the largest eigenvalue: rounding of the lowest one
STIFFEST = 10.0  # the largest eigenvalue in units of α over the area of a triangle

Key = tuple[str, str, str, bytes]
"""Quantity and patch; or quantity, patches at a held line, and its vertices in the coarsest mesh."""


@dataclass(frozen=True)
class Reading:
    """A quantity of one surface."""

    quantity: str
    of: str  # the patch or boundary it belongs to; empty for the whole
    value: float  # as read from the mesh
    estimate: float  # of the same limit, but smoother from mesh to mesh; the same as ``value`` for most
    rounding: float  # differences up to this size are none; 0 for a value that is given


def readings(surface: Surface, certificate: Certificate, vertices: int) -> dict[Key, Reading]:
    """The quantities of a surface. Keys are the same for all refinements of one surface.

    All supports together carry the loads in the limit; on a mesh forces within the sheets, which move no
    vertex, keep a part that comes and goes from mesh to mesh. So the loads are the estimate of the reaction.
    ``vertices`` is the number of vertices of the coarsest mesh, which come first in all finer ones.
    """
    share, areas = ROUNDING + RESIDUALS * certificate.residual, certificate.patches["area"].to_numpy()
    size, tension, whole = surface.size, float(surface.tensions.max()), float(areas.sum())
    found: dict[Key, Reading] = {}

    def add(
        what: str, of: str, value: float, rounding: float, estimate: float | None = None, key: Any = ()
    ) -> None:
        reading = Reading(what, of, value, value if estimate is None else estimate, rounding)
        found[key or (what, of, "", b"")] = reading

    for k, patch in enumerate(surface.patches):
        if surface.roof[k]:
            add("height", patch.name, *_height(surface, k, share * size))
    for patch, area in zip(surface.patches, areas.tolist(), strict=True):
        add("area", patch.name, area, share * size**2)
    given = given_volume(surface)
    add("volume", "", *((certificate.volume, share * size**3) if given is None else (given, 0.0)))
    for room, pressure in zip(surface.rooms, room_pressures(surface).tolist(), strict=True):
        add("pressure", room.name, pressure, share * tension / size)
    add("energy", "", certificate.energy, share * tension * whole)
    pull = share * tension * size
    against = 0.0 - certificate.load  # never -0
    add("reaction", "", certificate.support, pull, against)
    normal = np.array(surface.plane.normal)
    lifts = certificate.supports[[*FORCE]].to_numpy() @ normal
    alone = (np.abs(lifts) > pull).sum() == 1  # an upright mirror plane carries nothing up
    for on, patches, name, force, most in _held_lines(surface, certificate):
        old = np.sort(on[on < vertices]).tobytes()
        up, along = float(force @ normal), np.linalg.norm(surface.plane.along(force))
        loads = against if alone and abs(up) > pull else None
        add("reaction", name, up, pull, loads, ("reaction", "", patches, old))
        add("thrust", name, float(along), pull, None, ("thrust", "", patches, old))
        what = "reaction per length"
        add(what, name, most, share * tension, None, (what, "", patches, old))
    if len(certificate.eigenvalues):
        stiffest = STIFFEST * tension * surface.m / whole
        rounding = share * tension / size**2 + EIGENVALUES * stiffest
        add("lowest eigenvalue", "", float(certificate.eigenvalues[0]), rounding)
    return found


def given_volume(surface: Surface) -> float | None:
    """The volume under the roof, where the prescribed volumes of rooms fix it; else None.

    A room between plates that are not upright encloses another volume than the roof has over Π.

    >>> from pcmc import Patch, Room
    >>> X, F = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 3]], [[0, 1, 3], [1, 2, 3], [2, 0, 3]]
    >>> tent = Surface(X, F, [0] * 3, [Patch("tent", 2.0)], fixed=range(3))
    >>> given_volume(tent) is None
    True
    >>> rooms = [Room("all", {"tent": 1}, 0.5)]
    >>> round(given_volume(Surface(X, F, [0] * 3, tent.patches, fixed=range(3), rooms=rooms)), 12)
    0.5
    """
    if not surface.rooms or np.any(closing_volumes(surface)):
        return None
    signs, roof = surface.room_signs, surface.roof.astype(float)
    share = np.round(np.linalg.lstsq(signs.T, roof)[0], 9)  # most are whole: no rounding in the sum
    given = float(share @ prescribed_volumes(surface))
    same = abs(given - volume_below(surface)) <= SAME * surface.size**3
    return given if same and np.abs(share @ signs - roof).max() <= ROUNDING else None


def _held_lines(surface: Surface, certificate: Certificate) -> Iterator[tuple[Ints, str, str, Floats, float]]:
    """Each held line, of the boundary or inside: its vertices (k,), the names of its patches, its own name,
    its reaction (3,) and the largest one per length.

    Of several lines of one name, each is named with its place; those around one centre with the number of
    their support, too.
    """
    table = certificate.supports.iloc[line_rows(certificate.acting)]
    on, names = support_vertices(certificate.acting), table["name"].astype(str).tolist()
    middles, forces = (table[[*columns]].to_numpy() for columns in ("xyz", FORCE))
    near = [f"{name} near {point_text(at, surface.size)}" for name, at in zip(names, middles, strict=True)]
    places = [one if names.count(one) == 1 else other for one, other in zip(names, near, strict=True)]
    numbers = table["support"].tolist()
    own = [at if places.count(at) == 1 else f"{at}, {k}" for at, k in zip(places, numbers, strict=True)]
    most = table["per_length_max"].tolist()
    yield from zip([on[k] for k in numbers], names, own, forces, most, strict=True)


def _height(surface: Surface, patch: int, rounding: float) -> tuple[float, float, float]:
    """Height of a patch's ``summit`` over Π, ``rounding``, and that of the smooth surface through it.

    The highest vertex is up to half an edge beside the top, at random from mesh to mesh. The paraboloid
    through it and its neighbours, or on a junction the parabola, has its top at the surface's own. In a
    mirror plane the images of its neighbours belong to them.
    """
    local, topo = surface.plane.to_local(surface.vertices), surface.topology
    top, side = summit(surface, patch)
    value, on_junction = float(local[top, 2]), topo.on_junction[top]
    mirrors = [plane for plane, mask in surface.on_planes if plane.mirror and mask[top]]
    if surface.fixed[top] or surface.on_plane[top] or (surface.held[top] and not mirrors):
        return value, rounding, value
    around = (topo.edges == top).any(axis=1)
    if on_junction:
        around &= topo.junction_edge | topo.seam_edge
    beside = surface.vertices[topo.edges[around].sum(axis=1) - top]
    for plane in mirrors:
        beside = np.concatenate([beside, beside - 2.0 * plane.height(beside)[:, None] * plane.normal])
    step = surface.plane.to_local(beside) - local[top]
    if on_junction:
        if len(beside) != 2:
            return value, rounding, value
        along = step[0, :2] - step[1, :2]
        along /= np.linalg.norm(along) or 1.0
        step = np.column_stack([step[:, :2] @ along, np.zeros(2), step[:, 2]])
    # how far the top of the paraboloid through 0 and these points is above 0
    x, y, z = (step * [1.0, 1.0, side]).T
    a, b, xx, xy, yy = np.linalg.lstsq(np.column_stack([x, y, 0.5 * x * x, x * y, 0.5 * y * y]), z)[0]
    slope, bend = np.array([a, b]), np.array([[xx, xy], [xy, yy]])
    place = -np.linalg.pinv(bend) @ slope
    rise = 0.5 * float(slope @ place)
    near = np.linalg.norm(place) <= np.linalg.norm(step[:, :2], axis=1).max()
    return value, rounding, value + side * (rise if near and rise > 0.0 else 0.0)


def summit(surface: Surface, patch: int) -> tuple[int, float]:
    """The highest vertex of a patch, and 1; of one with none above Π, as a cushion's lower sheet, the lowest,
    and -1."""
    vertices = np.unique(surface.faces[surface.patch_of_face == patch])
    height = surface.plane.height(surface.vertices[vertices])
    side = 1.0 if height.max() > ON * surface.size else -1.0
    return int(vertices[(side * height).argmax()]), side
