"""A film between two junctions that vanishes: the certificate names the films that then meet."""

from itertools import pairwise

import numpy as np
import pytest

import pcmc
from pcmc.certificate.diagnosis import where_collapsed

CORNERS = {"south-west": (-1, -1), "north-west": (-1, 1), "north-east": (1, 1), "south-east": (1, -1)}


def steiner_films(width: float, depth: float) -> pcmc.Surface:
    """Films between two plates and four lines at the corners of a rectangle; the middle one is along x."""
    lines = [0.5 * np.array([width, depth]) * place for place in CORNERS.values()]
    places = [*lines, np.array([-0.2, 0.0]), np.array([0.2, 0.0])]
    ways = [(0, 4), (1, 4), (2, 5), (3, 5), (4, 5)]
    X, faces, patch = list[list[float]](), list[list[int]](), list[int]()
    number = dict[tuple[float, ...], int]()

    def column(point: np.ndarray) -> int:
        key = tuple(point.round(9))
        if key not in number:
            number[key] = len(X)
            X.extend([*point, height] for height in (0.0, 0.25, 0.5, 0.75, 1.0))
        return number[key]

    for label, (start, end) in enumerate(ways):
        steps = 2 if label == 4 else 4
        line = [places[start] + (places[end] - places[start]) * k / steps for k in range(steps + 1)]
        for p, q in pairwise(line):
            i, j = column(p), column(q)
            for k in range(4):
                faces += [[i + k, j + k, j + k + 1], [i + k, j + k + 1, i + k + 1]]
                patch += [label, label]
    Z = np.array(X)
    fixed = np.isclose(np.abs(Z[:, 0]), width / 2) & np.isclose(np.abs(Z[:, 1]), depth / 2)
    patches = [pcmc.Patch(name, 1.0, 0.0) for name in [*CORNERS, "middle"]]
    return pcmc.Surface(Z, faces, patch, patches, fixed=fixed, images=pcmc.images_in(Z, [[0, 0, 1]]))


def test_a_vanishing_film_is_named_with_those_that_then_meet() -> None:
    # the middle film of the Steiner tree has the length a - b/√3, which is below zero here
    result = pcmc.solve(steiner_films(0.56, 1.0))
    assert result.certificate.verdict is pcmc.Verdict.DEGENERATE
    first, second = "'south-west' and 'south-east'", "'north-west' and 'north-east'"
    assert f"patch 'middle' may vanish: {first} then meet, and {second};" in result.certificate.detail


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
