"""A film between two junctions replaced by one between the other two of the four sheets: a T1 of a foam.

The film meets the sheets A and B at the one junction, C and D at the other; A and C are on the same side of
it. It shrinks to a curve at which all four meet. This opens to a new film, with A and C at its one junction
and B and D at the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import SurfaceError
from ..base.tolerances import ON
from ..forces.functional import energy, patch_volumes
from ..forces.rooms import prescribed_volumes
from ..surface import Patch, Room, Surface
from ..surface.geometry import area_vectors, edge_vectors, face_areas
from ..surface.images import lattice_of
from ..surface.lagrange import expect_flat
from ..surface.supports import apply_supports
from ..surface.topology import joined
from .quality import turns_over
from .strips import Strip, lattice_steps, strip_of

WIDTH = 0.75  # of the square root of the area of the triangles beside: how wide the new film is at first
WIDTHS = 0.5 * 1.25 ** np.arange(16)  # further, of that
VOLUME = 0.1  # of a room's own: by no more does the new film change it
Triangle = tuple[tuple[int, int, int], tuple[Ints, Ints, Ints], int]  # vertices, steps and patch


def swap(surface: Surface, patch: str) -> Surface:
    """The surface with other neighbours of a film between two junctions; not solved.

    The new film has the name, tension and weight of the old one. Its pressure, its snow and the rooms that
    it bounds follow from the sheets beside it. A roof over the film goes along: the patches at its sides
    part, those at its ends meet. Where all four sheets meet, they stay together and the patch is gone if its
    tension holds them both ways: if it is at least (f_A + f_C - f_B - f_D)/2 and (f_A + f_B - f_C - f_D)/2,
    with the pulls f of the sheets.

    Parameters
    ----------
    patch : the name of the film; a narrow one changes the shape least.

    Raises
    ------
    SurfaceError : the patch is no such film, its junctions end at different fixed places, or a cable ends
        on it.
    """
    expect_flat(surface.cell, "swap")
    strip = strip_of(surface, surface.patch_index(patch))
    if strip is None:
        text = f"patch {patch!r} is no strip between two junctions with two other patches each, four in all;"
        raise SurfaceError(f"{text} only the neighbours of a strip can be swapped", what="patch", where=patch)
    own = surface.faces[surface.patch_of_face == strip.patch]
    if cables := [cable.name for cable in surface.cables if np.isin(cable.edges, own).any()]:
        text = f"cable {cables[0]!r} runs on or to patch {patch!r}, whose neighbours are to be swapped"
        raise SurfaceError(f"{text}; leave the cable out", what="cables", where=cables[0])
    lattice = lattice_of(surface)
    target, X, columns = _collapsed(surface, strip)
    F, Y = surface.original[surface.faces], surface.vertices
    steps = lattice_steps(lattice, Y[surface.faces] - Y[F]) + lattice_steps(lattice, Y - Y[target])[F]
    mesh = _Mesh(target[F], steps, surface.patch_of_face)
    mesh = mesh[(mesh.patch != strip.patch) & (mesh.vertices[:, [1, 2, 0]] != mesh.vertices).all(axis=1)]
    curve = target[strip.pairs[:, 0]]
    curve = curve[np.sort(np.unique(curve, return_index=True)[1])]
    edges = np.stack([curve, np.roll(curve, -1)], axis=1)[: None if strip.closed else -1]
    # along an edge the values of A, C and the new film cancel, each with the sense in which it runs there
    values = np.array([surface.pressures, surface.snows, *surface.room_signs])[:, list(strip.one_side)]
    values = 0.0 - values @ [mesh.sense(mesh.at_edge(k, *edges[0]), *edges[0]) for k in strip.one_side]
    patches = list(surface.patches)
    half = _opening(surface, strip, mesh, X, edges, columns)
    if half is None:
        mesh = replace(mesh, patch=mesh.patch - (mesh.patch > strip.patch))
        del patches[strip.patch]
        values[:] = 0.0
        half = np.zeros(X.shape)
    else:
        split = np.flatnonzero(half.any(axis=1))
        twin = np.arange(len(X))
        twin[split] = len(X) + np.arange(len(split))
        mesh = _opened(strip, mesh, edges, twin)
        X, columns = np.concatenate([X, X[split]]), np.concatenate([columns, columns[split]])
        half = np.concatenate([half, -half[split]])
        wall = bool(surface.walls[strip.patch])
        own = {"pressure": float(values[0]), "snow": float(values[1]), "wall": wall}
        patches[strip.patch] = replace(patches[strip.patch], **own)
    rooms = [_with_sign(room, patch, int(sign)) for room, sign in zip(surface.rooms, values[2:], strict=True)]
    X = X + half
    guides = [surface.plane, *(guide for guide, _ in (*surface.on_planes, *surface.given_supports.on_line))]
    for guide, on in zip(guides, columns.T[1:], strict=True):
        X[on] = guide.nearest(X[on])
    changed, vertex = _rebuilt(surface, mesh, X, columns, target, patches, rooms)
    return _widened(changed, half[vertex])


@dataclass(frozen=True, eq=False)
class _Mesh:
    """Triangles: vertices that are no images, and the translations from there to the corners."""

    vertices: Ints  # (m,3)
    steps: Ints  # (m,3,d) whole multiples of the lattice
    patch: Ints  # (m,)

    def __getitem__(self, chosen: Bools) -> _Mesh:
        return _Mesh(self.vertices[chosen], self.steps[chosen], self.patch[chosen])

    def at_edge(self, sheet: int, a: int, b: int) -> int:
        """The first triangle of a sheet that has the edge from a to b."""
        has = (self.vertices == a).any(axis=1) & (self.vertices == b).any(axis=1)
        return int(np.argmax(has & (self.patch == sheet)))

    def sense(self, triangle: int, a: int, b: int) -> int:
        """1 if a triangle runs from a to b, -1 if from b to a."""
        corners = self.vertices[triangle].tolist()
        return 1 if corners[corners.index(a) - 2] == b else -1


def _collapsed(surface: Surface, strip: Strip) -> tuple[Ints, Floats, Bools]:
    """The vertex (n,) that each one becomes once the film has vanished; places (n,3) and supports then."""
    target, X, columns = surface.original.copy(), surface.vertices.copy(), surface.support_columns.copy()
    lattice, freedom = lattice_of(surface), surface.admissible.freedom

    def near(vertex: int, others: Ints) -> Floats:
        step = surface.vertices[others] - surface.vertices[vertex]
        return np.asarray(step - lattice_steps(lattice, step) @ lattice)

    fewer = int(np.argmin([len(np.unique(column)) for column in strip.pairs.T]))
    for vertex in np.unique(strip.pairs[:, fewer]):
        both = np.append(vertex, strip.pairs[strip.pairs[:, fewer] == vertex, 1 - fewer])
        most_held = freedom[both] == freedom[both].min()
        steps = near(vertex, both[most_held])
        if freedom[both].min() == 0 and np.ptp(steps, axis=0).max() > ON * surface.size:
            name = surface.patches[strip.patch].name
            text = f"the junctions of patch {name!r} are held at different places, so it cannot vanish;"
            raise SurfaceError(f"{text} let their ends slide", what="patch", where=name)
        X[vertex], columns[vertex] = X[vertex] + steps.mean(axis=0), columns[both].any(axis=0)
        target[both] = vertex
    ends = strip.pairs[[0, -1], fewer]
    own = surface.original[surface.faces[surface.patch_of_face == strip.patch]]
    for vertex in np.setdiff1d(own, strip.pairs):  # of its short sides, where a roof goes on
        target[vertex] = ends[np.linalg.norm(near(vertex, ends), axis=1).argmin()]
    return target[surface.original], X, columns


def _opening(
    surface: Surface, strip: Strip, mesh: _Mesh, X: Floats, edges: Ints, columns: Bools
) -> Floats | None:
    """(n,3) half the width of the new film, from its middle to A and C; None where it does not open."""
    at, lattice = np.zeros(len(X), dtype=bool), lattice_of(surface)
    at[edges] = True
    beside = mesh[np.isin(mesh.patch, strip.sheets) & at[mesh.vertices].any(axis=1)]
    P = X[beside.vertices] + beside.steps @ lattice
    normal, area = area_vectors(P), face_areas(P)
    weight = 0.5 * surface.tensions[beside.patch] / np.where(area > 0.0, area, 1.0)
    pull = np.zeros((len(surface.patches), *X.shape))  # of each sheet, - α ∂A/∂x, (15a)
    corner_pull = weight[:, None, None] * np.cross(edge_vectors(P), normal[:, None])
    np.add.at(pull, (beside.patch[:, None], beside.vertices), corner_pull)
    (a, c), (b, d) = strip.one_side, strip.other_side
    new, old = 0.5 * (pull[a] + pull[c] - pull[b] - pull[d]), 0.5 * (pull[a] + pull[b] - pull[c] - pull[d])
    guided = columns[:, 2 + len(surface.on_planes) :].any(axis=1)
    at &= ~columns[:, 0] | guided  # a fixed end stays one
    span = X[edges[:, 1]] - X[edges[:, 0]]
    span -= lattice_steps(lattice, span) @ lattice
    lengths = np.bincount(edges.ravel(), np.repeat(0.5 * np.linalg.norm(span, axis=1), 2), len(X))
    holds = surface.tensions[strip.patch] * lengths[at].sum()
    strength = np.linalg.norm(new, axis=1)
    if max(strength[at].sum(), np.linalg.norm(old, axis=1)[at].sum()) <= holds:
        return None
    at &= strength > 0.0
    half = 0.5 * WIDTH * np.sqrt(area.mean()) * new / np.where(at, strength, 1.0)[:, None]
    return np.where(at[:, None], half, 0.0)


def _opened(strip: Strip, mesh: _Mesh, edges: Ints, twin: Ints) -> _Mesh:
    """The triangles once B and D have the twins (n,) of the curve's vertices, with those of the new film."""
    V, new = mesh.vertices.copy(), list[Triangle]()
    far = np.isin(mesh.patch, strip.other_side)
    V[far] = twin[V[far]]
    for vertex in np.unique(edges):
        if twin[vertex] != vertex:
            new += _parted(strip, mesh, int(vertex), int(twin[vertex]), edges, V)
    for a, b in edges.tolist():
        f = mesh.at_edge(strip.one_side[0], a, b)
        s, t = (mesh.steps[f, mesh.vertices[f] == v][0] for v in (a, b))
        c, d = int(twin[a]), int(twin[b])
        new += [((a, b, d), (s, t, t), strip.patch)] if d != b else []
        new += [((a, d, c), (s, t, s), strip.patch)] if c != a else []
    vertices, steps, patch = (np.array(part) for part in zip(*new, strict=True))
    return _Mesh(
        np.concatenate([V, vertices]),
        np.concatenate([mesh.steps, steps.reshape(len(new), *mesh.steps.shape[1:])]),
        np.concatenate([mesh.patch, patch]),
    )


def _parted(strip: Strip, mesh: _Mesh, vertex: int, twin: int, edges: Ints, V: Ints) -> list[Triangle]:
    """Gives the twin of a vertex to the other patches there on the side of B and D, in V (m,3).

    Where a patch lies between both sides, its fan is cut in its middle, and a triangle fills the gap.
    """
    rows = np.flatnonzero((mesh.vertices == vertex).any(axis=1))
    sheet = mesh.patch[rows]
    near, far = (
        np.setdiff1d(mesh.vertices[rows[np.isin(sheet, side)]], edges)
        for side in (strip.one_side, strip.other_side)
    )
    others = rows[~np.isin(sheet, strip.sheets)]
    corner = np.argmax(mesh.vertices[others] == vertex, axis=1)
    arcs = np.stack([mesh.vertices[others, (corner + k) % 3] for k in (1, 2)], axis=1)
    stop = np.bincount(arcs.ravel(), minlength=mesh.vertices.max() + 1) != 2
    stop[np.concatenate([near, far])] = True
    filled = []
    for chain, closed, _ in joined(arcs, stop, len(stop)):
        sides = [int(v in near) - int(v in far) for v in chain[[0, -1]].tolist()]
        if closed or sum(sides) > 0 or sides == [0, 0]:
            continue
        chain = chain if sides != [-1, 1] else chain[::-1]
        cut = (len(chain) - 1) // 2 if sum(sides) == 0 else 0
        fan = [others[np.isin(arcs, chain[k : k + 2]).all(axis=1)][0] for k in range(cut, len(chain) - 1)]
        V[fan] = np.where(V[fan] == vertex, twin, V[fan])
        if sum(sides) == 0:
            f, spoke = int(fan[0]), int(chain[cut])
            s, t = (mesh.steps[f, mesh.vertices[f] == v][0] for v in (vertex, spoke))
            one, other = (vertex, twin)[:: mesh.sense(f, vertex, spoke)]
            filled.append(((one, spoke, other), (s, t, s), int(mesh.patch[f])))
    return filled


def _with_sign(room: Room, patch: str, sign: int) -> Room:
    """The room with a patch on this side of it, or without it for 0."""
    others = {name: own for name, own in room.patches if name != patch}
    return replace(room, patches=tuple((others | ({patch: sign} if sign else {})).items()))


def _rebuilt(
    surface: Surface,
    mesh: _Mesh,
    X: Floats,
    columns: Bools,
    target: Ints,
    patches: Sequence[Patch],
    rooms: Sequence[Room],
) -> tuple[Surface, Ints]:
    """The surface of these triangles, and which vertex each of its own is: images are one vertex."""
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
        columns[vertex],
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


def _widened(surface: Surface, half: Floats) -> Surface:
    """The surface with its new film as wide as lowers the energy most, all other vertices following evenly.

    ``half`` (n,3) is the way of the film's vertices from its middle; it is extended by the graph's Laplacian.
    """
    edges, n, way = surface.topology.edges, surface.n, half.copy()
    links = coo_array(
        (np.ones(2 * len(edges)), np.concatenate([edges, edges[:, ::-1]]).T), shape=(n, n)
    ).tocsr()
    laplacian = (diags_array(links.sum(axis=1) + 1e-9) - links).tocsr()
    inner = np.flatnonzero(~half.any(axis=1) & ~surface.fixed & (surface.original == np.arange(n)))
    if len(inner):
        way[inner] = -splu(laplacian[inner][:, inner].tocsc()).solve(laplacian[inner] @ half)
    way = surface.spread(apply_supports(surface, way))
    most = VOLUME * np.abs(prescribed_volumes(surface))
    best, least, before = surface, energy(surface), patch_volumes(surface, surface.vertices)
    for width in WIDTHS:
        wider = surface.moved(surface.onto_supports(surface.vertices + width * way))
        growth = surface.room_signs @ (patch_volumes(surface, wider.vertices) - before)
        turned = turns_over(best.vertices, wider.vertices, surface.faces)
        if energy(wider) >= least or turned or (np.abs(growth) > most).any():
            break
        best, least = wider, energy(wider)
    return best
