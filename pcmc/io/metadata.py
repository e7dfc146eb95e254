"""What formats of plain meshes have no place for: patches, plane, cables, rooms, ... in one line of JSON; and
a mesh per patch, as formats and trimesh have them.

Vertices are named by their number where the mesh keeps its vertices, by position where each patch has a mesh.
Below a junction on Π a wall's triangles have no area, and readers that join patches by position would merge
its vertices. So a file of such meshes has a text from which the reader puts the walls back.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import FileError, SurfaceError
from ..base.units import NO_UNITS, Units
from ..base.validate import names_from_file
from ..surface import Cable, Circle, HeldCurve, Line, Patch, Plane, Room, Surface
from ..surface.colours import patch_colors
from ..surface.curve_data import exact_curve, exact_data
from ..surface.geometry import bounding_size
from ..surface.held_curve import checked_curves
from ..surface.topology import topology
from .mesh_data import (
    FIXED,
    FREE,
    ROUNDING,
    SLIDING,
    MeshData,
    checked_data,
    coincident,
    support_of,
    within,
    without_unused,
)

DAMAGED = (ValueError, KeyError, TypeError, IndexError, AttributeError)
CURVES_LOST = "the curves that edges were drawn on were left out"
CHANGED = "the surface has changed since it was written"
PARTS = ("cables", "rooms", "lines", "planes", "slides", "curves", "order", "images")


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
        "curves": [
            [exact_data(one.curve), where(one.vertices), one.at.tolist()] for one in surface.held_curves
        ],
        "order": surface.order if surface.order > 1 else 0,
        "images": surface.images.tolist(),
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
        about: dict[str, Any] = {"bare": bare, "plane": self.plane, "units": self.units, "parts": self.parts}
        return MeshData(X, F, patch, patches, notes=(*notes, *filter(None, (changed,))), **about | more)

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
        by_name = {p.name: None if p.name in values.get("bare", ()) else p for p in patches}
        counts, units = (int(values["counts"][0]), int(values["counts"][1])), Units(*values.get("units", ()))
        parts = {key: values[key] for key in PARTS if key in values}
        return Metadata(by_name, Plane(point, normal), counts, units, parts)
    except DAMAGED:
        raise _damaged(text) from None


def _damaged(text: str) -> FileError:
    text = text[:60]
    return FileError(f"the pcmc metadata in it are damaged: {text!r}", where="metadata", found=text)


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
        rows = [
            (exact_curve(pieces), groups(where, CURVES_LOST, exact=True), np.array(at, dtype=np.float64))
            for pieces, where, at in parts.get("curves", ())
        ]
        fixed = np.zeros(len(X), dtype=bool) if support is None else support == FIXED
        number = keep.copy()
        number[group[fixed]] = np.flatnonzero(fixed)  # of the vertices at a place the one that is held
        curves = tuple(HeldCurve(curve, number[own], at) for curve, own, at in rows if own is not None)
        order = int(parts.get("order", 1))
        images = within(parts["images"], "images", len(X)) if parts.get("images") else data.images
        guides = tuple((Circle(*row) if len(row) == 3 else Line(*row), own) for row, own in lines)
        on_planes = () if off in lost else tuple((Plane(*row), own) for row, own in planes)
    except DAMAGED:
        raise _damaged(str(dict(parts))) from None
    try:
        if curves:
            topo = topology(data.faces, data.patch_of_face, len(X))
            checked_curves(curves, X, topo, fixed, bounding_size(X))
    except SurfaceError:
        lost[CURVES_LOST], curves = None, ()
    notes = (*data.notes, *([f"{', '.join(lost)}: {CHANGED}"] if lost else []))
    found: dict[str, Any] = {"cables": tuple(cables), "rooms": rooms, "lines": guides, "planes": on_planes}
    found |= {"order": order, "images": images} | ({"curves": curves} if curves else {})
    return replace(data, vertices=X, support=support, notes=notes, **found)


WALLS = "pcmc walls"  # the key of their text in a file
WALLS_CHANGED = "walls without height were left out: the surface has changed since they were written"


def patch_meshes(surface: Surface) -> Iterator[tuple[int, Floats, Ints, Ints]]:
    """For each patch with triangles: its number, colour (3,), vertices (v,), and triangles (t,3) of these."""
    for k, color in enumerate(patch_colors(surface)):
        used, local = np.unique(surface.faces[surface.patch_of_face == k], return_inverse=True)
        if len(used):
            yield k, color, used, local.reshape(-1, 3)


def from_scene(scene: Any, default: str, metadata: Metadata) -> MeshData:
    """Every mesh of a scene of trimesh, placed by its node; meshes of one name are one patch."""
    data: dict[str, list[Any]] = {}
    meshes, order = [], list(scene.geometry)
    for node in sorted(scene.graph.nodes_geometry, key=lambda n: order.index(scene.graph[n][1])):
        transform, key = scene.graph[node]
        mesh = scene.geometry[key]
        if not len(getattr(mesh, "faces", ())):
            continue
        unnamed = len(order) == 1 and (node.startswith("geometry_") or "." in node)
        points = np.asarray(mesh.vertices, dtype=np.float64)
        if not np.array_equal(transform, np.eye(4)):
            points = points @ transform[:3, :3].T + transform[:3, 3]
        known = node if node in metadata.patches or key not in metadata.patches else key
        meshes.append((default if unnamed else known, points, mesh.faces))
        for attribute, values in mesh.vertex_attributes.items():
            if np.size(values) == len(points):
                data.setdefault(attribute, []).append(np.asarray(values, dtype=np.float64).ravel())
    size = sum(len(points) for _, points, _ in meshes)
    scalars = {k: np.concatenate(v) for k, v in data.items() if sum(map(len, v)) == size}
    return metadata.of_meshes(meshes, scalars=scalars)


def encode_walls(surface: Surface, shown: Surface) -> str:
    """The walls of a surface as text; ``shown`` is the surface without the triangles that have no area."""
    wall = surface.auxiliary[surface.patch_of_face]
    used, local = np.unique(surface.faces[wall], return_inverse=True)
    values = {
        "vertices": surface.vertices[used],
        "support": support_of(surface)[used],
        "above": np.isin(used, surface.faces[~wall]),
        "faces": local.reshape(-1, 3),
        "patch": surface.patch_of_face[wall],
        "shown": np.count_nonzero(shown.auxiliary[shown.patch_of_face]),
    }
    plain = {name: np.asarray(value).tolist() for name, value in values.items()}
    return json.dumps(plain | {"patches": [row_of(p) for p in surface.patches]})


def restore_walls(data: MeshData) -> MeshData:
    """The same, joined, with the walls of ``data.walls``; without them, with a note, if it has changed."""
    if data.walls is None:
        return data
    walls, above, shown = _parsed(data.walls)
    names = {walls.patches[k].name for k in walls.patch_of_face}
    is_wall = np.array([p.name in names for p in data.patches])[data.patch_of_face]
    sheets = np.unique(data.faces[~is_wall])
    far, near = cKDTree(data.vertices[sheets]).query(walls.vertices[above])
    if np.count_nonzero(is_wall) != shown or np.any(far > ROUNDING * bounding_size(data.vertices)):
        return replace(data, walls=None, notes=(*data.notes, WALLS_CHANGED))
    n, below = len(data.vertices), ~above
    place = np.empty(len(below), dtype=np.int64)
    place[above], place[below] = sheets[near], n + np.arange(np.count_nonzero(below))
    X = np.concatenate([data.vertices, walls.vertices[below]])
    X[place] = walls.vertices  # those above too: to rest on Π they must lie on it to the last digit
    support = np.zeros(len(X), dtype=np.int8)
    support[:n] = 0 if data.support is None else data.support
    support[place] = np.asarray(walls.support)
    patches = [*data.patches, *(p for p in walls.patches if p.name in names - {q.name for q in data.patches})]
    number = {p.name: k for k, p in enumerate(patches)}
    patch = np.array([number.get(p.name, -1) for p in walls.patches])[walls.patch_of_face]
    beside = cKDTree(data.vertices).query(walls.vertices[below])[1]
    F = np.concatenate([data.faces[~is_wall], place[walls.faces]])
    of_face = np.concatenate([data.patch_of_face[~is_wall], patch])
    scalars = {k: np.concatenate([v, v[beside]]) for k, v in data.scalars.items()}
    mesh: dict[str, Any] = {"vertices": X, "faces": F, "patch_of_face": of_face, "patches": tuple(patches)}
    whole = replace(data, **mesh, support=support, scalars=scalars, walls=None)
    return replace(without_unused(whole), notes=data.notes)


def _parsed(text: str) -> tuple[MeshData, Bools, int]:
    """The walls, which of their vertices lie on other patches, and how many of their faces are shown."""
    try:
        values = json.loads(text)
        X, F, patch, support = (values[key] for key in ("vertices", "faces", "patch", "support"))
        walls = checked_data(MeshData(X, F, patch, tuple(Patch(*p) for p in values["patches"]), support))
        above, shown = np.array(values["above"], dtype=bool), int(values["shown"])
        if len(above) != len(walls.vertices):
            raise ValueError
    except (ValueError, KeyError, TypeError):
        raise FileError(f"the description of walls in it is damaged: {text!r:.60}", where=WALLS) from None
    return walls, above, shown
