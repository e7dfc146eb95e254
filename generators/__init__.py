"""The paper's examples and the closed forms, as Surfaces to start from."""

from .two_caps import two_caps
from .two_squares import two_squares

__all__ = ["two_caps", "two_squares"]
