"""Surface Evolver, given the same mesh, finds the same energy, forces, Newton step and index."""

import numpy as np
import pytest
from programs import needs_evolver
from tents import tent

import pcmc
from generators import four_fans, two_caps, two_squares
from pcmc.surface.supports import apply_supports
from studies.reference import evolver

pytestmark = needs_evolver


def shaken(surface: pcmc.Surface) -> pcmc.Surface:
    """Off symmetry, so that no coordinate is right by being zero."""
    jitter = np.random.default_rng(0).normal(scale=0.02 * surface.size, size=(surface.n, 3))
    return surface.moved(surface.vertices + apply_supports(surface, 0.2 * jitter))


SURFACES = {
    "tent": tent,
    "walls under pressure": lambda: tent(pressures=(1.0, -0.4, 0.3)),
    "one pressure": lambda: tent(pressures=(1.0, 1.0, 0.0), tilted=False),
    "two squares": lambda: shaken(two_squares(4)),
    "two caps": lambda: shaken(two_caps()),
    "four fans": lambda: shaken(four_fans()),
    "names that are commands": lambda: tent(names=("\\ */ 屋 /* \\", "VERTICES", 'quit; exec "q" \\')),
}


@pytest.mark.parametrize("name", SURFACES)
def test_energy_and_gradient_agree(name):
    surface = SURFACES[name]()
    assert evolver.energy(surface) == pytest.approx(pcmc.energy(surface), rel=1e-12)
    expected = pcmc.gradient(surface)
    found = evolver.gradient(surface)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * abs(expected).max())
    assert abs(expected).max() > 0.1


def test_coordinates_arrive_to_the_last_bit():
    surface = shaken(two_squares(4))
    np.testing.assert_array_equal(evolver.positions(surface, ""), surface.vertices)


def test_full_hessian_has_the_same_inertia():
    surface = shaken(two_squares(3))
    free = np.repeat(surface.free, 3)
    sliding = np.repeat(surface.on_plane, 3) & np.tile([True, True, False], surface.n)
    H = pcmc.hessian(surface).toarray()[np.ix_(free | sliding, free | sliding)]
    values = np.linalg.eigvalsh(H)
    expected = evolver.Inertia(int((values < 0).sum()), 0, int((values > 0).sum()))
    assert expected.negative > 0
    assert evolver.inertia(surface, normal=False) == expected


def test_its_steps_lower_the_energy_and_are_timed():
    surface = two_squares(4)
    assert evolver.energy(surface, "g 20") < pcmc.energy(surface)
    times = evolver.seconds(surface, "hessian", before="g 5\nhessian_normal on", repeat=3)
    assert times.shape == (3,)
    assert (times >= 0.0).all()


def test_its_dump_is_read(tmp_path):
    surface = tent()
    dump = tmp_path / "out.dmp"
    evolver.run(surface, f'dump "{dump}"')
    again = pcmc.read(dump)
    origin = np.array(surface.plane.point)  # the dump has lost where the origin was
    np.testing.assert_allclose(again.vertices + origin, surface.vertices, atol=1e-12)
    np.testing.assert_array_equal(again.faces, surface.faces)
    np.testing.assert_array_equal(again.patch_of_face, surface.patch_of_face)
    np.testing.assert_array_equal(again.on_plane, surface.on_plane)
    np.testing.assert_array_equal(again.fixed, surface.fixed)
    assert again.tensions.tolist() == surface.tensions.tolist()
    assert again.pressures.tolist() == surface.pressures.tolist()
    assert pcmc.energy(again) == pytest.approx(pcmc.energy(surface), rel=1e-12)


def test_what_goes_wrong_is_said(monkeypatch):
    with pytest.raises(evolver.EvolverError, match="syntax error"):
        evolver.run(tent(), "frobnicate the surface")
    with pytest.raises(evolver.EvolverError, match=r"within 0\.01 s"):
        evolver.run(tent(), "g 100000000", timeout=0.01)
    monkeypatch.setattr(evolver, "PROGRAM", "no-such-program")
    assert not evolver.available()
    with pytest.raises(evolver.EvolverError, match="not installed"):
        evolver.energy(tent())


@pytest.mark.parametrize("name", ["tent", "two squares", "four fans"])
def test_its_normal_motions_are_as_many_as_ours(name):
    surface = SURFACES[name]()
    counts = evolver.inertia(surface)
    total = counts.negative + counts.zero + counts.positive
    kind, free, sliding = surface.topology.vertex_kind, surface.free, surface.on_plane
    expected = sum((d + 1) * (free & (kind == d)).sum() for d in range(3))
    expected += sum(d * (sliding & (kind == d)).sum() for d in (1, 2))
    assert total == expected
