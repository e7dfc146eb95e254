"""The key figures of a surface: what page, report, sweep and command show, computed once."""

from __future__ import annotations

from contextlib import suppress
from typing import NamedTuple

import numpy as np

from ..base.errors import OptionError
from ..certificate import Certificate
from ..certificate.cables import chord
from ..forces.volume_below import volumes_below
from ..surface import Surface
from .table import dimension_of


class Figure(NamedTuple):
    """A number of a roof.

    Attributes
    ----------
    quantity : one of ``QUANTITIES``.
    of : the patch, wall, cable or room it belongs to; empty for the whole roof.
    owner : what that is, of ``OWNERS``.
    value : in the surface's units; None where it has none.
    """

    quantity: str
    of: str
    owner: str
    value: float | None

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

    def add(quantity: str, of: str, owner: str, value: float | None) -> None:
        rows.append(Figure(quantity, of, owner, value))

    height, area = surface.plane.height(surface.vertices), certificate.patches["area"].to_numpy()
    volume, acting = volumes_below(surface), certificate.acting
    roof = surface.roof
    for k, patch in enumerate(surface.patches):
        owner, name = "patch" if roof[k] else "wall", patch.name
        if roof[k]:
            add("apex", name, owner, float(height[surface.faces[surface.patch_of_face == k]].max()))
        add("area", name, owner, float(area[k]))
        if roof[k]:
            add("volume", name, owner, float(volume[k]))
            add("reaction per length", name, owner, acting.largest_per_length(k))
        add("tension", name, owner, patch.tension)
        if roof[k]:
            add("pressure", name, owner, patch.pressure)
        if patch.snow and roof[k]:
            add("snow", name, owner, patch.snow)
            add("net pressure", name, owner, patch.net_pressure)
        if patch.weight:
            add("weight", name, owner, patch.weight)
    leaning = certificate.leaning
    for name, lean in zip(leaning.get("wall", ()), leaning.get("lean", ()), strict=True):
        add("lean", str(name), "wall", float(lean))
    for cable in surface.cables:
        add("force", cable.name, "cable", cable.tension)
        ends = surface.vertices[cable.edges]
        add("length", cable.name, "cable", float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()))
        with suppress(OptionError):  # a closed cable has no sag
            out = chord(surface, cable.name)[2]
            add("sag", cable.name, "cable", float(np.linalg.norm(out, axis=1).max()))
    for room in surface.rooms:
        add("volume", room.name, "room", room.volume)
    lowest = height[surface.held].min() if surface.held.any() else height.min()
    apex = float(height[surface.faces[roof[surface.patch_of_face]]].max())
    for quantity, value in (
        ("apex", apex),
        ("rise", apex - float(lowest)),
        ("area", float(area[roof].sum())),
        ("volume", float(certificate.volume)),
        ("energy", float(certificate.energy)),
        ("load", float(certificate.load)),
        ("reaction", float(certificate.support)),
        ("reaction per length", acting.largest_per_length()),
    ):
        add(quantity, "", "roof", value)
    return rows
