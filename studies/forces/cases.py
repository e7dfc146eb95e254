"""Closed forms of surfaces with cables, weight, prescribed volumes, sliding planes and mirrors.

Each is a start on a mesh of given fineness, and quantities of the surface at rest beside their exact values.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import generators
from generators import barrel, catenary, hypar_roof, hypar_roof_edge, schwarz_p, triple_bubble
from generators.schwarz_p import AREA as SCHWARZ_P
from pcmc import Plane, Room, Surface, Target, room_volumes
from pcmc.base.arrays import Floats
from pcmc.design.targets import measure
from pcmc.forces.functional import patch_areas

DOUBLE_BUBBLE = 27.0 * np.pi / (9.0 * np.pi) ** (2.0 / 3.0)  # area around two volumes of 1
TRIPLE_BUBBLE = generators.triple_bubble_exact().area  # around three
HEAVY, WEIGHT = 2.0 * np.pi / 3.0, 1.5  # volume and weight of the heavy bubble, α = p = 1
SAG = 2.0  # asked of the edges of the flat roof
Values = Mapping[str, tuple[float, float]]  # by quantity: of the mesh, and exact


@dataclass(frozen=True)
class Case:
    """A closed form.

    Attributes
    ----------
    name, title : of its rows and of its picture.
    term : what it shows.
    start : the surface that the solver starts from, on a mesh of this fineness.
    fineness : of the coarsest mesh: an edge length, or a number of edges.
    values : quantities of the surface at rest.
    """

    name: str
    title: str
    term: str
    start: Callable[[float], Surface]
    fineness: float
    values: Callable[[Surface], Values]

    def mesh(self, level: int) -> Surface:
        """The start on the mesh after so many halvings of its edges."""
        counted = isinstance(self.fineness, int)
        return self.start(self.fineness * 2**level if counted else self.fineness / 2**level)


def flat_roof(squares: float) -> Surface:
    """A flat membrane between four points and four cables, τ = 10 and α = 1."""
    return hypar_roof(int(squares), height=0.0)


def _flat_roof(surface: Surface) -> Values:
    off = hypar_roof_edge(surface.vertices[np.unique(surface.cables[0].edges)]).max()
    sag = measure(surface, Target("sag", "south")).value
    return {"distance": (float(off), 0.0), "sag": (sag, 10.0 - np.sqrt(75.0))}


def hanging_barrel(squares: float) -> Surface:
    """A piece between mirror planes of a long barrel that hangs by its weight, α/w = 2."""
    return barrel(int(squares), alpha=2.0, pressure=0.0, weight=1.0, rise=-0.2)


def _hanging_barrel(surface: Surface) -> Values:
    X, z = surface.vertices, catenary(2.0, 2.0)
    return {
        "distance": (float(np.abs(X[:, 2] - z(X[:, 0])).max()), 0.0),
        "lowest point": (float(X[:, 2].min()), float(z(np.zeros(1))[0])),
    }


def _arched_barrel(surface: Surface) -> Values:
    X, centre = surface.vertices, -np.sqrt(3.0)
    off = np.abs(np.hypot(X[:, 0], X[:, 2] - centre) - 2.0).max()
    return {"distance": (float(off), 0.0), "rise": (float(X[:, 2].max()), 2.0 + centre)}


def _area(exact: float) -> Callable[[Surface], Values]:
    return lambda surface: {"area": (float(patch_areas(surface).sum()), exact)}


def _schwarz_p(surface: Surface) -> Values:
    return {"area of a cell": (8.0 * float(patch_areas(surface).sum()), SCHWARZ_P)}


def heavy_bubble(edge_length: float) -> Surface:
    """A bubble on Π of prescribed volume, its edge sliding, that weighs 1.5 per area."""
    half = generators.hemisphere(edge_length, alpha=0.5)
    heavy = half.retensioned({"bubble": 1.0}, weights={"bubble": WEIGHT})
    return replace(heavy, rooms=(Room("inside", (("bubble", 1),), HEAVY),))


def _heavy_bubble(surface: Surface) -> Values:
    height, radius = heavy_profile(HEAVY, 1.0, WEIGHT)
    foot = surface.vertices[surface.on_plane]
    mean = float(np.linalg.norm(foot - foot.mean(axis=0), axis=1).mean())
    return {"height": (float(surface.vertices[:, 2].max()), height), "radius": (mean, radius)}


def heavy_profile(volume: float, alpha: float, weight: float) -> tuple[float, float]:
    """Height and radius on Π of a heavy bubble that meets Π at a right angle.

    E = ∫ σ(z) dA - p V with σ = α + w z is stationary where p = σ (κ₁ + κ₂) + w cos φ. Here φ is the slope of
    the profile, which grows from 0 at the apex to π/2 on Π; along it r' = cos φ and z' = -sin φ, and

        φ' = (p - w cos φ) / σ - sin φ / r,    φ' = (p - w) / 2σ at the apex.

    >>> height, radius = heavy_profile(2 * np.pi / 3, 1.0, 1e-12)
    >>> round(height, 8), round(radius, 8)
    (1.0, 1.0)
    """

    def profile(height: float, pressure: float) -> Floats:
        def rates(slope: float, y: Floats) -> list[float]:
            r, z, _ = y
            bend = (pressure - weight * np.cos(slope)) / (alpha + weight * z)
            turn = bend - np.sin(slope) / r if r > 0.0 else 0.5 * bend
            return [np.cos(slope) / turn, -np.sin(slope) / turn, np.pi * r**2 * np.sin(slope) / turn]

        path = solve_ivp(rates, (0.0, 0.5 * np.pi), [0.0, height, 0.0], rtol=1e-11, atol=1e-12)
        return np.asarray(path.y[:, -1])

    def misfit(unknown: Floats) -> list[float]:
        _, z, enclosed = profile(*unknown)
        return [z, enclosed - volume]

    radius = (1.5 * volume / np.pi) ** (1.0 / 3.0)
    height, pressure = fsolve(misfit, [0.9 * radius, 2.0 * alpha / radius], xtol=1e-12)
    return float(height), float(profile(height, pressure)[0])


def tube(edge_length: float, length: float, between: str = "plates") -> Surface:
    """A cylinder of radius 1 and of the volume it has, between rings or plates on which its ends slide."""
    surface = generators.cylinder(edge_length, length=length, exact=True)
    rooms = (Room("inside", (("tube", 1),), 1.0),)
    if between == "rings":
        surface = replace(surface, rooms=rooms)
    else:
        lid, z = Plane((0.0, 0.0, length), (0.0, 0.0, 1.0), "lid"), surface.vertices[:, 2]
        mesh = surface.vertices, surface.faces, surface.patch_of_face, surface.patches
        ends = np.isclose(z, 0.0), np.isclose(z, length)
        surface = Surface(*mesh, on_plane=ends[0], on_planes=((lid, ends[1]),), rooms=rooms)
    return surface.retensioned(volumes={"inside": float(room_volumes(surface)[0])})


def pressed_tube(edge_length: float) -> Surface:
    """A tube of length 2 between two plates, under the pressure 1, started too wide."""
    surface = replace(tube(edge_length, 2.0), rooms=())
    return surface.moved(surface.vertices * np.array([1.1, 1.1, 1.0]))


def _pressed_tube(surface: Surface) -> Values:
    X = surface.vertices
    radius = np.linalg.norm(X[:, :2] - X[:, :2].mean(axis=0), axis=1)
    enclosed = room_volumes(replace(surface, rooms=(Room("inside", (("tube", 1),), 1.0),)))
    return {"radius": (float(radius.max()), 1.0), "volume": (float(enclosed[0]), 2.0 * np.pi)}


CASES = (
    Case("edges", "flat roof: arcs of radius τ/α", "cables", flat_roof, 4, _flat_roof),
    Case("catenary", "barrel under its weight", "weight", hanging_barrel, 4, _hanging_barrel),
    Case("barrel", "barrel under pressure", "mirror planes", lambda n: barrel(int(n)), 8, _arched_barrel),
    Case("tube", "tube between two plates", "sliding planes", pressed_tube, 0.5, _pressed_tube),
    Case(
        "two_bubbles",
        "two bubbles of volume 1",
        "volumes",
        lambda h: generators.double_bubble(h, volumes=(1.0, 1.0)),
        0.4,
        _area(DOUBLE_BUBBLE),
    ),
    Case("three_bubbles", "three bubbles of volume 1", "volumes", triple_bubble, 0.4, _area(TRIPLE_BUBBLE)),
    Case("heavy_bubble", "heavy bubble on Π", "weight, volume", heavy_bubble, 0.4, _heavy_bubble),
    Case(
        "schwarz_p", "Schwarz' P from an eighth", "mirror planes", lambda n: schwarz_p(int(n)), 4, _schwarz_p
    ),
)
