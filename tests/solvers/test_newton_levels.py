"""The geometric solver from coarse to fine: each level as if solved by itself, with memory of its own."""

import dataclasses
import gc
import weakref

import numpy as np
import pytest
from backends import every_backend

from generators import spherical_cap, two_squares
from pcmc.certificate import certificate
from pcmc.meshing.refinement import refine
from pcmc.solvers import solve_once
from pcmc.stability import equilibrium

pytestmark = every_backend


@pytest.mark.parametrize("target", ["minimum", "stationary"])
def test_levels_are_the_solutions_one_after_the_other(backend, target):
    start = two_squares(4, alpha_aux=1.0)
    options = {"target": target, "backend": backend}
    by_hand = solve_once(start, **options)
    steps_by_hand = by_hand.iterations
    for _ in range(2):
        by_hand = solve_once(refine(by_hand.surface), **options)
        steps_by_hand += by_hand.iterations + 1  # each level begins with a row of its own
    at_once = solve_once(start, levels=2, **options)
    np.testing.assert_array_equal(at_once.surface.vertices, by_hand.surface.vertices)
    np.testing.assert_array_equal(at_once.surface.faces, by_hand.surface.faces)
    assert at_once.iterations == steps_by_hand
    assert at_once.energy == by_hand.energy


def test_from_coarse_to_fine_takes_fewer_steps_on_the_finest_mesh(backend):
    coarse = two_squares(4, alpha_aux=1.0)
    rows = solve_once(coarse, levels=2, target="stationary", backend=backend).history
    alone = solve_once(refine(coarse, 2), target="stationary", backend=backend)
    assert (rows["level"] == 2).sum() - 1 < alone.iterations
    assert rows["energy"].iloc[-1] == pytest.approx(alone.energy, rel=1e-3)  # vertices lie elsewhere along it


@pytest.fixture
def factorisers(monkeypatch):
    """Those alive, counted whenever another is made."""
    made, alive = [], []
    gc.collect()
    gc.freeze()  # what other tests left need not be searched each time

    make = equilibrium.factoriser

    def factoriser(*arguments):
        gc.collect()
        alive.append(sum(each() is not None for each in made))
        new = make(*arguments)
        made.append(weakref.ref(new))
        return new

    monkeypatch.setattr(equilibrium, "factoriser", factoriser)
    yield alive
    gc.collect()
    gc.unfreeze()
    assert not any(each() is not None for each in made)


def test_one_factor_at_a_time(backend, factorisers):
    """Also where a junction comes down to Π and is lifted: the next faces begin without the last ones."""
    result = solve_once(two_squares(8, alpha_aux=2.0), target="stationary", levels=1, backend=backend)
    assert result.converged
    assert result.history["resting"].any()
    assert len(factorisers) > 2
    assert set(factorisers) == {0}


def test_a_certificate_keeps_no_factor(backend, factorisers):
    surface = solve_once(spherical_cap(0.3), backend=backend).surface
    del factorisers[:]
    assert certificate.certify(surface).certified
    assert factorisers == [0]


def test_what_was_factorised_at_rest_is_not_factorised_again(backend, factorisers):
    result = solve_once(spherical_cap(0.3), backend=backend)
    del factorisers[:]
    found, again = result.certificate, certificate.certify(result.surface)
    assert factorisers == [0]  # for the second alone; the first has given the memory back
    assert found.verdict is again.verdict
    assert found.index == again.index == 0
    np.testing.assert_allclose(found.eigenvalues, again.eigenvalues, rtol=1e-9)
    result = solve_once(spherical_cap(0.3), backend=backend)
    moved = dataclasses.replace(result, surface=two_squares(4))
    assert moved.certify().verdict.name == "NOT_CONVERGED"
