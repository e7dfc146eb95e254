"""The motion space: at each vertex the directions in which moving it changes the shape.

- inside a sheet: the unit vertex normal (the normalised vector area);
- on a curve where sheets meet or end: the plane perpendicular to the curve;
- on a cable the same, also where it runs inside a sheet or along a free edge;
- at a point where such curves meet, where a cable ends or its tension changes, or which sheets share that
  have no edge in common there: all three directions;
- always within what the support allows: nothing where fixed, along the plane where sliding, or along a
  line or circle. In a mirror plane the sheet goes on: its boundary there is no curve.

The remaining directions only slide vertices along the shape and belong to mesh quality. Faces without
tension and pressure exert no force: they are left out, and a vertex of such faces alone has no motion.
A P-CMC surface is Bᵀ∇E = 0, with B the basis of this space.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isqrt, sqrt
from typing import NamedTuple

import numpy as np

from ..base.arrays import Bools, Floats, Ints, Vector, read_only
from ..base.compiled import compiled, inlined
from ..base.tolerances import NO_DIRECTION, ON
from ..surface import Surface
from ..surface.geometry import (
    accumulate,
    cross,
    divided,
    dot,
    norm,
    point,
    scaled,
    squared_sides,
    sub,
    vector,
    vertex_area_vectors,
)
from ..surface.lagrange import lattice
from ..surface.supports import mirror_edges, symmetric_part
from ..surface.topology import (
    CURVE,
    POINT,
    SHEET,
    Topology,
    curve_neighbours,
    edge_places,
    one_sided_copies,
    vertex_kind,
)
from .cables import cable_pulls, laws_on
from .elements import Mesh, energy_mesh
from .triangles import effective_tensions

NO_IMAGES: Ints = read_only(np.empty(0, dtype=np.int32))


@dataclass(frozen=True, eq=False)
class VertexClasses:
    """The active faces, which exert forces, and the class of each vertex: both stay as vertices move."""

    active: Bools  # (m,) faces with a tension or a pressure
    faces: Ints  # these alone; those without pressure turned over where that gives a sheet one side
    patch_of_face: Ints
    topology: Topology
    kind: Ints  # (n,) SHEET, CURVE or POINT: by the edges at which sheets meet, end, or change law or side
    curve: Ints  # (c,) vertices on a curve
    beside: Ints  # (c,2) their neighbours along it
    seen: Ints  # (c,2) images of the curve vertices as these neighbours have them; (0,2) without images
    idle: Bools  # (n,) vertices of no active face, and images
    level: Bools  # (n,) curve vertices beside one that rests on Π: their tangent is taken along Π
    nodes: Ints  # (e,k) of the active elements; of flat ones ``faces``

    def mesh(self, surface: Surface) -> Mesh:
        """The active elements, with the tensions and pressures of a surface of these classes."""
        patch = read_only(np.ascontiguousarray(self.patch_of_face[:: surface.order**2]))
        return energy_mesh(surface)._replace(faces=self.nodes, rows=self.rows, patch=patch)

    @property
    def rows(self) -> Ints:
        """(e,k) the vertices that ``nodes`` are images of, or the same."""
        return self.nodes if self.topology.placed is None else self.topology.faces


class MotionSpace(NamedTuple):
    """Orthonormal basis of the motion space at each vertex; an unknown is a component along one vector."""

    basis: Floats  # (n,3,3) basis[v, c] for c < dimension[v] are unit vectors, the rest zero
    dimension: Ints  # (n,) 0 to 3
    start: Ints  # (n+1,) the first unknown of each vertex; the last entry is the number of unknowns
    original: Ints = NO_IMAGES  # (n,) the vertex that each is an image of; of a surface without any (0,)

    @classmethod
    def of(cls, basis: Floats, dimension: Ints, original: Ints = NO_IMAGES) -> MotionSpace:
        """The space of a basis, with its unknowns numbered vertex by vertex."""
        start = np.append(0, np.cumsum(dimension)).astype(np.int64)
        return cls(basis, dimension, start, original)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.start[-1])

    def to_coordinates(self, vectors: Floats) -> Floats:
        """Bᵀ v (size,): the components of vectors (n,3) along the basis."""
        return _to_coordinates(self, vectors)

    def to_vectors(self, components: Floats) -> Floats:
        """B s (n,3): the vectors that have these components (size,); images have those of their vertex."""
        vectors: Floats = _to_vectors(self, components)
        return vectors[self.original] if len(self.original) else vectors

    def project(self, vectors: Floats) -> Floats:
        """B Bᵀ v (n,3): the part of the vectors that changes the shape."""
        return self.to_vectors(self.to_coordinates(vectors))


def vertex_classes(surface: Surface, crest: Ints | None = None, level: Bools | None = None) -> VertexClasses:
    """The active faces of a surface and the classes of its vertices.

    ``crest`` (k,2) leads from each junction vertex that rests on Π to its neighbours on the junction:
    that is its curve, sharp or not, and whatever else ends there, as a standing wall does beside.
    ``level`` (n,) marks curve vertices whose tangent is taken along Π: beside a resting vertex the
    curve has a corner and no tangent of its own.

    Two sheets of equal tension and pressure that meet with no pulling wall between them are one
    smooth sheet: their common curve can slide along it freely and carries no motion of its own.
    Without pressure they are so whichever way their faces run; a Möbius band keeps a curve across.
    """
    in_room = surface.room_signs.any(axis=0)  # the pressure of a room may take any value
    acts = (surface.tensions != 0.0) | (surface.net_pressures != 0.0) | in_room
    active = acts[surface.patch_of_face]
    faces, patch = surface.faces, surface.patch_of_face
    if not active.all():
        faces, patch = np.ascontiguousarray(faces[active]), np.ascontiguousarray(patch[active])
    laws = np.vstack([surface.tensions, surface.net_pressures, surface.weights, surface.room_signs])
    kinds = np.unique(laws, axis=1, return_inverse=True)
    alike = np.asarray(kinds[1]).ravel()[patch].astype(np.int32)
    if active.all():
        topo = replace(surface.topology, patch_of_face=alike)
    else:
        topo = surface.topology_of(faces, alike)
    if (topo.one_way_edge & ~topo.seam_edge).any():
        # faces to turn over so that each sheet has one side; none of a sheet that has only one
        m, smooth = len(faces), (topo.valence == 2) & ~topo.seam_edge
        one, other = (topo.neighbours[smooth[topo.valence == 2]] // 3).T
        label = one_sided_copies(one, other, topo.one_way_edge[smooth], m)
        turned = (label[:m] > label[m:]) & ((surface.net_pressures == 0.0) & ~in_room)[patch]
        faces = np.where(turned[:, None], faces[:, ::-1], faces)
        topo = surface.topology_of(faces, alike)
    faces.setflags(write=False)  # compiled loops then see one type of array
    patch.setflags(write=False)
    on_curve = topo.curve_edge | topo.one_way_edge
    if surface.on_planes:
        on_curve = on_curve & ~mirror_edges(surface.on_planes, topo)
    pulls = laws_on(topo, surface) if surface.cables else None
    if pulls is not None:
        on_curve = on_curve | (pulls[:, 0] > 0.0)
    edges = topo.edges[on_curve]
    links = np.concatenate([edges, edges[:, ::-1]])
    if crest is not None and len(crest):
        links = np.concatenate([links[~np.isin(links[:, 0], crest[:, 0])], crest])
    curve, beside = curve_neighbours(links, surface.n)
    kind = vertex_kind(links[:, 0], surface.n)
    shared = topo.fans > 1
    if pulls is not None:
        for law in pulls[on_curve].T:
            least, most = np.full(surface.n, np.inf), np.full(surface.n, -np.inf)
            np.minimum.at(least, edges, law[:, None])
            np.maximum.at(most, edges, law[:, None])
            shared |= least < most  # where curve edges of different line tension or weight meet
    if crest is not None:
        shared[crest[:, 0]] = False
    kind[shared] = POINT
    curve, beside = curve[~shared[curve]], beside[~shared[curve]]
    idle = np.bincount(topo.faces.ravel(), minlength=surface.n) == 0
    level = np.zeros(surface.n, dtype=bool) if level is None else level
    nodes = faces if surface.order == 1 else read_only(surface.nodes[active[:: surface.order**2]])
    seen = np.empty((0, 2), dtype=np.int64)
    if surface.periodic:  # along the sides of faces, which do not leave the cell
        place = edge_places(np.stack([np.stack([curve, b], axis=1) for b in beside.T], axis=1), topo.edges)
        later = topo.edges[place, 1] == curve[:, None]  # than the neighbour, in the edge
        low, high = topo.sides[place].transpose(2, 0, 1)
        seen, beside = np.where(later, high, low), np.where(later, low, high)
    return VertexClasses(active, faces, patch, topo, kind, curve, beside, seen, idle, level, nodes)


def motion_space(surface: Surface, classes: VertexClasses, X: Floats) -> MotionSpace:
    """Basis of the motion space of the surface with its vertices at X (n,3).

    Of the directions that the supports admit the ones along the shape are removed.
    """
    freedom, axis = surface.admissible_at(X)
    freedom = np.where(classes.idle, np.int8(0), freedom)
    for circle, along in surface.on_circle:
        # a curve along the circle on both sides: the polygon's chord is not quite along the tangent
        near = surface.fixed & (circle.distance(surface.vertices) <= ON * surface.size)
        freedom[classes.curve[along[classes.curve] & near[classes.beside].all(axis=1)]] = 0
    chord = np.zeros_like(X)
    chord[classes.curve] = curve_chords(surface, classes, X)
    basis, dimension = np.zeros((surface.n, 3, 3)), np.zeros(surface.n, dtype=np.int64)
    area_vector = normal_vectors(surface, classes, X)
    _fill(classes.kind, area_vector, chord, freedom, axis, basis, dimension)
    return MotionSpace.of(basis, dimension, surface.original if surface.periodic else NO_IMAGES)


@compiled
def _fill(
    kind: Ints, normal: Floats, chord: Floats, freedom: Ints, axis: Floats, basis: Floats, dimension: Ints
) -> None:
    """The basis at each vertex, from the shape's normal or chord and what the supports admit."""
    none = (0.0, 0.0, 0.0)
    for v in range(len(kind)):
        if freedom[v] == 0:
            continue
        # the directions that change the shape
        along = point(normal, v) if kind[v] == SHEET else point(chord, v)
        length = norm(along)
        along = divided(along, length) if length > 0.0 else none
        first, second, third, size = along, none, none, 1 if length > 0.0 else 0
        if kind[v] == CURVE and length > 0.0:
            pair = perpendicular_pair(along)
            first, second, size = pair[0], pair[1], 2
        elif kind[v] != SHEET:
            first, second, third, size = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), 3
        a = point(axis, v)
        if freedom[v] == 2 and size > 0:  # within the plane across a
            rest = cross(a, along) if size == 2 else sub(first, scaled(dot(first, a), a))
            length = norm(rest)
            if size == 3 or (size == 2 and length <= NO_DIRECTION):
                pair = perpendicular_pair(a)
                first, second, third, size = pair[0], pair[1], none, 2
            else:
                size = 1 if length > NO_DIRECTION else 0
                first, second = divided(rest, length) if size else none, none
        elif freedom[v] == 1:  # along a
            across = (dot(first, a), dot(second, a), dot(third, a))
            first, second, third, size = a, none, none, 1 if norm(across) > NO_DIRECTION else 0
        dimension[v] = size
        for d in range(3):
            if size > 0:
                basis[v, 0, d] = first[d]
            basis[v, 1, d], basis[v, 2, d] = second[d], third[d]


def normal_vectors(surface: Surface, classes: VertexClasses, X: Floats, d: Floats | None = None) -> Floats:
    """(n,3) along the sheets' normals: the area vectors of flat triangles around each vertex.

    At the nodes of curved elements the unit normals of the corners are interpolated, each of the triangles
    around it in the same sheet and their mirror images: where the normals of nodes are uneven, so are their
    distances after a step, and elements of order 4 and more lose their order. With a motion d (n,3) of
    these, how they change along it, their lengths kept.
    """
    if classes.nodes.shape[1] == 3:
        return vertex_area_vectors(X, classes.faces, classes.topology.faces)[0]
    law, n, nodes = classes.topology.patch_of_face, len(X), classes.nodes
    sheets, faces = int(law.max(initial=0)) + 1, classes.faces + n * law[:, None]

    def stars(X: Floats) -> Floats:
        found = vertex_area_vectors(np.tile(X, (sheets, 1)), faces)[0]
        for sheet in found.reshape(sheets, n, 3):
            symmetric_part(surface.on_planes, sheet)
        return found

    around = stars(X)
    length = np.linalg.norm(around, axis=1)[:, None]
    if d is not None:  # area vectors are quadratic in X
        around = 0.5 * (stars(X + d) - stars(X - d))
    around /= np.where(length > 0.0, length, 1.0)
    per_element = len(law) // len(nodes)
    corners = nodes[:, :3] + n * law[::per_element, None]
    place, out = lattice(isqrt(per_element)).nodes, np.zeros_like(X)
    out[nodes] = place / isqrt(per_element) @ around[corners]
    return out


def curve_chords(surface: Surface, classes: VertexClasses, X: Floats) -> Floats:
    """(c,3) from the vertex before to the one after each curve vertex: along its tangent."""
    chord = X[classes.beside[:, 1]] - X[classes.beside[:, 0]]
    if len(classes.seen):
        chord += X[classes.seen[:, 0]] - X[classes.seen[:, 1]]
    level = classes.level[classes.curve]
    chord[level] = surface.plane.along(chord[level])
    return np.asarray(chord)


def force_scale(surface: Surface, of: VertexClasses | Surface, X: Floats) -> float:
    """The norm of ``squared_forces``, the single forces that cancel at rest; 1 without any."""
    return sqrt(float(squared_forces(surface, of, X).sum())) or 1.0


def squared_forces(surface: Surface, of: VertexClasses | Surface, X: Floats) -> Floats:
    """(m+c,) squared forces ½ α |e| of each active triangle, or of all, then τ of each cable edge, force².

    Those of its sides, or both ends, are added up; with weights α + w z and τ + g z take their places.
    """
    tension = effective_tensions(surface, X, of.faces, of.patch_of_face)
    return np.append(0.25 * tension**2 * squared_sides(X, of.faces), 2.0 * cable_pulls(surface, X) ** 2)


@inlined
def perpendicular_pair(direction: Vector) -> tuple[Vector, Vector]:
    """Two unit vectors that complete a unit direction to a right-handed frame."""
    x, y, z = abs(direction[0]), abs(direction[1]), abs(direction[2])
    if x <= y and x <= z:
        first = cross(direction, (1.0, 0.0, 0.0))
    else:
        first = cross(direction, (0.0, 1.0, 0.0) if y <= z else (0.0, 0.0, 1.0))
    first = divided(first, norm(first))
    return first, cross(direction, first)


@compiled
def perpendicular(directions: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors (k,3) that complete each unit direction (k,3) to a right-handed frame."""
    out = np.empty((2, len(directions), 3))
    for v in range(len(directions)):
        first, second = perpendicular_pair(point(directions, v))
        for d in range(3):
            out[0, v, d], out[1, v, d] = first[d], second[d]
    return out[0], out[1]


@compiled
def _to_coordinates(space: MotionSpace, vectors: Floats) -> Floats:
    out = np.empty(space.start[-1])
    for v in range(len(space.dimension)):
        for c in range(space.dimension[v]):
            out[space.start[v] + c] = dot(vector(space.basis[v, c]), point(vectors, v))
    return out


@compiled
def _to_vectors(space: MotionSpace, components: Floats) -> Floats:
    out = np.zeros((len(space.dimension), 3))
    for v in range(len(space.dimension)):
        for c in range(space.dimension[v]):
            accumulate(out, v, scaled(components[space.start[v] + c], vector(space.basis[v, c])))
    return out
