"""Contact settles: the walls of remeshed platforms, whose feet meet resting junctions anywhere."""

import numpy as np

from pcmc import Verdict, solve
from pcmc.forces.pinching import standing_part
from pcmc.meshing.remeshing import remesh
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
