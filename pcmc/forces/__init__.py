"""The energy E = Σ α A − Σ p V: its gradient, Hessian and Jacobian, curvature, and the motion space.

And contact with Π: ``wall_rows`` finds the walls that can come down, ``pinching`` the part of a surface that
stands, and what its junctions bear. Imports ``surface`` and ``base``.
"""

from .functional import energy, energy_and_gradient, energy_at, gradient

__all__ = ["energy", "energy_and_gradient", "energy_at", "gradient"]
