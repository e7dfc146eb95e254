"""Walls that pinch: where a junction comes down to Π its wall has no height left, and it rests there.

A wall of tension α_w and height z over a length s costs α_w |z| s: not differentiable at z = 0. The
junction rests on Π where the pull of the sheets on it, up or down, is at most α_w per length. Where it is
more, the junction stands off Π, to the side it is pulled to, and the forces balance there. While it rests,
the wall below has no area: its vertices are at places on the junction, and its triangles are left out. The
``StandingPart`` remains, from which the whole surface follows; solvers and branches carry it along. In a file
positions alone show which walls are pinched.

A wall whose bottom is held can pinch where each top vertex has a bottom vertex below it. The junction
then rests on that curve, not on Π: a resting vertex is fixed on its bottom vertex, as long as the pull of the
sheets across the curve, to whichever side, is at most α_w per length. No wall with a held bottom pinches
before a solver has asked for it (``find_walls``): a solver asks where a junction comes down.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..base.arrays import Bools, Floats, Ints, kept_with_owner, mask_of, read_only
from ..base.errors import CurvedContactError
from ..base.tolerances import EXCESS, ON
from ..surface import Surface
from ..surface.checks import lying
from ..surface.geometry import area_vectors, edge_vectors, segment_lengths, unit_vectors
from ..surface.images import expect_no_images
from ..surface.supports import apply_supports
from ..surface.topology import topology
from .functional import energy_and_gradient, weighted
from .motion_space import MotionSpace, VertexClasses, vertex_classes
from .triangles import effective_tensions
from .wall_rows import WallRows, Walls, find_walls

# of a wall's height: where its top edge moves by less, its rows stay, or Newton would not converge
STILL = 1e-3
WEISZFELD = 30  # steps to the direction of the largest pull where walls meet


def place_wall_rows(surface: Surface, walls: Walls, X: Floats, space: MotionSpace | None = None) -> Floats:
    """X (n,3) with the rows of walls moved to their places below the top edges.

    With a motion space given, they move within the wall only: they keep their distance across it.
    """
    rows, change = walls.rows, np.zeros_like(X)
    if not len(rows.vertices):
        return X
    change[rows.vertices] = rows.places(surface, X) - X[rows.vertices]
    if space is not None:
        change -= space.project(change)
    if surface.on_planes:
        return X + apply_supports(surface, change, X)
    change[surface.fixed] = 0.0
    return X + change


def resting_vertices(surface: Surface, walls: Walls) -> Bools:
    """(n,) junction vertices that rest on Π, by their positions."""
    X, held, gap = surface.vertices, walls.held, surface.plane.height(surface.vertices)
    gap[held] = np.linalg.norm(X[held] - X[walls.foot[held]], axis=1)
    return walls.top_free & lying(gap, X)


def resting_links(walls: Walls, resting: Bools) -> Ints:
    """(k,2) from each resting junction vertex to its neighbours along the junction."""
    links = np.concatenate([walls.top_edges, walls.top_edges[:, ::-1]])
    return links[resting[links[:, 0]]]


@dataclass(frozen=True, eq=False)
class StandingPart:
    """The part of a surface that carries forces: without the walls that are pinched where junctions rest.

    It has the vertex array of the whole surface. Vertex v of the whole is at (1 - λ) X_i + λ X_j, with X the
    positions in the standing part: i = j = v outside the pinched walls, and inside them the resting junction
    vertices that v lies between.
    """

    whole: Surface  # with all its walls
    walls: Walls  # of the whole surface, those that can pinch
    resting: Bools  # (n,) its junction vertices at rest on Π
    surface: Surface  # the standing part; resting vertices slide on Π or are held on a bottom
    classes: VertexClasses  # what the vertices lie on; resting ones lie on the junction

    @classmethod
    def of(cls, whole: Surface, walls: Walls, resting: Bools) -> StandingPart:
        """The part that stands where the given vertices rest; CurvedContactError if elements are curved."""
        surface = whole
        if whole.order > 1 and resting.any():
            message = f"order: the junction comes down to the plane at vertex {resting.argmax()}, and only"
            message += " flat triangles have contact; give order=1"
            raise CurvedContactError(message, what="order", found=whole.order, expected=1)
        if resting.any():  # vertices of the walls left out belong to no face
            expect_no_images(whole, "a junction that comes to rest on the plane")
            X, held = _put_down(whole, walls, whole.vertices, resting), resting & walls.held
            owner, given = _owners(whole.n, walls, resting), whole.given_supports
            F, left = _standing_faces(whole, walls, resting, owner)
            F, patch = read_only(np.ascontiguousarray(F[left])), read_only(whole.patch_of_face[left])
            on_plane = whole.on_ground | (resting & ~held)
            rests = given._replace(fixed=given.fixed | held, on_plane=on_plane)
            surface = whole._with(
                vertices=X[owner],
                faces=F,
                patch_of_face=patch,
                topology=topology(F, patch, whole.n),
                cables=tuple(filter(None, (cable.carried(owner) for cable in whole.cables))),
                curves=(),
                **rests.resolved(whole.plane, whole.on_planes),
            )
        links, beside = resting_links(walls, resting), np.zeros(whole.n, dtype=bool)
        beside[links[:, 1]] = True
        classes = vertex_classes(surface, links, beside & walls.top_free & ~resting)
        return cls(whole, walls, resting, surface, classes)

    def keep(self) -> StandingPart:
        """The same, which ``standing_part`` of the whole surface gives from now on."""
        vars(self.whole)[standing_part.__name__] = self  # as ``kept_with_owner`` does
        return self

    def with_values(self, change: Callable[[Surface], Surface]) -> StandingPart:
        """The same with other tensions or pressures, as a function of the surface gives them."""
        surface = change(self.surface)
        whole = surface if self.whole is self.surface else change(self.whole)
        return replace(self, whole=whole, surface=surface)

    @property
    def quality_faces(self) -> Ints:
        """(k,3) the faces whose quality counts: those outside walls that can pinch."""
        return self.surface.faces[~self.walls.pinchable[self.surface.patch_of_face]]

    @property
    def faces_of_whole(self) -> Ints:
        """(k,) the faces of the whole surface that are those of the standing part, in the same order."""
        if not self.resting.any():
            return np.arange(self.whole.m)
        owner = _owners(self.whole.n, self.walls, self.resting)
        return np.flatnonzero(_standing_faces(self.whole, self.walls, self.resting, owner)[1])

    @cached_property
    def places(self) -> tuple[Ints, Floats]:
        """i, j (2,n) and λ (n,); a foot that still carries a triangle slides on Π and stays where it is."""
        n, walls, resting = self.whole.n, self.walls, self.resting
        rows, owner = walls.rows, _owners(n, walls, resting)
        gone = (resting | walls.corner)[rows.top_ends].all(axis=1)
        gone &= ~(mask_of(self.surface.faces, n) | self.whole.pinned)[rows.vertices]
        vertices, ends, share = rows.vertices[gone], np.tile(np.arange(n), (2, 1)), np.zeros(n)
        ends[:, vertices], share[vertices] = rows.top_ends[gone].T, rows.fraction[gone]
        return ends[:, owner], share[owner]

    def whole_positions(self, X: Floats) -> Floats:
        """(n,3) where the vertices of the whole surface are, with those of the standing part at X (n,3)."""
        if not self.resting.any():
            return X
        (start, end), share = self.places
        X = (1.0 - share[:, None]) * X[start] + share[:, None] * X[end]
        # beside another wall each keeps its plane
        return self.whole.onto_supports(X) if self.whole.on_planes else X

    def whole_at(self, X: Floats) -> Surface:
        """The whole surface, with the vertices of the standing part at X (n,3)."""
        return self.whole.moved(self.whole_positions(X))

    def follow(self, X: Floats, space: MotionSpace | None = None) -> Floats:
        """X (n,3) with the rows of walls placed below their top edges; see ``place_wall_rows``."""
        return place_wall_rows(self.surface, self.walls, X, space)

    @property
    def standing(self) -> Bools:
        """(n,) the junction vertices that can come to rest."""
        return self.walls.top_free & ~self.resting

    def coming_down(self, X: Floats, before: Floats, low: Floats | float = 0.0) -> Bools:
        """(n,) the standing junction vertices that a move from ``before`` to X (n,3) brings down.

        They reach Π or the curve of a held bottom, pass it, or come nearer to it than ``low``.
        """
        walls, standing, held = self.walls, self.standing, self.walls.held
        above, last = (walls.side * self.surface.plane.height(Y) for Y in (X, before))
        down = standing & ((above <= 0.0) | ((above < last) & (above <= low)))
        if not held.any():
            return down
        gap, gap_before = (walls.across_bottom(Y - Y[walls.foot], Y) for Y in (X, before))
        near, near_before = np.linalg.norm(gap, axis=1), np.linalg.norm(gap_before, axis=1)
        passes = np.einsum("ij,ij->i", gap, gap_before) <= 0.0
        return np.where(held, standing & (passes | ((near < near_before) & (near <= low))), down)

    def hardly_moves(self, before: Floats, X: Floats) -> bool:
        """Whether no top edge moves by more than ``STILL`` of the height of its wall."""
        rows = self.walls.rows
        moved, drop = rows.top_places(X) - rows.top_places(before), rows.drops(self.surface, X)
        return bool((np.linalg.norm(moved, axis=1) <= STILL * np.linalg.norm(drop, axis=1)).all())

    def landed(
        self, X: Floats, down: Bools, space: MotionSpace | None = None, before: Floats | float = 0.0
    ) -> Floats:
        """X (n,3) with the vertices ``down`` on Π or on their bottom, and the rows of walls below.

        With a motion space given, the other vertices over a held bottom slide along the junction to above
        their vertices of that: no farther than from ``before`` to X, so that a short move changes E little.
        """
        walls, moved = self.walls, np.linalg.norm(X - before, axis=1)
        X = _put_down(self.surface, walls, X, down)
        sliding = self.standing & ~down & walls.held
        if space is not None and sliding.any():
            gap = X - X[walls.foot]
            change = np.where(sliding[:, None], walls.across_bottom(gap, X) - gap, 0.0)
            change -= space.project(change)
            far = np.linalg.norm(change, axis=1) > moved
            change[far] *= (moved[far] / np.linalg.norm(change[far], axis=1))[:, None]
            X += change
        return self.follow(X, space)


def _put_down(surface: Surface, walls: Walls, X: Floats, down: Bools) -> Floats:
    """X (n,3) with the vertices ``down`` on Π, or on their vertices of a held bottom."""
    X, held = X.copy(), down & walls.held
    X[down] -= surface.plane.height(X[down])[:, None] * walls.rising(surface)[down]
    X[held] = X[walls.foot[held]]
    return X


@kept_with_owner
def standing_part(surface: Surface) -> StandingPart:
    """The part of a surface that stands, as a solver has left it or else by its positions.

    >>> from pcmc import Patch
    >>> square = Surface([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], [[0, 1, 2], [2, 3, 0]],
    ...                  [0, 0], [Patch("floor", 1.0)], fixed=range(4))
    >>> standing_part(square).surface is square
    True
    """
    return part_by_positions(surface)


def part_by_positions(surface: Surface, held: bool = False) -> StandingPart:
    """The same by the positions alone; with ``held``, walls with held bottoms can pinch (``find_walls``)."""
    walls = find_walls(surface, held)
    return StandingPart.of(surface, walls, resting_vertices(surface, walls))


def top_spacing(surface: Surface, walls: Walls) -> Floats:
    """(n,) the shorter top edge at each vertex of one, length; infinite elsewhere."""
    lengths = segment_lengths(surface.vertices, walls.top_edges)
    spacing = np.full(surface.n, np.inf)
    for end in walls.top_edges.T:
        np.minimum.at(spacing, end, lengths)
    return spacing


def lift(
    surface: Surface, walls: Walls, vertices: Bools, fraction: float | Floats, ways: Floats | None = None
) -> Surface:
    """The whole surface with resting ``vertices`` raised by a fraction of their spacing, and their wall rows.

    ``ways`` are directions (n,3), by default off Π.
    """
    ways = walls.side[:, None] * walls.rising(surface) if ways is None else ways
    spacing = top_spacing(surface, walls)
    rise = fraction * np.where(vertices & np.isfinite(spacing), spacing, 0.0)
    X = surface.vertices + rise[:, None] * ways
    below = walls.rows.vertices[vertices[walls.rows.top_ends].any(axis=1)]
    X[below] = place_wall_rows(surface, walls, X)[below]
    return surface.moved(X)


def _standing_faces(surface: Surface, walls: Walls, resting: Bools, owner: Ints) -> tuple[Ints, Bools]:
    """(m,3) faces between the owners of their vertices, and which of them stand (m,)."""
    F = owner[surface.faces]
    apart = (F[:, 0] != F[:, 1]) & (F[:, 1] != F[:, 2]) & (F[:, 2] != F[:, 0])
    wall = surface.auxiliary[surface.patch_of_face]
    down, rows = resting | walls.corner, walls.rows
    down[rows.vertices] = under_low(rows, down) | (rows.relative_height == 0.0)  # vertices on Π
    apart[wall] &= ~down[F[wall]].all(axis=1)
    # a foot that has come to its resting top takes faces beside it to the same three corners: together they
    # are no part of the wall that stands there, and would pull its next vertex down without end
    chosen = np.flatnonzero(apart & wall & resting[F].any(axis=1))
    if len(chosen):
        corners = np.sort(F[chosen], axis=1)
        _, same, count = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
        apart[chosen[count[same.ravel()] > 1]] = False
    return F, apart


def _owners(n: int, walls: Walls, resting: Bools) -> Ints:
    """(n,) the vertex each one coincides with: the resting one straight above it, or itself."""
    owner = np.arange(n, dtype=np.int32)
    for end, fraction in ((0, 0.0), (1, 1.0)):
        top = walls.rows.top_ends[:, end]
        straight = (walls.rows.fraction == fraction) & resting[top]
        straight &= (walls.rows.feet[:, 0] < 0) | (walls.rows.relative_height > 0.0)
        owner[walls.rows.vertices[straight]] = top[straight]
    held = np.flatnonzero(resting & walls.held)
    owner[walls.foot[held]] = held
    return owner


def under_low(rows: WallRows, low: Bools) -> Bools:
    """(w,) wall vertices whose place on the top edge is on Π: straight below a low end, or between two."""
    i, j = rows.top_ends.T
    return (low[i] | (rows.fraction == 1.0)) & (low[j] | (rows.fraction == 0.0))


def pull_and_capacity(part: StandingPart, force: Floats | None = None) -> tuple[Floats, Floats]:
    """Pull (n,) on each resting vertex and what the wall can take, force.

    The pull is the force of the sheets away from Π, to the vertex's own side; negative to the other.
    Lifting the vertex by dz to either side makes a wall of area ½ ℓ dz under each top edge there, ℓ
    its length along Π, so the capacity is ½ Σ α_w ℓ; the vertex rests while |pull| ≤ capacity.
    On a held bottom the pull is the force along the direction d of ``pull_directions``, and ℓ is taken on the
    bottom; where walls meet, the area is ½ ℓ |d × e| for an edge along e. See ``_lifting_forces``.
    ``force`` (n,3) is -∇E without supports, if that is known.
    """
    force = -energy_and_gradient(part.surface, supports=False)[1] if force is None else force
    d = pull_directions(part, force)
    pull = np.where(part.resting, np.einsum("ij,ij->i", _lifting_forces(part, force), d), 0.0)
    vertex, half, along = _edge_ends(part.surface, part.walls)
    across = np.linalg.norm(np.cross(d[vertex], along), axis=1)
    half = half * np.where((part.walls.meeting & part.walls.held)[vertex], across, 1.0)
    return pull, np.where(part.resting, np.bincount(vertex, half, part.whole.n), 0.0)


def spans(part: StandingPart) -> Ints:
    """(k,) the standing triangles of walls that reach from one resting vertex to another, over the bottom of
    what stands between: lifting one of them leaves that bottom where it is, and so their area."""
    low, surface = part.resting | part.walls.corner, part.surface
    within = part.walls.pinchable[surface.patch_of_face]
    return np.flatnonzero(within & (low[surface.faces].sum(axis=1) == 2))


def _lifting_forces(part: StandingPart, force: Floats) -> Floats:
    """The forces (n,3) -∇E on a standing part, at resting vertices those that lift them off their bottoms.

    There they are without those of the area of ``spans``, -½ α ν × e, e the side opposite, and with the
    pressure on the walls of the whole surface, as far as their vertices follow a lift, for that on what
    stands of them. Along a top edge it balances the pressures of the sheets to either side, where these
    differ; on the feet the bottom carries it.
    """
    surface, walls, rows = part.surface, part.walls, part.walls.rows
    left, chosen = force, spans(part)
    if len(chosen):
        left, F = force.copy(), surface.faces[chosen]
        P = surface.vertices[F]
        tension = effective_tensions(surface, surface.vertices, F, surface.patch_of_face[chosen])
        edges = edge_vectors(P)
        own = -0.5 * tension[:, None, None] * np.cross(unit_vectors(area_vectors(P))[:, None], edges)
        np.subtract.at(left, F, own)
    pressures = np.where(walls.pinchable, surface.net_pressures, 0.0)
    if pressures.any():
        standing, whole = (weighted(each, pressures=pressures)[1] for each in (surface, part.whole))
        gone = np.flatnonzero(~mask_of(surface.faces, surface.n)[rows.vertices])
        below = rows.relative_height[gone, None] * whole[rows.vertices[gone]]
        left = left + np.where(part.resting[:, None], standing - whole, 0.0)
        for end, share in enumerate((1.0 - rows.fraction[gone], rows.fraction[gone])):
            np.subtract.at(left, rows.top_ends[gone, end], share[:, None] * below)
    return left


def _edge_ends(surface: Surface, walls: Walls) -> tuple[Ints, Floats, Floats]:
    """Of both ends of each top edge: the vertex (2k,), ½ α_w ℓ (2k,), and the edge's unit vector (2k,3)."""
    feet = walls.foot[walls.top_edges]
    held = (feet >= 0).all(axis=1, keepdims=True)
    start, end = surface.vertices[np.where(feet >= 0, feet, walls.top_edges).T]
    span = np.where(held, end - start, surface.plane.along(end - start))
    length = np.linalg.norm(span, axis=1)
    half = 0.5 * surface.tensions[walls.wall_below] * length
    along = span / np.where(length > 0.0, length, 1.0)[:, None]
    return walls.top_edges.T.ravel(), np.tile(half, 2), np.tile(along, (2, 1))


def excess_pull(part: StandingPart, force: Floats) -> Floats:
    """(n,) the pull on each resting vertex beyond what its wall can take, force.

    Zero at equilibrium: a junction that is pulled harder stands off Π. Signed as the pull is.
    """
    pull, capacity = pull_and_capacity(part, force)
    beyond = np.where(np.abs(pull) > capacity * (1.0 + EXCESS), np.abs(pull) - capacity, 0.0)
    return np.copysign(beyond, pull)


def pull_directions(part: StandingPart, force: Floats) -> Floats:
    """(n,3) the direction to lift each vertex: off Π by 1, or the unit one in which a held one is pulled.

    Where held walls meet, they resist a motion d by h(d) = Σ c |d × e|, c = ½ α_w ℓ, most where it is across
    all of them. The direction is the one of the largest ⟨f, d⟩ / h(d): there f ∝ M d, M = Σ c (1 - e eᵀ) /
    |d × e|, a fixed point (Weiszfeld's). An upright plane takes what is across it.
    """
    surface, walls, resting = part.surface, part.walls, part.resting
    direction = walls.side[:, None] * walls.rising(surface)
    held = resting & walls.held
    if not held.any():
        return direction
    force = _lifting_forces(part, force)
    pull = walls.across_bottom(force, surface.vertices)
    length = np.linalg.norm(pull, axis=1)
    pulled = held & (length > 0.0)
    direction[pulled] = pull[pulled] / length[pulled, None]
    vertex, c, e = _edge_ends(surface, walls)
    meet = np.flatnonzero(pulled & walls.meeting)
    if not len(meet):
        return direction
    here = np.isin(vertex, meet)
    number, c, e = np.searchsorted(meet, vertex[here]), c[here], e[here]
    P = c[:, None, None] * (np.eye(3) - e[:, :, None] * e[:, None, :])
    d = direction[meet]
    free = walls.admissible.projectors(meet)
    for _ in range(WEISZFELD):
        M = np.zeros((len(meet), 3, 3))
        turned = np.linalg.norm(np.cross(d[number], e), axis=1)
        np.add.at(M, number, P / np.maximum(turned, ON)[:, None, None])
        d = (np.linalg.pinv(free @ M @ free, hermitian=True) @ force[meet, :, None])[:, :, 0]
        d /= np.linalg.norm(d, axis=1)[:, None]
    direction[meet] = d
    return direction
