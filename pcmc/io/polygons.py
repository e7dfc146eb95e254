"""Polygons with data on points and cells, as PLY and VTK files hold them, become triangles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.errors import FileError
from ..meshing.quality import triangle_quality
from ..surface import checks
from ..surface.geometry import area_vectors
from .mesh_data import MeshData, support_kinds
from .metadata import Metadata

LARGEST = 200  # corners of a polygon: all fans of one are compared, which are their square
ELSEWHERE = "in the program that wrote it, or with pcmc repair"
AT_ONCE = 1 << 18  # triangles of fans compared at once: a hundred megabytes
LABELS = ("patch", "PatchId", "RegionId", "GroupIds", "MaterialIds", "medit:ref", "gmsh:physical")
"""Cell data that may hold the patch of each face; the first of these in the file counts."""


def cut_polygons(X: Floats, corners: Ints, counts: Ints) -> tuple[Ints, Ints, tuple[str, ...]]:
    """Triangles (m,3), the polygon each comes from (m,), and a note if any was cut.

    ``corners`` lists the vertices of polygon after polygon, ``counts`` how many each has. A polygon of k
    corners becomes the fan of k - 2 triangles whose worst one is best: for a quad the better diagonal.

    >>> X = np.array([[0, 0, 0], [2, 0, 0], [3, 1, 0], [1, 1, 0.0]])
    >>> cut_polygons(X, np.array([0, 1, 2, 3]), np.array([4]))[0].tolist()
    [[1, 2, 3], [1, 3, 0]]
    """
    if len(odd := np.flatnonzero((counts < 3) | (counts > LARGEST))):
        at, k = int(odd[0]), int(counts[odd[0]])
        text = f"face {at} has {k} corners"
        if k < 3:
            text += "; a face needs three or more"
        else:
            text += f", more than {LARGEST}; cut it into triangles {ELSEWHERE}"
        raise FileError(text, where=at, found=k, expected=(3, LARGEST))
    if (counts == 3).all():
        return corners.reshape(-1, 3), np.arange(len(counts)), ()
    checks.positions(X)
    start = np.cumsum(counts) - counts
    triangles, origin = [], []
    for k in np.unique(counts):
        same = np.flatnonzero(counts == k)
        for chosen in np.array_split(same, -(-len(same) * int(k) ** 2 // AT_ONCE)):
            polygon = corners[start[chosen][:, None] + np.arange(k)]
            triangles.append(_best_fans(X, polygon, chosen).reshape(-1, 3))
            origin.append(np.repeat(chosen, k - 2))
    source = np.concatenate(origin)
    order = np.argsort(source, kind="stable")
    quads, many = np.count_nonzero(counts == 4), np.count_nonzero(counts > 4)
    parts = [f"{n} {kind}" for n, kind in ((quads, "quads"), (many, "polygons")) if n]
    note = f"{' and '.join(parts)} were cut into triangles"
    return np.concatenate(triangles)[order], source[order], (note,)


def _best_fans(X: Floats, polygon: Ints, number: Ints) -> Ints:
    """(p,k-2,3) the fan of each polygon (p,k) whose smallest signed quality is largest."""
    k = polygon.shape[1]
    if k == 3:
        return polygon[:, None, :]
    relative = X[polygon] - X[polygon[:, :1]]
    vector_area = np.cross(relative, np.roll(relative, -1, axis=1)).sum(axis=1)
    turned = np.stack([np.roll(polygon, -s, axis=1) for s in range(k)])
    first = np.repeat(turned[:, :, :1], k - 2, axis=2)
    fans = np.stack([first, turned[:, :, 1:-1], turned[:, :, 2:]], axis=3)
    side = np.sign(np.einsum("sptd,pd->spt", area_vectors(X[fans]), vector_area))
    quality = triangle_quality(X, fans.reshape(-1, 3)).reshape(side.shape)
    worst = (side * quality).min(axis=2)
    best = worst.argmax(axis=0)
    if len(bad := np.flatnonzero(worst.max(axis=0) < 0.0)):  # those without area become such triangles
        at, text = int(number[bad[0]]), f"is a polygon of {k} corners that no fan of triangles fills; cut it"
        raise FileError(f"face {at} {text} {ELSEWHERE}", where=at, found=int(k))
    return fans[best, np.arange(len(polygon))]


def from_polygons(
    X: Floats,
    corners: Ints,
    counts: Ints,
    point_data: Mapping[str, Any],
    cell_data: Mapping[str, Any],
    metadata: Metadata,
    default: str,
) -> MeshData:
    """The mesh of polygons as in ``cut_polygons``, with data on its points and cells.

    "support" of the points holds supports, the first of LABELS of the cells patches, which the metadata name.
    """
    if not len(counts):
        raise FileError("the file has no faces", where="faces", found=0)
    outside = (corners < 0) | (corners >= len(X)) | (corners != np.floor(corners))  # NaN differs from itself
    if outside.any():
        bad = int(outside.argmax())
        face = int(np.searchsorted(np.cumsum(counts), bad, side="right"))
        text = f"face {face} names vertex {corners[bad]}, which is outside 0..{len(X) - 1}"
        raise FileError(text, where=face)
    X = np.array(X, dtype=np.float64)
    F, source, notes = cut_polygons(X, corners.astype(np.int64), counts.astype(np.int64))
    metadata.check_counts(len(X), len(F))
    label = next((key for key in LABELS if key in cell_data), None)
    names, patch = [default], np.zeros(len(counts), dtype=np.int64)
    if label is not None:
        values, patch = np.unique(np.asarray(cell_data[label]).ravel(), return_inverse=True)
        described = list(metadata.patches)
        known = label == "patch" and values.min() >= 0 and values.max() < len(described)
        names = [described[int(v)] if known else f"patch {v}" for v in values.tolist()]
    support = support_kinds(point_data["support"]) if "support" in point_data else None
    scalars = _scalars(point_data, "support", len(X))
    scalars |= {k: v[source] for k, v in _scalars(cell_data, label, len(counts)).items()}
    about: dict[str, Any] = {"support": support, "scalars": scalars, "joined": metadata.counts is not None}
    return metadata.mesh_data(X, F, patch[source], names, notes, **about)


def _scalars(data: Mapping[str, Any], other: str | None, size: int) -> dict[str, Floats]:
    """The data of one number each, but for the one of the name ``other``."""
    columns = {k: np.asarray(v).ravel() for k, v in data.items() if k != other}
    numbers = {k: v for k, v in columns.items() if len(v) == size and np.issubdtype(v.dtype, np.number)}
    return {k: v.astype(np.float64) for k, v in numbers.items()}
