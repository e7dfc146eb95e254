"""Where seams go: drawn lines, and strips of a largest width or a number across each sheet of a roof."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Bools, Floats
from ..base.errors import OptionError
from ..surface.geometry import area_vectors, segment_lengths
from ..surface.guides import Plane
from ..surface.pieces import point_text
from ..surface.topology import joined
from .cut_mesh import ON, CutMesh, nearest_places

MEET = 0.25  # of a strip's width: ends of seams of two sheets so near to each other meet
ANGLES = np.radians([0.0, 90.0, *range(1, 90), *range(91, 180)])  # in which the longer side is sought
NARROWER = 0.98  # of the width square to x or y: another direction must do better


@dataclass(frozen=True, eq=False)
class ClothSheet:
    """A sheet between curves and cables, cut into strips at equal steps of their width."""

    patch: str
    source: Bools  # (m,) its faces of the surface
    along: Floats  # (3,) unit vector of the warp
    across: Floats  # (3,) unit vector; the seams lie near to levels of x · across
    levels: Floats  # (k,) ascending, with both ends: k - 1 strips, seams between


def sheet_axes(P: Floats, plane: Plane, degrees: float | None) -> tuple[Floats, Floats]:
    """Unit vectors (3,) along and across the strips of triangles P (m,3,3), square to their mean normal.

    Along is the direction with this angle from x in the plan; by default the one across which the sheet is
    narrowest.
    """
    normal = area_vectors(P).sum(axis=0)
    normal = normal / (np.linalg.norm(normal) or 1.0)
    east, north, _ = plane.axes
    if degrees is None:
        first = east - (east @ normal) * normal
        first = first if np.linalg.norm(first) > 0.1 else north - (north @ normal) * normal
        first /= np.linalg.norm(first)
        second = np.cross(normal, first)
        turned = np.cos(ANGLES)[:, None] * second - np.sin(ANGLES)[:, None] * first
        widths = np.ptp(P.reshape(-1, 3) @ turned.T, axis=0)
        widths[:2] *= NARROWER
        widths[0] *= NARROWER
        across = turned[widths.argmin()]
    else:
        wanted = np.cos(np.radians(degrees)) * east + np.sin(np.radians(degrees)) * north
        across = np.cross(normal, wanted)
        if np.linalg.norm(across) < 1e-6:
            text = f"direction: {degrees:g} degrees is square to a sheet of the roof; give another"
            raise OptionError(text, what="direction", found=degrees)
        across /= np.linalg.norm(across)
    return np.cross(across, normal), across


def level_ends(mesh: CutMesh, faces: Bools, height: Floats, level: float) -> Iterator[tuple[Floats, Floats]]:
    """The ends (3,) of each line on which height (n,) has a level on chosen faces (m,), between two cuts."""
    topo = mesh.topology
    sides = topo.edge_of_face[faces]
    above = height >= level
    crossed = above[topo.edges[:, 0]] != above[topo.edges[:, 1]]
    hit = crossed[sides]
    rows = hit.any(axis=1)
    links = sides[rows][hit[rows]].reshape(-1, 2).astype(np.int64)
    cut = mesh.cut_edge[links]
    nodes = np.where(cut, len(topo.edges) + np.arange(links.size).reshape(-1, 2), links)
    names, local = np.unique(nodes, return_inverse=True)
    edge = np.empty(len(names), dtype=np.int64)
    edge[local.ravel()] = links.ravel()
    for chain, closed, _ in joined(local.reshape(-1, 2), np.zeros(len(names), dtype=bool), len(names)):
        if not closed:
            a, b = topo.edges[edge[chain[[0, -1]]]].T
            share = (level - height[a]) / (height[b] - height[a])
            ends = mesh.X[a] + share[:, None] * (mesh.X[b] - mesh.X[a])
            yield ends[0], ends[1]


def with_levels(mesh: CutMesh, sheets: Sequence[ClothSheet]) -> CutMesh:
    """The mesh cut along geodesics between the ends of each sheet's levels; ends of several sheets meet."""
    number, before = int(mesh.seam.max(initial=-1)) + 1, list[int]()  # the vertices at ends of other sheets
    for sheet in sheets:
        meet, height = MEET * float(np.diff(sheet.levels).min()), mesh.X @ sheet.across
        own = [level_ends(mesh, sheet.source[mesh.source], height, level) for level in sheet.levels[1:-1]]
        met = list[int]()
        for line in [line for lines in own for line in lines]:  # a geodesic may cross the next level
            vertices = []
            for point in line:
                mine = sheet.source[mesh.source]
                others = [vertex for vertex in before if (mesh.F[mine] == vertex).any()]
                away = np.linalg.norm(mesh.X[others] - point, axis=1) if others else np.array([np.inf])
                if away.min() <= meet:
                    vertices.append(others[int(away.argmin())])
                else:
                    mesh, vertex = mesh.with_vertex(point, mine)
                    vertices.append(vertex)
            mine = sheet.source[mesh.source]
            mesh = mesh.with_seam(vertices[0], vertices[1], number, f"a seam of {sheet.patch!r}", mine)
            met += vertices
            number += 1
        before += met
    return mesh


def with_lines(mesh: CutMesh, lines: Sequence[Floats], plane: Plane) -> CutMesh:
    """The mesh cut along lines, each of points (k,2) in the plan or (k,3), joined by geodesics.

    An end within an edge's length of a cut or a rim is put there. Of two sheets, one over the other, points
    of the plan are on the upper one. OptionError for a point off the roof.
    """
    first = int(mesh.seam.max(initial=-1)) + 1
    for number, line in enumerate(lines):
        name, previous = f"seam {number + 1}", -1
        for k, point in enumerate(line):
            weights, f, away = _seen(mesh, point, plane)
            reach = float(segment_lengths(mesh.X, mesh.topology.edges[mesh.topology.edge_of_face[f]]).max())
            if away > reach:
                text = f"{name}: its point {point_text(point)} is off the roof, {away:.3g} from it; move it"
                raise OptionError(text, what="seams", found=point.tolist())
            place = weights @ mesh.X[mesh.F[f]]
            if k in (0, len(line) - 1):
                rim = mesh.topology.edges[mesh.cut_edge]
                on_rim, gap = nearest_places(mesh.X[np.column_stack([rim, rim[:, 1]])], place)
                near = int(gap.argmin())
                if gap[near] <= reach:
                    place = on_rim[near] @ mesh.X[[*rim[near], rim[near, 1]]]
            mesh, vertex = mesh.with_vertex(place, np.ones(len(mesh.F), dtype=bool))
            if k:
                middle = _seen(mesh, 0.5 * (point + line[k - 1]), plane)[1]
                faces = mesh.pieces.piece == mesh.pieces.piece[middle]
                mesh = mesh.with_seam(previous, vertex, first + number, name, faces)
            previous = vertex
    return mesh


def _seen(mesh: CutMesh, point: Floats, plane: Plane) -> tuple[Floats, int, float]:
    """(3,) the barycentric coordinates of the place nearest to a point of the plan or of space, its triangle,
    the highest of several, and how far it is."""
    seen = mesh.X if len(point) == 3 else plane.to_local(mesh.X)[:, :2]
    weights, away = nearest_places(seen[mesh.F], point)
    height = np.einsum("mi,mi->m", weights, plane.height(mesh.X)[mesh.F])
    f = int(np.where(away <= away.min() + ON * mesh.size, height, -np.inf).argmax())
    return weights[f], f, float(away[f])
