"""The tables of patches, junctions, cables and rooms, and of how far walls lean."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd

from ..base.arrays import Floats, mask_of
from ..base.tolerances import ON
from ..base.units import Units
from ..forces.cables import directions, pull_along
from ..forces.curvature import METHODS, curvature_error, mean_curvature, target_curvature
from ..forces.functional import patch_areas
from ..forces.rooms import prescribed_volumes, room_pressures, room_volumes
from ..meshing.quality import triangle_quality
from ..surface import Surface
from ..surface.geometry import area_vectors, segment_lengths
from ..surface.images import lattice_of
from ..surface.pieces import point_text
from ..surface.topology import EdgeCurve
from .forces import CableEnd, cable_parts, sheet_pulls

ROUNDING = 1e-8  # of the size, about what a solve leaves: a coordinate below is 0
PLACES = ("x", "y", "z", "middle_x", "middle_y", "middle_z")  # columns of coordinates
THIN = 1e-6  # of the wall's mean triangle: smaller ones have no direction worth telling


def names_of(surface: Surface, patches: Iterable[int]) -> str:
    """The names of patches that meet, as in "north | south | wall"."""
    return " | ".join(surface.patches[i].name for i in patches)


def head_text(certificate: Any, units: Units, rows: dict[str, str]) -> str:
    """Lines of a name and a text each: that the surface is not certified or a part; the units; these rows."""
    first = {} if certificate.certified else {"not certified": certificate.verdict.value}
    first |= {"extent": certificate.part, "units": units.sentence if units else ""}
    return "\n".join(f"{name:>14}  {text}" for name, text in (first | rows).items() if text)


def curve_lengths(surface: Surface, curve: EdgeCurve) -> Floats:
    """(k,) the lengths of the edges of a curve, in order."""
    topo = surface.topology
    return segment_lengths(surface.vertices, topo.sides[topo.edge_numbers(curve.pairs)])


def middle(surface: Surface, curve: EdgeCurve) -> dict[str, float]:
    """The point half way along a curve, or the centre of a closed one; tells curves of one name apart."""
    X, topo, pairs, lengths = surface.vertices, surface.topology, curve.pairs, curve_lengths(surface, curve)
    points = X[np.append(pairs[:, 0], pairs[-1:, 1])]
    if surface.periodic:  # the curve goes on out of the cell
        number = topo.edge_numbers(pairs)
        steps = X[topo.sides[number, 1]] - X[topo.sides[number, 0]]
        steps[topo.edges[number, 0] != pairs[:, 0]] *= -1.0
        points[1:] = points[0] + np.cumsum(steps, axis=0)
    if curve.closed:
        place = lengths @ (points[:-1] + points[1:]) / (2.0 * lengths.sum() or 1.0)
    else:
        along = np.append(0.0, lengths.cumsum())
        place = np.array([np.interp(0.5 * along[-1], along, column) for column in points.T])
    place = np.where(np.abs(place) <= ROUNDING * surface.size, 0.0, place)
    return {f"middle_{axis}": float(value) for axis, value in zip("xyz", place, strict=True)}


def as_text(table: pd.DataFrame, size: float) -> str:
    """A table in four digits; places far from the origin of a surface of this size as its points have them.

    >>> print(as_text(pd.DataFrame({"x": [691003.125], "y": [2.0], "force_x": [12345.678]}), 12.0))
           x  y   force_x
    691003.125  2 1.235e+04
    """
    digits = 4 - math.floor(math.log10(size or 1.0))
    far = [name for name in table if name in PLACES and table[name].abs().max() >= 1e4]
    formats: Any = dict.fromkeys(far, lambda x: f"{round(x, digits):.12g}")
    return table.to_string(index=False, float_format=lambda x: f"{x:.4g}", formatters=formats)


def patch_table(surface: Surface, standing: Surface) -> pd.DataFrame:
    """A row per patch; see ``Certificate.patches``."""
    errors = {method: np.abs(curvature_error(standing, method)) for method in METHODS}
    curvature, target = mean_curvature(standing, "variational"), target_curvature(standing)
    areas, quality = patch_areas(surface), triangle_quality(standing.vertices, standing.faces)
    rows = []
    for index, patch in enumerate(surface.patches):
        faces = standing.patch_of_face == index
        inside = mask_of(standing.faces[faces], surface.n) & np.isfinite(curvature)
        mean, aim = [float(H[inside].mean()) if inside.any() else np.nan for H in (curvature, target)]
        row: dict[str, Any] = {
            "patch": patch.name,
            "tension": patch.tension,
            "pressure": patch.pressure,
            **({"snow": patch.snow, "net": patch.net_pressure} if surface.snows.any() else {}),
            "target": aim if patch.weight else patch.target_curvature,
            "area": float(areas[index]),
            "mean_H": 0.0 if abs(mean) * surface.size < ON else mean,
        }
        for method, error in errors.items():
            known = error[inside & np.isfinite(error)]
            row[f"{method}_max"] = float(known.max()) if len(known) else np.nan
            row[f"{method}_mean"] = float(known.mean()) if len(known) else np.nan
        rows.append(row | {"quality": float(quality[faces].min(initial=1.0))})
    return pd.DataFrame(rows)


def junction_table(surface: Surface, left: Floats) -> pd.DataFrame:
    """A row per junction curve: where it is, the forces left (n,3) per length, Σ α n of its triangles."""
    rows = []
    for curve in surface.topology.junctions:
        lengths, sums, along = _along_curve(surface, curve, left[curve.vertices])
        mean = float(sums @ lengths) / (along["length"] or 1.0)
        own = {"junction": names_of(surface, curve.sheets), **along}
        rows.append(own | {"sum_alpha_n_mean": mean, "sum_alpha_n_max": float(sums.max())})
    return pd.DataFrame(rows)


def cable_table(surface: Surface, left: Floats) -> pd.DataFrame:
    """A row per cable, or per part of it between supports, branches, other cables and ends.

    At rest a cable of tension τ and curvature vector κ balances the sheets along it: Σ α n + τ κ = 0 with
    their outward co-normals n; so along the free edge of a flat sheet α = τ κ. Of triangles this holds in
    the mean over a cable's edges up to what the mesh leaves.

    Columns: ``cable``, ``tension`` (its force, the largest where a weight g lets it vary), ``weight`` (g, if
    any cable has one) and ``length``; the middle of the part; ``sheet_pull``, the mean of |Σ α n|, with the
    weight across the cable, and ``cable_pull``, that of (τ + g z) |κ|, force/length; ``force_left`` per
    length in the motion space, of ``left`` (n,3).
    """
    rows, heavy = [], surface.cable_edges.weight.any()
    for cable, curve in cable_parts(surface):
        t, closed = directions(surface.vertices, curve.pairs)[0], curve.closed
        inner = curve.vertices if closed else curve.vertices[1:-1]
        load = -cable.weight * np.array(surface.plane.normal)
        lengths, sums, along = _along_curve(surface, curve, left[inner], load - (t @ load)[:, None] * t)
        turns = np.linalg.norm(t - np.roll(t, 1, axis=0) if closed else np.diff(t, axis=0), axis=1)
        weight = 0.5 * (lengths + np.roll(lengths, 1)) if closed else 0.5 * (lengths[1:] + lengths[:-1])
        pulls = {
            "sheet_pull": float(sums @ lengths) / (along["length"] or 1.0),
            "cable_pull": float(pull_along(surface, cable, inner) @ turns) / (float(weight.sum()) or 1.0),
            "force_left": along.pop("force_left"),
        }
        tension = float(pull_along(surface, cable, curve.vertices).max())
        own = {"cable": cable.name, "tension": tension, **({"weight": cable.weight} if heavy else {})}
        rows.append(own | along | pulls)
    return pd.DataFrame(rows)


def _along_curve(
    surface: Surface, curve: EdgeCurve, left: Floats, load: Floats | float = 0.0
) -> tuple[Floats, Floats, dict[str, float]]:
    """Lengths, |Σ α n + load| (k,) of a curve's edges; its length, middle, largest force left per length."""
    lengths = curve_lengths(surface, curve)
    pulls = sheet_pulls(surface, curve.pairs) + load
    for plane, on in ((surface.plane, surface.on_ground), *surface.on_planes):  # takes the part across
        pulls -= np.outer(on[curve.pairs].all(axis=1) * (pulls @ plane.normal), plane.normal)
    sums = np.linalg.norm(pulls, axis=1)
    most = float(np.linalg.norm(left, axis=1).max(initial=0.0)) / (float(lengths.mean()) or 1.0)
    return lengths, sums, {"length": float(lengths.sum()), **middle(surface, curve), "force_left": most}


def cable_end_table(surface: Surface, ends: Iterable[CableEnd]) -> pd.DataFrame:
    """A row per end of each part of a cable: where it is, whether a support holds it, and the force.

    ``force_x``, ``force_y``, ``force_z`` is what a support there exerts on the cable: -(τ + g z) t, t the
    direction from the end along the cable. Where several cables end, their support carries the sum.
    """
    rows = [
        [cable.name, v, *surface.vertices[v].tolist(), bool(surface.supported[v]), *force.tolist()]
        for cable, v, force in ends
    ]
    columns = ["cable", "vertex", *"xyz", "held", "force_x", "force_y", "force_z"]
    return pd.DataFrame(rows, columns=columns if rows else None)


def room_table(surface: Surface) -> pd.DataFrame:
    """A row per room of prescribed volume; see ``Certificate.rooms``."""
    if not surface.rooms:
        return pd.DataFrame()
    wanted, reached = prescribed_volumes(surface), room_volumes(surface)
    names, pressure = [room.name for room in surface.rooms], room_pressures(surface)
    columns = {"room": names, "volume": reached, "prescribed": wanted}
    return pd.DataFrame(columns | {"difference": (reached - wanted) / np.abs(wanted), "pressure": pressure})


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
    rows, sines = [], lean_sines(surface)
    for wall in np.flatnonzero(surface.walls):
        faces = np.flatnonzero(surface.patch_of_face == wall)
        if len(faces):  # else it is pinched all along
            face = faces[np.abs(sines[faces]).argmax()]
            angle = float(np.degrees(np.arcsin(min(1.0, abs(sines[face])))))
            place = surface.vertices[surface.faces[face]].mean(axis=0)
            rows.append([surface.patches[wall].name, angle, *place])
    return pd.DataFrame(rows, columns=["wall", "lean", *"xyz"])


def cut_note(surface: Surface) -> str:
    """What of a cell's energy does not depend on where the cell is cut; empty where all of it does not."""
    if not surface.net_pressures.any() or len(lattice_of(surface)) < 3:
        return ""
    areas = float(surface.tensions @ patch_areas(surface))
    return f"; {areas:.10g} of areas, and the volumes as they are where the cell is cut"


def lean_texts(table: pd.DataFrame, size: float, least: float = 0.05) -> list[str]:
    """The walls that lean by ``least`` degrees or more, in words, the most first; ``size`` of the surface."""
    leaning = table[table["lean"] >= least].sort_values("lean", ascending=False)
    rows = leaning[["wall", "lean", *"xyz"]].itertuples(index=False, name=None)
    return [f"{wall!r} by {lean:.1f}° near {point_text(np.array(at), size)}" for wall, lean, *at in rows]
