"""What a file holds, before it becomes a Surface: the one shape every reader returns."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import FileError, OptionError, unknown
from ..surface import Patch, Plane, Surface, checks
from ..surface.geometry import bounding_size
from ..surface.topology import topology

FREE, SLIDING, FIXED = 0, 1, 2
ROUNDING = 1e-6  # of the size: what a format may round by


@dataclass(frozen=True, eq=False)
class Contents:
    """A file's mesh, as far as its format can tell.

    Attributes
    ----------
    vertices, faces, patch_of_face : as in Surface.
    patches : one per patch; tension and pressure are 1 where the format has none.
    support : (n,) int, FREE, SLIDING or FIXED; None where the format has no supports.
    plane : Π; None where the format has none.
    scalars : (n,) or (m,) arrays by name.
    certificate : the certificate's values by name, empty when the file has none.
    notes : sentences on what was changed in reading ("3 quads were cut into triangles").
    joined : whether patches share their vertices for certain, as in what was written here. Then
        vertices at one place are meant: a wall without height below a junction that rests on Π.
    walls : what ``flat.walls_told`` wrote, where patches were written apart and such walls are there.
    """

    vertices: Floats
    faces: Ints
    patch_of_face: Ints
    patches: tuple[Patch, ...]
    support: Ints | None = None
    plane: Plane | None = None
    scalars: Mapping[str, Floats] = field(default_factory=dict)
    certificate: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    joined: bool = False
    walls: str | None = None


def support_of(surface: Surface) -> Ints:
    """(n,) int8 FREE, SLIDING or FIXED."""
    return np.where(surface.fixed, FIXED, np.where(surface.on_plane, SLIDING, FREE)).astype(np.int8)


def without_unused(contents: Contents) -> Contents:
    """The same without vertices that no face uses, which Surface refuses."""
    used = np.zeros(len(contents.vertices), dtype=bool)
    used[contents.faces] = True
    if used.all():
        return contents
    number = np.cumsum(used) - 1
    left = f"{np.count_nonzero(~used)} vertices that no face uses were left out"
    return replace(
        contents,
        vertices=contents.vertices[used],
        faces=number[contents.faces],
        support=None if contents.support is None else contents.support[used],
        scalars={k: v[used] if len(v) == len(used) else v for k, v in contents.scalars.items()},
        notes=(*contents.notes, left),
    )


def merged(contents: Contents) -> Contents:
    """The same with vertices at one place made one, as patches that were written apart need."""
    if contents.joined:
        return contents
    from .merge import coincident  # scipy.spatial is slow to import, and rarely needed

    keep, place = coincident(checks.positions(contents.vertices))
    if len(keep) == len(contents.vertices):
        return contents
    support = None
    if contents.support is not None:
        support = np.zeros(len(keep), dtype=np.int8)
        np.maximum.at(support, place, contents.support)
    n = len(contents.vertices)
    scalars = {k: v[keep] if len(v) == n else v for k, v in contents.scalars.items()}
    return replace(
        contents, vertices=contents.vertices[keep], faces=place[contents.faces], support=support,
        scalars=scalars,
    )  # fmt: skip


def to_surface(
    contents: Contents,
    tensions: Mapping[str, float] | float | None = None,
    pressures: Mapping[str, float] | float | None = None,
    fixed: npt.ArrayLike | str | None = None,
    on_plane: npt.ArrayLike | None = None,
    plane: Plane | None = None,
) -> Surface:
    """The Surface of the contents, with what the caller says in place of what the file says."""
    n = len(contents.vertices)
    support = contents.support
    if isinstance(fixed, str) and fixed != "boundary":
        raise OptionError(unknown("fixed", fixed, ["boundary"]))
    if isinstance(fixed, str) or (fixed is None and support is None):
        held = topology(contents.faces, contents.patch_of_face, n).on_boundary
    elif fixed is None:
        held = np.asarray(support == FIXED)
    else:
        held = checks.mask(fixed, n, "fixed")
    if on_plane is not None:
        sliding = checks.mask(on_plane, n, "on_plane")
    else:
        sliding = np.zeros(n, dtype=bool) if support is None else support == SLIDING
    if fixed is None and support is None:
        held = held & ~sliding
    patches = _changed(contents.patches, "tension", tensions)
    plane = plane or contents.plane or Plane()
    return Surface(
        _on(plane, contents.vertices, sliding & ~held), contents.faces, contents.patch_of_face,
        _changed(patches, "pressure", pressures), held, sliding, plane,
    )  # fmt: skip


def _on(plane: Plane, X: Floats, sliding: Bools) -> Floats:
    """Sliding vertices that single precision or few digits put beside the plane, back onto it."""
    height, size = plane.height(X), bounding_size(X)
    near = sliding & (np.abs(height) < ROUNDING * size) & (np.abs(height) > 1e-12 * size)
    return X - np.where(near, height, 0.0)[:, None] * np.array(plane.normal) if near.any() else X


def _changed(
    patches: tuple[Patch, ...], key: str, values: Mapping[str, float] | float | None
) -> tuple[Patch, ...]:
    if values is None:
        return patches
    names = [p.name for p in patches]
    if not isinstance(values, Mapping):
        values = dict.fromkeys(names, values)
    for name in values:
        if name not in names:
            raise OptionError(unknown("patch", name, names))
    return tuple(replace(p, **{key: values.get(p.name, getattr(p, key))}) for p in patches)


# What formats of plain meshes carry besides the mesh, as one line of text


def description(surface: Surface) -> str:
    """Patches, plane and counts as JSON, for the comment or metadata of a format that has one."""
    point, normal = surface.plane.point, surface.plane.normal
    return json.dumps({
        "patches": [astuple(p) for p in surface.patches],
        "plane": [point, normal],
        "counts": [surface.n, surface.m],
    })  # fmt: skip


@dataclass(frozen=True)
class Description:
    """The same read back: patches by name, the plane, numbers of vertices and faces."""

    patches: Mapping[str, Patch] = field(default_factory=dict)
    plane: Plane | None = None
    counts: tuple[int, int] | None = None

    def named(self, names: Sequence[str]) -> tuple[Patch, ...]:
        """Patches of these names, as described, or with tension and pressure 1."""
        return tuple(self.patches.get(name, Patch(name, 1.0)) for name in names)

    def check_counts(self, vertices: int, faces: int) -> None:
        """An error when the file has lost some of what was written."""
        if self.counts is not None and self.counts != (vertices, faces):
            raise FileError(
                f"cut off or changed: {self.counts[0]} vertices and {self.counts[1]} faces were"
                f" written, {vertices} and {faces} found"
            )


def described(text: str | None) -> Description:
    """The description in a text, or an empty one for no text."""
    if text is None:
        return Description()
    try:
        found = json.loads(text)
        patches = [Patch(*p) for p in found["patches"]]
        plane = Plane(*(tuple(v) for v in found["plane"]))
        counts = (int(found["counts"][0]), int(found["counts"][1]))
    except (ValueError, KeyError, TypeError, IndexError):
        raise FileError(f"its pcmc description is damaged: {text[:60]!r}") from None
    return Description({p.name: p for p in patches}, plane, counts)
