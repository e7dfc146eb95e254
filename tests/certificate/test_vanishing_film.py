"""A film between two junctions that vanishes: the certificate names the films that then meet."""

import numpy as np
import pytest
from periodic_cases import steiner_films

import pcmc
from pcmc.certificate.diagnosis import SWAP, vanished_films, where_collapsed


def test_a_vanishing_film_is_named_with_those_that_then_meet() -> None:
    # the middle film of the Steiner tree has the length a - b/√3, which is below zero here
    result = pcmc.solve(steiner_films(0.56, 1.0))
    assert result.certificate.verdict is pcmc.Verdict.DEGENERATE
    first, second = "'south-west' and 'south-east'", "'north-west' and 'north-east'"
    sentence = f"patch 'middle' may vanish: {first} then meet, and {second}; {SWAP}"
    assert sentence in result.certificate.detail
    assert vanished_films(result.surface) == ["middle"]


def test_a_narrow_film_whose_junctions_are_held_apart_is_not_offered() -> None:
    films = pcmc.solve(steiner_films(0.56, 1.0)).surface
    held = films.rebuilt(fixed=films.fixed | films.topology.on_junction[films.original])
    assert vanished_films(held) == []
    assert "vanish" not in where_collapsed(held, np.zeros(len(held.patches), dtype=bool))


def test_where_they_meet_the_other_tree_is_at_rest_and_has_less_energy() -> None:
    vanished, other = (pcmc.solve(steiner_films(*sides)) for sides in ((0.56, 1.0), (1.0, 0.56)))
    assert other.energy == pytest.approx(1.0 + 0.56 * 3**0.5, abs=1e-10)  # h (b + a√3), turned by 90°
    assert (other.certificate.verdict, other.certificate.index) == (pcmc.Verdict.STABLE, 0)
    assert other.energy < vanished.energy


def test_a_film_as_wide_as_the_others_does_not_vanish() -> None:
    surface = steiner_films(0.56, 1.0)
    X = surface.vertices.copy()
    X[np.linalg.norm(X - [0.0, 0.0, 0.5], axis=1) < 1e-9, 0] = -0.199  # its triangles collapse, it does not
    text = where_collapsed(surface.moved(X), np.zeros(len(surface.patches), dtype=bool))
    assert "of patch 'middle'" in text
    assert "vanish" not in text


@pytest.mark.parametrize("width", [0.62, 1.0])
def test_a_film_that_stays_has_the_energy_of_the_steiner_tree(width: float) -> None:
    result = pcmc.solve(steiner_films(width, 1.0))
    assert result.energy == pytest.approx(width + 3**0.5, abs=1e-10)
    assert result.certificate.verdict is pcmc.Verdict.STABLE
    assert "vanish" not in result.certificate.detail
