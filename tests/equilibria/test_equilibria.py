"""The equilibria of surfaces in closed form: their number, indices and energies, and the barriers."""

import numpy as np
import pytest
from refusals import refused

from generators import (
    catenoid,
    catenoid_exact,
    cylinder,
    enneper,
    enneper_exact,
    spherical_cap,
    spherical_cap_exact,
)
from pcmc import BoundaryMotion, Direction, find_equilibria, solve
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.equilibria import shape_distance
from studies.reference import evolver

SMALL, LARGE = spherical_cap_exact(), spherical_cap_exact(upper=True)


@pytest.fixture(scope="module")
def caps():
    return [find_equilibria(spherical_cap(edge), starts=0) for edge in (0.25, 0.125)]


def test_two_caps_stand_over_a_circle_and_only_the_small_one_is_stable(caps):
    for found in caps:
        assert [one.index for one in found.found] == [0, 1]
        assert found.stable == (1,)
        assert len(found.branches["pressure"]) == 1
        assert len(found.branches["pressure"][0].folds) == 1
        assert found.table.verdict.tolist() == ["stable", "saddle"]
    assert caps[1][1].height == pytest.approx(SMALL.height, rel=0.01)
    assert caps[1][2].height == pytest.approx(LARGE.height, rel=0.05)


def test_the_barrier_is_the_difference_of_their_energies_with_second_order(caps):
    exact = LARGE.energy - SMALL.energy
    error = np.array([found.barrier(1) - exact for found in caps])
    assert np.log2(error[0] / error[1]) == pytest.approx(2.0, abs=0.2)
    assert (4.0 * error[1] - error[0]) / 3.0 == pytest.approx(0.0, abs=0.01 * exact)


def test_beyond_the_large_cap_the_way_down_has_no_end(caps):
    (barrier,) = caps[0].barriers
    assert (barrier.start, barrier.saddle, barrier.to) == (1, 2, None)
    assert barrier.end == "inflates without bound"
    text = str(caps[0])
    assert "barrier from 1 over saddle 2 inflates without bound" in text
    assert "No search of this kind proves" in text


def test_deflation_alone_finds_the_large_cap():
    found = find_equilibria(spherical_cap(0.25), (), starts=6)
    assert [one.index for one in found.found] == [0, 1]
    assert found[2].found == "by deflation"
    assert not found.branches


def test_the_wide_catenoid_breaks_over_the_deep_one():
    film = catenoid(0.35)
    x, y, z = film.vertices[film.fixed].T
    apart = BoundaryMotion(lambda h: np.stack([x, y, np.sign(z) * h], axis=1), start=0.5)
    found = find_equilibria(film, apart, starts=0)
    wide, deep = catenoid_exact(), catenoid_exact(deep=True)
    assert [one.index for one in found.found] == [0, 1]
    assert found[1].energy == pytest.approx(wide.energy, rel=0.02)
    assert found[2].energy == pytest.approx(deep.energy, rel=0.02)
    assert found.barriers[0].end == "pinches off or collapses"  # to two discs


def test_enneper_s_surface_is_the_pass_between_two_that_are_images_of_each_other():
    found = find_equilibria(solve(enneper(0.3, radius=1.2), target="stationary"), (), starts=0)
    assert [one.index for one in found.found] == [0, 0, 1]
    assert found[1].energy == pytest.approx(found[2].energy, rel=1e-4)
    assert found[3].energy == pytest.approx(enneper_exact(radius=1.2).area, rel=0.01)
    assert found.barrier(1, 2) == pytest.approx(found[3].energy - found[1].energy, rel=1e-12)
    assert {barrier.to for barrier in found.barriers} == {1, 2}


@pytest.mark.skipif(not evolver.available(), reason="Surface Evolver is not installed")
def test_two_unduloids_leave_the_cylinder_of_length_2_pi():
    """The index of the cylinder rises where L = 2πR; both lean back over shorter cylinders."""
    edge, length = 2.0 * np.pi / 14, 6.0
    tube = cylinder(edge, length=length, exact=True)
    tube = solve(tube.moved(tube.vertices - [0.0, 0.0, 0.5 * length]), target="stationary").surface
    x, y, z = tube.vertices[tube.fixed].T
    longer = BoundaryMotion(lambda L: np.stack([x, y, 0.5 * np.sign(z) * L], axis=1), start=length)
    found = find_equilibria(tube, longer, starts=0, span=(5.8, 6.6))
    assert [one.index for one in found.found] == [1, 2, 2]
    assert found[2].energy == pytest.approx(found[3].energy, rel=1e-6)
    cylinders, one, other = found.branches["boundary"]
    assert cylinders.bifurcations.parameter.iloc[0] == pytest.approx(2.0 * np.pi, rel=0.01)
    assert one.points.parameter[0] == other.points.parameter[0] == cylinders.bifurcations.parameter.iloc[0]
    assert [evolver.inertia(one.surface).negative for one in found.found] == [1, 2, 2]


# ---- shapes -------------------------------------------------------------------------------------


def turned(surface, angle):
    """A cap with its inside turned about z: the same shape, other vertices on it."""
    X = surface.vertices.copy()
    c, s = np.cos(angle), np.sin(angle)
    inside = ~surface.fixed
    X[inside, :2] = X[inside, :2] @ np.array([[c, s], [-s, c]])
    return surface.moved(X)


def test_vertices_that_slide_along_a_shape_change_it_to_second_order():
    surfaces = {edge: spherical_cap(edge, exact=True) for edge in (0.2, 0.1)}
    same = [shape_distance(surface, turned(surface, 0.25 * edge)) for edge, surface in surfaces.items()]
    assert same[0] < 0.02 * 0.2
    assert np.log2(same[0] / same[1]) == pytest.approx(2.0, abs=0.5)
    other = spherical_cap(0.1, height=0.7)
    assert shape_distance(surfaces[0.1], other) == pytest.approx(0.1, rel=0.4)


def test_the_distance_is_symmetric_and_as_long_as_the_unit():
    one, other = spherical_cap(0.25), spherical_cap(0.2, height=0.5)
    there = shape_distance(one, other)
    assert shape_distance(other, one) == pytest.approx(there, rel=1e-14)
    scaled = [surface.moved(3.0 * surface.vertices) for surface in (one, other)]
    assert shape_distance(*scaled) == pytest.approx(3.0 * there, rel=1e-12)


# ---- what is refused, and stopping ----------------------------------------------------------------


def test_wrong_input_is_refused():
    cap = spherical_cap(0.5)
    with refused(SurfaceError, what="surface"):
        find_equilibria("roof.toml")
    with refused(OptionError, what="along", found=3):
        find_equilibria(cap, [3])
    with refused(OptionError, what="what"):
        find_equilibria(cap, "pressures")
    with refused(OptionError, what="span"):
        find_equilibria(cap, span=(1.2, 1.5))
    with refused(OptionError, what="span"):
        find_equilibria(cap, span=0.5)
    with refused(OptionError, what="most"):
        find_equilibria(cap, most=0)
    with refused(OptionError, what="callback"):
        find_equilibria(cap, callback=3)
    with refused(SurfaceError, what="surface", found="NO_EQUILIBRIUM"):
        find_equilibria(spherical_cap(0.5, alpha=0.3))


def test_numbers_of_equilibria_are_checked(caps):
    with refused(OptionError, what="number"):
        caps[0][3]
    with refused(OptionError, what="start"):
        caps[0].barrier(2)
    with refused(OptionError, what="to"):
        caps[0].barrier(1, 2)
    assert caps[0].barrier(1, 1) == 0.0


def test_a_search_that_is_stopped_keeps_what_it_has():
    def stop(step):
        if step.startswith("following"):
            raise StopIteration

    found = find_equilibria(spherical_cap(0.5), callback=stop)
    assert found.stopped
    assert len(found) == 1
    assert "stopped before its end" in str(found)


def test_a_search_ends_at_the_most_equilibria_that_are_wanted():
    found = find_equilibria(spherical_cap(0.25), starts=0, most=1)
    assert len(found) == 1
    assert "raise most" in str(found)


def test_the_line_may_be_a_direction_and_the_boundary():
    cap = spherical_cap(0.25)
    found = find_equilibria(cap, [Direction(pressures={"cap": 1.0})], starts=0)
    assert [one.index for one in found.found] == [0, 1]
    ring = cap.vertices[cap.fixed]
    wider = BoundaryMotion(lambda radius: ring * [radius, radius, 1.0], start=1.0)
    found = find_equilibria(cap, wider, starts=0)
    assert [one.index for one in found.found] == [0, 1]
    assert found.branches["boundary"][0].folds.parameter[0] == pytest.approx(1.2, abs=0.05)
