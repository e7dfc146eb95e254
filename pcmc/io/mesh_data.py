"""The mesh of a file and its data, as every reader returns them, before they become a Surface.

In a unit f times smaller, lengths become f times as large, tensions and cables' weights 1/f,
pressures, weights and snow 1/f², volumes f³. Forces stay, so the shape at rest stays the same.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints, mask_of
from ..base.errors import FileError, OptionError, unknown
from ..base.units import NO_UNITS, Units, conversion_note, length_factor
from ..base.validate import choice
from ..surface import Cable, Circle, Guide, HeldCurve, Line, Patch, Plane, Room, Surface, checks
from ..surface.geometry import bounding_size
from ..surface.topology import components, topology
from ..surface.values import KINDS, POWERS

FREE, SLIDING, FIXED = 0, 1, 2
HELD = {"fixed": FIXED, "sliding": SLIDING}  # names of groups and layers of supports
CURVATURE = "mean curvature"  # the scalar of that name, 1/length
TOLERANCE = 1e-7  # of the size, to merge vertices; single precision keeps this much
ROUNDING = 1e-6  # of the size: the most that a format rounds by


@dataclass(frozen=True, eq=False)
class MeshData:
    """A file's mesh and data, as far as its format has them."""

    vertices: Floats  # these three as in Surface
    faces: Ints
    patch_of_face: Ints
    patches: tuple[Patch, ...]  # tension and pressure are 1 where the file has none
    support: Ints | None = None  # (n,) FREE, SLIDING or FIXED; None where the format has no supports
    plane: Plane | None = None  # Π; None where the format has none
    scalars: Mapping[str, Floats] = field(default_factory=dict)  # (n,) or (m,) arrays by name
    certificate: Mapping[str, Any] = field(default_factory=dict)  # its values by name
    notes: tuple[str, ...] = ()  # what the reader changed ("3 quads were cut into triangles")
    # whether patches share their vertices for certain, as in files that pcmc wrote. Then two vertices at one
    # place stay two: those of a wall without height below a junction on Π
    joined: bool = False
    walls: str | None = None  # the text of ``metadata.encode_walls``
    lines: tuple[tuple[Guide, Bools], ...] = ()  # ``on_line`` in Surface; the others as there
    units: Units = NO_UNITS  # of the numbers; no unit where the file has none
    planes: tuple[tuple[Plane, Bools], ...] = ()
    cables: tuple[Cable, ...] = ()
    rooms: tuple[Room, ...] = ()
    parts: Mapping[str, Any] = field(default_factory=dict)  # as in ``metadata``, until the mesh is whole
    bare: tuple[str, ...] = ()  # the patches without tension and pressure: their 1 is the same in any unit
    curves: tuple[HeldCurve, ...] = ()
    order: int = 1  # of the elements, as in Surface
    images: Ints = field(default_factory=lambda: np.empty((0, 2), dtype=np.int64))  # as there


def checked_data(data: MeshData) -> MeshData:
    """The same with arrays of the right type, shape and range; FileError where a library let others pass."""
    X = checks.positions(numeric(data.vertices, "vertices", "fiu", (None, 3)).astype(np.float64))
    n, m, support, scalars = len(X), len(data.faces), data.support, dict(data.scalars)
    F = within(numeric(data.faces, "faces", "iu", (None, 3)), "faces", n)
    patch = numeric(data.patch_of_face, "patch_of_face", "iu", (m,))
    if support is not None:
        support = support_kinds(numeric(support, "support", "iu", (n,)))
    for name, values in scalars.items():
        if np.shape(values) != (m,):
            numeric(values, f"scalar {name}", "fiub", (n,))
        scalars[name] = np.asarray(values, dtype=np.float64)
    patch = within(patch, "patch_of_face", len(data.patches))
    return replace(data, vertices=X, faces=F, patch_of_face=patch, support=support, scalars=scalars)


def numeric(values: Any, name: str, kinds: str, shape: tuple[int | None, ...]) -> Any:
    """The array if its dtype is one of these kinds and its shape this one; None stands for any length > 0."""
    array = np.asarray(values)
    sizes = zip(array.shape, shape, strict=False)
    fits = array.ndim == len(shape) and all(n > 0 if wanted is None else n == wanted for n, wanted in sizes)
    if array.dtype.kind in kinds and fits:
        return array
    numbers = "numbers" if "f" in kinds else "whole numbers"
    wanted = f"({', '.join('n > 0' if size is None else str(size) for size in shape)})"
    text = f"{name}: expected {numbers} in the shape {wanted}, found {array.dtype} in {array.shape}"
    raise FileError(text, what=name, where=name, found=array.shape, expected=shape)


def within(numbers: Any, name: str, size: int) -> Ints:
    """The indices as int64 if all are in 0..size-1; FileError with the first that is not."""
    rows = np.asarray(numbers).reshape(len(numbers), -1)
    if len(bad := np.flatnonzero(((rows < 0) | (rows >= size)).any(axis=1))):
        found = rows[bad[0]].tolist()
        text = f"{name}: entry {bad[0]} is {str(found).strip('[]')}, outside 0..{size - 1}"
        raise FileError(text, what=name, where=int(bad[0]), found=found, expected=(0, size - 1))
    return np.asarray(numbers, dtype=np.int64)


def support_of(surface: Surface, planes: bool = False) -> Ints:
    """(n,) int8 FREE, SLIDING, FIXED; FIXED also on planes besides Π, unless a format has ``planes``."""
    given = surface.given_supports.fixed_and_sliding()
    fixed, sliding = given if planes else (surface.held & ~surface.on_plane, surface.on_plane)
    return np.where(fixed, FIXED, np.where(sliding, SLIDING, FREE)).astype(np.int8)


def support_kinds(values: npt.ArrayLike) -> Ints:
    """(n,) int8 FREE, SLIDING or FIXED from the numbers of a file; FileError for others."""
    numbers = np.asarray(values).ravel()
    if len(bad := np.flatnonzero(~np.isin(numbers, (FREE, SLIDING, FIXED)))):
        found = numbers[bad[0]].item()
        text = f"support: entry {bad[0]} is {found!r:.30}; expected 0 (free), 1 (sliding) or 2 (fixed)"
        raise FileError(text, what="support", where=int(bad[0]), found=found, expected=(0, 1, 2))
    return numbers.astype(np.int8)


def without_unused(data: MeshData) -> MeshData:
    """The same without vertices that no face uses, which Surface refuses."""
    used = mask_of(data.faces, len(data.vertices))
    if used.all():
        return data
    note = f"{np.count_nonzero(~used)} vertices that no face uses were left out"
    return replace(_selected(data, np.flatnonzero(used), np.cumsum(used) - 1), notes=(*data.notes, note))


def merged(data: MeshData) -> MeshData:
    """The same with vertices at one place merged: patches written as separate meshes need it."""
    if data.joined:
        return data
    keep, place = coincident(checks.positions(data.vertices))
    if len(keep) == len(data.vertices):
        return data
    selected = _selected(data, keep, place)
    if data.support is not None and selected.support is not None:
        np.maximum.at(selected.support, place, data.support)
    return selected


def coincident(X: Floats) -> tuple[Ints, Ints]:
    """Which vertices to keep, and the index among them of every vertex.

    Vertices closer than TOLERANCE times the diagonal of the bounding box become one, the first of them.

    >>> keep, place = coincident(np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1e-9], [0, 1, 0.0]]))
    >>> keep.tolist(), place.tolist()
    ([0, 1, 3], [0, 1, 0, 2])
    """
    near = cKDTree(X).query_pairs(TOLERANCE * bounding_size(X), output_type="ndarray")
    group = components(near, len(X))  # groups are numbered by their first vertex
    return np.unique(group, return_index=True)[1], group


def _selected(data: MeshData, keep: Ints, place: Ints) -> MeshData:
    """The same with the vertices ``keep``; ``place`` is the new index of every vertex."""
    X, support = data.vertices, None if data.support is None else data.support[keep]
    parts: dict[str, Any] = {
        "scalars": {k: v[keep] if len(v) == len(X) else v for k, v in data.scalars.items()},
        "planes": tuple((plane, mask[keep]) for plane, mask in data.planes),
        "cables": tuple(filter(None, (cable.carried(place) for cable in data.cables))),
        "curves": tuple(replace(curve, vertices=place[curve.vertices]) for curve in data.curves),
    }
    return replace(data, vertices=X[keep], faces=place[data.faces], support=support, **parts)


def to_surface(
    data: MeshData,
    tensions: Mapping[str, float] | float | None = None,
    pressures: Mapping[str, float] | float | None = None,
    fixed: npt.ArrayLike | str | None = None,
    on_plane: npt.ArrayLike | None = None,
    plane: Plane | None = None,
) -> Surface:
    """The Surface of the data; arguments that are given replace the file's values."""
    n, X = len(data.vertices), data.vertices
    support = np.full(n, FREE) if data.support is None else data.support
    sliding = support == SLIDING if on_plane is None else checks.mask(on_plane, n, "on_plane")
    if isinstance(fixed, str):
        choice("fixed", fixed, ["boundary"])
        held = topology(data.faces, data.patch_of_face, n).on_boundary
    elif fixed is not None:
        held = checks.mask(fixed, n, "fixed")
    elif data.support is not None:
        held = support == FIXED
    else:
        held = topology(data.faces, data.patch_of_face, n).on_boundary & ~sliding
    given = given_values("patch", [p.name for p in data.patches], tension=tensions, pressure=pressures)
    patches = tuple(replace(p, **given[p.name]) for p in data.patches)
    plane = plane or data.plane or Plane()
    height, size = plane.height(X), bounding_size(X)
    rounded = sliding & ~held & (np.abs(height) < ROUNDING * size) & (np.abs(height) > 1e-12 * size)
    if rounded.any():  # back onto the plane
        X = X - np.where(rounded, height, 0.0)[:, None] * np.array(plane.normal)
    lines, planes = (data.lines, data.planes) if fixed is None else ((), ())
    drawn = held | (support == FIXED) if data.curves else held  # where the file's curves are
    supports = drawn, sliding, plane, lines, planes
    parts = data.cables, data.rooms, data.curves, data.order, data.images
    surface = Surface(X, data.faces, data.patch_of_face, patches, *supports, *parts)
    return surface if drawn is held or np.array_equal(drawn, held) else surface.rebuilt(fixed=held)


def given_values(kind: str, names: Collection[str], **values: Any) -> dict[str, dict[str, Any]]:
    """The values by field that are given to each of these names: by name, or one for all, or None."""
    given: dict[str, dict[str, Any]] = {name: {} for name in names}
    for key, value in values.items():
        by_name = value if isinstance(value, Mapping) else dict.fromkeys(names, value)
        for name in by_name if value is not None else ():
            if name not in given:
                raise OptionError(unknown(kind, name, names), what=f"{key}s", where=name, found=name)
            given[name][key] = by_name[name]
    return given


def in_new_unit(value: Any, factor: float) -> Any:
    """A part of a surface, or a tuple of parts, in a new unit; ``factor`` new units are one old unit.

    >>> in_new_unit(Patch("roof", tension=2.0, pressure=3.0), 10.0)
    Patch(name='roof', tension=0.2, pressure=0.03)
    """
    match value:
        case tuple():
            return tuple(in_new_unit(part, factor) for part in value)
        case Patch() | Cable() | Room():
            parts = {Patch: "patches", Cable: "cables", Room: "rooms"}[type(value)]
            powers = {kind.field: POWERS[kind.dimension] for kind in KINDS.values() if kind.parts == parts}
            new: dict[str, Any] = {}
            for name, power in powers.items():
                old, by = getattr(value, name), factor ** abs(power)
                new[name] = old * by if power > 0 else old / by
            return replace(value, **new)
        case Plane() | Line() | Circle():
            point, _ = value.KEYS
            moved: dict[str, Any] = {point: tuple(factor * x for x in getattr(value, point))}
            moved |= {"radius": factor * value.radius} if isinstance(value, Circle) else {}
            return replace(value, **moved)
        case HeldCurve():
            return value.mapped(factor * np.eye(3), np.zeros(3))
    return value


def scaled_surface(surface: Surface, factor: float) -> Surface:
    """The surface in a new unit; ``factor`` new units are one old unit."""
    if factor == 1.0:
        return surface
    names = [f.name for f in fields(surface) if f.init]
    parts: dict[str, Any] = {name: in_new_unit(getattr(surface, name), factor) for name in names}
    parts |= {name: in_new_unit(part, factor) for name, part in surface.given_supports._asdict().items()}
    parts |= {"vertices": factor * surface.vertices, "curves": in_new_unit(surface.held_curves, factor)}
    return Surface(**parts)


def converted(data: MeshData, length: str, assumed: str = "") -> MeshData:
    """A file's data in another unit of length, if any is given, with a note if that changes them.

    ``assumed`` is the unit of a file that names none. Scalars besides curvature stay, and tensions that the
    file does not have. Of a certificate the mark alone is kept.
    """
    units = data.units or Units(assumed, data.units.force)
    factor = length_factor(units.length, length)
    if factor == 1.0:
        return replace(data, units=units)
    parts = {f.name: in_new_unit(getattr(data, f.name), factor) for f in fields(data)}
    parts["patches"] = tuple(p if p.name in data.bare else in_new_unit(p, factor) for p in data.patches)
    parts["vertices"] = factor * np.asarray(data.vertices, dtype=np.float64)
    parts["scalars"] = {k: v / factor if k == CURVATURE else v for k, v in data.scalars.items()}
    parts["certificate"] = {k: v for k, v in data.certificate.items() if k == "mark"}
    notes = (*data.notes, conversion_note(units.length, length))
    notes += ("its certificate is left out",) if len(parts["certificate"]) < len(data.certificate) else ()
    return replace(data, **parts | {"units": Units(length, units.force), "notes": notes})
