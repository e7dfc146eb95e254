"""Example 3: four fans over a disc, four walls that share a vertical line (Figs. 17-21)."""

from __future__ import annotations

from pcmc import Surface

from .fans import fans


def four_fans(
    rings: int = 7,
    *,
    alpha: float = 10.0,
    alpha_aux: float = 3.0,
    radius: float = 20.0,
    height: float = 8.0,
    bulge: float = 0.0,
    mesh: str = "lattice",
) -> Surface:
    """Four quarter discs and four right-triangle walls under the ridges between them.

    The rim is fixed and the walls' feet slide on Π.

    Parameters
    ----------
    rings : rings of triangles from the centre to the rim; radius/rings is the length of an edge.
    alpha, alpha_aux : tension of "fan 1" .. "fan 4" and of "wall 1" .. "wall 4".
    radius, height : the base and the height of the walls, lengths.
    bulge : how far the initial fans stand out of the cone over the ridges, length.
    mesh : "rings", ring k with k segments in each fan; "even", with as many as make them about as
        long as the rings are wide; "lattice", a triangular lattice fitted into the fan.

    >>> surface = four_fans(rings=5)
    >>> surface.patches[0].name, surface.patches[-1].name, surface.patches[0].target_curvature
    ('fan 1', 'wall 4', 0.05)
    """
    return fans(
        4,
        rings,
        name="fan",
        alpha=alpha,
        alpha_aux=alpha_aux,
        radius=radius,
        height=height,
        bulge=bulge,
        mesh=mesh,
    )
