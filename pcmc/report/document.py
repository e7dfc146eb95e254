"""A report as a PDF file: its pages in order."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from .. import quantities
from ..base.files import atomic_write, suffix_of, writing
from ..base.units import Units, as_units, expect_length
from ..certificate import Certificate
from ..certificate.required import certified, warning_mark
from ..panelling import Panels, panels
from ..plot import draw, families, reactions
from ..quantities import Figure
from ..surface import Surface, expect_surface
from . import pages, tables, words
from .plan import PaperPlan, paper_plan

if TYPE_CHECKING:
    from ..accuracy import MeshCheck
    from ..margins import Margin
    from ..verification import Theorem

VERSIONS = ("numpy", "scipy", "reportlab", "matplotlib")
PIXELS = 1300  # width of a picture


@dataclass(frozen=True, eq=False)
class RoofReport:
    """A report about a roof.

    Attributes
    ----------
    surface, units, certificate : the roof, the units of its numbers, and its certificate.
    name, date : in the head and the foot of the pages; empty for none.
    plan : to scale.
    schedule : the panels, if a tolerance was given; else None.
    mesh_check, mesh_failure, targets, theorem, margins : as given to ``roof_report``.
    figures : the key figures.
    files : name of each file that belongs to the roof, and what it is.
    """

    surface: Surface
    units: Units
    certificate: Certificate
    name: str
    date: str
    plan: PaperPlan
    schedule: Panels | None = None
    mesh_check: MeshCheck | None = None
    mesh_failure: str = ""
    targets: pd.DataFrame | None = None
    margins: Sequence[Margin] = ()
    files: Mapping[str, str] = field(default_factory=dict)
    figures: Sequence[Figure] = ()
    theorem: Theorem | None = None

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the report as a PDF file; the same report gives the same bytes.

        Raises
        ------
        FileError : for another suffix than .pdf, or a file that cannot be written.
        """
        path = check_suffix(path)
        content = self.pdf()
        with writing(path), atomic_write(path) as temporary:
            temporary.write_bytes(content)
        return path

    def pdf(self) -> bytes:
        """The bytes of the PDF file."""
        title = f"Report on the roof {self.name}" if self.name else "Report on a roof"
        mark = warning_mark(self.certificate)
        if not mark and self.targets is not None and not self.targets["met"].all():
            mark = "TARGETS NOT MET"
        foot = ", ".join(filter(None, (f"pcmc {version('pcmc-surfaces')}", self.date)))
        return pages.pdf(partial(self._story, self._pictures()), title, foot, mark)

    def _pictures(self) -> dict[str, bytes]:
        """The pictures as PNG files, by what they show."""
        surface = self.surface
        pictures = {
            "The roof": draw(surface, view="diagonal", legend=True, width=PIXELS),
            "Elevation": draw(surface, view="elevation", width=PIXELS),
        }
        if len(self.certificate.supports):
            pictures["Reactions"] = reactions(surface, units=self.units, width=PIXELS)
        if self.schedule is not None:
            pictures["Panels"] = families(self.schedule, width=PIXELS)
        return {name: _png(picture) for name, picture in pictures.items()}

    def _story(self, pictures: Mapping[str, bytes]) -> list[Any]:
        """All that the pages hold, in order; to be used once."""
        surface, certificate, units = self.surface, self.certificate, self.units
        story = [
            pages.heading("Verdict"),
            *map(pages.paragraph, words.verdict_sentences(certificate, self.mesh_check, self.theorem, units)),
            *(pages.paragraph(f"The roof {margin.text(units)}.") for margin in self.margins),
            *pages.table(tables.key_figures(surface, self.figures, units)),
            *pages.picture("View from above", pictures["The roof"]),
            pages.new_page(),
            pages.heading(f"Plan, scale {self.plan.scale}, lengths in {units.length}"),
            pages.plan(self.plan),
            pages.paragraph(words.LEGEND),
            *pages.picture("Elevation", pictures["Elevation"]),
        ]
        if "Reactions" in pictures:
            story += pages.picture("Reactions of the supports on the roof", pictures["Reactions"])
        story += [pages.heading("Forces"), pages.paragraph(words.about_forces(units))]
        if self.targets is not None:
            story += pages.table(tables.target_table(self.targets, self.units))
        listed = [
            tables.patch_table(surface, certificate, units),
            tables.junction_table(certificate, units),
            tables.wall_table(certificate, units),
            *tables.support_tables(certificate, units),
            *tables.cable_tables(certificate, units),
            tables.room_table(certificate, units),
        ]
        for table in listed:
            story += [] if table is None else pages.table(table)
        if self.mesh_check is not None:
            story += self._mesh_story(self.mesh_check)
        elif self.mesh_failure:
            text = f"The mesh could not be checked: {self.mesh_failure}."
            story += [pages.heading("Mesh check"), pages.paragraph(text)]
        if self.schedule is not None:
            story += self._panel_story(self.schedule, pictures["Panels"])
        return story + self._file_story()

    def _mesh_story(self, check: MeshCheck) -> list[Any]:
        sentences = filter(None, (check.verdict.value, check.detail, check.advice))
        text = "; ".join(sentences)
        about = "An error bar estimates how far the limit on finer and finer meshes may be from the number."
        return [
            pages.heading("Mesh check"),
            pages.paragraph(f"{text[:1].upper()}{text[1:]}. {about}"),
            *pages.table(tables.mesh_table(check, self.units)),
        ]

    def _panel_story(self, schedule: Panels, picture: bytes) -> list[Any]:
        units, total = self.units, schedule.edge_totals
        angles = schedule.edges["dihedral"].dropna()
        sentences = [
            f"{len(schedule.panels)} flat triangles in {schedule.count} families. Panels of a family differ"
            f" by at most {schedule.tolerance:g} {units.length} in the length of each edge.",
            f"Together they have an area of {tables.one(schedule.area)} {units.area}, and edges of"
            f" {tables.one(float(total['length'].sum()))} {units.length}.",
            f"The largest has {tables.one(float(schedule.largest['area']))} {units.area}, the smallest"
            f" {tables.one(float(schedule.smallest['area']))} {units.area}.",
        ]
        if len(angles):
            low, high = float(angles.min()), float(angles.max())
            sentences.append(f"The angle between neighbours is from {low:.1f}° to {high:.1f}°.")
        if schedule.count > tables.MOST_FAMILIES:
            sentences.append(f"The table has the {tables.MOST_FAMILIES} largest families.")
        return [
            pages.new_page(),
            pages.heading("Panels"),
            pages.paragraph(" ".join(sentences)),
            *pages.picture("", picture),
            *pages.table(tables.family_table(schedule, units)),
        ]

    def _file_story(self) -> list[Any]:
        files = tables.Table("Files", ["file", "content"], [list(item) for item in self.files.items()], 2)
        rows = [["pcmc", version("pcmc-surfaces")], *([name, version(name)] for name in VERSIONS)]
        programs = tables.Table("Programs", ["program", "version"], rows, 2)
        return [*(pages.table(files) if self.files else []), *pages.table(programs)]


def roof_report(
    surface: Surface,
    units: Units | str,
    *,
    name: str = "",
    tolerance: float | None = None,
    mesh_check: MeshCheck | None = None,
    mesh_failure: str = "",
    theorem: Theorem | None = None,
    targets: pd.DataFrame | None = None,
    margins: Sequence[Margin] = (),
    files: Mapping[str, str] | None = None,
    date: str = "",
    anyway: bool = False,
    certificate: Certificate | None = None,
    schedule: Panels | None = None,
    figures: Sequence[Figure] | None = None,
) -> RoofReport:
    """A report about a roof: pictures, plan, verdict in words, forces, panels, files.

    Parameters
    ----------
    surface : a certified surface, z up.
    units : of its numbers, such as ``Units("m", "kN")``; a text is the unit of length.
    name : of the roof.
    tolerance : of the panels' families, length; None for no panels.
    mesh_check : of the surface, for error bars; None for none.
    mesh_failure : why it was asked for and failed; empty otherwise.
    theorem : of the surface; None for none.
    targets : ``Design.targets``; None for none.
    margins : how far the roof is from the edge, a sentence each.
    files : name of each file that belongs to the roof, and what it is.
    date : of the report, as it is to be printed; no clock is read.
    anyway : report on a surface that is not certified; every page is marked.
    certificate, schedule, figures : of the surface, where they are known; otherwise computed.

    Raises
    ------
    SurfaceError : the surface is not certified.
    OptionError : the unit of length is missing; the tolerance is not above 0.
    MissingExtra : reportlab or matplotlib is not installed.

    Examples
    --------
    >>> from pcmc import Patch
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> roof_report(roof, "m").plan.scale
    '1:20'
    """
    expect_surface(surface)
    units = as_units(units)
    expect_length(units.length, "a report")
    pages.register_fonts()
    certificate = certified(surface, anyway, certificate)
    if schedule is None and tolerance is not None:
        schedule = panels(surface, tolerance, anyway=anyway, certificate=certificate)
    return RoofReport(
        surface,
        units,
        certificate,
        name,
        date,
        paper_plan(surface, certificate, units),
        schedule,
        mesh_check,
        mesh_failure,
        targets,
        margins,
        dict(files or {}),
        quantities.figures(surface, certificate) if figures is None else figures,
        theorem,
    )


def check_suffix(path: str | os.PathLike[str]) -> Path:
    """The path of a report; refuses another suffix than .pdf."""
    suffix_of(path, (".pdf",), "a report")
    return Path(path)


def _png(picture: Any) -> bytes:
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(np.asarray(picture)).save(stream, format="PNG")
    return stream.getvalue()
