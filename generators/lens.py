"""Bubbles that a plane or a film cuts: the hemisphere on Π, and the lens in a flat film."""

from __future__ import annotations

import numpy as np

from pcmc import Patch, Surface
from pcmc.base import validate
from pcmc.base.errors import OptionError

from .builder import Builder
from .exact import ExactSolution, FlatPlane, Shape, Sphere
from .ring_mesh import cap_directions, ring_mesh
from .sphere import STRETCH
from .strips import strips

RISE = 1.03  # of radii and heights: a start that is clearly not the solution, yet near enough


def hemisphere(edge_length: float = 0.4, *, alpha: float = 1.0, exact: bool = False) -> Surface:
    """A bubble of radius 2α on Π, whose rim slides there and meets it at a right angle.

    Its modes are those of the sphere with l + m even, α (l (l + 1) - 2) / (2α)². So the index is 1, the
    mode l = 0 in which it grows or shrinks; the two translations along Π are rigid.

    Parameters
    ----------
    edge_length : length.
    alpha : tension of "bubble", force/length.
    exact : leave the vertices on the sphere; otherwise stretch it by 1.05, 1 and 0.95 along the axes.

    >>> surface = hemisphere(exact=True)
    >>> bool(hemisphere_exact().distance(surface).max() < 1e-12), bool(surface.fixed.any())
    (True, False)
    """
    radius = 2.0 * validate.positive("alpha", alpha)
    rings = max(2, round(0.5 * np.pi * radius / validate.positive("edge_length", edge_length)))
    net = ring_mesh(6 * np.arange(1, rings + 1))
    points = radius * cap_directions(net, 0.5 * np.pi)
    rim = np.arange(len(points) - 6 * rings, len(points))
    points[rim, 2] = 0.0
    mesh = Builder()
    mesh.add_faces(mesh.add_points(points * (1.0 if exact else np.array(STRETCH)))[net.faces], 0)
    return mesh.surface([Patch("bubble", alpha)], on_plane=rim)


def hemisphere_exact(*, alpha: float = 1.0) -> ExactSolution:
    """A = 8π α², V = (16/3)π α³: half of the sphere of radius 2α.

    >>> half = hemisphere_exact()
    >>> round(half.energy / np.pi, 12), half.index
    (2.666666666667, 1)
    """
    radius = 2.0 * validate.positive("alpha", alpha)
    area, volume = 2.0 * np.pi * radius**2, 2.0 / 3.0 * np.pi * radius**3
    ball = Sphere((0.0, 0.0, 0.0), radius)
    return ExactSolution(alpha * area - volume, area, volume, radius, {"bubble": ball}, 1)


def lens(
    edge_length: float = 0.4,
    *,
    alpha_top: float = 1.0,
    alpha_bottom: float = 1.3,
    alpha_film: float = 1.8,
    exact: bool = False,
) -> Surface:
    """A bubble between two domes in the middle of a flat film, whose outer circle is held.

    The domes are parts of spheres of radius 2 α_top and 2 α_bottom. On a circle of radius ρ their
    slopes have the sines ρ / 2α, so the forces across the film balance; those along it do if
    √(α_top² - ρ²/4) + √(α_bottom² - ρ²/4) = α_film (Young's law): ρ is twice the height of the
    triangle with the tensions as its sides, over the side α_film.

    Parameters
    ----------
    edge_length : length, of the segments of the circle.
    alpha_top, alpha_bottom, alpha_film : tensions of "top", "bottom" and "film", force/length. The film
        reaches to 2ρ.
    exact : put the vertices on the exact solution; otherwise the free ones are 3 % farther from the axis.

    >>> surface = lens(exact=True)
    >>> bool(lens_exact().distance(surface).max() < 1e-12), surface.n - surface.fixed.sum() > 50
    (True, np.True_)
    """
    edge_length = validate.positive("edge_length", edge_length)
    circle = lens_circle(alpha_top=alpha_top, alpha_bottom=alpha_bottom, alpha_film=alpha_film)
    rings = max(2, round(np.pi * circle / (3.0 * edge_length)))
    net = ring_mesh(6 * np.arange(1, rings + 1))
    inside = len(net.radius) - 6 * rings
    mesh = Builder()
    domes = []
    for alpha, side in ((alpha_top, 1.0), (alpha_bottom, -1.0)):
        dome = 2.0 * alpha * cap_directions(net, float(np.arcsin(0.5 * circle / alpha)))
        dome[:, 2] -= np.sqrt(4.0 * alpha**2 - circle**2)
        dome[inside:, 2] = 0.0
        domes.append(dome * [1.0, 1.0, side])
    rim = mesh.add_points(domes[0][inside:])
    for patch, dome in enumerate(domes):
        number = np.concatenate([mesh.add_points(dome[:inside]), rim])
        faces = number[net.faces]
        mesh.add_faces(faces[:, ::-1] if patch else faces, patch)
    lines = [np.append(rim, rim[0])]
    for k in range(1, rings + 1):
        ring = mesh.add_points(mesh.positions(rim) * 2.0 ** (k / rings))
        lines.append(np.append(ring, ring[0]))
    mesh.add_faces(strips(np.concatenate(lines), np.full(rings + 1, len(rim))), 2)
    patches = [Patch("top", alpha_top), Patch("bottom", alpha_bottom), Patch("film", alpha_film, 0.0)]
    surface = mesh.surface(patches, fixed=lines[-1][:-1])
    if exact:
        return surface
    X = surface.vertices.copy()
    X[surface.free, :2] *= RISE
    return surface.moved(X)


def lens_circle(*, alpha_top: float = 1.0, alpha_bottom: float = 1.3, alpha_film: float = 1.8) -> float:
    """Radius ρ of the circle where the domes meet the film, length.

    Raises
    ------
    OptionError
        If the tensions are not the sides of a triangle whose angles beside α_film are acute: no lens
        between two domes that are less than hemispheres balances them.

    >>> round(lens_circle(alpha_top=1.0, alpha_bottom=1.0, alpha_film=1.0) ** 2, 12)
    3.0
    """
    top = validate.positive("alpha_top", alpha_top)
    bottom = validate.positive("alpha_bottom", alpha_bottom)
    film = validate.positive("alpha_film", alpha_film)
    if not abs(top**2 - bottom**2) < film**2 < (top + bottom) ** 2:
        raise OptionError(
            f"alpha_film must be between √|α_top² - α_bottom²| and α_top + α_bottom, found {film:g}",
            what="alpha_film",
            found=film,
            expected=(float(np.sqrt(abs(top**2 - bottom**2))), top + bottom),
        )
    s = 0.5 * (top + bottom + film)
    return float(4.0 * np.sqrt(s * (s - top) * (s - bottom) * (s - film)) / film)


def lens_exact(
    *, alpha_top: float = 1.0, alpha_bottom: float = 1.3, alpha_film: float = 1.8
) -> ExactSolution:
    """Two caps, A = 4πα h and V = πh² (6α - h)/3 each, h = 2α - √(4α² - ρ²), and an annulus.

    For equal tensions the index is 1: at given volume the lens is the least (Novaga, Paolini and
    Tortorelli 2023), at given pressure it grows or shrinks.

    >>> found = lens_exact(alpha_top=1.0, alpha_bottom=1.0, alpha_film=1.0)
    >>> round(found.area / np.pi, 9), round(found.volume / np.pi, 9), found.index
    (17.0, 3.333333333, 1)
    """
    circle = lens_circle(alpha_top=alpha_top, alpha_bottom=alpha_bottom, alpha_film=alpha_film)
    alpha = np.array([alpha_top, alpha_bottom])
    depth = np.sqrt(4.0 * alpha**2 - circle**2)
    h = 2.0 * alpha - depth
    areas = 4.0 * np.pi * alpha * h
    volume = float((np.pi * h**2 * (6.0 * alpha - h) / 3.0).sum())
    film = 3.0 * np.pi * circle**2
    energy = float(alpha @ areas + alpha_film * film - volume)
    index = 1 if alpha_top == alpha_bottom == alpha_film else None
    shapes: dict[str, Shape] = {
        "top": Sphere((0.0, 0.0, -float(depth[0])), 2.0 * alpha_top),
        "bottom": Sphere((0.0, 0.0, float(depth[1])), 2.0 * alpha_bottom),
        "film": FlatPlane(),
    }
    return ExactSolution(energy, float(areas.sum() + film), volume, float(h[0]), shapes, index)
