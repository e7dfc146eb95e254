"""The findings about a roof in plain sentences."""

from __future__ import annotations

from ..accuracy import MeshCheck
from ..base.units import NO_UNITS, Units
from ..certificate import Certificate, Verdict
from ..certificate.supports import balance_sentence
from ..certificate.theorem import Theorem
from ..panelling import Panels
from .tables import MOST_FAMILIES, one, small

VERDICTS = {  # what each verdict means for those who build
    Verdict.STABLE: "The roof is in equilibrium, and the equilibrium is stable: tension and pressure balance"
    " everywhere, and after any small disturbance the roof returns to this shape.",
    Verdict.NEUTRAL: "The roof is in equilibrium, but some change of shape needs almost no force. Hold the"
    " roof against that change, or change tensions, before you build it.",
    Verdict.SADDLE: "The roof is in equilibrium, but leaves this shape at the smallest disturbance. Do not"
    " build it like this.",
    Verdict.NOT_CONVERGED: "The roof is not in equilibrium yet: the forces do not balance. Solve it further.",
    Verdict.NO_EQUILIBRIUM: "There is no equilibrium: no smooth shape balances these tensions and loads.",
    Verdict.NONE_FOUND: "No equilibrium was found; that there is none is not proved.",
    Verdict.RAN_AWAY: "No equilibrium is known: the shape moved away without coming to rest.",
    Verdict.UNDECIDED: "Rounding of numbers hides whether the roof is in equilibrium, or stable.",
    Verdict.WALL_DOWN: "A ridge comes down on the bottom of its wall, where it cannot rest.",
    Verdict.DEGENERATE: "Triangles have collapsed or are folded: the shape says nothing about a roof.",
}

LEGEND = (  # of the plan
    "J1, J2 and so on number the junctions, B1, B2 and so on the supports along lines, S1, S2 and so on those"
    " at points, C1, C2 and so on the ends of cables on lines, as in the tables. Black: rims. Red: ridges."
    " Green: bottoms and ends of walls. Violet: cables. Grey: edges of panels, and mirrors."
)
ERROR_BARS = "An error bar estimates how far the limit on finer and finer meshes may be from the number."

SEEN = 5e-5  # of a number: less is not seen in its four digits


def verdict_sentences(
    certificate: Certificate,
    check: MeshCheck | None = None,
    theorem: Theorem | None = None,
    units: Units = NO_UNITS,
) -> list[str]:
    """The verdict, its reason, and how exactly the roof keeps what it promises.

    >>> from pcmc import Patch, Surface, certify
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> verdict_sentences(certify(roof))[0][:52]
    'The roof is in equilibrium, and the equilibrium is s'
    """
    sentences = [VERDICTS[certificate.verdict]]
    if certificate.detail:
        sentences.append(f"In detail: {certificate.detail}.")
    sentences.append(f"The forces left are {small(certificate.residual)} of the forces in the roof.")
    if certificate.index is not None:
        up_to = f", up to {small(certificate.curvature_error)} of it" * (certificate.curvature_error > 0.0)
        asked = "By its forces each patch has the mean curvature that its tension and pressure ask for"
        sentences.append(f"{asked}{up_to}.")
        share = f"{100.0 * certificate.load_ratio:.0f} %"
        if share != "0 %":  # as in a cushion, whose sheets are pushed apart
            sentences.append(f"Pressure and weight use {share} of the most that the boundary could carry.")
    if len(certificate.supports):
        sentences.append(sentence(balance_sentence(certificate.balance, certificate.symmetric_in)))
    if check is not None:
        sentences.append(f"The mesh check: {check.verdict.value.partition(': ')[2]}.")
    if theorem is not None:
        sentences.append(sentence(theorem.text(units)))
    if planes := ", ".join(certificate.symmetric_in):
        about = f"the verdict is about changes of shape that are symmetric in {planes}"
        sentences.append(f"This is {certificate.part}; {about}.")
    if certificate.cuts_itself:
        sentences.append(f"It cannot be built as it is: {certificate.cuts_itself}.")
    if count := len(certificate.pinched):
        sentences.append(f"The ridge rests on the plane at {count} {'vertex' if count == 1 else 'vertices'}.")
    return sentences


def sentence(text: str) -> str:
    """A text with a capital and a full stop."""
    return f"{text[:1].upper()}{text[1:]}."


def about_forces(units: Units, certificate: Certificate) -> str:
    """How the signs and units of the tables are meant, and how far reactions differ from loads."""
    force = units.force or "the unit of force of the tensions"
    text = f"Lengths are in {units.length}, forces in {force}. Reactions are the forces of the supports on"
    text += " the roof: z is up, so a negative z holds the roof down."
    if len(certificate.supports) and (share := certificate.balance["force_share"].iloc[-1]) > SEEN:
        text += f" Their sum differs from that of the loads by {100.0 * share:.1g} %, the remainder of the"
        text += " balance: the mesh leaves it along its sheets, and finer triangles make it smaller."
    return text


def panel_text(schedule: Panels, units: Units) -> str:
    """How many panels and families there are, how large, and how they meet."""
    total, angles = schedule.edge_totals, schedule.edges["dihedral"].dropna()
    largest, smallest = (one(float(panel["area"])) for panel in (schedule.largest, schedule.smallest))
    text = (
        f"{len(schedule.panels)} flat triangles in {schedule.count} families. Panels of a family differ"
        f" by at most {schedule.tolerance:g} {units.length} in the length of each edge. Together they have an"
        f" area of {one(schedule.area)} {units.area}, and edges of {one(float(total['length'].sum()))}"
        f" {units.length}. The largest has {largest} {units.area}, the smallest {smallest} {units.area}."
    )
    if len(angles):
        text += f" The angle between neighbours is from {angles.min():.1f}° to {angles.max():.1f}°."
    if schedule.count > MOST_FAMILIES:
        text += f" The table has the {MOST_FAMILIES} largest families."
    return text
