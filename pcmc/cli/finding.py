"""The command equilibria. Returns the exit code."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

from .. import project as projects
from ..base.errors import OptionError
from ..equilibria import find_equilibria
from ..plot import equilibria as diagram
from ..plot.uses import BRANCH_VALUES
from ..project.drawn import files_of
from ..project.members import warn_of_members
from ..project.writing import certified_files, check_outputs, write_all
from . import arguments, reports
from .arguments import MANY_FILES, FileUnits, Input, Shown, Whole, load_project
from .options import count, option, switch
from .reports import working

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
    arguments.validate.choice("--axis", axis, BRANCH_VALUES)
    if axis != "height" and not pictures:
        raise OptionError("--axis: is of the diagram; add -o diagram.svg, or leave it out", what="--axis")
    if seed and not starts:
        raise OptionError("--seed: is of random starts; leave out --starts 0, or the seed", what="--seed")
    ends: Any = None if span is None else tuple(arguments.numbers(span, "--span", FACTORS, 2))
    with working() as progress:
        roof = what.roof(load_project(file, units), progress, whole)
        options: dict[str, Any] = {"starts": starts, "seed": seed, "mesh_check": mesh_check, "span": ends}
        found = find_equilibria(roof.shown.surface, along or "pressure", callback=progress, **options)
        jobs: list[Any] = []
        for path in files:
            if path in pictures:
                jobs.append((path, partial(diagram, found, y=axis, units=roof.units)))
            elif path.suffix.lower() == TABLE:
                jobs.append((path, partial(found.table.to_csv, index=False)))
            else:
                warn_of_members(roof, path.name)
                for k, one in enumerate(found.found, 1):
                    jobs += certified_files(one.surface, one.certificate, [_numbered(path, k)], roof.units)
        written = write_all(jobs, progress)
    print(found.text(roof.units))
    return reports.ended(True, written)


def _numbered(path: Path, number: int) -> Path:
    return path.with_name(f"{path.stem}-{number}{path.suffix}")
