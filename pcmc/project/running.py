"""Running a project: mesh, solve, remesh, meet targets, certify, write."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import cKDTree

from .. import io, solvers
from ..base.arrays import Ints
from ..base.errors import BalanceWarning, FileError, OptionError, PcmcError
from ..base.files import folder as made
from ..certificate.balance import unbalanced
from ..certificate.certificate import certify
from ..contact.pinching import standing_part
from ..existence import solve
from ..meshing.remeshing import remesh, size_note
from ..solvers.result import Progress, Result, Status
from ..surface import Surface, mirrored
from . import cache
from .advice import advice, chosen_values
from .aims import aims_below_supports
from .documents import document_works
from .file import Project, in_file, load, start_of
from .outcome import Outcome, Whole
from .output import (
    OnStep,
    PathLike,
    Works,
    check_names,
    check_outputs,
    fields,
    ignore,
    metres_note,
    paint,
    write_all,
)

if TYPE_CHECKING:
    from ..accuracy import MeshCheck
    from ..design import Design, Target


MOST_CHECKED = 20_000  # triangles up to which the mesh is checked by default
SAME = 1e-9  # of the size: a vertex this near to a corner of the plan is that corner


def run(
    path: PathLike, out_dir: PathLike | None = None, progress: OnStep | None = None, *, anyway: bool = False
) -> Outcome:
    """Mesh, solve, meet the targets, certify, and write all output of a project.

    Parameters
    ----------
    path : the project file.
    out_dir : folder for the output, made if it is missing; by default that of the project file.
    progress : called with a few words at each step.
    anyway : write the output even if the surface is not certified or misses a target.

    Returns
    -------
    Outcome
        Nothing is written, and ``files`` is empty, if the surface is not certified or misses a target.

    Raises
    ------
    FileError, PlanError, OptionError
        The message is one line and names the file. Nothing is written.

    Warns
    -----
    BalanceWarning
        Before solving, if the tensions at a junction cannot balance.
    """
    project = load(path)
    project = project.in_folder(project.path.parent if out_dir is None else out_dir)
    return run_project(project, progress, anyway=anyway)


def run_project(
    project: Project,
    progress: OnStep | None = None,
    *,
    changed: Callable[[Surface], Surface] | None = None,
    anyway: bool = False,
    use_cache: bool = True,
) -> Outcome:
    """As ``run``, for a loaded project; ``changed`` is applied to its initial surface.

    The mesh check comes after the files are written, so that Ctrl-C during it leaves them. Where a report is
    among them, it comes before, unless ``mesh_check`` is false or the mesh is large. A good roof is kept in
    the cache, unless it was changed or ``use_cache`` is false; it is solved in any case.
    """
    outcome = _solve_and_write(project, progress or ignore, changed, anyway)
    if use_cache and changed is None:
        cache.keep(project, outcome)
    if project.mesh_check and outcome.mesh_check is None and outcome.certificate.index is not None:
        outcome = replace(outcome, mesh_check=check_of(project, outcome, progress))
    return outcome


def check_of(project: Project, outcome: Outcome, progress: OnStep | None = None) -> MeshCheck:
    """The mesh check of an outcome: that of its accuracy, where its surface is the same."""
    accurate = outcome.accurate
    if accurate is not None and accurate.check is not None and accurate.surface is outcome.surface:
        return accurate.check
    return check_project_mesh(project, outcome.result, progress)


def check_project_mesh(project: Project, result: Result, progress: OnStep | None = None) -> MeshCheck:
    """``pcmc.check_mesh`` of a project's result; the corners of its plan stay corners."""
    from ..accuracy import check_mesh  # takes long to import

    report, corners = progress or ignore, _plan_corners(project, result.surface)

    def callback(state: Progress) -> None:
        report(f"mesh check: {state.surface().m} triangles, step {state.iteration}")

    return check_mesh(result, corners=corners, callback=callback)


def _plan_corners(project: Project, surface: Surface) -> Ints:
    """(k,) the vertices of a surface at the corners of the project's plan."""
    if project.plan is None or not len(project.plan.corners):
        return np.empty(0, dtype=np.int64)
    away, nearest = cKDTree(surface.vertices).query(project.plan.corners)
    return np.asarray(nearest)[np.asarray(away) <= SAME * surface.size]


def _solve_and_write(
    project: Project, report: OnStep, changed: Callable[[Surface], Surface] | None, anyway: bool
) -> Outcome:
    """The outcome of a project, its output written."""
    outputs = project.outputs
    check_names(project.files, project.picture)
    _keep_drawing(project, outputs)
    check_outputs(outputs, project.folder)
    outcome = solve_from_start(project, report, changed)
    if project.whole:
        report("certifying the whole")
        whole = mirrored(outcome.surface)
        outcome = replace(outcome, whole=Whole(whole, certify(whole)))
    if not outputs or not (outcome.good or anyway):
        return outcome
    if project.documents.report is not None:
        outcome = replace(outcome, mesh_check=_reported_check(project, outcome, report))
    works = surface_files(outcome, project.files)
    if project.picture is not None:
        painting = partial(paint, views=project.views, colour=project.colour, units=outcome.units)
        works.append((Path(project.picture), partial(painting, outcome.shown.surface)))
    works += _documents(project, outcome, anyway, report)
    with made(project.folder or Path()):
        return replace(outcome, files=write_all(works, report))


def _reported_check(project: Project, outcome: Outcome, report: OnStep) -> MeshCheck | None:
    """The mesh check for a report: where it is asked for, or left open and the mesh is small enough."""
    small = outcome.shown.surface.m <= MOST_CHECKED
    wanted = small if project.mesh_check is None else project.mesh_check
    if not wanted or outcome.certificate.index is None:
        return None
    from ..accuracy import check_mesh

    try:
        if outcome.whole is None:
            return check_of(project, outcome, report)
        report("mesh check")
        return check_mesh(outcome.whole.surface)
    except PcmcError:
        if project.mesh_check:
            raise
        return None  # the report is good without it


def _keep_drawing(project: Project, outputs: Iterable[Path]) -> None:
    """Refuse to write over the drawing that the roof is made from."""
    for path in outputs:
        if project.drawing is not None and path.resolve() == project.drawing.path.resolve():
            text = f"{path}: this is the drawing of the plan; name another file for the roof"
            raise FileError(text, what=str(path))


def _documents(project: Project, outcome: Outcome, anyway: bool, report: OnStep) -> Works:
    """The project's documents, each with the function that writes it."""
    if not project.documents.names:
        return []
    report("drawing, sorting panels, modelling")
    files = {project.path.name: "project"}
    if project.drawing is not None:
        files[project.drawing.path.name] = "drawing of the plan"
    files |= {Path(file).name: "surface" for file in project.files}
    if project.picture is not None:
        files[Path(project.picture).name] = "picture"
    name = project.path.stem
    with in_file(project.path):
        return document_works(project.documents, project.structure, outcome, name, files, anyway)


def surface_files(outcome: Outcome, files: Iterable[PathLike], colour: str = "") -> Works:
    """The files of a designed roof with all that their formats hold, for ``write_all``.

    ``colour`` names the scalar that colours vertices.
    """
    surface, certificate = outcome.shown
    data: dict[str, Any] = {
        "scalars": fields(surface, certificate),
        "certificate": certificate,
        "units": outcome.units,
        "colour": colour,
    }
    return [(Path(file), partial(io.write, surface=surface, **data)) for file in files]


def solve_from_start(
    project: Project, report: OnStep, changed: Callable[[Surface], Surface] | None
) -> Outcome:
    """Mesh a project, solve it, remesh it and meet its targets; write nothing."""
    report("reading" if project.plan is None else "meshing the plan")
    start, units = start_of(project)
    given, start = start, start if changed is None else changed(start)
    if project.documents.structure is not None and project.structure is not None:
        with in_file(project.path):
            project.structure.check(start)
    if project.whole and not any(plane.mirror for plane, _ in start.on_planes):
        text = f"{project.path}: the roof has no mirror planes, so it is the whole already; leave out whole"
        raise OptionError(f"{text}, or give the plan mirrors", what="whole")
    _check_balance(start)
    outcome = replace(solve_project(project, start, report), units=units)
    notes = (*chosen_values(project, start), *outcome.notes)
    if project.drawing is not None:
        notes += tuple(metres_note(project.files, units.length))
    if outcome.good:
        return replace(outcome, notes=notes)
    notes += tuple(aims_below_supports(project.plan, start, project.targets, units))
    report("looking for advice")
    return replace(outcome, notes=notes, advice=advice(project, given, start, outcome, solve_project))


def _check_balance(surface: Surface) -> None:
    """Warn before a long computation if the tensions alone show that a junction cannot balance.

    The advice after it names a remedy that was tried.
    """
    pinchable = standing_part(surface).walls.pinchable
    imbalance = unbalanced(surface, pinchable)
    if imbalance:
        unless = ", unless the junction rests on the plane" if pinchable.any() else ""
        warnings.warn(f"{imbalance.imbalance}{unless}; solving anyway", BalanceWarning, stacklevel=4)


def solve_project(project: Project, surface: Surface, progress: OnStep | None = None) -> Outcome:
    """Solve a surface with the project's options, remesh it, meet its targets; write nothing.

    A surface that is not certified, or misses a target, is not remeshed. The accuracy comes last; targets
    are met once more on its mesh.
    """
    report, notes = progress or ignore, list[str]()
    with in_file(project.path):
        for stage in project.remeshing:
            if stage.when == "before":
                report("remeshing")
                surface = remesh(surface, **stage.options)
                notes.append(size_note(surface, stage.edge_length))
        after = [stage for stage in project.remeshing if stage.when == "after"]
        if project.wanted.accuracy and not after and not project.targets:
            return _solve_to_accuracy(project, surface, report)
        outcome = _solve_or_meet(project, surface, report)
        outcome = replace(outcome, notes=(*filter(None, notes), *outcome.notes))
        for stage in after:
            if outcome.good:
                report("remeshing")
                before, surface = outcome, remesh(outcome.surface, **stage.options)
                note = size_note(surface, stage.edge_length)
                outcome = _again(project, surface, report)
                notes = [*before.notes, note, *outcome.notes, *_met_before(project.targets, before, outcome)]
                outcome = replace(outcome, notes=tuple(filter(None, notes)))
        if project.wanted.accuracy and outcome.good:
            accurate = _solve_to_accuracy(project, outcome.surface, report)
            if not (project.targets and accurate.good):
                return replace(accurate, design=outcome.design)
            outcome = replace(_again(project, accurate.surface, report), accurate=accurate.accurate)
    return outcome


def _again(project: Project, surface: Surface, report: OnStep) -> Outcome:
    """Solve the surface on another mesh, and meet the targets there."""
    outcome = _solve_or_meet(replace(project, targets=()), surface, report)
    if project.targets and outcome.good:  # otherwise its verdict is the better explanation
        outcome = _solve_or_meet(project, outcome.surface, report)
    return outcome


def _met_before(targets: Sequence[Target], before: Outcome, after: Outcome) -> list[str]:
    """That the targets were met on the mesh before, with which parameters, and what the finer one reaches."""
    if before.design is None:
        return []
    values = ", ".join(f"{label} {value:.6g}" for label, value in before.design.parameters["value"].items())
    met = f"targets met on the first mesh, {before.surface.m} triangles, with {values}"
    where = f"on the new one, {after.surface.m} triangles"
    if after.design is not None:
        return [met if after.good else f"{met}; {where}, {after.design.status.value}"]
    from ..design.targets import measure  # needed by projects with targets only

    reached = ", ".join(f"{target.label} {measure(after.surface, target).value:.6g}" for target in targets)
    return [f"{met}; {where}, the surface does not come to rest with them; it has {reached}"]


def _solve_to_accuracy(project: Project, surface: Surface, report: OnStep) -> Outcome:
    """Solve on finer and finer meshes, and certify."""
    from ..accuracy import AccuracyStatus, solve_to_accuracy

    def callback(row: Mapping[str, Any]) -> None:
        report(f"accuracy: {row['triangles']} triangles, error {row['excess']:.2g} of the accuracy wanted")

    _newton_alone(project, "reach an accuracy")
    report("solving to the accuracy")
    accurate = solve_to_accuracy(
        surface,
        corners=_plan_corners(project, surface),
        callback=callback,
        **vars(project.wanted),
        **project.options,
    )
    if accurate.status is AccuracyStatus.STOPPED:  # by Ctrl-C, which ends the command
        raise KeyboardInterrupt
    accurate.result.certificate  # noqa: B018 — computed here, while the progress is shown
    return Outcome(accurate.result, (), accurate=accurate)


def _newton_alone(project: Project, act: str) -> None:
    if project.method != "newton":
        message = f"only method 'newton' can {act}, found {project.method!r}"
        raise OptionError(message, what="solve.method", found=project.method, expected="newton")


def _solve_or_meet(project: Project, surface: Surface, report: OnStep) -> Outcome:
    """Solve the surface, or meet its targets, and certify it.

    Where the search for the targets finds no equilibrium to start from, the surface is solved without them:
    from a roof that is certified the search starts again, any other says why there is none.
    """
    if not project.targets:
        return _certified(_solve(project, surface, report), None, report)
    from ..design import NoStart  # needed by projects with targets only

    try:
        design = _meet(project, surface, report)
    except NoStart:
        outcome = _certified(_solve(project, surface, report), None, report)
        if not outcome.good:
            return replace(
                outcome, notes=("targets not tried: without them there is no stable roof, either",)
            )
        design = _meet(project, outcome.surface, report)
    return _certified(design.result, design, report)


def _solve(project: Project, surface: Surface, report: OnStep) -> Result:
    solver = solve if project.search else solvers.solve
    result = solver(surface, project.method, reporter(report), **project.options)
    if result.status is Status.STOPPED:  # by Ctrl-C, which ends the command
        raise KeyboardInterrupt
    return result


def _certified(result: Result, design: Design | None, report: OnStep) -> Outcome:
    report("certifying")
    result.certificate  # noqa: B018 — computed here, while the progress is shown
    return Outcome(result, (), design)


def reporter(report: OnStep) -> Callable[[Progress], None]:
    """A solver's callback that reports its step and the forces left."""

    def callback(state: Progress) -> None:
        force = state.row.get("residual", state.row["gradient_squared"])
        report(f"solving: step {state.iteration}, forces left {force:.1e}")

    return callback


def _meet(project: Project, surface: Surface, report: OnStep) -> Design:
    from ..design import DesignStatus, meet  # needed by projects with targets only

    _newton_alone(project, "meet targets")
    solves = count(1)

    def callback(row: object) -> None:
        report(f"meeting the targets: solve {next(solves)}")

    options = dict(project.options) | ({} if project.misfit is None else {"tolerance": project.misfit})
    design = meet(surface, project.targets, project.vary, callback=callback, **options)
    if design.status is DesignStatus.STOPPED:  # by Ctrl-C
        raise KeyboardInterrupt
    return design
