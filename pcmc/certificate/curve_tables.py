"""Tables of junctions and held boundaries: where each curve is, and the forces along it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from ..base.arrays import Bools, Floats, Ints
from ..surface import Surface
from ..surface.geometry import segment_lengths
from ..surface.supports import symmetric_part
from ..surface.topology import Curve
from .balance import edge_tensions
from .reactions import reactions_per_length

ROUNDING = 1e-12  # of the size: a coordinate below is 0


def conormal_sum(surface: Surface, edges: Ints) -> Floats:
    """(k,3) at each of the edges (k,), Σ α n over its triangles, n the outward co-normal, force/length.

    With weights, α + w z stands for α. Zero along a junction of smooth surfaces at rest (7) without a
    cable; of triangles it is zero only in the limit.
    """
    topo, tension = surface.topology, edge_tensions(surface)
    row = np.full(len(topo.edges), -1)
    row[edges] = np.arange(len(edges))
    total = np.zeros((len(edges), 3))
    for corner in range(3):
        at = row[topo.edge_of_face[:, corner]]
        faces = np.flatnonzero(at >= 0)
        apex, a, b = (surface.vertices[surface.faces[faces, corner - k]] for k in (0, 2, 1))
        along = b - a
        length = np.linalg.norm(along, axis=1)
        along /= np.where(length > 0.0, length, 1.0)[:, None]
        out = a - apex
        out -= np.einsum("ij,ij->i", out, along)[:, None] * along
        length = np.linalg.norm(out, axis=1)
        pull = tension[faces, corner] / np.where(length > 0.0, length, 1.0)
        np.add.at(total, at[faces], pull[:, None] * out)
    return total


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


def boundary_table(surface: Surface, forces: Floats) -> pd.DataFrame:
    """One row per held boundary curve: where it is, its share of the reactions (n,3), most per length.

    Then one per curve in a mirror plane, named after it: there the image pulls, across the plane.
    """
    curves = held_curves(surface)
    carried = symmetric_part(surface.on_planes, forces.copy())
    per_length = np.linalg.norm(np.nan_to_num(reactions_per_length(surface, forces)), axis=1)
    rows = _boundary_rows(surface, curves, ["" for _ in curves], carried, per_length)
    for plane, mask in surface.on_planes:
        if plane.mirror:
            edges = surface.mirror_edge & mask[surface.topology.edges].all(axis=1)
            curves = _curves_by_patch(surface, edges)
            half = 0.5 * np.repeat(segment_lengths(surface.vertices, surface.topology.edges[edges]), 2)
            share = np.bincount(surface.topology.edges[edges].ravel(), half, surface.n)
            pull = (forces @ np.array(plane.normal)) * mask
            per_length = np.divide(np.abs(pull), share, out=np.zeros(surface.n), where=share > 0.0)
            across = pull[:, None] * np.array(plane.normal)
            rows += _boundary_rows(surface, curves, [f" in the {plane}"] * len(curves), across, per_length)
    return pd.DataFrame(rows)


def _curves_by_patch(surface: Surface, edges: Bools) -> list[Curve]:
    """The curves of boundary edges (e,), each in one patch."""
    topo = surface.topology
    curves: list[Curve] = []
    patch = np.empty(len(topo.edges), dtype=np.int64)
    patch[topo.edge_of_face] = surface.patch_of_face[:, None]
    for p in np.unique(patch[edges]):
        curves += topo.curves_among(edges & (patch == p))
    return curves


def held_curves(surface: Surface) -> list[Curve]:
    """The boundary curves with a held vertex, but for those in mirror planes."""
    curves = surface.topology.boundary_loops
    if surface.mirror_edge.any():
        curves = surface.topology.curves_among(surface.topology.boundary_edge & ~surface.mirror_edge)
    return [curve for curve in curves if surface.held[curve.vertices].any()]


def _boundary_rows(
    surface: Surface, curves: Sequence[Curve], places: Sequence[str], forces: Floats, per_length: Floats
) -> list[dict[str, object]]:
    """The rows of curves; they share the force of a corner equally, so that they add up to the total."""
    count = np.zeros(surface.n)
    for curve in curves:
        count[curve.vertices] += 1.0
    parts = forces / np.maximum(count, 1.0)[:, None]
    rows = []
    for curve, place in zip(curves, places, strict=True):
        total = parts[curve.vertices].sum(axis=0).tolist()
        rows.append(
            {
                "boundary": " | ".join(surface.patches[i].name for i in curve.sheets) + place,
                "length": float(segment_lengths(surface.vertices, curve.pairs).sum()),
                **middle(surface, curve),
                **dict(zip(("reaction_x", "reaction_y", "reaction_z"), total, strict=True)),
                "per_length_max": float(per_length[curve.vertices].max()),
            }
        )
    return rows


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
