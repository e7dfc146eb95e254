"""Boundaries that slide on several planes: energy, derivatives, volumes, supports, and closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from pcmc import Patch, Plane, Surface
from pcmc.energy.flat_pieces import flat_pieces
from pcmc.energy.functional import apply_supports, energy_and_gradient, energy_at, hessian, weighted
from pcmc.energy.jacobian import linearise
from pcmc.energy.motion_space import motion_space, vertex_classes
from pcmc.energy.projected_hessian import assemble, hessian_pattern
from pcmc.stability.modes import full_matrix
from pcmc.surface.geometry import vertex_area_vectors

BOTTOM, TOP = Plane(), Plane((0, 0, 2), (0, 0, 1), name="top")


def tube(rings=8, around=12, radius=1.0, tension=1.0, pressure=1.0, length=2.0, **supports):
    """A cylinder between z = 0 and z = ``length``, its ends sliding on two plates."""
    angle, z = 2 * np.pi * np.arange(around) / around, np.linspace(0.0, length, rings + 1)
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    X = np.concatenate([np.column_stack([ring, np.full(around, height)]) for height in z])
    i = np.arange(around * rings)
    right = i - i % around + (i + 1) % around
    F = np.concatenate(
        [np.stack([i, right, right + around], axis=1), np.stack([i, right + around, i + around], axis=1)]
    )
    ends = np.arange(around), np.arange(around) + around * rings
    top = Plane((0, 0, length), (0, 0, 1), name="top")
    supports = {"on_plane": ends[0], "on_planes": {top: ends[1]}} | supports
    return Surface(X, F, np.zeros(len(F), int), [Patch("tube", tension, pressure)], **supports)


def corner_roof(origin=(0.3, 0.2, 0.0), n=5):
    """A bulged square over [0,1]², its sides sliding on four upright planes; Π's point is on none of them."""
    t = np.linspace(0.0, 1.0, n)
    x, y = (axis.ravel() for axis in np.meshgrid(t, t, indexing="ij"))
    z = 1.0 + 0.2 * x * (1 - x) + 0.1 * y + 0.15 * x * y
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(n - 1), np.arange(n - 1), indexing="ij"))
    a = i * n + j
    F = np.concatenate([np.stack([a, a + n, a + n + 1], 1), np.stack([a, a + n + 1, a + 1], 1)])
    walls = {
        Plane((1, 0, 0), (1, 0, 0)): x == 1,
        Plane((0, 1, 0), (0, 1, 0)): y == 1,
        Plane((0, 0, 0), (1, 0, 0)): x == 0,
        Plane((0, 0, 0), (0, 1, 0)): y == 0,
    }
    half = x < 0.5
    patch = np.where(half[F].all(axis=1), 0, 1)
    patches = [Patch("left", 1.0, 0.7), Patch("right", 1.3, 0.7)]
    X = np.stack([x, y, z], axis=1)
    return Surface(X, F, patch, patches, plane=Plane(origin), on_planes=walls)


def random_motion(surface, seed):
    return apply_supports(surface, np.random.default_rng(seed).standard_normal(surface.vertices.shape))


CASES = {
    "plates": lambda: tube(rings=3, around=7),
    "room corners": corner_roof,
    "oblique": lambda: tube(
        rings=3,
        around=7,
        plane=Plane((0.2, 0, -1), (0, 0.3, 1)),
        on_plane=(),
        on_planes={TOP: np.arange(21, 28), Plane(normal=(0, 0, -1)): np.arange(7)},
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_taylor_slopes(case):
    surface = CASES[case]()
    d, X = random_motion(surface, 1), surface.vertices
    value, forces = energy_and_gradient(surface, X)
    second = float(d.ravel() @ (hessian(surface) @ d.ravel()))
    steps = 1e-2 * 0.5 ** np.arange(5)
    change = np.array([energy_at(surface, X + t * d) for t in steps]) - value
    first = np.abs(change - steps * (forces * d).sum())
    both = np.abs(change - steps * (forces * d).sum() - 0.5 * steps**2 * second)
    assert np.log2(first[:-1] / first[1:]).min() > 1.9
    assert np.log2(both[:-1] / both[1:]).min() > 2.8


@pytest.mark.parametrize("case", CASES)
def test_volumes_are_enclosed(case):
    """A boundary that slides within its planes changes V by what the moved triangles sweep, and no more."""
    surface = CASES[case]()
    assert flat_pieces(surface)
    X, d = surface.vertices, random_motion(surface, 2)
    area_vector = vertex_area_vectors(X, surface.faces)[0] / 3.0
    moving = weighted(surface, 0.0, -1.0)[2]
    assert abs(float(((moving - area_vector) * d).sum())) < 1e-12 * np.abs(d).sum()


def dense(space):
    """B as a matrix (3n, unknowns)."""
    return np.stack([space.to_vectors(row).ravel() for row in np.eye(space.size)], axis=1)


@pytest.mark.parametrize("case", CASES)
def test_assembled_hessian(case):
    surface = CASES[case]()
    classes = vertex_classes(surface)
    space = motion_space(surface, classes, surface.vertices)
    pattern = hessian_pattern(classes, space)
    data = assemble(surface, classes, space, pattern, surface.vertices)
    B = dense(space)
    assert np.abs(full_matrix(pattern, data).toarray() - B.T @ (hessian(surface) @ B)).max() < 1e-13


@pytest.mark.parametrize("case", CASES)
def test_linearised_forces(case):
    """Bᵀ Df[d] is the derivative of the forces f = B Bᵀ ∇E, sliding boundaries included."""
    surface = CASES[case]()
    classes, X = vertex_classes(surface), surface.vertices

    def forces(X):
        return motion_space(surface, classes, X).project(energy_and_gradient(surface, X)[1])

    space = motion_space(surface, classes, X)
    here = linearise(surface, classes, space, X, energy_and_gradient(surface, X)[1])
    d = random_motion(surface, 3)
    d /= np.abs(d).max()
    t = 1e-5
    numeric = space.to_coordinates((forces(X + t * d) - forces(X - t * d)) / (2 * t))
    assert np.abs(here.times(d) - numeric).max() < 1e-8
