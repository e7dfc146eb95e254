"""solve, certify, remesh: what ends in a certificate. Each function returns the exit code."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .. import project as projects
from ..certificate.certificate import certify
from ..io import write
from ..meshing.remeshing import remesh
from .arguments import (
    TOML,
    Input,
    Pressures,
    Settings,
    check_input,
    number,
    retensioned,
    surface_in,
)
from .codes import NOT_CERTIFIED, OK, code, names, report
from .progress import working

if TYPE_CHECKING:
    from ..design import Design


def solve_(
    file: Input,
    output: Annotated[
        list[Path] | None,
        typer.Option("-o", "--output", metavar="FILE", help="To write; may be repeated."),
    ] = None,
    picture: Annotated[Path | None, typer.Option(metavar="PNG", help="To draw.")] = None,
    method: Annotated[
        str | None, typer.Option(metavar="NAME", help="newton, nesterov or lbfgs.")
    ] = None,
    target: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="minimum, or stationary for saddles too (newton)."),
    ] = None,
    tension: Settings = None,
    pressure: Pressures = None,
    folder: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Where a project's output goes.")
    ] = None,
    anyway: Annotated[
        bool, typer.Option("--anyway", help="Write the output even if it is not certified.")
    ] = False,
) -> int:
    """Solve a surface or a project, certify it, and write it: all files, or none.

    \b
    Examples:
      pcmc solve roof.toml
      pcmc solve mesh.obj --tension 4 --tension wall=1.5 -o roof.3dm
    """
    project = _project(file, folder, output, picture)
    options = dict(project.options) if method in (None, project.method) else {}
    if target is not None:
        options["target"] = target
    project = replace(project, method=method or project.method, options=options)
    with working() as say:
        outcome = projects.run_project(
            project, say, anyway=anyway,
            changed=partial(retensioned, tension=tension, pressure=pressure),
        )  # fmt: skip
    print(f"{outcome.surface.m} triangles; {outcome.result.message}")
    if outcome.design is not None:
        print(f"targets {outcome.design.message}")
        if outcome.design.met:
            print(_with(outcome.design))
    report(outcome.certificate, list(outcome.files))
    if project.outputs and not outcome.files:
        print("nothing written (--anyway writes it all the same)")
    return OK if outcome.good else NOT_CERTIFIED


def _with(design: Design) -> str:
    """What the search found: the targets' quantities, and the parameters that give them.

    A sentence of ``design.message`` has them where a target is missed.
    """
    found = (f"{label} {value:.6g}" for label, value in design.targets["value"].items())
    values = (f"{label} {value:.6g}" for label, value in design.parameters["value"].items())
    return f"{', '.join(found)}, with {', '.join(values)}"


def _project(
    file: Path, folder: Path | None, output: list[Path] | None, picture: Path | None
) -> projects.Project:
    """The project, with the output asked for in place of its own."""
    check_input(file)
    if file.suffix.lower() != TOML:
        return projects.Project(file, files=output or (), picture=picture, folder=folder)
    project = projects.load(file).in_folder(file.parent if folder is None else folder)
    return replace(
        project, files=output or project.files, picture=picture or project.picture
    )  # fmt: skip


def certify_(file: Input, tension: Settings = None, pressure: Pressures = None) -> int:
    """Say what a surface is: forces left, curvature errors, stability, reactions.

    \b
    Example:
      pcmc certify roof.pcmc
    """
    with working() as say:
        say("certifying")
        found = certify(retensioned(surface_in(file), tension, pressure))
    print(found)
    return code(found)


def remesh_(
    file: Input,
    edge_length: Annotated[
        float, typer.Option(parser=number, metavar="LENGTH", help="Of the triangles.")
    ],
    output: Annotated[
        list[Path],
        typer.Option("-o", "--output", metavar="FILE", help="To write; may be repeated."),
    ],
    near_curves: Annotated[
        float | None,
        typer.Option(
            parser=number, metavar="LENGTH", help="Edge length at junctions and boundaries."
        ),
    ] = None,
    chord: Annotated[
        float | None,
        typer.Option(
            parser=number,
            metavar="LENGTH",
            help="Largest distance to the smooth surface: finer where it curves.",
        ),
    ] = None,
    solved: Annotated[
        bool, typer.Option("--solve/--no-solve", help="Solve and certify the new mesh.")
    ] = True,
) -> int:
    """Remesh a surface to an edge length, keeping patches and supports; solve and certify it again.

    \b
    Example:
      pcmc remesh roof.pcmc --edge-length 0.25 -o fine.pcmc
    """
    stage = projects.Remeshing(edge_length, near_curves, chord=chord, when="before")
    projects.check_names(output)
    projects.check_outputs(output)
    if not solved:
        with working() as say:
            say("remeshing")
            surface = remesh(surface_in(file), **stage.options)
            projects.write_all([(path, partial(write, surface=surface)) for path in output], say)
        print(f"{surface.m} triangles, not solved; written: {names(output)}")
        return OK
    project = replace(_project(file, None, output, None), remeshing=(stage,), picture=None)
    with working() as say:
        outcome = projects.run_project(project, say)
    print(f"{outcome.surface.m} triangles; {outcome.result.message}")
    report(outcome.certificate, list(outcome.files))
    if outcome.files:
        return OK
    print("nothing written (--no-solve writes the new mesh as it is)")
    return NOT_CERTIFIED
