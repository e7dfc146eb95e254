"""The equilibria of surfaces in closed form: their number, indices and energies, and the barriers."""

import sys
from dataclasses import replace
from importlib.util import find_spec
from types import SimpleNamespace

import numpy as np
import pytest
import volume_cases
from refusals import refused

from generators import (
    catenoid,
    catenoid_exact,
    enneper,
    enneper_exact,
    four_fans,
    spherical_cap,
    spherical_cap_exact,
    two_squares,
)
from pcmc import BoundaryMotion, Direction, Patch, Room, Surface, find_equilibria, follow, plot, solve
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.equilibria import from_known, search, shape_distance
from pcmc.equilibria.found import Equilibria, WayDown
from pcmc.explore.page_data import equilibria_data
from pcmc.forces.functional import patch_areas
from pcmc.plot import uses
from pcmc.solvers.continuation import Branch, Ending
from pcmc.solvers.result import Status

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
    found = find_equilibria(spherical_cap(0.35), (), starts=6)
    assert [one.index for one in found.found] == [0, 1]
    assert found[2].found == "by deflation"
    assert not found.branches


def test_beside_a_fold_the_cap_behind_it_is_found_though_one_step_leads_past_both():
    start, along = spherical_cap(0.3), Direction({"cap": 1.0})
    (fold,) = follow(solve(start).surface, along, step=-0.05, folds=1).folds.itertuples()
    found = find_equilibria(start.retensioned({"cap": 1.001 * fold.parameter}), along, starts=0)
    assert [one.index for one in found.found] == [0, 1]
    assert 0.0 < found.barrier(1) < 1e-3 * found[1].energy
    assert found[1].height < fold.height < found[2].height
    assert len(found.failed) == 2  # as a cap of triangles carries a little more than a round one
    assert all("only a mesh as coarse as this is at rest here" in text for text in found.failed)


def test_what_is_found_does_not_depend_on_the_unit_of_force():
    one, small = (
        find_equilibria(
            replace(spherical_cap(0.5), patches=[Patch("cap", 0.6 * unit, unit)]),
            Direction({"cap": 1.0}),
            starts=0,
        )
        for unit in (1.0, 1e-6)
    )
    assert [at.index for at in small.found] == [at.index for at in one.found] == [0, 1]
    assert 1e6 * small.barrier(1) == pytest.approx(one.barrier(1), rel=1e-6)


def catenoids(edge):
    film = catenoid(edge)
    x, y, z = film.vertices[film.fixed].T
    apart = BoundaryMotion(lambda h: np.stack([x, y, np.sign(z) * h], axis=1), start=0.5)
    return find_equilibria(film, apart, starts=0)


@pytest.mark.nightly
def test_the_wide_catenoid_breaks_over_the_deep_one():
    """The deep one gets new triangles: with those of the wide one its energy does not come nearer."""
    pytest.importorskip("mmgpy")
    wide, deep = catenoid_exact(), catenoid_exact(deep=True)
    errors = []
    for edge in (0.35, 0.175):
        found = catenoids(edge)
        assert [one.index for one in found.found] == [0, 1]
        assert found[2].certificate.quality > 0.4
        assert found.barriers[0].end == "pinches off or collapses"  # to two discs
        errors.append(abs(found.barrier(1) - (deep.energy - wide.energy)))
    assert np.log2(errors[0] / errors[1]) > 1.8
    assert errors[1] < 0.02 * (deep.energy - wide.energy)


def test_two_caps_under_one_gas_are_a_double_well():
    """V = πh(3 + h²)/6, A = π(1 + h²): the pass has equal heights, minima have h and 1/h, of equal radii."""
    h = np.array([1.25, 1.25, 1.642024, 1.0 / 1.642024])
    volumes, areas = np.pi * h * (3.0 + h**2) / 6.0, np.pi * (1.0 + h**2)
    assert volumes[:2].sum() == pytest.approx(volumes[2:].sum(), rel=1e-6)
    pair = solve(volume_cases.connected_caps(volumes[:2].sum(), 0.17), target="stationary")
    found = find_equilibria(pair, Direction(volumes={"both": 1.0}), starts=0)
    assert [one.index for one in found.found] == [0, 0, 1]
    for one, other in ((1, 2), (2, 1)):
        exact = areas[:2].sum() - areas[2:].sum()
        assert found.barrier(one, other) == pytest.approx(exact, rel=0.05)
    assert not found.failed  # both branches reach their minimum, also where a start has found it before


def test_without_mmgpy_the_deep_catenoid_keeps_its_triangles(monkeypatch):
    monkeypatch.setitem(sys.modules, "mmgpy", None)
    found = catenoids(0.35)
    assert [one.index for one in found.found] == [0, 1]
    assert found[2].certificate.quality < 0.3


@pytest.mark.skipif(find_spec("mmgpy") is None, reason="mmgpy is not installed (pcmc-surfaces[remesh])")
def test_enneper_s_surface_is_the_pass_between_two_that_are_images_of_each_other():
    found = find_equilibria(solve(enneper(0.3, radius=1.2), target="stationary"), (), starts=0)
    assert [one.index for one in found.found] == [0, 0, 1]
    assert found[1].energy == pytest.approx(found[2].energy, rel=1e-4)
    assert found[3].energy == pytest.approx(enneper_exact(radius=1.2).area, rel=0.01)
    assert found.barrier(1, 2) == pytest.approx(found[3].energy - found[1].energy, rel=1e-12)
    assert {barrier.to for barrier in found.barriers} == {1, 2}


@pytest.mark.nightly
def test_walls_that_lean_to_either_side_are_two_equilibria():
    found = find_equilibria(two_squares(8, alpha_aux=1.95), "tension of wall", starts=0, span=(0.85, 1.15))
    assert [one.index for one in found.found] == [0, 0, 0]
    upright, left, right = found.found
    assert left.energy == pytest.approx(right.energy, rel=1e-12)
    assert upright.energy < left.energy
    mirrored = left.surface.moved(left.surface.vertices * [-1.0, 1.0, 1.0])
    assert shape_distance(mirrored, right.surface) < 0.1 * shape_distance(left.surface, right.surface)
    for other in (2, 3):
        assert f"barrier from 1 to {other}: not known" in str(found)


def test_each_equilibrium_is_checked_on_finer_meshes_if_that_is_asked_for():
    found = find_equilibria(spherical_cap(0.5), (), starts=0, mesh_check=True)
    (check,) = (one.mesh_check for one in found.found)
    assert check.persists
    assert found.table.mesh.tolist() == ["persists"]
    assert " mesh " in str(found).splitlines()[0]
    assert " mesh " not in str(find_equilibria(spherical_cap(0.5), (), starts=0)).splitlines()[0]


def test_at_given_volumes_the_large_cap_is_stable_and_the_energy_is_that_of_the_film():
    large = solve(spherical_cap(0.25, upper=True, exact=True), target="stationary").surface
    closed = replace(large, rooms=[Room("inside", {"cap": 1}, 1.0)])
    found = find_equilibria(closed, "volume", starts=2)
    assert [one.index for one in found.found] == [0]
    film = float(patch_areas(found[1].surface) @ [patch.tension for patch in closed.patches])
    assert found[1].energy == pytest.approx(film, rel=1e-10)


def test_a_picture_has_the_equilibria_on_their_branches(monkeypatch):
    """Where a room prescribes a volume both have the energy at it; once the branch was lower by p V."""
    drawn, add = dict[str, Branch](), uses.add_branches

    def add_and_keep(axes, branches, x, y):
        drawn.update(branches)
        return add(axes, branches, x, y)

    monkeypatch.setattr(uses, "add_branches", add_and_keep)
    cap = spherical_cap(0.5).rebuilt(rooms=[Room("inside", {"cap": 1}, 1.0)])
    found = find_equilibria(cap, "volume", starts=0, span=(0.9, 1.1))
    plot.equilibria(found, y="energy", width=600)
    points = drawn["branch 1"].points
    assert points.energy[(points.parameter - 1.0).abs().idxmin()] == pytest.approx(found[1].energy, rel=1e-9)


# ---- shapes -------------------------------------------------------------------------------------


def test_wrong_input_is_refused():
    cap = spherical_cap(0.5)
    with refused(SurfaceError, what="surface"):
        find_equilibria("roof.toml")
    with refused(OptionError, what="along", found=3):
        find_equilibria(cap, [3])
    with refused(OptionError, what="load or tension"):
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
    with refused(OptionError, what="start", found="1"):
        caps[0].barrier("1")
    with refused(OptionError, what="to", found="1"):
        caps[0].barrier(1, "1")
    assert caps[0].barrier(1, 1) == 0.0


def test_an_index_that_rounding_hides_is_minus_one(caps):
    one = caps[0][1]
    assert replace(one, certificate=replace(one.certificate, index=None)).index == -1


def test_the_way_out_of_a_minimum_leads_to_another_shape():
    """Of the saddles beside minimum 1 the lowest leads back to it, one beside 2 is lower still."""
    shapes = [(0, 0.0), (0, 1.0), (1, 1.5), (1, 2.0), (1, 3.0)]
    found = tuple(SimpleNamespace(index=index, energy=energy) for index, energy in shapes)
    ways = [(3, 2, None), (4, 1, 1), (5, 1, 2)]
    ways = tuple(WayDown(saddle, to) for saddle, *both in ways for to in both)
    assert Equilibria(found, ways, (), {}).barrier(1) == 3.0


def test_minima_that_no_saddle_joins_are_named():
    """Over saddle 6 a way leads from 2 to 3, over 5 from 1 out of all minima; 4 has none."""
    shapes = [(index, float(energy)) for energy, index in enumerate([0, 0, 0, 0, 1, 1])]
    found = tuple(SimpleNamespace(index=index, energy=energy) for index, energy in shapes)
    ways = tuple(
        WayDown(saddle, to, "" if to else "inflates") for saddle, to in [(5, 1), (5, None), (6, 2), (6, 3)]
    )
    assert Equilibria(found, ways, (), {}).barrier_lines() == [
        "barrier from 1 over saddle 5 inflates: 4",
        "barrier from 2 over saddle 6 to 3: 4",
        "barrier from 3 over saddle 6 to 2: 3",
        "barrier from 1 to 2, 3: not known, as no saddle was found between them",
        "barrier from 1 to 4: not known, as no saddle was found between them",
    ]


def test_a_way_that_the_solver_lost_is_no_way_out():
    """Where it stalls, nobody knows what lies there; where the roof inflates, it has left the minimum."""
    shapes = [(0, 0.0), (1, 1.0), (1, 2.0)]
    found = tuple(SimpleNamespace(index=index, energy=energy) for index, energy in shapes)
    lost = WayDown(2, 1), WayDown(2, None, "stalled", lost=True)
    out = WayDown(3, 1), WayDown(3, None, "inflates without bound")
    both = Equilibria(found, (*lost, *out), (), {})
    assert both.barrier(1) == 2.0
    assert Equilibria(found, lost, (), {}).barrier(1) == np.inf


def test_a_saddle_from_which_no_way_leads_to_a_minimum_is_named():
    """A roof with two summits: whichever grows, it inflates until the coarse triangles collapse."""
    X = [[-3, -1, 0], [0, -1, 0], [3, -1, 0], [3, 1, 0], [0, 1, 0], [-3, 1, 0], [-1, 0, 1], [1, 0, 1]]
    F = [[0, 1, 6], [1, 7, 6], [1, 2, 7], [2, 3, 7], [3, 4, 7], [4, 6, 7], [4, 5, 6], [5, 0, 6]]
    roof = Surface(X, F, [0] * 8, [Patch("roof", 0.39)], fixed=range(6))
    found = find_equilibria(roof, (), starts=0)
    assert [one.index for one in found.found] == [1]
    assert not found.barriers
    assert "The 2 ways down from a saddle of index 1: pinches off or collapses (2)." in str(found)


def stopped_at(beginning):
    def stop(step):
        if step.startswith(beginning):
            raise StopIteration

    return find_equilibria(spherical_cap(0.5), callback=stop)


def test_a_search_that_is_stopped_keeps_what_it_has():
    found = stopped_at("following")
    assert found.stopped
    assert len(found) == 1
    assert "stopped before its end" in str(found)


def test_a_search_that_is_stopped_before_the_first_equilibrium_has_none():
    found = stopped_at("solving")
    assert str(found).startswith("No equilibrium was found.\n")
    assert "stopped before its end" in str(found)
    assert not equilibria_data(found)["equilibria"]
    assert plot.equilibria(found, width=300).shape[1] == 300


@pytest.mark.parametrize(("module", "name", "count"), [(search, "solve", 0), (from_known, "solve_once", 1)])
def test_ctrl_c_in_a_solve_ends_the_search(monkeypatch, module, name, count):
    """Before, that solve alone ended, as one that does not come to rest."""
    whole, stopped = getattr(module, name), []

    def interrupted(start, **options):
        stopped.append(1)
        return replace(whole(start, **options), status=Status.STOPPED)

    monkeypatch.setattr(module, name, interrupted)
    found = find_equilibria(spherical_cap(0.35), ())
    assert found.stopped
    assert len(stopped) == 1
    assert len(found) == count


def test_ctrl_c_on_the_way_to_the_present_value_ends_the_search(monkeypatch):
    def stopped(branch, row, stop):
        return replace(branch, ending=Ending.STOPPED)

    monkeypatch.setattr(Branch, "resume", stopped)
    found = find_equilibria(spherical_cap(0.35), "pressure", starts=0)
    assert found.stopped
    assert not found.failed


def test_a_search_ends_at_the_most_equilibria_that_are_wanted():
    found = find_equilibria(spherical_cap(0.25), starts=0, most=1)
    assert len(found) == 1
    assert "raise most" in str(found)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_search_that_ends_between_the_two_ways_down_has_no_barrier(monkeypatch, sign):
    """On one side of Enneper's surface is the minimum that a low start has found, on the other one more."""
    way_down = search.way_down
    monkeypatch.setattr(search, "way_down", lambda saddle, mode: way_down(saddle, sign * mode))
    saddle = solve(enneper(0.4, radius=1.2), target="stationary")
    found = find_equilibria(saddle, (), starts=0, most=2)
    assert [one.index for one in found.found] == [0, 1]
    assert not found.barriers
    assert "raise most" in str(found)


@pytest.mark.nightly
def test_walls_on_both_diameters_slip_away_from_their_balance():
    """Example 3 of the paper: each wall gets shorter as it leaves its diameter, so the index is 2."""
    found = find_equilibria(four_fans(5), (), starts=0)
    assert [one.index for one in found.found] == [2]
    assert found.failed == ("The 4 ways down from a saddle of index 2: pinches off or collapses (4).",)
