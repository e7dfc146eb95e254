"""The steps of the geometric solver: Newton with a reused factor, smooth descent, leaving a saddle."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, gmres

from ..base.arrays import Floats
from ..forces.jacobian import linearise
from ..forces.motion_space import MotionSpace
from ..forces.pattern import Pattern, hessian_pattern
from ..forces.rigid_motions import rigid_modes, rigid_motions
from ..forces.second_variation import assemble
from ..meshing.quality import edge_lengths
from ..stability.bordered import BorderedFactor
from ..stability.factorisation import Factor, Factoriser, SingularMatrix, factoriser
from ..stability.modes import (
    SOFT,
    excluded_columns,
    full_matrix,
    lowest,
    negatives_without,
    stiffness,
    strength_units,
)
from ..surface.checks import reachable
from ..surface.geometry import vertex_area_vectors
from .smoother import HarmonicExtension, Smoother
from .state import State

SHIFTS = (0.0, 0.25, 1.0, 4.0)  # of the stiffness, tried in turn until the matrix is positive
LENGTHS = (1.0, 0.5, 0.25, 0.125)  # of a Newton step, tried in turn
REFRESH = 6  # descent steps between two factorisations of the Laplacian
GROWTH = 0.5  # of a room's volume: the most that a step adds to it or takes away
DRIFT = 0.1  # of an edge: the most that a step moves along a rigid motion that no support resists
ROUNDING = 1e3 * float(np.finfo(float).eps)


class Stepper:
    """Takes steps on a State, and reuses factorisations while they contract.

    Attributes
    ----------
    kind : the last step: ``"newton"``, ``"shifted"``, ``"contact"``, ``"descent"`` or ``"saddle"``.
    factorisations : matrices factorised so far.
    """

    def __init__(self, state: State, minimum: bool, backend: str | None) -> None:
        self.state, self.minimum, self.backend = state, minimum, backend
        self.kind = "start"
        self.factorisations = 0
        self._shifted_steps = 0  # in a row
        self._residual_raised = False  # by the last step, which was allowed to
        self._version = -1
        self._factor_space: MotionSpace = state.space
        self._drop_outdated()

    def _drop_outdated(self) -> None:
        """Drop everything that belongs to other faces or unknowns than the present ones."""
        if self._version == self.state.version:
            return
        self.free()
        self._version = self.state.version
        self._motions = rigid_motions(self.state.surface)

    def free(self) -> None:
        """Drop all factors: they are most of a large surface's memory."""
        self._version = -1
        self._pattern: Pattern | None = None
        self._factoriser: Factoriser | None = None
        self._factor: Factor | None = None
        self._added: csr_array | None = None  # stiffness of a singular matrix
        self._bordered: BorderedFactor | None = None  # by the gradients of the rooms' volumes
        self._smoother: Smoother | None = None
        self._extension: HarmonicExtension | None = None
        self._smoother_age = REFRESH

    def drop_factor(self) -> None:
        """Make the next Newton step factorise anew."""
        self._factor = None

    def newton(self) -> bool:
        """A Newton step, shortened if necessary; False, with nothing moved, if none helps."""
        self._drop_outdated()
        state = self.state
        fresh = self._factor is None
        if not self._factorise_definite():
            return False
        d, pressures = self._direction()
        start, energy, norm = state.X, state.energy, state.norm
        slope = float((state.gradient * d).sum())
        for t in LENGTHS if fresh else LENGTHS[:1]:
            X, down = state.displaced(t * d)
            if state.spoils_triangles(X):
                X, down = state.displaced(t * self._with_sheets(d))
            if state.spoils_triangles(X):
                continue
            if len(pressures):
                energy, slope = self._lagrangian(d, t * pressures)
            state.change_pressures(t * pressures)
            state.move(X, down)
            if down.any():
                self.kind = "contact"
                return True
            if self._improved(t, slope, energy, norm):
                if state.norm > 0.1 * norm or self._gmres_steps > 8:
                    self._factor = None
                self.kind = "newton" if self._shift == 0.0 else "shifted"
                return True
            if state.relative <= ROUNDING:
                break
            state.change_pressures(-t * pressures)
            state.move(start, np.zeros(len(start), dtype=bool))
        self._factor = None
        return not fresh

    def descend(self) -> bool:
        """One smooth descent step with backtracking; False if E does not fall."""
        self._drop_outdated()
        state = self.state
        if self._smoother is None:
            self._smoother = Smoother(state.surface, state.classes, self.backend)
        if self._smoother_age >= REFRESH:
            try:
                self._smoother.refresh(state.X)
            except SingularMatrix:
                return False
            self.factorisations += self._smoother.factorisations
            self._smoother_age = 0
        self._smoother_age += 1
        forces = state.space.to_vectors(state.residual)
        d, pressures = self._smooth_direction(self._smoother, forces)
        slope, energy = float((forces * d).sum()), state.energy
        if len(pressures):
            energy, slope = self._lagrangian(d, pressures, forces)
            state.change_pressures(pressures)
        for t in 0.5 ** np.arange(12):
            X, down = state.displaced(t * d)
            value = state.energy_at(X)
            if reachable(X) and value < energy + 1e-3 * t * slope:
                state.move(X, down)
                self._factor = None
                self.kind = "descent"
                return True
        state.change_pressures(-pressures)
        return False

    def _smooth_direction(self, smoother: Smoother, forces: Floats) -> tuple[Floats, Floats]:
        """-L⁻¹(f - Σ μ g), and the pressures μ (r,) that bring the volumes nearer to those prescribed.

        f (n,3) are the forces and g the gradients of the volumes, both in the motion space.
        """
        state = self.state
        d = -smoother.solve(forces)
        if not len(state.pressures):
            return d, state.pressures
        G = state.volume_gradients
        inflation = np.stack([smoother.solve(state.space.project(g)) for g in G])
        growth = -self._volumes_ahead() - np.einsum("rnd,nd->r", G, d)
        small = np.einsum("rnd,snd->rs", G, inflation)
        pressures = np.linalg.lstsq(small, growth)[0]
        return d + np.tensordot(pressures, inflation, axes=1), pressures

    def _volumes_ahead(self) -> Floats:
        """(r,) the defects of the volumes that one step corrects: all of them, unless they are large."""
        state = self.state
        most = GROWTH * np.maximum(np.abs(state.wanted_volumes), np.abs(state.wanted_volumes + state.defects))
        return np.clip(state.defects, -most, most)

    def _lagrangian(self, d: Floats, pressures: Floats, forces: Floats | None = None) -> tuple[float, float]:
        """The Lagrangian here and its slope along d (n,3), with the rooms' pressures changed."""
        state = self.state
        forces = state.gradient if forces is None else forces
        growth = np.einsum("rnd,nd->r", state.volume_gradients, d)
        slope = float((forces * d).sum() - pressures @ growth)
        return state.energy - float(pressures @ state.defects), slope

    def saddle_near(self) -> bool:
        """Whether several Newton steps in a row had to be shifted; True at every fourth."""
        self._shifted_steps = self._shifted_steps + 1 if self.kind == "shifted" else 0
        return self._shifted_steps > 0 and self._shifted_steps % 4 == 0

    def leave_saddle(self) -> bool:
        """Move along the lowest mode as far as E keeps falling; False if no mode lowers it."""
        state = self.state
        self._drop_outdated()
        rigid = rigid_modes(state.space, self._motions, state.X)
        try:
            system = stiffness(state.surface.moved(state.X), state.classes, state.space, rigid, self.backend)
            self.factorisations += 1
            modes = lowest(system, 1)[1] if system.negative else np.empty(0)
        except SingularMatrix:
            return False
        if not len(modes):
            return False
        normals, area = vertex_area_vectors(state.X, state.classes.faces)
        unit = modes[0] * (np.sqrt(area.sum() / 3.0) / np.linalg.norm(modes[0], axis=1).max())
        if (unit * normals).sum() < 0.0:
            unit = -unit  # outwards first, whichever way the surface is turned
        for direction in (unit, -unit):
            X = self._downhill(direction)
            if X is not None:
                state.X = X
                state.measure()
                self._factor, self.kind = None, "saddle"
                return True
        return False

    def _downhill(self, unit: Floats) -> Floats | None:
        """X farthest along a motion of unit length, in doubling steps on which E keeps falling; or None."""
        state = self.state
        best, lowest_energy = None, state.energy
        t = 1e-3
        while t < 0.1:
            X, down = state.displaced(t * unit)
            X = state.keep_volumes(X)
            value = state.energy_at(X)
            if not value < lowest_energy or down.any() or state.spoils_triangles(X):
                break
            best, lowest_energy = X, value
            t *= 2.0
        return best

    def _factorise_definite(self) -> bool:
        """Factorise; where a minimum is sought, with shifts until no eigenvalue is negative."""
        for shift in SHIFTS if self.minimum else SHIFTS[:1]:
            if self._factorise(shift) and (self.negative == 0 or not self.minimum):
                return True
            self._factor = None
        return False

    def _factorise(self, shift: float) -> bool:
        """Factorise BᵀHB + shift BᵀLB at X, unless there is a factor; False if it is singular."""
        if self._factor is not None:
            return True
        state = self.state
        if self._pattern is None or self._factoriser is None:
            self._pattern = hessian_pattern(state.classes, state.space)
            units = strength_units(state.surface, state.classes, state.space)
            self._factoriser = factoriser(self._pattern, self.backend, units)
        rigid = rigid_modes(state.space, self._motions, state.X)
        excluded = excluded_columns(state.surface, state.space, rigid, state.X)
        for weight in (shift, shift + SOFT):
            data = assemble(state.surface, state.classes, state.space, self._pattern, state.X, 1.0, weight)
            try:
                factor = self._factoriser.factor(data)
                self.negative = negatives_without(factor, excluded)
            except SingularMatrix:
                continue
            self.factorisations += 1
            self._factor, self._shift, self._factor_space = factor, shift, state.space
            self._added, self._bordered = None, None
            if len(state.pressures):
                self._bordered = BorderedFactor(factor, state.volume_columns())
            if weight != shift:
                soft = assemble(state.surface, state.classes, state.space, self._pattern, state.X, 0.0, SOFT)
                self._added = full_matrix(self._pattern, soft)
            return True
        return False

    def _in_factor_basis(self, action: Callable[[Floats], Floats], s: Floats) -> Floats:
        """Apply an action in the basis that the factor was made in to s, given in the present one."""
        now, then = self.state.space, self._factor_space
        if now is then:
            return action(s)
        return now.from_other(then, action(then.from_other(now, s)))

    def _inverse(self, right: Floats) -> Floats:
        """The factor's inverse, or that of the bordered matrix, in the present basis."""
        if self._bordered is None:
            assert self._factor is not None
            return self._in_factor_basis(self._factor.solve, right)
        now, then, size = self.state.space, self._factor_space, self.state.space.size
        if now is then:
            return self._bordered.solve(right)
        z = self._bordered.solve(np.append(then.from_other(now, right[:size]), right[size:]))
        return np.append(now.from_other(then, z[:size]), z[size:])

    def _direction(self) -> tuple[Floats, Floats]:
        """-B J⁻¹ r with J the derivative of r itself, by GMRES preconditioned with the factor.

        With a shift, J is the shifted matrix, and the factor its inverse. Stiffness added to the factor is
        added to J, too: otherwise motions that cost no energy would use up the accuracy.

        Where rooms prescribe volumes, the pressures μ (r,) are unknowns, too, and J is bordered:

            [ J   -G ] [ s ]     [ -r      ]
            [ Gᵀ   0 ] [ μ ]  =  [ V̄ - V   ]        G = Bᵀ ∂V/∂X
        """
        state, added = self.state, self._added
        rooms = len(state.pressures)
        right = -state.residual
        if rooms:
            columns, units = state.volume_columns(), state.volume_units
            right = np.append(right, -units * self._volumes_ahead())
        if self._shift != 0.0:
            self._gmres_steps = 0
            z = self._inverse(right)
            return self._split(z)
        size = (len(right), len(right))
        here = linearise(state.surface, state.classes, state.space, state.X, state.gradient)

        def times(s: Floats) -> Floats:
            change = here.times(state.space.to_vectors(s))
            return change if added is None else change + self._in_factor_basis(added.__matmul__, s)

        def bordered(z: Floats) -> Floats:
            s, pressures = z[:-rooms], z[-rooms:]
            return np.append(times(s) - columns @ pressures, columns.T @ s)

        norms: list[float] = []
        matrix = LinearOperator(size, bordered if rooms else times, dtype=float)
        inverse = LinearOperator(size, self._inverse, dtype=float)
        z, _ = gmres(
            matrix,
            right,
            M=inverse,
            rtol=1e-3,
            restart=12,
            maxiter=1,
            callback=norms.append,
            callback_type="pr_norm",
        )
        self._gmres_steps = len(norms)
        state.evaluations += len(norms)
        return self._split(z)

    def _split(self, z: Floats) -> tuple[Floats, Floats]:
        """The motion (n,3) and the pressures (r,) of a solution."""
        state = self.state
        s = z[: state.space.size]
        if self._shift == 0.0 and len(self._motions):
            s = self._limit_drift(s)
        return state.space.to_vectors(s), z[state.space.size :] * (
            state.volume_units if len(z) > len(s) else 1.0
        )

    def _limit_drift(self, s: Floats) -> Floats:
        """s with its rigid part shortened, which only slides the mesh; the residual may rise for a while."""
        state = self.state
        rigid = rigid_modes(state.space, self._motions, state.X)
        drift = rigid @ (rigid.T @ s)
        far = float(np.abs(state.space.to_vectors(drift)).max())
        room = DRIFT * float(np.median(edge_lengths(state.surface.moved(state.X))))
        if far <= room:
            return s
        self._residual_raised = False
        return s - (1.0 - room / far) * drift

    def _with_sheets(self, d: Floats) -> Floats:
        """The motion d with the insides of the sheets following their curves."""
        if self._extension is None:
            state = self.state
            try:
                self._extension = HarmonicExtension(state.surface, state.classes, state.X, self.backend)
            except SingularMatrix:
                return d
            self.factorisations += 1
        return self._extension.extend(self.state.space, d)

    def _improved(self, t: float, slope: float, energy: float, norm: float) -> bool:
        """Whether the step just taken lowers the residual enough or, towards a minimum, E."""
        if self.state.norm < (1.0 - 0.3 * t) * norm:
            self._residual_raised = False
            return True
        # where no support resists some rigid motion, every other step may raise the residual
        if len(self._motions) and not self._residual_raised and self.state.norm < 2.0 * norm:
            self._residual_raised = True
            return True
        return self.minimum and self.state.energy <= energy + 1e-2 * t * slope and slope < 0.0
