"""Where a surface is on a map."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ..base import validate
from ..base.errors import OptionError
from ..base.units import Units, length_factor
from ..surface import Surface

FAR = 10.0  # sizes of a surface from zero: what is nearer tells nothing about a map
SAME = 0.05  # of eastings or northings: what is so near to them is the same place


@dataclass(frozen=True)
class Georeference:
    """The place of a surface's coordinates on a map, for .ifc files.

    >>> Georeference("EPSG:25832", eastings=691_000.0, northings=5_334_000.0, height=519.5).rotation
    0.0

    Attributes
    ----------
    crs : the map's coordinate system in the EPSG dataset, such as "EPSG:25832"; its unit is the metre.
    eastings, northings : of the point [0, 0], metres; 0 where the coordinates are those of the map.
    height : of z = 0 in the map's system of heights, metres.
    rotation : from east to the x axis, towards north, degrees.
    """

    crs: str
    eastings: float = 0.0
    northings: float = 0.0
    height: float = 0.0
    rotation: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.crs, str) or not re.fullmatch(r"EPSG:[0-9]{4,6}", self.crs):
            validate.refuse("crs", self.crs, 'a coordinate system such as "EPSG:25832"')
        for name in ("eastings", "northings", "height", "rotation"):
            validate.number(name, getattr(self, name))

    def check(self, surface: Surface, units: Units) -> None:
        """Refuse eastings, northings or a height that the surface's own coordinates have already."""
        metre = length_factor(units.length, "m")
        middle, far = metre * surface.vertices.mean(axis=0), FAR * metre * surface.size
        names = ("eastings", "northings", "height")
        for name, axis, found in zip(names, "xyz", middle.tolist(), strict=True):
            given = getattr(self, name)
            if abs(given) > far and abs(found - given) < SAME * abs(given):
                text = f"{name} = {given:.12g}: the surface is at {axis} = {found:.0f} m itself, and would be"
                text += f" at twice the place; leave {name} out, or draw it near {axis} = 0"
                raise OptionError(text, what=name, found=given)
