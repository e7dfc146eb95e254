"""Refinement of chosen triangles, such as those near points: fine there, coarse elsewhere."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..base import validate
from ..base.arrays import Bools, Ints
from ..base.errors import OptionError
from ..contact.pinching import Walls, lift, standing_part
from ..surface import Surface
from ..surface.geometry import segment_lengths
from .curve_cutting import cut_triangles
from .quality import edge_lengths
from .refinement import Projection, new_vertices, with_vertices_on
from .remeshing import RAISED

TALL = 4.0  # heights of a wall over the length of its top edge: a higher column does not come to rest


def refine_near(
    surface: Surface,
    points: npt.ArrayLike,
    levels: int,
    radius: float,
    project: Projection | None = None,
) -> Surface:
    """The same surface with finer triangles near points: half the edge length at half the distance.

    Level k of 1 … ``levels`` cuts all triangles within the distance r_k = radius 2^(1-k) of a point, as
    ``refine_faces`` does. So the edges near the points are 2^-levels times as long as before, and a
    level adds about the same number of triangles as the one before.

    Parameters
    ----------
    points : (k,3) or (3,), length; vertices of the surface or other places.
    levels : how often, ≥ 0.
    radius : distance up to which the first level cuts triangles, length.
    project : as in ``refine``: puts new fixed vertices (k,3) on a curved boundary.

    Returns
    -------
    Surface
        Vertex i keeps its number; patches, tensions and the plane stay.

    Raises
    ------
    OptionError
        For points that are no finite (k,3) array, or wrong ``levels`` or ``radius``.

    Examples
    --------
    >>> from pcmc import Patch
    >>> square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]],
    ...                  [0, 0], [Patch("floor", 1.0)], fixed=range(4))
    >>> graded = refine_near(square, [0, 0, 0], levels=10, radius=0.5)
    >>> graded.m, float(edge_lengths(graded).min() * 2**10)
    (116, 1.0)
    """
    places = np.atleast_2d(np.asarray(points, dtype=float))
    if places.ndim != 2 or places.shape[1] != 3 or not np.isfinite(places).all():
        expected = "finite places of shape (k, 3)"
        message = f"points: expected {expected}, found an array of shape {np.shape(points)}"
        raise OptionError(message, what="points", found=np.shape(points), expected=expected)
    levels, radius = validate.integer("levels", levels), validate.positive("radius", radius)
    tree = cKDTree(places)
    for level in range(levels):
        corners = surface.vertices[surface.faces]
        middle = corners.mean(axis=1)
        reach = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
        distance = tree.query(middle)[0] - reach  # of the ball around the triangle: no more than its own
        surface = refine_faces(surface, distance <= radius * 0.5**level, project)
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

    Examples
    --------
    >>> from pcmc import Patch
    >>> square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]],
    ...                  [0, 0], [Patch("floor", 1.0)], fixed=range(4))
    >>> refine_faces(square, [0]).m
    6
    """
    edge_of_face = surface.topology.edge_of_face
    cut = np.zeros(len(surface.topology.edges), dtype=bool)
    cut[edge_of_face[_face_mask(surface, chosen)]] = True
    if not cut.any():
        return surface
    part = standing_part(surface)
    surface = lift(surface, part.walls, part.resting, RAISED)
    longest, columns = _longest_sides(surface), _wall_columns(surface, part.walls)
    first = edge_of_face[np.arange(surface.m), longest]
    count = 0
    while count < cut.sum():
        count = cut.sum()
        cut[first[cut[edge_of_face].any(axis=1)]] = True
        cut |= np.isin(columns, columns[cut & (columns >= 0)])
    new = new_vertices(surface, cut, project)
    ends, number = surface.topology.edges[cut], surface.n + np.arange(len(new.middle))
    F, patch = cut_triangles(surface.faces, surface.patch_of_face, ends, number, surface.n, longest)
    return with_vertices_on(surface, cut, F, patch, new)


def _face_mask(surface: Surface, chosen: Bools | Ints) -> Bools:
    """(m,) mask of triangles, from a mask or from indices."""
    given = np.asarray(chosen)
    mask = np.zeros(surface.m, dtype=bool)
    is_mask = given.dtype == bool and given.shape == mask.shape
    if not is_mask and given.size:
        indices = np.issubdtype(given.dtype, np.integer) and given.ndim == 1
        if not (indices and given.min() >= 0 and given.max() < surface.m):
            validate.refuse("chosen", chosen, f"a ({surface.m},) mask, or indices below {surface.m}")
    mask[given if is_mask else given.astype(np.int64)] = True
    return mask


def _longest_sides(surface: Surface) -> Ints:
    """(m,) the corner opposite each triangle's longest side; of equal ones, that of one edge for all."""
    length = edge_lengths(surface).astype(np.float32)  # equal but for rounding counts as equal
    rank = np.empty(len(length), dtype=np.int64)
    rank[np.lexsort((np.arange(len(length)), length))] = np.arange(len(length))
    return np.asarray(rank[surface.topology.edge_of_face].argmax(axis=1))


def _wall_columns(surface: Surface, walls: Walls) -> Ints:
    """(e,) the low column below a top edge that an edge crosses, itself included; -1 for none."""
    edges, n, X = surface.topology.edges, surface.n, surface.vertices
    height = np.abs(surface.plane.height(X))[walls.top_edges].max(axis=1, initial=0.0)
    low = walls.top_edges[height <= TALL * segment_lengths(X, walls.top_edges)]
    above = np.full(n, -1, dtype=np.int64)  # the top vertex straight above
    rows = walls.rows
    for end in (0, 1):
        straight = rows.fraction == end
        above[rows.vertices[straight]] = rows.top_ends[straight, end]
    above[walls.top_edges] = walls.top_edges
    one, other = np.sort(above[edges], axis=1).T
    key = np.where(one >= 0, one * n + other, -1)
    tops = np.sort(low, axis=1).astype(np.int64) @ [n, 1]
    return np.where(np.isin(key, tops), key, -1)
