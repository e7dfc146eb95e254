"""Cables: their balance with the sheets along them, and the forces at their ends."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from ..base.arrays import Bools, Floats
from ..energy.cables import directions
from ..surface import Surface
from ..surface.cable import Cable
from ..surface.geometry import segment_lengths
from ..surface.topology import Curve
from .curve_tables import conormal_sum, middle


def cable_table(surface: Surface, left: Floats) -> pd.DataFrame:
    """A row per cable, or per part of it between supports, branches and ends.

    At rest a cable of tension τ and curvature vector κ balances the sheets along it: Σ α n + τ κ = 0 with
    their outward co-normals n; so along the free edge of a flat sheet α = τ κ. Of triangles this holds in
    the mean over a cable's edges up to what the mesh leaves.

    Columns: ``cable``, ``tension`` (its force) and ``length``; the middle of the part; ``sheet_pull``, the
    mean of |Σ α n| and ``cable_pull``, that of τ |κ|, force/length; ``force_left`` per length in the motion
    space, of ``left`` (n,3).
    """
    rows = []
    for cable, curve in _parts(surface):
        lengths = segment_lengths(surface.vertices, curve.pairs)
        total, t = float(lengths.sum()), directions(surface.vertices, curve.pairs)[0]
        turns = np.linalg.norm(t - np.roll(t, 1, axis=0) if curve.closed else np.diff(t, axis=0), axis=1)
        weight = 0.5 * (lengths + np.roll(lengths, 1)) if curve.closed else 0.5 * (lengths[1:] + lengths[:-1])
        sheets = np.linalg.norm(conormal_sum(surface, surface.topology.edge_numbers(curve.pairs)), axis=1)
        inner = curve.vertices if curve.closed else curve.vertices[1:-1]
        rows.append(
            {
                "cable": cable.name,
                "tension": cable.tension,
                "length": total,
                **middle(surface, curve),
                "sheet_pull": float(sheets @ lengths) / (total or 1.0),
                "cable_pull": cable.tension * float(turns.sum()) / (float(weight.sum()) or 1.0),
                "force_left": float(np.linalg.norm(left[inner], axis=1).max(initial=0.0))
                / (float(lengths.mean()) or 1.0),
            }
        )
    return pd.DataFrame(rows)


def cable_end_table(surface: Surface) -> pd.DataFrame:
    """A row per end of each part of a cable: where it is, whether a support holds it, and the force.

    ``force_x``, ``force_y``, ``force_z`` is what a support there exerts on the cable: -τ t, with t the
    direction from the end along the cable. Where several cables end, their support carries the sum.
    """
    rows = []
    for cable, vertex, force in cable_ends(surface):
        rows.append(
            {
                "cable": cable.name,
                "vertex": vertex,
                **dict(zip("xyz", surface.vertices[vertex].tolist(), strict=True)),
                "held": bool(surface.held[vertex]),
                **dict(zip(("force_x", "force_y", "force_z"), force.tolist(), strict=True)),
            }
        )
    return pd.DataFrame(rows)


def cable_ends(surface: Surface) -> list[tuple[Cable, int, Floats]]:
    """Each end of a part of a cable: the cable, the vertex, and -τ t (3,), the force that holds it there."""
    ends = []
    for cable, curve in _parts(surface):
        for end, beside in () if curve.closed else ((0, 1), (-1, -2)):
            pair = curve.vertices[[end, beside]]
            direction = directions(surface.vertices, pair[None])[0][0]
            ends.append((cable, int(pair[0]), -cable.tension * direction))
    return ends


def too_long(surface: Surface) -> str:
    """Names a cable along a free edge whose chord is over 2 τ/α, the diameter of its arc; or empty.

    In a plane no arc is as wide, so a flat sheet is not at rest there; another one hardly.
    """
    for cable, curve in _parts(surface):
        if curve.closed or len(curve.sheets) != 1:
            continue
        chord = float(np.linalg.norm(np.diff(surface.vertices[curve.vertices[[0, -1]]], axis=0)))
        tension = float(surface.tensions[curve.sheets[0]])
        widest = 2.0 * cable.tension
        if chord * tension > widest:
            enough = _upwards(chord * tension)  # an arc of 60°, which rises by 0.13 of its chord
            return (
                f"cable {cable.name!r} spans {chord:.4g}, more than 2 τ/α = {widest / tension:.4g}, the"
                f" diameter of the arc along a flat edge; raise its tension, well beyond"
                f" {0.5 * chord * tension:.3g} (in a plan, cable = {enough:g}), or put a support between"
            )
    return ""


def _upwards(value: float) -> float:
    """The value rounded up to two digits."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / step) * step


def _parts(surface: Surface) -> list[tuple[Cable, Curve]]:
    """The parts of each cable of tension > 0 between its ends, branches and the supports in between."""
    parts = []
    for cable in surface.cables:
        if cable.tension > 0.0:
            curves = surface.topology.chains(cable.edges, _supported(surface, cable))
            parts += [(cable, curve) for curve in curves]
    return parts


def _supported(surface: Surface, cable: Cable) -> Bools:
    """(n,) fixed vertices of a cable beside one that moves: a mast that it runs over."""
    mask = np.zeros(surface.n, dtype=bool)
    leading = cable.edges[surface.fixed[cable.edges].sum(axis=1) == 1]
    mask[leading] = surface.fixed[leading]
    return mask
