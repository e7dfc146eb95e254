"""Refinement of chosen triangles, such as those near points: fine there, coarse elsewhere."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..base import validate
from ..base.arrays import Bools, Ints, mask_of
from ..base.errors import OptionError
from ..forces.pinching import standing_part
from ..forces.wall_rows import Walls, find_walls
from ..surface import Surface
from ..surface.geometry import segment_lengths
from ..surface.lagrange import expect_flat
from ..surface.topology import edge_places
from .curve_cutting import cut_triangles
from .quality import edge_lengths
from .refinement import Projection, with_vertices_on
from .remeshing import raised

TALL = 4.0  # heights of a wall over the length of its top edge: a higher column does not come to rest


def refine_near(
    surface: Surface, points: npt.ArrayLike, levels: int, radius: float, project: Projection | None = None
) -> Surface:
    """The same surface with finer triangles near points: half the edge length at half the distance.

    Level k of 1 … ``levels`` ≥ 0 cuts all triangles within the distance r_k = radius 2^(1-k), length, of a
    point, as ``refine_faces`` does. So the edges there get 2^-levels times as long, and each level adds about
    as many triangles as the one before. Vertex i keeps its number; patches, tensions and the plane stay.

    Parameters
    ----------
    points : (k,3) or (3,), length; vertices of the surface or other places.
    project : as in ``refine``: puts new fixed vertices (k,3) on a curved boundary.

    Raises
    ------
    OptionError : the points are no finite (k,3) array, or ``levels`` or ``radius`` are wrong.

    >>> from pcmc import Patch
    >>> square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]],
    ...                  [0, 0], [Patch("floor", 1.0)], fixed=range(4))
    >>> graded = refine_near(square, [0, 0, 0], levels=10, radius=0.5)
    >>> graded.m, float(edge_lengths(graded).min() * 2**10)
    (116, 1.0)
    """
    places = np.atleast_2d(np.asarray(points, dtype=float))
    if places.ndim != 2 or places.shape[1] != 3 or not np.isfinite(places).all():
        expected, found = "finite places of shape (k, 3)", np.shape(points)
        message = f"points: expected {expected}, found an array of shape {found}"
        raise OptionError(message, what="points", found=found, expected=expected)
    levels, radius = validate.integer("levels", levels), validate.positive("radius", radius)
    tree, rests = cKDTree(places), bool(standing_part(surface).walls.held.any())
    for level in range(levels):
        corners = surface.vertices[surface.faces]
        middle = corners.mean(axis=1)
        reach = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
        distance = tree.query(middle)[0] - reach  # of the ball around the triangle: no more than its own
        near = distance <= radius * 0.5**level
        surface = _refined(surface, near, project, held=rests) if near.any() else surface
    return surface


def refine_faces(surface: Surface, chosen: Bools | Ints, project: Projection | None = None) -> Surface:
    """The same surface with the chosen triangles cut into four, and as few others as must be.

    A triangle beside a chosen one is cut through its longest side first, and through the other where it
    has a new vertex there too. So no triangle gets an angle below half the smallest one of the triangle
    it comes from, however often this is repeated (Rivara 1984): repeated cuts make few different shapes.
    Where a wall stands in columns, one below each edge of its junction, a low column is cut from top to
    foot: no vertex of a row is without one of the junction above, where it has its place once that rests.

    Vertex i keeps its number. Junctions, boundaries and the rows of walls stay; a new vertex on an edge
    has the support that ``refine`` gives it. A junction that rests on the plane is lifted off it by a
    quarter of its edges, as by ``remesh``: solving brings it down again.

    Parameters
    ----------
    chosen : (m,) mask or indices of triangles.
    project : as in ``refine``: puts new fixed vertices (k,3) on a curved boundary.

    >>> from pcmc import Patch
    >>> square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]],
    ...                  [0, 0], [Patch("floor", 1.0)], fixed=range(4))
    >>> refine_faces(square, [0]).m
    6
    """
    given, faces = np.asarray(chosen), np.zeros(surface.m, dtype=bool)
    is_mask = given.dtype == bool and given.shape == faces.shape
    if not is_mask and given.size:
        indices = np.issubdtype(given.dtype, np.integer) and given.ndim == 1
        if not (indices and given.min() >= 0 and given.max() < surface.m):
            validate.refuse("chosen", chosen, f"a ({surface.m},) mask, or indices below {surface.m}")
    faces[given if is_mask else given.astype(np.int64)] = True
    return _refined(surface, faces, project, held=False) if faces.any() else surface


def _refined(surface: Surface, faces: Bools, project: Projection | None, held: bool) -> Surface:
    """The same with ``faces`` (m,) cut; with ``held``, walls over held bottoms are cut in columns, too."""
    expect_flat(surface, "refine_faces")
    topo = surface.topology
    cut = mask_of(topo.edge_of_face[faces], len(topo.edges))
    walls = find_walls(surface, held=True) if held else standing_part(surface).walls
    surface = raised(surface)
    # the corner opposite each longest side; of sides equal but for rounding, one edge for all triangles
    length = edge_lengths(surface).astype(np.float32)
    rank = np.argsort(np.argsort(length, kind="stable"))
    longest = rank[topo.edge_of_face].argmax(axis=1)
    columns, first = _wall_columns(surface, walls), topo.edge_of_face[np.arange(surface.m), longest]
    count = 0
    while count < cut.sum():
        count = cut.sum()
        cut[first[cut[topo.edge_of_face].any(axis=1)]] = True
        cut |= np.isin(columns, columns[cut & (columns >= 0)])
    number = surface.n + np.arange(count)
    F, patch = cut_triangles(surface.faces, surface.patch_of_face, topo.edges[cut], number, longest)
    return with_vertices_on(surface, cut, F, patch, project)


def _wall_columns(surface: Surface, walls: Walls) -> Ints:
    """(e,) the column below a top edge that an edge crosses, itself included; -1 for none.

    It is low, or over a held bottom: there the vertices of both edges are pairs.
    """
    rows, tops, X = walls.rows, walls.top_edges, surface.vertices
    height = np.abs(surface.plane.height(X))[tops].max(axis=1, initial=0.0)
    above = np.full(surface.n, -1, dtype=np.int64)  # the top vertex straight above
    for end in (0, 1):
        straight = rows.fraction == end
        above[rows.vertices[straight]] = rows.top_ends[straight, end]
    above[tops] = tops
    low = (height <= TALL * segment_lengths(X, tops)) | (walls.foot[tops] >= 0).all(axis=1)
    return edge_places(above[surface.topology.edges], tops[low])
