"""The chapter of a report on the cutting pattern of a roof."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..base.units import Units, length_factor
from ..plot import strains
from ..plot.figure import png
from .plan import FORMAT, on_paper
from .tables import Block, Columns, Heading, Picture, columns_in, one, text_table

if TYPE_CHECKING:
    from ..cloth import CuttingPattern

PIXELS = 1300  # width of a picture
ABOUT = (
    "Each strip is laid flat with the least strain for which the sides of every seam are equally long. Strain"
    " is that of the cloth on the roof beside the strain from its tension; its mean is the root mean square"
    " over the area. Lengths and widths are those of the cut strip, shortened by the compensation, without"
    " allowances."
)


def cutting(pattern: CuttingPattern, units: Units) -> Iterator[Block]:
    """What is cut in sentences, the strips on the roof from above and coloured by strain, and their table."""
    from ..cloth.sheets import seam_sheet

    table, sewn = pattern.table, pattern.seam_table.query("kind != 'rim'")
    sheet = seam_sheet(pattern, FORMAT, length_factor(units.length, "mm"))
    yield Heading(f"Cutting pattern, scale {sheet.scale}, lengths in {units.length}", new_page=True)
    yield on_paper(sheet.scale, *sheet.drawn())
    area, long = one(float(table["cut_area"].sum())), one(float(sewn["length"].sum()))
    yield f"{len(table)} strips of {area} {units.area} of cloth, {long} {units.length} of seams between them."
    yield ABOUT
    yield Picture("Strain of the cloth", png(strains(pattern, width=PIXELS)))
    columns: Columns = columns_in(table, ["length", "width"], units.length)
    columns |= columns_in(table, ["area", "cut_area"], units.area)
    names = {"strain_min": "strain from", "strain_max": "to", "strain_rms": "mean"}
    names |= {"warp": "warp shorter", "weft": "weft shorter"}
    columns |= columns_in(table.rename(columns=names), names.values(), "%")
    yield text_table("Strips", {"strip": table["strip"], "patch": table["patch"]}, columns)
