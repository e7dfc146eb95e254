"""A report as a PDF file: its blocks in order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd

from ..accuracy import Margin, MeshCheck
from ..base.files import PathLike, atomic_write, suffix_of, writing
from ..base.units import Units, as_units, expect_length
from ..certificate import Certificate, quantities
from ..certificate.certificate import certified
from ..certificate.quantities import Figure
from ..certificate.theorem import Theorem
from ..cloth import CuttingPattern
from ..drawings.sheet import MISSED, register_fonts
from ..panelling import Panels, panels
from ..plot import draw, families, reactions
from ..plot.figure import png
from ..structure import Analysis, StructuralModel
from ..surface import Surface, expect_surface
from ..surface.images import expect_no_images
from . import tables
from .chapters import PIXELS, at_rest_chapter, cutting_chapter, under_load_chapter
from .plan import PaperPlan, paper_plan
from .tables import Block, Heading, Picture, Table
from .words import ERROR_BARS, LEGEND, about_forces, panel_text, sentence, verdict_sentences

SUFFIXES = (".pdf",)
VERSIONS = ("numpy", "scipy", "reportlab", "matplotlib")


@dataclass(frozen=True, eq=False)
class RoofReport:
    """A report about a roof; see ``roof_report``."""

    surface: Surface
    units: Units  # of its numbers
    certificate: Certificate
    plan: PaperPlan  # to scale
    figures: Sequence[Figure]  # the key figures
    schedule: Panels | None = None
    name: str = ""  # in the head of the pages
    date: str = ""  # in their foot
    mesh_check: MeshCheck | None = None
    mesh_failure: str = ""
    theorem: Theorem | None = None
    targets: pd.DataFrame | None = None
    margins: Sequence[Margin] = ()
    analysis: Analysis | None = None
    model: StructuralModel | None = None
    pattern: CuttingPattern | None = None
    files: Mapping[str, str] = field(default_factory=dict)

    def write(self, path: PathLike) -> Path:
        """Write the report as a PDF file; the same report gives the same bytes.

        FileError for another suffix than .pdf, or a file that cannot be written.
        """
        suffix_of(path, SUFFIXES, "a report")
        content = self.pdf()
        with writing(path), atomic_write(path) as temporary:
            temporary.write_bytes(content)
        return Path(path)

    def pdf(self) -> bytes:
        from .pages import pdf  # needs reportlab

        title = f"Report on the roof {self.name}" if self.name else "Report on a roof"
        missed = self.targets is not None and not self.targets["met"].all()
        foot = ", ".join(filter(None, (f"pcmc {version('pcmc-surfaces')}", self.date)))
        return pdf(list(self._blocks()), title, foot, self.certificate.mark or MISSED * missed)

    def _blocks(self) -> Iterator[Block]:
        surface, certificate, units = self.surface, self.certificate, self.units
        yield Heading("Verdict")
        yield from verdict_sentences(certificate, self.mesh_check, self.theorem, units)
        yield from (f"The roof {margin.text(units)}." for margin in self.margins)
        yield tables.key_figures(surface, self.figures, units)
        yield Picture("View from above", png(draw(surface, view="diagonal", legend=True, width=PIXELS)))
        yield Heading(f"Plan, scale {self.plan.scale}, lengths in {units.length}", new_page=True)
        yield self.plan
        yield LEGEND
        yield Picture("Elevation", png(draw(surface, view="elevation", width=PIXELS)))
        if len(certificate.supports):
            acting = png(reactions(surface, units=units, width=PIXELS))
            yield Picture("Reactions of the supports on the roof", acting)
        yield Heading("Forces")
        yield about_forces(units, certificate)
        if self.targets is not None:
            yield tables.target_table(self.targets, units)
        yield tables.table_of_patches(surface, certificate, units)
        yield from tables.line_tables(certificate, units)
        yield from tables.cable_tables(certificate, units)
        if self.mesh_check is not None or self.mesh_failure:
            yield Heading("Mesh check")
        if (check := self.mesh_check) is not None:
            parts = filter(None, (check.verdict.value, check.detail, check.advice))
            yield f"{sentence('; '.join(parts))} {ERROR_BARS}"
            yield tables.mesh_table(check, units)
        elif self.mesh_failure:
            yield f"The mesh could not be checked: {self.mesh_failure}."
        if self.analysis is not None:
            yield from under_load_chapter(self.analysis, units)
        elif self.model is not None:
            yield from at_rest_chapter(self.model, units)
        if self.pattern is not None:
            yield from cutting_chapter(self.pattern, units)
        if self.schedule is not None:
            yield Heading("Panels", new_page=True)
            yield panel_text(self.schedule, units)
            yield Picture("", png(families(self.schedule, width=PIXELS)))
            yield tables.family_table(self.schedule, units)
        if self.files:
            yield Table("Files", ["file", "content"], [list(item) for item in self.files.items()], 2)
        rows = [["pcmc", version("pcmc-surfaces")], *([name, version(name)] for name in VERSIONS)]
        yield Table("Programs", ["program", "version"], rows, 2)


def roof_report(
    surface: Surface,
    units: Units | str,
    *,
    tolerance: float | None = None,
    anyway: bool = False,
    certificate: Certificate | None = None,
    schedule: Panels | None = None,
    figures: Sequence[Figure] | None = None,
    **about: Any,
) -> RoofReport:
    """A report about a roof: pictures, plan, verdict in words, forces, panels, files.

    Parameters
    ----------
    surface : a certified surface, z up.
    units : of its numbers, such as ``Units("m", "kN")``; a text is the unit of length.
    tolerance : of the panels' families, length; None for no panels.
    anyway : report on a surface that is not certified; every page is marked.
    certificate, schedule, figures : of the surface, where they are known; otherwise computed.
    about : ``name`` of the roof; ``date`` as it is to be printed, no clock is read; ``mesh_check`` of the
        surface, for error bars, or ``mesh_failure``, why it failed; ``theorem`` of the surface; ``targets``
        of a ``Design``; ``margins``, a sentence each; ``analysis`` under load, of ``pcmc.analyse``, or the
        structural ``model``, for the forces of its members at rest; ``pattern``, of ``pcmc.cutting_pattern``;
        ``files``, the name of each file and what it is.

    Raises
    ------
    SurfaceError : the surface is not certified.
    OptionError : the unit of length is missing; the tolerance is not above 0.
    MissingExtra : reportlab or matplotlib is not installed.

    >>> from pcmc import Patch
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> roof_report(roof, "m").plan.scale
    '1:20'
    """
    expect_surface(surface)
    expect_no_images(surface, "a report")
    units = as_units(units)
    expect_length(units.length, "a report")
    register_fonts()
    certificate = certified(surface, anyway, certificate)
    if schedule is None and tolerance is not None:
        schedule = panels(surface, tolerance, anyway=anyway, certificate=certificate)
    figures = quantities.figures(surface, certificate) if figures is None else figures
    plan = paper_plan(surface, certificate, units)
    return RoofReport(surface, units, certificate, plan, figures, schedule, **about)
