"""Edges, curves and points against what a plain loop over the faces finds."""

from collections import defaultdict
from itertools import pairwise

import numpy as np
import pytest
from refusals import refused
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapes import cap, hexagon, octahedron, pyramid, three_patches

from pcmc import Patch, Surface
from pcmc.base.errors import SurfaceError
from pcmc.surface.topology import CURVE, POINT, SHEET, components, curve_neighbours, topology


def edges_by_hand(surface):
    """Edge → its faces, from the definition."""
    faces_of = defaultdict(list)
    for f, (a, b, c) in enumerate(surface.faces.tolist()):
        for pair in ((a, b), (b, c), (c, a)):
            faces_of[tuple(sorted(pair))].append(f)
    return faces_of


def two_bubbles():
    """Two tetrahedron-like bubbles on one triangle: its rim is a closed junction."""
    X = [[1, 0, 0], [-0.5, 0.8, 0], [-0.5, -0.8, 0], [0, 0, 1], [0, 0, -1]]
    F = [[0, 1, 3], [1, 2, 3], [2, 0, 3], [1, 0, 4], [2, 1, 4], [0, 2, 4], [0, 1, 2]]
    patches = [Patch("up", 1.0), Patch("down", 1.0), Patch("disc", 1.0, pressure=0.0)]
    return Surface(X, F, [0, 0, 0, 1, 1, 1, 2], patches, fixed=[0])


def umbrella():
    """A vertex with many triangles, its number the lowest."""
    angle = 2.0 * np.pi * np.arange(400) / 400
    X = np.vstack([[0, 0, 1], np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])])
    ring = np.random.default_rng(3).permutation(len(angle)) + 1  # neighbours out of order
    X[ring] = X[1:].copy()
    F = [[0, a, b] for a, b in zip(ring, np.roll(ring, -1), strict=True)]
    return Surface(X, F, [0] * len(F), [Patch("roof", 1.0)], fixed=ring)


def shuffled():
    """The three patches with vertices and faces in any order."""
    surface, random = three_patches(3), np.random.default_rng(4)
    place, face = random.permutation(surface.n), random.permutation(surface.m)
    X, fixed = np.empty_like(surface.vertices), place[np.flatnonzero(surface.fixed)]
    X[place] = surface.vertices
    F = place[surface.faces][face]
    return Surface(X, F, surface.patch_of_face[face], surface.patches, fixed=fixed)


@pytest.mark.parametrize(
    "make", [pyramid, octahedron, three_patches, two_bubbles, lambda: cap(3), umbrella, shuffled]
)
def test_edges_and_their_faces(make):
    surface = make()
    t, expected = surface.topology, edges_by_hand(surface)
    assert [tuple(e) for e in t.edges.tolist()] == sorted(expected)
    assert t.valence.tolist() == [len(expected[e]) for e in sorted(expected)]
    for f, face in enumerate(surface.faces.tolist()):
        for k in range(3):
            opposite = sorted({*face} - {face[k]})
            assert t.edges[t.edge_of_face[f, k]].tolist() == opposite


@pytest.mark.parametrize("make", [pyramid, octahedron, three_patches, two_bubbles, lambda: cap(3)])
def test_kinds_of_vertices(make):
    surface = make()
    t, patch = surface.topology, surface.patch_of_face
    degree = np.zeros(surface.n, int)
    boundary, junction = set(), set()
    for (a, b), faces in edges_by_hand(surface).items():
        single, branching = len(faces) == 1, len(faces) > 2
        seam = len(faces) == 2 and patch[faces[0]] != patch[faces[1]]
        degree[[a, b]] += single or branching or seam
        boundary |= {a, b} if single else set()
        junction |= {a, b} if branching or seam else set()
    expected = [SHEET if d == 0 else CURVE if d == 2 else POINT for d in degree]
    assert t.vertex_kind.tolist() == expected
    assert set(np.flatnonzero(t.on_boundary)) == boundary
    assert set(np.flatnonzero(t.on_junction)) == junction
    assert set(np.flatnonzero(~t.interior)) == boundary | junction


def test_the_three_patches_of_fig_4():
    surface = three_patches(3)
    t = surface.topology
    assert surface.n - len(t.edges) + surface.m == 1  # three half-discs' roofs and fins: contractible
    assert [c.sheets for c in t.junctions] == [(0, 1, 4), (1, 2, 5), (0, 2, 3), (3, 4, 5)]
    assert [len(c.vertices) for c in t.junctions] == [4, 4, 4, 4]
    top = np.flatnonzero((surface.vertices == [0, 0, 1.5]).all(axis=1))[0]
    ends = [{int(c.vertices[0]), int(c.vertices[-1])} for c in t.junctions]
    assert all(top in pair for pair in ends)
    assert t.vertex_kind[top] == POINT
    assert sorted(len(c.vertices) for c in t.boundary_loops) == [4, 4, 4, 7, 7, 7]
    assert set(t.components) == {0}


def test_curves_run_along_edges_without_gaps():
    surface = three_patches(4)
    t = surface.topology
    known = {tuple(e) for e in t.edges[t.curve_edge].tolist()}
    seen = []
    for curve in (*t.junctions, *t.boundary_loops):
        chain = [*curve.vertices, curve.vertices[0]] if curve.closed else [*curve.vertices]
        seen += [tuple(sorted(map(int, pair))) for pair in pairwise(chain)]
    assert sorted(seen) == sorted(known)


def test_closed_curves():
    loop = cap(3).topology.boundary_loops
    assert [(c.closed, len(c.vertices), c.sheets) for c in loop] == [(True, 18, (0,))]
    ring = two_bubbles().topology
    assert [(c.closed, len(c.vertices), c.sheets) for c in ring.junctions] == [(True, 3, (0, 1, 2))]
    assert ring.boundary_loops == ()
    around = loop[0].vertices
    angle = np.unwrap(np.arctan2(*cap(3).vertices[around, 1::-1].T))
    steps = np.diff(angle)
    assert np.allclose(np.abs(steps), np.pi / 9)
    assert len(set(np.sign(steps))) == 1


def test_a_closed_surface_has_no_curves():
    t = octahedron().topology
    assert not t.curve_edge.any()
    assert t.junctions == ()
    assert t.boundary_loops == ()
    assert t.interior.all()


def test_a_seam_has_no_wall():
    X = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    patches = [Patch("a", 1.0), Patch("b", 2.0)]
    t = Surface(X, [[0, 1, 2], [0, 2, 3]], [0, 1], patches, fixed=[0]).topology
    assert t.edges[t.seam_edge].tolist() == [[0, 2]]
    assert not t.junction_edge.any()
    assert [(c.sheets, c.closed) for c in t.junctions] == [((0, 1), False)]
    assert t.vertex_kind.tolist() == [POINT, CURVE, POINT, CURVE]
    assert not t.interior.any()


def test_two_parts_are_two_components():
    flat, faces = hexagon(1)
    X = np.column_stack([flat, np.zeros(7)])
    both = np.concatenate([X, X + np.array([10, 0, 0])])
    patches = [Patch("a", 1.0), Patch("b", 1.0)]
    surface = Surface(both, np.concatenate([faces, faces + 7]), [0] * 6 + [1] * 6, patches, fixed=[0])
    label = surface.topology.components
    assert len(set(label[:7])) == len(set(label[7:])) == 1
    assert label[0] != label[7]


def test_neighbours_along_a_curve_are_those_before_and_after():
    t = three_patches(3).topology
    edges = t.edges[t.curve_edge]
    links = np.concatenate([edges, edges[:, ::-1]])
    inner, beside = curve_neighbours(links, t.vertex_count)
    assert inner.tolist() == np.flatnonzero(t.vertex_kind == CURVE).tolist()
    found = {int(v): set(pair) for v, pair in zip(inner, beside.tolist(), strict=True)}
    for curve in t.junctions:
        for before, v, after in zip(curve.vertices, curve.vertices[1:], curve.vertices[2:], strict=False):
            assert found[int(v)] == {before, after}


def test_relabelled_vertices_have_the_same_topology():
    surface = three_patches(3)
    order = np.random.default_rng(4).permutation(surface.n)  # old index of each new vertex
    new = np.argsort(order)
    other = Surface(
        surface.vertices[order],
        new[surface.faces],
        surface.patch_of_face,
        surface.patches,
        fixed=surface.fixed[order],
        on_plane=surface.on_plane[order],
    ).topology
    t = surface.topology
    assert other.vertex_kind.tolist() == t.vertex_kind[order].tolist()
    for name in ("junctions", "boundary_loops"):
        mine = {(c.sheets, frozenset(map(int, new[c.vertices]))) for c in getattr(t, name)}
        theirs = {(c.sheets, frozenset(map(int, c.vertices))) for c in getattr(other, name)}
        assert mine == theirs


def test_numbers_of_many_vertices_do_not_overflow():
    n = 3_000_000  # n² has more than 32 bits
    F = np.array([[0, n - 2, n - 1], [n - 3, n - 1, n - 2]])
    t = topology(F, np.zeros(2, dtype=int), n)
    assert t.edges.tolist() == [[0, n - 2], [0, n - 1], [n - 3, n - 2], [n - 3, n - 1], [n - 2, n - 1]]
    assert t.edge_of_face.tolist() == [[4, 1, 0], [4, 2, 3]]
    assert t.valence.tolist() == [1, 1, 1, 1, 2]
    assert t.edges.dtype == t.edge_of_face.dtype == np.int32


def test_parts_are_numbered_by_their_first_vertices():
    random = np.random.default_rng(5)
    for n, count in ((1, 0), (40, 15), (40, 60)):
        edges = random.integers(0, n, (count, 2))
        graph = coo_array((np.ones(count), edges.T), shape=(n, n)).tocsr()
        assert components(edges, n).tolist() == connected_components(graph, directed=False)[1].tolist()


@pytest.mark.parametrize("pages", [3, 40])  # the second are sorted to be checked, the first are not
def test_a_book_of_patches_is_sound_until_a_page_comes_twice(pages):
    angle = np.linspace(0.0, np.pi, pages)
    outer = np.column_stack([np.cos(angle), np.sin(angle), 0.5 + 0 * angle])
    X = np.vstack([[0, 0, 0], [0, 0, 1], outer])
    F = np.array([[0, 1, 2 + k] for k in range(pages)])
    patches = [Patch(f"page {k}", 1.0) for k in range(pages)]
    book = Surface(X, F, np.arange(pages), patches, fixed=[0])
    assert book.topology.valence.max() == pages
    with refused(SurfaceError, what="faces", where=pages, found=[2, 0, 1]):
        Surface(X, [*F, [2, 0, 1]], [*range(pages), pages - 1], patches, fixed=[0])
    one_less = np.minimum(np.arange(pages), pages - 2)  # the last two are one patch, and run the same way
    with refused(SurfaceError, what="faces", where=pages - 1):
        Surface(X, F, one_less, patches[:-1], fixed=[0])
