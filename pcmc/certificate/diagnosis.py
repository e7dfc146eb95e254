"""Where and why a surface collapses: triangles, and the narrowest neck; what moves along the way down."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, maximum_flow
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints, mask_of
from ..base.errors import SurfaceError
from ..base.tolerances import PINCHED
from ..meshing.neighbour_swap import collapsed, film_of
from ..meshing.quality import edge_lengths, triangle_quality
from ..surface import Surface
from ..surface.geometry import area_vectors, face_areas, segment_lengths
from ..surface.pieces import point_text
from ..surface.supports import members
from ..surface.topology import EdgeCurve, components
from .forces import held_boundary
from .tables import names_of

UNITS = 500_000_000  # of the length of all edges: the flow counts in whole numbers


@dataclass(frozen=True, eq=False)
class Neck:
    """The shortest cut through the triangles that parts two held curves."""

    girth: float  # its length
    place: Floats  # (3,) its middle
    curve: float  # length of the shorter of the two curves

    @property
    def ratio(self) -> float:
        """The girth over that length."""
        return self.girth / self.curve

    def __str__(self) -> str:
        place = point_text(self.place, self.curve)
        around = f"{self.girth:.2g} around, {self.ratio:.2g} of the shorter curve that holds it"
        return f"a neck pinches off near {place}: {around}"


def pinched_neck(surface: Surface) -> Neck | None:
    """The narrowest neck between two held curves, if it has pinched off; else None."""
    neck = narrowest_neck(surface)
    return neck if neck is not None and neck.ratio < PINCHED else None


def narrowest_neck(surface: Surface) -> Neck | None:
    """The narrowest neck between two held parts of one connected part; None without two of these.

    A minimal cut: of all sets of edges that part the triangles at one held curve from those at the other, the
    one of least length. It is computed as a maximal flow from triangle to triangle (Ford and Fulkerson 1956).

    >>> from pcmc import Patch
    >>> angle = 2 * np.pi * np.arange(6) / 6
    >>> ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> X = np.concatenate([ring, 0.1 * ring + [0, 0, 1], ring + [0, 0, 2]])
    >>> i, j = np.arange(6), (np.arange(6) + 1) % 6
    >>> band = np.concatenate([np.stack([i, j, i + 6], 1), np.stack([j, j + 6, i + 6], 1)])
    >>> film = Surface(X, np.concatenate([band, band + 6]), [0] * 24, [Patch("film", 1.0, 0.0)],
    ...                fixed=np.r_[0:6, 12:18])
    >>> neck = narrowest_neck(film)
    >>> round(neck.girth, 9), round(neck.ratio, 9), neck.place.round(9).tolist()
    (0.6, 0.1, [0.0, 0.0, 1.0])
    """
    groups, lengths = held_groups(surface)
    count = len(lengths) if len(lengths) > 2 else len(lengths) // 2  # of two, one cut parts both
    necks = [_cut(surface, groups, lengths, number) for number in range(count)]
    return min((neck for neck in necks if neck is not None), key=lambda neck: neck.ratio, default=None)


def held_groups(surface: Surface) -> tuple[Ints, Floats]:
    """(n,) number of each vertex's held curve, -1 where there is none; and the curves' lengths.

    Curves are the connected parts of held boundary edges; only those on a connected part of the surface that
    has two or more are numbered. A curve that slides on Π has infinite length: it may shrink.
    """
    topo, n = surface.topology, surface.n
    edges = topo.edges[held_boundary(surface)]
    label = components(edges, n)
    on_curve = mask_of(edges, n)
    curves, first = np.unique(label[on_curve], return_index=True)
    part = topo.components[np.flatnonzero(on_curve)[first]]
    several = curves[np.bincount(part)[part] > 1] if len(part) else curves
    groups, lengths = np.full(n, -1), np.full(len(several), np.inf)
    for number, curve in enumerate(several):
        mine = on_curve & (label == curve)
        groups[mine] = number
        if (surface.pinned & mine).any():
            lengths[number] = segment_lengths(surface.vertices, edges[mine[edges[:, 0]]]).sum()
    return groups, lengths


def _cut(surface: Surface, groups: Ints, lengths: Floats, number: int) -> Neck | None:
    """The shortest cut between one held curve and the others on its part; None if all only slide, or if no
    edge joins them."""
    topo, X = surface.topology, surface.vertices
    source = groups == number
    others = (groups >= 0) & ~source & np.isin(topo.components, topo.components[source])
    starts, ends = (np.flatnonzero(mask[surface.faces].sum(axis=1) > 1) for mask in (source, others))
    shorter = float(min(lengths[number], lengths[np.unique(groups[others])].min()))
    if not 0.0 < shorter < np.inf or len(np.intersect1d(starts, ends)):
        return None
    inner = np.flatnonzero(topo.valence > 1)
    cut = inner[_minimal_cut(topo.edge_of_face, inner, segment_lengths(X, topo.sides[inner]), starts, ends)]
    if not len(cut):  # the parts share vertices, but no edge
        return None
    girth = segment_lengths(X, topo.sides[cut])
    place = (girth @ X[topo.sides[cut]].mean(axis=1)) / (girth.sum() or 1.0)
    return Neck(float(girth.sum()), place, shorter)


def _minimal_cut(edge_of_face: Ints, inner: Ints, lengths: Floats, starts: Ints, ends: Ints) -> Bools:
    """(k,) which of the inner edges (k,) make the shortest cut between two sets of triangles.

    Nodes are the triangles, two for each edge, a source and a sink. An edge passes on at most its length
    between the triangles at it.
    """
    m, k = len(edge_of_face), len(inner)
    number = np.full(int(edge_of_face.max()) + 1, -1)
    number[inner] = np.arange(k)
    face, edge = np.repeat(np.arange(m), 3), number[edge_of_face.ravel()]
    face, edge = face[edge >= 0], edge[edge >= 0]
    source, sink, plenty = m + 2 * k, m + 2 * k + 1, 2 * UNITS
    capacity = np.maximum(np.rint(lengths * (UNITS / lengths.sum())), 1.0)
    links = (
        (face, m + edge, plenty),
        (m + np.arange(k), m + k + np.arange(k), capacity),
        (m + k + edge, face, plenty),
        (source, starts, plenty),
        (ends, sink, plenty),
    )
    row, column, data = np.concatenate([np.broadcast_arrays(*link) for link in links], axis=1)
    graph = csr_array(coo_array((data.astype(np.int32), (row, column)), shape=(sink + 1, sink + 1)))
    left = (graph - csr_array(maximum_flow(graph, source, sink).flow)).astype(float)
    left.eliminate_zeros()
    reached = mask_of(breadth_first_order(left, source, return_predecessors=False), sink + 1)
    return np.asarray(reached[m : m + k] & ~reached[m + k : m + 2 * k])


REACH = 1.5  # median edge lengths: the cause is looked for this near to the worst triangle
LOW = 0.2  # median edge lengths: a held wall this low has no room for triangles
NARROW = 0.05  # of the smallest area beside it: a film this small between two junctions vanishes
VANISHED = "vanished"  # all films that have, in place of their names
SWAP = f"try pcmc solve FILE --swap {VANISHED}, or pcmc.swap_neighbours(surface)"
KEY = 'in a plan, bottom = "{}"'
ALONG = 30.0  # degrees: at a smaller angle to the support a junction counts as lying along it
ALIKE = 6  # decimals of a share: symmetric places differ by rounding
FOLDED = 175.0  # degrees: a tent eleven times as high as wide may have less at its ridge
SLIPS = 0.25  # of the mode's largest motion: that much beside a fixed end is a slip of this end


def where_collapsed(surface: Surface, pinchable: Bools) -> str:
    """Names the worst triangle outside walls that can pinch, and its cause if that is a known one.

    ``pinchable`` (k,) marks these walls. Two causes are known: a junction slips along a support away from its
    own end, where only the mesh holds it; or it comes down on the held bottom of its wall, which cannot pinch
    (``find_walls``).
    """
    face, quality = worst_face(surface, pinchable)
    place = surface.vertices[surface.faces[face]].mean(axis=0)
    worst = f"worst is face {face} of patch {surface.patches[surface.patch_of_face[face]].name!r} near"
    worst += f" {point_text(place, surface.size)}, quality {quality:.1e}"
    if films := vanished_films(surface):
        meeting = film_of(surface, films[0]).meeting(surface, "then")
        others = f" and {len(films) - 1} more" if len(films) > 1 else ""
        return f"{worst}; patch {films[0]!r}{others} may vanish: {meeting}; {SWAP}"
    if held_wall_down(surface, pinchable):
        worst += "; the junction there comes down on the held bottom of its wall, so the wall has no height"
        worst += " left: make the wall weaker, or let its bottom slide so that the junction can rest on the"
        return f"{worst} plane ({KEY.format('sliding')})"
    if _slips(surface, pinchable, place, REACH * float(np.median(edge_lengths(surface)))):
        worst += "; the junction there slips along a support, which does not hold its end: hold the bottom of"
        worst += f" its wall ({KEY.format('held')})"
    return worst


def vanished_films(surface: Surface) -> list[str]:
    """The films that have vanished and nothing holds open, by name: narrow, and small beside the others."""
    areas = face_areas(surface.vertices[surface.faces])
    area, names = np.bincount(surface.patch_of_face, areas, len(surface.patches)), list[str]()
    for patch in np.flatnonzero(area < NARROW * area.max()):
        with suppress(SurfaceError):  # it is no film, or held open
            film = collapsed(surface, surface.patches[patch].name)[0]
            if area[patch] < NARROW * area[list(film.sheets)].min() and film.width < 2.0 * film.height:
                names.append(surface.patches[patch].name)
    return names


def held_wall_down(surface: Surface, pinchable: Bools) -> bool:
    """Whether the worst triangle is in a wall whose junction has come down on its held bottom.

    Without a bottom vertex below each junction vertex such a wall cannot pinch: its triangles collapse.
    """
    X, patch = surface.vertices, int(surface.patch_of_face[worst_face(surface, pinchable)[0]])
    used = mask_of(surface.faces[surface.patch_of_face == patch], surface.n)
    top = used & surface.topology.on_junction
    bottom, top = used & surface.pinned & ~top, top & ~surface.pinned
    if not (surface.auxiliary[patch] and top.any() and bottom.any()):
        return False
    height = float(np.min(cKDTree(X[bottom]).query(X[top])[0]))
    return height < LOW * float(np.median(edge_lengths(surface)))


def worst_face(surface: Surface, left_out: Bools) -> tuple[int, float]:
    """The worst triangle outside the patches (k,) that are left out, and its quality."""
    quality = triangle_quality(surface.vertices, surface.faces)
    outer = np.where(left_out[surface.patch_of_face], np.inf, quality)
    return int(outer.argmin()), float(outer.min())


def folded_over(surface: Surface, pinchable: Bools) -> str:
    """Names a patch, not a wall that can pinch, with a triangle on the back of another; else empty.

    Their normals turn by more than ``FOLDED`` at an edge that is neither held nor a cable's, inside a patch
    or between two, whose sheets may meet with opposite sides. Patches without tension and weight are left
    out: their area counts for nothing.
    """
    topo, counts = surface.topology, (surface.tensions != 0.0) | (surface.weights != 0.0)
    free = ~(surface.fixed[topo.edges[:, 0]] & surface.fixed[topo.edges[:, 1]])
    free[topo.edge_numbers(surface.cable_edges.ends)] = False
    free[topo.edges_of((pinchable | ~counts)[surface.patch_of_face])] = False
    free &= topo.valence == 2
    one, other = topo.neighbours[free[topo.valence == 2]].T // 3
    vectors = area_vectors(surface.vertices[surface.faces])
    sizes = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    cosines = np.einsum("ij,ij->i", vectors[one], vectors[other])
    cosines *= np.where(topo.one_way_edge[free], -1.0, 1.0)  # there they show opposite sides
    back = cosines < np.cos(np.radians(FOLDED)) * sizes[one] * sizes[other]
    if not back.any():
        return ""
    face = one[back.argmax()]
    name = surface.patches[surface.patch_of_face[face]].name
    place = point_text(surface.vertices[surface.faces[face]].mean(axis=0), surface.size)
    text = f"patch {name!r} is folded near {place}: a triangle lies on the back of another, and the area"
    return f"{text} there counts twice; move the vertices there apart, or remesh"


def _slips(surface: Surface, pinchable: Bools, place: Floats, reach: float) -> bool:
    """Whether a junction near the place slides on a support next to its fixed end, or lies along it."""
    X, topo = surface.vertices, surface.topology
    near = np.linalg.norm(X - place, axis=1) <= reach
    if not (near & topo.on_junction & ~surface.pinned).any():
        return False
    if (near & surface.pinned).any() and (near & surface.on_ground).any():
        return True
    held = topo.edges[topo.boundary_edge & surface.pinned[topo.edges].all(axis=1)]
    for curve in topo.junctions:
        if near[curve.vertices].any() and pinchable[list(curve.sheets)].any():
            for end, beside in curve.ends:
                sides = X[held[(held == end).any(axis=1)].sum(axis=1) - end] - X[end]
                edge = X[beside] - X[end]
                lengths = np.linalg.norm(sides, axis=1) * np.linalg.norm(edge)
                if surface.pinned[end] and (sides @ edge > np.cos(np.radians(ALONG)) * lengths).any():
                    return True
    return False


class SlippingEnd(NamedTuple):
    """A fixed end of a junction next to which a mode moves almost as far as anywhere.

    A mode that the end holds rises from 0 along the junction, to about π h / L after an edge h of the length
    L; one that slips jumps, whatever the mesh, and only the triangles at the end hold it.
    """

    junction: EdgeCurve
    vertex: int
    share: float  # the mode's motion at the junction's next vertex over its largest motion


def slipping_ends(surface: Surface, mode: Floats) -> list[SlippingEnd]:
    """The fixed ends of junctions that slip in a mode (n,3), the one that slips most first."""
    motion = np.linalg.norm(mode, axis=1)
    largest = float(motion.max(initial=0.0))
    ends = [
        SlippingEnd(curve, end, float(motion[beside] / largest))
        for curve in surface.topology.junctions
        for end, beside in curve.ends
        if surface.pinned[end] and motion[beside] >= SLIPS * largest > 0.0
    ]
    return sorted(ends, key=lambda end: -round(end.share, ALIKE))  # of equal ones the first of the mesh


def slipping_rings(surface: Surface, mode: Floats) -> list[str]:
    """The walls below closed junctions that slip in a mode (n,3): nothing holds their sliding bottoms.

    A junction from mirror to mirror is closed, too, or has no end.
    """
    motion, names = np.linalg.norm(mode, axis=1), list[str]()
    in_mirror = members([pair for pair in surface.on_planes if pair[0].mirror], surface.n)
    for curve in surface.topology.junctions:
        closed = all(in_mirror[end] for end, _ in curve.ends)
        if closed and motion[curve.vertices].max() >= SLIPS * motion.max() > 0.0:
            for wall in (i for i in curve.sheets if surface.walls[i]):
                F = surface.faces[surface.patch_of_face == wall]
                if surface.on_ground[F].any() and not surface.pinned[F].any():
                    names.append(surface.patches[wall].name)
    return names


def describe_saddle(surface: Surface, index: int, mode: Floats) -> str:
    """The ways down from a saddle: where its lowest mode (n,3) moves most, and which ends slip in it."""
    text = f"index {index}: {'1 way' if index == 1 else f'{index} ways'} down"
    if not len(mode):
        return text
    motion = np.linalg.norm(mode, axis=1)
    most = int(np.round(motion / (motion.max() or 1.0), ALIKE).argmax())
    curves = [curve for curve in surface.topology.junctions if most in curve.vertices]
    face = int(np.flatnonzero((surface.faces == most).any(axis=1))[0])
    part = f"patch {surface.patches[surface.patch_of_face[face]].name!r}"
    part = f"the junction {names_of(surface, curves[0].sheets)}" if curves else part
    text += f"; the mode moves {part} most, near {point_text(surface.vertices[most], surface.size)}"
    if rings := " and of ".join(map(repr, slipping_rings(surface, mode))):
        text += f"; the bottom of {rings} slips: hold it ({KEY.format('held')})"
    ends = slipping_ends(surface, mode)
    if not ends:
        return text
    junctions = " and of ".join(dict.fromkeys(names_of(surface, end.junction.sheets) for end in ends))
    places = " and ".join(point_text(surface.vertices[end.vertex], surface.size) for end in ends[:4])
    below = dict.fromkeys(i for end in ends for i in end.junction.sheets if surface.walls[i])
    walls = " and of ".join(repr(surface.patches[i].name) for i in below)
    advice = f"hold the bottom of {walls} ({KEY.format('held')})" if walls else "put a wall below it"
    which, verb = ("end", "slips") if len(ends) == 1 else ("ends", "slip")
    text += f"; the {which} of {junctions} at {places} {verb}: one edge away the junction moves"
    return f"{text} {ends[0].share:.2f} as far, so only the mesh holds it there; {advice}"
