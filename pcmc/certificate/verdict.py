"""The verdict: an ordered table of rules over the findings about a surface. The first match decides."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property

import numpy as np

from ..base.arrays import Bools, Floats
from ..forces.triangles import compressed, effective_tensions
from ..stability.softness import Spectrum
from ..surface import Surface
from .balance import coarseness, describe_growing, growing_part, hardly_balanced, overload, unbalanced, unheld
from .cables import too_long, weak_cable
from .collapse import held_wall_down, where_collapsed
from .neck import Neck, pinched_neck
from .proof import Attempt, Overload, Proof
from .slipping import describe_saddle

NOISE = 10.0  # times what rounding of the coordinates leaves: forces up to here may be rounding alone
FACTOR = 1e6  # between two tensions: from here it may be why a second variation is singular
# |λ| size²/α up to which the detail names a fold. A mesh's own branch folds where the derivative of the
# forces left is singular, which is not quite the second variation: at reported folds of coarse caps,
# catenoids and pairs of caps |λ| is 0.003 to 0.55. A flat film over a disc has 46.
NEAR = 1.0
NEUTRAL = 1e-2  # |λ| size²/α up to which a motion counts as neutral, α the tension of what it moves
SMALL = 1e3  # tolerances of its own forces that a patch may lack where stronger ones hide it
COLLAPSED = 1e-3  # triangle quality up to which a mesh counts as degenerate


class Verdict(Enum):
    """What kind of equilibrium a surface is, or why it is none. The value is a sentence."""

    STABLE = "stable: at rest, and every small change of shape raises the energy"
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
    DEGENERATE = "degenerate mesh: triangles have collapsed; remesh, or start from another shape"


class Evidence(Enum):
    """What happened to a surface while it was solved; its shape alone may not show it."""

    INFLATED = "it grew without bound"
    VANISHED = "it shrank to nothing"
    COLLAPSED = "its triangles collapsed"


@dataclass(frozen=True, eq=False)
class Findings:
    """What the verdict about a surface depends on.

    Attributes
    ----------
    surface : the whole surface.
    pinchable : (patches,) bool, its walls that can pinch.
    residual, tolerance : forces left, relative; the most at which a surface counts as at rest.
    quality : smallest triangle quality outside walls that can pinch.
    spectrum : how many eigenvalues are negative, and how many nearly zero; see ``Spectrum``.
    own_residuals : (patches,) each patch's forces left, relative to its own.
    rounding : what rounding of the coordinates alone leaves of the residual, about.
    evidence : what happened on the way, if a solver was there to see it.
    tried : what a search has tried; empty if there was none.
    mode : (n,3) displacements of the lowest mode; empty where none is known.
    rigid : number of rigid motions that nothing resists, where rooms prescribe volumes.
    """

    surface: Surface
    pinchable: Bools
    residual: float
    tolerance: float
    quality: float
    spectrum: Spectrum
    own_residuals: Floats
    rounding: float = 0.0
    evidence: Evidence | None = None
    tried: tuple[Attempt, ...] = ()
    mode: Floats = field(default_factory=lambda: np.empty((0, 3)))
    rigid: int = 0

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
        settled = self.evidence in (Evidence.INFLATED, Evidence.COLLAPSED)
        load = self.overload
        if load and not settled and load.ratio <= 1.0 + coarseness(self.surface):
            load = None
        return _theorems(self.surface, self.pinchable, load)

    @property
    def lost(self) -> bool:
        """Whether a solver saw the surface run away, or a branch of equilibria fold."""
        away = self.evidence in (Evidence.INFLATED, Evidence.VANISHED) or self.neck is not None
        return self.moving and (away or any(attempt.folds for attempt in self.tried))

    @cached_property
    def hardly_balanced(self) -> str:
        """Names a junction whose tensions can hardly balance, while forces are left; else empty."""
        return hardly_balanced(self.surface, self.pinchable) if self.moving else ""

    @cached_property
    def neck(self) -> Neck | None:
        """The neck that pinches off, if triangles have collapsed there."""
        return pinched_neck(self.surface) if self.moving and self.collapsed else None

    @property
    def collapsed(self) -> bool:
        """Whether triangles have collapsed."""
        return self.evidence is Evidence.COLLAPSED or self.quality <= COLLAPSED


def _theorems(surface: Surface, pinchable: Bools, load: Overload | None) -> tuple[Proof, ...]:
    """What rules out a smooth surface at rest, with an overload if one is given."""
    found = unbalanced(surface, pinchable), load, unheld(surface), weak_cable(surface)
    return tuple(proof for proof in found if proof is not None)


def only_coarse(surface: Surface, pinchable: Bools) -> str:
    """Why no smooth surface is at rest where this mesh is; empty if nothing is known against one."""
    why = "; ".join(map(str, _theorems(surface, pinchable, overload(surface))))
    return why and f"only a mesh as coarse as this is at rest here, no smooth surface is: {why}"


@dataclass(frozen=True)
class Rule:
    """A verdict, when it applies, and the sentence that gives the reason (empty for none)."""

    verdict: Verdict
    applies: Callable[[Findings], bool]
    reason: Callable[[Findings], str]


def judge(findings: Findings) -> tuple[Verdict, str]:
    """The verdict on the findings and its reason, by the first of ``RULES`` that applies."""
    rule = next(rule for rule in RULES if rule.applies(findings))
    return rule.verdict, rule.reason(findings)


def _disproved(f: Findings) -> str:
    folds = (attempt for attempt in f.tried if attempt.folds)
    return "; ".join(map(str, (*f.proofs, *folds, *([f.neck] if f.neck else []))))


def _none_found(f: Findings) -> str:
    vertex = growing_part(f.surface)
    alone = "" if vertex is None else describe_growing(vertex)
    return "; ".join(filter(None, (alone, *map(str, f.tried), str(f.neck or ""), _compressed(f))))


def _ran_away(f: Findings) -> str:
    if f.neck is not None:
        return f"{f.neck}; bring the held curves nearer to each other, or raise the pressure"
    if f.evidence is Evidence.INFLATED:
        return (
            "it grew without bound; start lower, raise the tensions or lower the pressures, or follow the"
            " pressure from a lower one (pcmc.follow)"
        )
    return "it shrank to nothing; hold it with fixed= or on_plane=, raise the pressure, or start larger"


def _collapse(f: Findings) -> str:
    reasons = f.hardly_balanced, too_long(f.surface), where_collapsed(f.surface, f.pinchable)
    return "; ".join(filter(None, (*reasons, *map(str, f.tried[1:]))))


def _forces_left(f: Findings) -> str:
    reason = f"relative residual {f.residual:.1e}, tolerance {f.tolerance:.0e}"
    if f.hardly_balanced:
        reason += f"; {f.hardly_balanced}"
    reason = "; ".join(filter(None, (reason, too_long(f.surface), _compressed(f))))
    if f.overload:
        reason += f"; {f.overload}: only a mesh as coarse as this may come to rest, a finer one cannot"
    return "; ".join((reason, *map(str, f.tried[1:])))


def _weak_patch(f: Findings) -> str:
    name = f.surface.patches[int(f.own_residuals.argmax())].name
    return (
        f"the forces left in patch {name!r}, or in an island of it, are {f.own_residuals.max():.1e} of its"
        " own, which are small beside those of the rest; solve with a smaller tolerance"
    )


def _hidden_forces(f: Findings) -> str:
    return (
        f"relative residual {f.residual:.1e}, tolerance {f.tolerance:.0e}, but rounding of the coordinates"
        f" alone leaves about {f.rounding:.0e}: parts that are small beside their coordinates lose their"
        " digits; move the origin near them, or solve them by themselves"
    )


def _hidden_stability(f: Findings) -> str:
    hidden = f.spectrum.hidden or (
        "the second variation is singular to rounding, so its negative eigenvalues cannot be counted"
    )
    reason = f"the forces balance (relative residual {f.residual:.1e}), but {hidden}"
    tensions = f.surface.tensions[f.surface.tensions > 0.0]
    if len(tensions) and tensions.max() > FACTOR * tensions.min():
        reason += f"; the tensions differ by a factor of {tensions.max() / tensions.min():.0e}"
    return reason


def _compressed(f: Findings) -> str:
    """Names a patch whose weight leaves no tension somewhere; or empty, as where it grew without bound."""
    surface = f.surface
    faces = np.flatnonzero(compressed(surface))
    if not len(faces) or f.evidence is Evidence.INFLATED:
        return ""
    pull = effective_tensions(surface, surface.vertices, surface.faces, surface.patch_of_face)[faces]
    worst = faces[pull.argmin()]
    name = surface.patches[surface.patch_of_face[worst]].name
    place = surface.vertices[surface.faces[worst]].mean(axis=0).round(4).tolist()
    return (
        f"patch {name!r} is under compression in {len(faces)} triangles: its weight leaves α + w z ="
        f" {pull.min():.3g} at {place}, and a sheet buckles there; raise its tension, or put Π lower"
    )


def _ways_down(f: Findings) -> str:
    saddle = describe_saddle(f.surface, f.spectrum.index or f.spectrum.below or 0, f.mode)
    return "; ".join(filter(None, (saddle, _near_fold(f))))


def _near_fold(f: Findings) -> str:
    """Names what nearly lets go, so that the certificate of a fold says where it is; else empty."""
    count, band = (f.spectrum.soft, NEUTRAL) if f.spectrum.soft else (f.spectrum.near, NEAR)
    if not count:
        return ""
    index = f.spectrum.index
    signs = "of signs that rounding hides" if index is None else f"index {index}"
    modes = "1 softest mode" if count == 1 else f"{count} softest modes"
    return f"at a fold or a branching, or near one: {modes} within ±{band:g} α/size², {signs}"


RULES = (
    Rule(
        Verdict.NEUTRAL,
        lambda f: not f.surface.tensions.any(),
        lambda f: "no patch has a tension: every shape is at rest",
    ),
    Rule(
        Verdict.NO_EQUILIBRIUM,
        lambda f: bool(f.proofs),
        _disproved,
    ),
    Rule(Verdict.NONE_FOUND, lambda f: f.lost and bool(f.tried), _none_found),
    Rule(Verdict.RAN_AWAY, lambda f: f.lost, _ran_away),
    Rule(
        Verdict.WALL_DOWN,
        lambda f: f.moving and f.collapsed and held_wall_down(f.surface, f.pinchable),
        _collapse,
    ),
    Rule(Verdict.DEGENERATE, lambda f: f.collapsed, _collapse),
    Rule(Verdict.UNDECIDED, lambda f: f.moving and f.residual <= NOISE * f.rounding, _hidden_forces),
    Rule(Verdict.NOT_CONVERGED, lambda f: f.moving, _forces_left),
    Rule(Verdict.NOT_CONVERGED, lambda f: bool(f.own_residuals.max() > SMALL * f.tolerance), _weak_patch),
    Rule(Verdict.SADDLE, lambda f: bool(compressed(f.surface).any()), _compressed),
    Rule(Verdict.UNDECIDED, lambda f: f.spectrum.unknown, _hidden_stability),
    Rule(Verdict.SADDLE, lambda f: bool(f.spectrum.below), _ways_down),
    Rule(
        Verdict.NEUTRAL,
        lambda f: f.rigid > 0,
        lambda f: f"nothing resists {f.rigid} rigid motions; every change of shape at these volumes raises E",
    ),
    Rule(
        Verdict.NEUTRAL,
        lambda f: bool(f.spectrum.soft),
        _near_fold,
    ),
    Rule(Verdict.STABLE, lambda f: True, _near_fold),
)
