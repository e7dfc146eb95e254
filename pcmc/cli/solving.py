"""The commands solve, certify and remesh. Each returns the exit code."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from .. import project as projects
from ..accuracy import check_mesh
from ..accuracy.adaptive import TRIANGLES
from ..base import validate
from ..io import write
from ..meshing.remeshing import remesh, size_note
from . import NOT_CERTIFIED, OK, arguments, checking
from .arguments import (
    MANY_FILES,
    Cables,
    Cache,
    FileUnits,
    Input,
    Loads,
    Pressures,
    Settings,
    Snows,
    Start,
    Volumes,
    Weights,
    Whole,
    number,
    option,
)
from .checking import CHECKED
from .progress import working
from .reports import report

MESHES = "Check the mesh on this many meshes in all, 3 for error bars and orders."
ACCURACY = (
    "Error bar wanted, such as height=1e-3: finer triangles where the error comes from; may be repeated."
)
ACCURACY_OF = "mesh: the value on the mesh is to be so accurate; limit: the extrapolated one."
MOST_TRIANGLES = f"The most that the mesh for an accuracy may have, {TRIANGLES} by default."
WHOLE_INDEX = "Of a surface with mirror planes certify the whole: motions that are not symmetric count, too."
RISE = "Find the tension with which the whole roof rises so much over its outline."
APEX = "The same, over the plane."
SPAN_RATIO = "The same: the span of the plan, the diameter of the largest circle in it, over the rise."
MARGIN = "How far from the edge: pressure, snow, weight, or such as 'tension of west'; may be repeated."
VERIFY = "Prove that an exact equilibrium of the mesh is near, and its Morse index; print the theorem."
CHORD = "Largest distance to the smooth surface; triangles are smaller where it curves more."


def solve_(
    file: Input,
    output: Annotated[list[Path] | None, MANY_FILES] = None,
    picture: Annotated[Path | None, option("PNG", "Picture to draw.")] = None,
    method: Annotated[str | None, option("NAME", "newton, nesterov or lbfgs.")] = None,
    target: Annotated[
        str | None, option("NAME", "minimum, or stationary to accept saddles too (newton only).")
    ] = None,
    tension: Settings = None,
    pressure: Pressures = None,
    weight: Weights = None,
    snow: Snows = None,
    cable: Cables = None,
    volume: Volumes = None,
    rise: Annotated[float | None, option("LENGTH", RISE, parser=number)] = None,
    apex: Annotated[float | None, option("LENGTH", APEX, parser=number)] = None,
    span_ratio: Annotated[float | None, option("NUMBER", SPAN_RATIO, "--span-ratio", parser=number)] = None,
    folder: Annotated[Path | None, option("FOLDER", "Folder for a project's output.")] = None,
    anyway: Annotated[bool, typer.Option("--anyway", help="Write the output even if not certified.")] = False,
    accuracy: Annotated[list[str] | None, option("QUANTITY=NUMBER", ACCURACY, "--accuracy")] = None,
    accuracy_of: Annotated[str | None, option("NAME", ACCURACY_OF, "--accuracy-of")] = None,
    most_triangles: Annotated[int | None, option("NUMBER", MOST_TRIANGLES, parser=arguments.integer)] = None,
    mesh_check: Annotated[bool | None, typer.Option("--mesh-check/--no-mesh-check", help=CHECKED)] = None,
    verify: Annotated[bool, typer.Option("--verify", help=VERIFY)] = False,
    cache: Cache = True,
    whole: Whole = False,
    units: FileUnits = "",
) -> int:
    """Solve a surface or a project, certify it, write all files, or none; then check its mesh.

    The mesh check solves the surface on two finer meshes and prints error bars. Ctrl-C ends it; the files
    are written before.

    \b
    Examples:
      pcmc solve roof.toml
      pcmc solve hall.dxf --rise 2 -o hall.3dm
      pcmc solve roof.toml --accuracy height=1e-3
      pcmc solve sail.toml --cable "cable 1=12"
      pcmc solve mesh.obj --tension 4 --tension wall=1.5 -o roof.3dm
    """
    project = _project(file, folder, output, picture, units)
    project = projects.with_rise(project, {"rise": rise, "apex": apex, "span_ratio": span_ratio})
    options = dict(project.options) if method in (None, project.method) else {}
    if target is not None:
        options["target"] = target
    given: dict[str, Any] = {"accuracy_of": accuracy_of, "most_triangles": most_triangles}
    given["accuracy"] = ", ".join(accuracy) if accuracy else None
    goal = replace(project.wanted, **{name: value for name, value in given.items() if value is not None})
    wanted = project.mesh_check if mesh_check is None else mesh_check
    project = replace(project, method=method or project.method, options=options, wanted=goal)
    verify = verify or project.verify
    written = replace(project.output, whole=whole or project.output.whole)
    project = replace(project, mesh_check=wanted, verify=verify, output=written)
    if projects.is_drawing(file) and project.drawing is not None:
        print(projects.proposal_text(project))
    with working() as say:
        loads = Loads(tension, pressure, weight, cable, volume, snow)
        changed = loads.of if loads else None
        how: dict[str, Any] = {"anyway": anyway, "use_cache": cache, "check_after": False}
        outcome = projects.run_project(project, say, changed=changed, **how)
    report(outcome)
    if verify and outcome.certificate.tried == () == outcome.certificate.proofs:
        print(outcome.theorem.text(outcome.units))
    if project.output.paths and not outcome.files:
        print("nothing written (use --anyway to write it)")
    if check := checking.mesh_check(outcome):
        print(f"\n{check.brief(outcome.units)}")
    checking.margins(outcome)
    return OK if outcome.good else NOT_CERTIFIED


def _project(
    file: Path, folder: Path | None, output: list[Path] | None, picture: Path | None, units: str
) -> projects.Project:
    """The project, with the output files of the command line if there are any."""
    arguments.check_input(file)
    project = projects.load(file, units=units).in_folder(file.parent if folder is None else folder)
    own = project.output
    written = replace(own, files=output or own.files, picture=picture or own.picture)
    return replace(project, output=written)


def certify_(
    file: Input,
    tension: Settings = None,
    pressure: Pressures = None,
    weight: Weights = None,
    snow: Snows = None,
    cable: Cables = None,
    volume: Volumes = None,
    meshes: Annotated[int | None, option("NUMBER", MESHES, parser=arguments.integer)] = None,
    margin: Annotated[list[str] | None, option("WHAT", MARGIN, "--margin")] = None,
    start: Start = False,
    cache: Cache = True,
    whole: Annotated[bool, typer.Option("--whole", help=WHOLE_INDEX)] = False,
    verify: Annotated[bool, typer.Option("--verify", help=VERIFY)] = False,
) -> int:
    """Check a surface, or a project's roof: residual forces, curvature errors, stability, reactions.

    \b
    Examples:
      pcmc certify roof.pcmc
      pcmc certify roof.toml
      pcmc certify roof.pcmc --meshes 3
      pcmc certify roof.toml --margin pressure --margin "tension of west"
      pcmc certify roof.pcmc --verify
    """
    if meshes is not None:
        validate.integer("--meshes", meshes, least=2)
    with working() as say:
        loads = Loads(tension, pressure, weight, cable, volume, snow)
        roof = arguments.opened(file, say, loads, start=start, use_cache=cache)
        if whole:
            roof = roof.unfolded()
        say("certifying")
        surface, certificate = roof.shown
    if roof.result is not None:
        report(roof, verdict=False)
    print(certificate.text(roof.units))
    checking.margins(roof, margin or ())
    if verify or (roof.project is not None and roof.project.verify):
        print(roof.theorem.text(roof.units))
    if meshes is not None and certificate.index is not None:
        sys.stdout.flush()
        with working() as say:
            say("checking the mesh")
            check = check_mesh(surface, meshes)
        print(f"\n{check.text(roof.units)}")
    return OK if roof.good else NOT_CERTIFIED


def remesh_(
    file: Input,
    edge_length: Annotated[float, option("LENGTH", "Edge length of the triangles.", parser=number)],
    output: Annotated[list[Path], MANY_FILES],
    near_curves: Annotated[
        float | None, option("LENGTH", "Edge length at junctions and boundaries.", parser=number)
    ] = None,
    chord: Annotated[float | None, option("LENGTH", CHORD, parser=number)] = None,
    units: FileUnits = "",
    solved: Annotated[
        bool, typer.Option("--solve/--no-solve", help="Solve and certify the new mesh.")
    ] = True,
) -> int:
    """Remesh a surface to an edge length, then solve and certify it. Patches and supports stay.

    \b
    Example:
      pcmc remesh roof.pcmc --edge-length 0.25 -o fine.pcmc
    """
    stage = projects.Remeshing(edge_length, near_curves, chord=chord, when="before")
    projects.check_names(output)
    projects.check_outputs(output, inputs=projects.files_of(file))
    if not solved:
        with working() as say:
            say("remeshing")
            roof = arguments.opened(file, say, start=True, units=units)
            surface = remesh(roof.surface, **stage.options)
            writing = partial(write, surface=surface, units=roof.units)
            projects.write_all([(path, writing) for path in output], say)
        if note := size_note(surface, edge_length):
            print(note)
        print(f"{surface.m} triangles, not solved; written: {', '.join(map(str, output))}")
        return OK
    project = _project(file, None, output, None, units)
    project = replace(project, remeshing=(stage,), output=projects.Output(files=project.output.files))
    with working() as say:
        outcome = projects.run_project(project, say)
    report(outcome)
    if outcome.files:
        return OK
    print("nothing written (use --no-solve to write the new mesh)")
    return NOT_CERTIFIED
