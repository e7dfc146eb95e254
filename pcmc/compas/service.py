"""Functions of meshes and plain data; ``pcmc.compas.server`` offers them to other programs."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from typing import Any

import pcmc

from ..base.arrays import plain
from .meshes import from_meshes, to_meshes

Values = Mapping[str, float] | float | None


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
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
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
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        surface = from_meshes(meshes, tensions=tensions, pressures=pressures, weld=weld)
        values = _plain_certificate(pcmc.certify(surface, **options))
    return {**values, "warnings": [str(one.message) for one in caught]}


def read(path: str | os.PathLike[str], **options: Any) -> list[Any]:
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


def write(path: str | os.PathLike[str], meshes: Any, weld: bool = False, **options: Any) -> None:
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
    tables = {name: getattr(found, name) for name in ("patches", "junctions", "boundaries", "supports")}
    values = {"certified": found.certified, **found.numbers(), "detail": found.detail, **tables}
    return {name: plain(value) for name, value in values.items()}
