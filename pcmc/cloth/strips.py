"""The values of a cutting pattern: strips, seams, and their tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ..base.arrays import Floats, Ints, cached_array
from ..base.libraries import load_library
from ..base.units import NO_UNITS, Units
from ..certificate import Certificate
from ..certificate.tables import head_text
from ..surface import Surface
from ..surface.geometry import cross_2d, face_areas, lengths_along, segment_lengths
from .settings import CuttingOptions


@dataclass(frozen=True, eq=False)
class Strip:
    """A piece of cloth. Lengths are in the surface's unit; the warp is along x.

    Attributes
    ----------
    number, patch : its number, from 1, and the name of its patch.
    faces : (t,3) triangles of its vertices.
    source : (t,) the face of the surface that each is a part of.
    roof : (v,3) its vertices on the roof.
    flat : (v,2) laid flat, as long as on the roof but for its strain.
    stretch : cut length over flat length along warp and weft.
    strain : (t,2) least and largest principal strain of the cloth on the roof, beyond that from tension.
    outlines : vertices of its outline, counter-clockwise, and of its holes.
    """

    number: int
    patch: str
    faces: Ints
    source: Ints
    roof: Floats
    flat: Floats
    stretch: tuple[float, float]
    strain: Floats
    outlines: Sequence[Ints]

    @cached_array
    def cut(self) -> Floats:
        """(v,2) as it is cut, without allowances: compensated, with x and y from 0."""
        cut = self.flat * np.array(self.stretch)
        return cut - cut.min(axis=0)

    @cached_property
    def polygon(self) -> Any:
        """Its outline and holes, cut, as a polygon of shapely."""
        outline, *holes = (self.cut[loop] for loop in self.outlines)
        return load_library("shapely", "cloth").Polygon(outline, holes)

    @property
    def length(self) -> float:
        """Of the cut strip along the warp, length."""
        return float(self.cut[:, 0].max())

    @property
    def width(self) -> float:
        """Of the cut strip along the weft, length."""
        return float(self.cut[:, 1].max())

    @cached_array
    def areas(self) -> Floats:
        """(t,) areas of its triangles on the roof, length²."""
        return face_areas(self.roof[self.faces])

    @property
    def area(self) -> float:
        """On the roof, length²."""
        return float(self.areas.sum())

    @property
    def cut_area(self) -> float:
        """Cut, without allowances, length²."""
        a, b, c = self.cut[self.faces].transpose(1, 0, 2)
        return 0.5 * float(cross_2d(b - a, c - a).sum())


class Side(NamedTuple):
    """One side of a seam: the edges (k,2) of a strip, in the order and direction of the seam."""

    strip: int  # its number
    edges: Ints
    forward: bool  # whether the strip lies to the left of the seam, seen from outside


@dataclass(frozen=True, eq=False)
class Seam:
    """A line along which cloth is cut: a seam within a sheet, a junction of sheets, a rim, or the line in a
    mirror plane, which is a seam to the image."""

    number: int
    kind: str  # "seam", "junction", "mirror" or "rim"
    points: Floats  # (k,3) on the roof; the first is repeated at the end if it is closed
    sides: Sequence[Side]

    @property
    def length(self) -> float:
        """On the roof, length."""
        return float(lengths_along(self.points)[-1])


@dataclass(frozen=True, eq=False)
class CuttingPattern:
    """The cutting pattern of a roof. ``print`` shows the table of its strips.

    Attributes
    ----------
    surface, certificate : the surface and its certificate.
    options : the widths, directions, compensations and allowances that it was made for.
    strips : in the order of their numbers.
    seams : all lines between and around them, in the order of their numbers.

    >>> from pcmc import Patch, Surface, cutting_pattern
    >>> flat = Surface([[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]], [[0, 1, 2], [0, 2, 3]], [0, 0],
    ...                [Patch("sail", 2.0, pressure=0.0)], fixed=range(4))
    >>> pattern = cutting_pattern(flat, strips=2)
    >>> pattern.table[["length", "width"]].round(6).to_numpy().tolist()
    [[4.0, 1.5], [4.0, 1.5]]
    """

    surface: Surface
    certificate: Certificate
    options: CuttingOptions
    strips: Sequence[Strip]
    seams: Sequence[Seam] = field(repr=False)

    @cached_property
    def table(self) -> pd.DataFrame:
        """A row per strip: ``strip``, ``patch``; ``length`` along the warp and ``width``, cut, without
        allowances; ``area`` on the roof and ``cut_area``; ``strain_min``, ``strain_max``, the extremes of the
        principal strains, and ``strain_rms``, of the mean over the area, percent; ``warp`` and ``weft``, the
        compensations, percent."""
        rows = []
        for s in self.strips:
            rms = np.sqrt((s.areas @ (s.strain**2).sum(axis=1)) / s.area)
            percents = 100.0 * np.array([s.strain.min(), s.strain.max(), rms, *np.subtract(1.0, s.stretch)])
            rows.append([s.number, s.patch, s.length, s.width, s.area, s.cut_area, *percents.tolist()])
        head = ["strip", "patch", "length", "width", "area", "cut_area"]
        return pd.DataFrame(rows, columns=[*head, "strain_min", "strain_max", "strain_rms", "warp", "weft"])

    @cached_property
    def seam_table(self) -> pd.DataFrame:
        """A row per seam: ``seam``, ``kind``; ``strips`` beside it; ``length`` on the roof, ``cut_length``;
        ``difference`` between the cut lengths of its sides, as a part of the length; its ends ``x0``...``z1``
        on the roof: as ``seams`` of another pattern they can be moved."""
        rows = []
        for seam in self.seams:
            cut = [self.side_lengths(side).sum() for side in seam.sides]
            lengths = seam.length, float(np.mean(cut)), np.ptp(cut) / seam.length
            beside = " | ".join(str(side.strip) for side in seam.sides)
            rows.append([seam.number, seam.kind, beside, *lengths, *seam.points[[0, -1]].ravel().tolist()])
        head = ["seam", "kind", "strips", "length", "cut_length", "difference"]
        return pd.DataFrame(rows, columns=[*head, *(f"{c}{k}" for k in (0, 1) for c in "xyz")])

    @property
    def largest_difference(self) -> float:
        """Of the cut lengths of two sides of an edge of a seam, as a part of its length."""
        worst = [0.0]
        for seam in self.seams:
            apart = np.ptp([self.side_lengths(side) for side in seam.sides], axis=0)
            worst.append(float((apart / np.linalg.norm(np.diff(seam.points, axis=0), axis=1)).max()))
        return max(worst)

    def side_lengths(self, side: Side) -> Floats:
        """(k,) the cut lengths of the edges of a seam's side."""
        return segment_lengths(self.strips[side.strip - 1].cut, side.edges)

    def text(self, units: Units = NO_UNITS) -> str:
        """Totals and the table of strips, with the units of the numbers if they are given."""
        table, seams = self.table, self.seam_table
        sewn = seams[seams["kind"] != "rim"]
        low, high, total = table.min(), table.max(), table.sum()
        rows = {"strips": f"{len(table)}, up to {high['length']:.5g} long and {high['width']:.5g} wide"}
        rows["area"] = f"{total['area']:.6g} on the roof, {total['cut_area']:.6g} cut"
        rows["strain"] = f"{low['strain_min']:.2g} to {high['strain_max']:.2g} %"
        apart = f"their sides differ by at most {self.largest_difference:.1g} of the length"
        rows["seams"] = f"{len(sewn)}, {sewn['length'].sum():.5g} long; {apart}"
        if table[["warp", "weft"]].to_numpy().any():
            warp, weft = (f"{low[way]:.3g} to {high[way]:.3g} %" for way in ("warp", "weft"))
            rows["cut shorter"] = f"by {warp} along the warp, {weft} along the weft"
        head = head_text(self.certificate, units, rows)
        return f"{head}\n\n{table.to_string(index=False, float_format=lambda x: f'{x:.4g}')}"

    __str__ = text
