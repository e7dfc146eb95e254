"""Cables of a structural model: trusses with the tension of the cable.

Beams would bend: beside a held end over a length √(EI/τ), which a thick cable feels over a whole bay.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import Floats, Ints
from ..base.errors import OptionError
from ..io.text import format_rows
from ..surface import Surface
from ..surface.geometry import segment_lengths

POINTS = 8  # integration points of a T3D2 element, which is expanded to a brick
THINNEST = 1e-9  # a thickness, in the size of the surface: thinner ones overflow the stresses


def short(value: float) -> str:
    """A number in at most 20 characters, the field of an input file.

    >>> short(-1e-5 / 3)
    '-3.33333333333e-06'
    """
    return f"{value:.12g}"


def checked_areas(given: object, surface: Surface) -> tuple[float, ...]:
    """The area of each cable's section, from one number or one by name."""
    names = [cable.name for cable in surface.cables]
    limits: dict[str, Any] = {"least": (THINNEST * surface.size) ** 2, "most": surface.size**2}
    if given is None and names:
        message = f"cable_area is missing: give the area of the section of cable {names[0]!r}, length²"
        raise OptionError(message, what="cable_area", where=names[0])
    if isinstance(given, Mapping):
        for name in given:
            validate.choice("cable", name, names)
        return tuple(validate.number("cable_area", given.get(name), where=name, **limits) for name in names)
    return tuple(validate.number("cable_area", given, where=name, **limits) for name in names)


def directions(surface: Surface, edges: Ints) -> Floats:
    """(k,3) unit vectors along edges (k,2)."""
    along = surface.vertices[edges[:, 1]] - surface.vertices[edges[:, 0]]
    return np.asarray(along / segment_lengths(surface.vertices, edges)[:, None])


def cable_elements(surface: Surface, areas: tuple[float, ...], first: int) -> Iterator[str]:
    """Elements from number ``first`` on, sections, and the set CABLES of all."""
    if not surface.cables:
        return
    for k, (cable, area) in enumerate(zip(surface.cables, areas, strict=True), 1):
        numbers = first + np.arange(len(cable.edges))
        first += len(cable.edges)
        yield f"*ELEMENT, TYPE=T3D2, ELSET=CABLE_{k}\n"
        yield format_rows("%d,%d,%d\n", numbers, *(cable.edges.T + 1))
        yield f"*SOLID SECTION, ELSET=CABLE_{k}, MATERIAL=CABLE\n{short(area)}\n"
    yield "*ELSET, ELSET=CABLES\n" + "".join(f"CABLE_{k},\n" for k in range(1, len(surface.cables) + 1))


def cable_stress(surface: Surface, areas: tuple[float, ...]) -> Floats:
    """(k,3,3) the stress τ/a along each edge of all cables, one after the other."""
    along = [directions(surface, cable.edges) for cable in surface.cables]
    stress = [cable.tension / area for cable, area in zip(surface.cables, areas, strict=True)]
    return np.concatenate([s * t[:, :, None] * t[:, None, :] for s, t in zip(stress, along, strict=True)])
