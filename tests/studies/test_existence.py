"""The study of existence: a short run through every line, and what its kept results say."""

from pathlib import Path

import pandas as pd
import pytest

from studies.questions import existence
from studies.questions.existence import EDGES, START, STUDY, exact_tension
from studies.study import perform

KEPT = Path(__file__).resolve().parents[2] / "results" / "existence"


@pytest.mark.nightly
def test_short_run_writes_tables_and_figures(tmp_path):
    perform(STUDY, tmp_path, short=True)
    folder = tmp_path / "existence"
    figures = {path.name for path in folder.glob("*.png")}
    assert figures == {path.name for path in KEPT.glob("*.png")}
    cap = pd.read_csv(folder / "cap.csv")
    assert cap.fold_order.iloc[-1] == pytest.approx(2.0, abs=0.2)
    rays = pd.read_csv(folder / "rays.csv")
    assert (rays.ending == "folds").all()
    assert (rays.load_ratio < 1.0).all()


def test_kept_cap_folds_at_the_hemisphere():
    cap = pd.read_csv(KEPT / "cap.csv")
    assert cap.edge_length.tolist() == list(EDGES)
    assert abs(cap.fold.iloc[-1] - exact_tension(1.0)) < 1e-3
    assert cap[["fold_order", "fold_height_order", "last_order"]].iloc[1:].to_numpy() == (
        pytest.approx(2.0, abs=0.2)
    )
    assert (cap.index_below == 0).all()
    assert (cap.index_above == 1).all()
    assert cap.last_height.to_numpy() == pytest.approx(1.5)


def test_kept_rays_stay_where_the_boundary_can_carry_the_pressure():
    rays = pd.read_csv(KEPT / "rays.csv")
    assert (rays.load_ratio < 1.0).all()
    for _, mine in rays.groupby("edge_length"):
        assert (mine.ending == "folds").sum() >= 10
        assert mine.alpha_large.min() < START[0] < mine.alpha_large.max()
        assert mine.alpha_small.min() < START[1] < mine.alpha_small.max()


def test_kept_walls_lose_stability_sooner_on_finer_meshes():
    walls = pd.read_csv(KEPT / "walls.csv")
    assert walls.critical_wall.is_monotonic_decreasing
    assert walls.set_index("rings").critical_wall[7] == pytest.approx(2.1, abs=0.1)
    assert (walls.index_after == 2).all()


def test_only_between_two_folds_is_the_end_decided():
    ends = pd.DataFrame(
        {
            "ending": ["folds", "folds", "degenerate", "folds"],
            "alpha_large": [1.0, 2.0, 3.0, 1.0],
            "alpha_small": [5.0, 6.0, 7.0, 5.0],
        }
    )
    stretches = existence._stretches(ends)
    assert [decided for decided, _, _ in stretches] == [True, False, False]
    assert stretches[0][1:] == ([1.0, 2.0], [5.0, 6.0])


def test_every_way_to_end_has_a_mark_and_a_meaning():
    assert set(existence.MARKERS) == set(existence.MEANINGS) == set(existence.ENDS)
