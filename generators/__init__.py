"""The paper's examples and the closed forms, as Surfaces to start from."""

from .four_fans import four_fans
from .joined_caps import joined_caps, joined_caps_exact
from .spherical_cap import spherical_cap, spherical_cap_exact
from .two_caps import two_caps
from .two_squares import two_squares

__all__ = [
    "four_fans",
    "joined_caps",
    "joined_caps_exact",
    "spherical_cap",
    "spherical_cap_exact",
    "two_caps",
    "two_squares",
]
