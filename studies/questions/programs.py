"""Two finite-element programs on the same structural models: CalculiX, which pcmc runs, and Kratos.

Each shape stands under the load that it was found for, and then under snow. Deflection, principal stresses
and the sum of the reactions of both programs stand side by side.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from generators import bezier_hall, spherical_cap, two_caps
from pcmc import StructuralModel, Surface, analyse, solve
from pcmc.base.arrays import Floats
from pcmc.structure import StepResults, calculix

from ..folder import Folder
from ..reference import kratos
from ..study import Study
from . import structure

SHAPES: dict[str, Callable[[], Surface]] = {
    "cap": lambda: spherical_cap(0.1, alpha=0.6),
    "Example 2": lambda: two_caps(0.6),
    "Example 4": lambda: bezier_hall(6.0),
    "L-shaped roof": lambda: structure.roof(0.7),
}
DEFLECTION, REACTIONS = "deflection / size", "reactions, upwards"
APART = "principal stresses apart / (α/t)"


def data(folder: Folder, short: bool) -> None:
    """``records``: a row per shape, step and quantity."""
    calculix.expect_program()
    rows: list[structure.Row] = []
    for shape, build in list(SHAPES.items())[: 1 if short else None]:
        model = structure.structural_model(solve(build(), target="stationary").surface)
        calculated = [case.results for case in analyse(model, remedy=False).cases]
        both = zip(calculated, kratos.run(model), strict=True)
        for k, (step, (one, other)) in enumerate(zip(model.steps, both, strict=True)):
            about: structure.Row = {"shape": shape, "triangles": model.surface.m, "step": step.name}
            ours, theirs = numbers(model, one), numbers(model, other)
            for quantity in ours if k else list(ours)[1:]:  # under the form's own load nothing moves
                a, b = ours[quantity], theirs[quantity]
                found: structure.Row = {"quantity": quantity, "CalculiX": a, "Kratos": b}
                rows.append(about | found | {"difference": abs(a - b) / max(abs(a), abs(b))})
            apart = principal(model, one) - principal(model, other)
            rows.append(about | {"quantity": APART, "difference": float(np.abs(apart).max())})
    folder.write_table("records", structure.rounded(rows))


def numbers(model: StructuralModel, found: StepResults | kratos.KratosResults) -> dict[str, float]:
    """Deflection, least and largest principal stress over the largest α/t, and the reactions upwards."""
    up, stress = np.array(model.surface.plane.normal), principal(model, found)
    return {
        DEFLECTION: -float((found.displacements[model.nodes] @ up).min()) / model.surface.size,
        "least stress / (α/t)": float(stress.min()),
        "largest stress / (α/t)": float(stress.max()),
        REACTIONS: float((found.reactions @ up).sum()),
    }


def principal(model: StructuralModel, found: StepResults | kratos.KratosResults) -> Floats:
    """(e,2) the principal stresses of the elements over the largest α/t."""
    stress = found.principal_stresses
    if isinstance(found, StepResults):
        stress = stress[model.faces]
    return np.asarray(stress / model.prestress.max())


def table(folder: Folder) -> dict[str, float]:
    """The largest difference of each quantity under snow, and of the stresses under the form's load."""
    records = folder.read_table("records")
    snow = records[records.step == "snow"].groupby("quantity").difference.max()
    names = {
        DEFLECTION: "deflection",
        REACTIONS: "reactions",
        APART: "stresses",
    }
    measured = {name: float(snow[quantity]) for quantity, name in names.items()}
    form = records[(records.step != "snow") & (records.quantity == APART)]
    return measured | {"stresses_form": float(form.difference.max())}


def figure(folder: Folder) -> None:
    """None: the records stand side by side."""


STUDY = Study(
    "programs",
    "CalculiX and Kratos side by side on the structural models: deflection, stresses, reactions",
    data,
    table,
    figure,
    parameters={"thickness": structure.THICKNESS, "strain": structure.STRAIN, "snow": structure.SNOW},
    seconds=60,
    paper=False,
)
