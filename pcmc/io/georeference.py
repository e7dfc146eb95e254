"""Where a surface is on a map."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ..base import validate


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
