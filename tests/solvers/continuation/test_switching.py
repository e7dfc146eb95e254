"""Boundaries that move with the parameter, and branches that leave a bifurcation."""

from dataclasses import replace

import numpy as np
import pytest
from convergence import orders
from nightly import at_night
from refusals import refused
from scipy.spatial import cKDTree
from shapes import pyramid, tube

from generators import (
    catenoid,
    catenoid_exact,
    catenoid_fold,
    enneper,
    enneper_exact,
    enneper_wire,
    two_squares,
)
from pcmc import BoundaryMotion, Patch, Plane, certify, follow, solve
from pcmc.base.errors import OptionError
from pcmc.solvers.continuation import Branch, Ending
from pcmc.solvers.continuation.state import BranchMesh, BranchState


def rings(surface):
    """The rings of a catenoid, λ half their distance."""
    x, y, z = surface.vertices[surface.fixed].T
    return lambda h: np.stack([x, y, np.sign(z) * h], axis=1)


def wire(surface):
    """Enneper's wire of radius λ."""
    count = int(surface.fixed.sum())
    return lambda radius: enneper_wire(radius, 2.0 * np.pi * np.arange(count) / count)


# ---- a boundary that moves ----------------------------------------------------------------------


@pytest.fixture(scope="module")
def catenoids():
    """Branches from half-distance 0.5 through the fold, on three meshes."""
    starts = [solve(catenoid(2.0 * np.pi / around)).surface for around in (20, 40, 80)]
    return [follow(start, BoundaryMotion(rings(start), 0.5), step=0.05, folds=1) for start in starts]


@pytest.mark.nightly
def test_catenoids_fold_at_the_widest_distance_with_second_order(catenoids):
    assert [branch.ending for branch in catenoids] == [Ending.FOLDS] * 3
    error = np.array([branch.folds.parameter[0] for branch in catenoids]) - catenoid_fold()
    assert orders(error)[-1] == pytest.approx(2.0, abs=0.2)
    for branch in catenoids:
        change = branch.events[branch.events.kind == "index"].iloc[0]
        assert (change.index_before, change.index_after) == (0, 1)
        assert change.parameter == pytest.approx(branch.folds.parameter[0], rel=1e-3)
        assert change.along_branch > 0.9
        assert branch.bifurcations.empty


def test_half_a_film_at_a_mirror_folds_where_the_whole_does():
    """Its triangles follow the ring as those of the whole; once a row at the mirror took all the stretch."""
    patch, half = Patch("film", 1.0, 0.0), 0.5
    mirror = {"fixed": range(72, 84), "on_planes": {Plane(mirror=True): range(12)}}
    film = tube(6, 12, lambda t: (0.85 + 0.15 * t**2, half * t), patch, **mirror)
    whole = tube(12, 12, lambda t: (0.85 + 0.15 * (2.0 * t - 1.0) ** 2, half * (2.0 * t - 1.0)), patch)
    starts = [solve(one).surface for one in (film, whole)]
    folds = [follow(s, BoundaryMotion(rings(s), half), folds=1).folds.parameter[0] for s in starts]
    assert folds[0] == pytest.approx(folds[1], rel=1e-4)


def test_every_point_is_the_catenoid_between_its_rings(catenoids):
    error = []
    for branch in catenoids:
        row = (branch.points.parameter - 0.6).abs().idxmin()
        point, surface = branch.points.loc[row], branch.surfaces[row]
        z = surface.vertices[surface.fixed, 2]
        assert np.abs(z) == pytest.approx(point.parameter, rel=1e-14)
        found = certify(surface)
        assert found.energy == pytest.approx(point.energy, rel=1e-12)
        assert found.residual <= 1e-9
        exact = catenoid_exact(half_distance=point.parameter)
        error.append(exact.distance(surface).max())
    assert orders(error) == pytest.approx(2.0, abs=0.35)


def moving_state(edge=0.4):
    surface = solve(enneper(edge)).surface
    line = BoundaryMotion(wire(surface), 0.8).line(surface)
    mesh = BranchMesh(surface, line)
    X = surface.vertices.copy()
    X[surface.free] += 0.01 * np.random.default_rng(3).standard_normal((surface.free.sum(), 3))
    return BranchState(mesh, X, 0.8)


def test_forces_change_with_the_boundary_as_their_derivative_says():
    at = moving_state()
    error = []
    for change in (1e-2, 1e-3):
        ahead = at.step(change * at.carried, at.parameter + change)
        force = ahead.rest.unbalanced
        turned = at.rest.space.to_coordinates(force) - at.rest.forces
        error.append(np.linalg.norm(turned - change * at.parameter_derivative))
        assert ahead.X[at.mesh.surface.fixed] == pytest.approx(wire(at.mesh.surface)(0.8 + change))
    assert np.log10(error[0] / error[1]) == pytest.approx(2.0, abs=0.1)


def test_energy_changes_with_the_boundary_as_the_reactions_say():
    slope = []
    for edge in (0.2, 0.1):
        surface = solve(enneper(edge)).surface
        line = BoundaryMotion(wire(surface), 0.8).line(surface)
        slope.append(line.energy_derivative(surface, surface.vertices, 0.8))
    exact = np.pi * (2 * 0.8 + 4 * 0.8**3 + 2 * 0.8**5)
    assert orders(np.array(slope) - exact) == pytest.approx(2.0, abs=0.5)
    assert slope[-1] == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize("name", [*at_night("energy"), "volume", *at_night("height")])
def test_goals_are_met_while_the_boundary_moves(name):
    start = solve(enneper(0.3)).surface
    motion = BoundaryMotion(wire(start), 0.8)
    if name == "volume":
        start = start.retensioned(pressures={"film": 0.01})
        start = solve(start).surface
    branch = follow(start, motion, 0.9, step=0.03)
    goal = float(branch.points[name].iloc[[0, -1]].mean())
    met = follow(start, motion, until={name: goal}, step=0.03)
    assert met.ending is Ending.REACHED
    assert met.points[name].iloc[-1] == pytest.approx(goal, rel=1e-9, abs=1e-12)


def test_wrong_boundaries_are_refused():
    film = solve(catenoid(0.5)).surface
    at = rings(film)
    with refused(OptionError, what="BoundaryMotion.positions", found=3):
        BoundaryMotion(3, 0.5)
    with refused(OptionError, what="BoundaryMotion.start", found="0.5"):
        BoundaryMotion(at, "0.5")
    with refused(OptionError, what="positions", where=0):
        follow(film, BoundaryMotion(at, 0.4))
    with refused(OptionError, what="BoundaryMotion.positions(0.5)"):
        follow(film, BoundaryMotion(lambda h: at(h)[1:], 0.5))
    with refused(OptionError, what="BoundaryMotion.positions(0.5)"):
        follow(film, BoundaryMotion(lambda h: at(h) * np.nan, 0.5))
    with refused(OptionError, what="remesh", found=0.3):
        follow(film, BoundaryMotion(at, 0.5), remesh=0.3)
    loose = pyramid(fixed=(), on_plane=range(4))
    with refused(OptionError, what="parameter", found=0):
        follow(loose, BoundaryMotion(at, 0.5))


# ---- Enneper's wire: a pitchfork at R = 1 -------------------------------------------------------


@pytest.fixture(scope="module")
def ennepers():
    """Enneper's branch through R = 1 on three meshes."""
    branches = []
    for steps in (5, 10, 20):
        start = solve(enneper((0.85 + 0.85**3 / 3.0) / steps, radius=0.85), target="stationary").surface
        branches.append(follow(start, BoundaryMotion(wire(start), 0.85), 1.2, step=0.05))
    return branches


@pytest.mark.nightly
def test_enneper_s_surface_turns_unstable_at_its_hemisphere_with_second_order(ennepers):
    radius = []
    for branch in ennepers:
        (event,) = branch.bifurcations.index
        row = branch.events.loc[event]
        assert (row.index_before, row.index_after) == (0, 1)
        assert row.along_branch < 1e-6
        assert certify(branch.event_surfaces[event]).residual < 1e-8
        radius.append(row.parameter)
    assert orders(np.array(radius) - 1.0) == pytest.approx(2.0, abs=0.2)
    extrapolated = radius[-1] + (radius[-1] - radius[-2]) / 3.0
    assert extrapolated == pytest.approx(1.0, abs=1e-3)


@pytest.mark.nightly
def test_two_more_surfaces_of_less_area_leave_it(ennepers):
    area = []
    for branch in ennepers[:2]:
        two = branch.switch(stop=1.2)
        for other in two:
            assert other.ending is Ending.REACHED
            assert (other.points["index"] == 0).all()
            assert other.points.parameter.iloc[-1] == 1.2
            assert (other.points.parameter >= branch.bifurcations.parameter.iloc[0]).all()
        one, another = (other.last for other in two)
        assert two[0].points.energy.iloc[-1] == pytest.approx(two[1].points.energy.iloc[-1], rel=1e-9)
        quarter_turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
        assert cKDTree(another.vertices).query(one.vertices @ quarter_turn.T)[0].max() < 1e-6
        assert np.abs(one.vertices - another.vertices).max() > 0.3
        assert two[0].points.energy.iloc[-1] < branch.points.energy.iloc[-1] - 0.2
        area.append(enneper_exact(radius=1.2).area - two[0].points.energy.iloc[-1])
        assert certify(one).index == 0
    assert area[1] == pytest.approx(area[0], rel=0.5)


def test_near_the_bifurcation_the_radius_grows_with_the_square_of_the_distance(ennepers):
    steps = (0.02, 0.01, 0.005)
    radius = [ennepers[0].switch(step=step, steps=0)[0].points.parameter.iloc[0] for step in steps]
    assert np.log2(np.diff(radius)[0] / np.diff(radius)[1]) == pytest.approx(2.0, abs=0.05)


# ---- a wall that leans: a pitchfork in a tension, with a junction ---------------------------------


def test_a_wall_that_pulls_too_hard_leans_to_either_side():
    start = solve(two_squares(8, alpha_aux=1.8), target="stationary").surface
    branch = follow(start, "wall", 2.2)
    one, other = branch.switch(steps=3)
    (event,) = branch.bifurcations.index
    mirrored = other.last.vertices * [-1.0, 1.0, 1.0]
    assert cKDTree(mirrored).query(one.last.vertices)[0].max() < 1e-6
    wall = one.last.topology.junctions[0].vertices
    assert np.abs(one.last.vertices[wall, 0]).max() > 0.05
    for leaning in (one, other):
        assert (leaning.points["index"] == 1).all()
        assert (leaning.points.parameter < branch.events.parameter[event]).all()  # it bends back


# ---- where nothing leaves -----------------------------------------------------------------------


def test_switching_where_no_branch_leaves_is_refused(catenoids, ennepers):
    fold = catenoids[0]
    kinds = fold.events.kind.tolist()
    with refused(OptionError, what="event", expected="a bifurcation"):
        fold.switch()
    for kind in ("fold", "index"):  # the index changes at the fold, too
        with refused(OptionError, what="event", where=kinds.index(kind), found="fold"):
            fold.switch(kinds.index(kind))
    with refused(OptionError, what="event", found=7):
        fold.switch(7)
    with refused(OptionError, what="event", found=-1):
        fold.switch(-1)
    branch = ennepers[0]
    elsewhere = replace(branch, event_surfaces={0: branch.surfaces[0]})
    elsewhere = replace(elsewhere, events=branch.events.assign(parameter=0.85))
    with refused(OptionError, what="event", where=0, expected=0.0):
        elsewhere.switch()
    both = replace(branch, events=branch.events.assign(index_after=2))
    with refused(OptionError, what="event", where=0, found="2 modes that turn at once"):
        both.switch()
    contact = replace(branch, events=branch.events.assign(kind="contact", along_branch=np.nan))
    with refused(OptionError, what="event", where=0, found="contact"):
        contact.switch(0)
    tables = Branch(branch.parameter, branch.points, branch.events, {}, branch.ending)
    with refused(OptionError, what="branch"):
        tables.switch()
    with refused(OptionError, what="option of method 'switch'", found="lenght"):
        branch.switch(lenght=1.0)
