"""What a project writes for those who build: drawings, panel schedule, structural model, report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

from ..base import validate
from ..base.errors import OptionError
from ..base.files import suffix_of
from ..base.units import Units, expect_length
from ..drawings.drawing_set import check_suffix as check_drawing
from ..drawings.sheet import FORMATS
from ..panelling import Panels
from ..report.document import check_suffix as check_report
from ..structure.model import Structure
from .output import Works

CSV, INP = ".csv", ".inp"
SINGLE = ("panels", "structure", "report")  # keys of one file each


@dataclass(frozen=True)
class Documents:
    """The documents of a roof, and how they are made.

    Attributes
    ----------
    drawings : files of drawings: .dxf, .pdf, .svg; see ``pcmc draw``.
    sheet : format of their sheets.
    panels : the schedule of panels, .csv; NAME-families.csv and NAME-edges.csv come with it.
    tolerance : largest difference of edges in a family of panels; with it drawings and report have them.
    panel_sheets : whether drawings have each panel at true size; needs ``tolerance``.
    structure : the structural model, .inp; needs the section [structure].
    report : the report, .pdf; see ``pcmc report``.
    date : printed in the report, which reads no clock.
    """

    drawings: Sequence[str | Path] = ()
    sheet: str = "A1"
    panels: str | Path | None = None
    tolerance: float | None = None
    panel_sheets: bool = False
    structure: str | Path | None = None
    report: str | Path | None = None
    date: str = ""

    def __post_init__(self) -> None:
        validate.choice("sheet", self.sheet, tuple(FORMATS))
        if self.tolerance is not None:
            validate.positive("tolerance", self.tolerance)
        for drawing in self.drawings:
            check_drawing(Path(drawing))
        if self.panels is not None:
            check_schedule(Path(self.panels))
        if self.structure is not None:
            check_model(Path(self.structure))
        if self.report is not None:
            check_report(self.report)
        for name in ("panels", "panel_sheets"):
            if getattr(self, name) and self.tolerance is None:
                text = f"{name}: needs the largest difference of edges in a family; add tolerance = LENGTH"
                raise OptionError(text, what="tolerance", expected="a length")

    @property
    def names(self) -> list[str]:
        """The names of the files, as they are given."""
        single = [getattr(self, name) for name in SINGLE]
        return [str(name) for name in (*self.drawings, *(name for name in single if name is not None))]

    @property
    def paths(self) -> list[Path]:
        """All files that are known before the roof is; sheets as .svg get numbers."""
        others = schedule_paths(Path(self.panels))[1:] if self.panels is not None else []
        return [Path(name) for name in self.names] + others

    def in_folder(self, folder: Path) -> Documents:
        """The same documents in a folder."""
        single = {name: getattr(self, name) for name in SINGLE}
        moved = {name: folder / path for name, path in single.items() if path is not None}
        return replace(self, drawings=[folder / name for name in self.drawings], **moved)

    def check(self, units: Units, structure: Structure | None) -> None:
        """Refuse documents that need a unit of length or a [structure] which the project does not have."""
        if self.drawings:
            expect_length(units.length, "a drawing")
        if self.report is not None:
            expect_length(units.length, "a report")
        if self.structure is not None and structure is None:
            text = "a structural model needs material and thickness; add [structure] with young and thickness"
            raise OptionError(text, what="structure", expected="a table")


def documents_of(output: Mapping[str, Any]) -> Documents:
    """The documents that [output] asks for."""
    known = [f.name for f in fields(Documents)]
    return Documents(**{name: output[name] for name in known if name in output})


def check_schedule(path: Path) -> None:
    """Refuse the name of a schedule that does not end with .csv."""
    suffix_of(path, (CSV,), "a schedule of panels")


def check_model(path: Path) -> None:
    """Refuse the name of a structural model that does not end with .inp."""
    suffix_of(path, (INP,), "a structural model")


def schedule_paths(path: Path) -> list[Path]:
    """The files of a schedule: panels, families, edges."""
    return [path, *(path.with_name(f"{path.stem}-{name}{path.suffix}") for name in ("families", "edges"))]


def schedule_works(path: Path, schedule: Panels) -> Works:
    """The files of a schedule, each with the function that writes it."""
    tables = (schedule.panels, schedule.families, schedule.edges)
    paths = schedule_paths(path)
    return [(one, partial(table.to_csv, index=False)) for one, table in zip(paths, tables, strict=True)]
