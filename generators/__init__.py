"""Starting surfaces: the paper's examples, and surfaces with a closed form."""

from .barrel import barrel
from .bezier_hall import bezier_hall
from .catenary import catenary
from .cells import kelvin_foam, minimal_cell, minimal_cell_area, weaire_phelan_foam
from .delaunay import delaunay, delaunay_exact, delaunay_force, delaunay_limit, unduloid_length
from .double_bubble import double_bubble, double_bubble_exact
from .enneper import enneper, enneper_exact, enneper_wire
from .fans import four_fans, three_patches
from .hypar_roof import hypar_roof, hypar_roof_edge
from .joined_caps import joined_caps, joined_caps_exact
from .lens import hemisphere, hemisphere_exact, lens, lens_circle, lens_exact
from .schwarz_p import schwarz_p
from .sphere import sphere, sphere_exact
from .spherical_cap import spherical_cap, spherical_cap_exact
from .tetrahedron import (
    skew_quadrilateral,
    skew_quadrilateral_exact,
    tetrahedral_film,
    tetrahedral_film_exact,
)
from .triple_bubble import triple_bubble, triple_bubble_exact
from .tubes import catenoid, catenoid_exact, catenoid_fold, catenoid_neck, cylinder, cylinder_exact
from .two_caps import two_caps
from .two_squares import two_squares

__all__ = [
    "barrel",
    "bezier_hall",
    "catenary",
    "catenoid",
    "catenoid_exact",
    "catenoid_fold",
    "catenoid_neck",
    "cylinder",
    "cylinder_exact",
    "delaunay",
    "delaunay_exact",
    "delaunay_force",
    "delaunay_limit",
    "double_bubble",
    "double_bubble_exact",
    "enneper",
    "enneper_exact",
    "enneper_wire",
    "four_fans",
    "hemisphere",
    "hemisphere_exact",
    "hypar_roof",
    "hypar_roof_edge",
    "joined_caps",
    "joined_caps_exact",
    "kelvin_foam",
    "lens",
    "lens_circle",
    "lens_exact",
    "minimal_cell",
    "minimal_cell_area",
    "schwarz_p",
    "skew_quadrilateral",
    "skew_quadrilateral_exact",
    "sphere",
    "sphere_exact",
    "spherical_cap",
    "spherical_cap_exact",
    "tetrahedral_film",
    "tetrahedral_film_exact",
    "three_patches",
    "triple_bubble",
    "triple_bubble_exact",
    "two_caps",
    "two_squares",
    "unduloid_length",
    "weaire_phelan_foam",
]
