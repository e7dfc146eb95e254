"""1→4 refinement: edges are cut at their midpoints; patches and supports stay."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_array

from ..base import validate
from ..base.arrays import Bools, Floats, Ints
from ..base.errors import OptionError
from ..base.tolerances import ON
from ..forces.pinching import standing_part, under_low
from ..surface import Surface, expect_surface
from ..surface.geometry import CORNER
from ..surface.held_curve import HeldCurve
from ..surface.images import expect_no_images
from ..surface.lagrange import middles_of_sides

Projection = Callable[[Floats], Floats]


def refine(surface: Surface, levels: int = 1, project: Projection | None = None) -> Surface:
    """The same surface with every triangle cut into four, ``levels`` times.

    Vertex i keeps its number; the midpoint of edge e of ``surface.topology.edges`` (of a periodic surface:
    of ``surface.cell.topology.edges``) becomes vertex n + e. Face f becomes faces 4 f … 4 f + 3 (three at its
    corners, then the middle one), so a per-face field is carried over by ``numpy.repeat(field, 4)`` and a
    per-vertex field by ``prolongation(surface) @ field``.

    The midpoint of an edge on one of ``surface.curves`` is fixed, half way along the curve. On other edges a
    midpoint is held where both ends are held *and* the edge is part of that support, as far as can be told:

    - boundary edge, both ends fixed: fixed;
    - boundary edge, one end sliding and the other sliding, or fixed and on Π: sliding; the same for a
      junction or seam edge that does not lead from boundary to boundary, and for each edge of a patch that
      lies on Π and has sliding vertices off the boundary;
    - junction or seam edge, both ends fixed, not leading from boundary to boundary: fixed;
    - edge inside a sheet, both ends fixed, off the boundary and on none of the curves (a held line in a
      patch): fixed; the same for the edge by which a line of two or more of them goes on to a fixed vertex
      of the boundary;
    - boundary edge in a plane of ``on_planes``: sliding there; the same for a curve in a mirror plane, and
      for each edge of a triangle that lies in the plane;
    - every other edge, such as one across a sheet between two fixed boundary vertices: free.

    A new vertex is the middle of its edge, except beside a junction that rests on Π: there the rows of
    the wall coincide, and their new vertices are placed apart. Those of curved elements lie on them, so that
    four elements have the shape of one, but for new places on the curves.

    Parameters
    ----------
    project : (k,3) → (k,3), applied to the new fixed vertices on no curve at each level: puts them on a
        curved boundary that the edges only approximate.

    Raises
    ------
    OptionError : ``levels`` is not a whole number ≥ 0, or ``project`` returns another shape.
    SurfaceError : ``project`` degenerates a triangle.

    >>> from pcmc import Patch
    >>> square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]],
    ...                  [0, 0], [Patch("floor", 1.0)], fixed=range(4))
    >>> fine = refine(square)
    >>> fine.n, fine.m, int(fine.fixed.sum())  # the diagonal's midpoint is free
    (9, 8, 8)
    """
    expect_surface(surface)
    for _ in range(refinable(levels, surface.m)):
        cell = surface.cell
        a, b, c = cell.faces.T
        bc, ca, ab = cell.n + cell.topology.edge_of_face.T  # an edge's number is opposite its corner
        F = np.stack([a, ab, ca, b, bc, ab, c, ca, bc, bc, ca, ab], axis=1).reshape(-1, 3)
        every = np.ones(len(cell.topology.edges), dtype=bool)
        fine = with_vertices_on(cell, every, F, np.repeat(cell.patch_of_face, 4), project)
        surface = _refined_cell(surface, fine) if surface.periodic else fine
    return surface


def _refined_cell(surface: Surface, fine: Surface) -> Surface:
    """One refinement of a periodic surface: where edges are images of each other, so are their midpoints."""
    edges = surface.cell.topology.edges
    number, k = surface.topology.edge_numbers(surface.original[edges]), np.arange(len(edges))
    columns = np.concatenate([surface.support_columns, edge_columns(surface)[number]])
    vertex = np.unique(number, return_index=True)[1][number]
    images = np.concatenate([surface.images, surface.n + np.stack([k, vertex], axis=1)[vertex != k]])
    return fine.with_mesh(columns, images=images, rooms=surface.rooms)


def refinable(levels: object, triangles: int) -> int:
    """The number of refinements, if so many triangles can be counted in 32 bits afterwards."""
    most = int(np.log2(validate.MOST / triangles) / 2.0)
    hint = f"each makes four times as many triangles of {triangles}"
    return validate.integer("levels", levels, most=most, hint=hint)


def prolongation(surface: Surface) -> csr_array:
    """(n + e, n) sparse P: ``P @ field`` carries a vertex field to ``refine(surface)``.

    Old vertices keep their value, midpoints take the average of their edge's ends.

    >>> from pcmc import Patch
    >>> one = Surface([[0, 0, 0], [2, 0, 0], [0, 2, 0]], [[0, 1, 2]], [0], [Patch("a", 1.0)],
    ...               fixed=range(3))
    >>> (prolongation(one) @ [0.0, 1.0, 2.0]).tolist()
    [0.0, 1.0, 2.0, 0.5, 1.0, 1.5]
    """
    expect_no_images(surface, "prolongation")
    n, edges = surface.n, surface.topology.edges
    e = len(edges)
    columns = np.concatenate([np.arange(n), edges.ravel()])
    starts = np.concatenate([np.arange(n), n + 2 * np.arange(e + 1)])
    weights = np.concatenate([np.ones(n), np.full(2 * e, 0.5)])
    return csr_array((weights, columns, starts), shape=(n + e, n))


def held_midpoints(surface: Surface) -> tuple[Bools, Bools]:
    """(e,) the edges whose midpoint is fixed, a guess off the curves; and those where it slides on Π."""
    topo, (fixed, sliding) = surface.topology, surface.given_supports.fixed_and_sliding()
    start, end = topo.edges.T
    boundary = topo.boundary_edge
    inner = (topo.junction_edge | topo.seam_edge) & ~topo.on_boundary[topo.edges].all(axis=1)
    drawn, known = surface.edges_on_curves.drawn, np.zeros(surface.n, dtype=bool)
    known[topo.edges[drawn]] = True
    inside = ~(topo.on_boundary | known)[topo.edges].any(axis=1) & ~boundary & ~inner
    if surface.held_curves:  # then the edges that are held and carry no cable are known
        boundary = boundary.copy()
        boundary[topo.edge_numbers(surface.cable_edges.ends)] = False
    both_fixed = drawn | (fixed[start] & fixed[end] & (boundary | inner | inside))
    # lines of held edges inside a patch go on to the boundary by the edge along which they turn least
    inside &= both_fixed
    X, line, before = surface.vertices, topo.edges[inside], np.zeros(surface.n, dtype=np.int64)
    ends = np.bincount(line.ravel(), minlength=surface.n) == 1
    before[line], rim = line[:, ::-1], topo.on_boundary & fixed
    number = np.flatnonzero((ends[topo.edges] & rim[topo.edges][:, ::-1]).any(axis=1))
    here, there = np.where(ends[topo.edges[number, :1]], topo.edges[number], topo.edges[number][:, ::-1]).T
    along, on = X[here] - X[before[here]], X[there] - X[here]
    lengths = np.linalg.norm(along, axis=1) * np.linalg.norm(on, axis=1)
    cosine = np.einsum("ij,ij->i", along, on) / np.maximum(lengths, 1e-300)
    order = np.lexsort((-cosine, here))
    best = order[np.unique(here[order], return_index=True)[1]]
    both_fixed[number[best[cosine[best] >= np.cos(np.radians(CORNER))]]] = True
    height = surface.plane.height(X)
    resting = sliding | (fixed & (np.abs(height) <= ON * surface.size))
    # patches that lie on Π, such as the ground below a drop: not every one whose boundary alone does
    flat, slips = np.ones(len(surface.patches), dtype=bool), np.zeros(len(surface.patches), dtype=bool)
    flat[surface.patch_of_face[~resting[surface.faces].all(axis=1)]] = False
    slips[surface.patch_of_face[(sliding & ~topo.on_boundary)[surface.faces].any(axis=1)]] = True
    on_ground = topo.boundary_edge | inner
    on_ground[topo.edge_of_face[(flat & slips)[surface.patch_of_face]]] = True
    slides = on_ground & resting[start] & resting[end] & (sliding[start] | sliding[end])
    return both_fixed, slides


def edge_columns(surface: Surface) -> Bools:
    """(e,c) the supports of the new vertices on edges, as in ``Surface.support_columns``.

    A new vertex slides along a line or circle if both ends of its edge lie on it, and one of them slides.
    """
    columns, edges = [*held_midpoints(surface), *edges_on_planes(surface)], surface.topology.edges
    for guide, along in surface.given_supports.on_line:
        on = surface.fixed & (guide.distance(surface.vertices) <= ON * surface.size)
        columns.append(columns[0] & on[edges].all(axis=1) & along[edges].any(axis=1))
    return np.stack(columns, axis=1)


def onto_circles_of(surface: Surface, columns: Bools, points: Floats) -> None:
    """Put new points (k,3) on edges along a circle there, in place; ``columns`` (k,c) are their supports."""
    first = columns.shape[1] - len(surface.given_supports.on_line)
    for (guide, _), along in zip(surface.given_supports.on_line, columns.T[first:], strict=True):
        points[along] = guide.nearest(points[along])


def edges_on_planes(surface: Surface) -> list[Bools]:
    """For each of ``on_planes`` the (e,) edges whose new vertices slide on it."""
    topo, masks = surface.topology, list[Bools]()
    for plane, mask in surface.on_planes:
        along = mask[topo.edges].all(axis=1) & (topo.curve_edge if plane.mirror else topo.boundary_edge)
        along[topo.edge_of_face[mask[surface.faces].all(axis=1)]] = True
        masks.append(along)
    return masks


def projected(project: Projection, points: Floats) -> Floats:
    """``project`` of points (k,3); OptionError if it returns another shape."""
    moved = np.asarray(project(points.copy()), dtype=float)
    if moved.shape != points.shape:
        expected, found = points.shape, moved.shape
        message = f"project: expected a function that returns shape {expected}, it returned {found}"
        raise OptionError(message, what="project", found=found, expected=expected)
    return moved


def with_vertices_on(
    surface: Surface, cut: Bools, F: Ints, patch: Ints, project: Projection | None = None
) -> Surface:
    """The surface of triangles ``F`` whose last k vertices are new ones on the edges ``cut`` (e,)."""
    ends, on, support = surface.topology.edges[cut], surface.edges_on_curves, edge_columns(surface)[cut]
    new, drawn = midpoints(surface, ends), on[cut].drawn
    guessed = support[:, 0] & ~drawn
    if project is not None:
        new[guessed] = projected(project, new[guessed])
    onto_circles_of(surface, support, new)
    at, points = on[cut].between()
    new[drawn] = points[drawn]
    if surface.order == 1:
        _rest_on_bottoms(surface, cut, new)
    number, curves = surface.n + np.arange(len(new)), tuple[HeldCurve, ...]()
    if surface.held_curves:
        halves = (np.stack([ends[:, 0], number], axis=1), np.stack([number, ends[:, 1]], axis=1))
        curves = on.cut(cut, at).joined(np.concatenate([surface.topology.edges[~cut], *halves]))
    return surface.with_mesh(
        np.concatenate([surface.support_columns, support]),
        vertices=np.concatenate([surface.vertices, new]),
        faces=F,
        patch_of_face=patch,
        cables=tuple(cable.cut(ends, number) for cable in surface.cables),
        curves=curves,
    )


def midpoints(surface: Surface, edges: Ints) -> Floats:
    """(k,3) the middles of edges (k,2), for a finer mesh.

    A wall's edge may lead from a resting junction to a standing vertex. Its middle is placed in its row
    below the middle of the top edge (``WallRows``): rows that coincide where the junction rests part again
    beside it.
    """
    (start, end), X, topo = edges.T, surface.vertices, surface.topology
    if surface.order > 1:
        on_edges = np.empty((len(topo.edges), 3))
        on_edges[topo.edge_of_face] = middles_of_sides(X, surface.nodes, surface.order)
        return np.asarray(on_edges[topo.edge_numbers(edges)])
    middle, part = 0.5 * (X[start] + X[end]), standing_part(surface)
    walls, rows, resting = part.walls, part.walls.rows, part.resting
    if not resting.any():
        return middle
    own, of_wall, down = rows.vertices, resting | walls.top_free, resting.copy()
    of_wall[own], down[own] = True, under_low(rows, resting | walls.corner)
    top, drop = X.copy(), X - surface.plane.nearest(X)
    drop[walls.held] = X[walls.held] - X[walls.foot[walls.held]]
    top[own], drop[own] = rows.top_places(X), rows.drops(surface, X)
    share, offset = np.zeros((surface.n, 1)), np.zeros_like(X)  # 0 on top edges
    share[own, 0], offset[own] = 1.0 - rows.relative_height, rows.offset
    rising = of_wall[start] & of_wall[end] & (down[start] != down[end])
    rising &= ~(surface.fixed[start] & surface.fixed[end])
    top, share, offset, drop = (v[edges[rising]].mean(axis=1) for v in (top, share, offset, drop))
    middle[rising] = top - share * drop + np.linalg.norm(drop, axis=1)[:, None] * offset
    return middle


def _rest_on_bottoms(surface: Surface, cut: Bools, new: Floats) -> None:
    """Move new points (k,3) of a wall as those of its held bottom were moved, where it rests, in place. A
    curved bottom has new points beside the middles of its edges; what does not lie on it does not rest."""
    part, topo = standing_part(surface), surface.topology
    rows, foot = part.walls.rows, part.walls.foot.copy()
    down = (part.resting | part.walls.corner) & (foot >= 0)
    if not (part.resting & down).any():
        return
    bottoms = foot[foot >= 0]
    down[rows.vertices] = under_low(rows, down) & (rows.feet[:, 0] >= 0)
    foot[rows.vertices] = np.where(rows.fraction == 0.0, *rows.feet.T)
    foot[bottoms], down[bottoms] = bottoms, True
    ends, number = topo.edges[cut], np.full(len(cut) + 1, -1)
    number[np.flatnonzero(cut)] = np.arange(len(new))
    moved = new - surface.vertices[ends].mean(axis=1)
    follows = (foot[ends] >= 0).all(axis=1) & down[ends].any(axis=1) & ~surface.fixed[ends].all(axis=1)
    below = np.where(follows, number[topo.edge_numbers(foot[ends])], -1)
    new[below >= 0] += moved[below[below >= 0]]
