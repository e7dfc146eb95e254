"""Verification: a theorem for a surface at rest, proved in floating point with outward rounding.

``verify`` proves that an exact equilibrium of the discrete energy is near, and its Morse index. Imports
``certificate`` and the rooms below it.
"""

from .theorem import Theorem, verify

__all__ = ["Theorem", "verify"]
