"""Every study by its name. A new study is a file with a ``STUDY`` and a line here."""

from __future__ import annotations

from collections.abc import Iterable

from pcmc.base.errors import OptionError, unknown

from . import (
    accuracy,
    alpha_grid,
    alpha_grid_geometric,
    calibration,
    corners,
    coverage,
    equilibria,
    example1,
    example2,
    example3,
    example4,
    existence,
    forces,
    gallery,
    margins,
    mesh_check,
    mesh_search,
    panel_families,
    refinement,
    solvers,
    stability,
    structure,
    verify,
)
from .study import Study

MODULES = (
    example1,
    example2,
    example3,
    example4,
    alpha_grid,
    calibration,
    mesh_search,
    equilibria,
    alpha_grid_geometric,
    corners,
    stability,
    refinement,
    solvers,
    existence,
    mesh_check,
    coverage,
    margins,
    accuracy,
    panel_families,
    gallery,
    forces,
    structure,
    verify,
)
STUDIES: dict[str, Study] = {module.STUDY.name: module.STUDY for module in MODULES}
EXTRAS = "extras"  # in place of a name: all that ``reproduce`` leaves out


def chosen(names: Iterable[str]) -> list[Study]:
    """The studies of these names, in the order given, each once.

    >>> [study.name for study in chosen(["stability", "example1", "stability"])]
    ['stability', 'example1']
    """
    studies: dict[str, Study] = {}
    for name in names:
        if name == EXTRAS:
            studies |= {study.name: study for study in STUDIES.values() if not study.paper}
        elif name in STUDIES:
            studies[name] = STUDIES[name]
        else:
            known = [*STUDIES, EXTRAS]
            raise OptionError(unknown("study", name, known), what="study", found=name, expected=tuple(known))
    return list(studies.values())


def of_the_paper() -> list[Study]:
    """What ``reproduce`` runs."""
    return [study for study in STUDIES.values() if study.paper]
