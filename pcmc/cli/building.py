"""The commands structure and pattern. Each returns the exit code."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from .. import project as projects
from ..base import validate
from ..cloth import CuttingOptions
from ..cloth.sheets import pattern_files
from ..plot import strains
from ..project.settings import Structure, of_material
from ..project.writing import analysis_jobs, model_job, write_all
from ..structure import analyse
from ..structure.calculix import expect_program
from ..structure.columns import column_text, columns_at_rest
from ..structure.member_forces import cable_notes, cable_offers, sentences
from . import arguments, reports
from .arguments import MANY_FILES, OUTPUT, Build, FileUnits, Input, SheetFormat, ViewName
from .options import amount, count, option, switch
from .reports import working

THICKNESS = "Thickness of a patch; a bare VALUE applies to every patch that is not named."
DENSITY = "Mass per volume; above 0, self-weight is a load."
RUN = "Run CalculiX on each case and combination; by default as the project says."
WIND = "Wind pressure on a patch, above 0 for suction on a roof; may be repeated."


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
        values |= {k: v for k, v in vars(given).items() if k not in ("thickness", "wind") and v is not None}
        if given.thickness:
            thick = arguments.by_name(patches, given.thickness, "--thickness")
            if project.structure is not None:
                own = project.structure.thicknesses(start)
                thick = (own if isinstance(own, dict) else dict.fromkeys(patches, own)) | thick
                for table in values["patches"].values():
                    table.pop("thickness", None)  # their own would count for more
            alike = thick.keys() == {*patches} and len({*thick.values()}) == 1  # one number, not one by patch
            values["thickness"] = thick[patches[0]] if alike else thick
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
    for note in filter(None, (model.note, model.certificate.part)):
        print(note)
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
