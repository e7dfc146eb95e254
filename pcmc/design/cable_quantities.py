"""Quantities of cables: sag, length and force, with exact derivatives."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats, Ints
from ..certificate.cables import chord
from ..forces.cables import add_pull
from ..surface import Surface
from .measurement import Branches, Measurement, largest


def sag(surface: Surface, of: str) -> Measurement:
    """The largest distance of a cable's vertices from its chord, the straight line between its two ends.

    With the chord from a to b and x at the share s of it, the distance along the unit vector e changes by
    ⟨e, dx - (1 - s) da - s db⟩.
    """
    order, share, out = chord(surface, of)
    distance = np.linalg.norm(out, axis=1)
    size = float(np.linalg.norm(np.diff(surface.vertices[order[-2:]], axis=0)))
    direction = out / np.where(distance > 0.0, distance, 1.0)[:, None]

    def branches(near: Ints) -> Branches:
        along, e = share[near][:, None], direction[near]
        ends = np.tile(order[-2:], (len(near), 1))
        slopes = np.stack([e, (along - 1.0) * e, -along * e], axis=1)
        return Branches.of(np.column_stack([order[near], ends]), slopes, surface.n)

    return largest(distance, size, branches)


def length(surface: Surface, of: str) -> Measurement:
    """The length L of a cable."""
    slope = np.zeros_like(surface.vertices)
    lengths = add_pull(surface.vertices, surface.cables[surface.cable_index(of)].edges, 1.0, slope)
    return Measurement(float(lengths.sum()), slope)


def force(surface: Surface, of: str) -> Measurement:
    """τ, the force in a cable: the same all along it."""
    index = surface.cable_index(of)
    by_cable: Floats = np.zeros(len(surface.cables))
    by_cable[index] = 1.0
    return Measurement(
        surface.cables[index].tension, np.zeros_like(surface.vertices), by_load={"cable": by_cable}
    )
