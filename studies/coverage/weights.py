"""Strips, barrels and domes that weigh something, for the study ``coverage``: their profiles by shooting."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import simpson, solve_ivp
from scipy.optimize import brentq

from generators import barrel
from generators.revolution import SAMPLES, Meridian
from pcmc import Patch, Plane, Surface
from pcmc.base.arrays import Floats

from ..gallery.closed_forms import Case, Quantity
from .meshes import disc, grid, one_patch


def _profile(alpha: float, pressure: float, weight: float, half: float, round_plan: bool) -> Meridian:
    """The meridian of a strip or a dome of weight w over |x| ≤ half, held at z = 0, from its top.

    With the angle φ of its slope, (α + w z)(κ + κ') = p - w cos φ, κ = dφ/ds and κ' = sin φ / r in a dome,
    0 in a strip. The height of the top is that for which it comes down to z = 0 at x = half.
    """

    def right(s: float, y: Floats) -> list[float]:
        x, z, slope = y
        bend = (pressure - weight * np.cos(slope)) / (alpha + weight * z)
        around = (np.sin(slope) / x if x > 1e-12 else 0.5 * bend) if round_plan else 0.0
        return [np.cos(slope), -np.sin(slope), bend - around]

    class Reached:
        """The end of the curve."""

        terminal = True

        def __call__(self, s: float, y: Floats) -> float:
            return float(y[0] - half)

    def down(top: float) -> Any:
        return solve_ivp(
            right,
            (0.0, 4.0 * half),
            [0.0, top, 0.0],
            events=Reached(),
            rtol=1e-12,
            atol=1e-13,
            dense_output=True,
        )

    guess = (pressure - weight) * half**2 / (4.0 if round_plan else 2.0) / alpha
    ends = sorted((0.3 * guess, 1.6 * guess))
    top = brentq(lambda h: float(down(h).y[1, -1]), ends[0], ends[1], xtol=1e-14, rtol=1e-14)
    run = down(top)
    length = float(run.t[-1])
    r, z, _ = run.sol(np.linspace(0.0, length, SAMPLES))
    return Meridian(r, z, length)


def _weighed(curve: Meridian, alpha: float, p: float, w: float, measure: Floats) -> dict[str, float]:
    """Area, volume and energy from a profile and the length of the surface across it at each point."""
    step = curve.length / (len(curve.r) - 1)
    area = float(simpson(measure, dx=step))
    volume = float(simpson(curve.z * measure * curve.tangent[:, 0], dx=step))
    lifted = float(simpson(curve.z * measure, dx=step))
    return {"area": area, "volume": volume, "energy": alpha * area + w * lifted - p * volume}


def domes() -> Iterator[Case]:
    """Heavy domes over the unit disc, on random meshes."""
    for alpha, p, w in (
        (1.0, 1.0, 0.3),
        (1.0, 1.2, 0.6),
        (0.8, 1.0, 0.5),
        (1.0, 0.0, 0.5),
        (2.0, 0.5, 1.5),
        (1.5, 2.0, 1.0),
    ):
        curve = _profile(alpha, p, w, 1.0, True)
        found = _weighed(curve, alpha, p, w, 2.0 * np.pi * curve.r)
        values: dict[Quantity, float] = {("area", "dome"): found["area"]}
        values["volume", ""], values["energy", ""] = found["volume"], found["energy"]
        if curve.z[0] > 0.0:
            values["height", "dome"] = float(curve.z[0])
        values["reaction", ""] = w * found["area"] - p * np.pi
        for edge in (0.35, 0.25, 0.18):
            start = partial(_dome, edge, Patch("dome", alpha, p, weight=w), curve, round(100 * edge))
            yield Case("heavy dome", f"α {alpha:g}, p {p:g}, w {w:g}, edge {edge:g}", start, values)


def _dome(edge: float, patch: Patch, curve: Meridian, seed: int) -> Surface:
    plan, faces, rim = disc(edge, seed)
    z = np.asarray(np.interp(np.hypot(*plan.T), curve.r, curve.z))
    z[rim] = 0.0
    return one_patch(np.column_stack([plan, z]), faces, patch, rim)


def barrels() -> Iterator[Case]:
    """Heavy barrels under pressure between mirror planes."""
    for alpha, p, w in (
        (2.0, 1.0, 0.3),
        (1.5, 1.0, 0.5),
        (2.0, 1.5, 0.5),
        (1.2, 0.9, 0.2),
        (3.0, 2.0, 1.0),
        (1.5, 1.2, 0.9),
    ):
        curve = _profile(alpha, p, w, 1.0, False)
        found = _weighed(curve, alpha, p, w, np.full(len(curve.r), 2.0))
        values = _strip_values(found, curve, p, w)
        for n in (6, 9, 13):
            start = partial(barrel, n, alpha=alpha, pressure=p, weight=w, length=1.0, rise=float(curve.z[0]))
            yield Case("heavy barrel", f"α {alpha:g}, p {p:g}, w {w:g}, {n} squares", start, values)


def _strip_values(found: dict[str, float], curve: Meridian, p: float, w: float) -> dict[Quantity, float]:
    values: dict[Quantity, float] = {("area", "vault"): found["area"]}
    values["volume", ""], values["energy", ""] = found["volume"], found["energy"]
    values["reaction", ""] = w * found["area"] - 2.0 * p
    if curve.z[0] > 0.0:
        values["height", "vault"] = float(curve.z[0])
    return values


def strips() -> Iterator[Case]:
    """Strips that hang or stand by their weight alone: α/w + z = a cosh(x/a); uneven meshes."""
    for alpha, w in ((2.0, 0.5), (2.0, 1.0), (2.0, 1.2), (1.0, 0.4)):
        a = brentq(lambda a, q=alpha / w: a * np.cosh(1.0 / a) - q, 0.9, 50.0, xtol=1e-15)
        s = np.linspace(0.0, a * np.sinh(1.0 / a), SAMPLES)
        curve = Meridian(a * np.arcsinh(s / a), np.hypot(a, s) - alpha / w, float(s[-1]))
        found = _weighed(curve, alpha, 0.0, w, np.full(len(s), 2.0))
        values = _strip_values(found, curve, 0.0, w)
        for n in (6, 9, 13):
            for jitter in (0.0, 0.4):
                start = partial(_strip, n, jitter, Patch("vault", alpha, 0.0, weight=w), curve)
                yield Case(
                    "heavy strip", f"α {alpha:g}, w {w:g}, {n} squares, moved {jitter:g}", start, values
                )


def _strip(n: int, jitter: float, patch: Patch, curve: Meridian) -> Surface:
    """A piece of length 1 between mirror planes y = 0 and y = 1."""
    u, v, faces, _ = grid(n, max(2, round(0.5 * n)), jitter, n)
    x = 2.0 * u - 1.0
    X = np.stack([x, v, np.interp(np.abs(x), curve.r, curve.z)], axis=1)
    held = np.abs(x) == 1.0
    X[held, 2] = 0.0
    ends = tuple(
        (Plane((0.0, y, 0.0), (0.0, 1.0, 0.0), name, mirror=True), v == y)
        for y, name in ((0.0, "front"), (1.0, "back"))
    )
    return one_patch(X, faces, patch, held, on_planes=ends)
