"""Periodic surfaces: vertices that are the image of another one under a translation, x_image = x + t.

The surface goes on there as its own copy. An image moves with its vertex and has the same normal. Both count
as one vertex in the topology, the motion space and every matrix, and the forces on both are added up. The
positions are those of the mesh as it is drawn, so areas and pictures need to know nothing of this.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..base.arrays import Bools, Floats, Ints, cached_array, kept_with_owner, read_only
from ..base.errors import SurfaceError
from ..base.tolerances import ON, PARALLEL
from . import checks
from .geometry import bounding_size
from .guides import Plane
from .topology import Topology, components, topology

if TYPE_CHECKING:
    from .surface import Surface

NONE: Ints = read_only(np.empty((0, 2), dtype=np.int64))
NEARLY = 1e-4  # of the size: vertices nearer to an image, but not at it, are a mistake
COARSE = "refine the mesh of the cell, so that each edge joins two vertices by one way only"


class Imaged:
    """A surface some of whose vertices are images of others."""

    vertices: Floats
    faces: Ints
    patch_of_face: Ints
    images: Ints
    _with: Callable[..., Any]

    @property
    def periodic(self) -> bool:
        """Whether some vertices are images of others."""
        return len(self.images) > 0

    @cached_array
    def original(self) -> Ints:
        """(n,) the vertex that each one is an image of, or itself."""
        return originals(self.images, len(self.vertices))

    @cached_property
    def topology(self) -> Topology:
        """Edges, curves and points, from the faces alone, images and their vertices as one; shared by all
        moved copies."""
        return self.topology_of(self.faces, self.patch_of_face)

    def topology_of(self, faces: Ints, patch_of_face: Ints) -> Topology:
        """The topology of some of the faces (m,3), images and their vertices as one."""
        return glued(faces, patch_of_face, self.images, len(self.vertices))

    @cached_property
    def cell(self) -> Any:
        """The cell alone, as it is drawn: without images and rooms, its seam is a boundary."""
        if not self.periodic:
            return self
        own = topology(self.faces, self.patch_of_face, len(self.vertices))
        return self._with(images=NONE, rooms=(), faces=self.faces, topology=own)

    def folded(self, forces: Floats) -> Floats:
        """Forces (n,…) with those on images added to their vertices', in place; zero at images."""
        if self.periodic:
            image, vertex = self.images.T
            np.add.at(forces, vertex, forces[image])
            forces[image] = 0.0
        return forces

    def spread(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Values (n,…) with those of vertices at their images, too."""
        return values[self.original] if self.periodic else values


def originals(images: Ints, n: int) -> Ints:
    """(n,) the vertex that each of n is an image of by the pairs (k,2), or itself."""
    original = np.arange(n, dtype=np.int32)
    original[images[:, 0]] = images[:, 1]
    return original


def glued(faces: Ints, patch_of_face: Ints, images: Ints, n: int) -> Topology:
    """The topology of faces (m,3) of n vertices, images (k,2) and their vertices as one."""
    if not len(images):
        return topology(faces, patch_of_face, n)
    F = read_only(np.ascontiguousarray(originals(images, n)[faces], dtype=np.int32))
    return topology(F, patch_of_face, n, placed=faces)


def expect_no_images(surface: Any, what: str) -> None:
    """Refuse a periodic Surface where ``what`` would take the seam of its cell for a boundary.

    >>> from pcmc import Patch, Surface
    >>> flat = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("a", 1.0)], fixed=[0])
    >>> expect_no_images(flat, "the panels")
    """
    if surface.periodic:
        message = f"{what}: not for a periodic surface ({len(surface.images)} of its vertices are images);"
        message += " pass surface.rebuilt(images=(), fixed=...), its cell alone, held along its seam"
        raise SurfaceError(message, what="images", found=len(surface.images), expected=0)


def images_in(vertices: npt.ArrayLike, lattice: npt.ArrayLike) -> Ints:
    """The pairs (k,2) of vertices (n,3) that a translation of a lattice brings together: image and vertex.

    Of all vertices that are images of each other the first is the one that the others follow.

    Parameters
    ----------
    vertices : (n,3) positions, length.
    lattice : (d,3) the d = 1, 2 or 3 translations whose whole multiples are those of the surface.

    Raises
    ------
    SurfaceError : the translations are not independent; or vertices are almost images, but for rounding.

    >>> corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> images_in(corners, [[1, 0, 0]]).tolist()
    [[1, 0], [3, 2]]
    """
    X = checks.positions(vertices)
    T = checks.positions(lattice, "lattice")
    if len(T) > 3 or np.linalg.matrix_rank(T, ON * np.abs(T).max()) < len(T):
        text = f"lattice: expected 1, 2 or 3 independent translations, found {T.tolist()}"
        raise SurfaceError(text, what="lattice", found=T.tolist())
    size = max(bounding_size(X), float(np.linalg.norm(T, axis=1).max()))
    steps = (X - X[0]) @ np.linalg.pinv(T)  # whole numbers apart between images: one angle on circles
    around = np.linalg.norm(T, axis=1) / (2.0 * np.pi) * np.exp(2j * np.pi * steps)
    from scipy.spatial import cKDTree  # here, as few surfaces ask

    places = np.hstack([around.real, around.imag, X - X[0] - steps @ T])
    pairs = cKDTree(places).query_pairs(NEARLY * size, output_type="ndarray")
    i, j = pairs.T
    apart = np.linalg.norm(places[i] - places[j], axis=1)
    there = apart <= ON * size
    off = np.flatnonzero(~there & np.rint(steps[i] - steps[j]).any(axis=1))
    if len(off):
        k, l = pairs[off[0]].tolist()
        text = f"vertices {k} and {l} are images of each other but for {apart[off[0]]:.2g}"
        text = f"{text} ({len(off)} such pairs); give positions and lattice with more digits"
        raise SurfaceError(text, what="vertices", where=l, found=float(apart[off[0]]))
    group = components(pairs[there], len(X))
    vertex = np.unique(group, return_index=True)[1][group]
    image = np.flatnonzero(vertex != np.arange(len(X)))
    return np.stack([image, vertex[image]], axis=1)


@kept_with_owner
def lattice_of(surface: Any) -> Floats:
    """(d,3) independent translations whose whole multiples are those between images and their vertices.

    >>> from pcmc import Patch, Surface
    >>> corners = [[x, y, 0] for y in (0, 1) for x in (0, 1, 2, 3)]
    >>> strip = Surface(corners, [[0, 1, 4], [1, 5, 4], [1, 2, 5], [2, 6, 5], [2, 3, 6], [3, 7, 6]], [0] * 6,
    ...                 [Patch("strip", 1.0)], fixed=range(8), images=[[3, 0], [7, 4]])
    >>> lattice_of(strip).tolist()
    [[3.0, 0.0, 0.0]]
    """
    image, vertex = surface.images.T
    near, basis = ON * surface.size, np.empty((0, 3))
    t = surface.vertices[image] - surface.vertices[vertex]
    left = list(t[np.unique(np.round(t / (2.0 * near)), axis=0, return_index=True)[1]])
    while left:  # Euclid's algorithm: what is left of a translation may be shorter than those so far
        left.sort(key=np.linalg.norm, reverse=True)
        v = left.pop()
        v = v - np.round(v @ np.linalg.pinv(basis)) @ basis
        if np.linalg.norm(v) <= near:
            continue
        more = np.vstack([basis, v])
        if np.linalg.matrix_rank(more, near) == len(basis):
            left, more = [*left, *more], np.empty((0, 3))
        basis = more
    return read_only(basis)


def goes_on_above(surface: Any) -> bool:
    """Whether a periodic surface goes on above itself, as a foam does: a translation leads away from Π."""
    return bool((np.abs(lattice_of(surface) @ surface.plane.normal) > ON * surface.size).any())


def leaning_mirrors(plane: Plane, on_planes: Iterable[tuple[Plane, Bools]]) -> list[Plane]:
    """The mirror planes that are not upright over Π: what is behind them has its own down."""
    return [p for p, _ in on_planes if p.mirror and abs(np.dot(plane.normal, p.normal)) > PARALLEL]


def check_weights(
    parts: Iterable[Any], plane: Plane, on_planes: Iterable[tuple[Plane, Bools]], X: Floats, pairs: Ints
) -> None:
    """Refuse weights where the surface goes on at other heights over Π: there its copy would weigh otherwise.

    So it does behind a mirror plane that leans over Π, and at images whose translation leads away from it.
    """
    if not any(part.weight for part in parts):
        return
    found = [f"the {mirror} leans over" for mirror in leaning_mirrors(plane, on_planes)]
    t = X[pairs[:, 0]] - X[pairs[:, 1]]
    if (np.abs(t @ np.array(plane.normal)) > ON * np.linalg.norm(t, axis=1)).any():
        found.append("a translation of images leads away from")
    if found:
        text = f"weights: {found[0]} the plane Π, and what goes on there would weigh otherwise"
        hint = "take the weights out, or give the plane= that is level"
        raise SurfaceError(f"{text}; {hint}", what="weights", found=found)


def checked_images(given: Any, X: Floats, F: Ints, fixed: Bools, on_plane: Bools) -> Ints:
    """The pairs (k,2) of images and their vertices, by image; SurfaceError where they make no periodic mesh.

    Both must be held alike.
    """
    pairs = checks.pair_array(given, len(X))
    if not len(pairs):
        return NONE
    pairs = pairs[np.argsort(pairs[:, 0], kind="stable")]
    image, vertex = pairs.T
    near = ON * bounding_size(X)
    t = X[image] - X[vertex]
    tests = (
        (np.append(image[1:] == image[:-1], False), "is the image of two vertices", "remove one pair"),
        (np.isin(vertex, image), "names an image as the vertex", "name the vertex that it is an image of"),
        (np.linalg.norm(t, axis=1) <= near, "has both at one place", "merge them"),
        (fixed[image] != fixed[vertex], "has only one of them fixed", "hold both or none"),
        (on_plane[image] != on_plane[vertex], "has only one of them on the plane", "hold both or none"),
    )
    for bad, fault, hint in tests:
        checks.refuse_rows("images", pairs, bad, fault, hint)
    topo = glued(F, np.zeros(len(F), dtype=np.int32), pairs, len(X))
    own = (topo.faces[:, [1, 2, 0]] == topo.faces).any(axis=1)
    checks.refuse_rows("faces", F, own, "joins a vertex with its image", COARSE)
    one = X[topo.sides[:, 1]] - X[topo.sides[:, 0]]
    along = (X[F[:, [2, 0, 1]]] - X[F[:, [1, 2, 0]]]) * topo.sense[..., None]
    apart = np.linalg.norm(along - one[topo.edge_of_face], axis=2).max(axis=1) > near
    fault = "has an edge between two vertices that are joined otherwise elsewhere, by their images"
    checks.refuse_rows("faces", F, apart, fault, COARSE)
    return read_only(pairs)


def check_translations(before: Surface, X: Floats) -> None:
    """Refuse positions X (n,3) at which an image is not where its translation has it."""
    if before.periodic:
        image, vertex = before.images.T
        t = before.vertices[image] - before.vertices[vertex]
        away = np.linalg.norm(X[image] - X[vertex] - t, axis=1) > ON * before.size
        hint = "move both alike, or change the cell with rebuilt(vertices=...)"
        checks.refuse_rows("images", before.images, away, "is no longer one", hint)
