"""The commands panels, draw and report. Each returns the exit code."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from .. import project as projects
from ..base import validate
from ..base.errors import FileError, OptionError
from ..base.files import suffix_of
from ..base.units import Units
from ..certificate.certificate import require_certified
from ..drawings.drawing_set import CSV, NET_SUFFIXES, NET_TABLES, net_files, table_paths
from ..io import FORMATS
from ..panelling.panel_net import check_grid
from ..plot import families, panel_planarity
from ..project.settings import SCHEDULE_TABLES, Output, cost_paths
from ..project.writing import certified_files, cost_jobs, schedule_jobs, write_all
from . import arguments, reports
from .arguments import MANY_FILES, OUTPUT, Build, FileUnits, Input, MeshCheck, SheetFormat, ViewName
from .options import amount, count, option, parsed_number, switch
from .reports import working

FAMILY = "Largest difference of edges within a family of triangles."
PATTERN = "planar-quads along lines of curvature; quads or hexagons of a grid in plan."
GRID = "Direction of a grid in plan, from x; by default the project's, or 0."
CHANGE = "Move the vertices along the shape to lower the number of families; leave the shape by at most this."
COST = "Cost of a family, as of its mould, and of a panel; adds NAME-costs.csv and .svg. Needs --change."
ALIKE = "Largest difference of edges within a family of panels; adds the schedule. By default the project's."
TWO = "two numbers FAMILY,PANEL, 0 or more"
LINE, FOUR = "Section along this line; may be repeated.", "four numbers X,Y,X,Y"
TRUE_SIZE = "Draw every panel at true size, as a project may say, too; needs --tolerance."
FORCE = "Unit of the forces: N, kN, MN, lbf or kip; by default the file's."
DATE = "Date to print; by default the project's. No clock is read."
Tolerance = Annotated[float | None, amount("LENGTH", ALIKE)]


def panels_(
    *,
    file: Input,
    tolerance: Annotated[float | None, amount("LENGTH", FAMILY)] = None,
    output: Annotated[list[Path] | None, MANY_FILES] = None,
    picture: Annotated[Path | None, option("PNG", "Picture to draw, coloured by family.")] = None,
    view: ViewName = "diagonal",
    pattern: Annotated[str | None, option("NAME", PATTERN)] = None,
    size: Annotated[float | None, amount("LENGTH", "Edge of the panels of a pattern.")] = None,
    direction: Annotated[float | None, amount("DEGREES", GRID)] = None,
    units: FileUnits = "",
    sheet: SheetFormat = None,
    change: Annotated[float | None, amount("LENGTH", CHANGE)] = None,
    cost: Annotated[str | None, option("FAMILY,PANEL", COST)] = None,
    mirror_images: Annotated[str, option("NAME", "alike: of one family; or apart.")] = "alike",
    walls: Annotated[bool, switch("--walls", "Triangles of walls are panels, too.")] = False,
    build: Build,
) -> int:
    """Sort the panels of a roof into families of congruent triangles, or lay out quads or hexagons.

    A .csv has a row per panel; beside it come NAME-families.csv and NAME-edges.csv. Other suffixes are
    formats of surfaces, for the surface that --change gives.

    With --pattern and --size the panels are quads or hexagons; beside the .csv come NAME-nodes.csv and
    NAME-beams.csv, an .obj has the polygons, and .dxf, .pdf and .svg have each panel at true size.

    \b
    Examples:
      pcmc panels roof.toml --tolerance 0.005 -o schedule.csv
      pcmc panels roof.pcmc --tolerance 0.005 --change 0.02 -o schedule.csv -o fewer.pcmc
      pcmc panels roof.toml --pattern planar-quads --size 1.2 -o panels.csv -o panels.obj
    """
    seen, files = arguments.parsed_view(view, picture), output or []
    triangles = {"tolerance": tolerance, "change": change, "cost": cost, "walls": walls or None}
    triangles["mirror-images"] = mirror_images if mirror_images != "alike" else None
    nets = {"units": units or None, "direction": direction, "sheet": sheet}
    net = pattern is not None or size is not None
    for name in (name for name, value in (triangles if net else nets).items() if value is not None):
        mend = "triangles; leave it out, or" if net else "quads and hexagons; leave it out, or give"
        raise OptionError(f"--{name}: belongs to panels of {mend} --pattern and --size", what=f"--{name}")
    if net:
        if pattern is None or size is None:
            text = "--pattern: needs a --size, and --size a --pattern: planar-quads, quads or hexagons"
            raise OptionError(text, what="--size", expected="a length")
        return _net(file, units, files, picture, seen, sheet, build, (size, pattern, direction))
    if tolerance is None:
        text = "--tolerance: panels of triangles need it; quads and hexagons need --pattern and --size"
        raise OptionError(text, what="--tolerance", expected="a length")
    validate.positive("--tolerance", tolerance)
    if change is not None:
        validate.positive("--change", change)
    prices = None if cost is None else arguments.numbers(cost, "--cost", TWO, 2)
    if prices is not None and change is None:
        raise OptionError("--cost: prices what --change finds; give --change, too", what="--cost")
    for price in prices or ():
        validate.number("--cost", price, least=0.0)
    outputs: list[Path] = []
    for path in files:
        if (suffix := path.suffix.lower()) not in (CSV, *FORMATS):
            text = f"{path}: expected {CSV} for a schedule, or a format of surfaces: {', '.join(FORMATS)}"
            raise FileError(text, what=str(path), found=suffix)
        outputs += table_paths(path, SCHEDULE_TABLES)
        outputs += cost_paths(path) if suffix == CSV and prices is not None else []
    arguments.output_of(file, *outputs, picture=picture, view=seen)
    how: dict[str, Any] = {"mirror_images": mirror_images, "walls": walls, "anyway": build.allow_uncertified}
    with working() as progress:
        roof = build.roof(arguments.load_project(file), progress)
        progress("sorting panels")
        if change is None:
            schedule = roof.panels(tolerance, **how)
        else:
            how["callback"] = lambda made, count: progress(f"round {made}: {count} families")
            fewer = roof.fewer_families(tolerance, change, **how)
            schedule = fewer.after
        works: list[Any] = []
        place = {"georeference": roof.output.georeference}
        for path in files:
            if path.suffix.lower() == CSV:
                works += schedule_jobs(path, schedule)
                works += cost_jobs(path, fewer.costs(*prices)) if prices is not None else []
            else:
                what = schedule.surface, schedule.certificate, [path], roof.units
                works += certified_files(*what, besides=place, mark=roof.mark)
        if picture is not None:
            works.append((picture, partial(families, schedule, view=seen)))
        written = write_all(works, progress)
    print(schedule.text(roof.units))
    if change is not None:
        print(f"\n{fewer}")
    if prices is not None:
        table = fewer.costs(*prices)
        table[""] = table.pop("cheapest").map({True: "cheapest", False: ""})
        print(f"\n{table.to_string(index=False, float_format='%.6g')}")
    return reports.ended(schedule.certificate.certified and roof.good, written)


def _net(
    file: Path,
    units: str,
    files: list[Path],
    picture: Path | None,
    seen: Any,
    sheet: str | None,
    build: Build,
    wanted: tuple[float, str, float | None],
) -> int:
    for path in files:
        suffix_of(path, NET_SUFFIXES, "a net of panels")
    size, pattern, given = wanted
    check_grid(pattern, given or 0.0)
    tables = [one for path in files for one in table_paths(path, NET_TABLES)]
    arguments.output_of(file, *tables, picture=picture, view=seen, sheet=sheet or "A1")
    with working() as progress:
        project = arguments.load_project(file, units)
        own = given is None and pattern != "planar-quads"
        direction = project.output.net_direction if own else given or 0.0
        roof = build.roof(project, progress)
        progress("laying out panels")
        net = roof.panel_net(size, pattern, direction, build.allow_uncertified)
        works: list[Any] = net_files(net, files, roof.units, sheet or roof.output.sheet, roof.name, roof.mark)
        if picture is not None:
            works.append((picture, partial(panel_planarity, net, view=seen)))
        written = write_all(works, progress)
    print(net.text(roof.units))
    return reports.ended(net.certificate.certified and roof.good, written)


def draw_(
    *,
    file: Input,
    output: Annotated[list[Path], MANY_FILES],
    units: FileUnits = "",
    sheet: SheetFormat = None,
    scale: Annotated[int | None, count("1 to this; by default it fits.")] = None,
    height: Annotated[list[str] | None, option("Z", "Section at this height; may be repeated.")] = None,
    line: Annotated[list[str] | None, option("X,Y,X,Y", LINE)] = None,
    tolerance: Tolerance = None,
    panel_sheets: Annotated[bool, switch("--panel-sheets", TRUE_SIZE)] = False,
    build: Build,
) -> int:
    """Draw a roof: plan, elevations, sections, setting-out points, panels; in .dxf, .pdf or .svg.

    \b
    Examples:
      pcmc draw roof.toml --units m -o roof.dxf -o roof.pdf
      pcmc draw roof.pcmc --units m --tolerance 0.005 --panel-sheets --sheet A0 -o roof.dxf
    """
    arguments.output_of(file, drawings=output)
    heights = None if height is None else [parsed_number(text) for text in height]
    points = [arguments.numbers(text, "--line", FOUR, 4) for text in line or ()]
    lines = None if line is None else [((a, b), (c, d)) for a, b, c, d in points]
    options: dict[str, Any] = {"scale": scale, "heights": heights, "lines": lines}
    with working() as progress:
        roof = build.roof(arguments.load_project(file, units), progress)
        progress("drawing")
        documents = _documents(roof, sheet=sheet, tolerance=tolerance, panel_sheets=panel_sheets or None)
        drawings = roof.drawing_set(documents, anyway=build.allow_uncertified, **options)
        written = write_all(drawings.files(*output), progress)
    print(f"{len(drawings.sheets)} sheets {drawings.sheets[0].format}", end="; ")
    return reports.ended(roof.good, written)


def report_(
    *,
    file: Input,
    output: Annotated[Path, option("PDF", "File to write, .pdf.", *OUTPUT)],
    units: FileUnits = "",
    force: Annotated[str, option("NAME", FORCE)] = "",
    tolerance: Tolerance = None,
    date: Annotated[str | None, option("TEXT", DATE)] = None,
    mesh_check: MeshCheck = None,
    build: Build,
) -> int:
    """Write a report: pictures, plan to scale, verdict in words, forces, mesh check, panels; in .pdf.

    \b
    Examples:
      pcmc report roof.toml -o roof.pdf
      pcmc report roof.pcmc --units m --force kN --tolerance 0.005 -o roof.pdf
    """
    arguments.output_of(file, report=output)
    anyway = build.allow_uncertified
    with working() as progress:
        roof = build.roof(arguments.load_project(file, units), progress)
        own = roof.units.force
        if force and own not in ("", force):
            text = f"--force: the forces of {file.name} are in {own}, not in {force}; leave out --force"
            raise OptionError(text, what="--force", found=force, expected=own)
        progress("certifying")
        roof = replace(roof, units=Units(roof.units.length, force or own))
        require_certified(roof.shown.certificate, anyway)
    reports.mesh_check(roof, mesh_check)
    reports.margins(roof)
    with working() as progress:
        progress("laying out the pages")
        documents = _documents(roof, tolerance=tolerance, date=date)
        listed = {file.name: "project" if roof.result is not None else "surface"}
        written = write_all([(output, roof.report(documents, files=listed, anyway=anyway).write)], progress)
    return reports.ended(roof.good, written)


def _documents(roof: projects.Outcome, **given: Any) -> Output:
    """What a project says about its documents, with what the command line says instead."""
    return replace(roof.output, **{name: value for name, value in given.items() if value is not None})
