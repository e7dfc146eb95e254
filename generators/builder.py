"""A mesh built from parts: points are numbered as they are added, so that sheets can share them."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from pcmc import Patch, Room, Surface
from pcmc.base.arrays import Floats, Ints
from pcmc.base.errors import FreeSurfaceWarning

from .strips import number_within_groups, strips


class Builder:
    """Collects points and faces and becomes a Surface.

    >>> mesh = Builder()
    >>> corners = mesh.add_points([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> mesh.add_faces([corners], patch=0)
    >>> mesh.surface([Patch("floor", 1.0)], fixed=corners).m
    1
    """

    def __init__(self) -> None:
        self._points: list[Floats] = []
        self._count = 0
        self._faces: list[Ints] = []
        self._patch: list[Ints] = []

    def add_points(self, positions: Any) -> Ints:
        """Add positions (k,3); returns their numbers (k,)."""
        positions = np.asarray(positions, dtype=float).reshape(-1, 3)
        self._points.append(positions)
        self._count += len(positions)
        return np.arange(self._count - len(positions), self._count)

    def add_faces(self, faces: Any, patch: int) -> None:
        """Add faces (f,3) of numbered points to a patch."""
        faces = np.asarray(faces, dtype=np.int64)
        self._faces.append(faces)
        self._patch.append(np.full(len(faces), patch))

    def positions(self, numbers: Ints) -> Floats:
        """(k,3) positions of points already added."""
        return np.concatenate(self._points)[numbers]

    def add_wall(
        self, patch: int, top: Ints, bottom_points: Floats, spacing: float | Floats, side: Ints | None = None
    ) -> Ints:
        """Add a wall of columns from the vertices of a curve to points below; returns its foot (c,).

        The rows of a column are about ``spacing`` high; there is at least one. Where the top touches
        the bottom they share the vertex.

        Parameters
        ----------
        patch : the wall's patch.
        top : (c,) numbers of the vertices along the curve.
        bottom_points : (c,3) the foot of each column.
        spacing : height of a row, length; one for all columns or one for each (c,).
        side : numbers of the first column, bottom to top, if another wall has it already.

        >>> mesh = Builder()
        >>> top = mesh.add_points([[0, 0, 0], [1, 0, 1], [2, 0, 0]])
        >>> mesh.add_wall(0, top, mesh.positions(top) * [1, 1, 0], spacing=1.0).tolist()
        [0, 3, 2]
        """
        top_points = self.positions(top)
        height = np.linalg.norm(top_points - bottom_points, axis=1)
        apart = height > 1e-9 * height.max(initial=0.0)
        rows = np.where(apart, np.maximum(1, np.rint(height / spacing)), 0).astype(np.int64)
        if side is not None:
            rows[0] = len(side) - 1
        column, level = number_within_groups(rows + 1)
        numbers = np.where(level == rows[column], top[column], -1)
        if side is not None:
            numbers[: len(side)] = side
        new = numbers < 0
        share = (level / np.maximum(rows, 1)[column])[new, None]
        foot = bottom_points[column[new]]
        numbers[new] = self.add_points(foot + share * (top_points[column[new]] - foot))
        mirrored = np.arange(len(rows) - 1) >= (len(rows) - 1) / 2
        self.add_faces(strips(numbers, rows, mirrored), patch)
        return numbers[level == 0]

    def closed_surface(self, patches: Sequence[Patch], rooms: Sequence[Room] = ()) -> Surface:
        """The Surface of all parts, without supports: for closed surfaces only."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FreeSurfaceWarning)
            return self.surface(patches, rooms=rooms)

    def surface(
        self, patches: Sequence[Patch], fixed: Any = (), on_plane: Any = (), rooms: Sequence[Room] = ()
    ) -> Surface:
        """The Surface of all parts; Π is z = 0."""
        return Surface(
            np.concatenate(self._points),
            np.concatenate(self._faces),
            np.concatenate(self._patch),
            tuple(patches),
            fixed=fixed,
            on_plane=on_plane,
            rooms=tuple(rooms),
        )
