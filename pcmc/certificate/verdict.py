"""The verdict: an ordered table of rules over the findings about a surface. The first match decides."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property

import numpy as np

from ..base.arrays import Bools, Floats
from ..base.tolerances import COLLAPSED, NEAR_NEUTRAL, NEUTRAL, NOISE, WEAK
from ..forces.cables import heavy_cable_pulls
from ..forces.triangles import heavy_triangle_pulls
from ..stability.modes import Spectrum
from ..surface import Surface
from ..surface.pieces import point_text
from .balance import coarseness, growing_part, hardly_balanced, overload, unbalanced, unheld
from .cables import too_long, weak_cable
from .diagnosis import Neck, describe_saddle, folded_over, held_wall_down, pinched_neck, where_collapsed
from .proof import Attempt, Overload, Proof

NO_TENSION = "no patch has a tension: every shape is at rest"
FACTOR = 1e6  # between two tensions: from here it may be why a second variation is singular


class Verdict(Enum):
    """What kind of equilibrium a surface is, or why it is none. The value is a sentence."""

    STABLE = "stable: at rest, and every small change of shape of this mesh raises the energy"
    NEUTRAL = "neutral: at rest, and some change of shape costs almost no energy"
    SADDLE = "saddle: at rest, but some change of shape lowers the energy"
    NOT_CONVERGED = "not converged: the forces do not balance yet; solve further"
    NO_EQUILIBRIUM = "no equilibrium: no smooth surface is at rest here, as the detail proves"
    NONE_FOUND = (
        "none found: no equilibrium was found, nor a proof that there is none; the detail has what was tried"
    )
    RAN_AWAY = "ran away from this start: another start may come to rest; nothing proves that none does"
    UNDECIDED = "undecided: rounding hides whether it is at rest, or stable; the detail has the reason"
    WALL_DOWN = "wall down: a junction comes down on the held bottom of its wall, where it cannot rest"
    DEGENERATE = "degenerate mesh: triangles are collapsed or folded; remesh, or start from another shape"


class Evidence(Enum):
    """What happened to a surface while it was solved; its shape alone may not show it."""

    INFLATED = "it grew without bound"
    VANISHED = "it shrank to nothing"
    COLLAPSED = "its triangles collapsed"


@dataclass(frozen=True, eq=False)
class Findings:
    """What the verdict about a surface depends on."""

    surface: Surface
    pinchable: Bools  # (patches,) its walls that can pinch
    residual: float  # forces left, relative
    tolerance: float  # the most at which it counts as at rest
    quality: float  # smallest triangle quality outside walls that can pinch
    spectrum: Spectrum  # how many eigenvalues are negative, and how many nearly zero
    own_residuals: Floats  # (patches,) each patch's forces left, relative to its own
    rounding: float = 0.0  # what rounding of the coordinates alone leaves of the residual, about
    evidence: Evidence | None = None  # what happened on the way, if a solver was there to see it
    tried: tuple[Attempt, ...] = ()  # by a search
    mode: Floats = field(default_factory=lambda: np.empty((0, 3)))  # (n,3) the lowest; empty if unknown
    rigid: int = 0  # number of rigid motions that nothing resists, where rooms prescribe volumes
    pulled: tuple[int, ...] = ()  # pinched vertices at which the sheets pull harder than the wall can hold
    left_over: str = ""  # where pressures do not cancel at free edges, as a sentence

    @property
    def moving(self) -> bool:
        """Whether forces are left."""
        return self.residual > self.tolerance

    @cached_property
    def overload(self) -> Overload | None:
        """The load that no smooth surface could carry, while forces are left."""
        return overload(self.surface) if self.moving else None

    @cached_property
    def proofs(self) -> tuple[Proof, ...]:
        """Why there is no equilibrium, while forces are left.

        A mesh may come to rest under a load a little above what a smooth surface carries: where no solver saw
        it inflate or collapse, an overload within ``coarseness`` is left out.
        """
        if not self.moving:
            return ()
        settled, load = self.evidence in (Evidence.INFLATED, Evidence.COLLAPSED), self.overload
        if load and not settled and load.ratio <= 1.0 + coarseness(self.surface):
            load = None
        return theorems(self.surface, self.pinchable, load)

    @property
    def folds(self) -> list[Attempt]:
        """The attempts whose branch of equilibria folds before it arrives."""
        return [attempt for attempt in self.tried if attempt.folds]

    @property
    def lost(self) -> bool:
        """Whether a solver saw the surface run away, or a branch of equilibria fold."""
        away = self.evidence in (Evidence.INFLATED, Evidence.VANISHED) or self.neck is not None
        return self.moving and bool(away or self.folds)

    @cached_property
    def hardly_balanced(self) -> str:
        """Names a junction whose tensions can hardly balance, while forces are left; else empty."""
        return hardly_balanced(self.surface, self.pinchable) if self.moving else ""

    @cached_property
    def neck(self) -> Neck | None:
        """The neck that pinches off, if triangles have collapsed there."""
        return pinched_neck(self.surface) if self.moving and self.collapsed else None

    @cached_property
    def folded(self) -> str:
        """Names a patch that is folded over, else empty: its area counts more than once there."""
        return folded_over(self.surface, self.pinchable)

    @property
    def collapsed(self) -> bool:
        return self.evidence is Evidence.COLLAPSED or self.quality <= COLLAPSED

    @property
    def wall_down(self) -> bool:
        """Whether they have collapsed in a wall with a held bottom."""
        return self.collapsed and held_wall_down(self.surface, self.pinchable)


def theorems(surface: Surface, pinchable: Bools, load: Overload | None = None) -> tuple[Proof, ...]:
    """What rules out a smooth surface at rest, with an overload if one is given."""
    found = unbalanced(surface, pinchable), load, unheld(surface), weak_cable(surface)
    return tuple(proof for proof in found if proof is not None)


def only_coarse(surface: Surface, pinchable: Bools) -> str:
    """Why no smooth surface is at rest where this mesh is; empty if nothing is known against one."""
    why = "; ".join(map(str, theorems(surface, pinchable, overload(surface))))
    return why and f"only a mesh as coarse as this is at rest here, no smooth surface is: {why}"


def judge(f: Findings) -> tuple[Verdict, str]:
    """The verdict on the findings and its reason, by the first of ``RULES`` that applies; with notes."""
    verdict, reason = next((verdict, reason) for verdict, applies, reason in RULES if applies(f))
    parts = reason(f)
    told = [parts] if isinstance(parts, str) else [*parts]
    if not f.moving and f.quality > COLLAPSED and f.surface.tensions.any():
        told.append(only_coarse(f.surface, f.pinchable))
    if f.pulled:
        text = f"at {len(f.pulled)} pinched vertices, the first {f.pulled[0]}, the sheets pull harder than"
        told.append(f"{text} the wall can hold: the wall will stand there once solved")
    return verdict, "; ".join(str(part) for part in (*told, f.left_over) if part)


def _none_found(f: Findings) -> list[object]:
    return [growing_part(f.surface), *f.tried, f.neck, _compressed(f)]


def _ran_away(f: Findings) -> str:
    if f.neck is not None:
        return f"{f.neck}; bring the held curves nearer to each other, or raise the pressure"
    if f.evidence is Evidence.INFLATED:
        what = "start lower, raise the tensions or lower the pressures"
        return f"it grew without bound; {what}, or follow the pressure from a lower one (pcmc.follow)"
    return "it shrank to nothing; hold it with fixed= or on_plane=, raise the pressure, or start larger"


def _collapse(f: Findings) -> list[object]:
    return [f.hardly_balanced, too_long(f.surface), where_collapsed(f.surface, f.pinchable), *f.tried[1:]]


def _residual(f: Findings) -> str:
    return f"relative residual {f.residual:.1e}, tolerance {f.tolerance:.0e}"


def _forces_left(f: Findings) -> list[object]:
    X, coarser = f.surface.vertices[f.surface.free], np.finfo(np.float32).eps / np.finfo(float).eps
    few = f.residual <= NOISE * coarser * f.rounding and np.array_equal(X, X.astype(np.float32))
    digits = "its coordinates are in single precision, as in a .glb file, which alone leaves as much"
    coarse = f"{f.overload}: only a mesh as coarse as this may come to rest, a finer one cannot"
    reasons = [_residual(f), digits if few else "", f.hardly_balanced, too_long(f.surface), _compressed(f)]
    return [*reasons, coarse if f.overload else "", *f.tried[1:]]


def _weak_patch(f: Findings) -> str:
    name = f.surface.patches[int(f.own_residuals.argmax())].name
    text = f"the forces left in patch {name!r}, or in an island of it, are {f.own_residuals.max():.1e} of its"
    return f"{text} own, which are small beside those of the rest; solve with a smaller tolerance"


def _hidden_forces(f: Findings) -> str:
    text = f"{_residual(f)}, but rounding of the coordinates alone leaves about {f.rounding:.0e}: parts that"
    text += " are small beside their coordinates lose their digits"
    return f"{text}; move the origin near them, or solve them by themselves"


def _hidden_stability(f: Findings) -> list[object]:
    unknown = "the second variation is singular to rounding, so its negative eigenvalues cannot be counted"
    reason = f"the forces balance (relative residual {f.residual:.1e}), but {f.spectrum.hidden or unknown}"
    tensions = f.surface.tensions[f.surface.tensions > 0.0]
    factor = tensions.max(initial=0.0) / tensions.min(initial=np.inf)
    return [reason, f"the tensions differ by a factor of {factor:.0e}" if factor > FACTOR else ""]


def _compressed(f: Findings) -> str:
    """Names a patch or cable whose weight leaves no tension; or empty, as where it grew without bound."""
    surface = f.surface
    pulls = heavy_triangle_pulls(surface)
    faces, edges = np.flatnonzero(pulls <= 0.0), np.flatnonzero(heavy_cable_pulls(surface) <= 0.0)
    if not len(faces) + len(edges) or f.evidence is Evidence.INFLATED:
        return ""
    if not len(faces):
        ends = surface.cable_edges.ends[edges[0]]
        name = next(c.name for c in surface.cables if (c.edges == np.sort(ends)).all(axis=1).any())
        place = point_text(surface.vertices[ends].mean(axis=0), surface.size)
        text = f"cable {name!r} is under compression at {place} ({len(edges)} edges of cables are)"
        return f"{text}: its weight leaves τ + g z ≤ 0; raise its tension, or put Π lower"
    worst = pulls.argmin()
    name = surface.patches[surface.patch_of_face[worst]].name
    place = point_text(surface.vertices[surface.faces[worst]].mean(axis=0), surface.size)
    return (
        f"patch {name!r} is under compression in {len(faces)} triangles: its weight leaves α + w z ="
        f" {pulls.min():.3g} at {place}, and a sheet buckles there; raise its tension, or put Π lower"
    )


def _saddle(f: Findings) -> list[object]:
    return [describe_saddle(f.surface, f.spectrum.index or f.spectrum.below or 0, f.mode), _near_fold(f)]


def _free(f: Findings) -> str:
    where = "in this cell" if f.surface.periodic and not f.surface.rooms else "at these volumes"
    return f"nothing resists {f.rigid} rigid motions; every change of shape {where} raises E"


def _near_fold(f: Findings) -> str:
    """Names what nearly lets go, so that the certificate of a fold says where it is; else empty."""
    count, band = (f.spectrum.soft, NEUTRAL) if f.spectrum.soft else (f.spectrum.near, NEAR_NEUTRAL)
    if not count:
        return ""
    index = f.spectrum.index
    signs = "of signs that rounding hides" if index is None else f"index {index}"
    modes = "1 softest mode" if count == 1 else f"{count} softest modes"
    return f"at a fold or a branching, or near one: {modes} within ±{band:g} α/size², {signs}"


# a verdict, when it applies, and the reason, or its parts
RULES: tuple[tuple[Verdict, Callable[[Findings], object], Callable[[Findings], str | list[object]]], ...] = (
    (Verdict.NEUTRAL, lambda f: not f.surface.tensions.any(), lambda f: NO_TENSION),
    (Verdict.NO_EQUILIBRIUM, lambda f: f.proofs, lambda f: [*f.proofs, *f.folds, f.neck]),
    (Verdict.NONE_FOUND, lambda f: f.lost and f.tried, _none_found),
    (Verdict.RAN_AWAY, lambda f: f.lost, _ran_away),
    (Verdict.WALL_DOWN, lambda f: f.moving and f.wall_down, _collapse),
    (Verdict.DEGENERATE, lambda f: f.collapsed, _collapse),
    (Verdict.UNDECIDED, lambda f: f.moving and f.residual <= NOISE * f.rounding, _hidden_forces),
    (Verdict.NOT_CONVERGED, lambda f: f.moving, _forces_left),
    (Verdict.NOT_CONVERGED, lambda f: f.own_residuals.max() > WEAK * f.tolerance, _weak_patch),
    (Verdict.DEGENERATE, lambda f: f.folded, lambda f: f.folded),
    (Verdict.SADDLE, lambda f: (heavy_triangle_pulls(f.surface) <= 0.0).any(), _compressed),
    (Verdict.SADDLE, lambda f: (heavy_cable_pulls(f.surface) <= 0.0).any(), _compressed),
    (Verdict.UNDECIDED, lambda f: f.spectrum.unknown, _hidden_stability),
    (Verdict.SADDLE, lambda f: f.spectrum.below, _saddle),
    (Verdict.NEUTRAL, lambda f: f.rigid > 0, _free),
    (Verdict.NEUTRAL, lambda f: f.spectrum.soft, _near_fold),
    (Verdict.STABLE, lambda f: True, _near_fold),
)
