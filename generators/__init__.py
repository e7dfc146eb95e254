"""Starting surfaces: the paper's examples, and surfaces with a closed form."""

from .bezier_hall import bezier_hall
from .double_bubble import double_bubble, double_bubble_exact
from .fans import four_fans, three_patches
from .joined_caps import joined_caps, joined_caps_exact
from .sphere import sphere, sphere_exact
from .spherical_cap import spherical_cap, spherical_cap_exact
from .two_caps import two_caps
from .two_squares import two_squares

__all__ = [
    "bezier_hall",
    "double_bubble",
    "double_bubble_exact",
    "four_fans",
    "joined_caps",
    "joined_caps_exact",
    "sphere",
    "sphere_exact",
    "spherical_cap",
    "spherical_cap_exact",
    "three_patches",
    "two_caps",
    "two_squares",
]
