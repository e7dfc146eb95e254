"""The command pattern. Returns the exit code."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from ..base import validate
from ..cloth import CuttingOptions
from ..cloth.sheets import pattern_files
from ..plot import strains
from ..project import start_of
from ..project.settings import of_material
from ..project.writing import write_all
from . import arguments, reports
from .arguments import MANY_FILES, Build, FileUnits, Input, SheetFormat, ViewName
from .options import amount, count, option
from .reports import working

WIDTH = "Width of the cloth: no strip is wider, with its allowances."
SEAM = "A seam from point to point along geodesics, instead of others there; may be repeated."
DIRECTION = "Of the warp in the plan, degrees from x; by default along the longer side of each sheet."
COMPENSATION = "Percent by which the cloth is cut shorter along warp and weft."
STIFFNESS = "Force per length of warp and weft, from which the compensation follows."
NOTCHES = "Distance of the marks along seams, 0 for none; by default the mean width of strips."
PICTURE = "Picture to draw: the strips on the roof, coloured by strain."


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
    picture: Annotated[Path | None, option("PNG", PICTURE)] = None,
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
        start = start_of(project)
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
