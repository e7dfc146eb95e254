"""The geometric solver: Bᵀ∇E = 0 in the motion space, to rounding, on any refinement.

Each iteration tries a Newton step s = -(Bᵀ ∂²E B)⁻¹ Bᵀ∇E. Where the matrix has negative eigenvalues (and a
minimum is sought), or the step overshoots or spoils triangles, smooth descent steps L_α d = -B Bᵀ∇E come
first. A factorisation is kept while it still contracts the residual. In between, vertices are spread along
the shape as long as triangles are poor, and junctions that come down to Π are set to rest there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.sparse.linalg import LinearOperator, gmres

from ..arrays import Bools, Floats, Ints
from ..assemble import Pattern, assemble, pattern
from ..contact import (
    Walls,
    creases,
    crest_spacing,
    hung,
    lifted,
    pinched,
    pull_and_capacity,
    resting,
    settled,
    walls,
)
from ..descent import Carrier, Smoother
from ..energy import energy_and_gradient, energy_at
from ..factor import Factor, Factoriser, SingularMatrix, factoriser
from ..modes import lowest, negatives_without, stiffness
from ..motion import MotionSpace, Structure, force_scale, motion_space, structure
from ..quality import redistribution, triangle_quality
from ..refine import prolongation, refine
from ..rigid import rigid_modes, rigid_motions
from ..surface import Surface
from . import options as check
from .result import Callback, Progress, Result, Status

TARGETS = ("minimum", "stationary")
LOW = 2e-3  # height, in spacings along the crest, at which a sinking junction is set to rest
SLACK = 1e-13  # relative rounding of E, below which a rise of E means nothing


@dataclass(frozen=True)
class NewtonOptions:
    """What the geometric solver may be told.

    Parameters
    ----------
    tolerance : converged when ‖Bᵀ∇E‖ ≤ tolerance × the norm of the single triangles' forces.
    iterations : the most steps of any kind.
    target : ``"minimum"`` leaves saddles; ``"stationary"`` converges to them.
    levels : solve here, refine 1→4 this many times, and finish on each.
    care : triangles are spread while the worst has less than this quality, or half the initial one.
    inflation : diverged when the bounding box is more than this many times its first diagonal.
    backend : factorisation, ``"pardiso"`` or ``"superlu"``; None for the fastest here.
    """

    tolerance: float = 1e-11
    iterations: int = 200
    target: str = "minimum"
    levels: int = 0
    care: float = 0.45
    inflation: float = 10.0
    backend: str | None = None

    def __post_init__(self) -> None:
        check.number("tolerance", self.tolerance, above=0.0)
        check.whole("iterations", self.iterations)
        check.choice("target", self.target, TARGETS)
        check.whole("levels", self.levels)


class _Level:
    """One mesh: the surface as it stands and all that is kept between its steps."""

    def __init__(self, surface: Surface, options: NewtonOptions, log: _Log) -> None:
        self.full = surface
        self.options = options
        self.log = log
        self.walls: Walls = walls(surface)
        self.spacing = crest_spacing(surface, self.walls)
        self.first_quality = 0.0
        self.pinch(resting(surface, self.walls))
        self.first_quality = self.quality(self.X)
        self.bound = options.inflation * surface.size
        self.shifted = 0
        self.trouble = 0  # Newton steps refused in a row
        self.care_left = 60
        self.releases_left = 30

    def pinch(self, rests: Bools) -> None:
        """Set these junction vertices to rest on Π and forget what depended on the faces."""
        self.rests = rests
        self.surface = pinched(self.full, self.walls, rests)
        self.X: Floats = self.surface.vertices.copy()
        self.frame: Structure = structure(self.surface, creases(self.walls, rests))
        self.judged: Ints = self.surface.faces[~self.walls.pinchable[self.surface.patch_of_face]]
        self.rigid = rigid_motions(self.surface)
        self.shape: Ints | None = None
        self.pattern: Pattern | None = None
        self.factoriser: Factoriser | None = None
        self.factor: Factor | None = None
        self.smoother: Smoother | None = None
        self.carrier: Carrier | None = None
        self.smooth_age = 99
        self.measure()

    def measure(self) -> None:
        """Energy, gradient, frames and residual where the surface stands."""
        self.energy, self.gradient = energy_and_gradient(self.surface, self.X)
        self.log.evaluations += 1
        self.space: MotionSpace = motion_space(self.surface, self.frame, self.X)
        if self.shape is None or not np.array_equal(self.shape, self.space.dimension):
            self.shape, self.pattern, self.factoriser = self.space.dimension, None, None
            self.factor = None
        self.scale = force_scale(self.surface, self.frame, self.X)
        self.residual = self.space.pull(self.gradient)
        self.norm = float(np.linalg.norm(self.residual))

    @property
    def relative(self) -> float:
        return self.norm / self.scale

    def quality(self, X: Floats) -> float:
        return float(triangle_quality(X, self.surface.faces).min())

    def result_surface(self) -> Surface:
        if not self.rests.any():
            return self.full.moved(self.X)
        return self.full.moved(settled(self.full, self.walls, self.rests, self.X))

    # -- steps ---------------------------------------------------------------------------------

    def factorise(self, shift: float) -> bool:
        """Factorise BᵀHB + shift BᵀLB here, unless a factor is kept; False where it is singular."""
        if self.factor is not None:
            return True
        if self.factoriser is None:
            self.pattern = pattern(self.frame, self.space)
            self.factoriser = factoriser(self.pattern, self.options.backend)
        assert self.pattern is not None
        data = assemble(self.surface, self.frame, self.space, self.pattern, self.X, 1.0, shift)
        try:
            self.factor = self.factoriser.factor(data)
        except SingularMatrix:
            return False
        self.log.factorisations += 1
        self.shift = shift
        self.factor_space = self.space
        rigid = rigid_modes(self.space, self.rigid, self.X)
        self.negative = negatives_without(self.factor, rigid)
        return True

    def precondition(self, residual: Floats) -> Floats:
        """The kept factor's answer to a residual in the present basis."""
        assert self.factor is not None
        if self.factor_space is not self.space:
            residual = self.factor_space.pull(self.space.push(residual))
        s = self.factor.solve(residual)
        if self.factor_space is not self.space:
            s = self.space.pull(self.factor_space.push(s))
        return s

    def derivative(self, s: Floats) -> Floats:
        """Change of the residual along s, by a difference: the frames turn with the surface."""
        d = self.space.push(s)
        length = float(np.abs(d).max())
        if length == 0.0:
            return np.zeros_like(s)
        t = 1e-7 * self.full.size / length
        ahead = residual_vectors(self.surface, self.frame, self.X + t * d)
        behind = residual_vectors(self.surface, self.frame, self.X - t * d)
        self.log.evaluations += 2
        return self.space.pull(ahead - behind) / (2.0 * t)

    def newton_direction(self) -> Floats:
        """-B J⁻¹ r with J the derivative of r itself, by GMRES on the kept factor."""
        size = len(self.residual)
        steps: list[float] = []
        s, _ = gmres(
            LinearOperator((size, size), self.derivative, dtype=float), -self.residual,
            M=LinearOperator((size, size), self.precondition, dtype=float),
            rtol=1e-3, restart=12, maxiter=1, callback=steps.append, callback_type="pr_norm",
        )  # fmt: skip
        self.inner = len(steps)
        return self.space.push(s)

    def moved_by(self, d: Floats) -> tuple[Floats, Bools]:
        """X + d and the crests it brings down to Π, which it leaves there.

        The rows of a wall follow its crest in proportion to its height.
        """
        X = self.X + d
        standing = self.walls.can_rest & ~self.rests
        if not standing.any():
            return X, standing
        height = self.surface.plane.height(X)
        above = self.walls.side * height
        sinks = above < self.walls.side * self.surface.plane.height(self.X)
        down = standing & ((above <= 0.0) | (sinks & (above <= LOW * self.spacing)))
        X[down] -= height[down, None] * np.array(self.surface.plane.normal)
        X = hung(self.surface, self.walls, X, self.space)
        return X, down

    def to_rest(self, more: Bools) -> None:
        self.full = self.result_surface()
        self.pinch(self.rests | more)

    def try_newton(self) -> bool:
        """A Newton step, shortened if need be; False (and nothing moved) where none helps."""
        fresh = self.factor is None
        if not self.positive():
            return False
        d = self.newton_direction() if self.shift == 0.0 else self.shifted_direction()
        start, energy, norm = self.X, self.energy, self.norm
        slope = float((self.gradient * d).sum())
        for t in (1.0, 0.5, 0.25, 0.125) if fresh else (1.0,):
            X, down = self.moved_by(t * d)
            if self.spoils(X):
                X, down = self.moved_by(t * self.carried(d))
            if self.spoils(X):
                continue
            if down.any():
                self.X = X
                self.to_rest(down)
                self.step_kind = "contact"
                return True
            self.X = X
            self.measure()
            if self.helps(t, slope, energy, norm):
                if self.norm > 0.1 * norm or self.inner > 8:
                    self.factor = None
                self.step_kind = "newton" if self.shift == 0.0 else "shifted"
                return True
            if self.relative <= 1e3 * np.finfo(float).eps:
                break
            self.X = start
            self.measure()
        self.factor = None
        return not fresh

    def carried(self, d: Floats) -> Floats:
        """The motion d with the insides of the sheets carried along."""
        if self.carrier is None:
            self.carrier = Carrier(self.surface, self.frame, self.X, self.options.backend)
            self.log.factorisations += 1
        return self.carrier.carry(self.space, d)

    def positive(self) -> bool:
        """Factorise; where a minimum is sought, shift until no negative eigenvalue is left."""
        shifts = (0.0, 0.25, 1.0, 4.0) if self.options.target == "minimum" else (0.0,)
        for shift in shifts:
            if not self.factorise(shift):
                continue
            if self.negative == 0 or self.options.target == "stationary":
                return True
            self.factor = None
        return False

    def wants_to_leave(self) -> bool:
        """Whether Newton steps have had to be shifted for a while: a saddle is near."""
        if self.step_kind != "shifted":
            self.shifted = 0
            return False
        self.shifted += 1
        return self.shifted % 4 == 0

    def leave_saddle(self) -> bool:
        """Move along the lowest mode as far as E keeps falling; False where no mode lowers it."""
        system = stiffness(
            self.surface.moved(self.X), self.frame, self.space,
            rigid_modes(self.space, self.rigid, self.X), self.options.backend,
        )  # fmt: skip
        self.log.factorisations += 1
        if system.negative == 0:
            return False
        mode = lowest(system, 1)[1][0]
        unit = mode / np.abs(mode).max()
        unit *= np.sign(unit.sum()) or 1.0
        best, best_energy, step = self.X, self.energy, 1e-3 * self.full.size
        for sign in (1.0, -1.0):
            t = sign * step
            while abs(t) < 0.1 * self.full.size:
                X, _ = self.moved_by(t * unit)
                value = energy_at(self.surface, X)
                self.log.evaluations += 1
                if not value < best_energy or self.spoils(X):
                    break
                best, best_energy = X, value
                t *= 2.0
            if best is not self.X:
                break
        if best is self.X:
            return False
        self.X = best
        self.factor = None
        self.measure()
        self.step_kind = "saddle"
        return True

    def shifted_direction(self) -> Floats:
        self.inner = 0
        return -self.space.push(self.precondition(self.residual))

    def helps(self, t: float, slope: float, energy: float, norm: float) -> bool:
        """Whether the step just measured lowers the residual enough or, towards a minimum, E."""
        if self.norm < (1.0 - 0.3 * t) * norm:
            return True
        falls = self.energy <= energy + 1e-2 * t * slope and slope < 0.0
        return falls and self.options.target == "minimum"

    def collapsed(self, bound: float) -> bool:
        """Whether the worst triangle outside pinching walls is below a bound of quality."""
        return bool(triangle_quality(self.X, self.judged).min() < bound)

    def spoils(self, X: Floats) -> bool:
        """Whether the move to X turns a triangle over or makes the worst one much worse.

        The triangles of walls that may pinch are not judged: there a vanishing height is the answer.
        """
        F = self.judged
        before, after = _normals(self.X, F), _normals(X, F)
        if (np.einsum("ij,ij->i", before, after) <= 0.0).any():
            return True
        worst = triangle_quality(X, F).min()
        return bool(worst < 0.7 * min(triangle_quality(self.X, F).min(), self.options.care))

    def descend(self) -> bool:
        """One smooth step down with backtracking; False where E does not fall."""
        if self.smoother is None:
            self.smoother = Smoother(self.surface, self.frame, self.options.backend)
            self.smooth_age = 99
        if self.smooth_age >= 6:
            self.smoother.refresh(self.X)
            self.log.factorisations += self.smoother.factorisations
            self.smooth_age = 0
        self.smooth_age += 1
        forces = self.space.push(self.residual)
        d = -self.smoother.solve(forces)
        slope = float((forces * d).sum())
        t = 1.0
        for _ in range(12):
            X, more = self.moved_by(t * d)
            value = energy_at(self.surface, X)
            self.log.evaluations += 1
            if np.isfinite(value) and value < self.energy + 1e-3 * t * slope:
                break
            t *= 0.5
        else:
            return False
        self.X = X
        if more.any():
            self.to_rest(more)
        else:
            self.measure()
        self.factor = None
        self.step_kind = "descent"
        self.t = t
        return True

    def care(self) -> None:
        """Spread the vertices along the shape while triangles are poor."""
        worst = self.worst(self.X)
        if self.care_left <= 0 or self.relative < 1e-7 or worst >= self.options.care:
            return
        self.care_left -= 1
        best, X = self.X, self.X
        for _ in range(20):
            move = redistribution(self.surface, X, self.frame.curve_edges, self.frame.kind)
            move[self.rests] = 0.0
            space = motion_space(self.surface, self.frame, X)
            X = hung(self.surface, self.walls, X + move - space.project(move), space)
            quality = self.worst(X)
            if quality > worst:
                best, worst = X, quality
            if quality >= self.options.care:
                break
        if worst > 1.02 * self.worst(self.X):
            self.X = best
            self.factor = None
            self.measure()
        else:
            self.care_left = 0

    def worst(self, X: Floats) -> float:
        """Quality of the worst triangle outside walls that may pinch."""
        return float(triangle_quality(X, self.judged).min())

    def release(self) -> bool:
        """Lift the resting vertices that the sheets pull harder than the wall can hold."""
        if not self.rests.any() or self.releases_left <= 0:
            return False
        surface = self.surface.moved(self.X)
        pull, capacity = pull_and_capacity(surface, self.walls, self.rests)
        free = self.rests & (pull > capacity * (1 + 1e-9))
        if not free.any():
            return False
        self.releases_left -= 1
        self.full = lifted(self.result_surface(), self.walls, free)
        self.pinch(self.rests & ~free)
        return True


@dataclass
class _Log:
    """Counters and the history."""

    callback: Callback | None
    rows: list[dict[str, Any]]
    evaluations: int = 0
    factorisations: int = 0

    def row(self, level: _Level, number: int, kind: str) -> None:
        row = {
            "iteration": len(self.rows),
            "level": number,
            "step": kind,
            "evaluation": self.evaluations,
            "factorisation": self.factorisations,
            "energy": level.energy,
            "gradient_squared": float((level.gradient**2).sum()),
            "residual": level.relative,
            "quality": level.quality(level.X),
            "resting": int(level.rests.sum()),
        }
        self.rows.append(row)
        if self.callback is not None:
            self.callback(Progress(row["iteration"], level.result_surface, row))


def newton(surface: Surface, options: NewtonOptions, callback: Callback | None) -> Result:
    """Solve with the geometric solver; see ``pcmc.solve``."""
    log = _Log(callback, [])
    start = surface
    for number in range(options.levels + 1):
        level = _Level(surface, options, log)
        status = _run(level, number, log)
        if status is not Status.CONVERGED or number == options.levels:
            break
        finer = refine(start)
        surface = finer.moved(prolongation(start) @ level.result_surface().vertices)
        start = finer
    return Result(
        surface=level.result_surface(),
        status=status,
        method="newton",
        energy=level.energy,
        iterations=len(log.rows) - 1,
        evaluations=log.evaluations,
        history=pd.DataFrame(log.rows),
    )


def _run(level: _Level, number: int, log: _Log) -> Status:
    level.step_kind = "start"
    budget = 0
    try:
        log.row(level, number, "start")
        for _ in range(level.options.iterations):
            if level.relative <= level.options.tolerance:
                if level.options.target == "minimum" and level.leave_saddle():
                    log.row(level, number, level.step_kind)
                    continue
                if level.release():
                    log.row(level, number, "release")
                    continue
                return Status.CONVERGED
            level.care()
            if level.wants_to_leave() and level.leave_saddle():
                budget = 0
            elif budget <= 0 and level.try_newton():
                level.trouble = 0
            else:
                if budget <= 0:
                    level.trouble += 1
                    budget = 5
                budget -= 1
                if not level.descend():
                    return Status.DEGENERATE if level.collapsed(0.02) else Status.STALLED
            if not np.isfinite(level.energy):
                return Status.NON_FINITE
            if level.collapsed(1e-3):
                return Status.DEGENERATE
            if np.linalg.norm(np.ptp(level.X, axis=0)) > level.bound:
                return Status.DIVERGED
            log.row(level, number, level.step_kind)
    except (StopIteration, KeyboardInterrupt):
        return Status.STOPPED
    return Status.ITERATION_LIMIT


def _normals(X: Floats, F: Ints) -> Floats:
    return np.cross(X[F[:, 1]] - X[F[:, 0]], X[F[:, 2]] - X[F[:, 0]])


def residual_vectors(surface: Surface, frame: Structure, X: Floats) -> Floats:
    """B Bᵀ ∇E (n,3) with the frames and the gradient at X."""
    return motion_space(surface, frame, X).project(energy_and_gradient(surface, X)[1])
