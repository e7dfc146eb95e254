"""Surface Evolver, started from our finished surfaces on the same mesh, finds nothing left to do."""

from functools import partial

import numpy as np
import pytest
from nightly import at_night
from programs import needs_evolver
from starts import (
    bezier_hall,
    double_bubble,
    four_fans,
    joined_caps,
    sphere,
    spherical_cap,
    stationary,
    three_patches,
    two_caps,
    two_squares,
)

from pcmc import solve
from studies.reference import evolver

pytestmark = [
    needs_evolver,
    pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning"),
]
WEAK = {"alpha_left": 4.0, "alpha_right": 4.0, "alpha_aux": 1.0, "depth": 5.0}
NEWTON = "hessian_normal on\nhessian"

# name: (surface, its index)
CASES = {
    "two squares, 4": (partial(two_squares, 4, alpha_aux=1.0), 0),
    "two squares, 8": (partial(two_squares, 8, alpha_aux=1.0), 0),
    "two squares, wall of 2": (partial(two_squares, 8, alpha_aux=2.0), 0),
    "two caps": (partial(two_caps, 0.8), 0),
    "four fans, stable": (partial(four_fans, 4, alpha_aux=2.0), 0),
    "four fans": (partial(four_fans, 7), 2),
    "hall": (partial(bezier_hall, 8.0), 0),
    "Fig. 4": (partial(three_patches, 8), 2),
    "cap, 0.5": (partial(spherical_cap, 0.5), 0),
    "cap, 0.25": (partial(spherical_cap, 0.25), 0),
    "joined caps": (partial(joined_caps, 1.0), 0),
    "joined caps, weak wall": (partial(joined_caps, 1.0, **WEAK), 1),
    "sphere": (partial(sphere, 0.8), 1),
    "double bubble": (partial(double_bubble, 0.8), 2),
}
FINER = {
    "two squares": (partial(two_squares, 32, alpha_aux=1.0), 0),
    "four fans": (partial(four_fans, 14), 2),
    "hall": (partial(bezier_hall), 0),
    "joined caps": (partial(joined_caps, 0.5), 0),
    "joined caps, weak wall": (partial(joined_caps, 0.5, **WEAK), 1),
    "cap": (partial(spherical_cap, 0.05), 0),
}


def agrees(make, index):
    result = stationary(make)
    assert result.converged
    assert result.certificate.index == index
    before = evolver.energy(result.surface)
    assert before == pytest.approx(result.energy, rel=1e-12)
    after = evolver.energy(result.surface, NEWTON)
    assert after == pytest.approx(before, rel=1e-12)  # asked: 1e-7 on the coarsest meshes
    counts = evolver.inertia(result.surface)
    assert (counts.negative, counts.zero) == (index, 0)


@pytest.mark.parametrize("name", CASES)
def test_it_has_nothing_left_to_do(name):
    agrees(*CASES[name])


@pytest.mark.parametrize("name", [next(iter(FINER)), *at_night(*list(FINER)[1:])])
def test_nor_on_finer_meshes(name):
    agrees(*FINER[name])


def test_a_wall_without_tension():
    result = solve(two_squares(8, alpha_aux=0.0))
    before = evolver.energy(result.surface)
    assert before == pytest.approx(result.energy, rel=1e-12)
    assert evolver.energy(result.surface, NEWTON) == pytest.approx(before, rel=1e-7)


def test_it_would_have_something_to_do_a_little_way_off():
    """The same questions a thousandth of the size away: the step does lower the energy."""
    surface = solve(two_squares(8, alpha_aux=1.0)).surface
    X = surface.vertices.copy()
    X[surface.free, 2] += 1e-3 * surface.size
    before = evolver.energy(surface.moved(X))
    after = evolver.energy(surface.moved(X), NEWTON)
    assert before - after > 1e-5 * before


def test_its_step_is_ours():
    """From where the residual is small, one step of each ends in the same energy."""
    far = solve(two_squares(6, alpha_aux=1.0), iterations=2)
    assert 1e-9 < far.history["residual"].iloc[-1] < 1e-2
    done = solve(far.surface)
    theirs = evolver.energy(far.surface, NEWTON + "\nhessian\nhessian")
    assert theirs == pytest.approx(done.energy, rel=1e-7)
    assert np.isfinite(theirs)
