"""The chapters of a report on a roof under load, on its members at rest, and on its cutting pattern."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pandas as pd

from ..base.units import Units
from ..cloth import CuttingPattern
from ..cloth.sheets import seam_sheet
from ..drawings.sheet import column
from ..plot import member_forces, strains, under_load
from ..plot.figure import png
from ..structure import Analysis, StructuralModel
from ..structure.columns import column_answers, columns_at_rest
from ..structure.member_forces import member_tables, members_at_rest, sentences
from .plan import FORMAT, on_paper
from .tables import Block, Columns, Heading, Picture, columns_in, one, text_table, vectors_of
from .words import sentence

PIXELS = 1300  # width of a picture
ABOUT = (
    "Each case starts from the form-finding load and self-weight; combinations have the factors of the "
    "project. Deflections are along the normal of the plane. Forces of the membrane are principal stresses "
    "times the thickness; where the least of them is not above 0 the membrane is slack and wrinkles. A share "
    "below 100 % is the part of the loads up to which CalculiX finds an equilibrium, taut that up to which "
    "nothing is slack. Beyond it the share depends on the mesh; taut hardly does."
)
SIGNS = (
    "N is above 0 in tension. V and M are the largest shear force and moment, in whichever direction. The "
    "pull of the sheets is the load, in the deformed shape. Buckling is "
    "the factor on the forces along a member at which it buckles alone, without the sheets that hold it."
)
ABOUT_COLUMNS = (
    "They follow from the forces of the supports by statics; N is above 0 in tension. A stay that would be "
    "pressed is left out, with N = 0. Euler's load is that of a column with hinged ends. Their own weight is "
    "left out."
)
ABOUT_CLOTH = (
    "Each strip is laid flat with the least strain for which the sides of every seam are equally long. Strain"
    " is that of the cloth on the roof beside the strain from its tension; its mean is the root mean square"
    " over the area. Lengths, widths and cut areas are those of the cut strip, shortened by the"
    " compensation, without allowances."
)


def under_load_chapter(analysis: Analysis, units: Units) -> Iterator[Block]:
    """Cases, answers, pictures, and the tables of patches, supports and cables."""
    force = units.force or "force"
    yield Heading("Under load", new_page=True)
    yield ABOUT
    table = analysis.table
    columns: Columns = {f"{key}, %": [f"{100.0 * v:.0f}" for v in table[key]] for key in ("share", "taut")}
    kinds = {"down up moved": units.length, "least_force largest_force": units.tension}
    kinds |= {"slack_area": units.area} | ({"pressure": units.pressure} if "pressure" in table else {})
    columns |= columns_in(table, kinds)
    yield text_table("Cases and combinations", table[["case"]], columns)
    yield from map(sentence, analysis.answers(units))
    for what in ("deflection", "least force"):
        yield Picture("", png(under_load(analysis, what=what, units=units, width=PIXELS)))
    kinds = {"least_force mean_force largest_force": units.tension, "slack_area": units.area}
    columns = columns_in(analysis.patches, kinds)
    yield text_table("Membrane forces by patch", analysis.patches[["case", "patch"]], columns)
    table = analysis.supports.rename(columns={"support": "", "name": "of"})
    columns = {f"length, {units.length}": column(table["length"].where(table["length"] > 0.0))}
    columns |= vectors_of(table, "force", "F", force)
    yield text_table("Forces of the supports on the roof", table[["case", "", "of", "kind"]], columns)
    if len(table := analysis.cables):
        columns = columns_in(table, {"least largest": force})
        yield text_table("Forces of cables", table[["case", "cable"]], columns)
    pictures = [png(member_forces(analysis, units=units, width=PIXELS))] if len(analysis.members) else []
    yield from _members(analysis.model, analysis.members, units, *pictures)
    yield from _columns(analysis.model, analysis.columns, units)


def at_rest_chapter(model: StructuralModel, units: Units) -> Iterator[Block]:
    """The forces of members under the form-finding load, where no load cases were run."""
    rest = model.steps[0].name, members_at_rest(model)
    if model.beams or model.bars:
        yield Heading("Members at rest", new_page=True)
        yield "These are the forces under the form-finding load alone; no load cases were run."
    yield from _members(model, member_tables([rest])[0], units)
    yield from _columns(model, columns_at_rest(model), units)


def _columns(model: StructuralModel, table: pd.DataFrame, units: Units) -> Iterator[Block]:
    if not len(table):
        return
    profiles = {bar.name: bar.member.profile for bar in model.bars}
    sections = {name: p.label if p.shape else f"A = {p.area:.4g}" for name, p in profiles.items()}
    words: Columns = dict(table[["case", "member", "kind"]])
    words[f"section, {units.length}"] = table["member"].map(sections)
    kinds = {"length": units.length, "N euler": units.force or "force", "stress": units.pressure}
    columns = columns_in(table, kinds)
    shares = {"of its strength, %": 100.0 * table["utilisation"], "Euler over thrust": table["euler_over"]}
    columns |= {title: ["" if math.isnan(v) else f"{v:.3g}" for v in own] for title, own in shares.items()}
    yield text_table("Forces of columns and stays", words, columns)
    yield ABOUT_COLUMNS
    yield from map(sentence, column_answers(model, table, units))


def _members(model: StructuralModel, table: pd.DataFrame, units: Units, *pictures: bytes) -> Iterator[Block]:
    if not len(table):
        return
    force, length, beams = units.force or "force", units.length, model.beams
    profiles = [line.member.profile for line in beams]
    words: Columns = {
        "member": [line.name for line in beams],
        "in the place of": [line.wall or "a support" for line in beams],
        f"section, {length}": [profile.label for profile in profiles],
    }
    columns: Columns = {f"A, {units.area}": [f"{profile.area:.4g}" for profile in profiles]}
    for k, where in enumerate(("upright", "across")):
        columns[f"I {where}, {length}⁴"] = [f"{profile.moments[k]:.4g}" for profile in profiles]
    columns[f"E, {units.pressure}"] = [f"{line.member.material.young:.4g}" for line in beams]
    yield text_table("Members", words, columns)
    columns = columns_in(table, {"least_N largest_N V": force, "M": f"{force}·{length}", "moved": length})
    columns["span over it"] = [f"{over:.3g}" if over < 1e3 else f"{over:.0f}" for over in table["span_over"]]
    columns["buckling"] = ["" if math.isnan(factor) else f"{factor:.4g}" for factor in table["buckling"]]
    yield text_table("Forces of members", table[["case", "member"]], columns)
    yield SIGNS
    yield from (Picture("", picture) for picture in pictures)
    yield from (f"{line}." for line in sentences(model, units))


def cutting_chapter(pattern: CuttingPattern, units: Units) -> Iterator[Block]:
    """What is cut in sentences, the strips on the roof from above and coloured by strain, and their table."""
    table, sewn = pattern.table, pattern.seam_table.query("kind != 'rim'")
    sheet = seam_sheet(pattern, FORMAT, units.length)
    yield Heading(f"Cutting pattern, scale {sheet.scale}, lengths in {units.length}", new_page=True)
    yield on_paper(sheet.scale, *sheet.drawn())
    area, cut = (f"{one(float(table[of].sum()))} {units.area}" for of in ("area", "cut_area"))
    seams = f"{one(float(sewn['length'].sum()))} {units.length} of seams"
    yield f"{len(table)} strips, together {area} on the roof, {cut} cut; {seams} between them."
    yield ABOUT_CLOTH
    yield Picture("Strain of the cloth", png(strains(pattern, width=PIXELS)))
    heads = {"strain_min": "strain_from", "strain_max": "to", "strain_rms": "mean"}
    table = table.rename(columns=heads | {"warp": "warp_shorter", "weft": "weft_shorter"})
    kinds = {"length width": units.length, "area cut_area": units.area}
    columns = columns_in(table, kinds | {"strain_from to mean warp_shorter weft_shorter": "%"})
    yield text_table("Strips", table[["strip", "patch"]], columns)
