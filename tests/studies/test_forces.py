"""The study of cables, weight, volumes, planes and mirrors: a short run, and what its kept results say."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from studies.forces.cases import CASES, TRIPLE_BUBBLE
from studies.forces.checks import SIDES, STUDY
from studies.reference import evolver
from studies.study import perform

KEPT = Path(__file__).resolve().parents[2] / "results" / "forces"


@pytest.mark.nightly
def test_short_run_writes_tables_and_figures(tmp_path):
    perform(STUDY, tmp_path, short=True)
    folder = tmp_path / "forces"
    for kind in ("*.png", "*.csv", "*.pcmc"):
        assert {path.name for path in folder.glob(kind)} == {path.name for path in KEPT.glob(kind)}
    terms = pd.read_csv(folder / "terms.csv")
    assert terms.slope_gradient.to_numpy() == pytest.approx(2.0, abs=0.1)
    assert terms.slope_hessian.to_numpy() == pytest.approx(3.0, abs=0.2)
    if evolver.available():
        assert (terms[["energy_within", "gradient_within"]] <= 1e-12).all(axis=None)
        assert (terms.volume_within.dropna() <= 1e-12).all()


def test_kept_closed_forms_have_order_2():
    orders = pd.read_csv(KEPT / "orders.csv").set_index("what")
    cases = {what.split(",")[0] for what in orders.index}
    assert {case.name for case in CASES} <= cases
    assert orders.order.to_numpy() == pytest.approx(2.0, abs=0.4)
    assert (orders.order_error < 0.25).all()
    assert (orders.error.abs() < 4e-3 * np.maximum(orders.exact.abs(), 1.0)).all()
    assert orders.status.dropna().unique().tolist() == ["converged"]
    assert orders["index"].dropna().to_dict() == {
        what: float(what.startswith(("tube, ", "schwarz_p"))) for what in orders["index"].dropna().index
    }


def test_kept_terms_are_those_of_the_reference_program():
    terms = pd.read_csv(KEPT / "terms.csv")
    assert (terms[["energy_within", "gradient_within"]] <= 1e-12).all(axis=None)
    assert (terms.volume_within.dropna() <= 1e-12).all()
    assert terms.volume_within.notna().sum() == 4


def test_kept_roof_is_stable_and_its_sags_are_met():
    roof = pd.read_csv(KEPT / "roof.csv")
    assert set(roof.cable) == set(SIDES)
    assert (roof.verdict == "stable").all()
    assert (pd.read_csv(KEPT / "sag.csv").sag_within <= 1e-8).all()


def test_kept_branch_goes_past_the_largest_pressure():
    branches = pd.read_csv(KEPT / "branches.csv")
    assert (branches["index"] == 0).all()
    assert (branches.ending == "reached").all()
    for _, mine in branches.groupby("edge_length"):
        assert 0 < mine.pressure.to_numpy().argmax() < len(mine) - 1
        assert mine.volume.is_monotonic_increasing


def test_the_area_of_three_bubbles_differs_from_the_printed_one_in_a_digit():
    measured = pd.read_csv(KEPT / "measured.csv").set_index("key").value
    assert measured["forces.three_bubbles_area_less_printed"] == pytest.approx(1e-10, rel=0.01)
    assert pytest.approx(13.128168244433, abs=1e-12) == TRIPLE_BUBBLE
