"""One line of JSON with what formats of plain meshes have no place for: patches, plane, cables, rooms, ...

Vertices are named by their number where the mesh keeps its vertices, by position where each patch has a mesh.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import FileError
from ..base.units import NO_UNITS, Units
from ..base.validate import names_from_file
from ..surface import Cable, Circle, Line, Patch, Plane, Room, Surface
from ..surface.geometry import bounding_size
from .mesh_data import FREE, ROUNDING, SLIDING, MeshData, coincident, support_of, within

DAMAGED = (ValueError, KeyError, TypeError, IndexError, AttributeError)
CHANGED = "the surface has changed since it was written"
PARTS = ("cables", "rooms", "lines", "planes", "slides")


def metadata_text(
    surface: Surface,
    units: Units = NO_UNITS,
    joined: bool = True,
    without: Sequence[str] = (),
    counts: tuple[int, int] | None = None,
    bare: Collection[str] = (),
) -> str:
    """Everything of a surface but its mesh and supports on Π, as JSON.

    ``joined``: vertices keep their numbers in the file; ``without``: the parts that the format holds itself;
    ``counts``: of vertices and faces in the file; ``bare``: patches without tension and pressure.
    """

    def where(chosen: Ints | Bools) -> Any:
        vertices = np.flatnonzero(chosen) if chosen.dtype == bool else chosen
        return (vertices if joined else surface.vertices[vertices]).tolist()

    given, plain = support_of(surface, planes=True), support_of(surface)
    guides, planes = surface.given_supports.on_line, surface.on_planes
    values: dict[str, object] = {
        "patches": [row_of(patch) for patch in surface.patches],
        "plane": (surface.plane.point, surface.plane.normal),
        "counts": counts or (surface.n, surface.m),
    }
    parts = {
        "units": astuple(units) if units else (),
        "bare": [patch.name for patch in surface.patches if patch.name in bare],
        "cables": [
            [cable.name, cable.tension, where(cable.edges), *[cable.weight] * bool(cable.weight)]
            for cable in surface.cables
        ],
        "rooms": [astuple(room) for room in surface.rooms],
        "lines": [[astuple(guide), where(own)] for guide, own in guides if own.any()],
        "planes": [[astuple(plane), where(own)] for plane, own in planes if own.any()],
        "slides": [where((given == kind) & (plain != kind)) for kind in (FREE, SLIDING)] if planes else (),
    }
    return json.dumps(values | {key: part for key, part in parts.items() if part and key not in without})


def row_of(patch: Patch) -> tuple[object, ...]:
    """The fields of a patch in their order; without weight and snow as versions before these wrote them."""
    row = astuple(patch)
    return row if patch.snow else row[:-1] if patch.weight else row[:-2]


@dataclass(frozen=True)
class Metadata:
    patches: Mapping[str, Patch | None] = field(default_factory=dict)  # by name; bare ones are None
    plane: Plane | None = None
    counts: tuple[int, int] | None = None
    units: Units = NO_UNITS
    parts: Mapping[str, Any] = field(default_factory=dict)  # those of ``PARTS``

    def mesh_data(
        self, X: Floats, F: Ints, patch: Ints, names: Sequence[str], notes: Sequence[str] = (), **more: Any
    ) -> MeshData:
        """A mesh with all of this; tension and pressure of a patch are 1 where the metadata have none."""
        found, changed = names_from_file(names)
        patches = tuple(self.patches.get(name) or Patch(found[name], 1.0) for name in names)
        bare = tuple(found[name] for name in names if self.patches.get(name) is None)
        about = {"bare": bare, "plane": self.plane, "units": self.units, "parts": self.parts} | more
        return MeshData(X, F, patch, patches, notes=(*notes, *filter(None, (changed,))), **about)

    def of_meshes(self, meshes: Iterable[tuple[str, Any, Any]], default: str = "", **more: Any) -> MeshData:
        """Meshes of a name, points (n,3) and triangles (m,3) each; those of one name are one patch.

        ``default`` names the only patch.
        """
        X, F, named, start = [], [], list[str](), 0
        for name, points, faces in meshes:
            if len(faces):
                X.append(np.asarray(points, dtype=np.float64).reshape(-1, 3))
                local = np.asarray(faces).reshape(-1, 3)
                F.append(within(local, f"faces of {name!r}", len(X[-1])) + start)
                named += [name] * len(local)
                start += len(X[-1])
        if not X:
            raise FileError("the file has no triangles", where="faces", found=0)
        patch, names = pd.factorize(np.array(named, dtype=object))
        listed = [default] if default and len(names) == 1 else names.tolist()
        return self.mesh_data(np.concatenate(X), np.concatenate(F), patch, listed, **more)

    def check_counts(self, vertices: int, faces: int) -> None:
        """Raise FileError when the file lacks some of the mesh that was written."""
        if self.counts is not None and self.counts != (vertices, faces):
            written = f"{self.counts[0]} vertices and {self.counts[1]} faces"
            raise FileError(f"cut off or changed: {written} were written; it has {vertices} and {faces}")


def parse_metadata(text: str | None) -> Metadata:
    """The metadata in a text; without a text, empty ones."""
    if text is None:
        return Metadata()
    try:
        values = json.loads(text)
        patches = [Patch(*p) for p in values["patches"]]
        point, normal = map(tuple, values["plane"])
        return Metadata(
            {p.name: None if p.name in values.get("bare", ()) else p for p in patches},
            Plane(point, normal),
            (int(values["counts"][0]), int(values["counts"][1])),
            Units(*values.get("units", ())),
            {key: values[key] for key in PARTS if key in values},
        )
    except DAMAGED:
        raise _damaged(text) from None


def _damaged(text: str) -> FileError:
    message = f"the pcmc metadata in it are damaged: {text[:60]!r}"
    return FileError(message, where="metadata", found=text[:60])


def with_parts(data: MeshData) -> MeshData:
    """The mesh with the cables, rooms, lines and planes of its metadata; a note on those that do not fit."""
    if not data.parts:
        return data
    X, parts, lost = data.vertices, data.parts, dict[str, None]()
    keep: Ints = np.arange(len(X))
    group: Ints = keep

    def groups(where: Any, what: str, exact: bool = False) -> Ints | None:
        """The groups of vertices at a place, by number or position; None, and ``what`` lost, if one is gone.

        With ``exact`` the vertices get the positions of the metadata, to the last digit.
        """
        nonlocal X, keep, group
        given = np.array(where)
        if given.dtype.kind in "iu":
            return within(given, "metadata", len(X))
        if keep is group:  # positions: at one place there may be several vertices
            keep, group = coincident(X)
        points = given.astype(np.float64).reshape(-1, 3)
        distance, near = map(np.asarray, cKDTree(X[keep]).query(points))
        if (distance > ROUNDING * bounding_size(X)).any():
            lost[what] = None
            return None
        if exact:
            positions = X[keep]
            positions[near] = points
            X = positions[group]
        return near.reshape(given.shape[:-1])

    def sliding(key: str, what: str) -> list[tuple[Any, Bools]]:
        return [
            (row, np.isin(group, own))
            for row, where in parts.get(key, ())
            if (own := groups(where, what, exact=True)) is not None
        ]

    try:
        cables = [
            Cable(name, pull, keep[ends], *weight)
            for name, pull, where, *weight in parts.get("cables", ())
            if (ends := groups(where, f"cable {name!r} was left out")) is not None
        ]
        lines = sliding("lines", "what slides along a line is fixed")
        planes, support = sliding("planes", off := "what slides on a plane is fixed"), data.support
        if support is not None and planes and off not in lost:
            support = support.copy()
            for kind, where in zip((FREE, SLIDING), parts.get("slides", ()), strict=False):
                if len(where) and (own := groups(where, off)) is not None:
                    support[np.isin(group, own)] = kind
        rooms = tuple(Room(*row) for row in parts.get("rooms", ()))
        guides = tuple((Circle(*row) if len(row) == 3 else Line(*row), own) for row, own in lines)
        on_planes = () if off in lost else tuple((Plane(*row), own) for row, own in planes)
    except DAMAGED:
        raise _damaged(str(dict(parts))) from None
    return replace(
        data,
        vertices=X,
        support=support,
        cables=tuple(cables),
        rooms=rooms,
        lines=guides,
        planes=on_planes,
        notes=(*data.notes, *([f"{', '.join(lost)}: {CHANGED}"] if lost else [])),
    )
