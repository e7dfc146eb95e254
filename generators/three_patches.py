"""Fig. 4: three patches, and three walls that meet at 120° in a vertical line."""

from __future__ import annotations

from pcmc import Surface

from .fans import fans


def three_patches(
    rings: int = 8,
    *,
    alpha: float = 6.0,
    alpha_aux: float = 2.0,
    radius: float = 10.0,
    height: float = 4.0,
    bulge: float | None = None,
    mesh: str = "lattice",
) -> Surface:
    """Three sectors of a disc and three right-triangle walls under the ridges between them.

    The figure gives no numbers; at these the walls stand nearly as high at rest as at first.
    The rim is fixed and the walls' feet slide on Π (z = 0).

    Parameters
    ----------
    rings : rings of triangles from the centre to the rim; radius/rings is the length of an edge.
    alpha, alpha_aux : tension of "patch 1" .. "patch 3" and of "wall 1" .. "wall 3".
    radius, height : the base and the height of the walls, lengths.
    bulge, mesh : as in `four_fans`.

    >>> surface = three_patches()
    >>> [len(curve.sheets) for curve in surface.topology.junctions]
    [3, 3, 3, 3]
    """
    return fans(
        3,
        rings,
        name="patch",
        alpha=alpha,
        alpha_aux=alpha_aux,
        radius=radius,
        height=height,
        bulge=bulge,
        mesh=mesh,
    )
