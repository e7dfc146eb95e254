"""Contact settles: the walls of remeshed platforms, whose feet meet resting junctions anywhere."""

import numpy as np

from pcmc import Verdict, check_mesh, solve
from pcmc.forces.pinching import standing_part
from pcmc.meshing.remeshing import remesh
from pcmc.plan import plan_from
from studies.corners.ends import grid_case
from tests.meshing.test_platforms import platform


def test_faces_that_a_resting_foot_folds_together_do_not_stand():
    """They cancel; left in, they pulled the next vertex of the wall down in ever smaller steps."""
    start = remesh(platform(28, 6, 73, (18,), alpha=5.2, wall=4.16, h=2.5), 0.8)
    result = solve(start)
    assert result.converged
    assert result.certificate.verdict is Verdict.STABLE
    assert len(result.certificate.pinched) == 4
    corners = np.sort(standing_part(result.surface).surface.faces, axis=1)
    assert len(np.unique(corners, axis=0)) == len(corners)


def test_a_wall_that_is_lifted_off_a_curved_bottom_comes_up_straight():
    """Between two lengths at rest the middle stands. Lifted bent, it was brought down again without end."""
    divider = {"curve": {"arc": [[4.43, 0], [5.47, 3.8], [5.62, 7.59]]}, "wall": 3.69}
    outline = [[0, 0], [8.26, 0], [9.45, 7.59], [0, 7.59]]
    plan = plan_from({"outline": outline, "dividers": [divider], "edge_length": 1.08, "tension": 4.18})
    check = check_mesh(solve(plan.surface()), 3)
    assert check.persists, check.detail
    stands = [one.walls.top_free & ~one.resting for one in map(standing_part, check.surfaces)]
    assert [mask.sum() for mask in stands] == [2, 4, 8]


def test_a_wall_that_is_lifted_for_the_first_time_stays_bent():
    """Straight at once, it comes down on its held bottom on the second of these meshes, and stays there."""
    assert grid_case([5.0, 3.0, 2.0], "held")["label"] == "has a limit: a minimum"
