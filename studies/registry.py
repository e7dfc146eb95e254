"""Every study by its name. A new study is a file with a ``STUDY`` and a line here."""

from __future__ import annotations

from collections.abc import Iterable

from pcmc.errors import OptionError, unknown

from . import (
    alpha_grid,
    calibration,
    equilibria,
    example1,
    example2,
    example3,
    example4,
    mesh_search,
)
from .study import Study

MODULES = (example1, example2, example3, example4, alpha_grid, calibration, mesh_search, equilibria)
STUDIES: dict[str, Study] = {module.STUDY.name: module.STUDY for module in MODULES}


def chosen(names: Iterable[str]) -> list[Study]:
    """The studies of these names, in the order given."""
    for name in names:
        if name not in STUDIES:
            raise OptionError(unknown("study", name, STUDIES))
    return [STUDIES[name] for name in names]


def of_the_paper() -> list[Study]:
    """What ``reproduce`` runs."""
    return [study for study in STUDIES.values() if study.paper]
