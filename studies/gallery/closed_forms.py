"""Closed forms on many meshes: starts, and the exact values of what a designer reads from them.

Round boundaries have ten edges or more: at a polygon of fewer the mesh check sees corners.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.special import lpmv

from generators import (
    catenoid,
    catenoid_exact,
    cylinder,
    cylinder_exact,
    delaunay,
    delaunay_exact,
    double_bubble,
    double_bubble_exact,
    enneper,
    enneper_exact,
    hemisphere,
    hemisphere_exact,
    joined_caps,
    joined_caps_exact,
    lens,
    lens_exact,
    skew_quadrilateral,
    skew_quadrilateral_exact,
    sphere,
    sphere_exact,
    spherical_cap,
    spherical_cap_exact,
)
from generators.exact import ExactSolution
from generators.revolution import Meridian
from generators.ring_mesh import disc_points, ring_mesh
from generators.strips import strips
from pcmc import Patch, Surface
from pcmc.base.arrays import Bools, Floats, Ints
from pcmc.plan import Plan

Quantity = tuple[str, str]  # its name, and the patch it belongs to
TENSE = 1e4  # tension at which a roof over a plan of size 1 solves Poisson's equation to 1e-9


@dataclass(frozen=True)
class Case:
    """A closed form on one mesh.

    Attributes
    ----------
    family, name : what it is, and its parameters.
    start : builds a surface near it.
    exact : values of quantities of a mesh check.
    corners : vertices at which the boundary has corners of less than 40°, which no mesh tells from curves.
    """

    family: str
    name: str
    start: Callable[[], Surface]
    exact: Mapping[Quantity, float]
    corners: tuple[int, ...] = ()


def cases() -> Iterator[Case]:
    """All closed forms on all meshes."""
    for family in (_caps, _round_plans, _bubbles, _joined, _tubes, _lenses, _wires, _ellipses, _sectors):
        yield from family()


def _caps() -> Iterator[Case]:
    for alpha in (0.505, 0.52, 0.55, 0.6, 0.75, 1.0, 2.0, 5.0):
        for edge in (0.35, 0.25, 0.2, 0.15, 0.1):
            start = partial(spherical_cap, edge, alpha=alpha)
            yield Case("cap", f"α {alpha:g}, edge {edge:g}", start, cap_values(alpha, "cap"))


def _round_plans() -> Iterator[Case]:
    """Caps again, over unstructured meshes whose top is no vertex."""
    circle = {"circle": {"centre": [0.3, 0.1], "radius": 1.0}}
    for alpha in (0.52, 0.6, 1.0, 3.0):
        for edge in (0.4, 0.3, 0.2, 0.13):
            start = Plan(circle, tension=alpha, edge_length=edge).surface
            yield Case("round plan", f"α {alpha:g}, edge {edge:g}", start, cap_values(alpha, "patch 1"))


def cap_values(alpha: float, patch: str) -> dict[Quantity, float]:
    """Of a cap over the unit disc; its eigenvalue is α (ν (ν + 1) - 2) / 4α², with P_ν zero at the rim."""
    exact, rim = spherical_cap_exact(alpha=alpha), np.sqrt(1.0 - 0.25 / alpha**2)
    degrees = np.linspace(1.0001, 60.0, 3000)
    first = int(np.flatnonzero(np.diff(np.sign(lpmv(0, degrees, rim))))[0])
    degree = brentq(lambda nu: lpmv(0, nu, rim), degrees[first], degrees[first + 1])
    return {
        ("height", patch): exact.height,
        ("area", patch): exact.area,
        ("reaction", ""): -np.pi,
        ("reaction per length", patch): alpha,
        ("lowest eigenvalue", ""): 0.25 * (degree * (degree + 1.0) - 2.0) / alpha,
        **_whole(exact),
    }


def _whole(exact: ExactSolution) -> dict[Quantity, float]:
    both = {("energy", ""): exact.energy, ("volume", ""): exact.volume}
    return {quantity: value for quantity, value in both.items() if value != 0.0}


def _bubbles() -> Iterator[Case]:
    for alpha in (0.3, 1.0, 2.0):
        ball, half = sphere_exact(alpha=alpha), hemisphere_exact(alpha=alpha)
        for edge in (0.45, 0.3, 0.2, 0.15):
            values = {("area", "bubble"): ball.area, ("lowest eigenvalue", ""): -0.5 / alpha, **_whole(ball)}
            start = partial(sphere, 2.0 * alpha * edge, alpha=alpha)
            yield Case("sphere", f"α {alpha:g}, edge {2 * alpha * edge:g}", start, values)
            values = {("area", "bubble"): half.area, ("lowest eigenvalue", ""): -0.5 / alpha, **_whole(half)}
            start = partial(hemisphere, 2.0 * alpha * edge, alpha=alpha)
            yield Case("hemisphere", f"α {alpha:g}, edge {2 * alpha * edge:g}", start, values)
    for left, right, wall in ((1.0, 1.0, 1.0), (1.0, 1.3, 1.2), (1.0, 0.8, 1.5)):
        tensions: dict[str, Any] = {"alpha_left": left, "alpha_right": right, "alpha_aux": wall}
        for edge in (0.8, 0.6, 0.4):
            start = partial(double_bubble, edge, exact=False, **tensions)
            values = _whole(double_bubble_exact(**tensions))
            yield Case("double bubble", f"α {left:g}, {right:g}, {wall:g}, edge {edge:g}", start, values)


def _joined() -> Iterator[Case]:
    for left, right, wall, depth in ((4, 3, 3, 4.5), (4, 4, 3, 4.5), (5, 4, 3, 6), (6, 4, 4, 7)):
        given = {"alpha_left": left, "alpha_right": right, "alpha_aux": wall, "depth": depth}
        exact = joined_caps_exact(**given)
        for edge in (1.2, 0.9, 0.7):
            name = f"α {left:g}, {right:g}, {wall:g}, depth {depth:g}, edge {edge:g}"
            start = partial(joined_caps, edge, exact=False, **given)
            yield Case("joined caps", name, start, _whole(exact))


def _tubes() -> Iterator[Case]:
    for length in (2.0, 2.7, 4.0, 5.3):
        around = cylinder_exact(length=length)
        values = {
            ("area", "tube"): around.area,
            ("lowest eigenvalue", ""): (np.pi / length) ** 2 - 1.0,
            ("energy", ""): around.energy,
        }
        for edge in (0.45, 0.35, 0.25):
            yield Case(
                "cylinder",
                f"length {length:g}, edge {edge:g}",
                partial(cylinder, edge, length=length),
                values,
            )
    for half, deep in ((0.2, False), (0.35, False), (0.5, False), (0.6, False), (0.5, True), (0.6, True)):
        film = catenoid_exact(half_distance=half, deep=deep)
        for edge in (0.4, 0.3, 0.2):
            start = partial(catenoid, edge, half_distance=half, deep=deep)
            kind = "deep, " if deep else ""
            yield Case("catenoid", f"{kind}h {half:g}, edge {edge:g}", start, {("area", "film"): film.area})
    bulges = ((0.2, "bulge", 1.0), (0.4, "bulge", 1.2), (0.7, "bulge", 1.0), (1.5, "bulge", 1.2))
    for waviness, centre, reach in (*bulges, (0.4, "neck", 0.6)):
        exact = delaunay_exact(waviness=waviness, centre=centre, reach=reach)
        curve = exact.shapes["tube"]
        assert isinstance(curve, Meridian)
        values = {("area", "tube"): exact.area, ("energy", ""): exact.energy}
        values["volume", ""] = curve.volume_below
        for edge in (0.35, 0.25, 0.18):
            start = partial(delaunay, edge, waviness=waviness, centre=centre, reach=reach)
            yield Case("Delaunay", f"B {waviness:g}, {centre}, edge {edge:g}", start, values)


def _lenses() -> Iterator[Case]:
    for top, bottom, film in ((1.0, 1.3, 1.8), (1.0, 1.0, 1.0), (1.0, 1.2, 0.7)):
        tensions = {"alpha_top": top, "alpha_bottom": bottom, "alpha_film": film}
        for edge in (0.6, 0.45, 0.3, 0.22):
            start = partial(lens, edge, exact=False, **tensions)
            name = f"α {top:g}, {bottom:g}, {film:g}, edge {edge:g}"
            yield Case("lens", name, start, _whole(lens_exact(**tensions)))


def _wires() -> Iterator[Case]:
    """Minimal surfaces in a skew quadrilateral, straight, and in Enneper's wire."""
    for edge in (0.25, 0.17, 0.12, 0.08):
        values = {("energy", ""): skew_quadrilateral_exact().energy}
        yield Case("skew quadrilateral", f"edge {edge:g}", partial(skew_quadrilateral, edge), values)
        for radius in (0.5, 0.8):
            values = {("energy", ""): enneper_exact(radius=radius).energy}
            start = partial(enneper, edge, radius=radius)
            yield Case("Enneper", f"R {radius:g}, edge {edge:g}", start, values)


def _ellipses() -> Iterator[Case]:
    """Tense roofs, α Δu = -1: u = a²b² / 2α(a² + b²) at the top, volume π a b u / 2."""
    for a, b in ((1.5, 1.0), (2.0, 1.0), (3.0, 1.0)):
        top = (a * b) ** 2 / (2.0 * TENSE * (a**2 + b**2))
        values = {("height", "roof"): top, ("volume", ""): 0.5 * np.pi * a * b * top}
        for rings in (4, 6, 8, 11):
            yield Case("ellipse", f"{a:g} : {b:g}, {rings} rings", partial(_ellipse, a, b, rings), values)


def _ellipse(a: float, b: float, rings: int) -> Surface:
    net = ring_mesh(6 * np.arange(1, rings + 1))
    return _flat(disc_points(net) * [a, b], net.faces, net.radius == 1.0)


def _sectors() -> Iterator[Case]:
    """Tense roofs over sectors of a disc: order 4/3 at a corner of 270°, less beyond."""
    for degrees in (60, 120, 180, 240, 300, 330):
        angle = np.radians(degrees)
        values = {("volume", ""): _sector_volume(angle) / TENSE}
        for rings in (5, 7, 10, 14):
            yield Case("sector", f"{degrees}°, {rings} rings", partial(_sector, angle, rings), values)


def _sector(angle: float, rings: int) -> Surface:
    """Rings of a sector about its corner; all of its outline is fixed."""
    segments = np.maximum(1, np.rint(angle * np.arange(1, rings + 1))).astype(np.int64)
    points, held = [np.zeros((1, 2))], [np.array([True])]
    for ring, count in enumerate(segments, start=1):
        turn = angle * (np.arange(count + 1) / count - 0.5)
        points.append(ring / rings * np.stack([np.cos(turn), np.sin(turn)], axis=1))
        held.append((np.arange(count + 1) % count == 0) | (ring == rings))
    plan = np.concatenate(points)
    faces = strips(np.arange(len(plan)), np.append(0, segments))
    return _flat(plan, faces, np.concatenate(held))


def _sector_volume(angle: float) -> float:
    """∫ u over the sector of the unit disc, with -Δu = 1 and u = 0 on its outline.

    u = (r²/4)(cos 2θ / cos β - 1) + Σ a_k r^k cos kθ, k = nπ/β for odd n, β the angle of the sector and
    θ from its middle; a_k makes u zero on the arc. Singular at β = 90° and 270°, where terms combine.
    """
    theta = np.linspace(-0.5 * angle, 0.5 * angle, 20_001)
    arc = 0.25 * (np.cos(2.0 * theta) / np.cos(angle) - 1.0)
    total = float(np.trapezoid(arc, theta)) / 4.0
    for k in np.arange(1, 400, 2) * np.pi / angle:
        factor = -2.0 / angle * float(np.trapezoid(arc * np.cos(k * theta), theta))
        total += factor * 2.0 * np.sin(0.5 * k * angle) / k / (k + 2.0)
    return total


def _flat(plan: Floats, faces: Ints, held: Bools) -> Surface:
    """A flat roof of great tension over a plan, its faces turned upwards."""
    X = np.column_stack([plan, np.zeros(len(plan))])
    a, b, c = (X[faces[0, k]] for k in range(3))
    up = np.cross(b - a, c - a)[2] > 0.0
    one_patch = np.zeros(len(faces), dtype=np.int64)
    return Surface(X, faces if up else faces[:, ::-1], one_patch, (Patch("roof", TENSE),), fixed=held)
