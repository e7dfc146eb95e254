"""The tables of junctions, with where each is and the forces along it, and of rooms."""

from __future__ import annotations

import numpy as np
import pandas as pd

from ..base.arrays import Floats, Ints
from ..forces.rooms import prescribed_volumes, room_pressures, room_volumes
from ..surface import Surface
from ..surface.geometry import segment_lengths
from ..surface.topology import Curve

ROUNDING = 1e-8  # of the size, about what a solve leaves: a coordinate below is 0


def conormal_sum(surface: Surface, edges: Ints) -> Floats:
    """(k,3) at each of the edges (k,), Σ α n over its triangles, n the outward co-normal, force/length.

    With weights, α + w z stands for α. Zero along a junction of smooth surfaces at rest (7) without a
    cable; of triangles it is zero only in the limit.
    """
    at, face, corners = sides_at(surface, edges)
    c, a, b = surface.vertices[corners].transpose(1, 0, 2)
    along = b - a
    length = np.linalg.norm(along, axis=1)
    along /= np.where(length > 0.0, length, 1.0)[:, None]
    out = a - c
    out -= np.einsum("ij,ij->i", out, along)[:, None] * along
    length = np.linalg.norm(out, axis=1)
    k, height = surface.patch_of_face[face], surface.plane.height(0.5 * (a + b))
    pull = (surface.tensions[k] + surface.weights[k] * height) / np.where(length > 0.0, length, 1.0)
    total = np.zeros((len(edges), 3))
    np.add.at(total, at, pull[:, None] * out)
    return total


def sides_at(surface: Surface, edges: Ints) -> tuple[Ints, Ints, Ints]:
    """The sides of triangles at edges (k,): which of these, the triangle, and its corners, (s,) and (s,3).

    The corner opposite the side comes first.
    """
    row = np.full(len(surface.topology.edges), -1)
    row[edges] = np.arange(len(edges))
    at = row[surface.topology.edge_of_face]
    face, corner = np.nonzero(at >= 0)
    corners = surface.faces[face[:, None], (corner[:, None] + np.arange(3)) % 3]
    return at[face, corner], face, corners


def junction_table(surface: Surface, left: Floats) -> pd.DataFrame:
    """One row per junction curve: where it is, the forces left per length, Σ α n of its triangles."""
    rows = []
    for curve in surface.topology.junctions:
        lengths = segment_lengths(surface.vertices, curve.pairs)
        imbalance = np.linalg.norm(conormal_sum(surface, surface.topology.edge_numbers(curve.pairs)), axis=1)
        total, mean = float(lengths.sum()), float(lengths.mean()) or 1.0
        rows.append(
            {
                "junction": " | ".join(surface.patches[i].name for i in curve.sheets),
                "length": total,
                **middle(surface, curve),
                "force_left": float(np.linalg.norm(left[curve.vertices], axis=1).max()) / mean,
                "sum_alpha_n_mean": float(imbalance @ lengths) / total if total else 0.0,
                "sum_alpha_n_max": float(imbalance.max()),
            }
        )
    return pd.DataFrame(rows)


def room_table(surface: Surface) -> pd.DataFrame:
    """A row per room of prescribed volume; see ``Certificate.rooms``."""
    if not surface.rooms:
        return pd.DataFrame()
    wanted, reached = prescribed_volumes(surface), room_volumes(surface)
    return pd.DataFrame(
        {
            "room": [room.name for room in surface.rooms],
            "volume": reached,
            "prescribed": wanted,
            "difference": (reached - wanted) / np.abs(wanted),
            "pressure": room_pressures(surface),
        }
    )


def middle(surface: Surface, curve: Curve) -> dict[str, float]:
    """The point half way along a curve, or the centre of a closed one; tells curves of one name apart."""
    ends, lengths = surface.vertices[curve.pairs], segment_lengths(surface.vertices, curve.pairs)
    if curve.closed:
        place = lengths @ ends.mean(axis=1) / (lengths.sum() or 1.0)
    else:
        along = np.concatenate([[0.0], np.cumsum(lengths)])
        points = surface.vertices[curve.vertices]
        place = np.array([np.interp(0.5 * along[-1], along, column) for column in points.T])
    place = np.where(np.abs(place) <= ROUNDING * surface.size, 0.0, place)
    return {f"middle_{axis}": float(value) for axis, value in zip("xyz", place, strict=True)}
