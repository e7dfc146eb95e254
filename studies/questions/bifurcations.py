"""Where surfaces lose their stability: published bifurcations, on flat and on curved elements.

Each case is a family of equilibria in a parameter. Where an eigenvalue of the second variation passes zero,
the index changes, and other equilibria leave. With α = 1 and p = 1 (mean curvature 1/2):

- A cylinder of radius 1 between two rings: at a length of π if the pressure is held, of 2π if the volume is
  (Plateau 1873).
- A nodoid's bulge between two rings, where its meridian comes to run along them: there the sideways
  translation is a Jacobi field (Russo and Steen 1986). The next mode, cos 2θ, has no closed form.
- The whole nodoid, a half period between two planes, in the waviness B of ``delaunay``: its first
  bifurcation, again of cos 2θ (Mazzeo and Pacard 2002; Rossman 2005). Jacobi's equation gives B = 2.
- Two caps over unit circles with one volume between them: at hemispheres (Theisen et al. 2007).
- A double bubble between rings of radius 2 at z = ±1, in the tension of its disc. At 1 both bubbles have
  their equators on the rings, and the translation along the axis vanishes there.

Beside each stands Jacobi's equation on the meridian, integrated here with the meridian itself:

    (r φ')' + (r |A|² - m²/r) φ = 0,    |A|² = κ² + (1 - κ)²,    κ = sin ψ / r.

Places are zeros of an eigenvalue, found by the secant method. Those of flat triangles are extrapolated. Where
no junction moves, their error has order 2, and that of elements of order 2 order 4. Beside a junction that
moves, the sheets' vertices move along their normals only: there both have order 1. Surface Evolver counts
negative eigenvalues on both sides of each place on the coarsest flat mesh.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from scipy.integrate import simpson, solve_ivp
from scipy.optimize import brentq, newton

from generators import spherical_cap
from generators.builder import Builder
from generators.revolution import SAMPLES, Meridian, tube
from generators.ring_mesh import disc_points, even_segments, ring_mesh
from pcmc import Patch, Plane, Room, Surface, certify
from pcmc.base.arrays import Floats, Ints
from pcmc.meshing.elevation import elevate
from pcmc.meshing.refinement import Projection
from pcmc.solvers import solve_once

from ..folder import Folder
from ..orders import richardson
from ..reference import evolver
from ..study import Study

UPRIGHT = 0.5 * np.pi
BESIDE = 0.02  # of a place: where indices are counted on both sides of it
SHOWN = 0.04  # of the size: how far a mode displaces what the figure shows
APART = 1.5  # of the centres of the two circles from the origin
FILM = Patch("film", 1.0)


def integrate(r: float, psi: float, end: float, m: int = 0, phi: float = 1.0, rate: float = 0.0) -> Any:
    """Meridian and Jacobi field by arc length: rows r, z, ψ, φ and r φ', from one point on.

    ψ is the slope of the meridian against the radius, and κ + ψ' = 1. ``t_events[0]``: where φ is zero.
    """

    def rates(_: float, y: Floats) -> list[float]:
        r, _, psi, phi, flux = y
        k = np.sin(psi) / r
        return [np.cos(psi), np.sin(psi), 1.0 - k, flux / r, (m**2 / r - r * (k**2 + (1.0 - k) ** 2)) * phi]

    def zero(s: float, y: Floats) -> float:
        return float(y[3]) if s > 0.0 else 1.0

    start, at = [r, 0.0, psi, phi, r * rate], np.linspace(0.0, end, SAMPLES)
    return solve_ivp(rates, (0.0, end), start, "DOP853", at, events=zero, rtol=1e-11, atol=1e-12)


def first_zero(r: float, psi: float, m: int = 0, phi: float = 1.0, rate: float = 0.0) -> float:
    """Arc length to the first zero of a Jacobi field."""
    zeros = integrate(r, psi, 4.0, m, phi, rate).t_events[0]
    return float(zeros[zeros > 1e-6][0])


def meridian(r: float, psi: float, length: float, both_ways: bool = True) -> Meridian:
    """From a point on by arc length; ``both_ways``: and its mirror image below, which comes first."""
    r_, z = integrate(r, psi, length).y[:2]
    if not both_ways:
        return Meridian(r_, z, length)
    return Meridian(np.append(r_[:0:-1], r_), np.append(-z[:0:-1], z), 2.0 * length)


def film(curve: Meridian, edge: float, like: Meridian) -> Surface:
    """A tube over a meridian, with as many rings and vertices as one over another."""
    surface = tube(like, edge, FILM)
    X = surface.vertices
    at = np.arange(surface.n) // (surface.fixed.sum() // 2)
    r, z = (np.interp(at / at[-1], np.linspace(0.0, 1.0, len(v)), v) for v in (curve.r, curve.z))
    return surface.moved(np.column_stack([X[:, :2] * (r / np.hypot(*X[:, :2].T))[:, None], z]))


def onto_rings(surface: Surface) -> Projection:
    """Puts new nodes between fixed vertices on the rings at the ends."""
    radius = float(np.hypot(*surface.vertices[surface.fixed, :2].T).max())

    def project(points: Floats) -> Floats:
        r = np.hypot(*points[:, :2].T)
        scale = np.where(r > 0.9 * radius, radius / np.maximum(r, 1e-9), 1.0)
        return points * np.column_stack([scale, scale, np.ones(len(r))])

    return project


def onto_circles(points: Floats) -> Floats:
    """The same for the circles of two caps."""
    centre = np.sign(points[:, :1]) * [APART, 0.0, 0.0]
    return centre + (points - centre) / np.linalg.norm(points - centre, axis=1)[:, None]


def disc(mesh: Builder, rim: Ints, edge: float, patch: int, side: int = 1) -> Ints:
    """Add a flat disc in a ring of vertices that begins at angle 0; returns the new vertices."""
    around = mesh.positions(rim)
    radius = float(np.hypot(*around[0, :2]))
    count = max(1, round(radius / edge))
    segments = even_segments(radius * np.arange(1, count + 1) / count, edge)
    segments[-1] = len(rim)
    net = ring_mesh(segments)
    turn = np.arctan2(around[0, 1], around[0, 0])
    x, y = radius * disc_points(net).T[:, : -len(rim)]
    flat = [x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)]
    new = mesh.add_points(np.column_stack([*flat, np.full(len(x), around[0, 2])]))
    mesh.add_faces(np.append(new, rim)[net.faces][:, ::side], patch)
    return new


def cylinder(edge: float, length: float, critical: float) -> Surface:
    """Of radius 1, closed by two fixed discs, with the volume prescribed."""
    body = tube(meridian(1.0, UPRIGHT, 0.5 * critical), edge, FILM)
    mesh, fixed = Builder(), np.flatnonzero(body.fixed)
    number = mesh.add_points(body.vertices)
    mesh.add_faces(number[body.faces], 0)
    ends = np.split(fixed, 2)
    lids = [disc(mesh, rim, edge, 1, side) for rim, side in zip(ends, (-1, 1), strict=True)]
    rooms = [Room("inside", (("film", 1), ("lids", 1)), np.pi * length)]
    closed = mesh.surface([FILM, Patch("lids", 1.0)], np.concatenate([fixed, *lids]), rooms=rooms)
    return closed.moved(closed.vertices * [1.0, 1.0, length / critical])


def bulge(waviness: float, edge: float, reach: float, critical: float) -> Surface:
    """Of a nodoid, this arc length from its middle to either ring."""
    like = meridian(1.0 + waviness, UPRIGHT, critical)
    return film(meridian(1.0 + waviness, UPRIGHT, reach), edge, like)


def whole_nodoid(edge: float, waviness: float, critical: float) -> Surface:
    """From bulge to neck, both sliding on planes that the surface meets at a right angle."""
    curve, like = (meridian(1.0 + B, UPRIGHT, np.pi, both_ways=False) for B in (waviness, critical))
    surface = film(curve, edge, like)
    low, high = np.split(np.flatnonzero(surface.fixed), 2)
    return surface.rebuilt(fixed=(), on_planes={Plane(): low, Plane((0.0, 0.0, float(curve.z[-1]))): high})


def two_caps(edge: float, volume: float, _: float) -> Surface:
    """Equal ones over two unit circles, with this volume in all."""
    height = brentq(lambda h: np.pi * h * (3.0 + h * h) / 3.0 - volume, 0.1, 3.0)
    cap, mesh, rims = spherical_cap(edge, height=float(height)), Builder(), []
    for patch, side in enumerate((-1.0, 1.0)):
        number = mesh.add_points(cap.vertices + np.array([side * APART, 0.0, 0.0]))
        mesh.add_faces(number[cap.faces], patch)
        rims.append(number[cap.fixed])
    patches = [Patch(name, 1.0, 2.0) for name in ("left", "right")]
    return mesh.surface(
        patches, np.concatenate(rims), rooms=[Room("both", (("left", 1), ("right", 1)), volume)]
    )


def double_bubble(edge: float, tension: float, _: float = 1.0) -> Surface:
    """Parts of two spheres of radius 2 with a disc between; at rest if its tension is 1."""
    body = tube(meridian(3.0**0.5, np.pi / 3.0, np.pi / 3.0), edge, FILM)
    mesh, above = Builder(), body.vertices[body.faces, 2].mean(axis=1) > 0.0
    number = mesh.add_points(body.vertices)
    mesh.add_faces(number[body.faces[~above]], 0)
    mesh.add_faces(number[body.faces[above]], 1)
    disc(mesh, np.flatnonzero(np.abs(body.vertices[:, 2]) < 1e-9), edge, 2)
    patches = [Patch("lower", 1.0), Patch("upper", 1.0), Patch("disc", tension, pressure=0.0)]
    return mesh.surface(patches, np.flatnonzero(body.fixed))


def of_nodoid() -> float:
    """The waviness at which cos 2θ keeps the nodoid's symmetries: r φ' vanishes at bulge and neck."""
    return float(brentq(lambda B: integrate(1.0 + B, UPRIGHT, np.pi, 2).y[4, -1], 1.5, 3.0, xtol=1e-12))


def of_two_caps() -> float:
    """The volume over the radius³ where the rim is a zero of one cap's even mode."""
    near = 1e-5  # of the pole, where κ is 0/0
    end = first_zero(2.0 * near, near)
    r, _, psi = integrate(2.0 * near, near, end).y[:3]
    return float(2.0 * np.pi * simpson(r**2 * np.sin(psi), dx=end / (len(r) - 1)) / r[-1] ** 3)


def of_double_bubble() -> float:
    """The disc's tension for which the translation of the upper sheet along the axis vanishes at z = 1."""

    def beyond(tension: float) -> float:
        r, psi = (4.0 - tension**2) ** 0.5, float(np.arccos(0.5 * tension))
        end = first_zero(r, psi, 0, -np.cos(psi), 0.5 * np.sin(psi))
        return float(integrate(r, psi, end).y[1, -1] - 1.0)

    return float(brentq(beyond, 0.5, 1.5, xtol=1e-12))


@dataclass(frozen=True)
class Case:
    """A family of equilibria.

    Attributes
    ----------
    build : the surface of an edge length and a value, with the triangles of that of a third number.
    jacobi : the place by Jacobi's equation.
    exact : in closed form; NaN where there is none.
    below : how many eigenvalues are less than the one that passes zero.
    edges : of the flat meshes, each half the last, and of those of order 2.
    project : for ``elevate``.
    released : whether the volume with which it is solved is let go before eigenvalues are taken.
    orders : of the flat meshes' error, which are removed.
    """

    name: str
    build: Callable[[float, float, float], Surface]
    jacobi: Callable[[], float]
    exact: float
    below: int
    edges: Mapping[int, tuple[float, ...]]
    project: Callable[[Surface], Projection] = onto_rings
    released: bool = False
    orders: tuple[float, ...] = (2, 4)

    def rest(self, edge: float, value: float, order: int, critical: float) -> Surface:
        """The equilibrium."""
        start = self.build(edge, value, critical)
        if order > 1:
            start = elevate(start, order, self.project(start))
        result = solve_once(start, target="stationary")
        if not result.converged:
            raise ArithmeticError(f"{self.name} at {value:g}: {result.message}")
        return result.surface.rebuilt(rooms=()) if self.released else result.surface

    def place(self, edge: float, order: int, critical: float) -> float:
        """Where the eigenvalue is zero on a mesh, by the secant method from the smooth surface's place."""

        def eigenvalue(value: float) -> float:
            at = self.rest(edge, value, order, critical)
            return float(certify(at, modes=self.below + 1).eigenvalues[self.below])

        return float(newton(eigenvalue, critical, x1=(1.0 - BESIDE) * critical, tol=1e-9, maxiter=25))


TUBES = {1: (0.4, 0.2, 0.1), 2: (0.4, 0.2)}
CASES = (
    Case("cylinder, pressure held", cylinder, lambda: 2.0 * first_zero(1.0, UPRIGHT), np.pi, 0, TUBES,
         released=True),
    Case("cylinder, volume held", cylinder, lambda: 2.0 * first_zero(1.0, UPRIGHT, phi=0.0, rate=1.0),
         2.0 * np.pi, 0, TUBES),
    Case("nodoid, m = 1", partial(bulge, 2.0), lambda: first_zero(3.0, UPRIGHT, 1),
         UPRIGHT + float(np.arcsin(0.5)), 1, TUBES),
    Case("nodoid, m = 2", partial(bulge, 3.0), lambda: first_zero(4.0, UPRIGHT, 2), np.nan, 3, TUBES),
    Case("whole nodoid, m = 2", whole_nodoid, of_nodoid, np.nan, 4, {1: (0.4, 0.2, 0.1)}),
    Case("two caps, one volume", two_caps, of_two_caps, 4.0 * np.pi / 3.0, 0,
         {1: (0.25, 0.125, 0.0625), 2: (0.25, 0.125)}, lambda _: onto_circles),
    Case("double bubble", double_bubble, of_double_bubble, 1.0, 0,
         {1: (0.2, 0.1, 0.05), 2: (0.2, 0.1)}, orders=(1, 2)),
)  # fmt: skip


def file_name(name: str) -> str:
    """Of the mesh of a case."""
    return re.sub(r"\W+", "-", name)


def data(folder: Folder, short: bool) -> None:
    """``records``: the place on each mesh; ``sides``: the indices beside it on the coarsest flat one."""
    places: list[dict[str, Any]] = []
    sides: list[dict[str, Any]] = []
    for case in CASES:
        critical = case.jacobi()
        for order, edges in case.edges.items():
            for edge in edges[:1] if short else edges:
                place = case.place(edge, order, critical)
                row = {"case": case.name, "order": order, "edge_length": edge}
                places.append(row | {"jacobi": critical, "exact": case.exact, "place": place})
                if order > 1 or edge != edges[0]:
                    continue
                for side in (1.0 - BESIDE, 1.0 + BESIDE):
                    at = case.rest(edge, side * place, order, critical)
                    count = evolver.inertia(at).negative if evolver.available() else -1
                    known = certify(at, modes=case.below + 1)
                    row = {"case": case.name, "value": side * place, "index": known.index, "evolver": count}
                    sides.append(row)
                mode = known.modes[case.below]
                away = SHOWN * at.size * mode / np.linalg.norm(mode, axis=1).max()
                folder.write_mesh(file_name(case.name), {"at rest": at, "mode": at.moved(at.vertices + away)})
    folder.write_table("records", pd.DataFrame(places))
    folder.write_table("sides", pd.DataFrame(sides))


def table(folder: Folder) -> dict[str, float]:
    """``places``: each by Jacobi's equation, flat meshes and elements of order 2; with the largest errors."""
    records, sides = folder.read_table("records"), folder.read_table("sides")
    rows: list[dict[str, Any]] = []
    for case in CASES:
        mine = records[records.case == case.name]
        flat, bent = (mine[mine.order == order].place.to_numpy() for order in (1, 2))
        smooth = float(mine.jacobi.iloc[0])
        orders = case.orders[: len(flat) - 1]
        row: dict[str, Any] = {"case": case.name, "closed_form": case.exact, "jacobi": smooth}
        row |= {"finest_flat": flat[-1]}
        row |= {"extrapolated": richardson(flat, orders), "order_2": bent[-1] if len(bent) else np.nan}
        if len(bent) > 1 and case.orders[0] == 1:
            row["order_2"] = richardson(bent, (1,))
        row["flat_error"] = abs(row["extrapolated"] / smooth - 1.0)
        row["order_2_error"] = abs(row["order_2"] / smooth - 1.0)
        rows.append(row)
    places = pd.DataFrame(rows)
    folder.write_table("places", places)
    return {
        "cases": float(len(places)),
        "jacobi_error": float((places.jacobi / places.closed_form - 1.0).abs().max()),
        "flat_error": float(places.flat_error.max()),
        "order_2_error": float(places.order_2_error.max()),
        "indices": float(len(sides)),
        "indices_as_evolver": float((sides["index"] == sides.evolver).sum()),
        "whole_nodoid": float(places.jacobi[places.case == "whole nodoid, m = 2"].iloc[0]),
    }


def figure(folder: Folder) -> None:
    """Each surface of the coarsest mesh, displaced along the mode that turns unstable."""
    from pcmc.plot import panel

    places = folder.read_table("places").set_index("case")
    shapes = [folder.read_mesh(file_name(case.name))["mode"] for case in CASES]
    titles = [f"{case.name}: {places.extrapolated[case.name]:.4f}" for case in CASES]
    panel(shapes, folder.figure("modes"), columns=4, titles=titles, supports=False, one_scale=False)


STUDY = Study(
    "bifurcations",
    "where surfaces lose their stability: published bifurcations, on flat and on curved elements",
    data,
    table,
    figure,
    parameters={"edges": {case.name: {str(k): v for k, v in case.edges.items()} for case in CASES}},
    seconds=60,
    paper=False,
)
