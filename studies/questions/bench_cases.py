"""The surfaces of the bench: ours, and those of pySurfaceEvolver's stress suite that can be put in our terms.

The suite (gautelinga/pySurfaceEvolver, ``docs/stress_cases.md``, October 2026) has nine cases; the meshes
here are our own, and each case has a closed form. Of the nine are taken

- a column of liquid between two plates, stable at a radius above height/π and a saddle below;
- a catenoid close to its fold, and beyond it, where there is none;
- a drop on a plane with a contact angle of 170°, from 90°: the wet disc is a film of tension -α cos θ;
- a cube that becomes a sphere and a hundred times as large;
- a drop with a contact angle of 60° that shrinks to 1/10 000: the dry plane is a film of tension α cos θ.

Left out are the bridge between two spheres and the drop on a fibre (pcmc has no supports on spheres or
cylinders), the puddle (pcmc has no weight of a liquid), and the drainage of a slit (remeshed at each step).
Volumes go in the suite's steps; the column and the drop at 170° go in one, where the suite takes more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from generators import catenoid_exact, spherical_cap, spherical_cap_exact, two_squares
from generators.builder import Builder
from generators.revolution import Meridian, tube
from generators.ring_mesh import cap_directions, ring_mesh
from pcmc import Patch, Plane, Room, Surface

FILM = Patch("film", 1.0, pressure=0.0)
CEILING = Plane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0))
ANGLE, CONTACT = np.radians(170.0), np.radians(60.0)
OUTER = 1.5  # radius to which the dry plane counts


@dataclass(frozen=True)
class Case:
    """A surface that is asked for.

    Attributes
    ----------
    build : its start, of a size.
    sizes : edge lengths, or numbers of edges; coarse to fine.
    exact : energy of the smooth surface, Σ α A where volumes are prescribed; NaN if it is not known.
    volumes : after the first equilibrium, what its room holds next, one after the other.
    exists : whether there is an equilibrium.
    """

    build: Callable[[float], Surface]
    sizes: tuple[float, ...]
    exact: float = np.nan
    volumes: tuple[float, ...] = ()
    exists: bool = True


def cylinder_between(around: int, low: float, high: float, radius: float) -> Surface:
    """A film on a cylinder about z, its two rings fixed."""
    line = Meridian(np.full(2, radius), np.array([low, high]), high - low)
    return tube(line, 2.0 * np.pi * radius / around, FILM)


def column(around: float, radius: float) -> Surface:
    """A column of radius 0.5 between z = 0 and z = 1, to hold what one of another radius does."""
    start = cylinder_between(int(around), 0.0, 1.0, 0.5)
    z, held = start.vertices[:, 2], start.fixed
    floor, ceiling = held & (z < 0.5), held & (z > 0.5)
    rooms = [Room("liquid", (("film", 1),), np.pi * radius**2)]
    return start.rebuilt(fixed=(), curves=(), on_plane=floor, on_planes={CEILING: ceiling}, rooms=rooms)


def cap_volume(angle: float) -> float:
    """The volume of a cap of radius 1 that meets its plane at an angle.

    >>> round(cap_volume(np.pi) / np.pi, 12)
    1.333333333333
    """
    c = np.cos(angle)
    return float(np.pi / 3.0 * (2.0 + c) * (1.0 - c) ** 2)


def drop_energy(volume: float, angle: float) -> float:
    """α (A - cos θ π r²) of a drop with α = 1 on a plane, r the radius of its foot.

    >>> round(drop_energy(2 * np.pi / 3, np.pi / 2) / np.pi, 12)
    2.0
    """
    radius, c = (volume / cap_volume(angle)) ** (1.0 / 3.0), np.cos(angle)
    return float(np.pi * radius**2 * (2.0 * (1.0 - c) - c * (1.0 - c * c)))


def drop(rings: float, start: float, angle: float, volume: float) -> Surface:
    """A cap of radius 1 that meets Π at ``start``; to become a drop of a volume that does at ``angle``."""
    rings = int(rings)
    net = ring_mesh(6 * np.arange(1, rings + 1))
    X = cap_directions(net, start) - [0.0, 0.0, np.cos(start)]
    X[-6 * rings :, 2] = 0.0
    mesh = Builder()
    points = mesh.add_points(X)
    mesh.add_faces(points[net.faces], 0)
    rim, cosine = points[-6 * rings :], float(np.cos(angle))
    following, sliding, outer = np.roll(rim, -1), rim, rim[:0]
    if cosine < 0.0:
        middle = mesh.add_points(np.zeros(3))
        mesh.add_faces(np.stack([rim, following, np.repeat(middle, len(rim))], axis=1), 1)
        sliding = np.append(rim, middle)
    else:
        outer = mesh.add_points(X[-6 * rings :] * OUTER / np.sin(start))
        further = np.roll(outer, -1)
        mesh.add_faces(np.stack([rim, outer, further], axis=1), 1)
        mesh.add_faces(np.stack([rim, further, following], axis=1), 1)
    plane = Patch("plane", abs(cosine), pressure=0.0)
    rooms = [Room("liquid", (("film", 1),), volume)]
    return mesh.surface([FILM, plane], fixed=outer, on_plane=sliding, rooms=rooms)


def cube(parts: float) -> Surface:
    """A cube of side 1 and volume 1, each edge in as many parts."""
    parts = int(parts)
    mesh, steps = Builder(), np.linspace(-0.5, 0.5, parts + 1)
    u, v = (x.ravel() for x in np.meshgrid(steps, steps, indexing="ij"))
    number = np.arange((parts + 1) ** 2).reshape(parts + 1, parts + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    even = (np.indices(a.shape).sum(axis=0) % 2 == 0)[..., None]
    first = np.where(even, np.stack([a, b, c], -1), np.stack([a, b, d], -1))
    second = np.where(even, np.stack([a, c, d], -1), np.stack([b, c, d], -1))
    side = np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])
    corners = [
        np.roll(np.stack([np.full(len(u), s), u, v], axis=1), k, axis=1)
        for k in range(3)
        for s in (-0.5, 0.5)
    ]
    points, same = np.unique(np.concatenate(corners).round(12), axis=0, return_inverse=True)
    numbers = mesh.add_points(points)[same.ravel()].reshape(6, -1)
    for k in range(6):
        mesh.add_faces(numbers[k][side if k % 2 else side[:, ::-1]], 0)
    return mesh.closed_surface([FILM], [Room("gas", (("film", 1),), 1.0)])


def sphere_area(volume: float) -> float:
    """The area of a ball of a volume: (36π)^(1/3) V^(2/3)."""
    return float((36.0 * np.pi) ** (1.0 / 3.0) * volume ** (2.0 / 3.0))


_DRY = np.cos(CONTACT) * np.pi * OUTER**2
_DROP = cap_volume(CONTACT)
_AROUND, _RINGS = (24, 80, 240), (8, 25, 80)
CASES = {
    "cap": Case(
        lambda edge: spherical_cap(edge, alpha=0.6),
        (0.08, 0.025, 0.008, 0.0025),
        spherical_cap_exact(alpha=0.6).energy,
    ),
    "two squares": Case(lambda squares: two_squares(int(squares), alpha_aux=1.0), (15, 48, 152, 492)),
    "column": Case(lambda around: column(around, 0.35), _AROUND, 2.0 * np.pi * 0.35),
    "column, a saddle": Case(lambda around: column(around, 0.25), _AROUND, 2.0 * np.pi * 0.25),
    "catenoid": Case(
        lambda around: cylinder_between(int(around), -0.65, 0.65, 1.0),
        _AROUND,
        catenoid_exact(half_distance=0.65).area,
    ),
    "drop at 170°": Case(
        lambda rings: drop(rings, np.pi / 2.0, ANGLE, cap_volume(np.pi / 2.0)),
        _RINGS,
        drop_energy(cap_volume(np.pi / 2.0), ANGLE),
    ),
    "inflation": Case(cube, (8, 25, 80), sphere_area(100.0), (10.0, 100.0)),
    "evaporation": Case(
        lambda rings: drop(rings, CONTACT, CONTACT, _DROP),
        _RINGS,
        drop_energy(1e-4 * _DROP, CONTACT) + _DRY,
        tuple((_DROP * np.geomspace(1.0, 1e-4, 25)[1:]).tolist()),
    ),
    "no equilibrium": Case(lambda edge: spherical_cap(edge, alpha=0.45), (0.08,), exists=False),
    "no catenoid": Case(
        lambda around: cylinder_between(int(around), -0.675, 0.675, 1.0), (24,), exists=False
    ),
}
