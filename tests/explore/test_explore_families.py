"""The page's colours by family are those of the panel schedule."""

from __future__ import annotations

import numpy as np

import pcmc
from generators import two_squares
from pcmc.explore.page_data import families_drawn, fields
from pcmc.explore.session import SessionState
from pcmc.panelling.families import ALIKE, family_of_face
from pcmc.surface.geometry import edge_vectors


def test_families_are_those_of_the_schedule():
    surface = pcmc.solve(two_squares(4)).surface
    roof = ~surface.walls[surface.patch_of_face]
    lengths = np.linalg.norm(edge_vectors(surface.vertices[surface.faces[roof]]), axis=2)
    schedule = pcmc.panels(surface, tolerance=ALIKE * float(lengths.mean()))
    family = family_of_face(surface)
    assert np.isnan(family[~roof]).all()
    assert np.array_equal(family, schedule.family_of_face, equal_nan=True)
    assert np.nanmax(family) == schedule.count


def test_a_sail_is_a_roof_and_declared_walls_are_not():
    sail = two_squares(4).retensioned(pressures={"left": 0.0, "right": 0.0})
    assert not sail.walls.any()
    assert pcmc.panels(sail, tolerance=0.1, anyway=True).panels.shape[0] == sail.m
    walls = sail.retensioned(walls=["left", "right", "wall"])
    assert not walls.roof.any()
    assert np.isnan(family_of_face(walls)).all()


def test_families_are_sorted_when_they_are_asked_for():
    surface = pcmc.solve(two_squares(4)).surface
    state = SessionState(surface, pcmc.certify(surface), surface)
    assert "family" not in fields(state, np.zeros(3))
    assert np.array_equal(families_drawn(state), family_of_face(surface), equal_nan=True)
