"""From polygons with data on points and cells, as PLY and VTK files hold them, to Contents."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.errors import FileError
from .contents import Contents, Description
from .polygons import triangulate

LABELS = ("patch", "PatchId", "RegionId", "GroupIds", "MaterialIds", "medit:ref", "gmsh:physical")
"""Cell data that say which patch a face belongs to; the first of them that is there does."""


def from_polygons(
    X: Floats,
    corners: Ints,
    counts: Ints,
    point_data: Mapping[str, Any],
    cell_data: Mapping[str, Any],
    about: Description,
    default: str,
) -> Contents:
    """Contents of polygons given by their corners one after the other and how many each has.

    ``point_data["support"]`` are supports, the first of LABELS in ``cell_data`` patches, named by the
    description or "patch 1", "patch 2", ...; other data of one number each are scalars. Without
    labels all is one patch, ``default``.
    """
    if not len(counts):
        raise FileError("it holds no faces")
    if corners.min() < 0 or corners.max() >= len(X):
        raise FileError(f"a face names a vertex outside 0..{len(X) - 1}")
    X = np.array(X, dtype=np.float64)
    F, source, notes = triangulate(X, corners.astype(np.int64), counts.astype(np.int64))
    about.check_counts(len(X), len(F))
    label = next((key for key in LABELS if key in cell_data), None)
    names, patch = [default], np.zeros(len(counts), dtype=np.int64)
    if label is not None:
        values, patch = np.unique(np.asarray(cell_data[label]).ravel(), return_inverse=True)
        told = list(about.patches)
        known = label == "patch" and values.min() >= 0 and values.max() < len(told)
        names = [told[int(v)] if known else f"patch {v}" for v in values.tolist()]
    support = point_data.get("support")
    scalars = {
        **{k: _column(v) for k, v in point_data.items() if k != "support" and _one(v, len(X))},
        **{
            k: _column(v)[source]
            for k, v in cell_data.items()
            if k != label and _one(v, len(counts))
        },
    }
    return Contents(
        X, F, patch[source], about.named(names),
        None if support is None else np.asarray(support).ravel().astype(np.int8),
        about.plane, scalars, notes=notes, joined=about.counts is not None,
    )  # fmt: skip


def _one(values: Any, size: int) -> bool:
    """Whether there is one number for each."""
    array = np.asarray(values)
    return array.size == size and np.issubdtype(array.dtype, np.number)


def _column(values: Any) -> Floats:
    return np.asarray(values, dtype=np.float64).ravel()
