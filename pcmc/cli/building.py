"""The commands panels, draw and report: from the shape to what is built. Each returns the exit code."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from .. import project as projects
from ..base import validate
from ..base.errors import FileError, OptionError
from ..base.units import Units
from ..certificate.required import require_certified
from ..drawings.drawing_set import check_suffix as check_drawing
from ..io import FORMATS, write
from ..panelling import Panels, fewer_families
from ..panelling.schedule import MIRROR_IMAGES
from ..report.document import check_suffix as check_report
from . import NOT_CERTIFIED, OK, arguments, checking
from .arguments import MANY_FILES, Cache, FileUnits, Input, ViewName, Whole, number, option
from .checking import CHECKED
from .progress import working

CSV = ".csv"
CHANGE = "Move the vertices along the shape to lower the number of families; leave the shape by at most this."
ANYWAY = "Accept a surface that is not certified."
MARKED = "Draw a surface that is not certified; every sheet is marked."
TOLERANCE = (
    "Largest difference of edges within a family of panels; adds the schedule. By default the project's."
)
SHEET = "Format of the sheets: A4, A3, A2, A1 or A0; by default the project's, or A1."
FORCE = "Unit of the forces: N, kN, MN, lbf or kip; by default the file's."
DATE = "Date to print; by default the project's. No clock is read."
REPORTED = "Report on a surface that is not certified; every page is marked."
TRUE_SIZE = "Draw every panel at true size; needs --tolerance."
Anyway = Annotated[bool, typer.Option("--anyway", help=ANYWAY)]


def panels_(
    file: Input,
    tolerance: Annotated[
        float, option("LENGTH", "Largest difference of edges within a family.", parser=number)
    ],
    output: Annotated[list[Path] | None, MANY_FILES] = None,
    picture: Annotated[Path | None, option("PNG", "Picture to draw, coloured by family.")] = None,
    view: ViewName = "diagonal",
    change: Annotated[float | None, option("LENGTH", CHANGE, parser=number)] = None,
    mirror_images: Annotated[
        str, option("NAME", "alike: of one family; or apart.", "--mirror-images")
    ] = MIRROR_IMAGES[0],
    walls: Annotated[bool, typer.Option("--walls", help="Triangles of walls are panels, too.")] = False,
    whole: Whole = False,
    cache: Cache = True,
    anyway: Anyway = False,
) -> int:
    """Sort the panels of a roof into families of congruent triangles; write a schedule.

    A .csv has a row per panel; beside it come NAME-families.csv and NAME-edges.csv. Other suffixes are
    formats of surfaces, for the surface that --change gives.

    \b
    Examples:
      pcmc panels roof.toml --tolerance 0.005 -o schedule.csv
      pcmc panels roof.pcmc --tolerance 0.005 --change 0.02 -o schedule.csv -o fewer.pcmc
    """
    seen, files = arguments.view_of(view), output or []
    validate.positive("--tolerance", tolerance)
    if change is not None:
        validate.positive("--change", change)
    projects.check_names([], picture)
    projects.check_picture([seen], "patches")
    outputs = [path for one in files for path in _paths(one)] + ([picture] if picture else [])
    projects.check_outputs(outputs, inputs=projects.files_of(file))
    options: dict[str, Any] = {"mirror_images": mirror_images, "walls": walls, "anyway": anyway}
    with working() as say:
        project = arguments.load(file)
        roof = arguments.to_build(project, say, anyway=anyway, cache=cache, whole=whole)
        surface = roof.shown.surface
        say("sorting panels")
        if change is None:
            schedule = roof.panels(tolerance, **options)
        else:

            def callback(made: int, count: int) -> None:
                say(f"round {made}: {count} families")

            fewer = fewer_families(surface, tolerance, change, callback=callback, **options)
            schedule = fewer.after
        works = [work for path in files for work in _works(path, schedule, roof.units)]
        if picture is not None:
            works.append((picture, partial(_paint, schedule, seen)))
        written = projects.write_all(works, say)
    print(schedule)
    if change is not None:
        print(f"\n{fewer}")
    if written:
        print(f"written: {', '.join(map(str, written))}")
    return OK if schedule.certificate.certified and roof.good else NOT_CERTIFIED


def draw_(
    file: Input,
    output: Annotated[list[Path], MANY_FILES],
    units: FileUnits = "",
    sheet: Annotated[str | None, option("NAME", SHEET)] = None,
    scale: Annotated[
        int | None, option("NUMBER", "1 to this; by default it fits.", parser=arguments.integer)
    ] = None,
    height: Annotated[
        list[str] | None, option("Z", "Section at this height; may be repeated.", "--height")
    ] = None,
    line: Annotated[list[str] | None, option("X,Y,X,Y", "Section along this line; may be repeated.")] = None,
    tolerance: Annotated[float | None, option("LENGTH", TOLERANCE, parser=number)] = None,
    panel_sheets: Annotated[bool, typer.Option("--panel-sheets", help=TRUE_SIZE)] = False,
    whole: Whole = False,
    cache: Cache = True,
    anyway: Annotated[bool, typer.Option("--anyway", help=MARKED)] = False,
) -> int:
    """Draw a roof: plan, elevations, sections, setting-out points, panels; in .dxf, .pdf or .svg.

    \b
    Examples:
      pcmc draw roof.toml --units m -o roof.dxf -o roof.pdf
      pcmc draw roof.pcmc --units m --tolerance 0.005 --panel-sheets --sheet A0 -o roof.dxf
    """
    for path in output:
        check_drawing(path)
    projects.check_outputs(output, inputs=projects.files_of(file))
    heights = None if height is None else [number(text) for text in height]
    lines = None if line is None else [_ends(text) for text in line]
    with working() as say:
        project = arguments.load(file, units)
        roof = arguments.to_build(project, say, anyway=anyway, cache=cache, whole=whole)
        say("drawing")
        documents = _chosen(roof.output, sheet=sheet, tolerance=tolerance)
        documents = replace(documents, panel_sheets=panel_sheets)
        drawings = roof.drawing_set(documents, anyway=anyway, scale=scale, heights=heights, lines=lines)
        written = projects.write_all(drawings.files(*output), say)
    sheets = f"{len(drawings.sheets)} sheets {drawings.sheets[0].format}"
    print(f"{sheets}; written: {', '.join(map(str, written))}")
    return OK if roof.good else NOT_CERTIFIED


def report_(
    file: Input,
    output: Annotated[Path, option("PDF", "File to write, .pdf.", "-o", "--output")],
    units: FileUnits = "",
    force: Annotated[str, option("NAME", FORCE)] = "",
    tolerance: Annotated[float | None, option("LENGTH", TOLERANCE, parser=number)] = None,
    date: Annotated[str | None, option("TEXT", DATE)] = None,
    mesh_check: Annotated[bool | None, typer.Option("--mesh-check/--no-mesh-check", help=CHECKED)] = None,
    whole: Whole = False,
    cache: Cache = True,
    anyway: Annotated[bool, typer.Option("--anyway", help=REPORTED)] = False,
) -> int:
    """Write a report: pictures, plan to scale, verdict in words, forces, mesh check, panels; in .pdf.

    \b
    Examples:
      pcmc report roof.toml -o roof.pdf
      pcmc report roof.pcmc --units m --force kN --tolerance 0.005 -o roof.pdf
    """
    check_report(output)
    projects.check_outputs([output], inputs=projects.files_of(file))
    with working() as say:
        project = arguments.load(file, units)
        _expect_force(project, force)
        roof = arguments.to_build(project, say, anyway=anyway, cache=cache, whole=whole)
        say("certifying")
        roof = replace(roof, units=Units(roof.units.length, force or roof.units.force))
        require_certified(roof.shown.certificate, anyway)
    checking.mesh_check(roof, mesh_check)
    checking.margins(roof)
    documents = _chosen(roof.output, tolerance=tolerance, date=date)
    with working() as say:
        say("laying out the pages")
        listed = {file.name: "project" if roof.result is not None else "surface"}
        report = roof.report(documents, files=listed, anyway=anyway)
        projects.write_all([(output, report.write)], say)
    print(f"written: {output}")
    return OK if roof.good else NOT_CERTIFIED


def _expect_force(project: projects.Project, force: str) -> None:
    """Refuse another unit of force than the project has."""
    own = project.units.force
    if force and own and force != own:
        text = f"--force: the forces of {project.path.name} are in {own}, not in {force}; leave out --force"
        raise OptionError(text, what="--force", found=force, expected=own)


def _chosen(documents: projects.Output, **given: Any) -> projects.Output:
    """What a project says about its documents, with what the command line says instead."""
    return replace(documents, **{name: value for name, value in given.items() if value is not None})


def _ends(text: str) -> Any:
    """Two points from X,Y,X,Y."""
    try:
        a, b, c, d = map(validate.parsed, text.split(","))
    except ValueError:
        validate.refuse("--line", text, "four numbers X,Y,X,Y")
    return (a, b), (c, d)


def _paths(path: Path) -> list[Path]:
    """The files that the name of an output stands for."""
    suffix = path.suffix.lower()
    if suffix not in (CSV, *FORMATS):
        text = f"{path}: expected {CSV} for a schedule, or a format of surfaces: {', '.join(FORMATS)}"
        raise FileError(text, what=str(path), found=suffix)
    return [path] if suffix != CSV else projects.schedule_paths(path)


def _works(path: Path, schedule: Panels, units: Units) -> list[Any]:
    """Each file with the function that writes it."""
    if path.suffix.lower() != CSV:
        return [(path, partial(write, surface=schedule.surface, units=units))]
    return projects.schedule_jobs(path, schedule)


def _paint(schedule: Panels, view: Any, path: Path) -> None:
    from ..plot import families

    families(schedule, path, view=view)
