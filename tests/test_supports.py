"""The table of supports: its rows add up to the loads, in forces and in moments."""

from __future__ import annotations

import numpy as np
import pytest

import pcmc
from generators import two_squares
from pcmc import Cable, Patch, Plane, Surface, cut
from pcmc.contact.pinching import standing_part
from pcmc.plan import CableLine, Divider, Hole, Plan
from pcmc.surface.geometry import area_vectors

FORCE, MOMENT = ["force_x", "force_y", "force_z"], ["moment_x", "moment_y", "moment_z"]
ROOMS = {"south east": [9, 1, 1.0], "north": [6, 5, 1.2], "south west": [3, 1, 0.8]}
MAST = {"supports": [[0, 0, 0], [8, 0, 1], [8, 6, 0], [0, 6, 1]]}
SIDES = [[[0, 0, 0], [8, 0, 1]], [[8, 0, 1], [8, 6, 0]]]


def hall_of_upright_walls():
    """Three upright walls meet over rooms of different pressures."""
    ends = {"a": [6, 0], "b": [12, 4], "c": [0, 4]}
    walls = [
        Divider([end, [6, 3]], 0.8, name, upright=True) for name, end in ends.items()
    ]
    rooms = {name: {"tension": 4.0, "pressure": p, "at": [x, y]} for name, (x, y, p) in ROOMS.items()}
    return Plan([[0, 0], [12, 0], [12, 6], [0, 6]], walls, edge_length=1.0, patches=rooms).surface()


def half_with_mirror():
    """Half a hall whose wall leans, cut at a mirror plane, under snow."""
    whole = Plan([[0, 0], [9, 0], [9, 4], [0, 4]], [Divider([[4, 0], [4, 4]])], edge_length=0.7, tension=4.0)
    return cut(whole.surface().with_snow(0.3), Plane((0, 2, 0), (0, 1, 0), "middle", mirror=True))


def on_masts(**more):
    """A sail of some weight between cables, on four masts."""
    sail = {"roof": {"tension": 4.0, "pressure": 0.0, "weight": 0.2}}
    options = {"edge": "cable", "cable": 30.0, "patches": sail} | MAST | more
    return Plan([[0, 0], [8, 0], [8, 6], [0, 6]], edge_length=1.0, **options).surface()


def cables_between_walls():
    """Three raised sides are held, a cable along the fourth ends on them; inside, a mast and a line."""
    inside = [[4, 3, 1.5], [[2, 2, 0.8], [2, 4, 0.8]]]
    sides = [[8, 0, 1], [8, 6, 0], [0, 6, 1], [0, 0, 0.5]]
    sail = {"roof": {"tension": 4.0, "pressure": 0.0, "weight": 0.2}}
    outline = [*sides[3:], *sides[:3]]
    free = [CableLine([[0, 0], [8, 0]], 30.0)]
    return Plan(outline, edge_length=1.0, patches=sail, supports=inside, cables=free).surface()


def resting():
    """Two squares over a wall that is so strong that it is pinched."""
    return two_squares(6, alpha_aux=3.0)


CASES = {
    hall_of_upright_walls: {"line": 6, "ground": 3, "upright plane": 3},
    half_with_mirror: {"line": 4, "mirror": 3},
    on_masts: {"point": 4},
    cables_between_walls: {"line": 2, "point": 1, "cable end": 2},
    resting: {"line": 2, "ground": 1},
}


@pytest.mark.parametrize("case", CASES)
def test_the_rows_add_up_to_the_loads(case):
    result = pcmc.solve(case(), target="stationary")
    found, standing = result.certify(), standing_part(result.surface).surface
    table, balance = found.supports, found.balance
    print(found)
