"""Remeshing, by MMG, that keeps patches, junction curves, boundaries and supports."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..base import validate
from ..base.arrays import Floats, Ints, mask_of
from ..base.errors import MissingExtra, OptionError, SurfaceError
from ..forces.curvature import mean_curvature
from ..forces.pinching import lift, standing_part
from ..surface import Surface
from ..surface.geometry import angles, area_vectors, face_areas, segment_lengths
from ..surface.lagrange import expect_flat
from ..surface.pieces import two_digits
from ..surface.topology import SIDES, edge_places
from .curve_cutting import CurveMesh, check_sizes, cut_curves, limit_growth, sizes_at, triangles_for
from .quality import edge_lengths, improve_angles
from .refinement import Projection

CHORD = 0.1  # of the edge length
ROUNDED = 1e-3  # of the edge length: sides of an area vector that is none, as of a closed patch
SHORTEST = 0.3  # of the edge length: no edge of MMG gets shorter
BEYOND = 2.0  # times the chord wanted: where these edges are farther off, MMG gives up or never ends
MOST = 20_000_000  # triangles; more mean a mistake in the edge length
PASSES = 3  # of MMG at most, each on the result of the one before; a patch takes its best
GOOD_ANGLE = 25.0  # degrees; no further pass is made when all angles reach it
FLAT_ANGLE = 0.1  # degrees; a triangle below it is as good as one without area
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
    rounding: their vertices stay, and new ones are put on ``surface.curves``, or on the straight edges that
    are on none, with the same support as the edge. So along curves the mesh gets finer, never coarser.
    Vertices held inside a patch stay. A junction that rests on the plane is lifted off it by a quarter of
    its edges, so that its wall has triangles; solving brings it down again. Everywhere else MMG puts new
    vertices on a smooth approximation of the surface: solve again afterwards.

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
    project : (k,3) → (k,3), applied to the new fixed vertices on none of ``surface.curves``: puts them on a
        curved boundary that the edges only approximate.

    Raises
    ------
    MissingExtra : without the library mmgpy.
    OptionError : for lengths that are not positive, or would make more than 20 million triangles; for a
        ``chord`` that edges of 0.3 ``edge_length``, the shortest, do not come near; if ``project`` returns
        another shape.
    SurfaceError : MMG gives up, or does not keep a curve.

    >>> from pcmc.plan import Plan
    >>> dome = Plan([[0, 0], [4, 0], [4, 3], [0, 3]], tension=2.0, edge_length=1.0).surface()
    >>> fine = remesh(dome, 0.5)
    >>> fine.m > 2 * dome.m, fine.patches == dome.patches
    (True, True)
    """
    expect_flat(surface, "remesh")
    one: Any = edge_length if np.ndim(edge_length) == 0 else 1.0
    check_lengths(one, near_curves, growth, chord)
    size = np.full(surface.n, one, dtype=float)
    if np.ndim(edge_length):
        size = check_sizes(edge_length, surface.n)
        size = limit_growth(surface.vertices, surface.topology.edges, size, growth)
    along_curves = size if near_curves is None else np.minimum(size, near_curves)
    _refuse_too_many(surface, size, "edge_length")
    _refuse_too_many(surface, along_curves, "near_curves")  # curves are cut with the mesh around them
    if chord is not None:
        _refuse_flat_chord(surface, chord, float(size.min()))
    surface = raised(surface)
    mesh = old = cut_curves(surface, along_curves, project)
    chord = CHORD * float(size.max()) if chord is None else chord
    candidates = []
    for _ in range(PASSES):
        wanted = _sizes(mesh, sizes_at(mesh.X, surface.vertices, size), growth)
        mesh = _remesh_with_mmg(mesh, wanted, growth, chord)
        mesh = replace(mesh, X=improve_angles(mesh.X, mesh.F, mesh.source < 0, GOOD_ANGLE))
        candidates.append(mesh)
        if angles(mesh.X[mesh.F]).min() >= GOOD_ANGLE:
            break
    return _assembled(surface, old, candidates)


def raised(surface: Surface) -> Surface:
    """The surface with resting junctions lifted by ``RAISED`` of their spacing, and no triangle without area.

    A vertex of a wall may have its place at rest on one line with the two others of a triangle.
    """
    part = standing_part(surface)
    if not part.resting.any():
        return surface
    walls, rows = part.walls, part.walls.rows
    lifted = lift(surface, walls, part.resting, RAISED)
    inner = mask_of(rows.vertices[rows.relative_height > 0.0], surface.n) & ~surface.held
    faces = surface.faces[walls.pinchable[surface.patch_of_face]]
    return lifted.moved(improve_angles(lifted.vertices, faces, inner, FLAT_ANGLE))


def size_note(surface: Surface, edge_length: float) -> str:
    """A line about a remeshed surface whose edges cannot be so long; empty if its longest edge is."""
    longest = float(edge_lengths(surface).max())
    if longest >= edge_length:
        return ""
    reached = f"the edge length {edge_length:g} is not reached; the longest edge is {longest:.3g}"
    return f"{reached}, as junctions and boundaries keep their vertices"


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


def _refuse_too_many(surface: Surface, size: Floats, name: str) -> None:
    """Refuse edge lengths (n,) that would make more triangles than ``MOST``, with the least possible one."""
    count = triangles_for(face_areas(surface.vertices[surface.faces]), size[surface.faces].mean(axis=1)).sum()
    if count <= MOST:
        return
    least = two_digits(float(size.min()) * math.sqrt(count / MOST), math.ceil)
    message = f"remesh: {name} = {size.min():g} would make about {count:.2g} triangles, more than {MOST}"
    raise OptionError(f"{message}; use {least:g} or more", what=name, found=float(size.min()), expected=least)


def _refuse_flat_chord(surface: Surface, chord: float, size: float) -> None:
    """Refuse a chord that the shortest edges exceed by far: MMG would take long, and give up. An equilateral
    triangle of edge e is up to H e² / 6 away from a sphere of mean curvature H."""
    curvature = np.abs(mean_curvature(surface, "cotangent"))
    known = curvature[np.isfinite(curvature)]
    reached = (float(known.mean()) if len(known) else 0.0) * (SHORTEST * size) ** 2 / 6.0
    if reached > BEYOND * chord:
        least = two_digits(reached / BEYOND, math.ceil)
        message = f"remesh: chord = {chord:g} is out of reach of an edge length of {size:g}"
        message += f"; use {least:g} or more, or a smaller edge length"
        raise OptionError(message, what="chord", found=chord, expected=least)


def _sizes(mesh: CurveMesh, size: Floats, growth: float) -> Floats:
    """(n,) the edge lengths wanted, no longer than those of a curve next to it, which grow away from it."""
    if len(mesh.curves):
        length = segment_lengths(mesh.X, mesh.curves)
        spacing = np.zeros(len(mesh.X))
        np.maximum.at(spacing, mesh.curves, length[:, None])
        on_curve = np.flatnonzero(spacing)
        distance, nearest = cKDTree(mesh.X[on_curve]).query(mesh.X)
        size = np.minimum(size, spacing[on_curve][nearest] + (growth - 1.0) * distance)
    return size


def _remesh_with_mmg(mesh: CurveMesh, size: Floats, growth: float, chord: float) -> CurveMesh:
    """The mesh after MMG, with the same curves."""
    try:
        from mmgpy import MmgMeshS
    except ImportError:
        raise MissingExtra("mmgpy", "remesh") from None
    fixed = np.union1d(mesh.curves, np.flatnonzero(mesh.support.any(axis=1)))
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
    least, most = SHORTEST * float(size.min()), 1.3 * float(size.max())
    try:
        tool.remesh(hmin=least, hmax=most, hausd=chord, hgrad=growth, angle=0, verbose=-1)
    except RuntimeError as error:
        hint = "repair degenerate triangles first, or choose another edge length"
        raise SurfaceError(f"MMG cannot remesh this surface ({error}); {hint}", what="surface") from None
    X, reference = tool.get_vertices_with_refs()
    F, patch = tool.get_triangles_with_refs()
    if not np.isin(patch, mesh.patch + 1).all():
        message = "MMG cannot remesh this surface; repair its triangles first, or choose another edge length"
        raise SurfaceError(message, what="surface")
    before, after = np.zeros((2, int(mesh.patch.max()) + 1, 3))
    np.add.at(before, mesh.patch, area_vectors(mesh.X[mesh.F]))
    np.add.at(after, patch - 1, area_vectors(X[F]))  # the same, as the rims are, or turned over as a whole
    turned = (before * after).sum(axis=1) < -((ROUNDED * float(size.max())) ** 4)
    F = np.where(turned[patch - 1, None], F[:, ::-1], F)
    origin, known, number = np.append(-1, fixed)[reference], reference > 0, np.full(len(mesh.X), -1)
    number[origin[known]] = np.flatnonzero(known)
    curves = number[mesh.curves]
    lost = (curves < 0).any(axis=1) | (edge_places(curves, F[:, SIDES].reshape(-1, 2)) < 0)
    if lost.any():
        place = mesh.X[mesh.curves[np.argmax(lost), 0]].tolist()
        message = f"MMG lost {lost.sum()} edges of curves, the first at {place}; choose a smaller edge length"
        raise SurfaceError(message, what="surface", where=place)
    source = np.where(known, mesh.source[origin], -1)
    support = known[:, None] & mesh.support[origin]
    return CurveMesh(X, F.astype(np.int64), patch - 1, curves, support, source, mesh.cable, mesh.on)


def _corners_to_keep(mesh: CurveMesh, size: Floats) -> Ints:
    """Triangles between curves that are as good as their corner allows, and small: MMG would split them."""
    between = np.flatnonzero(np.isin(mesh.F, mesh.curves).all(axis=1))
    corners = mesh.X[mesh.F[between]]
    _, second, largest = np.sort(angles(corners), axis=1).T
    small = triangles_for(face_areas(corners), size[mesh.F[between]].mean(axis=1)) <= LARGE
    return between[(second >= BLUNT) & (largest <= OBTUSE) & small]


def _assembled(surface: Surface, old: CurveMesh, candidates: Sequence[CurveMesh]) -> Surface:
    """A Surface of the best triangles for each patch: they fit, because the curves are the same. Vertices of
    ``old`` keep its positions: MMG scales the mesh, which changes the last digits."""
    meshes = [old, *candidates]
    angle = np.full((len(meshes), len(surface.patches)), 180.0)  # the smallest in each patch
    for row, mesh in zip(angle, meshes, strict=True):
        np.minimum.at(row, mesh.patch, angles(mesh.X[mesh.F]).min(axis=1))
    best = 1 + np.argmax(np.minimum(angle[1:], GOOD_ANGLE), axis=0)
    reached = angle[best, np.arange(len(best))]
    best[(reached < LEAST_ANGLE) & (reached < WORSE * angle[0])] = 0
    faces, patch, first = list[Ints](), list[Ints](), 0
    for number, mesh in enumerate(meshes):
        chosen = best[mesh.patch] == number
        vertex = np.where(mesh.source >= 0, mesh.source, first + np.arange(len(mesh.X)))
        faces.append(vertex[mesh.F[chosen]])
        patch.append(mesh.patch[chosen])
        first += len(mesh.X)
    used, inverse = np.unique(np.concatenate(faces), return_inverse=True)
    F, patch_of_face = inverse.reshape(-1, 3), np.concatenate(patch)
    X = np.concatenate([mesh.X for mesh in meshes])[used]
    support = np.concatenate([mesh.support for mesh in meshes])[used]
    for column, (plane, before) in enumerate(surface.on_planes, start=2):
        off = ~before[surface.faces].all(axis=1)
        lies = np.bincount(surface.patch_of_face, off, len(surface.patches)) == 0  # such as an upright wall
        inside = mask_of(F[lies[patch_of_face]], len(X)) & (used >= len(old.X))
        X[inside] = plane.nearest(X[inside])
        support[inside, column] = True
    ends = np.searchsorted(used, old.curves)
    cables = tuple(replace(c, edges=ends[old.cable == index]) for index, c in enumerate(surface.cables))
    return surface.with_mesh(
        support, vertices=X, faces=F, patch_of_face=patch_of_face, cables=cables, curves=old.on.joined(ends)
    )
