"""The forces of the supports, and how they act: along lines, at points, and across mirror planes.

Along a line a support holds the pull of the sheets there, Σ (α + w z) n per length with their outward
co-normals n, as far as it can: a plane holds the part across itself. The forces at the vertices are

    f_v = Σ ½ L_e Σ (α + w z) n_e over the held edges e at v + the ends of cables + r_v,

with r_v half the same sums over the other edges at v, less ⅓ Σ p A_T ν_T. Where sheets are smooth r_v is
O(h²), as curvature balances pressure, and beside corners and where junctions end O(h): nothing of it is
left in the limit. Forces at points are those of cables that end, and of points held alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..forces import triangles
from ..forces.elements import add_values
from ..forces.functional import LINE_FORCES
from ..forces.pinching import standing_part
from ..surface import Surface
from ..surface.checks import lying
from ..surface.geometry import area_vectors, segment_lengths, vertex_sums
from ..surface.supports import apply_supports, symmetric_part
from .cables import cable_ends
from .tables import conormal_sum

SPAN = 1e-9  # of the largest force: what planes leave of the forces that they carry


def reactions(surface: Surface) -> Floats:
    """(n,3) forces of the supports: the whole force where fixed, its part normal to the plane where sliding.

    In a mirror plane this part is the pull of the image.

    The force at a vertex is Σ α ∂A - ⅓ Σ p A_T ν_T, with a third of each triangle's pressure, and the
    forces of cables and weights. At a boundary this is not ∇E: there the volume is that of a cone to the
    point of Π, whose side moves with the boundary but is under no pressure.
    """
    X, F = surface.vertices, surface.faces
    zero = np.zeros(len(surface.patches))
    forces = triangles.measure(triangles.energy_mesh(surface, pressure=zero), X)[2]
    add_values((each for force in LINE_FORCES for each in force(surface, X)), forces)
    triangles.add_weights(surface, X, forces)
    third = area_vectors(X[F]) / 3.0
    forces -= vertex_sums(third * surface.net_pressures[surface.patch_of_face, None], F, surface.n)
    return forces - apply_supports(surface, forces.copy())


@dataclass(frozen=True, eq=False)
class SupportForces:
    """The reactions by how they act, force; ``along``, ``points`` and the pull of images are all of them."""

    surface: Surface
    standing: Surface  # the part of it that stands, which the supports hold
    forces: Floats  # (n,3) all of them
    along: Floats  # (n,3) on lines and sheets
    points: Floats  # (n,3) at single points, and of the cables that end on a line
    lines: Bools  # (e,2) the ends of edges that are held as lines: of the boundary, of lines inside the
    # surface, and of junctions that a plane holds, as on an upright wall, or that rest on Π
    lengths: Floats  # (n,) half the length of the edges of ``lines`` at each vertex; 0 where there is none
    pulls: Floats  # (e,3) force per length that holds the sheets along the edges of ``lines``; else 0
    clamped: Bools  # (n,) the vertices that cannot move, or only along a line that was given
    single: Bools  # (n,) those of them that are in no line
    on_boundary: Bools  # (n,) the vertices of the held boundary
    by_plane: Floats  # (1 + planes,n,3) what Π and each of ``on_planes`` carry at the vertices on them
    cables: Floats  # (1 + planes,n,3) the part of these that holds the ends of cables

    @property
    def per_length(self) -> Floats:
        """(n,3) the mean of ``pulls`` along the lines at a vertex, force/length; NaN where there is none."""
        edges, force = self.surface.topology.edges, np.zeros_like(self.forces)
        half = 0.5 * segment_lengths(self.surface.vertices, edges)[:, None] * self.pulls
        for side in (0, 1):
            np.add.at(force, edges[:, side], half * self.lines[:, [side]])
        share = self.lengths[:, None]
        return np.divide(force, share, out=np.full(force.shape, np.nan), where=share > 0.0)

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


def support_forces(
    surface: Surface, forces: Floats | None = None, standing: Surface | None = None
) -> SupportForces:
    """The reactions of a surface by how they act.

    ``standing`` is its standing part, ``forces`` (n,3) are its reactions; both are found where not given.

    A vertex on several planes divides its force among them: Σ c_i n_i of their normals. Where a fixed vertex
    lies in mirror planes, these take the part across them.

    >>> from pcmc import Patch
    >>> square = Surface([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], [[0, 1, 2], [2, 3, 0]],
    ...                  [0, 0], [Patch("floor", 1.0)], fixed=range(4))
    >>> acting = support_forces(square)
    >>> acting.forces[1].tolist()[:2], acting.pulls[0].tolist()  # the edge from (1, 1) to (-1, 1)
    ([-1.0, 1.0], [0.0, 1.0, 0.0])
    """
    standing = standing_part(surface).surface if standing is None else standing
    forces = reactions(standing) if forces is None else forces
    topo, planes = surface.topology, [plane for plane, _ in standing.on_planes]
    ends = np.zeros_like(forces)
    for _, vertex, force in cable_ends(standing):
        ends[vertex] += force
    ends -= apply_supports(standing, ends.copy())
    clamped, on, by_plane, cables = _divided(standing, forces, ends)
    mirror = np.array([False, *(plane.mirror for plane in planes)])
    boundary, held = held_boundary(surface), standing.fixed | standing.on_plane
    on_boundary, used = np.zeros((2, surface.n), dtype=bool)
    on_boundary[topo.edges[boundary]] = True
    used[standing.faces] = used[standing.cable_edges.ends] = True
    for plane, mask in standing.on_planes:
        held = held | (mask & (not plane.mirror))
    single, sliding = (used & ~on_boundary & side for side in (clamped, held & ~clamped))
    between = topo.junction_edge | topo.seam_edge
    junction = between & at_both_ends(held, topo.edges)
    drawn = (between | surface.edges_on_curves.drawn) & ~topo.boundary_edge
    inner = at_both_ends(single, topo.edges) | (drawn & at_both_ends(clamped, topo.edges))
    lines = (junction[:, None] & sliding[topo.edges]) | (inner | boundary)[:, None]

    some = np.flatnonzero(lines.any(axis=1))
    half = np.repeat(0.5 * segment_lengths(surface.vertices, topo.edges[some])[:, None], 2, axis=1)
    lengths = np.bincount(topo.edges[some][lines[some]], half[lines[some]], surface.n).astype(float)
    pulls = np.zeros((len(lines), 3))
    pulls[some] = sheet_pulls(standing, topo.edges[some])
    part = some[~at_both_ends(clamped, topo.edges[some])]  # a plane holds the part across itself
    common = (on | clamped)[:, topo.edges[part]].all(axis=2) & ~mirror[:, None]
    normals = np.array([standing.plane.normal, *(plane.normal for plane in planes)])
    pulls[part] = _by_normal(normals, common, pulls[part]).sum(axis=0)
    points = np.where(lengths[:, None] > 0.0, ends - cables[mirror].sum(axis=0), 0.0)
    inside = forces - by_plane[mirror].sum(axis=0)
    alone = single & (lengths == 0.0)
    points[alone] = inside[alone]
    return SupportForces(
        surface=surface,
        standing=standing,
        forces=forces,
        along=inside - points,
        points=points,
        lines=lines,
        lengths=lengths,
        pulls=pulls,
        clamped=clamped,
        single=alone,
        on_boundary=on_boundary,
        by_plane=by_plane,
        cables=cables,
    )


def at_both_ends(mask: Bools, edges: Ints) -> Bools:
    """(e,) whether both ends of edges (e,2) are in a mask (n,)."""
    return np.asarray(mask[edges[:, 0]] & mask[edges[:, 1]])


def held_boundary(surface: Surface) -> Bools:
    """(e,) edges of the boundary that are held at both ends, but for those in mirror planes."""
    topo = surface.topology
    return topo.boundary_edge & ~surface.mirror_edge & at_both_ends(surface.held, topo.edges)


def sheet_pulls(surface: Surface, ends: Ints) -> Floats:
    """(k,3) Σ (α + w z) n of the sheets at edges, given by their ends (k,2); 0 where there is no edge."""
    numbers, pulls = surface.topology.edge_numbers(ends), np.zeros((len(ends), 3))
    pulls[numbers >= 0] = conormal_sum(surface, numbers[numbers >= 0])
    return pulls


def _divided(surface: Surface, forces: Floats, ends: Floats) -> tuple[Bools, Bools, Floats, Floats]:
    """The vertices (n,) that lines and points hold, those on Π and each of the other planes (1 + planes,n),
    and what these, (1 + planes,n,3), carry of the reactions (n,3), and of those at the ends of cables.
    """
    planes = (surface.plane, *(plane for plane, _ in surface.on_planes))
    normals = np.array([plane.normal for plane in planes])
    mirror, X = np.array([plane.mirror for plane in planes]), surface.vertices
    ground = surface.on_plane | (surface.fixed & lying(surface.plane.height(X), X))
    on = np.array([ground, *(mask for _, mask in surface.on_planes)])
    clamped = surface.given_supports.fixed_and_sliding()[0]
    least = SPAN * float(np.linalg.norm(forces, axis=1).max(initial=0.0))
    across = [part - symmetric_part(surface.on_planes, part.copy()) for part in (forces, ends)]
    for _ in range(2):  # again with those clamped that planes cannot carry, as where a held bottom is pinched
        here = np.where(clamped, on & mirror[:, None], on)
        carried, of_cables = (
            _by_normal(normals, here, np.where(clamped[:, None], mirrored, part))
            for part, mirrored in zip((forces, ends), across, strict=True)
        )
        clamped = clamped | (np.linalg.norm(forces - carried.sum(axis=0), axis=1) > least)
    return clamped, on, carried, of_cables


def _by_normal(normals: Floats, on: Bools, vectors: Floats) -> Floats:
    """(k,n,3) the parts c_i n_i of vectors (n,3), n_i the normals (k,3) of the planes each is ``on``."""
    parts = np.zeros((len(normals), *vectors.shape))
    some = np.flatnonzero(on.any(axis=0))
    for pattern in np.unique(on[:, some], axis=1).T:
        here, own = some[(on[:, some] == pattern[:, None]).all(axis=0)], normals[pattern]
        sizes = vectors[here] @ np.linalg.pinv(own)
        parts[np.ix_(pattern, here)] = sizes.T[:, :, None] * own[:, None, :]
    return parts
