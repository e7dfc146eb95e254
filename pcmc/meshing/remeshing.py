"""Remeshing, by MMG, that keeps patches, junction curves, boundaries and supports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..base import validate
from ..base.arrays import Bools, Floats, Ints
from ..base.errors import MissingExtra, SurfaceError
from ..contact.pinching import lift, standing_part
from ..surface import Surface
from ..surface.geometry import angles, area_vectors, face_areas, segment_lengths
from .angles import improve_angles
from .quality import edge_lengths
from .refinement import (
    Projection,
    carry_lines,
    edges_on_planes,
    held_midpoints,
    onto_round_edges,
    projected,
    prolongation,
    refine,
)
from .sizes import (
    SizeField,
    check_sizes,
    edges_between,
    equilateral_area,
    limit_growth,
    place_between,
    triangles_for,
)

CHORD = 0.1  # of the edge length
MOST = 20_000_000  # triangles; more mean a mistake in the edge length
PASSES = 3  # of MMG at most, each on the result of the one before; a patch takes its best
GOOD_ANGLE = 25.0  # degrees; no further pass is made when all angles reach it
LEAST_ANGLE = 20.0  # degrees; a patch that stays below it ...
WORSE = 0.8  # ... and below this share of its old smallest angle keeps its old triangles, cut
RAISED = 0.25  # of its spacing: height to which a resting junction is lifted, so that its wall has area
LARGE = 2.0  # times the area wanted: a larger triangle is split, also between curves
BLUNT, OBTUSE = 25.0, 100.0  # degrees; for the upper two angles of one that fills a corner well


def remesh(
    surface: Surface,
    edge_length: float | npt.ArrayLike,
    *,
    near_curves: float | None = None,
    growth: float = 1.2,
    chord: float | None = None,
    project: Projection | None = None,
) -> Surface:
    """The same surface with triangles near a wanted edge length, the same everywhere or not.

    Patches, tensions, the plane and all names stay. Boundaries, junctions and seams do not move, to
    rounding: their vertices stay, and new ones are put on the straight edges between them, with the
    same support as the edge. So along curves the mesh gets finer, never coarser. Vertices held inside a
    patch stay. A junction that rests on the plane is lifted off it by a quarter of its edges, so that
    its wall has triangles; solving brings it down again. Everywhere else MMG puts new vertices on a
    smooth approximation of the surface: solve again afterwards.

    Parameters
    ----------
    edge_length : of the triangles, length; or one per vertex (n,), which is lowered where it would grow
        faster than ``growth``.
    near_curves : edge length at junctions and boundaries, if it is to be shorter there; it grows
        with the distance.
    growth : ratio of the lengths of neighbouring edges where they grow, > 1.
    chord : largest distance between the triangles and the smooth surface, length; where the surface
        is strongly curved, edges get shorter to keep it. By default a tenth of ``edge_length``, of the
        largest one if there are several.
    project : (k,3) → (k,3), applied to the new fixed vertices: puts them on a curved boundary that the
        edges only approximate.

    Raises
    ------
    MissingExtra
        Without the library mmgpy.
    OptionError
        For lengths that are not positive, or that would make more than 20 million triangles; if
        ``project`` returns another shape.
    SurfaceError
        When MMG gives up, or does not keep a curve.

    Examples
    --------
    >>> from pcmc.plan import Plan
    >>> dome = Plan([[0, 0], [4, 0], [4, 3], [0, 3]], tension=2.0, edge_length=1.0).surface()
    >>> fine = remesh(dome, 0.5)
    >>> fine.m > 2 * dome.m, fine.patches == dome.patches
    (True, True)
    """
    one: Any = edge_length if np.ndim(edge_length) == 0 else 1.0
    check_lengths(one, near_curves, growth, chord)
    size = _wanted_sizes(surface, edge_length, growth)
    part = standing_part(surface)
    surface = lift(surface, part.walls, part.resting, RAISED)
    along_curves = size if near_curves is None else np.minimum(size, near_curves)
    old, wanted = _cut_curves(surface, size, along_curves, project)
    chord = CHORD * float(wanted.size.max()) if chord is None else chord
    candidates, mesh = [], old
    for _ in range(PASSES):
        size = _sizes(mesh, wanted, growth)
        mesh = _remesh_with_mmg(mesh, size, growth, chord)
        mesh = replace(mesh, X=improve_angles(mesh.X, mesh.F, mesh.source < 0, GOOD_ANGLE))
        candidates.append(mesh)
        if angles(mesh.X[mesh.F]).min() >= GOOD_ANGLE:
            break
    return _assembled(surface, old, candidates)


@dataclass(frozen=True, eq=False)
class _Mesh:
    """Vertices, faces with a patch each, the edges (c,2) of curves, and supports.

    ``support`` (n,2+p): whether a vertex is fixed, slides on Π, slides on each of ``Surface.on_planes``.
    ``source`` (n,): the number of each vertex in the mesh before MMG, or -1. ``cable`` (c,): the number of
    the cable on each of ``curves``, or -1.
    """

    X: Floats
    F: Ints
    patch: Ints
    curves: Ints
    support: Bools
    source: Ints
    cable: Ints


def check_lengths(
    edge_length: float, near_curves: float | None = None, growth: float = 1.2, chord: float | None = None
) -> None:
    """Check the arguments of ``remesh``.

    >>> check_lengths(0.5, growth=1)
    Traceback (most recent call last):
    pcmc.base.errors.OptionError: growth: expected a finite number > 1, found 1
    """
    validate.positive("edge_length", edge_length)
    for name, value in {"near_curves": near_curves, "chord": chord}.items():
        if value is not None:
            validate.positive(name, value)
    validate.number("growth", growth, above=1.0)


def _wanted_sizes(surface: Surface, edge_length: npt.ArrayLike, growth: float) -> Floats:
    """(n,) the edge length wanted at each vertex."""
    if np.ndim(edge_length) == 0:
        size = np.full(surface.n, edge_length, dtype=float)
    else:
        size = check_sizes(edge_length, surface.n)
        size = limit_growth(surface.vertices, surface.topology.edges, size, growth)
    count = triangles_for(face_areas(surface.vertices[surface.faces]), size[surface.faces].mean(axis=1))
    if count > MOST:
        hint = f"it makes about {count:.2g}; choose a larger one"
        found = float(size.min())
        validate.refuse("edge_length", found, f"at most {MOST} triangles", hint=hint)
    return size


def _curve_edges(surface: Surface) -> Bools:
    """(e,) the edges that must stay: curves, cables, and edges held inside a patch."""
    fixed, sliding = held_midpoints(surface)
    return surface.topology.curve_edge | fixed | sliding | (_cable_of_edge(surface) >= 0)


def _cable_of_edge(surface: Surface) -> Ints:
    """(e,) the number of the cable on each edge; -1 for none."""
    out = np.full(len(surface.topology.edges), -1)
    for index, cable in enumerate(surface.cables):
        out[surface.topology.edge_numbers(cable.edges)] = index
    return out


def _cut_curves(
    surface: Surface, size: Floats, along_curves: Floats, project: Projection | None = None
) -> tuple[_Mesh, SizeField]:
    """The mesh with new vertices on its curves, about ``along_curves`` (n,) apart, and its sizes."""
    first = surface.n
    background = SizeField(surface.vertices, size)
    counts = _pieces(surface, along_curves)
    # 1→4 keeps the triangles' shape, cutting single edges does not
    while len(counts) and np.median(counts) >= 2.0:
        along_curves = prolongation(surface) @ along_curves
        surface = _refined_round(surface)
        counts = _pieces(surface, along_curves)
    topo, stay = surface.topology, _curve_edges(surface)
    fixed_edge, sliding_edge = held_midpoints(surface)
    X, F, patch, number = surface.vertices, surface.faces, surface.patch_of_face, np.arange(surface.n)
    at_vertices = np.stack(
        [*surface.given_supports.fixed_and_sliding(), *(mask for _, mask in surface.on_planes)], axis=1
    )
    mesh = _Mesh(X, F, patch, topo.edges[stay], at_vertices, number, _cable_of_edge(surface)[stay])
    support = np.stack([fixed_edge, sliding_edge, *edges_on_planes(surface)], axis=1)[stay]
    while (counts > 1).any():
        mesh, along_curves, counts, support = _cut_once(mesh, along_curves, counts, support)
    new = mesh.support[:, 0] & (np.arange(len(mesh.X)) >= first)
    if (project is not None or surface.on_circle) and new.any():
        X = mesh.X.copy()
        if project is not None:
            X[new] = projected(project, X[new])
        X[new] = onto_round_edges(surface, X[new])
        mesh = replace(mesh, X=X)
    return mesh, background


def _refined_round(surface: Surface) -> Surface:
    """1→4 with the new vertices off the curves on cubics that end square to the vertex normals.

    With t the components of the edge b - a across the normals at its ends, the middle of the cubic is
    (a + b)/2 + (t_a - t_b)/8.
    """
    chosen = np.flatnonzero(~_curve_edges(surface))
    ends, normals = surface.topology.edges[chosen], _edge_normals(surface, chosen)
    edge = (surface.vertices[ends[:, 1]] - surface.vertices[ends[:, 0]])[:, None]
    across = edge - (edge * normals).sum(axis=2, keepdims=True) * normals
    rise = (across[:, 0] - across[:, 1]) / 8.0
    most = 0.2 * np.linalg.norm(edge[:, 0], axis=1)
    rise *= np.minimum(1.0, most / np.maximum(np.linalg.norm(rise, axis=1), 1e-300))[:, None]
    fine = refine(surface)
    X = fine.vertices.copy()
    X[surface.n + chosen] += rise
    return fine.moved(X)


def _edge_normals(surface: Surface, chosen: Ints) -> Floats:
    """(c,2,3) unit normals at the ends of edges inside sheets, of the edge's own sheet."""
    X, F, topo = surface.vertices, surface.faces, surface.topology
    vector = area_vectors(X[F])
    corner = surface.patch_of_face[:, None].astype(np.int64) * surface.n + F
    key, place = np.unique(corner.ravel(), return_inverse=True)
    total = np.zeros((len(key), 3))
    np.add.at(total, place, np.repeat(vector, 3, axis=0))
    total /= np.maximum(np.linalg.norm(total, axis=1), 1e-300)[:, None]
    patch_of_edge = np.zeros(len(topo.edges), dtype=np.int64)
    patch_of_edge[topo.edge_of_face] = surface.patch_of_face[:, None]
    return total[np.searchsorted(key, patch_of_edge[chosen, None] * surface.n + topo.edges[chosen])]


def _pieces(surface: Surface, size: Floats) -> Ints:
    """(c,) into how many pieces each curve edge is to be cut."""
    chosen = _curve_edges(surface)
    start, end = size[surface.topology.edges[chosen]].T
    return np.maximum(1, np.rint(edges_between(edge_lengths(surface)[chosen], start, end))).astype(np.int64)


def _cut_once(mesh: _Mesh, size: Floats, counts: Ints, support: Bools) -> tuple[_Mesh, Floats, Ints, Bools]:
    """Every curve edge that is to be cut, cut in two, with its triangles."""
    cut = counts > 1
    ends, pieces = mesh.curves[cut], counts[cut]
    first = pieces // 2
    size_start, size_end = size[ends].T
    share = place_between(first / pieces, size_start, size_end)
    start, end = mesh.X[ends[:, 0]], mesh.X[ends[:, 1]]
    number = len(mesh.X) + np.arange(len(ends))
    F, patch = cut_triangles(mesh.F, mesh.patch, ends, number, len(mesh.X))
    halves = np.stack([ends[:, 0], number], 1), np.stack([number, ends[:, 1]], 1)
    X = np.concatenate([mesh.X, start + share[:, None] * (end - start)])
    size = np.concatenate([size, size_start + share * (size_end - size_start)])
    curves = np.concatenate([mesh.curves[~cut], *halves])
    at_vertices = np.concatenate([mesh.support, support[cut]])
    cable = np.concatenate([mesh.cable[~cut], mesh.cable[cut], mesh.cable[cut]])
    new = _Mesh(X, F, patch, curves, at_vertices, np.arange(len(X)), cable)
    counts = np.concatenate([counts[~cut], first, pieces - first])
    return new, size, counts, np.concatenate([support[~cut], support[cut], support[cut]])


def cut_triangles(
    F: Ints, patch: Ints, ends: Ints, number: Ints, n: int, first: Ints | None = None
) -> tuple[Ints, Ints]:
    """Triangles with a new vertex on one, two or three sides, replaced by two, three or four.

    The edges ``ends`` (k,2) get the vertices ``number`` (k,); old vertices are below n. With two cut sides
    a line leads to the middle of one of them from the corner opposite: of the side opposite corner
    ``first`` (m,), where that is given.
    """
    key = ends.min(axis=1).astype(np.int64) * n + ends.max(axis=1)
    order = np.argsort(key)
    side = F[:, [[1, 2], [2, 0], [0, 1]]].astype(np.int64)
    wanted = side.min(axis=2) * n + side.max(axis=2)
    place = np.minimum(np.searchsorted(key[order], wanted), len(key) - 1)
    middle = np.where(key[order][place] == wanted, number[order][place], -1)
    count = (middle >= 0).sum(axis=1)
    # turn each triangle so that its cut sides come first: opposite corners 0, then 0 and 1
    turn = np.argmax(middle >= 0, axis=1)
    turn = np.where((count == 2) & (middle[:, 0] >= 0) & (middle[:, 2] >= 0), 2, turn)
    roll = (np.arange(3) + turn[:, None]) % 3
    a, b, c = np.take_along_axis(F.astype(np.int64), roll, axis=1).T
    p, q, r = np.take_along_axis(middle, roll, axis=1).T  # on the sides opposite a, b, c
    if first is not None:
        count[(count == 2) & (first == (turn + 1) % 3)] = -2
    templates = {
        0: [(a, b, c)],
        1: [(a, b, p), (a, p, c)],
        2: [(c, q, p), (q, a, p), (a, b, p)],
        -2: [(c, q, p), (q, b, p), (a, b, q)],
        3: [(a, r, q), (b, p, r), (c, q, p), (p, q, r)],
    }
    faces, owner = [], []
    for cuts, corners in templates.items():
        chosen = np.flatnonzero(count == cuts)
        faces.append(np.stack([np.stack(t, axis=1)[chosen] for t in corners], 1).reshape(-1, 3))
        owner.append(np.repeat(patch[chosen], len(corners)))
    return np.concatenate(faces), np.concatenate(owner)


def _sizes(mesh: _Mesh, wanted: SizeField, growth: float) -> Floats:
    """(n,) the edge length wanted at each vertex: a curve's own next to it, growing away from it."""
    size = wanted.at(mesh.X)
    if len(mesh.curves):
        length = segment_lengths(mesh.X, mesh.curves)
        spacing = np.zeros(len(mesh.X))
        np.maximum.at(spacing, mesh.curves, length[:, None])
        on_curve = np.flatnonzero(spacing)
        distance, nearest = cKDTree(mesh.X[on_curve]).query(mesh.X)
        size = np.minimum(size, spacing[on_curve][nearest] + (growth - 1.0) * distance)
    return size


def _remesh_with_mmg(mesh: _Mesh, size: Floats, growth: float, chord: float) -> _Mesh:
    """The mesh after MMG, with the same curves."""
    try:
        from mmgpy import MmgMeshS
    except ImportError:
        raise MissingExtra("mmgpy", "remesh") from None
    held = np.flatnonzero(mesh.support.any(axis=1))
    fixed = np.unique(np.concatenate([mesh.curves.ravel(), held]))
    reference = np.zeros(len(mesh.X), dtype=np.int64)
    reference[fixed] = 1 + np.arange(len(fixed))
    tool: Any = MmgMeshS()
    tool.set_mesh_size(vertices=len(mesh.X), triangles=len(mesh.F), edges=len(mesh.curves))
    tool.set_vertices(np.ascontiguousarray(mesh.X), reference)
    tool.set_triangles(mesh.F.astype(np.int32), mesh.patch.astype(np.int64) + 1)
    tool.set_edges(mesh.curves.astype(np.int32), np.ones(len(mesh.curves), dtype=np.int64))
    tool.set_required_edges(np.arange(len(mesh.curves), dtype=np.int32))
    tool.set_required_vertices(fixed.astype(np.int32))
    tool.set_required_triangles(_corners_to_keep(mesh, size).astype(np.int32))
    tool["metric"] = size[:, None]
    least, most = 0.3 * float(size.min()), 1.3 * float(size.max())
    try:
        tool.remesh(hmin=least, hmax=most, hausd=chord, hgrad=growth, angle=0, verbose=-1)
    except RuntimeError as error:
        hint = "repair degenerate triangles first, or choose another edge length"
        raise SurfaceError(f"MMG cannot remesh this surface ({error}); {hint}", what="surface") from None
    X, reference = tool.get_vertices_with_refs()
    F, patch = tool.get_triangles_with_refs()
    place = np.append(-1, fixed)[reference]
    known = place >= 0
    number = np.full(len(mesh.X), -1)
    number[place[known]] = np.flatnonzero(known)
    curves = number[mesh.curves]
    _check_curves(mesh, curves, F, len(X))
    source = np.where(known, mesh.source[place], -1)
    support = known[:, None] & mesh.support[place]
    return _Mesh(X, F.astype(np.int64), patch - 1, curves, support, source, mesh.cable)


def _corners_to_keep(mesh: _Mesh, size: Floats) -> Ints:
    """Triangles between curves that are as good as their corner allows, and small: MMG would split them."""
    on_curve = np.zeros(len(mesh.X), dtype=bool)
    on_curve[mesh.curves] = True
    between = np.flatnonzero(on_curve[mesh.F].all(axis=1))
    corners = mesh.X[mesh.F[between]]
    _, second, largest = np.sort(angles(corners), axis=1).T
    small = face_areas(corners) <= LARGE * equilateral_area(size[mesh.F[between]].mean(axis=1))
    return between[(second >= BLUNT) & (largest <= OBTUSE) & small]


def _check_curves(before: _Mesh, curves: Ints, F: Ints, n: int) -> None:
    """Every curve edge must still be an edge of triangles."""
    side = F[:, [[1, 2], [2, 0], [0, 1]]].astype(np.int64)
    edges = side.min(axis=2) * n + side.max(axis=2)
    lost = (curves < 0).any(axis=1)
    lost |= ~np.isin(curves.min(axis=1) * n + curves.max(axis=1), edges)
    if lost.any():
        place = before.X[before.curves[np.argmax(lost), 0]].tolist()
        message = f"MMG lost {lost.sum()} edges of curves, the first at {place}; choose a smaller edge length"
        raise SurfaceError(message, what="surface", where=place)


def _assembled(surface: Surface, old: _Mesh, candidates: Sequence[_Mesh]) -> Surface:
    """A Surface of the best triangles for each patch: they fit, because the curves are the same.

    Vertices of ``old`` keep its positions: MMG scales the mesh, which changes the last digits.
    """
    meshes = [old, *candidates]
    angle = np.array([_patch_angles(mesh, len(surface.patches)) for mesh in meshes])
    best = 1 + np.argmax(np.minimum(angle[1:], GOOD_ANGLE), axis=0)
    reached = angle[best, np.arange(len(best))]
    best[(reached < LEAST_ANGLE) & (reached < WORSE * angle[0])] = 0
    first = np.cumsum([0, *(len(mesh.X) for mesh in meshes)])
    faces, patch = [], []
    for number, mesh in enumerate(meshes):
        chosen = best[mesh.patch] == number
        vertex = np.where(mesh.source >= 0, mesh.source, first[number] + np.arange(len(mesh.X)))
        faces.append(vertex[mesh.F[chosen]])
        patch.append(mesh.patch[chosen])
    used, inverse = np.unique(np.concatenate(faces), return_inverse=True)
    F, patch_of_face = inverse.reshape(-1, 3), np.concatenate(patch)
    X = np.concatenate([mesh.X for mesh in meshes])[used]
    fixed, sliding, *on_planes = np.concatenate([mesh.support for mesh in meshes])[used].T
    lines = carry_lines(surface, X, fixed)
    planes = tuple((plane, mask) for (plane, _), mask in zip(surface.on_planes, on_planes, strict=True))
    ends = np.searchsorted(used, old.curves)
    cables = tuple(replace(c, edges=ends[old.cable == index]) for index, c in enumerate(surface.cables))
    return surface.rebuilt(
        vertices=X,
        faces=F,
        patch_of_face=patch_of_face,
        fixed=fixed,
        on_plane=sliding,
        on_line=lines,
        on_planes=planes,
        cables=cables,
    )


def _patch_angles(mesh: _Mesh, count: int) -> Floats:
    """(count,) the smallest angle in each patch, degrees."""
    smallest = np.full(count, 180.0)
    np.minimum.at(smallest, mesh.patch, angles(mesh.X[mesh.F]).min(axis=1))
    return smallest
