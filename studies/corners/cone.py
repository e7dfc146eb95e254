"""The tangent cone at a corner of Example 2, where a crest and two outlines meet on the plane Π.

Close to the corner pressure and curvature no longer count: what is left is a cone of flat sectors, or on
the sphere around the corner a network of great-circle arcs. Two arcs join the crest's direction c to the
outlines' directions on the equator Π, one goes from c straight down to the equator: Fermat's problem,

    f(c) = α_1 d(c, e_1) + α_2 d(c, e_2) + α_w height(c),    stationary where  Σ α t = 0.

The arcs leave c at the angles ψ_1, ψ_2 from straight up that the tensions alone fix (7); going up and
over, each comes down to the equator π - atan2(sin h sin ψ, cos ψ) away, h the height of c. Both
together must span the opening of the corner, which gives h.

Displacements of the crest near the corner are r^ν g, g'' = -ν² g on the arcs, with the balance at c. A ν
below 1 means a slope that grows towards the corner: the crest does not come to the cone, but away from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from pcmc.base.arrays import Floats


@dataclass(frozen=True)
class Cone:
    """A balanced cone: angles in radians.

    Attributes
    ----------
    height : of the crest over Π.
    azimuths : (2,) of the crest in plan from each of the outlines, through the inside.
    arcs : (3,) lengths of the two sheets' arcs and the wall's, on the unit sphere.
    angles : (3,) directions of the arcs at the crest, from straight up; the wall's is π.
    length : f, the weighted length.
    slip : f where the crest lies along the first outline, and along the second.
    exponent : smallest ν.
    """

    height: float
    azimuths: tuple[float, float]
    arcs: tuple[float, float, float]
    angles: tuple[float, float, float]
    length: float
    slip: tuple[float, float]
    exponent: float


def cone(tensions: tuple[float, float, float], opening: float) -> Cone | None:
    """The balanced cone of sheets of tensions α_1, α_2 and a wall of tension α_w; None without one.

    Parameters
    ----------
    tensions : α_1, α_2, α_w.
    opening : of the corner, through the inside, radians; more than π.

    >>> found = cone((4.0, 3.0, 4.0), math.radians(284.4))
    >>> round(math.degrees(found.height)), found.exponent < 1.0
    (29, True)
    """
    one, two, wall = tensions
    if not abs(one - two) < wall < one + two:
        return None
    up = (_angle(one, wall, two), -_angle(two, wall, one))
    rest = 2.0 * math.pi - opening

    def over(height: float) -> float:
        return sum(_reach(height, angle) for angle in up) - rest

    low, high = 1e-9, 0.5 * math.pi - 1e-9
    if over(low) * over(high) > 0.0:
        return None
    height = float(brentq(over, low, high))
    angles = (up[0], up[1], math.pi)
    azimuths = (math.pi - _reach(height, up[0]), math.pi - _reach(height, up[1]))
    sheets = [math.acos(math.cos(height) * math.cos(azimuth)) for azimuth in azimuths]
    arcs = (sheets[0], sheets[1], height)
    return Cone(
        height,
        azimuths,
        arcs,
        angles,
        float(np.dot(tensions, arcs)),
        (two * min(rest, opening), one * min(rest, opening)),
        _exponent(tensions, arcs, angles),
    )


def _angle(one: float, wall: float, other: float) -> float:
    """Of a sheet from straight up, where three tensions balance and the wall hangs down."""
    return math.acos((wall**2 + one**2 - other**2) / (2.0 * wall * one))


def _reach(height: float, angle: float) -> float:
    """By how much less than π in azimuth an arc comes down to the equator."""
    return math.atan2(math.sin(height) * math.sin(abs(angle)), math.cos(angle))


def _exponent(
    tensions: tuple[float, float, float], arcs: tuple[float, float, float], angles: tuple[float, float, float]
) -> float:
    """Smallest ν > 0 for which a displacement r^ν g is in balance at the crest."""
    normals = np.array([[math.cos(angle), -math.sin(angle)] for angle in angles])

    def lowest(nu: float) -> float:
        held = [a * nu / math.tan(nu * d) for a, d in zip(tensions[:2], arcs[:2], strict=True)]
        pull: Floats = np.array([*held, -tensions[2] * nu * math.tan(nu * arcs[2])])
        return float(np.linalg.eigvalsh((normals.T * pull) @ normals)[0])

    # up to the first pole the smallest eigenvalue falls from a positive value
    pole = min(math.pi / arcs[0], math.pi / arcs[1], 0.5 * math.pi / arcs[2])
    return float(brentq(lowest, 1e-6, pole * (1.0 - 1e-9)))
