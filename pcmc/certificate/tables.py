"""The tables of patches, junctions and rooms, and of how far walls lean."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd

from ..base.arrays import Floats, Ints
from ..forces.curvature import METHODS, curvature_error, mean_curvature, target_curvature
from ..forces.rooms import prescribed_volumes, room_pressures, room_volumes
from ..surface import Surface
from ..surface.geometry import area_vectors, segment_lengths
from ..surface.topology import EdgeCurve

ROUNDING = 1e-8  # of the size, about what a solve leaves: a coordinate below is 0
THIN = 1e-6  # of the wall's mean triangle: smaller ones have no direction worth telling


def names_of(surface: Surface, patches: Iterable[int]) -> str:
    """The names of patches that meet, as in "north | south | wall"."""
    return " | ".join(surface.patches[i].name for i in patches)


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


def middle(surface: Surface, curve: EdgeCurve) -> dict[str, float]:
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


def patch_table(surface: Surface, standing: Surface, areas: Floats, quality: Floats) -> pd.DataFrame:
    """A row per patch; see ``Certificate.patches``. ``quality`` (m,) is that of the standing triangles."""
    errors = {method: np.abs(curvature_error(standing, method)) for method in METHODS}
    curvature, target = mean_curvature(standing, "variational"), target_curvature(standing)
    rows = []
    for index, patch in enumerate(surface.patches):
        faces = standing.patch_of_face == index
        inside = np.zeros(surface.n, dtype=bool)
        inside[standing.faces[faces]] = True
        inside &= np.isfinite(curvature)
        varies = patch.weight and inside.any()
        row: dict[str, Any] = {
            "patch": patch.name,
            "tension": patch.tension,
            "pressure": patch.pressure,
            **({"snow": patch.snow, "net": patch.net_pressure} if surface.snows.any() else {}),
            "target": float(target[inside].mean()) if varies else patch.target_curvature,
            "area": float(areas[index]),
            "mean_H": float(curvature[inside].mean()) if inside.any() else np.nan,
        }
        for method, error in errors.items():
            known = error[inside & np.isfinite(error)]
            row[f"{method}_max"] = float(known.max()) if len(known) else np.nan
            row[f"{method}_mean"] = float(known.mean()) if len(known) else np.nan
        rows.append(row | {"quality": float(quality[faces].min(initial=1.0))})
    return pd.DataFrame(rows)


def junction_table(surface: Surface, left: Floats) -> pd.DataFrame:
    """One row per junction curve: where it is, the forces left per length, Σ α n of its triangles."""
    rows = []
    for curve in surface.topology.junctions:
        lengths = segment_lengths(surface.vertices, curve.pairs)
        sums = np.linalg.norm(conormal_sum(surface, surface.topology.edge_numbers(curve.pairs)), axis=1)
        total, mean = float(lengths.sum()), float(lengths.mean()) or 1.0
        rows.append(
            {
                "junction": names_of(surface, curve.sheets),
                "length": total,
                **middle(surface, curve),
                "force_left": float(np.linalg.norm(left[curve.vertices], axis=1).max()) / mean,
                "sum_alpha_n_mean": float(sums @ lengths) / total if total else 0.0,
                "sum_alpha_n_max": float(sums.max()),
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


def lean_sines(surface: Surface) -> Floats:
    """(m,) ⟨ν, n⟩ of the walls' triangles with the normal n of Π, 0 for all others.

    A triangle leans from the vertical by the angle arcsin |⟨ν, n⟩|.
    """
    own = np.flatnonzero(surface.walls[surface.patch_of_face])
    vectors = area_vectors(surface.vertices[surface.faces[own]])
    areas = np.linalg.norm(vectors, axis=1)
    thick = areas > THIN * (areas.mean() if len(own) else 0.0)
    sines = np.zeros(surface.m)
    sines[own[thick]] = vectors[thick] @ np.array(surface.plane.normal) / areas[thick]
    return sines


def lean_table(surface: Surface) -> pd.DataFrame:
    """A row per wall: the largest angle of its triangles from the vertical of Π, degrees, and where it is.

    >>> from pcmc.plan import Divider, Plan
    >>> halves = [Divider([[4, 0], [4, 4]])]
    >>> hall = Plan([[0, 0], [8, 0], [8, 4], [0, 4]], halves, tension=4.0, edge_length=1.0)
    >>> lean_table(hall.surface())[["wall", "lean"]].round(6).to_numpy().tolist()
    [['wall 1', 0.0]]
    """
    rows = []
    sines = lean_sines(surface)
    for wall in np.flatnonzero(surface.walls):
        faces = np.flatnonzero(surface.patch_of_face == wall)
        if len(faces):  # else it is pinched all along
            face = faces[np.abs(sines[faces]).argmax()]
            angle = float(np.degrees(np.arcsin(min(1.0, abs(sines[face])))))
            place = surface.vertices[surface.faces[face]].mean(axis=0)
            rows.append([surface.patches[wall].name, angle, *place])
    return pd.DataFrame(rows, columns=["wall", "lean", *"xyz"])


def lean_texts(table: pd.DataFrame, least: float = 0.05) -> list[str]:
    """The walls that lean by at least ``least`` degrees, in words, the one that leans most first."""
    if not len(table):
        return []
    leaning = table[table["lean"] >= least].sort_values("lean", ascending=False)
    rows = leaning[["wall", "lean", *"xyz"]].itertuples(index=False, name=None)
    return [f"{wall!r} by {lean:.1f}° near [{x:.4g}, {y:.4g}, {z:.4g}]" for wall, lean, x, y, z in rows]
