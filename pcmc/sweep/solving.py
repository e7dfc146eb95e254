"""The case most sweeps want: build a surface, solve it, certify it."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Container, Mapping
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base import validate
from ..base.errors import OptionError, unknown
from ..forces.functional import gradient
from ..solvers import find_method, solve, solve_once
from ..solvers.result import Result
from .case_script import resolve
from .grid import checked

if TYPE_CHECKING:
    from ..certificate import Certificate
    from ..project import Outcome


def _found(generator: str) -> tuple[Callable[..., Any], Mapping[str, Any]]:
    """A generator and its parameters."""
    try:
        build = resolve(generator)
        return build, inspect.signature(build).parameters
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        text = f"the generator {generator!r} cannot be found ({error}); expected 'generators:two_caps'"
        text += " or 'package.module:function'"
        raise OptionError(text, what="generator", found=generator) from error


def digest_of(generator: str) -> str:
    """SHA-256, hexadecimal, of the file that a generator is in.

    >>> digest_of("generators:two_caps") == digest_of("generators:two_squares")
    False
    """
    file = inspect.getsourcefile(inspect.unwrap(_found(generator)[0]))
    return hashlib.sha256(Path(file or "").read_bytes()).hexdigest() if file else ""


def _split(
    generator: str, method: str, arguments: Mapping[str, Any]
) -> tuple[Callable[..., Any], dict[str, Any], dict[str, Any]]:
    """The generator, and which arguments are its own and which the solver's."""
    build, own = _found(generator)
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


def _check(generator: str, method: str = "newton", generator_digest: str = "", **arguments: Any) -> None:
    for name in ("mesh_check", "search"):
        validate.flag(name, arguments.pop(name, False))
    _split(generator, method, arguments)


@checked(_check)
def solve_case(
    generator: str,
    method: str = "newton",
    mesh_check: bool = False,
    search: bool = False,
    generator_digest: str = "",
    **arguments: Any,
) -> dict[str, Any]:
    """Build a surface with a generator, solve it, certify it; every number of the certificate.

    Parameters
    ----------
    generator : a function that returns a Surface: ``"generators:two_caps"``.
    method, search : as of ``pcmc.solve``; with a search ``message`` has what was tried, and any proof.
    mesh_check : whether to solve each surface at rest on two finer meshes, too (``pcmc.check_mesh``).
    generator_digest : ``digest_of(generator)``, if any: with it a store belongs to one state of its file.
    arguments : of the generator, and options of the method. A name that both have is the generator's.

    Returns
    -------
    dict : ``status`` (the solver's, in small letters), ``verdict`` of the certificate, ``message``;
        ``iterations_taken``, ``evaluations_made``, ``triangles``, ``gradient_squared`` (‖∇E‖²); the
        certificate's numbers, those of its tables as ``large.area``, ``junction 0.length``,
        ``boundary 0.reaction_z``; of a surface at rest, the key figures: ``large.apex``, and ``rise`` of the
        whole roof. A number with the name of one of the arguments is called ``name_reached``. With
        ``mesh_check`` also ``mesh_verdict``, ``mesh_detail``, ``height_error``, ``height_limit``,
        ``height_limit_error``, ``height_order``, and so on for volume, energy, reaction, lowest eigenvalue.

    Raises
    ------
    OptionError : an unknown generator, method or parameter name; a sweep raises it before any case is run.

    >>> case = solve_case("generators:two_squares", "lbfgs", alpha_aux=1.0)
    >>> case["status"], round(case["energy"], 4), round(case["left.area"], 3)
    ('converged', 58.5059, 17.583)
    """
    build, shape, solver = _split(generator, method, arguments)
    result = (solve if search else solve_once)(build(**shape), method, **solver)
    answer = case_row(result, arguments)
    if mesh_check:
        from ..project import Outcome  # takes long to import

        answer |= mesh_columns(Outcome(result))
    return answer


def case_row(result: Result, names: Container[str], outcome: Outcome | None = None) -> dict[str, Any]:
    """The answer of a case: see ``solve_case``. ``names`` are the names of its parameters.

    With the ``outcome`` of a project it is that of the roof shown, which may be the whole of one between
    mirror planes: see the column ``extent``. Without an equilibrium the row has no numbers of the shape.
    """
    from ..certificate.quantities import figures  # takes long to import

    surface, certificate = result.surface, result.certificate
    counts = {"iterations_taken": result.iterations, "evaluations_made": result.evaluations}
    numbers = counts | {"triangles": surface.m, "gradient_squared": float((gradient(surface) ** 2).sum())}
    words = {"status": result.status.name.lower().replace("_", " ")}
    at_rest = certificate.index is not None
    if at_rest and outcome is not None:
        surface, certificate = outcome.shown
        if outcome.whole is not None or any(plane.mirror for plane, _ in surface.on_planes):
            words["extent"] = "part between mirrors" if outcome.whole is None else "whole"
    findings = certificate.numbers()
    words |= {"verdict": findings.pop("verdict").replace("_", " "), "message": result.message}
    if at_rest or outcome is None:
        findings |= _tables(certificate)
    else:
        findings = {name: findings[name] for name in ("residual", "load_ratio")}
    if at_rest:
        known = figures(surface, certificate) if outcome is None else outcome.figures
        findings |= {".".join(filter(None, (f.of, f.quantity))): f.value for f in known}
    return words | {f"{n}_reached" if n in names else n: v for n, v in (numbers | findings).items()}


def mesh_columns(outcome: Outcome) -> dict[str, Any]:
    """What a mesh check adds to the answer of a case; nothing where the surface is not at rest."""
    if outcome.certificate.index is None:
        return {}
    check = outcome.check_mesh()
    failed = {"mesh_verdict": "not checked", "mesh_detail": outcome.mesh_failure}  # the case itself is good
    return failed if check is None else check.numbers()


def _tables(certificate: Certificate) -> dict[str, Any]:
    """The numbers of the certificate's tables, each named by its row and column; the pressure of a room that
    is named as a patch is "room left.pressure"."""
    cables = list(certificate.cables.get("cable", ()))  # numbered where supports cut one into several rows
    named = [f"{n} {cables[:k].count(n) + 1}" if cables.count(n) > 1 else n for k, n in enumerate(cables)]
    cells: dict[str, Any] = {}
    for kind, frame, names in (
        ("patch", certificate.patches, certificate.patches["patch"]),
        ("room", certificate.rooms, certificate.rooms.get("room", ())),
        ("cable", certificate.cables, named),
        ("", certificate.junctions, [f"junction {i}" for i in certificate.junctions.index]),
        ("", certificate.boundaries, [f"boundary {i}" for i in certificate.boundaries.index]),
    ):
        rows = zip(names, frame.select_dtypes("number").to_dict("records"), strict=True)
        own = {f"{name}.{column}": value for name, row in rows for column, value in row.items()}
        cells |= {f"{kind} {n}" if n in cells else n: value for n, value in own.items()}
    return cells
