"""The command structure. It returns the exit code."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from .. import project as projects
from ..structure import write_structure
from ..surface import Surface
from . import NOT_CERTIFIED, OK, arguments
from .arguments import Cache, Input, Whole, number, option
from .progress import working

THICKNESS = "Thickness of a patch; a bare VALUE applies to every patch that is not named."
WIND = "Wind pressure on a patch, above 0 for suction on a roof; may be repeated."


def structure(
    file: Input,
    output: Annotated[Path, option("INP", "File to write, .inp.", "-o", "--output")],
    thickness: Annotated[list[str] | None, option("NAME=VALUE", THICKNESS, "--thickness")] = None,
    young: Annotated[float | None, option("VALUE", "Young's modulus.", parser=number)] = None,
    poisson: Annotated[
        float | None, option("VALUE", "Poisson's ratio, 0.3 by default.", parser=number)
    ] = None,
    density: Annotated[
        float | None, option("VALUE", "Mass per volume; above 0, self-weight is a load.", parser=number)
    ] = None,
    gravity: Annotated[
        float | None, option("VALUE", "Length/s²; by default 9.81 m/s².", parser=number)
    ] = None,
    snow: Annotated[
        float | None, option("VALUE", "Load per plan area, besides the snow of the form.", parser=number)
    ] = None,
    wind: Annotated[list[str] | None, option("NAME=VALUE", WIND, "--wind")] = None,
    cable_area: Annotated[float | None, option("VALUE", "Section of the cables.", parser=number)] = None,
    whole: Whole = False,
    cache: Cache = True,
    anyway: Annotated[bool, typer.Option("--anyway", help="Write it even if not certified.")] = False,
) -> int:
    """Write a structural model for CalculiX: prestressed membranes, supports, loads.

    A project is solved first; its [structure] has the values that no option gives.

    \b
    Example:
      pcmc structure roof.pcmc -o roof.inp --thickness 0.001 --young 1e6 --snow 0.6
    """
    projects.check_model(output)
    projects.check_outputs([output], inputs=projects.files_of(file))
    with working() as say:
        project = arguments.load(file)
        start = projects.surface_of(project)
        given = {
            "thickness": _thickness(start, thickness),
            "young": young,
            "poisson": poisson,
            "density": density,
            "gravity": gravity,
            "snow": snow,
            "wind": arguments.by_name([p.name for p in start.patches], wind, "--wind") if wind else None,
            "cable_area": cable_area,
        }
        values = {} if project.structure is None else asdict(project.structure)
        wanted = projects.Structure(**values | {k: v for k, v in given.items() if v is not None})
        wanted.check(start)
        roof = arguments.to_build(project, say, anyway=anyway, cache=cache, whole=whole)
        say("certifying")
        model = roof.model(wanted, anyway)
        projects.write_all([(output, partial(write_structure, model=model))], say)
    if model.note:
        print(model.note)
    steps = ", ".join(step.name for step in model.steps)
    print(f"{len(model.faces)} elements, {int(model.nodes.sum())} nodes; steps: {steps}")
    print(f"written: {output}; run it with: ccx {output.with_suffix('')}")
    return OK if roof.good else NOT_CERTIFIED


def _thickness(surface: Surface, given: list[str] | None) -> float | dict[str, float] | None:
    """One number, or one by patch where a patch is named."""
    if not given:
        return None
    values = arguments.by_name([patch.name for patch in surface.patches], given, "--thickness")
    names = {patch.name for patch in surface.patches}
    same = len(set(values.values())) == 1 and set(values) == names
    return next(iter(values.values())) if same else values
