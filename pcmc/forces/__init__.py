"""The energy E = Σ α A − Σ p V: its gradient, Hessian and Jacobian, curvature, and the motion space.

Gives these to contact, stability, the certificate and the solvers. Imports ``surface`` and ``base``.
"""

from .functional import energy, energy_and_gradient, energy_at, gradient

__all__ = ["energy", "energy_and_gradient", "energy_at", "gradient"]
