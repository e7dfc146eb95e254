"""A film between two junctions replaced by one between the other two of the four sheets: a T1 of a foam.

The film meets the sheets A and B at the one junction, C and D at the other; A and C are on the same side of
it. It shrinks to a curve at which all four meet. This opens to a new film, with A and C at its one junction
and B and D at the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np

from ..base.arrays import Bools, Floats, Ints, mask_of
from ..base.errors import SurfaceError
from ..base.tolerances import ON
from ..forces.functional import energy, patch_volumes
from ..forces.rooms import prescribed_volumes
from ..surface import Patch, Room, Surface
from ..surface.geometry import area_vectors, edge_vectors, face_areas, segment_lengths, vertex_sums
from ..surface.images import lattice_of
from ..surface.lagrange import expect_flat
from ..surface.supports import apply_supports
from ..surface.topology import EdgeCurve, joined
from .quality import in_the_middle, turns_over

EDGE = 1.5  # of an equilateral triangle, over the square root of its area
WIDTH = 0.5  # of the edges of the triangles beside: how wide the new film is at first
WIDTHS = 0.5 * 1.25 ** np.arange(16)  # by which it is widened, of that
VOLUME = 0.1  # of a room's own: by no more may that change it
Triangle = tuple[Sequence[int], Sequence[Ints], int]  # vertices, steps and patch


@dataclass(frozen=True, eq=False)
class Film:
    """A film between two junctions, with the patches A and B beside the one and C and D beside the other."""

    patch: int
    pairs: Ints  # (k,2) vertices of the one junction and of the other, across from each other and in order
    closed: bool  # whether the last pair is joined to the first
    one_side: tuple[int, int]  # A and C, on the same side of the film: these meet if it vanishes
    other_side: tuple[int, int]  # B and D
    width: float  # the mean distance of the pairs, length
    height: float  # length of the shorter junction

    @property
    def sheets(self) -> tuple[int, ...]:
        """A, C, B and D."""
        return (*self.one_side, *self.other_side)

    def meeting(self, surface: Surface, when: str) -> str:
        """Names the patches that meet once the film has vanished: of a wall, the two of the roof at its ends.

        >>> from pcmc import Patch
        >>> floor = Surface(np.eye(3), [[0, 1, 2]], [0], [Patch("floor", 1.0)], fixed=range(3))
        >>> Film(0, np.empty((0, 2)), False, (0, 0), (0, 0), 0.0, 1.0).meeting(floor, "then")
        "'floor' and 'floor' then meet, and 'floor' and 'floor'"
        """
        name = [repr(patch.name) for patch in surface.patches]
        (a, c), (b, d) = self.one_side, self.other_side
        if surface.walls[self.patch]:
            sheets = [curve.sheets for curve in surface.topology.junctions]
            beside = [{k for own in sheets if s in own for k in own} for s in (a, b, c, d)]
            ends = [{k for k in one & other if surface.roof[k]} for one, other in (beside[:2], beside[2:])]
            if [len(end) for end in ends] == [1, 1]:
                return f"{name[ends[0].pop()]} and {name[ends[1].pop()]} {when} meet"
        return f"{name[a]} and {name[c]} {when} meet, and {name[b]} and {name[d]}"


def film_of(surface: Surface, name: str) -> Film:
    """The strip that a patch is; SurfaceError for another shape, or without four different patches beside it.

    A film with further sides at junctions, such as a wall below a roof, is a strip across the short ones.
    """
    topo, original, patch = surface.topology, surface.original, surface.patch_index(name)
    curves = [curve for curve in topo.junctions if patch in curve.sheets]
    edges = [topo.sides[topo.edge_numbers(curve.pairs)] for curve in curves]
    lengths = [float(segment_lengths(surface.vertices, own).sum()) for own in edges]
    ends = [set() if curve.closed else {int(v) for v in curve.vertices[[0, -1]]} for curve in curves]
    found = list[tuple[float, int, int]]()
    for i, j in combinations(range(len(curves)), 2):
        one, other = curves[i], curves[j]
        rest = [k for k in range(len(curves)) if k not in (i, j)]
        around = {k for curve in (one, other) for k in curve.sheets} - {patch}
        strip = (one.closed, len(one.sheets), len(other.sheets), len(around)) == (other.closed, 3, 3, 4)
        strip = strip and all(len(ends[k] & ends[i]) == len(ends[k] & ends[j]) == 1 for k in rest)
        if strip and surface.fixed[original[sorted(ends[i] & ends[j])]].all():
            found.append((sum(lengths[k] for k in rest), i, j))
    if not found:
        text = f"patch {name!r} is no film between two junctions with two other patches each, four in all;"
        raise SurfaceError(f"{text} only the neighbours of a film can be swapped", what="patch", where=name)
    _, i, j = min(found)
    one, other = curves[i], curves[j]
    pairs, width = _across(surface, one, other)
    (a, b), (c, d) = ([k for k in curve.sheets if k != patch] for curve in (one, other))
    apart = _apart(surface, one, a, b)[pairs[:, 0]] * _apart(surface, other, c, d)[pairs[:, 1]]
    c, d = (c, d) if apart.sum() > 0.0 else (d, c)
    return Film(patch, pairs, one.closed, (a, c), (b, d), width, min(lengths[i], lengths[j]))


def lattice_steps(lattice: Floats, vectors: Floats) -> Ints:
    """(…,d) the whole multiples of the translations (d,3) of a lattice nearest to vectors (…,3)."""
    return np.asarray(np.rint(vectors @ np.linalg.pinv(lattice)).astype(np.int64))


def shortest(lattice: Floats, vectors: Floats) -> Floats:
    """(…,3) the shortest of all vectors that differ from these (…,3) by translations of a lattice (d,3)."""
    return np.asarray(vectors - lattice_steps(lattice, vectors) @ lattice)


def _across(surface: Surface, one: EdgeCurve, other: EdgeCurve) -> tuple[Ints, float]:
    """(k,2) the vertices of two curves side by side, some of one several times; their mean distance."""
    X, lattice, count = surface.vertices, lattice_of(surface), max(len(one.vertices), len(other.vertices))

    def sampled(v: Ints) -> Ints:
        share = np.rint(np.linspace(0, len(v) - 1, count)).astype(int)
        return v[np.arange(count) * len(v) // count if one.closed else share]

    def apart(v: Ints, w: Ints | int) -> Floats:
        return np.asarray(np.linalg.norm(shortest(lattice, X[v] - X[w]), axis=1))

    rows = []
    for way in (other.vertices, other.vertices[::-1]):
        if one.closed:
            way = np.roll(way, -int(apart(way, one.vertices[0]).argmin()))
        rows.append(np.stack([sampled(one.vertices), sampled(way)], axis=1))
    pairs = min(rows, key=lambda row: float(apart(*row.T).sum()))
    return pairs, float(apart(*pairs.T).mean())


def _apart(surface: Surface, curve: EdgeCurve, one: int, other: int) -> Floats:
    """(n,3) at the vertices of a junction the way across it from the one of two sheets to the other."""
    topo, F, out = surface.topology, surface.faces, np.zeros((surface.n, 3))
    f, k = np.nonzero(np.isin(topo.edge_of_face, topo.edge_numbers(curve.pairs)))
    a, b, c = (surface.vertices[F[f, k - j]] for j in range(3))
    sign = (surface.patch_of_face[f] == other).astype(float) - (surface.patch_of_face[f] == one)
    for j in (1, 2):
        np.add.at(out, surface.original[F[f, k - j]], sign[:, None] * (a - 0.5 * (b + c)))
    return out


def swap(surface: Surface, patch: str) -> tuple[Surface, str]:
    """The surface with other neighbours of a film between two junctions, not solved; and in words who meets.

    The new film has the name, tension and weight of the old one. Its pressure, its snow and the rooms that
    it bounds follow from the sheets beside it. A roof over the film goes along: the patches at its sides
    part, those at its ends meet. Where all four sheets meet, they stay together and the patch is gone if its
    tension holds them both ways: if it is at least (f_A + f_C - f_B - f_D)/2 and (f_A + f_B - f_C - f_D)/2,
    with the pulls f of the sheets. Otherwise the film gets as wide as lowers the energy.

    Parameters
    ----------
    patch : the name of the film; a narrow one changes the shape least.

    Raises
    ------
    SurfaceError : the patch is no such film, its junctions end at different fixed places, or a cable ends
        on it.
    """
    film, mesh, target = collapsed(surface, patch)
    curve = np.array([*dict.fromkeys(target[film.pairs[:, 0]].tolist())])  # in order, each vertex once
    edges = np.stack([curve, np.roll(curve, -1)], axis=1)[: None if film.closed else -1]
    edge = EDGE * float(np.sqrt(face_areas(mesh.corners(surface)[mesh.beside(film, edges)]).mean()))
    way, patches = _opening(surface, film, mesh, edges), list(surface.patches)
    if way is None:
        del patches[film.patch]
        mesh = replace(mesh, patch=mesh.patch - (mesh.patch > film.patch))
        rooms = [_with_sign(room, patch, 0) for room in surface.rooms]
        what = f"patch {patch!r} is gone, and the four beside it meet at one junction"
        return _rebuilt(surface, mesh, target, patches, rooms)[0], what
    # along an edge the values of A, C and the new film cancel, each with the sense in which it runs there
    sense = [mesh.sense(mesh.at_edge(k, *edges[0]), *edges[0]) for k in film.one_side]
    values = np.array([surface.pressures, surface.snows, *surface.room_signs])[:, list(film.one_side)]
    pressure, snow, *signs = (0.0 - values @ sense).tolist()
    wall = bool(surface.walls[film.patch])
    patches[film.patch] = replace(patches[film.patch], pressure=pressure, snow=snow, wall=wall)
    rooms = [_with_sign(room, patch, int(sign)) for room, sign in zip(surface.rooms, signs, strict=True)]
    half, columns, wide = 0.5 * WIDTH * edge * way, 1, 0.0
    for _ in range(2):  # once more with as many columns of triangles as its width has room for
        opened, parting = _opened(film, mesh, edges, half, columns)
        changed, vertex = _rebuilt(surface, opened, target, patches, rooms)
        changed, wide = _widened(changed, parting[vertex])
        columns = round(wide * WIDTH)
        if columns <= 1:
            break
    return changed, film.meeting(surface, "now")


@dataclass(frozen=True, eq=False)
class _Mesh:
    """Triangles of vertices that are no images, and the translations from there to their corners."""

    X: Floats  # (n,3)
    supports: Bools  # (n,c) as ``Surface.support_columns``
    vertices: Ints  # (m,3)
    steps: Ints  # (m,3,d) whole multiples of the lattice
    patch: Ints  # (m,)

    def corners(self, surface: Surface) -> Floats:
        """(m,3,3)"""
        return np.asarray(self.X[self.vertices] + self.steps @ lattice_of(surface))

    def beside(self, film: Film, edges: Ints) -> Bools:
        """(m,) the triangles of the four sheets that touch the edges (k,2)."""
        return np.isin(self.patch, film.sheets) & np.isin(self.vertices, edges).any(axis=1)

    def at_edge(self, sheet: int, a: int, b: int) -> int:
        """The first triangle of a sheet that has the edge from a to b."""
        has = (self.vertices == a).any(axis=1) & (self.vertices == b).any(axis=1)
        return int(np.argmax(has & (self.patch == sheet)))

    def sense(self, triangle: int, a: int, b: int) -> int:
        """1 if a triangle runs from a to b, -1 if from b to a."""
        corners = self.vertices[triangle].tolist()
        return 1 if corners[corners.index(a) - 2] == b else -1


def collapsed(surface: Surface, patch: str) -> tuple[Film, _Mesh, Ints]:
    """The film of this name, the mesh once it has vanished, and the vertex (n,) that each one is then.

    SurfaceError as of ``swap``: it is no film between two junctions, or something holds it open.
    """
    expect_flat(surface.cell, "swap")
    film = film_of(surface, patch)
    own = surface.faces[surface.patch_of_face == film.patch]
    if cables := [cable.name for cable in surface.cables if np.isin(cable.edges, own).any()]:
        text = f"cable {cables[0]!r} runs on or to patch {patch!r}, whose neighbours are to be swapped"
        raise SurfaceError(f"{text}; leave the cable out", what="cables", where=cables[0])
    target, X, supports = surface.original.copy(), surface.vertices.copy(), surface.support_columns.copy()
    lattice, freedom, Y = lattice_of(surface), surface.admissible.freedom, surface.vertices
    fewer = int(np.argmin([len(np.unique(column)) for column in film.pairs.T]))
    for vertex in np.unique(film.pairs[:, fewer]):
        both = np.append(vertex, film.pairs[film.pairs[:, fewer] == vertex, 1 - fewer])
        most_held = freedom[both] == freedom[both].min()
        steps = shortest(lattice, Y[both[most_held]] - Y[vertex])
        if freedom[both].min() == 0 and np.ptp(steps, axis=0).max() > ON * surface.size:
            text = f"the junctions of patch {patch!r} are held at different places, so it cannot vanish;"
            raise SurfaceError(f"{text} let their ends slide", what="patch", where=patch)
        X[vertex], supports[vertex] = X[vertex] + steps.mean(axis=0), supports[both].any(axis=0)
        target[both] = vertex
    ends = film.pairs[[0, -1], fewer]
    for vertex in np.setdiff1d(surface.original[own], film.pairs):  # of its short sides, where a roof goes on
        target[vertex] = ends[np.linalg.norm(shortest(lattice, Y[ends] - Y[vertex]), axis=1).argmin()]
    target, F = target[surface.original], surface.original[surface.faces]
    counts = lattice_steps(lattice, Y[surface.faces] - Y[F]) + lattice_steps(lattice, Y - Y[target])[F]
    V, left = target[F], surface.patch_of_face != film.patch
    left &= (V[:, [1, 2, 0]] != V).all(axis=1)
    return film, _Mesh(X, supports, V[left], counts[left], surface.patch_of_face[left]), target


def _opening(surface: Surface, film: Film, mesh: _Mesh, edges: Ints) -> Floats | None:
    """(n,3) the unit vectors along which the curve opens towards A and C; None where it stays closed."""
    at, beside = mask_of(edges, len(mesh.X)), mesh.beside(film, edges)
    P, V, patch = mesh.corners(surface)[beside], mesh.vertices[beside], mesh.patch[beside]
    normal = area_vectors(P) / np.maximum(face_areas(P), 1e-300)[:, None]
    pull = 0.25 * surface.tensions[patch, None, None] * np.cross(edge_vectors(P), normal[:, None])  # (15a)
    sides = (np.isin(patch, pair)[:, None, None] for pair in (film.one_side, film.sheets[::2]))  # A, C; A, B
    new, old = (vertex_sums(np.where(side, pull, -pull), V, len(at)) for side in sides)
    guided = mesh.supports[:, 2 + len(surface.on_planes) :].any(axis=1)
    at &= ~mesh.supports[:, 0] | guided  # a fixed end stays one
    span = shortest(lattice_of(surface), mesh.X[edges[:, 1]] - mesh.X[edges[:, 0]])
    lengths = np.bincount(edges.ravel(), np.repeat(0.5 * np.linalg.norm(span, axis=1), 2), len(at))
    strength, other = np.linalg.norm([new, old], axis=2)
    if max(strength[at].sum(), other[at].sum()) <= surface.tensions[film.patch] * lengths[at].sum():
        return None
    at &= strength > 0.0
    return np.where(at[:, None], new / np.where(at, strength, 1.0)[:, None], 0.0)


def _opened(film: Film, mesh: _Mesh, edges: Ints, half: Floats, columns: int) -> tuple[_Mesh, Floats]:
    """The mesh with a new film, of so many columns of triangles; how far its vertices are from its middle.
    ``half`` (n,3) leads from the curve to the film's junction with A and C, and back to that with B and D."""
    split, count = np.flatnonzero(half.any(axis=1)), len(mesh.X)
    across = np.repeat(np.arange(count)[:, None], columns + 1, axis=1)  # from A and C to B and D
    across[split, 1:] = count + np.arange(len(split) * columns).reshape(-1, columns)
    V, new = mesh.vertices.copy(), list[Triangle]()
    far = np.isin(mesh.patch, film.other_side)
    V[far] = across[V[far], -1]
    for vertex in np.intersect1d(edges, split):
        new += _parted(film, mesh, int(vertex), across[vertex].tolist(), edges, V)
    for edge in edges.tolist():
        f = mesh.at_edge(film.one_side[0], *edge)
        s, t = (mesh.steps[f, mesh.vertices[f] == v][0] for v in edge)
        for k in range(columns):
            (a, c), (b, d) = across[edge, k : k + 2].tolist()
            new += [((a, b, d), (s, t, t), film.patch)] if d != b else []
            new += [((a, d, c), (s, t, s), film.patch)] if c != a else []
    vertices, steps, patch = (np.array(part) for part in zip(*new, strict=True))
    shares = 1.0 - 2.0 * np.arange(1, columns + 1) / columns
    parting = np.concatenate([half, (half[split, None] * shares[:, None]).reshape(-1, 3)])
    own = np.concatenate([np.arange(count), np.repeat(split, columns)])  # the vertex that each one was
    opened = _Mesh(
        mesh.X[own] + parting,
        mesh.supports[own],
        np.concatenate([V, vertices]),
        np.concatenate([mesh.steps, steps.reshape(len(new), *mesh.steps.shape[1:])]),
        np.concatenate([mesh.patch, patch]),
    )
    return opened, parting


def _parted(
    film: Film, mesh: _Mesh, vertex: int, across: Sequence[int], edges: Ints, V: Ints
) -> list[Triangle]:
    """Gives the last vertex ``across`` to the other patches on the side of B and D, in V (m,3). Where a patch
    lies between both sides, its fan is cut in its middle, and triangles fill the gap."""
    rows = np.flatnonzero((mesh.vertices == vertex).any(axis=1))
    of_sides = (rows[np.isin(mesh.patch[rows], side)] for side in (film.one_side, film.other_side))
    near, far = (np.setdiff1d(mesh.vertices[beside], edges) for beside in of_sides)
    others = rows[~np.isin(mesh.patch[rows], film.sheets)]
    corner = np.argmax(mesh.vertices[others] == vertex, axis=1)
    arcs = np.stack([mesh.vertices[others, (corner + k) % 3] for k in (1, 2)], axis=1)
    stop = np.bincount(arcs.ravel(), minlength=len(mesh.X)) != 2
    stop[np.concatenate([near, far])] = True
    filled = list[Triangle]()
    for chain, closed, _ in joined(arcs, stop, len(stop)):
        sides = [int(v in near) - int(v in far) for v in chain[[0, -1]].tolist()]
        if closed or sum(sides) > 0 or sides == [0, 0]:
            continue
        chain = chain if sides != [-1, 1] else chain[::-1]
        cut = (len(chain) - 1) // 2 if sum(sides) == 0 else 0
        fan = [others[np.isin(arcs, chain[k : k + 2]).all(axis=1)][0] for k in range(cut, len(chain) - 1)]
        V[fan] = np.where(V[fan] == vertex, across[-1], V[fan])
        if sum(sides) == 0:
            f, spoke = int(fan[0]), int(chain[cut])
            s, t = (mesh.steps[f, mesh.vertices[f] == v][0] for v in (vertex, spoke))
            for pair in pairwise(across):
                one, other = pair[:: mesh.sense(f, vertex, spoke)]
                filled.append(((one, spoke, other), (s, t, s), int(mesh.patch[f])))
    return filled


def _with_sign(room: Room, patch: str, sign: int) -> Room:
    """The room with a patch on this side of it, or without it for 0."""
    others = {name: own for name, own in room.patches if name != patch}
    return replace(room, patches=tuple((others | ({patch: sign} if sign else {})).items()))


def _rebuilt(
    surface: Surface, mesh: _Mesh, target: Ints, patches: Sequence[Patch], rooms: Sequence[Room]
) -> tuple[Surface, Ints]:
    """The surface of this mesh, and which vertex each of its own is: images are one vertex."""
    X = mesh.X.copy()
    guides = [surface.plane, *(guide for guide, _ in (*surface.on_planes, *surface.given_supports.on_line))]
    for guide, on in zip(guides, mesh.supports.T[1:], strict=True):
        X[on] = guide.nearest(X[on])
    flat = mesh.steps.reshape(3 * len(mesh.steps), mesh.steps.shape[2])
    keys = np.column_stack([mesh.vertices.ravel(), np.abs(flat).sum(axis=1), flat])
    placed, number = np.unique(keys, axis=0, return_inverse=True)
    vertex = placed[:, 0]
    first = np.unique(vertex, return_index=True)[1]
    place = np.full(len(X), -1)
    place[vertex[first]] = first
    image = np.setdiff1d(np.arange(len(placed)), first)
    edges = place[target[surface.topology.edges]]
    left = (edges >= 0).all(axis=1) & (edges[:, 0] != edges[:, 1])
    made = surface.with_mesh(
        mesh.supports[vertex],
        vertices=X[vertex] + placed[:, 2:] @ lattice_of(surface),
        faces=number.reshape(-1, 3),
        patch_of_face=mesh.patch,
        patches=tuple(patches),
        rooms=tuple(rooms),
        cables=tuple(replace(cable, edges=place[cable.edges]) for cable in surface.cables),
        curves=surface.edges_on_curves[left].joined(edges[left]) if surface.curves else (),
        images=np.stack([image, place[vertex[image]]], axis=1),
    )
    return made, vertex


def _widened(surface: Surface, parting: Floats) -> tuple[Surface, float]:
    """The surface with its new film as wide as lowers the energy most, all others following; how many times.
    ``parting`` (n,3): the way of the film's vertices from its middle. Others go the mean way of those
    around."""
    known = parting.any(axis=1) | surface.fixed | (surface.original != np.arange(surface.n))
    way = in_the_middle(surface.original[surface.faces], known, parting)
    way = surface.spread(apply_supports(surface, way))
    most = VOLUME * np.abs(prescribed_volumes(surface))
    best, least, times, before = surface, energy(surface), 1.0, patch_volumes(surface, surface.vertices)
    for width in WIDTHS.tolist():
        wider = surface.moved(surface.onto_supports(surface.vertices + width * way))
        growth = surface.room_signs @ (patch_volumes(surface, wider.vertices) - before)
        turned = turns_over(best.vertices, wider.vertices, surface.faces)
        if energy(wider) >= least or turned or (np.abs(growth) > most).any():
            break
        best, least, times = wider, energy(wider), 1.0 + width
    return best, times
