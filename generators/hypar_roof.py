"""A roof on four masts: a membrane between edge cables, its corners alternately high and low."""

from __future__ import annotations

import numpy as np

from pcmc import Cable, Patch, Surface
from pcmc.base import validate
from pcmc.base.arrays import Floats

from .grid import grid_faces

DEEPEST = 0.15  # of the chord: sag that an edge starts with at most


def hypar_roof(
    squares: int = 12,
    *,
    side: float = 10.0,
    height: float = 4.0,
    tension: float = 1.0,
    cable: float = 10.0,
    weight: float = 0.0,
) -> Surface:
    """A square roof whose corners are fixed, two of them at ``height`` and two on Π, with four edge cables.

    The edges start as arcs of radius τ/α, seen from above; the membrane between them is ruled. With
    ``height`` 0 and without weight it is flat, and each edge at rest is such an arc
    (``hypar_roof_edge``); this needs 2 τ > α · side.

    Parameters
    ----------
    squares : along each edge, ≥ 2.
    side, height : length.
    tension, weight : of the patch "roof".
    cable : τ of the cables "south", "east", "north" and "west", force.

    >>> roof = hypar_roof(4)
    >>> roof.m, [cable.name for cable in roof.cables], int(roof.fixed.sum())
    (32, ['south', 'east', 'north', 'west'], 4)
    """
    squares = validate.integer("squares", squares, least=2)
    for name, length in {"side": side, "tension": tension, "cable": cable}.items():
        validate.positive(name, length)
    share = np.arange(squares + 1) / squares
    sag = DEEPEST * side
    if 2.0 * cable > tension * side:
        radius = cable / tension
        sag = min(sag, radius - np.sqrt(radius**2 - 0.25 * side**2))
    inward = _arc(share, side, sag)
    s, t = (k.ravel() for k in np.meshgrid(share, share, indexing="ij"))
    dent = np.repeat(inward, squares + 1), np.tile(inward, squares + 1)  # of the edges along x and along y
    X = np.empty((len(s), 3))
    X[:, 0] = side * (s - 0.5) + dent[1] * (1.0 - 2.0 * s)
    X[:, 1] = side * (t - 0.5) + dent[0] * (1.0 - 2.0 * t)
    X[:, 2] = height * (s * t + (1.0 - s) * (1.0 - t))
    number = np.arange(len(X)).reshape(squares + 1, squares + 1)
    edges = {"south": number[:, 0], "east": number[-1], "north": number[:, -1], "west": number[0]}
    masts = np.zeros(len(X), dtype=bool)
    masts[number[[0, 0, -1, -1], [0, -1, 0, -1]]] = True
    return Surface(
        X,
        grid_faces(squares, squares),
        np.zeros(2 * squares**2, dtype=int),
        (Patch("roof", tension, 0.0, weight=weight),),
        fixed=masts,
        cables=tuple(Cable.along(name, cable, vertices) for name, vertices in edges.items()),
    )


def hypar_roof_edge(
    points: Floats, *, side: float = 10.0, tension: float = 1.0, cable: float = 10.0
) -> Floats:
    """(k,) distance of points of the edge "south" of the flat roof from its arc of radius τ/α, length.

    >>> hypar_roof_edge(np.array([[-5, -5, 0], [0, 5 - 75**0.5, 0]])).round(12).tolist()
    [0.0, 0.0]
    """
    radius = cable / tension
    centre = np.array([0.0, -0.5 * side - np.sqrt(radius**2 - 0.25 * side**2), 0.0])
    return np.asarray(np.abs(np.linalg.norm(points - centre, axis=1) - radius))


def _arc(share: Floats, chord: float, sag: float) -> Floats:
    """Rise of an arc over its chord at shares (k,) of the chord."""
    radius = (0.25 * chord**2 + sag**2) / (2.0 * sag)
    across = chord * (share - 0.5)
    return np.asarray(np.sqrt(radius**2 - across**2) - (radius - sag))
