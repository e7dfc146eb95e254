"""The commands panels, draw, report, structure and pattern. Each returns the exit code."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from .. import project as projects
from ..base import validate
from ..base.errors import FileError, OptionError
from ..base.files import suffix_of
from ..base.units import Units
from ..certificate.certificate import require_certified
from ..cloth import CuttingOptions
from ..cloth.sheets import pattern_files
from ..drawings.drawing_set import NET_SUFFIXES, NET_TABLES, net_files, table_paths
from ..io import FORMATS, write
from ..panelling.panel_net import check_grid
from ..plot import families, panel_planarity, strains
from ..project.drawn import files_of
from ..project.settings import Output, Structure, cost_paths, of_material, schedule_paths
from ..project.writing import analysis_jobs, check_outputs, cost_jobs, model_job, schedule_jobs, write_all
from ..structure import analyse
from ..structure.calculix import expect_program
from ..structure.columns import column_text, columns_at_rest
from ..structure.member_forces import cable_notes, cable_offers, sentences
from . import arguments, reports
from .arguments import MANY_FILES, OUTPUT, Build, FileUnits, Input, MeshCheck, SheetFormat, ViewName
from .options import amount, count, option, parsed_number, switch
from .reports import working

CSV = ".csv"
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
THICKNESS = "Thickness of a patch; a bare VALUE applies to every patch that is not named."
DENSITY = "Mass per volume; above 0, self-weight is a load."
RUN = "Run CalculiX on each case and combination; by default as the project says."
WIND = "Wind pressure on a patch, above 0 for suction on a roof; may be repeated."
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
    outputs = Output(picture=picture, view=seen).paths
    for path in files:
        if (suffix := path.suffix.lower()) not in (CSV, *FORMATS):
            text = f"{path}: expected {CSV} for a schedule, or a format of surfaces: {', '.join(FORMATS)}"
            raise FileError(text, what=str(path), found=suffix)
        outputs += schedule_paths(path) if suffix == CSV else [path]
        outputs += cost_paths(path) if suffix == CSV and prices is not None else []
    check_outputs(outputs, inputs=files_of(file), pictures=[picture])
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
        for path in files:
            if path.suffix.lower() == CSV:
                works += schedule_jobs(path, schedule)
                works += cost_jobs(path, fewer.costs(*prices)) if prices is not None else []
            else:
                works.append((path, partial(write, surface=schedule.surface, units=roof.units)))
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
    outputs = Output(picture=picture, view=seen, sheet=sheet or "A1").paths
    outputs += [one for path in files for one in table_paths(path, NET_TABLES)]
    check_outputs(outputs, inputs=files_of(file), pictures=[picture])
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


@dataclass(frozen=True)
class Model:
    """What the command line says of a structural model, instead of the project."""

    thickness: Annotated[list[str] | None, option("NAME=VALUE", THICKNESS)] = None
    young: Annotated[float | None, amount("VALUE", "Young's modulus.")] = None
    poisson: Annotated[float | None, amount("VALUE", "Poisson's ratio, 0.3 by default.")] = None
    density: Annotated[float | None, amount("VALUE", DENSITY)] = None
    gravity: Annotated[float | None, amount("VALUE", "Length/s²; by default 9.81 m/s².")] = None
    snow: Annotated[float | None, amount("VALUE", "Load per plan area, besides the snow of the form.")] = None
    wind: Annotated[list[str] | None, option("NAME=VALUE", WIND)] = None
    cable_area: Annotated[float | None, amount("VALUE", "Section of the cables.")] = None


def structure(
    *,
    file: Input,
    output: Annotated[Path, option("INP", "File to write, .inp.", *OUTPUT)],
    given: Model,
    run: Annotated[bool | None, switch("--run/--no-run", RUN)] = None,
    build: Build,
) -> int:
    """Write a structural model for CalculiX: prestressed membranes, supports, loads; and run it.

    A project is solved first; its [structure] has the values that no option gives. With --run each case and
    combination is analysed: NAME-cases.csv, NAME-patches.csv, NAME-supports.csv, NAME-cables.csv,
    NAME-members.csv, NAME-member-forces.csv, NAME-columns.csv, NAME-cases.png and NAME-member-forces.png come
    beside the model. A case that is not carried as a whole ends with the code 1.

    \b
    Examples:
      pcmc structure roof.pcmc -o roof.inp --thickness 0.001 --young 1e6 --snow 0.6
      pcmc structure roof.toml -o roof.inp --run
    """
    arguments.output_of(file, structure=output)
    with working() as progress:
        project = arguments.load_project(file)
        start = projects.surface_of(project)
        patches = [patch.name for patch in start.patches]
        values: dict[str, Any] = {} if project.structure is None else asdict(project.structure)
        plain = {k: v for k, v in vars(given).items() if k not in ("thickness", "wind") and v is not None}
        values |= plain
        if given.thickness:
            thick = arguments.by_name(patches, given.thickness, "--thickness")
            if project.structure is not None:
                own = project.structure.thicknesses(start)
                thick = (own if isinstance(own, dict) else dict.fromkeys(patches, own)) | thick
                values["patches"] = {  # their own would count for more
                    name: {key: value for key, value in table.items() if key != "thickness"}
                    for name, table in values["patches"].items()
                }
            one = set(thick.values()) if len(thick) == len(patches) else ()
            values["thickness"] = thick[patches[0]] if len(one) == 1 else thick  # one number, not one by patch
        if given.wind:
            values["wind"] = values.get("wind", {}) | arguments.by_name(patches, given.wind, "--wind")
        wanted = Structure(**values)
        wanted.check(start, project.plan, build.whole or project.output.whole)
        if run := wanted.run if run is None else run:
            expect_program()
        roof = build.roof(project, progress)
        progress("certifying")
        model = roof.model(wanted, build.allow_uncertified)
        jobs = [model_job(roof, output, model)]
        analysis = analyse(model, progress=progress) if run else None
        jobs += analysis_jobs(roof, output, analysis) if analysis is not None else []
        written = write_all(jobs, progress)
    if model.note:
        print(model.note)
    steps = ", ".join(step.name for step in model.steps)
    print(f"{len(model.faces)} elements, {int(model.nodes.sum())} nodes; steps: {steps}")
    if analysis is None:
        for line in (*cable_notes(model), *sentences(model, model.units), *cable_offers(model)):
            print(line)
        if model.bars:
            print(column_text(model, columns_at_rest(model), model.units))
        print(f"written: {output}; run it with: ccx {output.with_suffix('')}")
        return reports.ended(roof.good)
    print(analysis)
    return reports.ended(roof.good and analysis.carried, written)


WIDTH = "Width of the cloth: no strip is wider, with its allowances."
SEAM = "A seam from point to point along geodesics, instead of others there; may be repeated."
DIRECTION = "Of the warp in the plan, degrees from x; by default along the longer side of each sheet."
COMPENSATION = "Percent by which the cloth is cut shorter along warp and weft."
STIFFNESS = "Force per length of warp and weft, from which the compensation follows."
NOTCHES = "Distance of the marks along seams, 0 for none; by default the mean width of strips."
STRIPS = "Picture to draw: the strips on the roof, coloured by strain."


@dataclass(frozen=True)
class Cutting:
    """What the command line says of a cutting pattern, instead of the project."""

    width: Annotated[float | None, amount("LENGTH", WIDTH)] = None
    strips: Annotated[int | None, count("Number of strips of each sheet, instead of a width.")] = None
    seam: Annotated[list[str] | None, option("X,Y,X,Y", SEAM)] = None
    direction: Annotated[float | None, amount("DEGREES", DIRECTION)] = None
    compensation: Annotated[str | None, option("WARP,WEFT", COMPENSATION)] = None
    stiffness: Annotated[str | None, option("WARP,WEFT", STIFFNESS)] = None
    poisson: Annotated[float | None, amount("NUMBER", "Contraction of the weft, 0.3 by default.")] = None
    allowance: Annotated[float | None, amount("LENGTH", "Cloth added outside of seams.")] = None
    hem: Annotated[float | None, amount("LENGTH", "Cloth added at rims; by default the allowance.")] = None
    notches: Annotated[float | None, amount("LENGTH", NOTCHES)] = None

    def of(self, own: CuttingOptions | None) -> CuttingOptions:
        """The pattern of a project with these values."""
        values: dict[str, Any] = {} if own is None else dict(vars(own))
        given = {name: value for name, value in vars(self).items() if value not in (None, [])}
        for pair in ({"width", "strips"}, {"compensation", "stiffness"}):  # one or the other
            if len(pair & given.keys()) == 1:
                values = {name: value for name, value in values.items() if name not in pair}
        for name in {"compensation", "stiffness"} & given.keys():
            given[name] = arguments.numbers(given[name], f"--{name}")
        if "seam" in given:
            lines = [arguments.numbers(text, "--seam") for text in given.pop("seam")]
            for line in lines:
                if len(line) % 2 or len(line) < 4:
                    validate.refuse("--seam", ",".join(map(str, line)), "points X,Y,X,Y and so on")
            given["seams"] = [[line[k : k + 2] for k in range(0, len(line), 2)] for line in lines]
        return CuttingOptions(**(values | given))


def pattern(
    *,
    file: Input,
    output: Annotated[list[Path] | None, MANY_FILES] = None,
    picture: Annotated[Path | None, option("PNG", STRIPS)] = None,
    view: ViewName = "diagonal",
    given: Cutting,
    sheet: SheetFormat = None,
    units: FileUnits = "",
    build: Build,
) -> int:
    """Cut a roof into strips of cloth and lay them flat; write sheets and tables.

    A .dxf has all strips at true size with allowances, seams, notches and labels; .pdf and .svg have sheets
    to scale; a .csv has the table of strips, beside it comes NAME-seams.csv. A project is solved first;
    its [pattern] has the values that no option gives.

    \b
    Examples:
      pcmc pattern roof.toml --width 2.4 -o cloth.dxf -o cloth.pdf
      pcmc pattern roof.toml --width 2.4 --compensation 0.4,1.5 --allowance 0.04 -o cloth.csv
    """
    seen, files = arguments.parsed_view(view, picture), output or []
    arguments.output_of(file, pattern=files, picture=picture, view=seen)
    with working() as progress:
        project = arguments.load_project(file, units)
        wanted, own = given.of(project.pattern), project.output
        own = replace(own, pattern=files, sheet=sheet or own.sheet)
        start = projects.start_of(project)
        own.check(start.units, project.structure, wanted)
        of_material(wanted, project.structure, start.surface)
        roof = build.roof(project, progress)
        progress("cutting strips")
        cloth = roof.cutting_pattern(wanted, build.allow_uncertified)
        jobs: list[Any] = pattern_files(cloth, files, roof.units, own.sheet, roof.name, roof.mark)
        if picture is not None:
            jobs.append((picture, partial(strains, cloth, view=seen)))
        written = write_all(jobs, progress)
    print(cloth.text(roof.units))
    return reports.ended(roof.good, written)
