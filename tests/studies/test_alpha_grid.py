"""The grid of Fig. 16: the flow's answers, the geometric solver's, and the reasons between them."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pcmc import solve
from pcmc.solvers.result import Status
from studies.alpha_grid import branches as alpha_grid_branches
from studies.alpha_grid import geometric as alpha_grid_geometric
from studies.alpha_grid import grid as alpha_grid
from studies.alpha_grid.branches import branch_case, branches, equilibrium, finer_case, starts, weakening_case
from studies.alpha_grid.geometric import CATEGORIES, explained
from studies.alpha_grid.sentences import sentences
from studies.folder import Folder
from studies.study import perform

RESULTS = Path(__file__).parents[2] / "results"


def test_flow_at_two_triples(tmp_path):
    mesh = tmp_path / "mesh"
    sweep = alpha_grid.flow_sweep(mesh, 200, [1.0])
    near = alpha_grid.flow_case(str(mesh), 4.0, 4.0, 3.0, 200)
    assert near["status"] == "iteration_limit"
    assert near["gradient_squared"] < alpha_grid.CONVERGED
    assert alpha_grid.flow_case(**next(iter(sweep)))["status"] == "diverged"


def test_branches_start_from_what_shares_a_patch_then_from_the_nearest():
    sound = np.array([
        [8.0, 4.0, 3.0], [6.0, 4.0, 3.0], [1.0, 6.0, 6.0], [4.0, 3.0, 3.0], [12.0, 3.0, 2.0],
    ])  # fmt: skip
    # the wall of 12 counts as 3 + 2; log ratios 5/6, 3/4, 1 are less than 1, 1, 3/2
    assert starts(np.array([6.0, 4.0, 2.0]), sound) == [
        [6.0, 4.0, 3.0], [12.0, 3.0, 2.0], [4.0, 3.0, 3.0], [1.0, 6.0, 6.0],
    ]  # fmt: skip
    assert starts(np.array([6.0, 5.0, 2.5]), sound)[0] == [6.0, 4.0, 3.0]
    resting = np.array([[5.0, 3.0, 2.0], [12.0, 3.0, 2.0], [6.0, 3.0, 2.0]])
    assert starts(np.array([12.0, 6.0, 2.0]), resting) == [[12.0, 3.0, 2.0]]


def test_each_open_case_gets_its_number_of_starts():
    rows = [(4.0, 4.0, 3.0, "converged", 0.6), (4.0, 3.0, 2.0, "converged", 0.5),
            (4.0, 4.0, 4.0, "converged", 0.01), (4.0, 6.0, 3.0, "stalled", 0.5),
            (4.0, 3.0, 6.0, "stalled", 0.5)]  # fmt: skip
    records = pd.DataFrame(rows, columns=[*alpha_grid.AXES, "status", "quality"])
    open_cases = (records.status == "stalled").to_numpy()
    first = [[[4.0, 6.0, 3.0], [4.0, 4.0, 3.0]], [[4.0, 3.0, 6.0], [4.0, 3.0, 2.0]]]
    assert branches(records, open_cases, 1) == first
    others = ([4.0, 3.0, 2.0], [4.0, 4.0, 3.0])
    assert branches(records, open_cases, 2) == [
        [*case, other] for case, other in zip(first, others, strict=True)
    ]
    assert branches(records.assign(status="stalled"), open_cases, 2) == []


@pytest.mark.nightly
def test_a_patch_held_all_around_folds_below_half_its_radius():
    fold = alpha_grid_branches.patch_fold(1.2, "small")
    assert 1.7 < fold < 2.0
    weak = alpha_grid_branches.initial(1.2).retensioned({"small": 0.9 * fold})
    assert solve(weak, target="stationary").status is not Status.CONVERGED


@pytest.mark.nightly
def test_branches_arrive_or_fold_with_a_way_down_opening():
    found = branch_case([[3.0, 3.0, 2.0], [4.0, 3.0, 2.0]], 1.2)
    assert found["ending"] == "fold"
    assert 0.1 < found["share"] < 0.3
    assert found["at_wall"] == pytest.approx(4.0 - found["share"])
    assert [found["at_large"], found["at_small"]] == [3.0, 2.0]
    assert found["quality"] > 0.2
    arrived = branch_case([[2.0, 4.0, 4.0], [3.0, 4.0, 4.0]], 1.2)
    assert arrived["ending"] == "reached"
    assert [arrived[f"from_{name}"] for name in ("wall", "large", "small")] == [3.0, 4.0, 4.0]
    assert (arrived["verdict"], arrived["index"], arrived["pinched"]) == ("stable", 0, 0)
    direct = equilibrium(np.array([2.0, 4.0, 4.0]), 1.2).certificate.patches.set_index("patch")
    assert arrived["wall_area"] == pytest.approx(direct.area["wall"], rel=5e-3)
    # here the branch turns although all ways lead up: the mesh's doing
    turned = branch_case([[3.0, 4.0, 4.0], [2.0, 4.0, 4.0]], 1.2)
    assert turned["ending"] == "slip"


@pytest.mark.nightly
def test_a_branch_that_ends_in_poor_triangles_is_tried_from_elsewhere():
    """From (8, 4, 3) the junction slips into a corner; with the smaller patch raised it folds."""
    slipped = branch_case([[8.0, 3.0, 8.0], [8.0, 4.0, 3.0]], 1.2)
    assert slipped["ending"] == "slip"
    found = branch_case([[8.0, 3.0, 8.0], [8.0, 4.0, 3.0], [6.0, 3.0, 2.0]], 1.2)
    assert found["ending"] == "fold"
    assert found["from_large"] == found["at_large"] == 3.0
    assert 2.0 < found["at_small"] < 2.1


def test_no_patch_is_weakened_beyond_its_own_fold():
    fold = alpha_grid_branches.patch_fold(1.2, "small")
    found = weakening_case([6.0, 3.0, 2.0], "small", 1.2)
    assert found["ending"] == "fold"
    assert fold < found["least"] < 2.0
    assert found["quality"] > 0.2


@pytest.mark.nightly
def test_equilibria_are_sought_at_half_the_edge_length():
    there = finer_case([6.0, 4.0, 3.0], 1.2)
    assert (there["status"], there["verdict"]) == ("converged", "stable")
    assert there["finer_height"] == pytest.approx(there["height"], rel=0.02)
    gone = finer_case([1.0, 16.0, 4.0], 1.2)
    assert gone["status"] != "converged"
    assert np.isnan(gone["finer_height"])


def _records(rows):
    columns = [*alpha_grid.AXES, "status", "verdict", "flow_status", "flow_gradient_squared"]
    return pd.DataFrame(rows, columns=columns).assign(index=0, pinched=0, wall_area=1.0, quality=0.5)


def test_reason_of_each_case(tmp_path):
    rest, open_case = ("converged", "stable"), ("stalled", "not_converged")
    rows = [
        (4, 4, 3, *rest, "iteration_limit", 1e-3),
        (4, 4, 4, *rest, "diverged", 1e-3),
        (4, 6, 6, "converged", "saddle", "iteration_limit", 1e-3),
        (1, 4, 2, *open_case, "diverged", 1e9),
        (4, 1, 4, *open_case, "diverged", 1e9),
        (4, 4, 2, *open_case, "diverged", 1e9),
        (8, 3, 8, *open_case, "diverged", 1e9),
        (8, 8, 6, *open_case, "diverged", 1e9),
        (8, 12, 12, *open_case, "iteration_limit", 5.0),
    ]
    folder = Folder(tmp_path)
    folder.write_table("records", _records(rows))
    folder.write_table("patch_folds", pd.DataFrame([{"large": 2.9, "small": 1.8}]))
    ends = pd.DataFrame(
        [(4, 4, 2, "fold", 0.5), (8, 3, 8, "slip", 0.1), (8, 12, 12, "reached", 1.0)],
        columns=[*alpha_grid.AXES, "ending", "share"],
    ).assign(verdict="stable", index=0, quality=0.3, pinched=7, wall_area=0.0)
    for name, start, at in zip(alpha_grid_branches.PATCHES, (4, 4, 3), (4, 4, 2.5), strict=True):
        ends[f"from_{name}"], ends[f"at_{name}"] = start, at
    folder.write_table("branches", ends)
    finer = [(4, 4, 3, "converged", 2.61, 2.6), (4, 4, 4, "stalled", 2.0, np.nan)]
    columns = [*alpha_grid.AXES, "status", "height", "finer_height"]
    folder.write_table("finer", pd.DataFrame(finer, columns=columns))
    found, names = explained(folder), list(CATEGORIES)
    assert found.category.tolist() == [names[k] for k in (0, 1, 2, 4, 5, 6, 7, 8, 3)]
    assert found.crossed.sum() == 6
    assert found.equilibrium.sum() == 4
    assert found.finer.tolist() == [True] + [False] * 8
    assert found.reason.tolist() == [
        "2.610 high here, 2.600 at half the edge length",
        "not found at half the edge length: stalled",
        "not found at half the edge length",
        "|4 - 2| > 1",
        "the larger patch folds at 2.900",
        "the branch from (4, 4, 3) folds at (4, 4, 2.5)",
        "the branch from (4, 4, 3) ends at (4, 4, 2.5)",
        "",
        "not found at half the edge length",
    ]
    last = found.iloc[-1]
    assert (last.verdict, last.pinched, last.quality) == ("stable", 7, 0.3)  # the branch's own


def test_the_results_explain_every_cross():
    """By a fold, on the way or of the patch, or by tensions out of balance; none by the mesh alone."""
    folder = Folder(RESULTS / "alpha_grid_geometric")
    cases, records = folder.read_table("explained"), folder.read_table("records")
    assert len(cases) == len(alpha_grid.TENSIONS) ** 3
    crosses = cases[cases.crossed]
    assert len(crosses) == records.flow_status.isin(alpha_grid.FAILED).sum() > 200
    reasons = {"none: tensions cannot balance", "none found: a patch below its fold",
               "none found: a fold on the way"}  # fmt: skip
    assert set(crosses.category[~crosses.equilibrium]) <= reasons
    assert (crosses.reason.str.len() > 0).all()
    assert (cases.quality[cases.ending == "fold"].notna()).all()
    unbalanced = (cases.alpha_large - cases.alpha_small).abs() > cases.alpha_wall
    assert (cases.proved == (unbalanced & ~cases.equilibrium)).all()  # each by the theorem, and no other
    assert (cases.category == "none: tensions cannot balance").sum() == cases.proved.sum() > 400
    folds = folder.read_table("patch_folds").iloc[0]
    least = folder.read_table("weakening").groupby("patch").least.min()
    assert least.large > folds.large
    assert least.small > folds.small


def test_sentences_follow_from_the_cases():
    def case(wall, large, small, near, crossed=False, there=True, pinched=0):
        return {"alpha_wall": wall, "alpha_large": large, "alpha_small": small, "near": near,
                "crossed": crossed, "equilibrium": there, "balanced": abs(large - small) <= wall,
                "pinched": pinched}  # fmt: skip

    listed = [
        case(1.0, 4.0, 4.0, near=False), case(2.0, 4.0, 3.0, near=True),
        case(8.0, 8.0, 8.0, near=False, pinched=3),
        case(1.0, 16.0, 4.0, near=False, there=False),
        case(4.0, 1.0, 1.0, near=False, crossed=True, there=False),
    ]  # fmt: skip
    said = sentences(pd.DataFrame(listed))
    words = said.verdict.tolist()
    assert words[3] == words[1] == words[6] == "confirmed"
    listed[1]["near"], listed[0]["near"] = False, True
    listed[4]["crossed"], listed[2]["pinched"] = False, 0
    turned = sentences(pd.DataFrame(listed))
    assert [turned.verdict[k] for k in (1, 3, 6)] == ["corrected"] * 3
    assert turned.instead[3]
    few = sentences(pd.DataFrame(listed[:1])).set_index("paper").verdict
    assert few[turned.paper[2]] == "no such cases"


@pytest.mark.nightly
def test_grid_by_the_geometric_solver_end_to_end(tmp_path, monkeypatch):
    for module in (alpha_grid, alpha_grid_geometric):
        monkeypatch.setattr(module, "TENSIONS", (1.0, 4.0))
    monkeypatch.setattr(alpha_grid, "SHORT_ITERATIONS", 200)
    study = alpha_grid_geometric.STUDY
    monkeypatch.setattr(
        alpha_grid_geometric, "_flow", lambda folder, short: alpha_grid.flow_grid(folder, True)
    )
    perform(study, tmp_path)
    folder = Folder(tmp_path / study.name)
    assert len(folder.read_table("explained")) == 8
    assert folder.read_table("measured").set_index("key").value[f"{study.name}.crosses"] > 0
    verdicts = set(folder.read_table("sentences").verdict)  # 8 cases do not have all kinds
    assert verdicts == {"confirmed", "no such cases"}
    assert folder.figure("existence").stat().st_size <= 150_000
    assert not (folder.path / "build").exists()
