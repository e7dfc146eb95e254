"""What must not change the energy: rigid motions, units, numbers and orders, threads."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapes import generic, hexagon, pyramid, rotation, shaken, three_patches

from pcmc import Patch, Plane, Surface, energy, gradient, hessian
from pcmc.base import compiled
from pcmc.forces.elements import energy_mesh
from pcmc.forces.functional import energy_and_gradient, patch_areas
from pcmc.forces.second_variation import hessian_product

seeds = st.integers(0, 2**32 - 1)
small = st.floats(-10.0, 10.0)


def forms(surface, **keywords):
    """E and ∇E with the supports left out."""
    return energy_and_gradient(surface, supports=False, **keywords)


# ---- rigid motions, scaling, labels -------------------------------------------------------------


@settings(max_examples=25, deadline=None, derandomize=True)
@given(seeds, st.tuples(small, small, small))
def test_rigid_motions_turn_the_gradient(seed, shift):
    surface = shaken(three_patches(3))
    R, shift = rotation(seed), np.array(shift)
    plane = Plane(shift + R @ surface.plane.point, R @ surface.plane.normal)
    X = surface.vertices @ R.T + shift
    # Rounding may lift sliding vertices off the turned plane by far less than the check allows.
    other = surface.rebuilt(vertices=X, plane=plane)
    assert energy(other) == pytest.approx(energy(surface), rel=1e-12)
    np.testing.assert_allclose(gradient(other), gradient(surface) @ R.T, atol=1e-11)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.floats(1e-3, 1e3))
def test_scaling_lengths_and_tensions(scale):
    surface = shaken(three_patches(3))
    tensions = {p.name: scale * p.tension for p in surface.patches}
    other = surface.moved(scale * surface.vertices).retensioned(tensions)
    assert energy(other) == pytest.approx(scale**3 * energy(surface), rel=1e-12)
    np.testing.assert_allclose(gradient(other) / scale**2, gradient(surface), atol=1e-12)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(seeds)
def test_labels_do_not_matter(seed):
    surface = shaken(three_patches(3))
    rng = np.random.default_rng(seed)
    vertex, face, patch = (rng.permutation(k) for k in (surface.n, surface.m, 6))
    turned = (np.arange(3) + rng.integers(0, 3, (surface.m, 1))) % 3  # start at another corner
    F = np.argsort(vertex)[surface.faces[face]]
    other = Surface(
        surface.vertices[vertex],
        np.take_along_axis(F, turned, axis=1),
        np.argsort(patch)[surface.patch_of_face[face]],
        [surface.patches[k] for k in patch],
        surface.fixed[vertex],
        surface.on_plane[vertex],
    )
    assert energy(other) == pytest.approx(energy(surface), rel=1e-13)
    np.testing.assert_allclose(gradient(other), gradient(surface)[vertex], atol=1e-13)
    np.testing.assert_allclose(patch_areas(other), patch_areas(surface)[patch], rtol=1e-13)


def test_turning_a_patch_over_turns_its_pressure():
    surface = shaken(pyramid())
    under = Surface(surface.vertices, surface.faces[:, ::-1], [0] * 4, [Patch("roof", 1.0, -1.0)], range(4))
    assert energy(under) == pytest.approx(energy(surface), rel=1e-15)
    np.testing.assert_allclose(gradient(under), gradient(surface), atol=1e-15)


# ---- threads ------------------------------------------------------------------------------------


@pytest.fixture
def small_blocks(monkeypatch):
    monkeypatch.setattr(compiled, "BLOCK", 10)


def test_blocks_cover_every_triangle_once(small_blocks):
    for count in (1, 9, 10, 25, 81, 1000):
        for workers in (1, 2, 3, 8):
            ranges = compiled.blocks(count, workers)
            assert len(ranges) <= workers
            assert ranges[0][0] == 0
            assert ranges[-1][1] == count
            assert all(a[1] == b[0] for a, b in pairwise(ranges))


@pytest.mark.parametrize("workers", [1, 2, 3, 8])
def test_threads_do_not_change_the_answer(small_blocks, workers):
    surface = generic()
    E, g = forms(surface, workers=1)
    again = [forms(surface, workers=workers) for _ in range(3)]
    for other, d in again:
        assert other == pytest.approx(E, rel=1e-14)
        np.testing.assert_allclose(d, g, atol=1e-14)
        assert other == again[0][0]  # the same bytes every time
        assert d.tobytes() == again[0][1].tobytes()


@pytest.mark.parametrize("workers", [2, 3, 8])
def test_threads_do_not_change_the_second_variation(small_blocks, monkeypatch, workers):
    surface = generic()
    d = np.random.default_rng(0).standard_normal((surface.n, 3))

    def second(threads):
        monkeypatch.setenv("PCMC_THREADS", str(threads))
        return hessian(surface).data, hessian_product(surface, energy_mesh(surface), surface.vertices, d)

    one, several, again = second(1), second(workers), second(workers)
    for by_one, by_several, once_more in zip(one, several, again, strict=True):
        np.testing.assert_allclose(by_several, by_one, atol=1e-14 * np.abs(by_one).max())
        assert by_several.tobytes() == once_more.tobytes()


@pytest.mark.nightly
def test_a_mesh_of_two_real_blocks():
    points, faces = hexagon(110)  # 72 600 triangles
    X = np.column_stack([points, 0.01 * (points**2).sum(axis=1)])
    surface = Surface(X, faces, [0] * len(faces), [Patch("big", 1.0)], fixed=[0])
    assert len(compiled.blocks(surface.m, 2)) == 2
    one, two = (forms(surface, workers=w) for w in (1, 2))
    assert two[0] == pytest.approx(one[0], rel=1e-12)
    np.testing.assert_allclose(two[1], one[1], atol=1e-9 * np.abs(one[1]).max())
