"""Closed forms unlike those in ``closed_forms``, for the study ``coverage``.

Minimal surfaces with boundaries that are no circles (helicoids, pieces of Scherk's), tubes between unequal
rings, strips, barrels and domes that weigh something, double bubbles with unequal pressures, wedges between
mirror planes, and uneven meshes with moved vertices. The seeds of all random meshes are fixed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import cumulative_simpson
from scipy.optimize import fsolve

from generators import double_bubble
from generators.revolution import SAMPLES, Meridian, tube
from generators.strips import strips as strip_faces
from pcmc import Patch, Plane, Surface
from pcmc.base.arrays import Floats

from ..gallery.closed_forms import Case, Quantity, cap_values
from .meshes import disc, one_patch, sheet
from .weights import barrels, domes, strips


def cases() -> Iterator[Case]:
    """All closed forms on all meshes."""
    families = (helicoids, scherk, _tubes, domes, barrels, strips, _bubbles, wedges, random_caps)
    for family in families:
        yield from family()


def _gauss(f: Callable[[Floats, Floats], Floats], x: tuple[float, float], y: tuple[float, float]) -> float:
    """∫∫ f dx dy by 80 x 80 Gauss points."""
    t, w = np.polynomial.legendre.leggauss(80)
    (px, wx), (py, wy) = ((0.5 * (a + b) + 0.5 * (b - a) * t, 0.5 * (b - a) * w) for a, b in (x, y))
    return float(wx @ f(px[:, None], py[None, :]) @ wy)


# ---- minimal surfaces ----------------------------------------------------------------------------


def helicoids() -> Iterator[Case]:
    """(r cos θ, r sin θ, cθ) for a ≤ r ≤ b, 0 ≤ θ ≤ turn: area turn ∫ √(r² + c²) dr."""
    for k, (pitch, turn, inner) in enumerate(
        [
            (0.3, 1.5, 0.2),
            (0.5, 2.5, 0.0),
            (1.0, 2.0, 0.3),
            (0.7, 3.0, 0.5),
            (1.5, 1.0, 0.1),
            (0.4, 2.0, -0.6),
        ]
    ):
        outer = 1.2

        def chart(
            u: Floats, v: Floats, pitch: float = pitch, turn: float = turn, inner: float = inner
        ) -> Floats:
            r, t = inner + (1.2 - inner) * u, turn * v
            return np.stack([r * np.cos(t), r * np.sin(t), pitch * t], axis=1)

        def primitive(r: float, c: float = pitch) -> float:
            return 0.5 * (r * np.hypot(r, c) + c * c * np.arcsinh(r / c))

        area = turn * (primitive(outer) - primitive(inner))
        values = {("area", "film"): area, ("energy", ""): area}
        values["volume", ""] = 0.25 * pitch * turn**2 * (outer**2 - inner**2)
        for n in (5, 7, 10):
            for jitter in (0.0, 0.4):
                start = partial(sheet, chart, n, round(1.2 * n), Patch("film", 1.0, 0.0), jitter, 10 * k + n)
                name = f"c {pitch:g}, turn {turn:g}, from {inner:g}, {n} squares, moved {jitter:g}"
                yield Case("helicoid", name, start, values)


def scherk() -> Iterator[Case]:
    """z = log(cos x / cos y) over rectangles: W² = 1 + tan² x + tan² y."""
    for k, (x, y) in enumerate(
        [
            ((-1.2, 1.2), (-1.2, 1.2)),
            ((-1.0, 1.0), (-0.8, 0.8)),
            ((-0.3, 1.3), (-0.9, 0.9)),
            ((0.1, 1.35), (0.2, 1.2)),
            ((-1.4, 1.4), (-1.3, 1.3)),
        ]
    ):

        def chart(u: Floats, v: Floats, x: Any = x, y: Any = y) -> Floats:
            px, py = x[0] + (x[1] - x[0]) * u, y[0] + (y[1] - y[0]) * v
            return np.stack([px, py, np.log(np.cos(px) / np.cos(py))], axis=1)

        area = _gauss(lambda a, b: np.sqrt(1.0 + np.tan(a) ** 2 + np.tan(b) ** 2), x, y)
        values = {("area", "film"): area, ("energy", ""): area}
        volume = _gauss(lambda a, b: np.log(np.cos(a) / np.cos(b)), x, y)
        if abs(volume) > 1e-9:
            values["volume", ""] = volume
        for n in (6, 9, 12):
            for jitter in (0.0, 0.4):
                start = partial(sheet, chart, n, n, Patch("film", 1.0, 0.0), jitter, 10 * k + n)
                corners = (0, n, n * (n + 1), n * (n + 2))
                yield Case("Scherk", f"x {x}, y {y}, {n} squares, moved {jitter:g}", start, values, corners)


# ---- tubes between unequal rings -----------------------------------------------------------------


def _tubes() -> Iterator[Case]:
    """Delaunay's surfaces r² = 1 + B² + 2 B sin s and catenoids r = c cosh(z/c), cut at two unequal rings."""
    cuts = [
        ("unduloid", 0.3, (-0.4, 1.5)),
        ("unduloid", 0.5, (-1.0, 0.9)),
        ("unduloid", 0.7, (0.2, 2.6)),
        ("unduloid", 0.85, (-0.7, 0.4)),
        ("nodoid", 1.3, (0.0, 1.9)),
        ("nodoid", 1.8, (0.4, 2.2)),
        ("nodoid", 2.5, (0.6, 1.8)),
        ("nodoid", 4.0, (-0.3, 1.0)),
    ]
    for family, B, (begin, end) in cuts:
        s = np.linspace(begin, end, SAMPLES)
        r = np.sqrt(1.0 + B * B + 2.0 * B * np.sin(s))
        z = cumulative_simpson((1.0 + B * np.sin(s)) / r, x=s, initial=0.0)
        curve = Meridian(r, z, end - begin)
        values = {("area", "tube"): curve.area, ("volume", ""): curve.volume_below}
        values["energy", ""] = curve.area - curve.volume  # the paper's volume: of the cones from the origin
        yield from _ringed(family, f"B {B:g}, s {begin:g} to {end:g}", curve, 1.0, values)
    for c, low, high in ((1.0, -0.3, 0.7), (0.8, 0.0, 0.9), (0.6, -0.2, 0.6), (0.5, 0.1, 0.9)):
        t = np.linspace(c * np.sinh(low / c), c * np.sinh(high / c), SAMPLES)
        curve = Meridian(np.hypot(c, t), c * np.arcsinh(t / c) - low, t[-1] - t[0])
        values = {
            ("area", "tube"): curve.area,
            ("energy", ""): curve.area,
            ("volume", ""): curve.volume_below,
        }
        yield from _ringed("catenoid piece", f"c {c:g}, z {low:g} to {high:g}", curve, 0.0, values)


def _ringed(
    family: str, name: str, curve: Meridian, pressure: float, values: dict[Quantity, float]
) -> Iterator[Case]:
    for edge in (0.45, 0.33, 0.22):
        start = partial(tube, curve, edge, Patch("tube", 1.0, pressure))
        yield Case(family, f"{name}, edge {edge:g}", start, values)


# ---- bubbles and wedges --------------------------------------------------------------------------


def _bubbles() -> Iterator[Case]:
    """Double bubbles of prescribed volumes: three spherical caps on one rim, balanced there."""
    tensions = ((1.0, 1.0, 1.0), (1.0, 1.3, 1.2), (1.0, 0.8, 0.6))
    for left, right, wall in tensions:
        for ratio in (0.8, 0.6, 0.45):
            volumes = (10.0, 10.0 * ratio)
            values = _bubble_values((left, right, wall), volumes)
            given: dict[str, Any] = {"alpha_left": left, "alpha_right": right, "alpha_aux": wall}
            for edge in (0.6, 0.45):
                start = partial(double_bubble, edge, volumes=volumes, exact=False, **given)
                name = f"α {left:g}, {right:g}, {wall:g}, volumes 10 and {volumes[1]:g}, edge {edge:g}"
                yield Case("unequal double bubble", name, start, values)


def _bubble_values(alphas: tuple[float, float, float], volumes: tuple[float, float]) -> dict[Quantity, float]:
    """Caps of opening angles t over the rim of radius ρ: r = ρ / sin t, A = 2π r² (1 - cos t).

    V = π r³ (2 - 3 cos t + cos³ t) / 3. At the rim the tangents of the caps make the angles t_left and
    t_right with the rim's plane, the wall, which bends into the right bubble if positive, t_wall.
    Unknowns are the three angles and ρ.
    """
    left, right, wall = alphas

    def cap_volume(rho: float, t: float) -> float:
        c = np.cos(t)
        return float(np.pi * rho**3 * (2.0 - 3.0 * c + c**3) / (3.0 * np.sin(t) ** 3))

    def cap_area(rho: float, t: float) -> float:
        return float(2.0 * np.pi * rho**2 / (1.0 + np.cos(t)))

    def open_forms(y: Floats) -> list[float]:
        a, b, c, rho = y
        # tangents at the rim, pointing away from it into each cap; x from left to right, y inwards
        pull = np.array(
            [
                -left * np.sin(a) + right * np.sin(b) + wall * np.sin(c),
                left * np.cos(a) + right * np.cos(b) + wall * np.cos(c),
            ]
        )
        lens = cap_volume(rho, c)
        return [*pull, cap_volume(rho, a) + lens - volumes[0], cap_volume(rho, b) - lens - volumes[1]]

    a, b, c, rho = fsolve(open_forms, [2.0, 2.0, -0.1 if volumes[0] > volumes[1] else 0.1, 1.2], xtol=1e-12)
    assert np.abs(open_forms(np.array([a, b, c, rho]))).max() < 1e-9
    areas = [cap_area(rho, t) for t in (a, b, c)]
    pressures = 2.0 * left * np.sin(a) / rho, 2.0 * right * np.sin(b) / rho
    return {
        ("pressure", "left"): pressures[0],
        ("pressure", "right"): pressures[1],
        ("area", "left"): areas[0],
        ("area", "right"): areas[1],
        ("area", "wall"): areas[2],
        ("energy", ""): float(np.dot(alphas, areas) - np.dot(pressures, volumes)),
    }


def wedges() -> Iterator[Case]:
    """Sectors of caps between two upright mirror planes: p = 1, radius 2α, over a sector of the unit disc."""
    for degrees in (40.0, 75.0, 110.0, 150.0):
        for alpha in (0.55, 0.7, 1.5):
            angle, radius = np.radians(degrees), 2.0 * alpha
            top = radius - np.sqrt(radius**2 - 1.0)
            share = angle / (2.0 * np.pi)
            area, volume = 2.0 * np.pi * radius * top * share, np.pi * top**2 * (radius - top / 3.0) * share
            values = {
                ("height", "cap"): top,
                ("area", "cap"): area,
                ("volume", ""): volume,
                ("energy", ""): alpha * area - volume,
                ("reaction", ""): -np.pi * share,
            }
            for rings in (5, 8, 11):
                start = partial(_wedge, angle, rings, alpha)
                yield Case("wedge", f"{degrees:g}°, α {alpha:g}, {rings} rings", start, values)


def _wedge(angle: float, rings: int, alpha: float) -> Surface:
    segments = np.maximum(1, np.rint(angle * np.arange(1, rings + 1))).astype(np.int64)
    points, front, back = [np.zeros((1, 2))], [np.array([True])], [np.array([True])]
    for ring, count in enumerate(segments, start=1):
        turn = angle * np.arange(count + 1) / count
        points.append(ring / rings * np.stack([np.cos(turn), np.sin(turn)], axis=1))
        front.append(np.arange(count + 1) == 0)
        back.append(np.arange(count + 1) == count)
    plan = np.concatenate(points)
    rim = np.arange(len(plan)) >= len(plan) - segments[-1] - 1
    z = np.where(rim, 0.0, np.sqrt(4.0 * alpha**2 - (plan**2).sum(axis=1)) - np.sqrt(4.0 * alpha**2 - 1.0))
    faces = strip_faces(np.arange(len(plan)), np.append(0, segments))
    a, b, c = plan[faces[0]]
    if (b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0] < 0.0:
        faces = faces[:, ::-1]
    normals = ((0.0, 1.0, 0.0), (-np.sin(angle), np.cos(angle), 0.0))
    planes = tuple(
        (Plane((0.0, 0.0, 0.0), normal, name, mirror=True), np.concatenate(side))
        for normal, name, side in zip(normals, ("front", "back"), (front, back), strict=True)
    )
    return one_patch(np.column_stack([plan, z]), faces, Patch("cap", alpha), rim, on_planes=planes)


def random_caps() -> Iterator[Case]:
    """Caps over random triangulations of the disc, rims of uneven edges."""
    for alpha in (0.53, 0.65, 1.0, 4.0):
        values = {
            key: value for key, value in cap_values(alpha, "cap").items() if key[0] != "reaction per length"
        }
        for edge in (0.4, 0.28, 0.2):
            for seed in (1, 2):
                start = partial(_random_cap, edge, alpha, seed)
                yield Case("random cap", f"α {alpha:g}, edge {edge:g}, seed {seed}", start, values)


def _random_cap(edge: float, alpha: float, seed: int) -> Surface:
    plan, faces, rim = disc(edge, seed)
    z = np.sqrt(4.0 * alpha**2 - np.minimum((plan**2).sum(axis=1), 1.0)) - np.sqrt(4.0 * alpha**2 - 1.0)
    z[rim] = 0.0
    return one_patch(np.column_stack([plan, z]), faces, Patch("cap", alpha), rim)
