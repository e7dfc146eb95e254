"""The page's colours by family are those of the panel schedule."""

from __future__ import annotations

import numpy as np

import pcmc
from generators import two_squares
from pcmc.explore.page_data import ALIKE, family_of_face
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


def test_a_surface_of_walls_alone_has_no_families():
    surface = two_squares(4)
    walls = surface.retensioned(pressures={"left": 0.0, "right": 0.0})
    assert np.isnan(family_of_face(walls)).all()
