"""Every study by its name. A new study is a file with a ``STUDY`` and a line here."""

from __future__ import annotations

from collections.abc import Iterable

from pcmc.base.errors import OptionError, unknown

from .alpha_grid import geometric, grid, several
from .corners import ends
from .coverage import bars
from .examples import calibration, equilibria, example1, example2, example3, example4, mesh_search
from .forces import checks
from .gallery import surfaces
from .questions import (
    accuracy,
    bench,
    bifurcations,
    cells,
    cloth,
    curved,
    equilibria_atlas,
    existence,
    margins,
    mesh_check,
    panel_families,
    panel_nets,
    programs,
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
    grid,
    calibration,
    mesh_search,
    equilibria,
    geometric,
    several,
    ends,
    stability,
    refinement,
    curved,
    solvers,
    existence,
    mesh_check,
    bars,
    margins,
    equilibria_atlas,
    bifurcations,
    accuracy,
    panel_families,
    panel_nets,
    cloth,
    surfaces,
    cells,
    checks,
    structure,
    programs,
    bench,
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
