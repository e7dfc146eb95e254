"""A theorem for a surface at rest: an exact equilibrium is near, alone, and of this Morse index.

Freeze the vertices X₀ and the frames B₀ of the motion space, as the floats they are, and look at the smooth
function E(X₀ + B₀ s). Its exact gradient f(s) = B₀ᵀ∇E and Hessian A(s) at s = 0 are enclosed with outward
rounding (``enclosures``; where rooms prescribe volumes, with their pressures among the unknowns: ``system``).

- **Gap and index.** A float matrix Â is within a of A(0). Let Â ∓ σ = L D Lᵀ + R with ‖R‖ ≤ ρ
  (``stability.backward_error``) and g = σ - ρ - a > 0. By Sylvester and Weyl, A(0) has at least as many
  eigenvalues below -g as D has negative entries for Â + σ, and at most as many below g as D has for Â - σ. If
  both are k, that is the index, no eigenvalue is within g of zero, and ‖A(0)⁻¹‖ ≤ β = 1/g.
- **Existence.** Let η ≥ ‖A(0)⁻¹ f(0)‖, L with ‖A(s) - A(s')‖ ≤ L |s - s'| on the ball |s| ≤ r₀
  (``lipschitz``), and h = β L η ≤ ½. Newton and Kantorovich give a zero of f within 2η/(1 + √(1 - 2h)) of 0,
  if that is at most r₀, and no other one within min(r₀, (1 + √(1 - 2h))/(β L)). With any y, and so with the
  step y ≈ A⁻¹f of Newton's method, η = |y| + β ‖f(0) - A(0) y‖ will do, the latter norm bounded.
- **Index there.** A(s*) differs by L |s*| at most, so no eigenvalue is within g - L |s*| of zero, and the
  index is the same if that is positive.
- **Walls that rest.** All this is about the standing part. A vertex that rests on Π or on a held bottom does
  so at the exact equilibrium, too, if the pull on it is less than its wall can take. Both are enclosed there:
  the pull changes by the norm of its row of ∇²E times |s*| at most.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Floats
from ..base.tolerances import AT_REST, PARALLEL
from ..base.units import NO_UNITS, Units
from ..forces.motion_space import MotionSpace
from ..forces.pinching import StandingPart, pull_and_capacity, spans
from ..stability.backward_error import backward_error
from ..stability.equilibrium import Equilibrium
from ..stability.factorisation import SingularMatrix, factoriser
from ..surface import Surface, expect_surface
from ..surface.lagrange import expect_flat
from .balls import SAFE, U
from .lipschitz import lipschitz
from .system import System, system

STEPS = 5  # of inverse iteration for the least eigenvalue: then mostly within a few percent
SHARE = 0.8  # of that estimate: the first σ; each failure halves it
TRIES = 5
REACH = 1e-3  # of the least height of a triangle: r₀, where the zero does not need more
MOST = 0.05  # of it: farther away nothing is tried, as triangles may turn over


@dataclass(frozen=True)
class Theorem:
    """What ``verify`` has proved of a surface, or why it has not. ``print`` and ``text`` have it in words.

    Attributes
    ----------
    proved, reason : whether all below is proved; if not, why.
    radius : the root of the sum of squares of the vertices' distances to the exact equilibrium, at most.
    unique_within : there is no other one within this distance, in the same norm and frames.
    index, gap : its Morse index; no eigenvalue of B₀ᵀ∇²E B₀ there is within the gap of zero, force/length.
    beta, lipschitz, step, forces : β, length/force; L, force/length²; η, length; a bound of ‖f(0)‖, force.
    symmetric_in, volumes_kept : index and gap are about motions symmetric in these mirror planes that keep
        the volumes of these rooms.
    rigid : the number of rigid motions that no support resists: all is about motions across these.
    spare : how much of their walls' capacity resting vertices have left, at least; None without any.
    """

    proved: bool
    reason: str = ""
    radius: float = np.inf
    unique_within: float = 0.0
    index: int | None = None
    gap: float = 0.0
    beta: float = np.inf
    lipschitz: float = np.inf
    step: float = np.inf
    forces: float = np.inf
    symmetric_in: tuple[str, ...] = ()
    volumes_kept: tuple[str, ...] = ()
    spare: float | None = None
    rigid: int = 0

    def brief(self, units: Units = NO_UNITS) -> str:
        """The theorem in a line: "proved: index 0, within 1.3e-09 m"."""
        if not self.proved:
            return f"not proved: {self.reason}"
        return f"proved: index {self.index}, within {self.radius:.1e}{units.behind('length')}"

    def text(self, units: Units = NO_UNITS) -> str:
        """The theorem in words, or why there is none."""
        if not self.proved:
            return self.brief()
        length, tension = units.behind("length"), units.behind("tension")
        planes = f"are symmetric in {', '.join(self.symmetric_in)}" if self.symmetric_in else ""
        volumes = f"keep the volume of {', '.join(self.volumes_kept)}" if self.volumes_kept else ""
        across = f"are across its {self.rigid} free rigid motions" if self.rigid else ""
        motions = " and ".join(filter(None, (across, planes, volumes)))
        among, these = (f", among motions that {motions}", " among these") if motions else ("", "")
        still = f", but for its {self.rigid} free rigid motions," if self.rigid else ""
        rests = "" if self.spare is None else f"; walls rest where these do, with {self.spare:.1%} to spare"
        return (
            f"proved: an exact equilibrium of this mesh is within {self.radius:.1e}{length} of its vertices,"
            f" and no other{still} within {self.unique_within:.1e}{length}; its Morse index is exactly"
            f" {self.index}{among}, and no eigenvalue of its second variation{these} is within"
            f" {self.gap:.2g}{tension} of zero{rests}"
        )

    __repr__ = text


class _Unproved(Exception):
    """Why there is no theorem."""


def verify(surface: Surface) -> Theorem:
    """Prove that an exact equilibrium of the discrete energy is near a surface at rest, and its Morse index.

    The proof is one about real numbers, made in floating point with every rounding bounded. It is about the
    mesh, its energy, and motions in the frozen frames B₀; not about the limit of finer meshes.

    >>> from pcmc import Patch
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> theorem = verify(roof)
    >>> theorem.proved, theorem.index, theorem.radius < 1e-14, round(theorem.gap, 2)
    (True, 0, True, 2.68)
    >>> verify(roof.moved(roof.vertices * [1, 1, 1 + 1e-6])).proved
    False
    """
    expect_surface(surface)
    expect_flat(surface, "verify")
    try:
        return _proved(surface)
    except (_Unproved, SingularMatrix) as why:
        return Theorem(False, str(why))


def _proved(surface: Surface) -> Theorem:
    at = Equilibrium.of(surface)
    part, space, free = at.part, at.space, at.rigid
    _refuse(part, space, at.rigid_motions if free.shape[1] else at.rigid_motions[:0])
    if not at.residual <= AT_REST:
        raise _Unproved(f"it is not at rest: the residual is {at.residual:.1e}; solve it first")
    found = system(part, space, free)
    index, gap, newton = _inertia(found)
    beta = SAFE / gap
    _, stiffness, height = lipschitz(found.items, space, 0.0, 0.0)
    step = (float(np.sqrt((newton * newton).sum())) + beta * found.left_after(newton)) * SAFE
    first = 2.0 * step
    if not first <= MOST * height:
        raise _Unproved(
            f"the forces left, {found.residual:.1e}, may move it by {first:.1e}: too far beside its thinnest"
            f" triangle, of height {height:.1e}; solve to a smaller tolerance, or improve the mesh"
        )
    reach = max(REACH * height, first)
    rate = found.lipschitz(reach)
    h = beta * rate * step * SAFE
    if not h <= 0.5:
        text = f"β L η = {h:.2g} is above ½ (β {beta:.2g}, L {rate:.2g}, η {step:.1e}): it is too near to"
        text += " neutral for its thinnest triangles; solve to a smaller tolerance, or improve these"
        raise _Unproved(text)
    root = np.sqrt(1.0 - 2.0 * h) / SAFE
    # a bound of ‖B₀‖₂, which rounding keeps from 1: the root of the largest row sum of |B₀ᵀB₀|
    sums = np.abs(space.basis @ space.basis.transpose(0, 2, 1)).sum(axis=2)
    radius = first / (1.0 + root) * float(np.sqrt(sums.max()) * SAFE) * SAFE
    unique = min(reach, (1.0 + root) / (beta * rate)) / SAFE
    spare = _rests(surface, part, found, stiffness, radius)
    left = (gap - rate * radius) / SAFE
    if not left > 0.0:
        raise _Unproved("no gap is left between the eigenvalues and zero at the exact equilibrium")
    return Theorem(
        proved=True,
        radius=float(radius),
        unique_within=float(unique),
        index=index,
        gap=float(left),
        beta=float(beta),
        lipschitz=rate,
        step=step,
        forces=found.residual,
        symmetric_in=tuple(str(plane) for plane, _ in surface.on_planes if plane.mirror),
        volumes_kept=tuple(room.name for room in surface.rooms),
        spare=spare,
        rigid=free.shape[1],
    )


def _refuse(part: StandingPart, space: MotionSpace, rigid: Floats) -> None:
    """Refuse what the theorem does not cover, such as free rigid motions (k,2,3) that change E."""
    surface = part.surface
    if not space.size:
        raise _Unproved("no vertex can move")
    if any(space.dimension[along].any() for _, along in surface.on_circle):
        raise _Unproved("vertices slide along a circle, and the frozen frames are straight")
    if surface.cable_edges.weight.any():
        raise _Unproved("a cable has a weight, for which no bounds are known")
    n = np.array(surface.plane.normal)
    rises = np.abs(rigid[:, 0] @ n).max(initial=0.0), np.abs(np.cross(rigid[:, 1], n)).max(initial=0.0)
    if len(rigid) and (surface.uncancelled.any() or (surface.weights.any() and max(rises) >= PARALLEL)):
        raise _Unproved("its weight or pressure pushes along rigid motions that no support resists")


def _inertia(found: System) -> tuple[int, float, Floats]:
    """The Morse index; g: no eigenvalue of K is within g of zero; Newton's step (N,), about -K⁻¹F."""
    pattern, data = found.pattern, found.matrix
    solver = factoriser(pattern, "superlu")
    rough = solver.factor(data)
    step = rough.solve(found.left)
    x = np.cos(1.618 * np.arange(pattern.size))
    for _ in range(STEPS):
        x = rough.solve(x / np.sqrt((x * x).sum()))  # a sum: threads of BLAS wait for each other
    sigma, reason = SHARE / float(np.sqrt((x * x).sum())), ""
    diagonal = pattern.indptr[:-1]
    for _ in range(TRIES):
        counts: list[int] = []
        errors = [0.0]
        for shift in (-sigma, sigma):
            if shift < 0.0 or counts[0] > 0:
                moved = data.copy()
                moved[diagonal] += shift
                lu = solver.factor(moved).lu
                if not np.array_equal(lu.perm_r, lu.perm_c):
                    raise _Unproved("a zero pivot hides the signs of the eigenvalues")
                errors.append(backward_error(lu.L, lu.U) + U * float(np.abs(moved[diagonal]).max()))
                counts.append(int(np.count_nonzero(lu.U.diagonal() < 0.0)))
        gap = (sigma - (max(errors) + found.matrix_error) * SAFE) / SAFE
        if len(set(counts)) == 1 and gap > 0.0:
            return counts[0] - found.borders, gap, step
        reason = f"{min(counts)} to {max(counts)} eigenvalues below ∓{sigma:.1e}"
        if gap <= 0.0:
            reason = f"rounding, {sigma - gap:.1e}, hides eigenvalues as near to zero as {sigma:.1e}"
            break
        sigma *= 0.5
    raise _Unproved(f"its Morse index is not certain: {reason}")


def _rests(
    surface: Surface, part: StandingPart, found: System, stiffness: Floats, radius: float
) -> float | None:
    """How much of their walls' capacity the resting vertices have to spare, at least; None without any."""
    if not part.resting.any():
        return None
    n, walls, resting = surface.n, part.walls, part.resting
    meet = resting & walls.held & walls.meeting
    if meet.any():  # there the largest pull over capacity is found by iteration, without a bound
        where = f"walls meet at resting vertex {meet.argmax()}"
        raise _Unproved(f"{where}, and what they hold there has no bound")
    if len(over := spans(part)):  # their forces are left out, without a bound
        face = part.surface.faces[over[0]]
        where = f"a wall stands on vertex {face[~(resting | walls.corner)[face]][0]}"
        raise _Unproved(f"{where} between two that rest, whose pull has no bound")
    pull, capacity = pull_and_capacity(part, -found.forces[:n])
    size = np.linalg.norm(found.forces[:n], axis=1)
    off = np.linalg.norm(found.forces_radius[:n], axis=1) + 2.0 * stiffness[:n] * radius + 1e-14 * size
    lost = np.zeros(n)
    far = float(np.linalg.norm(surface.vertices - surface.origin, axis=1).max())
    pressures = np.abs(surface.net_pressures[walls.wall_below])  # under a top edge they push by ⅙ p x × y
    moved = (surface.tensions[walls.wall_below] + pressures * far) * radius + 1e-14 * pressures * far**2
    for end in walls.top_edges.T:  # both ends of a top edge may move by the radius
        np.add.at(lost, end, moved)
    spare = (capacity * (1.0 - 1e-12) - lost - np.abs(pull) - off * SAFE)[resting]
    worst = int(spare.argmin())
    if not spare[worst] > 0.0:
        why = f"resting vertex {np.flatnonzero(resting)[worst]} is on the verge of lifting off"
        raise _Unproved(f"{why}, so which rest is not certain")
    return float((spare / capacity[resting]).min())
