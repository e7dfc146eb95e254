"""Example 2: two shallow sphere caps of different curvature with a wall between (Figs. 11-16)."""

from __future__ import annotations

from pcmc import Patch, Surface
from pcmc.base import validate

from .exact import Sphere
from .sphere_pair import build_pair

LARGE = Sphere((-5.0, 0.0, -17.5), 18.5)
SMALL = Sphere((3.0, 0.0, -7.5), 8.5)
WALLS = ("upright", "inclined")


def two_caps(
    edge_length: float = 0.36,
    *,
    alpha_large: float = 4.0,
    alpha_small: float = 3.0,
    alpha_aux: float = 4.0,
    wall: str = "upright",
) -> Surface:
    """The parts above Π of two spheres, cut where they meet, and the wall from there down to Π.

    The spheres are the paper's: centres (-5, 0, -17.5) and (3, 0, -7.5), radii 18.5 and 8.5. On Π
    they are circles of radius 6 and 4; they meet in the plane x = 0.25 - 1.25 z, at most 0.37 above
    Π. The outline is fixed, the wall's foot slides.

    The paper prints ‖∇E‖² = 12.204 for its initial shape; an edge length of 0.36 comes nearest
    (``generators.calibration``). The paper's flow converges as printed at 1.2, not at 0.36.

    Parameters
    ----------
    edge_length : length.
    alpha_large, alpha_small, alpha_aux : tension of the patches "large", "small" and "wall".
    wall : "upright", straight down from the junction; or "inclined", in the plane in which the
        spheres meet, its foot a straight line.

    Returns
    -------
    Surface
        Angles of the two patches are at least 30°; the wall's follow from its height of 0.37.

    >>> surface = two_caps()
    >>> [p.name for p in surface.patches], float(surface.vertices[:, 2].max().round(1))
    (['large', 'small', 'wall'], 1.0)
    """
    edge_length = validate.positive("edge_length", edge_length)
    validate.choice("wall", wall, WALLS)
    mesh, fixed, sliding = build_pair(LARGE, SMALL, edge_length, upright=wall == "upright")
    patches = (
        Patch("large", alpha_large),
        Patch("small", alpha_small),
        Patch("wall", alpha_aux, pressure=0.0),
    )
    return mesh.surface(patches, fixed=fixed, on_plane=sliding)
