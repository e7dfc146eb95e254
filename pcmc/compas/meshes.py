"""Surface to COMPAS meshes, one per patch, and back.

The names of attributes are those of COMPAS packages where they have one: ``is_support``, and ``rx``, ``ry``,
``rz`` for reactions.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import astuple, fields
from typing import Any

import numpy as np

from ..base.arrays import Floats
from ..base.errors import FileWarning, SurfaceError
from ..certificate.balance import reactions
from ..contact.pinching import standing_part
from ..energy.curvature import mean_curvature
from ..io.import_warnings import import_warnings
from ..io.mesh_data import FIXED, SLIDING, MeshData, support_of
from ..surface import Line, Surface, expect_surface
from ..surface.topology import topology
from . import mesh_arrays
from .mesh_arrays import GUIDE, KEY, SLIDES

MARKS = {"is_support": False, SLIDES: False, GUIDE: None}
QUANTITIES = dict.fromkeys(("mean_curvature", "rx", "ry", "rz"))
CARRIED = {"vertices", "faces", "patch_of_face", "patches", "fixed", "on_plane", "plane", "on_line"}


def to_meshes(surface: Surface) -> list[Any]:
    """A ``compas.datastructures.Mesh`` per patch. Patches share the keys of their common vertices.

    The key of a vertex is its index in the surface, that of a face likewise, so ``from_meshes`` restores the
    surface to the last bit.

    Returns
    -------
    list of Mesh : named after their patches, with

        - ``mesh.attributes``: ``tension`` α (force/length), ``pressure`` p (force/area), ``wall``, and on the
          first mesh ``"pcmc"`` with the plane Π and the lines and circles that vertices slide along;
        - at vertices: ``is_support`` (fixed), ``is_sliding`` (on Π), ``guide`` (the number of the line or
          circle in ``attributes["pcmc"]["guides"]``, or None), ``mean_curvature`` H (1/length; None on
          junctions and boundaries), and ``rx``, ``ry``, ``rz``, the force of the support on the surface.

    Raises
    ------
    SurfaceError : for a surface with a property that meshes do not carry.
    MissingExtra : without COMPAS.

    Examples
    --------
    >>> square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]],
    ...                  [0, 0], [Patch("floor", 2.0)], fixed=range(4))
    >>> mesh, = to_meshes(square)
    >>> mesh.name, mesh.attributes["tension"], mesh.vertex_attribute(3, "is_support")
    ('floor', 2.0, True)
    """
    mesh_class = mesh_arrays.mesh_class()
    expect_surface(surface)
    _check_carried(surface)
    rows = _vertex_attributes(surface)
    meshes = []
    for index, patch in enumerate(surface.patches):
        mesh = mesh_class(default_vertex_attributes=MARKS | QUANTITIES, name=patch.name)
        mesh.attributes.update({f.name: getattr(patch, f.name) for f in fields(patch) if f.name != "name"})
        mine = np.flatnonzero(surface.patch_of_face == index)
        for key in np.unique(surface.faces[mine]).tolist():
            mesh.add_vertex(key, attr_dict=dict(rows[key]))
        for key, face in zip(mine.tolist(), surface.faces[mine].tolist(), strict=True):
            mesh.add_face(face, fkey=key)
        meshes.append(mesh)
    meshes[0].attributes[KEY] = {
        "plane": {"point": list(surface.plane.point), "normal": list(surface.plane.normal)},
        "guides": [
            ["line" if isinstance(guide, Line) else "circle", *astuple(guide)] for guide, _ in surface.on_line
        ],
    }
    return meshes


def from_meshes(
    meshes: Any,
    *,
    tensions: Mapping[str, float] | float | None = None,
    pressures: Mapping[str, float] | float | None = None,
    weld: bool = False,
) -> Surface:
    """The surface of COMPAS meshes, one per patch.

    Two meshes meet where they share the keys of vertices. Vertices and faces are numbered in the order of
    their keys; if two meshes have a face of the same key, faces are numbered mesh by mesh.

    Parameters
    ----------
    meshes : a Mesh, or a list of them. A mesh's name is the patch's; a mesh must have the attribute
        ``tension``, and may have ``pressure`` (otherwise 1) and ``wall``. A vertex is fixed if one of
        ``is_support``, ``is_anchor`` and ``is_fixed`` is true, and slides on Π if ``is_sliding`` is. If no
        mesh has any of these attributes, the boundary is fixed. Polygons are cut into triangles.
    tensions, pressures : by mesh name, or one number for all, in place of the attributes.
    weld : join vertices at one place, for meshes that do not share keys. The keys then have no meaning.

    Warns
    -----
    FileWarning : once, if polygons are cut, the boundary is taken as fixed, or the meshes probably do not
        form the surface that was meant (an open seam, patches turned against each other).

    Raises
    ------
    SurfaceError : for anything that is not such a mesh; ``where`` is the mesh's name.
    MissingExtra : without COMPAS.

    Examples
    --------
    >>> square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]],
    ...                  [0, 0], [Patch("floor", 2.0)], fixed=range(4))
    >>> from_meshes(to_meshes(square)).patches
    (Patch(name='floor', tension=2.0, pressure=1.0),)
    """
    named = mesh_arrays.named_meshes(meshes)
    patches = mesh_arrays.read_patches(named, tensions, pressures)
    plane, guides = mesh_arrays.read_whole(named)
    vertices = mesh_arrays.read_vertices(named)
    keep, place = mesh_arrays.shared_vertices(vertices, list(named), weld)
    F, patch, notes = mesh_arrays.read_faces(named, vertices, place)
    support, guide = np.zeros(len(keep), dtype=np.int8), np.full(len(keep), -1)
    np.maximum.at(guide, place, vertices.guide)
    if vertices.support is not None:
        np.maximum.at(support, place, vertices.support)
    used, F = np.unique(F, return_inverse=True)
    F = F.reshape(-1, 3)
    if len(used) < len(keep):
        notes = (*notes, f"{len(keep) - len(used)} vertices that no face uses were left out")
        keep, support, guide = keep[used], support[used], guide[used]
    if vertices.support is None:
        support = np.where(topology(F, patch, len(used)).on_boundary, FIXED, support)
        notes = (*notes, "no vertex has the attribute is_support, so the boundary is taken as fixed")
    if guide.max() >= len(guides):
        text = f"a vertex has the guide {guide.max()}, but attributes[{KEY!r}] has {len(guides)} lines and"
        text = f"{text} circles; keep the first mesh, or set the vertex attribute {GUIDE!r} to None"
        raise SurfaceError(text, what=GUIDE, found=int(guide.max()), expected=len(guides))
    X = vertices.X[keep]
    held = None if vertices.support is None else support
    notes = (*notes, *import_warnings(MeshData(X, F, patch, tuple(patches), held)))
    if notes:
        warnings.warn(f"meshes: {'; '.join(notes)}", FileWarning, stacklevel=2)
    along = tuple((one, guide == number) for number, one in enumerate(guides))
    return Surface(X, F, patch, tuple(patches), support == FIXED, support == SLIDING, plane, along)


def _check_carried(surface: Surface) -> None:
    """Refuse a surface with a property, other than at its default, that meshes do not carry."""
    for field in fields(surface):
        value = getattr(surface, field.name)
        empty = not value.any() if isinstance(value, np.ndarray) else value == field.default
        if field.name not in CARRIED and not empty:
            text = f"surface.{field.name}: COMPAS meshes do not carry it; write the surface as .pcmc"
            raise SurfaceError(text, what=field.name, found=value)


def _vertex_attributes(surface: Surface) -> list[dict[str, Any]]:
    """A row per vertex: coordinates, support, curvature and reaction."""
    support, standing = support_of(surface), standing_part(surface).surface
    guide = np.full(surface.n, None)
    for number, (_, along) in enumerate(surface.on_line):
        guide[along] = number
    columns: dict[str, list[Any]] = {
        **dict(zip("xyz", surface.vertices.T.tolist(), strict=True)),
        "is_support": (support == FIXED).tolist(),
        SLIDES: (support == SLIDING).tolist(),
        GUIDE: guide.tolist(),
        "mean_curvature": _none_for_nan(mean_curvature(standing, "variational")),
        **dict(zip(("rx", "ry", "rz"), reactions(standing).T.tolist(), strict=True)),
    }
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _none_for_nan(values: Floats) -> list[float | None]:
    """The numbers, and None where there is none: JSON has no NaN."""
    return [value if value == value else None for value in values.tolist()]
