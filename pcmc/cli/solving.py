"""The commands solve, certify and remesh. Each returns the exit code."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from .. import project as projects
from ..accuracy import check_mesh
from ..accuracy.adaptive import TRIANGLES
from ..base import validate
from ..project.file import with_rise
from ..project.planning import proposal_text
from ..project.writing import surface_files, write_all
from . import NOT_CERTIFIED, OK, reports
from .arguments import (
    MANY_FILES,
    UNCERTIFIED,
    Cache,
    FileUnits,
    Input,
    Loads,
    MeshCheck,
    Shown,
    Whole,
    count,
    flag,
    load,
    option,
    output_of,
    real,
)
from .progress import working

TARGET = "minimum, or stationary to accept saddles too (newton only)."
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
CHORD = "Largest distance to the smooth surface; triangles are smaller where it curves more."
VERIFY = "Prove that an exact equilibrium of the mesh is near, and its Morse index; print the theorem."
Verify = Annotated[bool, flag("--verify", VERIFY)]


def solve_(
    *,
    file: Input,
    output: Annotated[list[Path] | None, MANY_FILES] = None,
    picture: Annotated[Path | None, option("PNG", "Picture to draw.")] = None,
    method: Annotated[str | None, option("NAME", "newton, nesterov or lbfgs.")] = None,
    target: Annotated[str | None, option("NAME", TARGET)] = None,
    loads: Loads,
    rise: Annotated[float | None, real("LENGTH", RISE)] = None,
    apex: Annotated[float | None, real("LENGTH", APEX)] = None,
    span_ratio: Annotated[float | None, real("NUMBER", SPAN_RATIO)] = None,
    folder: Annotated[Path | None, option("FOLDER", "Folder for a project's output.")] = None,
    allow_uncertified: Annotated[bool, flag("--allow-uncertified", UNCERTIFIED)] = False,
    accuracy: Annotated[list[str] | None, option("QUANTITY=NUMBER", ACCURACY)] = None,
    accuracy_of: Annotated[str | None, option("NAME", ACCURACY_OF)] = None,
    most_triangles: Annotated[int | None, count(MOST_TRIANGLES)] = None,
    mesh_check: MeshCheck = None,
    verify: Verify = False,
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
    project = load(file, units).in_folder(file.parent if folder is None else folder)
    own = project.output
    own = replace(own, files=output or own.files, picture=picture or own.picture, whole=whole or own.whole)
    project = with_rise(project, {"rise": rise, "apex": apex, "span_ratio": span_ratio})
    options = dict(project.options) if method in (None, project.method) else {}
    if target is not None:
        options["target"] = target
    given: dict[str, Any] = {"accuracy_of": accuracy_of, "most_triangles": most_triangles}
    given["accuracy"] = ", ".join(accuracy) if accuracy else None
    project = replace(
        project,
        method=method or project.method,
        options=options,
        wanted=replace(project.wanted, **{name: value for name, value in given.items() if value is not None}),
        mesh_check=project.mesh_check if mesh_check is None else mesh_check,
        verify=verify or project.verify,
        output=own,
    )
    if project.specified and not project.has_file:  # a drawing alone
        print(proposal_text(project))
    with working() as progress:
        how: dict[str, Any] = {"anyway": allow_uncertified, "use_cache": cache, "check_after": False}
        outcome = projects.run_project(project, progress, changed=loads.change, **how)
    reports.report(outcome)
    if project.verify and outcome.certificate.tried == () == outcome.certificate.proofs:
        print(outcome.theorem.text(outcome.units))
    if project.output.paths and not outcome.files:
        print("nothing written (use --allow-uncertified to write it)")
    reports.mesh_check(outcome, brief=True)
    reports.margins(outcome)
    return OK if outcome.good else NOT_CERTIFIED


def certify_(
    *,
    file: Input,
    what: Shown,
    meshes: Annotated[int | None, count(MESHES)] = None,
    margin: Annotated[list[str] | None, option("WHAT", MARGIN)] = None,
    whole: Annotated[bool, flag("--whole", WHOLE_INDEX)] = False,
    verify: Verify = False,
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
    with working() as progress:
        roof = what.roof(load(file), progress, whole)
        progress("certifying")
        surface, certificate = roof.shown
    if roof.result is not None:
        reports.report(roof, verdict=False)
    print(certificate.text(roof.units))
    reports.margins(roof, margin or ())
    if verify or (roof.project is not None and roof.project.verify):
        print(roof.theorem.text(roof.units))
    if meshes is not None and certificate.index is not None:
        sys.stdout.flush()
        with working() as progress:
            progress("checking the mesh")
            check = check_mesh(surface, meshes)
        print(f"\n{check.text(roof.units)}")
    return OK if roof.good else NOT_CERTIFIED


def remesh_(
    *,
    file: Input,
    edge_length: Annotated[float, real("LENGTH", "Edge length of the triangles.")],
    output: Annotated[list[Path], MANY_FILES],
    near_curves: Annotated[float | None, real("LENGTH", "Edge length at junctions and boundaries.")] = None,
    chord: Annotated[float | None, real("LENGTH", CHORD)] = None,
    units: FileUnits = "",
    solve: Annotated[bool, flag("--solve/--no-solve", "Solve and certify the new mesh.")] = True,
) -> int:
    """Remesh a surface to an edge length, then solve and certify it. Patches and supports stay.

    \b
    Example:
      pcmc remesh roof.pcmc --edge-length 0.25 -o fine.pcmc
    """
    stage = projects.Remeshing(edge_length, near_curves, chord=chord, when="before")
    written = output_of(file, files=output)
    with working() as progress:
        project = replace(load(file, units), output=written)
        if solve:
            project = replace(project, folder=file.parent, remeshing=(stage,))
            outcome = projects.run_project(project, progress)
        else:
            progress("remeshing")
            roof = projects.start_of(project)
            surface, note = stage.remeshed(roof.surface)
            write_all(surface_files(roof.changed(lambda _: surface), output), progress)
    if not solve:
        if note:
            print(note)
        print(f"{surface.m} triangles, not solved; written: {', '.join(map(str, output))}")
        return OK
    reports.report(outcome)
    if not outcome.files:
        print("nothing written (use --no-solve to write the new mesh)")
    return OK if outcome.files else NOT_CERTIFIED
