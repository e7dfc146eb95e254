"""The steps of the geometric solver: Newton with a reused factor, smooth descent, leaving a saddle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..base.arrays import Floats
from ..base.tolerances import DIFFERENCE_ROUNDING
from ..meshing.quality import edge_lengths
from ..stability.bordered import solve_preconditioned
from ..stability.equilibrium import Equilibrium, SecondVariation
from ..stability.factorisation import SingularMatrix
from ..stability.modes import lowest
from ..surface.checks import reachable
from ..surface.geometry import vertex_area_vectors
from .smoother import HarmonicExtension, Smoother
from .state import SolverState

SHIFTS = (0.0, 0.25, 1.0, 4.0)  # of the stiffness, tried in turn until the matrix is positive
LENGTHS = (1.0, 0.5, 0.25, 0.125)  # of a Newton step, tried in turn
REFRESH = 6  # descent steps between two factorisations of the Laplacian
GROWTH = 0.5  # of a room's volume: the most that a step adds to it or takes away
DRIFT = 0.1  # of an edge: the most that a step moves along a rigid motion that no support resists


class Stepper:
    """Takes steps on a State, and reuses factorisations while they contract."""

    def __init__(self, state: SolverState, minimum: bool) -> None:
        self.state, self.minimum = state, minimum
        self.kind = "start"  # or the last step: newton, shifted, contact, descent, saddle, release
        self.factorisations = 0
        self._shifted_steps = 0  # in a row
        self._residual_raised = False  # by the last step, which was allowed to
        self.free()

    def free(self) -> None:
        """Drop all factors: they are most of a large surface's memory."""
        self._version = self.state.version  # of what follows: it belongs to these faces and unknowns
        self.second: SecondVariation | None = None  # last factorised, perhaps at other positions
        self._smoother: Smoother | None = None
        self._extension: HarmonicExtension | None = None
        self._smoother_age = REFRESH
        self.state.at.release()

    def drop_outdated(self) -> None:
        """Drop the factors where they belong to other faces or unknowns."""
        if self._version != self.state.version:
            self.free()

    def newton(self) -> bool:
        """A Newton step, shortened if necessary; False, with nothing moved, if none helps."""
        self.drop_outdated()
        state, at = self.state, self.state.at
        fresh = self.second is None
        second = self.second or self.factorise()
        if second is None:
            return False
        d, pressures, gmres_steps = self.direction(second)
        energy, slope = state.energy, float((at.gradient * d).sum())
        for t in LENGTHS if fresh else LENGTHS[:1]:
            X, down = state.displaced(t * d)
            if state.spoils_triangles(X):
                X, down = state.displaced(t * self._with_sheets(d))
            if state.spoils_triangles(X):
                continue
            if len(pressures):
                energy, slope = self._lagrangian(d, t * pressures, at.gradient)
            state.change_pressures(t * pressures)
            state.move(X, down)
            if down.any():
                self.kind = "contact"
                return True
            if self._improved(t, slope, energy, at.norm):
                if state.at.norm > 0.1 * at.norm or gmres_steps > 8:
                    self.second = None
                self.kind = "newton" if second.stiffness == 0.0 else "shifted"
                return True
            if state.at.residual <= DIFFERENCE_ROUNDING:
                break
            state.change_pressures(-t * pressures)
            state.go_to(at.X)
        self.second = None
        return not fresh

    def descend(self) -> bool:
        """One smooth descent step with backtracking; False if E does not fall."""
        self.drop_outdated()
        state, at = self.state, self.state.at
        if self._smoother is None:
            self._smoother = Smoother(at.surface, at.classes, state.backend)
        if self._smoother_age >= REFRESH:
            try:
                self._smoother.refresh(at.X)
            except SingularMatrix:
                return False
            self.factorisations += self._smoother.factorisations
            self._smoother_age = 0
        self._smoother_age += 1
        d, pressures = self._smooth_direction(self._smoother)
        energy, slope = self._lagrangian(d, pressures, at.unbalanced)
        state.change_pressures(pressures)
        for t in 0.5 ** np.arange(12):
            X, down = state.displaced(t * d)
            if reachable(X) and state.energy_at(X) < energy + 1e-3 * t * slope:
                state.move(X, down)
                self.second, self.kind = None, "descent"
                return True
        state.change_pressures(-pressures)
        return False

    def _smooth_direction(self, smoother: Smoother) -> tuple[Floats, Floats]:
        """-L⁻¹(f - Σ μ g), and the pressures μ (r,) that bring the volumes nearer to those prescribed.

        f (n,3) are the forces left and g the gradients of the volumes, both in the motion space.
        """
        at = self.state.at
        d = -smoother.solve(at.unbalanced)
        if not at.surface.rooms:
            return d, self.state.pressures
        G = at.volume_gradients
        inflation = np.stack([smoother.solve(at.space.project(g)) for g in G])
        growth = -self._volumes_ahead() - np.einsum("rnd,nd->r", G, d)
        pressures = np.linalg.lstsq(np.einsum("rnd,snd->rs", G, inflation), growth)[0]
        return d + np.tensordot(pressures, inflation, axes=1), pressures

    def _volumes_ahead(self) -> Floats:
        """(r,) the defects of the volumes that one step corrects: all of them, unless they are large."""
        defects, wanted = self.state.at.volume_defects, self.state.at.wanted_volumes
        most = GROWTH * np.maximum(np.abs(wanted), np.abs(wanted + defects))
        return np.clip(defects, -most, most)

    def _lagrangian(self, d: Floats, pressures: Floats, forces: Floats) -> tuple[float, float]:
        """The Lagrangian here and its slope along d (n,3), with the rooms' pressures changed."""
        at = self.state.at
        slope = float((forces * d).sum() - pressures @ np.einsum("rnd,nd->r", at.volume_gradients, d))
        return self.state.energy - float(pressures @ at.volume_defects), slope

    def saddle_near(self) -> bool:
        """Whether several Newton steps in a row had to be shifted; True at every fourth."""
        self._shifted_steps = self._shifted_steps + 1 if self.kind == "shifted" else 0
        return self._shifted_steps > 0 and self._shifted_steps % 4 == 0

    def leave_saddle(self, at: Equilibrium | None = None) -> bool:
        """Move along the lowest mode as far as E keeps falling; False if no mode lowers it.

        ``at`` is the present equilibrium, whose factors may be used up; by default a copy.
        """
        self.drop_outdated()
        state, at = self.state, at or replace(self.state.at)
        try:
            second = at.factorised()
            self.factorisations += 1
            modes = lowest(second, 1)[1] if second.negative else np.empty(0)
        except SingularMatrix:
            return False
        if not len(modes):
            return False
        normals, area = vertex_area_vectors(at.X, at.classes.faces)
        unit = modes[0] * (np.sqrt(area.sum() / 3.0) / np.linalg.norm(modes[0], axis=1).max())
        if (unit * normals).sum() < 0.0:
            unit = -unit  # outwards first, whichever way the surface is turned
        for direction in (unit, -unit):
            best, lowest_energy = None, state.energy
            for t in 1e-3 * 2.0 ** np.arange(7):
                X, down = state.displaced(t * direction)
                X = state.keep_volumes(X)
                value = state.energy_at(X)
                if not value < lowest_energy or down.any() or state.spoils_triangles(X):
                    break
                best, lowest_energy = X, value
            if best is not None:
                state.go_to(best)
                self.second, self.kind = None, "saddle"
                return True
        return False

    def factorise(self) -> SecondVariation | None:
        """Factorise; where a minimum is sought, with shifts until no eigenvalue is negative."""
        for shift in SHIFTS if self.minimum else SHIFTS[:1]:
            try:
                second = self.state.at.factorised(stiffness=shift)
            except SingularMatrix:
                continue
            self.factorisations += 1
            if second.negative == 0 or not self.minimum:
                self.second = second
                return second
        return None

    def direction(self, second: SecondVariation) -> tuple[Floats, Floats, int]:
        """-B J⁻¹ r (n,3), the changes (r,) of the rooms' pressures, and the steps that GMRES took.

        The factor preconditions J, ``Equilibrium.times``; shifted, it is the inverse. Stiffness added to the
        factor is added to J, too: otherwise motions that cost no energy would use up the accuracy.
        """
        at, added = self.state.at, second.added_matrix
        now, then, size = at.space, second.of.space, at.space.size
        right = np.append(-at.forces, -at.volume_units * self._volumes_ahead())

        def in_basis_then(action: Callable[[Floats], Floats], z: Floats) -> Floats:
            if now is then:
                return action(z)
            out = action(np.append(then.to_coordinates(now.to_vectors(z[:size])), z[size:]))
            return np.append(now.to_coordinates(then.to_vectors(out[:size])), out[size:])

        def times(z: Floats) -> Floats:
            change = at.times(now.to_vectors(z[:size]), z[size:])
            if added is not None:
                change[:size] += in_basis_then(added.__matmul__, z[:size])
            return change

        def inverse(z: Floats) -> Floats:
            return in_basis_then(second.bordered, z)

        if second.stiffness != 0.0:
            z, steps = inverse(right), 0
        else:
            z, residuals = solve_preconditioned(times, inverse, right, 1e-3, restart=12)
            steps = len(residuals)
            self.state.evaluations += steps
        s = at.across_carried(z[:size])
        if second.stiffness == 0.0 and len(at.rigid_motions):
            drift = at.rigid @ (at.rigid.T @ s)
            far = float(np.abs(at.space.to_vectors(drift)).max())
            most = DRIFT * float(np.median(edge_lengths(at.shape)))
            if far > most:  # the rigid part only slides the mesh; the residual may rise for a while
                s, self._residual_raised = s - (1.0 - most / far) * drift, False
        return at.space.to_vectors(s), z[size:] * at.volume_units, steps

    def _with_sheets(self, d: Floats) -> Floats:
        """The motion d with the insides of the sheets following their curves."""
        at = self.state.at
        if self._extension is None:
            try:
                self._extension = HarmonicExtension(at.surface, at.classes, at.X, self.state.backend)
            except SingularMatrix:
                return d
            self.factorisations += 1
        return self._extension.extend(at.space, d)

    def _improved(self, t: float, slope: float, energy: float, norm: float) -> bool:
        """Whether the step just taken lowers the residual enough or, towards a minimum, E."""
        state = self.state
        if state.at.norm < (1.0 - 0.3 * t) * norm:
            self._residual_raised = False
            return True
        # where rigid motions are free and not carried, every other step may raise the residual
        drifts = len(state.at.rigid_motions) > 0 and state.at.surface.order == 1
        if drifts and not self._residual_raised and state.at.norm < 2.0 * norm:
            self._residual_raised = True
            return True
        return self.minimum and state.energy <= energy + 1e-2 * t * slope and slope < 0.0
