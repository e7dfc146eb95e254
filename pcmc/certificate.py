"""What a finished surface is: how near to equilibrium, how true to its curvatures, how stable.

``certify`` looks at the surface alone; the certificate on a solver's result also knows how the solver ended.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
import pandas as pd

from . import kernels
from .arrays import Bools, Floats, Ints
from .contact import Walls, pinched, resting, standing_structure, walls
from .curvature import METHODS, curvature_error, mean_curvature
from .energy import energy_and_gradient, patch_areas, volume
from .factor import SingularMatrix
from .modes import Stiffness, lowest, stiffness
from .motion import MotionSpace, Structure, force_scale, motion_space
from .quality import edge_lengths, triangle_quality
from .rigid import rigid_modes, rigid_motions
from .surface import Surface
from .topology import Curve

TOLERANCE = 1e-8  # relative residual up to which a surface counts as at rest
NEUTRAL = 1e-2  # |λ| size²/α below which a mode counts as neutral
COLLAPSED = 1e-3  # triangle quality below which a mesh counts as degenerate


class Verdict(Enum):
    """What a surface is found to be. The value is a sentence."""

    STABLE = "stable: at rest, and every small change of shape raises the energy"
    NEUTRAL = "neutral: at rest, and some change of shape costs almost no energy"
    SADDLE = "saddle: at rest, but some change of shape lowers the energy"
    NOT_CONVERGED = "not converged: forces are left; solve further"
    NO_EQUILIBRIUM = "no equilibrium: the tension cannot carry the pressure; raise the tensions"
    DEGENERATE = "degenerate mesh: triangles have collapsed; remesh, or start from another shape"


@dataclass(frozen=True, eq=False)
class Certificate:
    """The findings about one surface. ``print`` shows them as a table.

    Attributes
    ----------
    verdict, detail : what the surface is, and what exactly (which mode, patch or place).
    residual : ‖Bᵀ∇E‖ over ``scale``; the forces left in the motion space, relative.
    scale : norm of the single triangles' tension forces, force.
    energy, volume : E (force·length) and the volume under pressure (length³).
    index : Morse index; None where the surface is not at rest. Rigid motions are not counted.
    eigenvalues : lowest second variations per unit area and displacement, force/length³, ascending.
    modes : (k,n,3) the displacement fields that belong to them, unit mass.
    curvature_error : largest |H - H̄|/H̄ by the variational definition.
    quality : smallest triangle quality outside pinched walls; ``walls_quality`` in walls that slide.
    patches : a row a patch: target, area, tension, errors by both definitions, quality.
    junctions : a row a junction curve: length, forces left and Σ α n, force/length.
    boundaries : a row a held boundary curve: length, reaction, largest reaction per length. A corner
        gives each of its curves an equal part of its reaction; per length it counts whole.
    reactions : (n,3) force that each support exerts on the surface.
    pinched : (k,) vertices where a junction rests on Π and its wall has no height.
    load_ratio : pressure along Π's normal over the most that the boundary's tension could carry; see
        the function ``load_ratio``.
    """

    verdict: Verdict
    detail: str
    residual: float
    scale: float
    energy: float
    volume: float
    index: int | None
    eigenvalues: Floats
    modes: Floats
    curvature_error: float
    quality: float
    walls_quality: float
    patches: pd.DataFrame
    junctions: pd.DataFrame
    boundaries: pd.DataFrame
    reactions: Floats
    pinched: Ints
    load_ratio: float
    status: str = field(default="")

    @property
    def certified(self) -> bool:
        """At rest, and neither a saddle nor degenerate."""
        return self.verdict in (Verdict.STABLE, Verdict.NEUTRAL)

    def numbers(self) -> dict[str, Any]:
        """The scalar findings, for tables."""
        return {
            "verdict": self.verdict.name.lower(),
            "residual": self.residual,
            "energy": self.energy,
            "volume": self.volume,
            "index": self.index,
            "lowest_eigenvalue": float(self.eigenvalues[0]) if len(self.eigenvalues) else None,
            "curvature_error": self.curvature_error,
            "curvature_error_cotangent": _largest(self.patches["cotangent_max"]),
            "quality": self.quality,
            "walls_quality": self.walls_quality,
            "pinched": len(self.pinched),
            "load_ratio": self.load_ratio,
        }

    def __str__(self) -> str:
        rows = [
            ("verdict", self.verdict.value),
            ("", self.detail),
            ("residual", f"{self.residual:.2e} of {self.scale:.4g}"),
            ("energy", f"{self.energy:.10g}"),
            ("volume", f"{self.volume:.6g}"),
            ("Morse index", "-" if self.index is None else str(self.index)),
            ("lowest eigenvalue", f"{self.eigenvalues[0]:.4g}" if len(self.eigenvalues) else "-"),
            ("curvature error", f"{self.curvature_error:.2e}"),
            ("triangle quality", f"{self.quality:.3f} (sliding walls {self.walls_quality:.3f})"),
            ("pinched vertices", str(len(self.pinched))),
            ("load over capacity", f"{self.load_ratio:.3f}"),
        ]
        head = "\n".join(f"{name:>20}  {text}" for name, text in rows if text)
        tables = [
            frame.to_string(index=False, float_format=lambda x: f"{x:.4g}")
            for frame in (self.patches, self.junctions, self.boundaries)
            if len(frame)
        ]
        return "\n\n".join([head, *tables])


def certify(
    surface: Surface, *, modes: int = 1, tolerance: float = TOLERANCE, status: str = ""
) -> Certificate:
    """Examine a surface.

    Parameters
    ----------
    modes : how many of the lowest modes to compute; the index is counted in any case.
    tolerance : relative residual up to which it counts as at rest.
    status : how a solver ended, if one did: ``"DIVERGED"``, ``"VANISHED"`` and ``"DEGENERATE"`` settle the
        verdict.

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> found = certify(roof)
    >>> found.verdict.name, found.index, found.curvature_error < 1e-12
    ('STABLE', 0, True)
    """
    below = walls(surface)
    rests = resting(surface, below)
    standing = pinched(surface, below, rests)
    frame = standing_structure(standing, below, rests)
    X = standing.vertices
    space = motion_space(standing, frame, X)
    value, forces = energy_and_gradient(standing, X, supports=False)
    scale = force_scale(standing, frame, X)
    residual = float(np.linalg.norm(space.pull(forces))) / scale
    quality, walls_quality = _quality(standing, below)
    system = None
    if residual <= tolerance and quality > COLLAPSED:
        system = _system(standing, frame, space)
    values, fields = _modes(system, modes)
    ratio = load_ratio(standing)
    verdict, detail = _verdict(
        surface, residual, tolerance, quality, system, values, ratio, status, below.pinchable
    )
    return Certificate(
        verdict=verdict,
        detail=detail,
        residual=residual,
        scale=scale,
        energy=value,
        volume=volume(surface),
        index=None if system is None else system.negative,
        eigenvalues=values,
        modes=fields,
        curvature_error=_largest(pd.Series(np.abs(curvature_error(standing, "variational")))),
        quality=quality,
        walls_quality=walls_quality,
        patches=_patch_table(surface, standing),
        junctions=_junction_table(standing, space.project(forces)),
        boundaries=_boundary_table(standing),
        reactions=_reactions(standing),
        pinched=np.flatnonzero(rests),
        load_ratio=ratio,
        status=status,
    )


def load_ratio(surface: Surface) -> float:
    """Pressure along Π's normal over the most that tension at the boundary could carry.

    Vertical balance of the whole: p |Ω| ≤ Σ α length(∂Ω) + Σ α_wall length(wall feet). Above 1 no
    smooth surface with this boundary is at rest, whatever its shape. A mesh may be: its triangles
    balance along the normals alone. A cap over the unit disc with edge length 0.2 comes to rest down
    to α = 0.493, where the ratio is 1.014; a pyramid over a square with one free vertex down to
    α = 1/3, at 1.5. The verdict draws on the ratio only above ``1 + coarseness``. 0 for a closed
    surface.
    """
    topo = surface.topology
    edge_patch = np.full(len(topo.edges), -1)
    edge_patch[topo.edge_of_face] = surface.patch_of_face[:, None]
    boundary = np.flatnonzero(topo.boundary_edge)
    ends = surface.vertices[topo.edges[boundary]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    capacity = float(surface.tensions[edge_patch[boundary]] @ length)
    corners = surface.vertices[surface.faces]
    vector = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    push = surface.pressures[surface.patch_of_face] @ (vector @ np.array(surface.plane.normal))
    return float(abs(push)) / capacity if capacity > 0.0 else 0.0


def coarseness(surface: Surface) -> float:
    """(h / R)², h the mean length of the boundary's edges and R = 2 · area / length of the plan.

    Of the size of the error with which a mesh balances; 0 for a closed surface.

    >>> from pcmc import Patch
    >>> square = Surface([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], [[0, 1, 2], [2, 3, 0]],
    ...                  [0, 0], [Patch("floor", 1.0)], fixed=range(4))
    >>> coarseness(square)
    4.0
    """
    X, topo = surface.vertices, surface.topology
    ends = X[topo.edges[topo.boundary_edge]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    corners = X[surface.faces[surface.pressures[surface.patch_of_face] != 0.0]]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
    plan = 0.5 * abs(float(across @ np.array(surface.plane.normal)))
    if not len(length) or plan == 0.0:
        return 0.0
    return float((length.mean() * length.sum() / (2.0 * plan)) ** 2)


def _system(surface: Surface, frame: Structure, space: MotionSpace) -> Stiffness | None:
    rigid = rigid_modes(space, rigid_motions(surface), surface.vertices)
    try:
        return stiffness(surface, frame, space, rigid)
    except SingularMatrix:
        return None


def _modes(system: Stiffness | None, count: int) -> tuple[Floats, Floats]:
    if system is None or count < 1 or len(system.mass) < 3:
        return np.empty(0), np.empty((0, 0, 3))
    return lowest(system, count)


def unbalanced(standing: Surface, pinchable: Bools) -> str:
    """Names a junction whose tensions cannot balance whatever the angles; empty if there is none.

    Σ α n = 0 (7) needs the largest tension to be at most the sum of the others. Where a junction is
    held all along, its support takes the difference; a wall that slides on Π and is stronger than its
    sheets brings its junction down to rest there.
    """
    held = standing.fixed | standing.on_plane
    for curve in standing.topology.junctions:
        strongest = max(curve.sheets, key=lambda patch: standing.tensions[patch])
        tensions = sorted(standing.tensions[list(curve.sheets)])
        if pinchable[strongest]:
            continue
        if tensions[-1] > sum(tensions[:-1]) * (1.0 + 1e-9) and not held[curve.vertices].all():
            names = " | ".join(standing.patches[i].name for i in curve.sheets)
            others = " + ".join(f"{tension:g}" for tension in tensions[:-1])
            return (
                f"the tensions at the junction {names} cannot balance: {tensions[-1]:g} > {others}"
            )
    return ""


def _verdict(
    surface: Surface, residual: float, tolerance: float, quality: float,
    system: Stiffness | None, values: Floats, ratio: float, status: str, sliding: Bools,
) -> tuple[Verdict, str]:  # fmt: skip
    if not surface.tensions.any():
        return Verdict.NEUTRAL, "no patch has a tension: every shape is at rest"
    if residual > tolerance:
        excess = unbalanced(surface, sliding)
        if excess:
            return Verdict.NO_EQUILIBRIUM, excess
        if ratio > 1.0 + coarseness(surface):
            why = f"the pressure is {ratio:.2f} times what the boundary's tension could carry"
            return Verdict.NO_EQUILIBRIUM, why
        if status == "DIVERGED":
            return Verdict.NO_EQUILIBRIUM, "the surface inflates without bound"
        if status == "VANISHED":
            return Verdict.NO_EQUILIBRIUM, "nothing holds the surface, and it shrinks to nothing"
    if status == "DEGENERATE" or quality <= COLLAPSED:
        return Verdict.DEGENERATE, _where_collapsed(surface, sliding)
    if residual > tolerance or system is None:
        why = f"relative residual {residual:.1e}, asked {tolerance:.0e}"
        if ratio > 1.0:
            why += (
                f"; the pressure is {ratio:.3f} times what the boundary's tension could carry: a"
                " fine mesh cannot come to rest, one as coarse as this may"
            )
        return Verdict.NOT_CONVERGED, why
    if system.negative:
        return Verdict.SADDLE, f"index {system.negative}: {system.negative} ways down"
    if len(values):
        relative = values[0] * surface.size**2 / surface.tensions.max()
        if abs(relative) < NEUTRAL:
            return Verdict.NEUTRAL, f"softest mode {relative:.1e} in units of α/size²"
    return Verdict.STABLE, ""


def _where_collapsed(surface: Surface, sliding: Bools) -> str:
    """Names the worst triangle outside the patches that may pinch, and what pressed on it."""
    X, topo = surface.vertices, surface.topology
    quality = triangle_quality(X, surface.faces)
    outer = np.where(sliding[surface.patch_of_face], np.inf, quality)
    face = int(outer.argmin())
    corners = X[surface.faces[face]]
    name = surface.patches[surface.patch_of_face[face]].name
    place = corners.mean(axis=0).round(4).tolist()
    said = f"worst is face {face} of patch {name!r} near {place}, quality {outer[face]:.1e}"
    reach = 1.5 * float(np.median(edge_lengths(surface)))
    near = np.linalg.norm(X - corners.mean(axis=0), axis=1) <= reach
    if (near & surface.fixed).any() and (near & topo.on_junction & ~surface.fixed).any():
        said += "; the junction there slips along a support, which does not hold its end"
    return said


def _quality(standing: Surface, below: Walls) -> tuple[float, float]:
    quality = triangle_quality(standing.vertices, standing.faces)
    sliding = below.pinchable[standing.patch_of_face]
    return float(quality[~sliding].min(initial=1.0)), float(quality[sliding].min(initial=1.0))


def _patch_table(surface: Surface, standing: Surface) -> pd.DataFrame:
    errors = {method: np.abs(curvature_error(standing, method)) for method in METHODS}
    mean = mean_curvature(standing, "variational")
    areas = patch_areas(surface)
    quality = triangle_quality(standing.vertices, standing.faces)
    rows = []
    for index, patch in enumerate(surface.patches):
        faces = standing.patch_of_face == index
        inside = np.zeros(surface.n, dtype=bool)
        inside[standing.faces[faces]] = True
        inside &= standing.topology.interior
        row: dict[str, Any] = {
            "patch": patch.name, "tension": patch.tension, "pressure": patch.pressure,
            "target": patch.target_curvature, "area": float(areas[index]),
            "mean_H": float(np.nanmean(mean[inside])) if inside.any() else np.nan,
        }  # fmt: skip
        for method, error in errors.items():
            found = error[inside & np.isfinite(error)]
            row[f"{method}_max"] = float(found.max()) if len(found) else np.nan
            row[f"{method}_mean"] = float(found.mean()) if len(found) else np.nan
        row["quality"] = float(quality[faces].min(initial=1.0))
        rows.append(row)
    return pd.DataFrame(rows)


def _junction_table(surface: Surface, left: Floats) -> pd.DataFrame:
    """Per junction curve: the forces left per length, and Σ α n of the triangles along it."""
    topo = surface.topology
    imbalance = np.linalg.norm(conormal_sum(surface), axis=1)
    number = {tuple(edge): i for i, edge in enumerate(topo.edges[_seams(topo)].tolist())}
    chosen = np.flatnonzero(_seams(topo))
    rows = []
    for curve in topo.junctions:
        pairs, lengths = _segments(surface, curve)
        edges = chosen[[number[tuple(pair)] for pair in np.sort(pairs, axis=1).tolist()]]
        total = float(lengths.sum())
        rows.append({
            "junction": " | ".join(surface.patches[i].name for i in curve.sheets),
            "length": total,
            "force_left": float(np.linalg.norm(left[curve.vertices], axis=1).max()) / _mean(lengths),
            "sum_alpha_n_mean": float(imbalance[edges] @ lengths) / total if total else 0.0,
            "sum_alpha_n_max": float(imbalance[edges].max()),
        })  # fmt: skip
    return pd.DataFrame(rows)


def conormal_sum(surface: Surface) -> Floats:
    """(e,3) Σ α n over the triangles at each edge, n the outward co-normal, force/length.

    Zero along a junction of smooth surfaces at rest (7); of triangles it is zero only in the limit.
    """
    topo = surface.topology
    X, F = surface.vertices, surface.faces
    total = np.zeros((len(topo.edges), 3))
    for corner in range(3):
        a, b, apex = X[F[:, corner - 2]], X[F[:, corner - 1]], X[F[:, corner]]
        along = b - a
        length = np.linalg.norm(along, axis=1)
        along /= np.where(length > 0.0, length, 1.0)[:, None]
        out = a - apex
        out -= np.einsum("ij,ij->i", out, along)[:, None] * along
        length = np.linalg.norm(out, axis=1)
        pull = surface.tensions[surface.patch_of_face] / np.where(length > 0.0, length, 1.0)
        np.add.at(total, topo.edge_of_face[:, corner], pull[:, None] * out)
    return total


def _boundary_table(surface: Surface) -> pd.DataFrame:
    reactions = _reactions(surface)
    held = surface.fixed | surface.on_plane
    loops = surface.topology.boundary_loops
    # a corner that several curves share gives each an equal part, so that the rows add up
    count = np.zeros(surface.n)
    for curve in loops:
        count[curve.vertices] += 1.0
    parts = reactions / np.maximum(count, 1.0)[:, None]
    share = held_lengths(surface)
    per_length = np.linalg.norm(reactions, axis=1) / np.where(share > 0.0, share, np.inf)
    rows = []
    for curve in loops:
        if not held[curve.vertices].any():
            continue
        total = parts[curve.vertices].sum(axis=0)
        rows.append({
            "boundary": " | ".join(surface.patches[i].name for i in curve.sheets),
            "length": float(_segments(surface, curve)[1].sum()),
            "reaction_x": float(total[0]), "reaction_y": float(total[1]),
            "reaction_z": float(total[2]),
            "per_length_max": float(per_length[curve.vertices].max()),
        })  # fmt: skip
    return pd.DataFrame(rows)


def held_lengths(surface: Surface) -> Floats:
    """(n,) half the length of the boundary edges at each vertex that are held at both ends, length."""
    held = surface.fixed | surface.on_plane
    ends = surface.topology.edges[surface.topology.boundary_edge]
    ends = ends[held[ends].all(axis=1)]
    half = 0.5 * np.linalg.norm(surface.vertices[ends[:, 1]] - surface.vertices[ends[:, 0]], axis=1)
    return np.asarray(np.bincount(ends.ravel(), np.repeat(half, 2), surface.n), dtype=float)


def _reactions(surface: Surface) -> Floats:
    """(n,3) what the supports exert: all of the force where fixed, its part normal to Π where sliding.

    The force at a vertex is Σ α ∂A - ⅓ Σ p A_T ν_T: a third of each triangle's tension and pressure.
    At a boundary this is not ∇E, whose volume is that of a cone to the point of Π: the cone's side
    moves with the boundary too, and has no pressure on it.
    """
    X, F = surface.vertices, surface.faces
    zero = np.zeros(len(surface.patches))
    forces = kernels.measure(X, F, surface.patch_of_face, np.zeros(3), surface.tensions, zero)[2]
    vector = np.cross(X[F[:, 1]] - X[F[:, 0]], X[F[:, 2]] - X[F[:, 0]]) / 6.0
    vector *= surface.pressures[surface.patch_of_face, None]
    for axis in range(3):
        forces[:, axis] -= np.bincount(F.ravel(), np.repeat(vector[:, axis], 3), surface.n)
    reactions = np.zeros_like(forces)
    reactions[surface.fixed] = forces[surface.fixed]
    sliding = surface.on_plane
    reactions[sliding] = forces[sliding] - surface.plane.along(forces[sliding])
    return reactions


def _segments(surface: Surface, curve: Curve) -> tuple[Ints, Floats]:
    order = np.append(curve.vertices, curve.vertices[:1]) if curve.closed else curve.vertices
    pairs = np.stack([order[:-1], order[1:]], axis=1)
    ends = surface.vertices[pairs]
    return pairs, np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


def _seams(topo: Any) -> Bools:
    return np.asarray(topo.junction_edge | topo.seam_edge)


def _mean(lengths: Floats) -> float:
    return float(lengths.mean()) or 1.0


def _largest(values: pd.Series) -> float:
    found = values[np.isfinite(values)]
    return float(found.max()) if len(found) else 0.0
