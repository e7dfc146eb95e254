"""Walls that pinch: where a junction comes down to Π the wall's height vanishes and it rests there.

A wall of tension α_w and height z over a length s costs α_w |z| s: not differentiable at z = 0. The
junction rests on Π where the pull of the sheets on it, up or down, is at most α_w per length, and stands
off, to the side it is pulled to, where the forces balance. While it rests, the wall below has no area: its
vertices coincide with the junction vertex above them (their *owner*), and its triangles are left out. So a
pinched wall is seen from the positions alone, and a surface with one needs no extra state.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..energy.functional import energy_and_gradient
from ..energy.motion_space import MotionSpace, VertexClasses, vertex_classes
from ..surface import Surface
from ..surface.checks import lying
from ..surface.geometry import area_vectors
from ..surface.topology import topology
from .wall_rows import crest_places, joined, places, wall_rows

SLACK = 1e-9  # of the capacity: an excess below is rounding


@dataclass(frozen=True, eq=False)
class Walls:
    """The walls that can pinch, those whose lower edge slides on Π, and how they hang from their crest.

    The crest is the junction above such a wall. A wall vertex hangs below the crest edge (i, j), at
    the fraction λ along it and the fraction ρ of the height there: 0 on Π, 1 at the crest. In a wall
    that leans or bulges it stands off from there, in proportion to the height.

    Attributes
    ----------
    hanging : (w,) vertices of such walls below the crest.
    ends : (w,2) crest vertices i, j that each hangs from.
    along, share : (w,) λ and ρ.
    lean : (w,3) what it stands off, over the height of the crest.
    can_rest : (n,) bool, free crest vertices.
    anchored : (n,) bool, fixed crest vertices on Π, where a wall ends in a corner.
    edges : (k,2) crest edges.
    tension : (k,) tension of the wall below each of those edges.
    side : (n,) +1 or -1, the side of Π a vertex stands on; on Π, the side it is pushed to.
    pinchable : (patches,) bool, the patches that are such walls.
    """

    hanging: Ints
    ends: Ints
    along: Floats
    share: Floats
    lean: Floats
    can_rest: Bools
    anchored: Bools
    edges: Ints
    tension: Floats
    side: Floats
    pinchable: Bools


def find_walls(surface: Surface) -> Walls:
    """The walls of a surface that can pinch, and how each vertex hangs from the crest."""
    n = surface.n
    height = surface.plane.height(surface.vertices)
    topo, roof = surface.topology, ~surface.walls[surface.patch_of_face]
    of_roof, outer = np.zeros(len(topo.edges), dtype=bool), np.zeros(n, dtype=bool)
    of_roof[topo.edge_of_face[roof]] = True
    outer[surface.faces[roof]] = True
    pinchable = np.zeros(len(surface.patches), dtype=bool)
    hanging, edges, tension = [], [np.empty((0, 2), dtype=np.int64)], [np.empty(0)]
    for index, patch in enumerate(surface.patches):
        if not patch.auxiliary:
            continue
        found = np.unique(topo.edge_of_face[surface.patch_of_face == index])
        sides, crest = topo.edges[found], topo.edges[found[of_roof[found]]]
        members = np.unique(sides)
        if not surface.on_plane[members].any() or not len(crest):
            continue
        pinchable[index] = True
        below = members[~outer[members]]
        hanging.append((below, *wall_rows(surface, below, crest, sides)))
        edges.append(crest)
        tension.append(np.full(len(crest), patch.tension))
    above = np.zeros(n, dtype=bool)
    above[np.concatenate(edges)] = True
    low = lying(height, surface.vertices)
    below, ends, along, share, lean = joined(hanging)
    return Walls(
        hanging=below,
        ends=ends,
        along=along,
        share=share,
        lean=lean,
        can_rest=above & ~surface.fixed & ~surface.on_plane,
        anchored=above & surface.fixed & low,
        edges=np.concatenate(edges),
        tension=np.concatenate(tension),
        side=np.where(np.where(low, _pushed(surface), height) < 0.0, -1.0, 1.0),
        pinchable=pinchable,
    )


def place_wall_rows(
    surface: Surface, below: Walls, X: Floats, space: MotionSpace | None = None
) -> Floats:
    """X (n,3) with every hanging vertex brought below its place on the crest.

    With the motion space given, only along the wall: what the vertex stands off across it stays.
    """
    if not len(below.hanging):
        return X
    place = places(surface, X, below.ends, below.along, below.share, below.lean)
    change = np.zeros_like(X)
    change[below.hanging] = place - X[below.hanging]
    if space is not None:
        change -= space.project(change)
    change[surface.fixed] = 0.0
    return X + change


def midpoints(surface: Surface, edges: Ints) -> Floats:
    """(k,3) the middles of edges (k,2), for a finer mesh.

    Where a wall's edge leads from a junction at rest to a standing vertex, its middle hangs in its row
    below the crest's middle: rows that coincide where the crest rests are apart again beside it.
    """
    start, end = edges.T
    X = surface.vertices
    middle = 0.5 * (X[start] + X[end])
    below = find_walls(surface)
    rests = resting(surface, below)
    if not rests.any():
        return middle
    crest, drop = X.copy(), np.zeros_like(X)
    crest[below.hanging] = crest_places(X, below.ends, below.along)
    drop[below.hanging] = (below.share - 1.0)[:, None] * np.array(surface.plane.normal) + below.lean
    down = rests.copy()
    down[below.hanging] = (rests | below.anchored)[below.ends].all(axis=1)
    of_wall = rests | below.can_rest
    of_wall[below.hanging] = True
    leaves = of_wall[start] & of_wall[end] & (down[start] != down[end])
    start, end = edges[leaves].T
    place = 0.5 * (crest[start] + crest[end])
    height = surface.plane.height(place)[:, None]
    middle[leaves] = place + 0.5 * height * (drop[start] + drop[end])
    return middle


def resting(surface: Surface, below: Walls) -> Bools:
    """(n,) junction vertices that rest on Π, seen from the positions."""
    height = surface.plane.height(surface.vertices)
    return below.can_rest & lying(height, surface.vertices)


def pinched(surface: Surface, below: Walls, rests: Bools) -> Surface:
    """The surface whose wall is gone below the resting vertices, which slide on Π.

    It has the same vertex array; vertices of the vanished wall belong to no face.
    """
    if not rests.any():
        return surface
    X = surface.vertices.copy()
    X[rests] -= surface.plane.height(X[rests])[:, None] * np.array(surface.plane.normal)
    group = _merged(surface.n, below, rests)
    X = X[group]
    F = group[surface.faces]
    apart = (F[:, 0] != F[:, 1]) & (F[:, 1] != F[:, 2]) & (F[:, 2] != F[:, 0])
    keep = apart & ~(_down(surface, below, rests)[F].all(axis=1) & _of_walls(surface))
    F, patch = np.ascontiguousarray(F[keep]), np.ascontiguousarray(surface.patch_of_face[keep])
    return surface._with(
        vertices=X, faces=F, patch_of_face=patch, topology=topology(F, patch, surface.n),
        on_plane=surface.on_plane | rests,
    )  # fmt: skip


def resting_crest(below: Walls, rests: Bools) -> Ints:
    """(k,2) from each resting junction vertex to its neighbours along the junction."""
    links = np.concatenate([below.edges, below.edges[:, ::-1]])
    return links[rests[links[:, 0]]]


def beside(below: Walls, rests: Bools) -> Bools:
    """(n,) standing crest vertices next to a resting one."""
    mask = np.zeros(len(rests), dtype=bool)
    for one, other in (below.edges.T, below.edges.T[::-1]):
        mask[one[rests[other]]] = True
    return mask & below.can_rest & ~rests


@dataclass(frozen=True, eq=False)
class Standing:
    """What of a surface stands, as the solver and the certificate see it.

    Attributes
    ----------
    surface : the pinched surface; see ``pinched``.
    walls, rests : of the whole surface; its junction vertices at rest on Π.
    classes : what the vertices lie on; those that rest follow the junction.
    """

    surface: Surface
    walls: Walls
    rests: Bools
    classes: VertexClasses

    @property
    def judged(self) -> Ints:
        """(k,3) the faces outside walls that may pinch, whose quality is judged."""
        return self.surface.faces[~self.walls.pinchable[self.surface.patch_of_face]]


def standing(surface: Surface, below: Walls | None = None, rests: Bools | None = None) -> Standing:
    """What stands of a surface; with its walls, and what rests, seen from the positions if not given."""
    below = find_walls(surface) if below is None else below
    rests = resting(surface, below) if rests is None else rests
    shown = pinched(surface, below, rests)
    classes = vertex_classes(shown, resting_crest(below, rests), beside(below, rests))
    return Standing(shown, below, rests, classes)


def pull_and_capacity(surface: Surface, below: Walls, rests: Bools) -> tuple[Floats, Floats]:
    """Pull (n,) on each resting vertex of a pinched surface and what the wall can take, force.

    The pull is the force of the sheets away from Π, to the vertex's own side; negative to the other.
    Lifting the vertex by dz to either side makes a wall of area ½ ℓ dz under each crest edge there, ℓ
    its length along Π, so the capacity is ½ Σ α_w ℓ; the vertex rests while |pull| ≤ capacity.
    """
    force = -energy_and_gradient(surface, supports=False)[1]
    pull = np.where(rests, below.side * (force @ np.array(surface.plane.normal)), 0.0)
    start, end = surface.vertices[below.edges.T]
    half = 0.5 * below.tension * np.linalg.norm(surface.plane.along(end - start), axis=1)
    capacity = np.zeros(surface.n)
    np.add.at(capacity, below.edges[:, 0], half)
    np.add.at(capacity, below.edges[:, 1], half)
    return pull, np.where(rests, capacity, 0.0)


def excess(surface: Surface, below: Walls, rests: Bools) -> Floats:
    """(n,) the pull on each resting vertex of a pinched surface beyond what its wall can take, force.

    At rest there is none: a junction that is pulled harder stands off Π. Signed as the pull is.
    """
    pull, capacity = pull_and_capacity(surface, below, rests)
    beyond = np.where(np.abs(pull) > capacity * (1.0 + SLACK), np.abs(pull) - capacity, 0.0)
    return np.copysign(beyond, pull)


def crest_spacing(surface: Surface, below: Walls) -> Floats:
    """(n,) the shorter crest edge at each crest vertex, length; infinite elsewhere."""
    ends = surface.vertices[below.edges]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    spacing = np.full(surface.n, np.inf)
    np.minimum.at(spacing, below.edges[:, 0], lengths)
    np.minimum.at(spacing, below.edges[:, 1], lengths)
    return spacing


def lifted(surface: Surface, below: Walls, free: Bools, fraction: float | Floats) -> Surface:
    """The full surface with the given resting vertices raised off Π by a fraction of their spacing.

    The fraction may be one for each vertex (n,). The wall below comes back hanging from them.
    """
    rise = fraction * np.where(free, crest_spacing(surface, below), 0.0) * below.side
    X = surface.vertices + rise[:, None] * np.array(surface.plane.normal)
    back = free[below.ends].any(axis=1)
    place = place_wall_rows(surface, below, X)
    X[below.hanging[back]] = place[below.hanging[back]]
    return surface.moved(X)


def settled(surface: Surface, below: Walls, rests: Bools, X: Floats) -> Floats:
    """X (n,3) with the vertices of vanished walls brought to their place on the resting junction.

    One of which a triangle still stands, as its lower corner, slides on Π and stays where it is.
    """
    stands = np.zeros(surface.n, dtype=bool)
    stands[pinched(surface, below, rests).faces] = True
    i, j = below.ends.T
    gone = (rests | below.anchored)[below.ends].all(axis=1) & ~stands[below.hanging]
    along = below.along[gone, None]
    X = X.copy()
    X[below.hanging[gone]] = (1.0 - along) * X[i[gone]] + along * X[j[gone]]
    return X[_merged(surface.n, below, rests)]


def _merged(n: int, below: Walls, rests: Bools) -> Ints:
    """(n,) the vertex each one coincides with: hanging straight below a resting one, or itself."""
    group = np.arange(n, dtype=np.int32)
    for end, at in ((0, 0.0), (1, 1.0)):
        owner = below.ends[:, end]
        straight = (below.along == at) & rests[owner]
        group[below.hanging[straight]] = owner[straight]
    return group


def _down(surface: Surface, below: Walls, rests: Bools) -> Bools:
    """(n,) vertices that lie on Π: resting, in a corner, or hanging from such or by nothing."""
    down = rests | below.anchored
    i, j = below.ends.T
    low_i, low_j = down[i] | (below.along == 1.0), down[j] | (below.along == 0.0)
    down[below.hanging] = (low_i & low_j) | (below.share == 0.0)
    return down


def _pushed(surface: Surface) -> Floats:
    """(n,) force along Π's normal with which the pressure of the sheets pushes each vertex."""
    vector = area_vectors(surface.vertices[surface.faces])
    force = (surface.pressures * ~surface.walls)[surface.patch_of_face] / 3.0
    push = force * (vector @ np.array(surface.plane.normal))
    return np.asarray(
        np.bincount(surface.faces.ravel(), np.repeat(push, 3), surface.n), dtype=float
    )


def _of_walls(surface: Surface) -> Bools:
    return surface.walls[surface.patch_of_face]
