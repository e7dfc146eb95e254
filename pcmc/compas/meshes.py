"""Surface to COMPAS meshes, one per patch, and back; functions of meshes and plain data for other programs.

Names of attributes are those of COMPAS packages where they have one: ``is_support``, and ``rx``, ``ry``,
``rz`` for reactions. ``pcmc.compas.server`` offers the functions to other programs.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from typing import Any

import numpy as np

import pcmc

from .. import mean_curvature
from ..base import validate
from ..base.arrays import plain
from ..base.errors import FileWarning, PcmcError, SurfaceError
from ..base.files import PathLike
from ..certificate.forces import Forces
from ..io.mesh_data import FIXED, SLIDING, MeshData, support_of, to_surface
from ..io.reading import import_warnings
from ..surface import Surface, expect_surface
from . import mesh_arrays
from .mesh_arrays import CABLE, GUIDE, KEY, PLANES, SLIDES, TENSION

MARKS: dict[str, Any] = {"is_support": False, SLIDES: False, GUIDE: None, PLANES: None}
QUANTITIES = dict.fromkeys(("mean_curvature", "rx", "ry", "rz"))
Values = Mapping[str, float] | float | None  # by name, or one for all
CARRIED = {"vertices", "faces", "patch_of_face", "patches", "fixed", "on_plane", "plane", "on_line"}
CARRIED |= {"on_planes", "cables", "rooms", "curves", "given_supports"}


def to_meshes(surface: Surface) -> list[Any]:
    """A ``compas.datastructures.Mesh`` per patch. Patches share the keys of their common vertices.

    The key of a vertex is its index in the surface, that of a face likewise, so ``from_meshes`` restores the
    surface to the last bit. ``mesh.attributes`` are ``tension`` α (force/length), ``pressure`` p (force/area)
    with ``weight`` and ``snow``, ``wall``, and on the first mesh ``"pcmc"`` with the plane Π and the lines
    and circles that vertices slide along. Vertices have ``is_support`` (fixed), ``is_sliding`` (on Π),
    ``guide`` (the number of the line or circle in ``attributes["pcmc"]["guides"]``, or None),
    ``mean_curvature`` H (1/length; None on junctions and boundaries), and the force of the support, ``rx``,
    ``ry``, ``rz``.

    Raises
    ------
    SurfaceError : for a surface with a property that meshes do not carry.
    MissingExtra : without COMPAS.

    >>> from pcmc import Patch, Surface
    >>> square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]],
    ...                  [0, 0], [Patch("floor", 2.0)], fixed=range(4))
    >>> mesh, = to_meshes(square)
    >>> mesh.name, mesh.attributes["tension"], mesh.vertex_attribute(3, "is_support")
    ('floor', 2.0, True)
    >>> from_meshes([mesh]).patches
    (Patch(name='floor', tension=2.0, pressure=1.0),)
    """
    mesh_class = mesh_arrays.mesh_class()
    expect_surface(surface)
    for field in fields(surface):
        value = getattr(surface, field.name)
        empty = not value.any() if isinstance(value, np.ndarray) else value == field.default
        if field.name not in CARRIED and not empty:
            text = f"surface.{field.name}: COMPAS meshes do not carry it; write the surface as .pcmc"
            raise SurfaceError(text, what=field.name, found=value)
    if heavy := next((cable for cable in surface.cables if cable.weight), None):
        text = f"cable {heavy.name!r}: COMPAS meshes do not carry its weight; write the surface as .pcmc"
        raise SurfaceError(text, what="weight", where=heavy.name, found=heavy.weight)
    rows, meshes = _vertex_attributes(surface), []
    for index, patch in enumerate(surface.patches):
        mesh = mesh_class(default_vertex_attributes=MARKS | QUANTITIES, name=patch.name)
        mesh.attributes.update({f.name: getattr(patch, f.name) for f in fields(patch) if f.name != "name"})
        mine = np.flatnonzero(surface.patch_of_face == index)
        for key in np.unique(surface.faces[mine]).tolist():
            mesh.add_vertex(key, attr_dict=dict(rows[key]))
        for key, face in zip(mine.tolist(), surface.faces[mine].tolist(), strict=True):
            mesh.add_face(face, fkey=key)
        meshes.append(mesh)
    for cable in surface.cables:
        for edge in map(tuple, cable.edges.tolist()):
            for mesh in (mesh for mesh in meshes if mesh.has_edge(edge)):
                mesh.edge_attributes(edge, [CABLE, TENSION], [cable.name, cable.tension])
    meshes[0].attributes[KEY] = {
        "plane": plain(asdict(surface.plane)),
        "guides": [plain(asdict(guide)) for guide, _ in surface.given_supports.on_line],
        "planes": [plain(asdict(plane)) for plane, _ in surface.on_planes],
        "rooms": [{**asdict(room), "patches": dict(room.patches)} for room in surface.rooms],
        "cables": [cable.name for cable in surface.cables],
        "curves": [curve.plain() for curve in surface.held_curves],
    }
    return meshes


def from_meshes(
    meshes: Any, *, tensions: Values = None, pressures: Values = None, weld: bool = False
) -> Surface:
    """The surface of COMPAS meshes, one per patch.

    Two meshes meet where they share the keys of vertices. Vertices and faces are numbered in the order of
    their keys; if two meshes have a face of the same key, faces are numbered mesh by mesh.

    Parameters
    ----------
    meshes : a Mesh, or a list of them. A mesh's name is the patch's; it must have the attribute ``tension``,
        and may have ``pressure`` (otherwise 1), ``weight``, ``snow`` and ``wall``. A vertex is fixed if one
        of ``is_support``, ``is_anchor`` and ``is_fixed`` is true, and slides on Π if ``is_sliding`` is. If no
        mesh has any of these attributes, the boundary is fixed. Polygons are cut into triangles.
    tensions, pressures : by mesh name, or one number for all, in place of the attributes.
    weld : join vertices at one place, for meshes that do not share keys. The keys then have no meaning.

    Warns
    -----
    FileWarning : once, if polygons are cut, the boundary is taken as fixed, or the meshes probably do not
        form the surface that was meant (an open seam, patches turned against each other).

    Raises
    ------
    SurfaceError : for anything that is not such a mesh, or if the meshes form no surface; ``where`` is the
        mesh's name, or the number of the vertex or face in the surface.
    MissingExtra : without COMPAS.

    Examples
    --------
    >>> from compas.datastructures import Mesh
    >>> floor = Mesh.from_vertices_and_faces([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> floor.name = "floor"
    >>> floor.attributes["tension"] = 2.0
    >>> floor.vertices_attribute("is_support", True)
    >>> from_meshes(floor).patches
    (Patch(name='floor', tension=2.0, pressure=1.0),)
    """
    named, weld = mesh_arrays.named_meshes(meshes), validate.flag("weld", weld)
    try:
        surface, notes = _surface(named, tensions, pressures, weld)
    except (TypeError, ValueError, LookupError, AttributeError, OverflowError) as error:
        if isinstance(error, PcmcError):
            raise
        raise mesh_arrays.damaged_mesh(error) from None  # the net under the checks
    if notes:
        warnings.warn(f"meshes: {'; '.join(notes)}", FileWarning, stacklevel=2)
    return surface


def _surface(
    named: Mapping[str, Any], tensions: Any, pressures: Any, weld: bool
) -> tuple[Surface, tuple[str, ...]]:
    """The surface of meshes by name, and notes on what was changed or is doubtful."""
    patches = tuple(mesh_arrays.read_patches(named, tensions, pressures))
    whole = mesh_arrays.read_whole(named)
    vertices, marked, unused = mesh_arrays.read_vertices(named, whole)
    keep, place = mesh_arrays.shared_vertices(vertices, weld)
    X, n = np.array([vertex.point for vertex in vertices])[keep], len(keep)
    places: dict[str, dict[int, int]] = {name: {} for name in named}
    support, guide = np.zeros(n, dtype=np.int8), np.full(n, -1)
    on_planes = np.zeros((len(whole.planes), n), dtype=bool)
    for vertex, k in zip(vertices, place.tolist(), strict=True):
        places[vertex.mesh][vertex.key] = k
        support[k], guide[k] = max(support[k], vertex.support), max(guide[k], vertex.guide)
        on_planes[list(vertex.planes), k] = True
    F, patch, notes = mesh_arrays.read_faces(named, X, places)
    if unused:
        notes = (*notes, f"{unused} vertices that no face uses were left out")
    if not marked:
        notes = (*notes, "no vertex has the attribute is_support, so the boundary is taken as fixed")
    lines = tuple((one, guide == number) for number, one in enumerate(whole.guides))
    planes = tuple(zip(whole.planes, on_planes, strict=True))
    about: dict[str, Any] = {"plane": whole.plane, "lines": lines, "planes": planes, "rooms": whole.rooms}
    about["cables"] = mesh_arrays.read_cables(named, places, whole.cables)
    data = MeshData(X, F, patch, patches, support if marked else None, **about)
    surface, notes = to_surface(data), (*notes, *import_warnings(data))
    of_key = {key: k for of_mesh in places.values() for key, k in of_mesh.items()}
    try:
        drawn = [(curve, [of_key[key] for key in curve.vertices.tolist()]) for curve in whole.curves]
        curves = [replace(curve, vertices=np.array(own)) for curve, own in drawn]
        return surface.rebuilt(curves=curves), notes
    except (KeyError, SurfaceError):
        lost = "the curves that held vertices were drawn on do not fit these meshes any more"
        return surface, (*notes, f"{lost} and were left out")


def _vertex_attributes(surface: Surface) -> list[dict[str, Any]]:
    """A row per vertex: coordinates, support, curvature and reaction."""
    support, acting = support_of(surface, planes=True), Forces.of(surface)
    guide = np.full(surface.n, None)
    for number, (_, along) in enumerate(surface.given_supports.on_line):
        guide[along] = number
    on_planes = np.array([mask for _, mask in surface.on_planes]).reshape(-1, surface.n)
    curvature = mean_curvature(acting.standing, "variational")
    columns: dict[str, list[Any]] = {
        **dict(zip("xyz", surface.vertices.T.tolist(), strict=True)),
        "is_support": (support == FIXED).tolist(),
        SLIDES: (support == SLIDING).tolist(),
        GUIDE: guide.tolist(),
        PLANES: [np.flatnonzero(column).tolist() for column in on_planes.T],
        "mean_curvature": plain(curvature),  # JSON has no NaN
        **dict(zip(("rx", "ry", "rz"), acting.reactions.T.tolist(), strict=True)),
    }
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def solve(
    meshes: Any, tensions: Values = None, pressures: Values = None, weld: bool = False, **options: Any
) -> dict[str, Any]:
    """Solve the surface of COMPAS meshes.

    Options are those of ``pcmc.solve``, over RPC plain data. The answer has the ``meshes`` reached,
    ``converged``, ``status`` (the name of the Status), ``message``, ``energy``, ``iterations``,
    ``certificate`` as ``certify`` returns it, and ``warnings``, sentences.

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.1]]
    >>> tent = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> answer = solve(to_meshes(tent))
    >>> round(answer["meshes"][0].vertex_attribute(4, "z"), 6), answer["certificate"]["verdict"]
    (0.353553, 'stable')
    """
    with warnings.catch_warnings(record=True, action="always") as caught:
        start = from_meshes(meshes, tensions=tensions, pressures=pressures, weld=weld)
        result = pcmc.solve(start, **options)
        return {
            "meshes": to_meshes(result.surface),
            "converged": result.converged,
            "status": result.status.name.lower(),
            "message": result.message,
            "energy": result.energy,
            "iterations": result.iterations,
            "certificate": _plain_certificate(result.certificate),
            "warnings": [str(one.message) for one in caught],
        }


def certify(
    meshes: Any, tensions: Values = None, pressures: Values = None, weld: bool = False, **options: Any
) -> dict[str, Any]:
    """The certificate of the surface of COMPAS meshes, as plain data.

    Options are those of ``pcmc.certify``. The answer has ``certified``, ``verdict``, ``detail``, the numbers
    of ``Certificate.numbers``, its tables ``patches``, ``junctions``, ``boundaries`` and ``supports`` as
    lists of rows, and ``warnings``. None stands for NaN.

    >>> square = pcmc.Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0]],
    ...                       [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                       [pcmc.Patch("film", 2.0, pressure=0.0)], fixed=range(4))
    >>> answer = certify(to_meshes(square))
    >>> answer["certified"], answer["verdict"]
    (True, 'stable')
    """
    with warnings.catch_warnings(record=True, action="always") as caught:
        surface = from_meshes(meshes, tensions=tensions, pressures=pressures, weld=weld)
        values = _plain_certificate(pcmc.certify(surface, **options))
    return {**values, "warnings": [str(one.message) for one in caught]}


def read(path: PathLike, **options: Any) -> list[Any]:
    """The meshes of the surface in a file that pcmc reads; options as in ``pcmc.read``.

    >>> import tempfile
    >>> film = pcmc.Surface(
    ...     [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [pcmc.Patch("film", 2.0)], fixed=range(3)
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write(folder + "/film.pcmc", to_meshes(film))
    ...     [mesh.name for mesh in read(folder + "/film.pcmc")]
    ['film']
    """
    return to_meshes(pcmc.read(path, **options))


def write(path: PathLike, meshes: Any, weld: bool = False, **options: Any) -> None:
    """Write the surface of COMPAS meshes to a file, as its suffix says; options as in ``pcmc.write``.

    >>> import tempfile
    >>> film = pcmc.Surface(
    ...     [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [pcmc.Patch("film", 2.0)], fixed=range(3)
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write(folder + "/film.obj", to_meshes(film))
    ...     pcmc.read(folder + "/film.obj").patches[0].tension
    2.0
    """
    pcmc.write(path, from_meshes(meshes, weld=weld), **options)


def _plain_certificate(found: pcmc.Certificate) -> dict[str, Any]:
    told = ("certified", "detail", "patches", "junctions", "boundaries", "supports")
    return dict(plain({**found.numbers(), **{name: getattr(found, name) for name in told}}))
