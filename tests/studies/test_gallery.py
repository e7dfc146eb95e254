"""The study of exact surfaces: a short run through every line, and what its kept results say."""

from pathlib import Path

import pandas as pd
import pytest

from generators import catenoid_fold, enneper_exact
from studies.gallery.surfaces import EXAMPLES, STUDY
from studies.study import perform

KEPT = Path(__file__).resolve().parents[2] / "results" / "gallery"


@pytest.mark.nightly
def test_short_run_writes_tables_and_figures(tmp_path):
    perform(STUDY, tmp_path, short=True)
    folder = tmp_path / "gallery"
    assert {path.name for path in folder.glob("*.png")} == {path.name for path in KEPT.glob("*.png")}
    changes = pd.read_csv(folder / "changes.csv").set_index("change")
    assert changes.order.to_numpy() == pytest.approx(2.0, abs=0.3)
    assert abs(changes.limit_error["Enneper, R = 1"]) < 1e-3
    orders = pd.read_csv(folder / "orders.csv")
    assert orders.index_known_and_found.all()


def test_kept_surfaces_have_the_order_and_the_index_of_theory():
    orders = pd.read_csv(KEPT / "orders.csv").set_index("example")
    assert orders.index.tolist() == [example.name for example in EXAMPLES]
    assert orders.index_known_and_found.all()
    for example in EXAMPLES:
        known = example.closed_form().index
        assert known is None or orders.loc[example.name, "index"] == known
    curved = orders.drop("tetrahedron")
    assert (orders.loc["tetrahedron", ["distance", "energy_error", "area_error"]] == 0.0).all()
    assert curved.energy_order.to_numpy() == pytest.approx(2.0, abs=0.2)
    assert (curved.distance_order > 1.7).all()  # of the double bubble h² log(1/h) by its junction


def test_kept_changes_of_index_are_where_theory_says():
    changes = pd.read_csv(KEPT / "changes.csv").set_index("change")
    assert changes.theory["catenoid, fold"] == pytest.approx(catenoid_fold())
    assert changes.order.to_numpy() == pytest.approx(2.0, abs=0.15)
    assert (changes.limit_error.abs() < 1e-4).all()


def test_kept_surfaces_in_enneper_s_wire():
    areas = pd.read_csv(KEPT / "enneper.csv").set_index("surface")
    radius = areas.radius["Enneper"]
    assert areas.limit["Enneper"] == pytest.approx(enneper_exact(radius=radius).area, abs=2e-4)
    assert areas.limit["one"] == pytest.approx(areas.limit["other"], abs=1e-4)
    assert areas.limit["one"] < areas.limit["Enneper"] - 0.4
    assert areas["index"].to_dict() == {"Enneper": 1, "one": 0, "other": 0}
    assert areas.observed_order.to_numpy() == pytest.approx(2.0, abs=0.2)
