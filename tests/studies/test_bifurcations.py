"""The study of bifurcations: Jacobi's equation against closed forms, meshes against both, kept results."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from studies.questions.bifurcations import CASES, UPRIGHT, first_zero

RESULTS = Path(__file__).resolve().parents[2] / "results"


@pytest.mark.parametrize("waviness", [1.2, 2.0, 5.0])
def test_the_sideways_mode_vanishes_where_the_nodoid_is_horizontal(waviness):
    assert first_zero(1.0 + waviness, UPRIGHT, 1) == pytest.approx(UPRIGHT + np.arcsin(1.0 / waviness))


def test_places_on_curved_elements_have_order_four():
    case = CASES[0]
    errors = [abs(case.place(edge, 2, np.pi) - np.pi) for edge in (0.8, 0.4)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=1.0)
    assert errors[1] < 1e-3


def test_kept_places_are_those_of_jacobi_s_equation():
    places = pd.read_csv(RESULTS / "bifurcations" / "places.csv")
    assert places.case.tolist() == [case.name for case in CASES]
    assert (places.flat_error < 1e-3).all()
    assert (places.order_2_error.dropna() < 1e-3).all()
    assert (places.jacobi / places.closed_form - 1.0).abs().max() < 1e-8


def test_surface_evolver_has_the_same_indices_and_energies_on_every_equilibrium():
    for study in ("bifurcations/sides", "equilibria_atlas/records", "alpha_grid_equilibria/records"):
        kept = pd.read_csv(RESULTS / f"{study}.csv")
        assert (kept["index"] == kept.evolver).all()
    atlas = pd.read_csv(RESULTS / "equilibria_atlas" / "records.csv")
    assert atlas[["evolver_energy", "evolver_step"]].max().max() < 1e-10
