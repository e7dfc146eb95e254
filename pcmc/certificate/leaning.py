"""How far walls lean from the vertical."""

from __future__ import annotations

import numpy as np
import pandas as pd

from ..base.arrays import Floats
from ..surface import Surface
from ..surface.geometry import area_vectors

THIN = 1e-6  # of the wall's mean triangle: smaller ones have no direction worth telling


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
        if not len(faces):  # a wall that is pinched all along
            continue
        face = faces[np.abs(sines[faces]).argmax()]
        x, y, z = surface.vertices[surface.faces[face]].mean(axis=0).tolist()
        angle = float(np.degrees(np.arcsin(min(1.0, abs(sines[face])))))
        rows.append({"wall": surface.patches[wall].name, "lean": angle, "x": x, "y": y, "z": z})
    return pd.DataFrame(rows, columns=["wall", "lean", "x", "y", "z"])


def lean_texts(table: pd.DataFrame, least: float = 0.05) -> list[str]:
    """The walls that lean by at least ``least`` degrees, in words, the one that leans most first."""
    if not len(table):
        return []
    leaning = table[table["lean"] >= least].sort_values("lean", ascending=False)
    rows = leaning[["wall", "lean", "x", "y", "z"]].itertuples(index=False, name=None)
    return [f"{wall!r} by {lean:.1f}° near [{x:.4g}, {y:.4g}, {z:.4g}]" for wall, lean, x, y, z in rows]
