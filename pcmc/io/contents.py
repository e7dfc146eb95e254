"""What a file holds, before it becomes a Surface: the one shape every reader returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import check
from ..arrays import Floats, Ints
from ..errors import OptionError, unknown
from ..surface import Patch, Plane, Surface
from ..topology import topology

FREE, SLIDING, FIXED = 0, 1, 2


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
        held = check.mask(fixed, n, "fixed")
    if on_plane is not None:
        sliding = check.mask(on_plane, n, "on_plane")
    else:
        sliding = np.zeros(n, dtype=bool) if support is None else support == SLIDING
    if fixed is None and support is None:
        held = held & ~sliding
    patches = _changed(contents.patches, "tension", tensions)
    return Surface(
        contents.vertices, contents.faces, contents.patch_of_face,
        _changed(patches, "pressure", pressures), held, sliding,
        plane or contents.plane or Plane(),
    )  # fmt: skip


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
