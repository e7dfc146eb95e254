"""Every quantity that pcmc shows, sweeps or aims at, and the key figures of a roof in these terms.

A number of a roof is computed once, here or in its certificate; page, report, sweep and command show it.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from ..base.errors import OptionError, unknown
from ..forces.cables import pull_along
from ..forces.volume_below import volumes_below
from ..surface import Surface
from .cables import chord
from .certificate import Certificate


class Quantity(NamedTuple):
    """A quantity of a roof or of a part of it: one word, one meaning, wherever it appears."""

    name: str
    dimension: str  # its unit, as a name of ``Units``
    owners: tuple[str, ...]  # what it may belong to; "roof" is all patches that are no walls together
    formula: str


_ROWS = (
    Quantity("apex", "length", ("roof", "patch"), "greatest height over Π"),
    Quantity("height", "length", ("point", "patch"), "height over Π at a point; of a patch the greatest"),
    Quantity("rise", "length", ("roof",), "apex less the height of the lowest support"),
    Quantity("area", "area", ("roof", "patch", "wall"), "Σ A_T"),
    Quantity("volume", "volume", ("roof", "patch", "room"), "∫ z ν·n dA, the volume between patch and Π"),
    Quantity("energy", "energy", ("roof",), "E = Σ α A - Σ p V, with cables and weights"),
    Quantity("tension", "tension", ("patch", "wall"), "α"),
    Quantity("pressure", "pressure", ("patch", "room"), "p of the air, without snow"),
    Quantity("snow", "pressure", ("patch",), "s, per area of the plan"),
    Quantity("net pressure", "pressure", ("patch",), "p - s"),
    Quantity("weight", "pressure", ("patch",), "w, per area of the patch"),
    Quantity("curvature", "curvature", ("patch",), "(p - s) / (2 α)"),
    Quantity("lean", "angle", ("wall",), "largest angle between the wall and Π's normal"),
    Quantity("force", "force", ("cable",), "τ, the tension of the cable"),
    Quantity("length", "length", ("cable",), "Σ of its edges"),
    Quantity("sag", "length", ("cable",), "largest distance from the chord between its ends"),
    Quantity("load", "force", ("roof",), "pressure, snow and weight along Π's normal"),
    Quantity("reaction", "force", ("roof", "boundary"), "force of the supports along Π's normal"),
    Quantity("thrust", "force", ("boundary",), "force of the supports along Π"),
    Quantity("reaction per length", "tension", ("roof", "patch", "boundary"), "largest |Σ (α + w z) n|"),
    Quantity("margin", "times", ("roof",), "factor on a load or tension up to which the roof stays stable"),
    Quantity("lowest eigenvalue", "eigenvalue", ("roof",), "smallest second variation per unit area"),
)

QUANTITIES = {quantity.name: quantity for quantity in _ROWS}
"""Every quantity by its name."""

CHANGED = {"cable": "force"}  # kinds of parameters with the name of what they belong to


def dimension_of(name: str) -> str:
    """The unit of a quantity or of a kind of parameter, as a name of ``Units``; OptionError for another.

    >>> dimension_of("apex"), dimension_of("reaction per length"), dimension_of("cable")
    ('length', 'tension', 'force')
    """
    if name in CHANGED:
        return CHANGED[name]
    if name not in QUANTITIES:
        raise OptionError(unknown("quantity", name, QUANTITIES), what="quantity", found=name)
    return QUANTITIES[name].dimension


class Figure(NamedTuple):
    """A number of a roof."""

    quantity: str  # one of ``QUANTITIES``
    of: str  # the patch, wall, cable or room it belongs to; empty for the whole roof
    owner: str  # what that is: roof, patch, wall, cable or room
    value: float | None  # in the surface's units; None where it has none

    @property
    def dimension(self) -> str:
        """Its unit, as a name of ``Units``."""
        return dimension_of(self.quantity)


def figures(surface: Surface, certificate: Certificate) -> list[Figure]:
    """The key figures: of each patch, wall, cable and room, then of the whole roof.

    >>> from pcmc import Patch, certify
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> {f.quantity: round(f.value, 3) for f in figures(roof, certify(roof)) if f.of == "roof"}["apex"]
    0.354
    """
    rows: list[Figure] = []

    def add(of: str, owner: str, values: Mapping[str, float | None]) -> None:
        rows.extend(Figure(quantity, of, owner, value) for quantity, value in values.items())

    height, area = surface.plane.height(surface.vertices), certificate.patches["area"].to_numpy()
    volume, acting, roof = volumes_below(surface), certificate.acting, surface.roof
    for k, patch in enumerate(surface.patches):
        weight = {"weight": patch.weight} if patch.weight else {}
        if not roof[k]:
            add(patch.name, "wall", {"area": float(area[k]), "tension": patch.tension, **weight})
            continue
        snow = {"snow": patch.snow, "net pressure": patch.net_pressure} if patch.snow else {}
        own = {
            "apex": float(height[surface.faces[surface.patch_of_face == k]].max()),
            "area": float(area[k]),
            "volume": float(volume[k]),
            "reaction per length": acting.largest_per_length(k),
            "tension": patch.tension,
            "pressure": patch.pressure,
        }
        add(patch.name, "patch", own | snow | weight)
    leaning = certificate.leaning
    for name, lean in zip(leaning.get("wall", ()), leaning.get("lean", ()), strict=True):
        add(str(name), "wall", {"lean": float(lean)})
    for cable in surface.cables:
        ends = surface.vertices[cable.edges]
        length = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())
        pull = float(pull_along(surface, cable, cable.edges.ravel()).max())
        add(cable.name, "cable", {"force": pull, "length": length})
        with suppress(OptionError):  # a closed cable has no sag
            out = chord(surface, cable.name)[2]
            add(cable.name, "cable", {"sag": float(np.linalg.norm(out, axis=1).max())})
    for room in surface.rooms:
        add(room.name, "room", {"volume": room.volume})
    lowest = height[surface.held].min() if surface.held.any() else height.min()
    apex = float(height[surface.faces[roof[surface.patch_of_face]]].max())
    whole = {
        "apex": apex,
        "rise": apex - float(lowest),
        "area": float(area[roof].sum()),
        "volume": float(certificate.volume),
        "energy": float(certificate.energy),
        "load": float(certificate.load),
        "reaction": float(certificate.support),
        "reaction per length": acting.largest_per_length(),
    }
    add("", "roof", whole)
    return rows
