"""The equations of an equilibrium in frozen frames, enclosed: their value, matrix, and how fast it changes.

Unknowns are s (N,), the motion X₀ + B₀ s, and, where rooms prescribe volumes, their pressures δ = κ η:

    F(s, η) = (B₀ᵀ ∇(E - Σ δ_r V_r),  -κ_r (V_r - V̄_r))
    K = DF  = [[A, -κ C], [-κ Cᵀ, 0]],    C = B₀ᵀ ∇V

F is the gradient of E - Σ δ_r (V_r - V̄_r), so K is symmetric. κ is a power of two, and makes the new columns
about as large as the diagonal of A. With K regular, C has full rank, and A has on the motions that keep the
volumes (Cᵀ s = 0) as many negative eigenvalues as K less r (Haynsworth). If such a motion v has Av = μv + Cy,
then K takes (v, y/κ) to (μ v, 0): so no μ is nearer to zero than the eigenvalues of K.

Rigid motions that no support resists cost nothing. Their k columns Q in the motion space border K like the
gradients of volumes, with the equations Qᵀ s = 0: at a zero of F, E is stationary along all motions across Q,
and along the rigid motions themselves, which do not change it. B₀ Q is only their part in the frozen frames:
along that alone E may change, as vertices then slide within the sheet.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import block_array, csr_array

from ..base.arrays import Floats
from ..forces.flat_pieces import flat_pieces
from ..forces.motion_space import MotionSpace
from ..forces.pattern import Pattern, hessian_pattern
from ..forces.pinching import StandingPart
from ..forces.rooms import closing_volumes, prescribed_volumes
from .balls import SAFE, U
from .enclosures import MeshArrays, coordinates, forces, mesh_arrays, second_variation, signed_volumes
from .lipschitz import lipschitz

CUBIC = 1.0 / np.sqrt(27.0)  # |det(d_0, d_1, d_2)| ≤ this times |d|³


@dataclass(frozen=True, eq=False)
class System:
    """F and K at the given vertices, s = 0 and η = 0."""

    items: MeshArrays
    space: MotionSpace  # the frozen frames
    pattern: Pattern  # of the upper triangle of K
    forces: Floats  # (n,3) ∇E, and the radii of its balls
    forces_radius: Floats
    matrix: Floats  # (k,) values of K in the pattern, and a bound of ‖K - these values‖₂
    matrix_error: float
    left: Floats  # (N,) values of F, the radii of their balls, and a bound of ‖F‖₂, force
    left_error: Floats
    residual: float
    borders: int  # r + k
    scales: Floats  # (r,) κ
    coupling: float  # a bound of ‖Σ κ_r ζ_r B₀ᵀ∇²V_r B₀‖₂ for |ζ| = 1, per |ζ|

    def left_after(self, y: Floats) -> float:
        """A bound of ‖F - K y‖₂. Row i of the product is a sum of k_i terms, off by γ_(k_i+1) |K| |y|."""
        matrix = self.pattern.symmetric(self.matrix)
        terms = np.diff(matrix.indptr) + 3.0
        off = 2.0 * U * terms * (abs(matrix) @ np.abs(y) + np.abs(self.left)) + self.left_error
        total = np.abs(self.left - matrix @ y) + off
        size = np.sqrt((y * y).sum())
        return float((np.sqrt((total * total).sum()) + self.matrix_error * size) * SAFE)

    def lipschitz(self, radius: float) -> float:
        """L with ‖K(x) - K(y)‖₂ ≤ L |x - y| for x, y in the ball of this radius.

        K has the third derivatives of E with pressures up to κ ``radius`` more, and those with one derivative
        by η: 3 ζ ⟨c, κ∇²V c⟩ in the cubic form, at most 3 · coupling · 2/√27 where |c|² + |ζ|² = 1.
        """
        own = lipschitz(self.items, self.space, radius, float(self.scales.sum()) * radius)[0]
        if not len(self.scales):
            return own
        shared = np.bincount(self.items.faces.ravel()).max() * CUBIC * float(np.linalg.norm(self.scales))
        return float((own + 6.0 * CUBIC * (self.coupling + shared * radius)) * SAFE)


def system(part: StandingPart, space: MotionSpace, rigid: Floats) -> System:
    """The system of a standing part in these frames; ``rigid`` (N,k) is Q."""
    surface = part.surface
    pattern = hessian_pattern(part.classes, space)
    items = mesh_arrays(surface, part.classes, pattern)
    patch_of_end = flat_pieces(surface).end_patch
    force, force_radius = forces(items, surface.net_pressures[patch_of_end])
    left, error = coordinates(space, force, force_radius)
    values, radii = second_variation(items, space, pattern)
    scales, coupling = np.empty(0), 0.0
    diagonal = np.abs(values[pattern.indptr[:-1]]).mean()
    columns = list(2.0 ** np.round(np.log2(diagonal)) * rigid.T)
    column_errors, forms = list(0.0 * rigid.T), []
    left, error = np.append(left, 0.0 * rigid[0]), np.append(error, 0.0 * rigid[0])
    if surface.rooms:
        for signs in surface.room_signs:
            room = items.of_volume(signs)
            column, off = coordinates(space, *forces(room, -signs[patch_of_end]))
            scale = 2.0 ** np.round(np.log2(diagonal / np.linalg.norm(column)))
            scales = np.append(scales, scale)
            columns.append(-scale * column)
            column_errors.append(scale * off)
            form, form_error = second_variation(room, space, pattern)
            forms.append(scale * _norm(pattern, np.abs(form) + form_error))
        coupling = float(np.linalg.norm(forms) * SAFE)
        found, off = signed_volumes(items, np.array(surface.room_signs), patch_of_end)
        off += U * (np.abs(found) + 2.0 * np.abs(found + closing_volumes(surface)))
        found = found + closing_volumes(surface)
        lacking = scales * (prescribed_volumes(surface) - found)
        left, error = np.append(left, lacking), np.append(error, scales * off + U * np.abs(lacking))
    if columns:
        radii = _bordered(pattern, radii, np.stack(column_errors, axis=1))[1]
        pattern, values = _bordered(pattern, values, np.stack(columns, axis=1))
    residual = float(np.linalg.norm(np.abs(left) + error) * SAFE)
    enclosed = force, force_radius, values, _norm(pattern, radii), left, error, residual
    return System(items, space, pattern, *enclosed, len(columns), scales, coupling)


def _bordered(pattern: Pattern, values: Floats, columns: Floats) -> tuple[Pattern, Floats]:
    """The upper triangle of [[A, C], [Cᵀ, 0]], with all entries of C (N,k) and zeros on its last diagonal."""
    size, k = columns.shape
    corner = csr_array((np.zeros(k), np.arange(k), np.arange(k + 1)))
    side = csr_array((columns.ravel(), np.tile(np.arange(k), size), k * np.arange(size + 1)))
    blocks: Any = [[pattern.matrix(values), side], [None, corner]]
    upper = csr_array(block_array(blocks))
    upper.sort_indices()
    return Pattern(upper.indptr, upper.indices, pattern.offset), upper.data


def _norm(pattern: Pattern, positive: Floats) -> float:
    """A bound of the 2-norm of the symmetric matrix with these entries ≥ 0: its largest row sum."""
    return float(pattern.symmetric(positive).sum(axis=1).max(initial=0.0) * SAFE)
