"""What a finished surface is: how near to equilibrium, how true to its curvatures, how stable.

``certify`` looks at the surface alone; the certificate on a solver's result also knows how the solver ended.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
import pandas as pd

from ..base.arrays import Bools, Floats, Ints
from ..contact.pinching import Walls, excess, standing
from ..energy.curvature import METHODS, curvature_error, mean_curvature
from ..energy.functional import energy_and_gradient, patch_areas, volume
from ..energy.motion_space import MotionSpace, VertexClasses, force_scale, motion_space
from ..energy.rigid_motions import rigid_modes, rigid_motions
from ..meshing.quality import triangle_quality
from ..stability.factorisation import SingularMatrix
from ..stability.modes import Stiffness, lowest, stiffness
from ..surface import Surface
from ..surface.geometry import face_areas
from ..surface.topology import SHEET
from .balance import (
    boundary_table,
    coarseness,
    hardly_balanced,
    junction_table,
    load,
    load_ratio,
    reactions,
    seen_from_point,
    unbalanced,
)
from .collapse import where_collapsed

TOLERANCE = 1e-8  # relative residual up to which a surface counts as at rest
NEUTRAL = 1e-2  # |λ| size²/α below which a mode counts as neutral
SMALL = 1e3  # tolerances of its own forces that a patch may lack where stronger ones hide it
ENDED_BADLY = ("DIVERGED", "DEGENERATE")
COLLAPSED = 1e-3  # triangle quality below which a mesh counts as degenerate


class Verdict(Enum):
    """What a surface is found to be. The value is a sentence."""

    STABLE = "stable: at rest, and every small change of shape raises the energy"
    NEUTRAL = "neutral: at rest, and some change of shape costs almost no energy"
    SADDLE = "saddle: at rest, but some change of shape lowers the energy"
    NOT_CONVERGED = "not converged: forces are left; solve further"
    NO_EQUILIBRIUM = "no equilibrium: tension and pressure cannot balance; change the tensions"
    DEGENERATE = "degenerate mesh: triangles have collapsed; remesh, or start from another shape"


@dataclass(frozen=True, eq=False)
class Certificate:
    """The findings about one surface. ``print`` shows them as a table.

    Attributes
    ----------
    verdict, detail : what the surface is, and what exactly (which mode, patch or place).
    residual : ‖Bᵀ∇E‖ over ``scale``: the forces left in the motion space, and the pull on pinched
        vertices beyond what their wall holds, relative.
    scale : norm of the single triangles' tension forces, force.
    energy, volume : E (force·length) and the volume under the roof (length³).
    index : Morse index; None where the surface is not at rest. Rigid motions are not counted.
    eigenvalues : lowest second variations per unit area and displacement, force/length³, ascending.
    modes : (k,n,3) the displacement fields that belong to them, unit mass.
    curvature_error : largest |H - H̄|/H̄ by the variational definition.
    quality : smallest triangle quality outside pinched walls; ``walls_quality`` in walls that slide.
    patches : a row a patch: target, area, tension, errors by both definitions, quality.
    junctions : a row a junction curve: length, its middle (the centre of a closed one), forces left and
        Σ α n, force/length.
    boundaries : a row a held boundary curve: length, middle, reaction, largest reaction per length. A
        corner gives each of its curves an equal part of its reaction; per length it counts whole.
    load, support : forces along Π's normal, of the pressure and of all supports; they add up to 0
        but for what the mesh leaves along the sheets.
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
    load: float
    support: float
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
            ("load, reactions", f"{self.load:.6g}, {self.support:.6g} along the plane's normal"),
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
    found = standing(surface)
    shown, below, rests, classes = found.surface, found.walls, found.rests, found.classes
    X = shown.vertices
    space = motion_space(shown, classes, X)
    value, forces = energy_and_gradient(shown, X, supports=False)
    scale = force_scale(shown, classes, X)
    unheld = excess(shown, below, rests)
    residual = (
        float(np.hypot(np.linalg.norm(space.to_coordinates(forces)), np.linalg.norm(unheld)))
        / scale
    )
    quality, walls_quality = _quality(shown, below)
    system = None
    if residual <= tolerance and quality > COLLAPSED:
        system = _system(shown, classes, space)
    values, fields = _modes(system, modes)
    ratio, carried = load_ratio(shown), reactions(shown)
    missing = space.project(forces)
    own = _own_residuals(shown, classes, missing)
    softest = _softest(shown, classes, values, fields)
    verdict, detail = _verdict(
        surface, residual, tolerance, quality, system, own, softest, ratio, status, below.pinchable
    )
    return Certificate(
        verdict=verdict,
        detail="; ".join(filter(None, (detail, _pulled_off(unheld), seen_from_point(shown)))),
        residual=residual,
        scale=scale,
        energy=value,
        volume=volume(surface),
        index=None if system is None else system.negative,
        eigenvalues=values,
        modes=fields,
        curvature_error=_largest(pd.Series(np.abs(curvature_error(shown, "variational")))),
        quality=quality,
        walls_quality=walls_quality,
        patches=_patch_table(surface, shown),
        junctions=junction_table(shown, missing),
        boundaries=boundary_table(shown),
        load=load(shown),
        support=float((carried @ np.array(surface.plane.normal)).sum()),
        reactions=carried,
        pinched=np.flatnonzero(rests),
        load_ratio=ratio,
        status=status,
    )


def _system(surface: Surface, classes: VertexClasses, space: MotionSpace) -> Stiffness | None:
    rigid = rigid_modes(space, rigid_motions(surface), surface.vertices)
    try:
        return stiffness(surface, classes, space, rigid)
    except SingularMatrix:
        return None


def _modes(system: Stiffness | None, count: int) -> tuple[Floats, Floats]:
    if system is None or count < 1 or len(system.mass) < 3:
        return np.empty(0), np.empty((0, 0, 3))
    return lowest(system, count)


def _verdict(
    surface: Surface, residual: float, tolerance: float, quality: float,
    system: Stiffness | None, own: Floats, softest: float, ratio: float, status: str, sliding: Bools,
) -> tuple[Verdict, str]:  # fmt: skip
    if not surface.tensions.any():
        return Verdict.NEUTRAL, "no patch has a tension: every shape is at rest"
    strained = hardly_balanced(surface, sliding) if residual > tolerance else ""
    if residual > tolerance:
        too_strong = unbalanced(surface, sliding)
        if too_strong:
            return Verdict.NO_EQUILIBRIUM, too_strong
        # a solver that ended badly settles what a coarse mesh leaves open
        if ratio > 1.0 + (0.0 if status in ENDED_BADLY else coarseness(surface)):
            times = (
                f"{ratio:.3f}" if ratio < 1.1 else f"{ratio:.2f}" if ratio < 1e4 else f"{ratio:.3g}"
            )
            why = f"the pressure is {times} times what the boundary's tension could carry"
            return Verdict.NO_EQUILIBRIUM, why
        if status == "DIVERGED":
            why = "the surface inflates without bound (seen on this way; no proof for others)"
            return Verdict.NO_EQUILIBRIUM, why
        if status == "VANISHED":
            return Verdict.NO_EQUILIBRIUM, "nothing holds the surface, and it shrinks to nothing"
    if status == "DEGENERATE" or quality <= COLLAPSED:
        return Verdict.DEGENERATE, "; ".join(
            filter(None, (strained, where_collapsed(surface, sliding)))
        )
    if residual > tolerance or system is None:
        why = f"relative residual {residual:.1e}, asked {tolerance:.0e}"
        if strained:
            why += f"; {strained}"
        if ratio > 1.0:
            why += (
                f"; the pressure is {ratio:.3f} times what the boundary's tension could carry: a"
                " fine mesh cannot come to rest, one as coarse as this may"
            )
        return Verdict.NOT_CONVERGED, why
    if own.max() > SMALL * tolerance:
        name = surface.patches[int(own.argmax())].name
        why = (
            f"patch {name!r} lacks {own.max():.1e} of its own forces, which are small beside those"
            " of others; solve with a smaller tolerance"
        )
        return Verdict.NOT_CONVERGED, why
    if system.negative:
        ways = "1 way" if system.negative == 1 else f"{system.negative} ways"
        return Verdict.SADDLE, f"index {system.negative}: {ways} down"
    if abs(softest) < NEUTRAL:
        return Verdict.NEUTRAL, f"softest mode {softest:.1e} in units of α/size²"
    return Verdict.STABLE, ""


def _own_residuals(surface: Surface, classes: VertexClasses, missing: Floats) -> Floats:
    """(k,) of each patch: the forces missing inside over the norm of its own triangles' forces."""
    F, patch, count = surface.faces, surface.patch_of_face, len(surface.patches)
    sides = surface.vertices[F[:, [1, 2, 0]]] - surface.vertices[F]
    forces = 0.25 * surface.tensions[patch] ** 2 * np.einsum("fij,fij->f", sides, sides)
    scale = np.bincount(patch, forces, count)
    owner = np.zeros(surface.n, dtype=np.int64)
    owner[F] = patch[:, None]
    left = np.einsum("ij,ij->i", missing, missing) * (classes.kind == SHEET)
    return np.asarray(np.sqrt(np.bincount(owner, left, count) / np.where(scale > 0.0, scale, 1.0)))


def _softest(surface: Surface, classes: VertexClasses, values: Floats, fields: Floats) -> float:
    """The lowest λ in units of α/size², α the tension of what its mode moves; infinite without one."""
    if not len(values):
        return np.inf
    X, F = surface.vertices, classes.faces
    area = face_areas(X[F])
    moved = area * np.einsum("fij,fij->f", fields[0][F], fields[0][F])
    tension = float(surface.tensions[classes.patch_of_face] @ moved / moved.sum())
    return float(values[0]) * surface.size**2 / tension


def _pulled_off(unheld: Floats) -> str:
    """Names the resting vertices that the sheets pull harder than the wall holds; or empty."""
    found = np.flatnonzero(unheld)
    if not len(found):
        return ""
    return (
        f"at {len(found)} pinched vertices, the first {found[0]}, the sheets pull harder than the"
        " wall can: it stands off there once solved"
    )


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
        inside &= np.isfinite(mean)
        row: dict[str, Any] = {
            "patch": patch.name, "tension": patch.tension, "pressure": patch.pressure,
            "target": patch.target_curvature, "area": float(areas[index]),
            "mean_H": float(mean[inside].mean()) if inside.any() else np.nan,
        }  # fmt: skip
        for method, error in errors.items():
            found = error[inside & np.isfinite(error)]
            row[f"{method}_max"] = float(found.max()) if len(found) else np.nan
            row[f"{method}_mean"] = float(found.mean()) if len(found) else np.nan
        row["quality"] = float(quality[faces].min(initial=1.0))
        rows.append(row)
    return pd.DataFrame(rows)


def _largest(values: pd.Series) -> float:
    found = values[np.isfinite(values)]
    return float(found.max()) if len(found) else 0.0
