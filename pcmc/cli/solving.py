"""The commands that solve: solve, certify, remesh, sweep and equilibria. Each returns the exit code."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from .. import project as projects
from ..accuracy.adaptive import TRIANGLES
from ..accuracy.varied import Varied
from ..base import validate
from ..base.errors import OptionError
from ..base.files import suffix_of
from ..certificate.quantities import dimension_of
from ..equilibria import find_equilibria
from ..io import FORMATS
from ..plot import equilibria as diagram
from ..plot.uses import BRANCH_VALUES
from ..project import Outcome, Project
from ..project.advising import Changed
from ..project.drawn import files_of
from ..project.file import with_rise
from ..project.members import warn_of_members
from ..project.planning import proposal_text
from ..project.settings import check_names
from ..project.writing import certified_files, check_outputs, surface_files, write_all
from ..sweep import Sweep, draw_sweep, run, short_table, solve_case, write_table
from ..sweep.projects import column_labels, project_sweep
from ..sweep.solving import digest_of
from ..sweep.store import FAILED
from ..sweep.tables import GOOD, TABLES, columns_of
from . import INTERRUPTED, NOT_CERTIFIED, OK, arguments, reports
from .arguments import MANY_FILES, READ, Cache, FileUnits, Input, Loads, MeshCheck, Shown, Uncertified, Whole
from .options import amount, count, option, switch
from .reports import sweeping, working

TARGET = "minimum, or stationary to accept saddles too (newton only)."
MESHES = "Check the mesh on this many meshes in all, 3 for error bars and orders."
ACCURACY = "Error bar wanted, such as height=1e-3: finer triangles where the error comes from;"
ACCURACY += " may be repeated."
ACCURACY_OF = "mesh: the value on the mesh is to be so accurate; limit: the extrapolated one."
MOST_TRIANGLES = f"The most that the mesh for an accuracy may have, {TRIANGLES} by default."
WHOLE_INDEX = "Of a surface with mirror planes certify the whole: motions that are not symmetric count, too."
RISE = "Find the tension with which the whole roof rises so much over its outline."
SPAN_RATIO = "The same: the span of the plan, the diameter of the largest circle in it, over the rise."
MARGIN = "How far from the edge: pressure, snow, weight, or such as 'tension of west'; may be repeated."
SWAP = (
    "Swap the neighbours of a film or wall between two junctions, a T1: it opens the other way; 'vanished':"
    " of all that have vanished; may be repeated. Undone where nothing comes to rest."
)
CHORD = "Largest distance to the smooth surface; triangles are smaller where it curves more."
VERIFY = "Prove that an exact equilibrium of the mesh is near, and its Morse index; print the theorem."
Verify = Annotated[bool, switch("--verify", VERIFY)]


def solve_(
    *,
    file: Input,
    output: Annotated[list[Path] | None, MANY_FILES] = None,
    picture: Annotated[Path | None, option("PNG", "Picture to draw.")] = None,
    method: Annotated[str | None, option("NAME", "newton, nesterov or lbfgs.")] = None,
    target: Annotated[str | None, option("NAME", TARGET)] = None,
    loads: Loads,
    swap: Annotated[list[str] | None, option("NAME", SWAP)] = None,
    rise: Annotated[float | None, amount("LENGTH", RISE)] = None,
    apex: Annotated[float | None, amount("LENGTH", "The same, over the plane.")] = None,
    span_ratio: Annotated[float | None, amount("NUMBER", SPAN_RATIO)] = None,
    folder: Annotated[Path | None, option("FOLDER", "Folder for a project's output.")] = None,
    allow_uncertified: Uncertified = False,
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
    project = arguments.load_project(file, units).in_folder(file.parent if folder is None else folder)
    own = project.output
    own = replace(own, files=output or own.files, picture=picture or own.picture, whole=whole or own.whole)
    if folder is not None and not any(path.is_relative_to(folder) for path in own.paths):
        text = f"--folder: {file.name} writes nothing there by itself; name the files, as"
        raise OptionError(f"{text} -o {folder}/roof.obj", what="--folder", found=str(folder))
    project = with_rise(project, {"rise": rise, "apex": apex, "span_ratio": span_ratio})
    project = project.solved_by(method or project.method)
    options = dict(project.options)
    if target is not None:
        options["target"] = target
    given: dict[str, Any] = {"accuracy_of": accuracy_of, "most_triangles": most_triangles}
    given["accuracy"] = ", ".join(accuracy) if accuracy else None
    wanted = replace(project.wanted, **{name: value for name, value in given.items() if value is not None})
    asked: dict[str, Any] = {"options": options, "wanted": wanted, "output": own}
    asked |= {"verify": verify or project.verify, "swap": swap or ()}
    asked["mesh_check"] = project.mesh_check if mesh_check is None else mesh_check
    project = replace(project, **asked)
    if project.specified and not project.has_file:  # a drawing alone
        print(proposal_text(project))
    with working() as progress:
        how: dict[str, Any] = {"anyway": allow_uncertified, "use_cache": cache, "check_after": False}
        outcome = projects.run_project(project, progress, changed=loads.change, **how)
    _print_solved(outcome, project, "--allow-uncertified to write it", loads.change)
    load = outcome.under_load
    return OK if outcome.good and (load is None or load.carried) else NOT_CERTIFIED


def _print_solved(outcome: Outcome, project: Project, otherwise: str, changed: Changed | None = None) -> None:
    """Print a roof that was solved, and what its project wants to know; make the mesh check last."""
    reports.report(outcome)
    if project.verify and outcome.certificate.tried == () == outcome.certificate.proofs:
        print(outcome.theorem.text(outcome.units))
    if project.output.paths and not outcome.files:
        print(f"nothing written (use {otherwise})")
    reports.mesh_check(outcome, None, "brief", changed)
    reports.margins(outcome)


def certify_(
    *,
    file: Input,
    what: Shown,
    meshes: Annotated[int | None, count(MESHES)] = None,
    margin: Annotated[list[str] | None, option("WHAT", MARGIN)] = None,
    whole: Annotated[bool, switch("--whole", WHOLE_INDEX)] = False,
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
        project = arguments.load_project(file)
        if margin:  # unknown names are refused before the work
            start = what.of(projects.surface_of(project))
            for name in margin:
                Varied.of(start, name)
        roof = what.roof(project, progress, whole)
        progress("certifying")
        certificate = roof.shown.certificate
    if roof.result is not None:
        reports.report(roof, verdict=False)
    print(certificate.text(roof.units))
    reports.margins(roof, margin or ())
    if verify or (roof.project is not None and roof.project.verify):
        print(roof.theorem.text(roof.units))
    wanted = meshes is not None or bool(roof.mesh_check_wanted())
    reports.mesh_check(roof, wanted, "text", what.change, meshes)
    return OK if roof.good else NOT_CERTIFIED


def remesh_(
    *,
    file: Input,
    edge_length: Annotated[float, amount("LENGTH", "Edge length of the triangles.")],
    output: Annotated[list[Path], MANY_FILES],
    near_curves: Annotated[float | None, amount("LENGTH", "Edge length at junctions and boundaries.")] = None,
    chord: Annotated[float | None, amount("LENGTH", CHORD)] = None,
    units: FileUnits = "",
    solve: Annotated[bool, switch("--solve/--no-solve", "Solve and certify the new mesh.")] = True,
) -> int:
    """Remesh a surface to an edge length, then solve and certify it. Patches and supports stay.

    \b
    Example:
      pcmc remesh roof.pcmc --edge-length 0.25 -o fine.pcmc
    """
    stage = projects.Remeshing(edge_length, near_curves, chord=chord, when="before")
    written = arguments.output_of(file, files=output)
    with working() as progress:
        project = arguments.load_project(file, units)
        kept = {"whole": project.output.whole, "georeference": project.output.georeference}
        project = replace(project, output=replace(written, **kept))
        if solve:
            check = bool(project.mesh_check)
            project = replace(project, folder=file.parent, remeshing=(stage,), mesh_check=check)
            outcome = projects.run_project(project, progress, check_after=False)
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
    _print_solved(outcome, project, "--no-solve to write the new mesh")
    return OK if outcome.files else NOT_CERTIFIED


METHOD = "newton, nesterov or lbfgs; default: the project's."
MESH_CHECK = "Solve each case on two finer meshes, too, for error bars."
WHAT = "A project (.toml), a surface, or package.module:function that returns a Surface."
SEARCH = "Try further starts where the first leads to no equilibrium: slower, but tells what ends each way."
PLOT = "Picture over one varied number or two: of the first --show, else apexes or the rise."
SHOW = "What the table has: apex, area, volume, force, ..., or of one part: west.area. Repeat for several."
RETRY = "Run the stored cases that failed again."
STORE = "File for finished cases. The same command again runs only the missing ones."


def sweep(
    what: Annotated[str, typer.Argument(metavar="WHAT", help=WHAT)],
    values: Annotated[list[str], typer.Argument(metavar="NAME=V1,V2,...")],
    method: Annotated[str | None, option("NAME", METHOD)] = None,
    store: Annotated[Path | None, option("FILE", STORE)] = None,
    csv: Annotated[Path | None, option("FILE", "Table to write (.csv or .parquet).")] = None,
    every: Annotated[bool, switch("--all", "Write all columns, not only the first ones.")] = False,
    plot: Annotated[Path | None, option("FILE", PLOT)] = None,
    show: Annotated[list[str] | None, option("QUANTITY", SHOW)] = None,
    workers: Annotated[int | None, count("Local processes; default: one per processor.")] = None,
    scheduler: Annotated[str | None, option("ADDRESS", "Dask scheduler to use: tcp://HOST:8786.")] = None,
    time_limit: Annotated[float, amount("SECONDS", "Time limit per case, in seconds.")] = 600.0,
    mesh_check: Annotated[bool, switch("--mesh-check", MESH_CHECK)] = False,
    search: Annotated[bool, switch("--search", SEARCH)] = False,
    retry_failed: Annotated[bool, switch("--retry-failed", RETRY)] = False,
) -> int:
    """Solve every combination of the values; exit code 0 if all are certified.

    For a project or a surface, NAME is PATCH.tension, PATCH.pressure, PATCH.weight or PATCH.snow of a patch
    or wall, CABLE.tension or CABLE.weight of a cable, or ROOM.volume of a room that has one. For a project it
    may also be the keys of a number in the file: plan.edge_length, plan.outline.3.1 (the first coordinate of
    the third corner); or the shift of a whole divider, hole, support or named point along x, y or z: "wall
    1.x". For a generator it is one of its parameters, or an option of the method. With a store, values may be
    added later: only new cases are run. If the project file has changed, name a new store.
    The table has the parameters, the verdict, the apex of each patch, the rise, the area, and the largest
    reaction per length, or what --show names; with --all it has every number of the certificate, too. Cells
    are empty where nothing is at rest.

    \b
    Examples:
      pcmc sweep roof.toml corner.tension=6,6.2 "wall 1.tension=1,2" --csv roof.csv
      pcmc sweep generators:two_caps alpha_large=3,4,5 --csv caps.csv
    """
    inputs = files_of(what) if Path(what).exists() else ()
    outputs = [path for path in (csv, store, plot) if path is not None]
    check_outputs(outputs, inputs=inputs, pictures=[plot])
    if csv is not None:
        suffix_of(csv, TABLES, "a table")
    if every and csv is None:
        raise OptionError("--all: is of the table in a file; name it with --csv", what="--all")
    check_names((), plot)
    if retry_failed and store is None:
        raise OptionError("--retry-failed: is of stored cases; name their --store", what="--retry-failed")
    for name in show or ():
        dimension_of(name.rpartition(".")[2])  # refuses what is no quantity

    def resume(kept: int, missing: int) -> None:
        if kept:
            print(f"{store}: {kept} cases are finished, {missing} to run")

    how: dict[str, Any] = {"scheduler": scheduler, "workers": workers, "time_limit": time_limit}
    with sweeping() as draw:
        cases = _cases(what, values, method, {"mesh_check": mesh_check, "search": search})
        table = run(cases, store, retry_failed=retry_failed, on_record=draw, on_resume=resume, **how)
    if table.empty:
        return INTERRUPTED
    shown, grid = show or (), list(cases.grid)
    first = short_table(table, grid, shown)
    if csv is not None:
        write_table(csv, table if every else first)
    labels = {} if ":" in what and not Path(what).exists() else column_labels(what, map(str, table))
    if plot is not None:
        draw_sweep(table, grid, plot, labels, *shown[:1])
    print(first.rename(columns=labels).to_string(float_format=lambda x: f"{x:.5g}", na_rep=""))
    for name in (name for name in shown if not columns_of(table, name, grid)):
        print(f"no case has {name}")
    failed = table[table["status"].isin(FAILED)]
    for message, alike in failed.groupby("message", sort=False):  # each reason once
        others = f" and {len(alike) - 1} more" if len(alike) > 1 else ""
        print(f"case {alike.index[0]}{others}: {alike['status'].iloc[0]}: {message}")
    if len(table) < len(cases):
        return INTERRUPTED
    good = table["verdict"].isin(GOOD) & table.get("targets_met", True)
    return OK if (good & table.get("accuracy_reached", True)).all() else NOT_CERTIFIED


def _cases(what: str, values: list[str], method: str | None, options: dict[str, bool]) -> Sweep:
    """Every combination of the values, each NAME=V1,V2,...; a name with one value is the same in all."""
    given: dict[str, list[Any]] = {}
    for name, listed in map(arguments.named_values, values):
        if name in given:
            raise OptionError(f"{name} is given twice; list its values with commas: {name}=1,2", what=name)
        given[name] = listed
    grid = {name: listed for name, listed in given.items() if len(listed) > 1}
    grid = grid or given  # one case, whose names are checked as those of any other
    fixed = {name: listed[0] for name, listed in given.items() if name not in grid}
    if Path(what).suffix.lower() in READ:
        return project_sweep(what, grid, fixed, method=method, **options)
    if ":" not in what:
        kinds = f"a project (.toml), a surface ({' '.join(FORMATS)}), or a generator"
        raise OptionError(f"{what}: expected {kinds} such as generators:two_caps", what="WHAT", found=what)
    about: dict[str, Any] = {name: True for name, wanted in options.items() if wanted}
    about |= {"generator": what, "generator_digest": digest_of(what), "method": method or "newton"}
    return Sweep(solve_case, grid, about | fixed)


ALONG = "Follow branches in: pressure, snow, weight, volume, or such as 'tension of west'; may be repeated."
SPAN = "Least and largest factor on it; by default 0.5,1.5. Of what is 0 now, least and largest value."
FACTORS = "LOW,HIGH such as 0.5,1.5"
CHECK = "Check the mesh of each: whether finer meshes have it, too."
VERTICAL = "Vertical axis of the diagram: height, energy or volume."
PICTURES, TABLE = (".png", ".svg", ".pdf"), ".csv"


def equilibria_(
    *,
    file: Input,
    output: Annotated[list[Path] | None, MANY_FILES] = None,
    along: Annotated[list[str] | None, option("NAME", ALONG)] = None,
    span: Annotated[str | None, option("LOW,HIGH", SPAN)] = None,
    starts: Annotated[int, count("Starts of deflated Newton around each equilibrium.")] = 6,
    seed: Annotated[int, count("Seed of these starts.")] = 0,
    axis: Annotated[str, option("NAME", VERTICAL)] = "height",
    mesh_check: Annotated[bool, switch("--mesh-check", CHECK)] = False,
    what: Shown,
    units: FileUnits = "",
    whole: Whole = False,
) -> int:
    """Search for all equilibria of a roof, stable or not, and for the energy barriers between them.

    A .svg, .png or .pdf has the diagram of the branches and a picture of each equilibrium, a .csv the table;
    of any other format each equilibrium is written as NAME-1, NAME-2 and so on. No search proves that there
    is no further equilibrium: the last lines say what was searched.

    \b
    Examples:
      pcmc equilibria roof.toml -o diagram.svg
      pcmc equilibria roof.toml --along pressure --along "tension of hall" -o table.csv -o roof.pcmc
    """
    files = output or []
    surfaces = [path for path in files if path.suffix.lower() not in (*PICTURES, TABLE)]
    projects.Output(files=surfaces)  # refuses an unknown format
    numbered = [_numbered(path, k) for path in surfaces for k in range(1, 100)]  # as many as may be found
    pictures = [path for path in files if path.suffix.lower() in PICTURES]
    check_outputs([*files, *numbered], inputs=files_of(file), pictures=pictures)
    validate.choice("--axis", axis, BRANCH_VALUES)
    if axis != "height" and not pictures:
        raise OptionError("--axis: is of the diagram; add -o diagram.svg, or leave it out", what="--axis")
    if seed and not starts:
        raise OptionError("--seed: is of random starts; leave out --starts 0, or the seed", what="--seed")
    ends: Any = None if span is None else tuple(arguments.numbers(span, "--span", FACTORS, 2))
    with working() as progress:
        roof = what.roof(arguments.load_project(file, units), progress, whole)
        options: dict[str, Any] = {"starts": starts, "seed": seed, "mesh_check": mesh_check, "span": ends}
        found = find_equilibria(roof.shown.surface, along or "pressure", callback=progress, **options)
        if not found.found:
            raise KeyboardInterrupt  # it was stopped before the first
        jobs: list[Any] = []
        place = {"georeference": roof.output.georeference}
        for path in files:
            if path in pictures:
                jobs.append((path, partial(diagram, found, y=axis, units=roof.units)))
            elif path.suffix.lower() == TABLE:
                jobs.append((path, partial(found.table.to_csv, index=False)))
            else:
                warn_of_members(roof, path.name)
                for k, one in enumerate(found.found, 1):
                    named = [_numbered(path, k)]
                    jobs += certified_files(one.surface, one.certificate, named, roof.units, "", place)
        written = write_all(jobs, progress)
    print(found.text(roof.units))
    return reports.ended(True, written)


def _numbered(path: Path, number: int) -> Path:
    return path.with_name(f"{path.stem}-{number}{path.suffix}")
