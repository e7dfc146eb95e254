"""How the forces along circles change because the tangent turns as a vertex slides.

The force along a circle with the tangent t(x) is f = ⟨t, ∇E⟩; along a motion d it changes by
⟨t, (∂²E) d⟩ + ⟨Dt[d], ∇E⟩. Unlike at free vertices, the second part does not vanish at rest: there ∇E is the
force that the circle carries. For d = t it is ⟨κ, ∇E⟩ with the curvature vector κ, and so part of the
second variation: E along the circle has the second derivative ⟨t, (∂²E) t⟩ + ⟨κ, ∇E⟩.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats, Ints
from ..surface import Surface
from .functional import energy_and_gradient
from .motion_space import MotionSpace


def circle_turning(surface: Surface, space: MotionSpace, X: Floats) -> tuple[Ints, Floats]:
    """The vertices (k,) that move along circles, and (k,3) the gradient of ⟨t, ∇E⟩ by t alone, there.

    ∇E is taken without supports at X (n,3), and not computed where nothing slides along a circle.
    """
    rows = [np.flatnonzero(along & (space.dimension == 1)) for _, along in surface.on_circle]
    if not sum(map(len, rows)):
        return np.empty(0, dtype=np.int64), np.empty((0, 3))
    forces = energy_and_gradient(surface, X, supports=False)[1]
    factors = [
        circle.turning(X[row], forces[row]) for (circle, _), row in zip(surface.on_circle, rows, strict=True)
    ]
    return np.concatenate(rows), np.concatenate(factors)
