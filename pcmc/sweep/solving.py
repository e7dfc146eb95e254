"""The case most sweeps want: build a surface, solve it, certify it."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Container, Iterable, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import existence, solvers
from ..base import validate
from ..base.errors import OptionError, PcmcError, unknown
from ..energy.functional import gradient
from ..solvers import find_method
from ..solvers.result import Result
from ..surface import Surface
from .case_script import resolve
from .grid import checked

if TYPE_CHECKING:
    import pandas as pd

    from ..accuracy import MeshCheck
    from ..certificate import Certificate

Parts = tuple[Callable[..., Any], dict[str, Any], dict[str, Any]]


def _split(generator: str, method: str, arguments: Mapping[str, Any]) -> Parts:
    """The generator, and which arguments are its own and which the solver's."""
    try:
        build = resolve(generator)
        own = inspect.signature(build).parameters
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        raise OptionError(
            f"the generator {generator!r} cannot be found ({error}); expected 'generators:two_caps'"
            " or 'package.module:function'",
            what="generator",
            found=generator,
        ) from error
    options = find_method(method).options
    known = [f.name for f in fields(options)]
    for name in arguments:
        if name not in own and name not in known:
            of = f"{generator} or of method {method!r}"
            raise OptionError(unknown(f"parameter of {of}:", name, [*own, *known]), what=name)
    shape = {name: value for name, value in arguments.items() if name in own}
    solver = {name: value for name, value in arguments.items() if name not in own}
    options(**solver)  # refuses bad values
    return build, shape, solver


def _check(
    generator: str, method: str = "newton", mesh_check: bool = False, search: bool = False, **arguments: Any
) -> None:
    validate.flag("mesh_check", mesh_check)
    validate.flag("search", search)
    _split(generator, method, arguments)


@checked(_check)
def solve_case(
    generator: str, method: str = "newton", mesh_check: bool = False, search: bool = False, **arguments: Any
) -> dict[str, Any]:
    """Build a surface with a generator, solve it, certify it; every number of the certificate.

    Parameters
    ----------
    generator : a function that returns a Surface: ``"generators:two_caps"``.
    method : as of ``pcmc.solve``.
    mesh_check : whether to solve each surface at rest on two finer meshes, too (``pcmc.check_mesh``).
    search : whether further starts are tried where the first leads to no equilibrium, as ``pcmc.solve``
        does: slower where there is none, with the proof as ``message``.
    arguments : parameters of the generator and options of the method. A name that both have is the
        generator's.

    Returns
    -------
    dict : ``status`` (the solver's, in small letters), ``verdict`` of the certificate, ``message``;
        ``iterations_taken``, ``evaluations_made``, ``triangles``, ``gradient_squared`` (‖∇E‖², the
        paper's squared sum); the certificate's numbers; and each number of its tables as
        ``large.area``, ``junction 0.length``, ``boundary 0.reaction_z``. A number with the name of
        one of the arguments is called ``name_reached``. With ``mesh_check`` also ``mesh_verdict``,
        ``mesh_detail``, and of the height, volume, energy, reaction and lowest eigenvalue
        ``height_error``, ``height_limit``, ``height_limit_error``, ``height_order`` and so on.

    Raises
    ------
    OptionError : an unknown generator, method or parameter name. A sweep raises it before any case
        is run.

    Examples
    --------
    >>> case = solve_case("generators:two_squares", "lbfgs", alpha_aux=1.0)
    >>> case["status"], round(case["energy"], 4), round(case["left.area"], 3)
    ('converged', 58.5059, 17.583)
    """
    build, shape, solver = _split(generator, method, arguments)
    solve = existence.solve if search else solvers.solve
    result = solve(build(**shape), method, **solver)
    answer = row(result, arguments)
    if mesh_check:
        from ..accuracy import check_mesh  # needs pandas, which takes long to import

        answer |= mesh_columns(result, check_mesh)
    return answer


def row(result: Result, names: Container[str]) -> dict[str, Any]:
    """The answer of a case: see ``solve_case``. ``names`` are the names of its parameters."""
    certificate = result.certificate
    numbers = {
        "iterations_taken": result.iterations,
        "evaluations_made": result.evaluations,
        "triangles": result.surface.m,
        "gradient_squared": float((gradient(result.surface) ** 2).sum()),
        **certificate.numbers(),
        **_cells(certificate.patches, certificate.patches["patch"]),
        **_heights(result.surface, certificate),
        **_cells(certificate.rooms, certificate.rooms.get("room", ())),
        **_cells(certificate.cables, _cable_names(certificate.cables)),
        **_cells(certificate.junctions, [f"junction {i}" for i in certificate.junctions.index]),
        **_cells(certificate.boundaries, [f"boundary {i}" for i in certificate.boundaries.index]),
    }
    words = {
        "status": result.status.name.lower().replace("_", " "),
        "verdict": numbers.pop("verdict").replace("_", " "),
        "message": result.message,
    }
    return words | {f"{n}_reached" if n in names else n: v for n, v in numbers.items()}


def mesh_columns(result: Result, check: Callable[[Result], MeshCheck]) -> dict[str, Any]:
    """What a mesh check adds to the answer of a case; nothing where the surface is not at rest."""
    if result.certificate.index is None:
        return {}
    try:
        return check(result).numbers()
    except PcmcError as error:  # the case itself is good without it
        return {"mesh_verdict": "not checked", "mesh_detail": str(error)}


def _heights(surface: Surface, certificate: Certificate) -> dict[str, float]:
    """The apex of each patch over Π, the rise over the lowest support, the roof's area, and the reactions."""
    height, walls = surface.plane.height(surface.vertices), surface.walls
    apex = np.full(len(surface.patches), -np.inf)
    np.maximum.at(apex, surface.patch_of_face, height[surface.faces].max(axis=1))
    lowest = height[surface.held].min(initial=height.max()) if surface.held.any() else height.min()
    roof = ~walls if not walls.all() else walls
    numbers = {f"{p.name}.apex": float(apex[k]) for k, p in enumerate(surface.patches) if not walls[k]}
    return numbers | {
        "rise": float(apex[roof].max() - lowest),
        "roof_area": float(certificate.patches["area"][roof].sum()),
        "largest_reaction": float(np.nan_to_num(certificate.largest_reaction)),
    }


def _cable_names(cables: pd.DataFrame) -> list[str]:
    """The name of each row: that of its cable, numbered where supports cut the cable into several rows."""
    names = list(cables.get("cable", ()))
    order = [names[:k].count(name) + 1 for k, name in enumerate(names)]
    return [f"{n} {k}" if names.count(n) > 1 else n for n, k in zip(names, order, strict=True)]


def _cells(frame: pd.DataFrame, names: Iterable[str]) -> dict[str, Any]:
    """The numbers of a table, each named by its row and column."""
    numeric = frame.select_dtypes("number")
    rows = zip(names, numeric.to_dict("records"), strict=True)
    return {f"{name}.{column}": value for name, row in rows for column, value in row.items()}
