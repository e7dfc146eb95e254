"""Strips sewn together again in CalculiX: the roof comes back to its shape, the stress to α/t."""

import numpy as np
import pytest
from programs import needs_ccx

from generators import spherical_cap
from pcmc import cutting_pattern, solve
from pcmc.plan import Plan
from pcmc.surface.geometry import face_areas
from studies.questions.cloth import (
    EXTENSION,
    POISSON,
    blown_up,
    cloth_forces,
    compared,
    membrane,
    sewn_together,
)


def sewn(count, part=1.0):
    """The sewn cap, its cloth's forces and α; the cut corners times ``part``."""
    roof = solve(spherical_cap(0.1, alpha=0.8)).surface
    alpha = float(roof.tensions[0])
    stiffness = (1.0 - POISSON) * alpha / EXTENSION
    pattern = cutting_pattern(roof, strips=count, stiffness=(stiffness, stiffness), poisson=POISSON)
    surface, cut = sewn_together(pattern)
    return surface, cloth_forces(surface, part * cut, stiffness), alpha, stiffness


@pytest.mark.nightly
def test_the_cloth_of_a_sewn_roof_carries_about_its_tension():
    surface, forces, alpha, stiffness = sewn(6)
    assert len(np.unique(surface.topology.boundary_edge)) == 2
    assert (surface.topology.valence <= 2).all()  # sewn, without a gap
    pulls = np.linalg.eigvalsh(forces)
    assert np.abs(pulls[:, 0]).max() < 1e-9  # nothing across the membrane
    area = face_areas(surface.vertices[surface.faces])
    assert area @ pulls[:, 1:].mean(axis=1) / area.sum() == pytest.approx(alpha, rel=0.02)
    longer = sewn(6, part=1.001)[1]  # cloth cut longer by 0.1 % pulls less by E t / (1 - ν) · 0.1 %
    less = 0.001 * (1.0 + EXTENSION) / 1.001 * stiffness / (1.0 - POISSON)
    assert np.linalg.eigvalsh(longer)[:, 1:].mean() == pytest.approx(pulls[:, 1:].mean() - less, rel=1e-3)


@needs_ccx
def test_a_sewn_roof_comes_back_to_its_shape():
    surface, forces, _, stiffness = sewn(6)
    model = membrane(surface, stiffness)
    found = compared(model, blown_up(model, forces))
    assert found["shape"] < 1e-3
    assert abs(found["stress_mean"]) < 0.02
    assert found["stress_least"] > 0.0  # no slack


def test_both_sheets_of_a_cushion_are_sewn_at_their_rim():
    plan = Plan([[0, 0], [3, 0], [3, 2], [0, 2]], edge_length=0.2, tension=1.6, cushion=1.5)
    pattern = cutting_pattern(solve(plan.surface()).surface, strips=3, compensation=(0.0, 0.0))
    surface, _ = sewn_together(pattern)
    assert (surface.topology.valence == 2).all()
    assert surface.vertices[surface.fixed, 2] == pytest.approx(0.0, abs=1e-9)
    assert set(surface.patch_of_face) == {0, 1}
