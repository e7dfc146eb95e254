"""Walls of formats that write patches apart, where some have no height: kept as text beside the meshes.

Below a junction that rests on Π a wall's triangles have no area, and its vertices lie on the junction. Such
triangles have no place in a mesh for other programs, and patches that were written apart are joined by
place, which would join them too. So with the meshes, without those triangles, goes a description of all
walls as they are, and on reading it takes their place.
"""

from __future__ import annotations

import json
from dataclasses import astuple, dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import FileError
from ..surface import Patch, Surface
from ..surface.geometry import bounding_size
from .contents import ROUNDING, Contents, support_of, without_unused

KEY = "pcmc walls"
CHANGED = "walls without height were left out: the surface has changed since they were written"


def walls_told(surface: Surface, shown: Surface) -> str:
    """The walls of a surface as text; ``shown`` is the surface without the triangles that have no area."""
    wall = surface.walls[surface.patch_of_face]
    used, local = np.unique(surface.faces[wall], return_inverse=True)
    return json.dumps({
        "vertices": surface.vertices[used].tolist(),
        "support": support_of(surface)[used].tolist(),
        "above": np.isin(used, surface.faces[~wall]).tolist(),
        "faces": local.reshape(-1, 3).tolist(),
        "patch": surface.patch_of_face[wall].tolist(),
        "patches": [astuple(p) for p in surface.patches],
        "shown": int(np.count_nonzero(shown.walls[shown.patch_of_face])),
    })  # fmt: skip


def with_walls(contents: Contents) -> Contents:
    """The same, its patches joined, with the walls that ``contents.walls`` tells in place of those shown.

    Where the surface is another one by now they are left out, and that is said.
    """
    if contents.walls is None:
        return contents
    told = _Walls.parsed(contents.walls)
    names = {told.patches[k].name for k in told.patch}
    is_wall = np.array([p.name in names for p in contents.patches])[contents.patch_of_face]
    sheets = np.unique(contents.faces[~is_wall])
    reach = ROUNDING * bounding_size(contents.vertices)
    far, near = cKDTree(contents.vertices[sheets]).query(told.vertices[told.above])
    if np.count_nonzero(is_wall) != told.shown or np.any(far > reach):
        return replace(contents, walls=None, notes=(*contents.notes, CHANGED))
    n, below = len(contents.vertices), ~told.above
    place = np.empty(len(below), dtype=np.int64)
    place[told.above], place[below] = sheets[near], n + np.arange(np.count_nonzero(below))
    X = np.concatenate([contents.vertices, told.vertices[below]])
    X[place] = told.vertices  # those above too: to rest on Π they must lie on it to the last digit
    support = np.zeros(len(X), dtype=np.int8)
    support[:n] = 0 if contents.support is None else contents.support
    support[place] = told.support
    patches = list(contents.patches)
    patches += [p for p in told.patches if p.name in names - {q.name for q in patches}]
    number = {p.name: k for k, p in enumerate(patches)}
    patch = np.array([number.get(p.name, -1) for p in told.patches])[told.patch]
    beside = cKDTree(contents.vertices).query(told.vertices[below])[1]
    whole = replace(
        contents,
        vertices=X,
        faces=np.concatenate([contents.faces[~is_wall], place[told.faces]]),
        patch_of_face=np.concatenate([contents.patch_of_face[~is_wall], patch]),
        patches=tuple(patches),
        support=support,
        scalars={k: np.concatenate([v, v[beside]]) for k, v in contents.scalars.items()},
        walls=None,
    )
    return replace(without_unused(whole), notes=contents.notes)


@dataclass(frozen=True, eq=False)
class _Walls:
    """What ``walls_told`` tells."""

    vertices: Floats
    support: Ints
    above: Bools
    faces: Ints
    patch: Ints
    patches: list[Patch]
    shown: int

    @classmethod
    def parsed(cls, text: str) -> _Walls:
        try:
            told = json.loads(text)
            found = cls(
                vertices=np.array(told["vertices"], dtype=np.float64).reshape(-1, 3),
                support=np.array(told["support"], dtype=np.int8),
                above=np.array(told["above"], dtype=bool),
                faces=np.array(told["faces"], dtype=np.int64).reshape(-1, 3),
                patch=np.array(told["patch"], dtype=np.int64),
                patches=[Patch(*p) for p in told["patches"]],
                shown=int(told["shown"]),
            )
            n = len(found.vertices)
            if not n == len(found.support) == len(found.above) > found.faces.max():
                raise ValueError
            if not len(found.faces) == len(found.patch) or found.patch.max() >= len(found.patches):
                raise ValueError
        except (ValueError, KeyError, TypeError):
            raise FileError(f"its description of walls is damaged: {text!r:.60}") from None
        return found
