"""Walls in an upright plane: strong ones come down on their bottom, and the plane takes the pull across."""

from dataclasses import replace

import numpy as np
import pytest

from generators.grid import grid_faces
from pcmc import Patch, Plane, Surface, Verdict, energy, solve
from pcmc.forces.functional import energy_and_gradient
from pcmc.forces.pinching import lift, pull_and_capacity, pull_directions, standing_part
from pcmc.forces.wall_rows import find_walls
from pcmc.plan import Divider, Plan


def hall(east, wall, upright=True, edge_length=0.8):
    """Two bays of 6 by 8 with tensions 6 and ``east``, and a wall between them."""
    patches = {"west": {"tension": 6.0}, "east": {"tension": east}}
    divider = Divider([[6, 0], [6, 8]], wall=wall, upright=upright)
    outline = [[0, 0], [12, 0], [12, 8], [0, 8]]
    return Plan(outline, [divider], edge_length=edge_length, patches=patches).surface()


def test_a_strong_upright_wall_comes_down_as_any_other():
    """On the bottom all along both are the two roofs of the bays alone."""
    upright, free = solve(hall(2.0, 9.0)), solve(hall(2.0, 9.0, upright=False))
    assert upright.certificate.verdict is free.certificate.verdict is Verdict.STABLE
    at_rest = standing_part(upright.surface).resting
    assert at_rest.sum() == standing_part(free.surface).resting.sum() == 9
    assert upright.energy == pytest.approx(free.energy, rel=1e-4)
    # one line holds the junction, and the plane nothing
    rows = [result.certificate.supports[["name", "kind"]].to_numpy().tolist() for result in (upright, free)]
    assert rows[0] == rows[1]
    assert rows[0][-1] == ["west | east | wall 1", "line"]


def test_the_plane_of_an_upright_wall_takes_the_pull_across_it():
    """Sheets of 6 and 2 pull across with 4, which a wall of 3.5 alone cannot hold."""
    found = solve(hall(2.0, 3.5, edge_length=0.5))
    assert found.certificate.verdict is Verdict.STABLE
    part = standing_part(found.surface)
    assert 0 < part.resting.sum() < 9
    pull, capacity = pull_and_capacity(part)
    assert (np.abs(pull) <= capacity)[part.resting].all()
    force = -energy_and_gradient(part.surface, supports=False)[1]
    direction = pull_directions(part, force)[part.resting]
    assert np.allclose(direction, [0.0, 0.0, 1.0])
    assert (np.linalg.norm(force[part.resting], axis=1) > capacity[part.resting]).all()
    supports = found.certificate.supports.set_index("kind")
    assert supports.loc["upright plane", "force_x"] > 20.0
    assert found.certificate.balance["force_share"].iloc[-1] < 0.005


@pytest.mark.parametrize("upright", [(True, True), (True, False), (False, True)])
def test_upright_walls_that_meet_come_down_together(upright):
    lines = [[[9, 0], [9, 8]], [[9, 4], [16, 4]]]
    dividers = [Divider(line, wall=8.0, upright=up) for line, up in zip(lines, upright, strict=True)]
    patches = {"a": {"tension": 3.2, "at": [3, 3]}, "b": {"tension": 1.9, "at": [12, 2]}}
    patches["c"] = {"tension": 2.1, "at": [12, 6]}
    plan = Plan([[0, 0], [16, 0], [16, 8], [0, 8]], dividers, edge_length=0.8, patches=patches)
    found = solve(plan.surface())
    assert found.certificate.verdict is Verdict.STABLE
    walls = find_walls(found.surface)
    assert standing_part(found.surface).resting[walls.held].all()
    assert walls.meeting.sum() == 1


def leaning(lean, wall):
    """Two sheets on three fixed sides; the fourth and the end of their wall slide on a plane that leans."""
    x, y = (part.ravel() for part in np.meshgrid(np.linspace(-2, 2, 5), np.linspace(0, 2, 3), indexing="ij"))
    z = 0.1 * (4 - x**2) * (2 - y)
    X = np.column_stack([x, np.where(y == 0, -lean * z, y), z])
    X = np.concatenate([X, [[0, 0, 0], [0, 1, 0]]])
    faces = [*grid_faces(4, 2).tolist(), [6, 7, 16], [6, 16, 15], [7, 8, 16]]
    patches = [Patch("west", 2.0), Patch("east", 2.0), Patch("wall", wall, 0.0)]
    fixed, side = np.append((np.abs(x) == 2) | (y == 2), [False, False]), np.append(y == 0, [True, False])
    planes = {Plane((0, 0, 0), (0, 1, lean)): side}
    return Surface(X, faces, [0] * 8 + [1] * 8 + [2] * 3, patches, fixed, [15, 16], on_planes=planes)


@pytest.mark.parametrize(
    ("lean", "wall", "at_rest"), [(0.3, 1.0, [6]), (0.3, 2.0, [6, 7]), (-0.3, 4.0, [6, 7])]
)
def test_in_a_leaning_plane_a_junction_comes_down_along_it(lean, wall, at_rest):
    """The pull and what the wall takes are those of a short lift along the plane."""
    found = solve(leaning(lean, wall), target="stationary")
    assert found.converged
    part = standing_part(found.surface)
    assert np.flatnonzero(part.resting).tolist() == at_rest
    pull, capacity = pull_and_capacity(part)
    for side in (1.0, -1.0):
        walls = replace(part.walls, side=side * part.walls.side)
        for v in at_rest:
            lifted = lift(found.surface, walls, np.arange(found.surface.n) == v, 1e-6)
            rise = abs(lifted.vertices[v, 2])
            slope = (energy(lifted) - found.energy) / rise
            assert slope == pytest.approx(capacity[v] - side * pull[v], rel=1e-4)
