"""Unduloids and nodoids: the other surfaces of revolution of constant mean curvature."""

from __future__ import annotations

import numpy as np
from scipy.integrate import cumulative_simpson
from scipy.optimize import brentq

from pcmc import Patch, Surface
from pcmc.base import validate
from pcmc.base.arrays import Floats

from .exact import ExactSolution
from .revolution import SAMPLES, Meridian, swollen, tube

CENTRES = {"bulge": 0.5 * np.pi, "neck": -0.5 * np.pi}


def delaunay(
    edge_length: float = 0.3,
    *,
    waviness: float = 0.4,
    centre: str = "bulge",
    reach: float = 1.2,
    alpha: float = 1.0,
    exact: bool = False,
) -> Surface:
    """A piece of Delaunay's surfaces about z between two fixed rings, under unit pressure.

    With B = ``waviness`` and lengths in units of α (mean curvature 1 / (2α)), s the arc length:

        r² = 1 + B² + 2 B sin s,    dz/ds = (1 + B sin s) / r

    B = 0 is the cylinder, 0 < B < 1 an unduloid, B > 1 a nodoid; the neck is at s = -π/2, the bulge at
    π/2. (Delaunay 1841; this form is Kenmotsu's, Tôhoku Math. J. 32, 1980.)

    Parameters
    ----------
    edge_length : length.
    waviness : B ≥ 0, not 1 (a chain of spheres).
    centre : "bulge" or "neck", in the middle of the piece, at z = 0.
    reach : arc length from there to either ring, in units of α; less than π.
    alpha : tension of "tube", force/length.
    exact : put the vertices on the surface; otherwise the free ones are 1 % farther out.

    >>> surface = delaunay(exact=True)
    >>> bool(delaunay_exact().distance(surface).max() < 1e-6)
    True
    """
    edge_length = validate.positive("edge_length", edge_length)
    surface = tube(_meridian(waviness, centre, reach, alpha), edge_length, Patch("tube", alpha))
    return surface if exact else swollen(surface)


def delaunay_exact(
    *, waviness: float = 0.4, centre: str = "bulge", reach: float = 1.2, alpha: float = 1.0
) -> ExactSolution:
    """A and V by Simpson's rule along the meridian; the index counts the zeros of Jacobi's equation.

    >>> cylinder = delaunay_exact(waviness=0.0, reach=1.0)
    >>> round(cylinder.area / np.pi, 9), cylinder.index
    (4.0, 0)
    >>> [delaunay_exact(centre="neck", reach=reach).index for reach in (0.9, 1.2)]
    [0, 1]
    """
    return _meridian(waviness, centre, reach, alpha).solution("tube", alpha, 1.0)


def delaunay_force(*, waviness: float = 0.4, alpha: float = 1.0) -> float:
    """2παr cos φ - πpr², the axial force that is the same at every height: πα² (1 - B²), force.

    >>> delaunay_force(waviness=0.0) == np.pi
    True
    """
    waviness = validate.number("waviness", waviness, least=0.0)
    return float(np.pi * validate.positive("alpha", alpha) ** 2 * (1.0 - waviness**2))


def delaunay_limit(*, waviness: float = 0.4, alpha: float = 1.0) -> float:
    """Arc length from the neck to either ring at which an unduloid's index turns from 0 to 1.

    There the change of the meridian with B has no normal part: a Jacobi field that vanishes on both
    rings. For B → 0 it is πα/2, half the cylinder's.

    >>> round(delaunay_limit(waviness=1e-4), 3)
    1.571
    """
    B = validate.number("waviness", waviness, above=0.0, below=1.0)

    def across(reach: float) -> float:
        s = np.linspace(-0.5 * np.pi, reach - 0.5 * np.pi, 2001)
        sine = np.sin(s)
        r = np.sqrt(1.0 + B * B + 2.0 * B * sine)
        r_B, r_s, z_s = (B + sine) / r, B * np.cos(s) / r, (1.0 + B * sine) / r
        z_B = cumulative_simpson(sine / r - (1.0 + B * sine) * (B + sine) / r**3, x=s, initial=0.0)
        return float((r_B * z_s - z_B * r_s)[-1])

    return float(validate.positive("alpha", alpha) * brentq(across, 0.05, 2.5))


def unduloid_length(waviness: float) -> float:
    """Distance between two rings of radius 1 that a bulge spans (B > 0), or a neck (B < 0); α = 1.

    On the ring sin s = -B/2. To first order it is π + B: the branch that leaves the cylinder of
    length π, where unduloids and cylinders exchange their stability.

    >>> round(unduloid_length(1e-4) - np.pi, 7)
    0.0001
    """
    B = validate.number("waviness", waviness, above=-1.0, below=1.0)
    turn = float(np.arcsin(0.5 * B))
    s = np.linspace(-turn, np.pi + turn, SAMPLES)
    _, rise = _radius_and_rise(B, s)
    return float(cumulative_simpson(rise, x=s)[-1])


def _meridian(waviness: float, centre: str, reach: float, alpha: float) -> Meridian:
    B = validate.number("waviness", waviness, least=0.0)
    if B == 1.0:
        validate.refuse(
            "waviness", waviness, "a number other than 1, where the surface is a chain of spheres"
        )
    middle = CENTRES[validate.choice("centre", centre, tuple(CENTRES))]
    reach = validate.number("reach", reach, above=0.0, below=np.pi)
    alpha = validate.positive("alpha", alpha)
    s = np.linspace(middle - reach, middle + reach, SAMPLES)
    r, rise = _radius_and_rise(B, s)
    z = cumulative_simpson(rise, x=s, initial=0.0)
    return Meridian(alpha * r, alpha * (z - 0.5 * z[-1]), 2.0 * alpha * reach)


def _radius_and_rise(B: float, s: Floats) -> tuple[Floats, Floats]:
    """r and dz/ds at arc lengths s."""
    r = np.sqrt(1.0 + B * B + 2.0 * B * np.sin(s))
    return r, (1.0 + B * np.sin(s)) / r
