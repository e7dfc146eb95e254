"""A patch over a disc: the simplest surface in closed form, a part of the sphere of radius 2α."""

from __future__ import annotations

import numpy as np

from pcmc import Patch, Surface
from pcmc.arrays import Floats, Ints
from pcmc.errors import OptionError

from .building import Builder
from .exact import Exact, Sphere
from .options import positive
from .strips import numbered, strips


def spherical_cap(
    edge_length: float = 0.1,
    *,
    radius: float = 1.0,
    alpha: float = 0.6,
    height: float | None = None,
    exact: bool = False,
) -> Surface:
    """A patch with a fixed circle on Π, starting as a dome of another height than at rest.

    Its equilibrium, for α ≥ radius/2, is `spherical_cap_exact`.

    Parameters
    ----------
    edge_length, radius : lengths; there are radius / edge_length rings, ring k of 6 k segments.
    alpha : tension of "cap", force/length.
    height : of the initial dome, a part of a sphere; 0.3 radius unless given. It may exceed the
        radius: more than a hemisphere.
    exact : put the vertices on the exact solution instead.

    Raises
    ------
    OptionError
        With ``exact`` where α < radius/2, since there is no solution.

    >>> surface = spherical_cap(0.25, exact=True)
    >>> bool(abs(surface.vertices[0, 2] - spherical_cap_exact().height) < 1e-12)
    True
    """
    edge_length, radius = positive(edge_length, "edge_length"), positive(radius, "radius")
    if exact:
        height = spherical_cap_exact(radius=radius, alpha=alpha).height
    dome = 0.3 * radius if height is None else positive(height, "height")
    ball = (radius**2 + dome**2) / (2.0 * dome)
    opening = 2.0 * np.arctan2(dome, radius)  # from the pole to the rim, seen from the centre
    rings = max(2, round(radius / edge_length))
    directions, faces = cap(opening, _six_per_ring(rings))
    points = ball * directions + [0.0, 0.0, dome - ball]
    rim = np.arange(len(points) - 6 * rings, len(points))
    points[rim, 2] = 0.0
    mesh = Builder()
    mesh.faces(mesh.points(points)[faces], 0)
    return mesh.surface([Patch("cap", alpha)], fixed=rim)


def spherical_cap_exact(*, radius: float = 1.0, alpha: float = 0.6) -> Exact:
    """The sphere of radius 2α through the circle: height h = 2α - √(4α² - radius²).

    A = 4π α h and V = π h² (6α - h) / 3. The lower of the two branches, which is the stable one.

    >>> cap = spherical_cap_exact()
    >>> round(cap.energy, 10), round(cap.height, 10)
    (1.5039191689, 0.5366750419)
    """
    radius, alpha = positive(radius, "radius"), positive(alpha, "alpha")
    if 2.0 * alpha < radius:
        raise OptionError(
            f"alpha must be at least radius/2 = {radius / 2:g}, found {alpha:g}: below the"
            " hemisphere's tension a cap has no equilibrium"
        )
    h = 2.0 * alpha - float(np.sqrt(4.0 * alpha**2 - radius**2))
    area = 4.0 * np.pi * alpha * h
    volume = np.pi * h**2 * (6.0 * alpha - h) / 3.0
    ball = Sphere((0.0, 0.0, h - 2.0 * alpha), 2.0 * alpha)
    return Exact(alpha * area - volume, area, volume, h, {"cap": ball})


def cap(opening: float, segments: Ints) -> tuple[Floats, Ints]:
    """Directions (k,3) and faces of a cap about +z, in rings of equal width from pole to rim.

    Parameters
    ----------
    opening : angle between the pole and the rim, seen from the centre.
    segments : (r,) segments of each ring; the last ring's vertices come last.

    >>> directions, faces = cap(np.pi / 2, np.array([6, 12]))
    >>> len(directions), len(faces), directions[0].tolist()
    (19, 24, [0.0, 0.0, 1.0])
    """
    rings = len(segments)
    ring, step = numbered(segments)
    theta = opening * (1 + ring) / rings
    phi = 2.0 * np.pi * step / segments[ring]
    around = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], 1)
    first = 1 + np.cumsum(segments) - segments
    line, step = numbered(segments + 1)
    closed = first[line] + step % segments[line]
    faces = strips(np.append(0, closed), np.append(0, segments))
    return np.concatenate([[[0.0, 0.0, 1.0]], around]), faces


def _six_per_ring(rings: int) -> Ints:
    return 6 * np.arange(1, rings + 1)
