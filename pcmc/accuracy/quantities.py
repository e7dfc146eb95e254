"""What a designer reads from a surface at rest: heights, areas, volume, energy, reactions, softest mode."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ..base.arrays import Floats
from ..certificate import Certificate
from ..certificate.balance import boundary_table
from ..surface import Surface

ROUNDING = 1e-10  # of a quantity's size: what solving to rest leaves open
RESIDUALS = 10.0  # that a quantity may change with the forces left, relative
EIGENVALUES = 1e-12  # of the largest eigenvalue: rounding of the lowest one

Key = tuple[str, tuple[int, ...], bytes]


@dataclass(frozen=True)
class Reading:
    """A quantity of one surface.

    Attributes
    ----------
    quantity, of : its name, and the patch or boundary it belongs to; empty for the whole.
    value : as read from the mesh.
    estimate : of the same limit, but smoother from mesh to mesh; the same as ``value`` for most.
    rounding : differences up to this size are none.
    """

    quantity: str
    of: str
    value: float
    estimate: float
    rounding: float


def readings(surface: Surface, certificate: Certificate, vertices: int) -> dict[Key, Reading]:
    """The quantities of a surface. Keys are the same for all refinements of one surface.

    ``vertices`` is the number of vertices of the coarsest mesh, which come first in all finer ones.
    """
    share = ROUNDING + RESIDUALS * certificate.residual
    size, tension = surface.size, float(surface.tensions.max())
    found: dict[Key, Reading] = {}

    def add(quantity: str, of: str, value: float, scale: float, curve: Key | None = None) -> None:
        key = (quantity, *curve[1:]) if curve else (quantity + " " + of, (), b"")
        found[key] = Reading(quantity, of, value, value, share * scale)

    for k, patch in enumerate(surface.patches):
        if not patch.auxiliary and (surface.patch_of_face == k).any():
            value, estimate = _height(surface, k)
            found["height " + patch.name, (), b""] = Reading(
                "height", patch.name, value, estimate, share * size
            )
    for row in certificate.patches.itertuples():
        add("area", str(row.patch), float(row.area), size**2)
    add("volume", "", certificate.volume, size**3)
    weight = tension * float(certificate.patches.area.sum())
    add("energy", "", certificate.energy, weight)
    add("reaction", "", certificate.support, tension * size)
    for key, row in _boundaries(surface, certificate, vertices):
        pull = np.array([row.reaction_x, row.reaction_y, row.reaction_z])
        add("reaction", row.name, float(pull @ np.array(surface.plane.normal)), tension * size, key)
        add("thrust", row.name, float(np.linalg.norm(surface.plane.along(pull))), tension * size, key)
        add("reaction per length", row.name, float(row.per_length_max), tension, key)
    if len(certificate.eigenvalues):
        stiffest = 10.0 * tension * surface.m / float(certificate.patches.area.sum())
        found["lowest eigenvalue ", (), b""] = Reading(
            "lowest eigenvalue",
            "",
            float(certificate.eigenvalues[0]),
            float(certificate.eigenvalues[0]),
            share * tension / size**2 + EIGENVALUES * stiffest,
        )
    return found


def _boundaries(surface: Surface, certificate: Certificate, vertices: int) -> list[tuple[Key, pd.Series]]:
    """Rows of the certificate's table of boundaries, with a key and a name; two of one name get places."""
    held = surface.fixed | surface.on_plane
    curves = [c for c in surface.topology.boundary_loops if held[c.vertices].any()]
    table = boundary_table(surface, certificate.reactions)
    if not len(table):
        return []
    count = Counter(table.boundary)
    middles = table[["middle_x", "middle_y", "middle_z"]].to_numpy()
    names = [
        name if count[name] == 1 else f"{name} near ({', '.join(f'{c:.3g}' for c in middle)})"
        for name, middle in zip(table.boundary, middles, strict=True)
    ]
    keys = [("", c.sheets, np.sort(c.vertices[c.vertices < vertices]).tobytes()) for c in curves]
    rows = [row for _, row in table.assign(name=names).iterrows()]
    for row, name in zip(rows, names, strict=True):
        row.name = name
    return list(zip(keys, rows, strict=True))


def _height(surface: Surface, patch: int) -> tuple[float, float]:
    """Greatest height of a patch's vertices over Π, and that of the smooth surface through them there.

    The highest vertex is up to half an edge beside the top, at random from mesh to mesh. The paraboloid
    through it and its neighbours, or on a junction the parabola, has its top at the surface's own.
    """
    local = surface.plane.to_local(surface.vertices)
    vertices = np.unique(surface.faces[surface.patch_of_face == patch])
    top = int(vertices[local[vertices, 2].argmax()])
    value = float(local[top, 2])
    if surface.fixed[top] or surface.on_plane[top]:
        return value, value
    topo = surface.topology
    around = (topo.edges == top).any(axis=1)
    if topo.on_junction[top]:
        around &= topo.junction_edge | topo.seam_edge
    beside = topo.edges[around].sum(axis=1) - top
    step = local[beside] - local[top]
    if topo.on_junction[top]:
        if len(beside) != 2:
            return value, value
        along = step[0, :2] - step[1, :2]
        along /= np.linalg.norm(along) or 1.0
        step = np.column_stack([step[:, :2] @ along, np.zeros(2), step[:, 2]])
    return value, value + _rise(step)


def _rise(step: Floats) -> float:
    """How far the top of a paraboloid through 0 and the points ``step`` (k,3) is above 0; 0 without one."""
    x, y, z = step.T
    a, b, xx, xy, yy = np.linalg.lstsq(np.column_stack([x, y, 0.5 * x * x, x * y, 0.5 * y * y]), z)[0]
    slope, bend = np.array([a, b]), np.array([[xx, xy], [xy, yy]])
    place = -np.linalg.pinv(bend) @ slope
    rise = 0.5 * float(slope @ place)
    near = np.linalg.norm(place) <= np.linalg.norm(step[:, :2], axis=1).max()
    return rise if near and rise > 0.0 else 0.0
