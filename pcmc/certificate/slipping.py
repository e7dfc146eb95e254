"""What moves along the way down from a saddle, and which ends of junctions slip."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Floats
from ..surface import Surface
from .collapse import KEY

ALIKE = 6  # decimals of a share: symmetric places differ by rounding
SLIPS = 0.25  # of the mode's largest motion: that much beside a fixed end is a slip of this end


@dataclass(frozen=True, eq=False)
class SlippingEnd:
    """A fixed end of a junction next to which a mode moves almost as far as anywhere.

    Attributes
    ----------
    junction : names of the patches that meet there.
    walls : names of the walls among them.
    place : (3,) the end.
    share : the mode's motion at the junction's next vertex over its largest motion. A mode that the end
        holds rises from 0 along the junction, to about π h / L after an edge h of the length L; one
        that slips jumps, whatever the mesh, and only the triangles at the end hold it.
    """

    junction: str
    walls: tuple[str, ...]
    place: Floats
    share: float


def slipping_ends(surface: Surface, mode: Floats) -> list[SlippingEnd]:
    """The fixed ends of junctions that slip in a mode (n,3), the one that slips most first."""
    motion = np.linalg.norm(mode, axis=1)
    largest = float(motion.max(initial=0.0))
    ends = []
    for curve in surface.topology.junctions:
        for end, beside in (curve.vertices[:2], curve.vertices[:-3:-1]):
            if curve.closed or not surface.fixed[end] or motion[beside] < SLIPS * largest or largest == 0.0:
                continue
            share = float(motion[beside] / largest)
            walls = tuple(surface.patches[i].name for i in curve.sheets if surface.walls[i])
            ends.append(SlippingEnd(_name(surface, curve.sheets), walls, surface.vertices[end], share))
    return sorted(ends, key=lambda end: -round(end.share, ALIKE))  # of equal ones the first of the mesh


def describe_saddle(surface: Surface, index: int, mode: Floats) -> str:
    """The ways down from a saddle: where its lowest mode (n,3) moves most, and which ends slip in it."""
    ways = f"index {index}: {'1 way' if index == 1 else f'{index} ways'} down"
    if not len(mode):
        return ways
    motion = np.linalg.norm(mode, axis=1)
    most = int(np.round(motion / (motion.max() or 1.0), ALIKE).argmax())
    curves = [curve for curve in surface.topology.junctions if most in curve.vertices]
    if curves:
        part = f"the junction {_name(surface, curves[0].sheets)}"
    else:
        face = int(np.flatnonzero((surface.faces == most).any(axis=1))[0])
        part = f"patch {surface.patches[surface.patch_of_face[face]].name!r}"
    text = f"{ways}; the mode moves {part} most, near {_text(surface.vertices[most])}"
    ends = slipping_ends(surface, mode)
    if not ends:
        return text
    junctions = " and of ".join(dict.fromkeys(end.junction for end in ends))
    places = " and ".join(_text(end.place) for end in ends[:4])
    walls = " and of ".join(dict.fromkeys(repr(name) for end in ends for name in end.walls))
    advice = f"hold the bottom of {walls} ({KEY.format('held')})" if walls else "put a wall below it"
    which, verb = ("end", "slips") if len(ends) == 1 else ("ends", "slip")
    return (
        f"{text}; the {which} of {junctions} at {places} {verb}: one edge away the junction moves"
        f" {ends[0].share:.2f} as far, so only the mesh holds it there; {advice}"
    )


def _name(surface: Surface, sheets: tuple[int, ...]) -> str:
    return " | ".join(surface.patches[i].name for i in sheets)


def _text(place: Floats) -> str:
    return str((place.round(3) + 0.0).tolist())
