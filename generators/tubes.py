"""Cylinders and catenoids between two rings."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from pcmc import Patch, Surface
from pcmc.base import validate
from pcmc.base.errors import OptionError

from .exact import ExactSolution
from .revolution import SAMPLES, Meridian, swollen, tube

_TURN = brentq(lambda u: u * np.tanh(u) - 1.0, 1.0, 1.5, xtol=1e-15, rtol=1e-15)  # h/c of the widest catenoid


def cylinder(
    edge_length: float = 0.3,
    *,
    radius: float = 1.0,
    length: float = 2.0,
    alpha: float = 1.0,
    exact: bool = False,
) -> Surface:
    """A cylinder about z between two fixed rings, under the pressure α / radius that holds it.

    Its mean curvature is 1 / (2 radius). A motion sin(kπz/L) cos(mθ) has the second variation
    α ((kπ/L)² + (m² - 1)/radius²) per unit, so under given pressure the index grows by 1 at each
    L = kπ radius. (At given volume the first of these does not count: there Plateau and Rayleigh's
    2π radius is the limit. McCuan and others 1997 have both.)

    Parameters
    ----------
    edge_length, radius, length : lengths. A whole number of edges goes around.
    alpha : tension of "tube", force/length.
    exact : leave the vertices on the cylinder; otherwise the free ones are 1 % farther out.

    >>> surface = cylinder(exact=True)
    >>> bool(cylinder_exact().distance(surface).max() < 1e-12), surface.pressures.tolist()
    (True, [1.0])
    """
    meridian, pressure = _cylinder(radius, length, alpha)
    edge_length = validate.positive("edge_length", edge_length)
    surface = tube(meridian, edge_length, Patch("tube", alpha, pressure))
    return surface if exact else swollen(surface)


def cylinder_exact(*, radius: float = 1.0, length: float = 2.0, alpha: float = 1.0) -> ExactSolution:
    """A = 2π radius L; V = (2/3)π radius² L, the cylinder without the cones over its ends.

    The index is the number of k ≥ 1 with kπ radius < L.

    >>> found = cylinder_exact(length=7.0)
    >>> round(found.area / np.pi, 9), round(found.volume / np.pi, 9), found.index
    (14.0, 4.666666667, 2)
    """
    meridian, pressure = _cylinder(radius, length, alpha)
    return meridian.solution("tube", alpha, pressure, math.ceil(length / (np.pi * radius)) - 1)


def _cylinder(radius: float, length: float, alpha: float) -> tuple[Meridian, float]:
    radius = validate.positive("radius", radius)
    length = validate.positive("length", length)
    pressure = validate.positive("alpha", alpha) / radius
    return Meridian(np.full(SAMPLES, radius), np.linspace(0.0, length, SAMPLES), length), pressure


def catenoid(
    edge_length: float = 0.2,
    *,
    radius: float = 1.0,
    half_distance: float = 0.5,
    alpha: float = 1.0,
    deep: bool = False,
    half: bool = False,
    exact: bool = False,
) -> Surface:
    """The film without pressure between two fixed rings about z: r = c cosh(z/c), c cosh(h/c) = radius.

    For h < 0.6627434 radius there are two catenoids. The one with the wider neck is stable; the deep one
    has index 1. At h = 0.6627434 radius they meet (``catenoid_fold``); beyond it there is none. (Euler
    1744; Bliss 1925 for the index.)

    Parameters
    ----------
    edge_length, radius : lengths.
    half_distance : h, the rings are at z = ±h.
    alpha : tension of "film", force/length.
    deep : the catenoid with the narrower neck.
    half : only z ≥ 0, its neck free to slide on Π, which it meets at a right angle.
    exact : put the vertices on the catenoid; otherwise the free ones are 1 % farther out.

    >>> surface = catenoid(exact=True)
    >>> bool(catenoid_exact().distance(surface).max() < 1e-6)
    True
    """
    edge_length = validate.positive("edge_length", edge_length)
    alpha = validate.positive("alpha", alpha)
    meridian = _catenoid(radius, half_distance, deep, half)
    surface = tube(meridian, edge_length, Patch("film", alpha, pressure=0.0), neck_slides=half)
    return surface if exact else swollen(surface)


def catenoid_exact(
    *,
    radius: float = 1.0,
    half_distance: float = 0.5,
    alpha: float = 1.0,
    deep: bool = False,
    half: bool = False,
) -> ExactSolution:
    """A = π c² (2h/c + sinh(2h/c)), or half of that with ``half``; the index is 0, or 1 if ``deep``.

    >>> wide, deep = catenoid_exact(), catenoid_exact(deep=True)
    >>> round(wide.area, 6), round(deep.area, 6), wide.index, deep.index
    (5.991797, 6.845655, 0, 1)
    """
    meridian = _catenoid(radius, half_distance, deep, half)
    return meridian.solution("film", validate.positive("alpha", alpha), 0.0, int(deep))


def catenoid_neck(*, radius: float = 1.0, half_distance: float = 0.5, deep: bool = False) -> float:
    """The neck's radius c, with c cosh(h/c) = radius: the larger one, or the smaller one if ``deep``.

    Raises
    ------
    OptionError
        For h > 0.6627434 radius: the rings are too far apart.

    >>> round(catenoid_neck(half_distance=0.5), 9), round(catenoid_neck(deep=True), 9)
    (0.848337938, 0.23509499)
    """
    radius = validate.positive("radius", radius)
    h = validate.positive("half_distance", half_distance)
    if h > catenoid_fold(radius):
        raise OptionError(
            f"half_distance must be at most 0.6627434 radius = {catenoid_fold(radius):g}, found {h:g}:"
            " between rings farther apart there is no catenoid",
            what="half_distance",
            found=h,
            expected=catenoid_fold(radius),
        )
    low, high = (1e-3 * h, h / _TURN) if deep else (h / _TURN, radius)
    return float(brentq(lambda c: c * np.cosh(min(h / c, 700.0)) - radius, low, high, xtol=1e-15))


def catenoid_fold(radius: float = 1.0) -> float:
    """The half-distance of the rings at which both catenoids meet: radius / sinh(u), u tanh u = 1.

    >>> round(catenoid_fold(), 15)
    0.662743419349182
    """
    return float(radius / np.sinh(_TURN))


def _catenoid(radius: float, half_distance: float, deep: bool, half: bool) -> Meridian:
    c = catenoid_neck(radius=radius, half_distance=half_distance, deep=deep)
    reach = c * np.sinh(half_distance / c)  # arc length from the neck
    s = np.linspace(0.0 if half else -reach, reach, SAMPLES)
    z = c * np.arcsinh(s / c)
    z[[0, -1]] = (0.0 if half else -half_distance), half_distance
    return Meridian(np.hypot(c, s), z, s[-1] - s[0])
