"""The forces on a surface, by cause and by support: every table of forces is a sum of these.

Along a line a support holds the pull of the sheets there, Σ (α + w z) n per length with their outward
co-normals n, as far as it can: a plane holds the part across itself. The forces at the vertices are

    f_v = Σ ½ L_e Σ (α + w z) n_e over the held edges e at v + the ends of cables + r_v,

with r_v half the same sums over the other edges at v, less ⅓ Σ p A_T ν_T. Where sheets are smooth r_v is
O(h²), as curvature balances pressure, and beside corners and where junctions end O(h): nothing of it is
left in the limit. Forces at points are those of cables that end, and of points held alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..base.arrays import Bools, Floats, Ints, kept_with_owner, mask_of, read_only
from ..base.tolerances import FORCE_ROUNDING
from ..forces import cables
from ..forces.cables import directions, pull_along
from ..forces.elements import Points, add_values, energy_mesh
from ..forces.pinching import standing_part
from ..forces.triangles import totals_and_gradient
from ..surface import Plane, Surface
from ..surface.checks import lying
from ..surface.geometry import end_tangent, segment_lengths, vertex_sums
from ..surface.parts import Cable
from ..surface.supports import apply_supports, symmetric_part
from ..surface.topology import EdgeCurve

DAMPED = 1e-4  # of 1: bends that the next triangles do not tell stay small
NARROW = 0.02  # of the size of a triangle and the next ones: a lower one keeps its own co-normal

CableEnd = tuple[Cable, int, Floats]


def loads(surface: Surface) -> Floats:
    """(m + c,3) the force on each triangle, (p - s) A ν of pressure and snow, -w A n of weight; and -g ℓ n on
    each edge of cables. On curved elements it is given at each point of the quadrature."""
    mesh = energy_mesh(surface)
    vector = Points.of(mesh, surface.vertices).area.reshape(-1, 3)
    patch = np.repeat(mesh.patch, len(vector) // len(mesh.patch))
    found = surface.net_pressures[patch, None] * vector
    ends, _, weight = surface.cable_edges
    areas, lengths = np.linalg.norm(vector, axis=1), segment_lengths(surface.vertices, ends)
    heavy = np.append(surface.weights[patch] * areas, weight * lengths)
    found = np.concatenate([found, np.zeros((len(ends), 3))])
    return found - heavy[:, None] * np.array(surface.plane.normal) if surface.heavy else found


def load_places(surface: Surface) -> Floats:
    """(m + c,3) where the forces of ``loads`` act: the middles of the triangles and of the cables' edges."""
    X = surface.vertices
    places = Points.of(energy_mesh(surface), X).place.reshape(-1, 3)
    return np.concatenate([places, X[surface.cable_edges.ends].mean(axis=1)])


@kept_with_owner
def total_load(surface: Surface) -> float:
    """The force of pressure, snow and weight along Π's normal."""
    return along_normal(surface, loads(surface))


def along_normal(surface: Surface, forces: Floats) -> float:
    """The sum of forces (k,3) along Π's normal; 0 where rounding alone is left of them."""
    total = float((forces @ np.array(surface.plane.normal)).sum())
    return total if abs(total) > rounding_of(forces) else 0.0


def rounding_of(forces: Floats) -> float:
    """What rounding leaves of the sum of forces (k,3) that cancel, force."""
    return FORCE_ROUNDING * float(np.linalg.norm(forces, axis=1).sum())


def support_forces(surface: Surface) -> Floats:
    """(n,3) forces of the supports: the whole force where fixed, its part normal to the plane where sliding.

    In a mirror plane this part is the pull of the image. The force of tension is -Σ α ∂A, that of pressure
    Σ p ∫ N_i ν dA, of a flat triangle a third. At a boundary these are not -∇E: there the volume is that of a
    cone to the point of Π, whose side is under no pressure.
    """
    X, mesh = surface.vertices, energy_mesh(surface)
    pull = totals_and_gradient(mesh._replace(pressure=read_only(np.zeros(len(surface.patches)))), X)[1]
    add_values(cables.elements(surface, X), pull)
    pushed = mesh.pressure[mesh.patch, None, None] * Points.of(mesh, X).area
    corners = np.einsum("qk,eqd->ekd", mesh.shapes.value, pushed)
    total = surface.folded(vertex_sums(corners, mesh.faces, len(X)) - pull)
    return apply_supports(surface, total.copy()) - total


@dataclass(frozen=True, eq=False)
class Forces:
    """The forces on the part of a surface that stands. ``along``, ``points`` and the pull of images are all
    of the ``reactions``."""

    surface: Surface
    standing: Surface  # the part of it that stands, which the supports hold
    loads: Floats  # (m + c,3) on its triangles and cable edges
    reactions: Floats  # (n,3) of all supports
    along: Floats  # (n,3) the reactions on lines and sheets
    points: Floats  # (n,3) at single points, and of the cables that end on a line
    lines: Bools  # (e,2) the ends of edges that are held as lines: of the boundary, of lines inside the
    # surface, and of junctions that a plane holds, as on an upright wall, or that rest on Π
    lengths: Floats  # (n,) half the length of the edges of ``lines`` at each vertex; 0 where there is none
    pulls: Floats  # (e,3) force per length that holds the sheets along the edges of ``lines``; else 0
    clamped: Bools  # (n,) the vertices that cannot move, or only along a line that was given
    single: Bools  # (n,) those of them that are in no line
    on_boundary: Bools  # (n,) the vertices of the held boundary
    by_plane: Floats  # (1 + planes,n,3) what Π and each of ``on_planes`` carry at the vertices on them
    by_plane_ends: Floats  # (1 + planes,n,3) the part of these that holds the ends of cables
    cable_ends: list[CableEnd]

    @classmethod
    def of(
        cls,
        surface: Surface,
        given: Floats | None = None,
        standing: Surface | None = None,
        at_ends: list[CableEnd] | None = None,
    ) -> Forces:
        """The forces on a surface, with its own reactions or ``given`` ones (n,3); so ``at_ends`` of cables.

        A vertex on several planes divides its force among them: Σ c_i n_i of their normals. Where a fixed
        vertex lies in mirror planes, these take the part across them.

        >>> from pcmc import Patch
        >>> square = Surface([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], [[0, 1, 2], [2, 3, 0]],
        ...                  [0, 0], [Patch("floor", 1.0, pressure=0.0)], fixed=range(4))
        >>> acting = Forces.of(square)
        >>> acting.reactions[1].tolist()[:2], acting.pulls[0].tolist()  # the edge from (1, 1) to (-1, 1)
        ([-1.0, 1.0], [0.0, 1.0, 0.0])
        """
        standing = standing_part(surface).surface if standing is None else standing
        forces = support_forces(standing) if given is None else given
        topo, cables = surface.topology, cable_ends(standing) if at_ends is None else at_ends
        ends = np.zeros_like(forces)
        for _, vertex, force in cables:
            ends[vertex] += force
        ends -= apply_supports(standing, ends.copy())
        clamped, on, by_plane, by_plane_ends = _divided(standing, forces, ends)
        mirror = np.array([False, *(plane.mirror for plane, _ in standing.on_planes)])
        boundary, held = held_boundary(surface), standing.supported
        on_boundary, used = np.zeros((2, surface.n), dtype=bool)
        on_boundary[topo.edges[boundary]] = True
        used[standing.topology.faces] = used[standing.cable_edges.ends] = True
        single, sliding = (used & ~on_boundary & side for side in (clamped, held & ~clamped))
        between = topo.junction_edge | topo.seam_edge
        junction = between & at_both_ends(held, topo.edges)
        drawn = (between | surface.edges_on_curves.drawn) & ~topo.boundary_edge
        inner = at_both_ends(single, topo.edges) | (drawn & at_both_ends(clamped, topo.edges))
        lines = (junction[:, None] & sliding[topo.edges]) | (inner | boundary)[:, None]

        some = np.flatnonzero(lines.any(axis=1))
        half = np.repeat(0.5 * segment_lengths(surface.vertices, topo.sides[some])[:, None], 2, axis=1)
        lengths = np.bincount(topo.edges[some][lines[some]], half[lines[some]], surface.n).astype(float)
        pulls = np.zeros((len(lines), 3))
        pulls[some] = sheet_pulls(standing, topo.edges[some])
        part = some[~at_both_ends(clamped, topo.edges[some])]  # a plane holds the part across itself
        common = (on | clamped)[:, topo.edges[part]].all(axis=2) & ~mirror[:, None]
        pulls[part] = _by_normal(_normals(standing), common, pulls[part]).sum(axis=0)
        inside, alone = forces - by_plane[mirror].sum(axis=0), single & (lengths == 0.0)
        points = np.where(lengths[:, None] > 0.0, ends - by_plane_ends[mirror].sum(axis=0), 0.0)
        points[alone] = inside[alone]
        return cls(
            surface=surface,
            standing=standing,
            loads=loads(standing),
            reactions=forces,
            along=inside - points,
            points=points,
            lines=lines,
            lengths=lengths,
            pulls=pulls,
            clamped=clamped,
            single=alone,
            on_boundary=on_boundary,
            by_plane=by_plane,
            by_plane_ends=by_plane_ends,
            cable_ends=cables,
        )

    @property
    def per_length(self) -> Floats:
        """(n,3) the mean of ``pulls`` along the lines at a vertex, force/length; NaN where there is none."""
        force, share = self.half_pulls(slice(None), self.pulls, self.lines), self.lengths[:, None]
        return np.divide(force, share, out=np.full(force.shape, np.nan), where=share > 0.0)

    def half_pulls(self, edges: Any, pulls: Floats, ends: Bools | None = None) -> Floats:
        """(n,3) half the pulls (k,3) along some edges at each end of these, or at the ``ends`` (k,2)."""
        topo, force = self.surface.topology, np.zeros_like(self.reactions)
        half = 0.5 * segment_lengths(self.surface.vertices, topo.sides[edges])[:, None] * pulls
        for side in (0, 1):
            np.add.at(force, topo.edges[edges, side], half if ends is None else half * ends[:, [side]])
        return force

    def along_patch(self, patch: int | None) -> Bools:
        """(e,) the edges of lines that belong to a patch, or all of them."""
        topo = self.surface.topology
        own = np.full(len(topo.edges), patch is None)
        own[topo.edge_of_face[self.surface.patch_of_face == patch]] = True
        return own & self.lines.any(axis=1)

    def largest_per_length(self, patch: int | None = None) -> float | None:
        """The largest of ``pulls`` on lines at the edges of a patch, or on all; None without any."""
        sizes = np.linalg.norm(self.pulls[self.along_patch(patch)], axis=1)
        return float(sizes.max()) if len(sizes) else None


def at_both_ends(mask: Bools, edges: Ints) -> Bools:
    """(e,) whether both ends of edges (e,2) are in a mask (n,)."""
    return np.asarray(mask[edges[:, 0]] & mask[edges[:, 1]])


def held_boundary(surface: Surface) -> Bools:
    """(e,) edges of the boundary that are held at both ends, but for those in mirror planes."""
    topo = surface.topology
    return topo.boundary_edge & ~surface.mirror_edge & at_both_ends(surface.supported, topo.edges)


def sheet_pulls(surface: Surface, ends: Ints) -> Floats:
    """(k,3) Σ (α + w z) n of the sheets at edges, given by their ends (k,2); 0 where there is none.

    n is the outward co-normal of the curved sheet, see ``SheetSides``; force/length. Along a junction of
    smooth surfaces at rest (7) without a cable it is zero, of triangles only in the limit.
    """
    sides, total = SheetSides.at(surface, ends), np.zeros((len(ends), 3))
    np.add.at(total, sides.edge, sides.pulls(surface.vertices[sides.corners], *sides.laws(surface)))
    return total


class SheetSides(NamedTuple):
    """The sides of triangles at some edges. Each goes from a to b, and has the corner c opposite.

    A triangle is parallel to its sheet about in its middle, not at its side. In its plane, with x along the
    side from its middle, y inwards and z along the normal ν, the sheet is

        z = ½ K_xx x² + ½ K_yy y² + K_xy x y + g y + z_0,     K_xx + K_yy = -(p - w ⟨ν, n⟩) / (α + w z),

    through a, b and c, and as nearly as it can through the far corners d and e of the next triangles of the
    sheet. Its co-normal at the side is that of the triangle turned by the slope g: for a smooth sheet at rest
    its error is O(h²), that of the triangle's own O(h). A triangle that is nearly flattened keeps its own.
    """

    edge: Ints  # (s,) which of the edges
    patch: Ints  # (s,)
    corners: Ints  # (s,5) c, a, b, and d and e beyond b c and c a; a corner of its own where there is none
    plane: Plane

    @classmethod
    def at(cls, surface: Surface, ends: Ints) -> SheetSides:
        """Those at edges that are given by their ends (k,2); none where there is no edge."""
        topo, F = surface.topology, surface.faces
        numbers = topo.edge_numbers(ends)
        row = np.full(len(topo.edges), -1)
        row[numbers[numbers >= 0]] = np.flatnonzero(numbers >= 0)
        edge = row[topo.edge_of_face]
        face, corner = np.nonzero(edge >= 0)
        own = (corner[:, None] + np.arange(3)) % 3
        beyond = _far_corners(surface, 3 * face[:, None] + own[:, 1:])
        corners = np.column_stack([F[face[:, None], own], beyond])
        return cls(edge[face, corner], surface.patch_of_face[face], corners, surface.plane)

    def laws(self, surface: Surface) -> tuple[Floats, Floats, Floats]:
        """α, w and p (s,) of the sheets."""
        of_patches = surface.tensions, surface.weights, surface.net_pressures
        alpha, weight, pressure = (law[self.patch] for law in of_patches)
        return alpha, weight, pressure

    def pulls(self, X: Any, alpha: Any, weight: Any, pressure: Any) -> Any:
        """(s,3) (α + w z) n with the corners at X (s,5,3), z the height over Π of a side's middle.

        Complex arguments are allowed, so that derivatives are exact by complex steps.
        """
        up, middle = np.array(self.plane.normal), 0.5 * (X[:, 1] + X[:, 2])
        tension = alpha + weight * ((middle - np.array(self.plane.point)) @ up)
        t, length = _unit(X[:, 2] - X[:, 1])
        n, height = _unit(middle - X[:, 0] + _dot(X[:, 0] - middle, t) * t)
        normal, away = np.cross(n, t), X - middle[:, None]
        least = NARROW * np.abs(away.real).max(axis=(1, 2))
        thin = np.minimum(length[:, 0].real, height[:, 0].real) <= least
        away = np.where(thin[:, None, None], 0.0, away)
        size = np.where(thin, 1.0, length[:, 0])
        x, y, z = (_dot(away, axis[:, None])[:, :, 0] / size[:, None] for axis in (t, -n, normal))
        terms = np.stack([0.5 * x * x, 0.5 * y * y, x * y], axis=2)
        high = np.where(thin, 1.0, y[:, 0])
        rise = terms[:, 0] - terms[:, 1]
        # of a and b all terms are the same: the plane through them and c has no slope along x
        beyond = terms[:, 3:] - terms[:, 1:2] - (y[:, 3:] / high[:, None])[:, :, None] * rise[:, None]
        trace = (weight * (normal @ up) - pressure) / np.where(tension == 0.0, 1.0, tension) * size
        rows = np.concatenate([np.broadcast_to([[[1.0, 1.0, 0.0]]], beyond[:, :1].shape), beyond], axis=1)
        back, right = rows.swapaxes(1, 2), np.column_stack([trace, z[:, 3:]])[:, :, None]
        bends = np.linalg.solve(back @ rows + DAMPED * np.eye(3), back @ right)[:, :, 0]
        slope = -_dot(rise, bends) / high[:, None]
        return tension[:, None] * _unit(n - slope * normal)[0]


def _far_corners(surface: Surface, corners: Ints) -> Ints:
    """(s,2) beyond the sides opposite some corners, by their numbers 3 face + corner (s,2): the corner of the
    next triangle of the same sheet; that corner itself where there is none, or only an image of it."""
    topo, F = surface.topology, surface.faces
    ended, near = topo.curve_edge | surface.edges_on_curves.drawn, mask_of(corners, F.size)
    pairs = topo.neighbours
    pairs = pairs[near[pairs[:, 0]] | near[pairs[:, 1]]]
    pairs = pairs[~ended[topo.edge_of_face.ravel()[pairs[:, 0]]]]
    ends = np.sort(F[pairs[:, :, None] // 3, (pairs[:, :, None] % 3 + [1, 2]) % 3])
    pairs = pairs[(ends[:, 0] == ends[:, 1]).all(axis=1)]
    far = np.arange(F.size)
    far[pairs] = pairs[:, ::-1]
    return F.ravel()[far[corners]]


def _dot(u: Any, v: Any) -> Any:
    """(…,1) the products of vectors (…,3), without conjugates."""
    return (u * v).sum(axis=-1, keepdims=True)


def _unit(v: Any) -> tuple[Any, Any]:
    """Vectors (s,3) over their lengths, and the lengths (s,1); 0 where that is 0."""
    size = np.sqrt(_dot(v, v))
    return v / np.where(size == 0.0, 1.0, size), size


def cable_parts(surface: Surface) -> list[tuple[Cable, EdgeCurve]]:
    """The parts of each cable of tension > 0 between its ends, branches, other cables, and the supports in
    between.

    A support in between is a mast that it runs over: a fixed vertex beside one that moves.
    """
    parts, meeting = [], np.bincount(surface.cable_edges.ends.ravel(), minlength=surface.n) > 2
    for cable in surface.cables:
        if cable.tension > 0.0:
            leading, kink = cable.edges[surface.fixed[cable.edges].sum(axis=1) == 1], meeting.copy()
            kink[leading] |= surface.fixed[leading]
            parts += [(cable, curve) for curve in surface.topology.chains(cable.edges, kink)]
    return parts


def cable_ends(
    surface: Surface, X: Floats | None = None, tensions: Mapping[str, Floats] | None = None
) -> list[CableEnd]:
    """Each end of a part of a cable: the cable, the vertex, and the force -(τ + g z) t (3,) that holds it; or
    with other positions X (n,3) and ``tensions`` (k,) of the edges of each cable, by name. t is the tangent
    there, ``end_tangent``."""
    found, X = [], surface.vertices if X is None else X
    for cable, curve in cable_parts(surface):
        for pair, pairs in zip(curve.ends, (curve.pairs[:2], curve.pairs[:-3:-1, ::-1]), strict=False):
            pull = pull_along(surface, cable, pair[:1])
            if tensions is not None:
                pull = tensions[cable.name][(np.sort(cable.edges, axis=1) == np.sort(pair)).all(axis=1)]
            found.append((cable, int(pair[0]), -pull * end_tangent(*directions(X, pairs))))
    return found


def _divided(surface: Surface, forces: Floats, ends: Floats) -> tuple[Bools, Bools, Floats, Floats]:
    """The vertices (n,) that lines and points hold; those on Π and the other planes (1 + planes,n); and what
    each plane carries of the forces and of those at the ``ends`` of cables (1 + planes,n,3)."""
    X, mirror = surface.vertices, np.array([[False], *([plane.mirror] for plane, _ in surface.on_planes)])
    ground = surface.on_plane | (surface.fixed & lying(surface.plane.height(X), X))
    on = np.array([ground, *(mask for _, mask in surface.on_planes)])
    clamped = surface.given_supports.fixed_and_sliding()[0] | surface.pinned  # at rest on a held bottom, too
    across = [part - symmetric_part(surface.on_planes, part.copy()) for part in (forces, ends)]
    here = np.where(clamped, on & mirror, on)
    carried, of_cables = (
        _by_normal(_normals(surface), here, np.where(clamped[:, None], mirrored, part))
        for part, mirrored in zip((forces, ends), across, strict=True)
    )
    return clamped, on, carried, of_cables


def _normals(surface: Surface) -> Floats:
    return np.array([surface.plane.normal, *(plane.normal for plane, _ in surface.on_planes)])


def _by_normal(normals: Floats, on: Bools, vectors: Floats) -> Floats:
    """(k,n,3) the parts c_i n_i of vectors (n,3), n_i the normals (k,3) of the planes each is ``on``."""
    parts = np.zeros((len(normals), *vectors.shape))
    some = np.flatnonzero(on.any(axis=0))
    for pattern in np.unique(on[:, some], axis=1).T:
        here, own = some[(on[:, some] == pattern[:, None]).all(axis=0)], normals[pattern]
        sizes = vectors[here] @ np.linalg.pinv(own)
        parts[np.ix_(pattern, here)] = sizes.T[:, :, None] * own[:, None, :]
    return parts
