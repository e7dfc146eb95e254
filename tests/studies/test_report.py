"""The sentences of REPORT: their numbers are measured, and they say what the tables beside them say."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd
import pytest
from numbers_in_text import numbers_in

from studies import report, report_tables
from studies.folder import Folder
from studies.paper import compare, paper, read_measured
from studies.words import FIELD, MISSING, fill, keys

RESULTS = Path(__file__).parents[2] / "results"
MEASURED = read_measured(RESULTS)
TEXTS = {
    name: text
    for name, text in vars(report).items()
    if name.isupper() and isinstance(text, str) and name not in ("HEADER",)
}
# numbers that no study measures: the name of a case, a percentile, the number of times of a word, orders of
# elements and what theory gives
NAMED = {"CORNERS": ["1"], "CHECK": ["1", "20"], "CURVED": ["8", "2", "3", "4", "3", "1", "2", "4"]}


@pytest.mark.parametrize("name", TEXTS)
def test_a_sentence_takes_its_numbers_from_fields(name):
    without = FIELD.sub("", TEXTS[name])
    assert numbers_in(without) == NAMED.get(name, [])


def test_so_do_the_claims_of_the_paper():
    claims, figures = paper()
    texts = [text for claim in claims for text in (claim.says, claim.fails)]
    texts += [figure.unknown for figure in figures]
    wrong = {text: found for text in texts if (found := numbers_in(FIELD.sub("", text)))}
    # iterations at which the paper itself prints ‖∇E‖²
    assert set(wrong) == {f"Ex. 4: ‖∇E‖² after {k} iterations" for k in (225, 500)}


def test_every_field_is_measured():
    claims, figures = paper()
    texts = [*TEXTS.values(), *(claim.says + claim.fails for claim in claims), *(f.unknown for f in figures)]
    dotted = {key for text in texts for key in keys(text) if "." in key}
    assert dotted <= set(MEASURED)
    written = (RESULTS / "REPORT.md").read_text(encoding="utf-8")
    assert MISSING not in written
    assert not re.search(r"\{[\w.]+", written)


def test_the_numbers_of_the_solvers_are_those_of_their_table():
    text = report.report(RESULTS).partition("## Solvers")[2].partition("##")[0]
    summary = Folder(RESULTS / "solvers").read_table("summary").set_index("method")
    for target in ("stationary", "minimum"):
        row = summary.loc[f'geometric solver, target "{target}"']
        assert f"{row.at_rest} of {row.runs}" in text.replace("\n", " ")
    assert f"quality {row.worst_quality:.2g}" in text.replace("\n", " ")
    assert "collapse" not in text


def test_the_headline_counts_what_holds_by_our_choice():
    comparison, figures = compare(MEASURED)
    said = report.headline(comparison, figures)
    assert "3 hold (2 of them because we chose the mesh and the iteration so)" in said
    assert "inputs" not in said
    freely = comparison.assign(chosen="")
    assert "3 hold, " in report.headline(freely, figures)
    ours = comparison[(comparison.kind == "sentence") & (comparison.threshold == "ours")]
    papers = report.of_the_paper(comparison, "sentence")
    assert report.thresholds(comparison)["paper"] == (papers.threshold == "ours").sum() == 8
    assert len(ours) > 8


def test_a_number_that_holds_by_choice_says_so_and_a_threshold_of_ours_too():
    comparison, _ = compare(MEASURED)
    numbers = report_tables.comparison_cells(comparison, "number")
    chosen = [row[-1] for row in numbers if "chosen so" in row[-1]]
    assert chosen == [
        "reproduced; the mesh is chosen so",
        "reproduced; the iteration is chosen so",
    ]
    cells = report_tables.comparison_cells(comparison, "sentence")
    assert sum("(ours)" in row[2] for row in cells) == (comparison.threshold == "ours").sum()
    missed = comparison.assign(verdict="differs")
    assert not any("chosen" in row[-1] for row in report_tables.comparison_cells(missed, "number"))


def test_the_step_of_the_energy_in_example_1_is_the_meshs():
    """It goes with the square of the edge length, and so does no step to another equilibrium."""
    jumps = Folder(RESULTS / "corners").read_table("jumps").set_index(["case", "bottom"])
    ladder = Folder(RESULTS / "corners").read_table("ladder")
    row = jumps.loc["example1-1", "held"]
    mine = ladder[(ladder.case == "example1-1") & (ladder.bottom == "held")].set_index("level")
    assert row.step == pytest.approx(mine.energy[row.level] - mine.energy[row.level - 1])
    assert mine.anew[row.level]
    assert 3.0 < row.step / row.step_halved < 5.0
    assert abs(row.step) < 0.2 * row.mesh_error
    assert mine.slid[row.level] > 0.1 > mine.slid.drop([row.level]).max()
    assert abs(mine.height.diff()[row.level]) < 2e-3


@pytest.mark.parametrize("case", ["example3", "fig4"])
def test_on_round_outlines_the_step_is_what_new_vertices_on_the_outline_leave(case):
    """With the outline left as a polygon all steps have one sign and get smaller; no level is solved anew."""
    jumps = Folder(RESULTS / "corners").read_table("jumps").set_index("case").loc[[case]]
    assert len(jumps) >= 2
    assert not jumps.anew.any()
    assert (jumps.slid < 0.01).all()
    assert (jumps.step.abs() > jumps.step_before.abs()).all()
    assert (jumps.polygon_step < 0.0).all()
    assert (jumps.polygon_step_before < 2.0 * jumps.polygon_step).all()
    text = " ".join(report.report(RESULTS).split())
    row = jumps[jumps.bottom == "sliding"].iloc[0]
    assert f"{row.polygon_step_before:.2g} and {row.polygon_step:.2g}" in text


def test_the_largest_and_the_least_effect_of_cutting_are_of_example_1_alone():
    jumps = Folder(RESULTS / "corners").read_table("jumps")
    mine = jumps[jumps.case.isin(["example1-1", "example1-2"])]
    ratios = (mine.step / mine.step_halved).tolist()
    text = " ".join(report.report(RESULTS).split())
    assert f"Example 1's steps smaller, {min(ratios):.1f} to {max(ratios):.1f} times" in text
    assert 3.0 < min(ratios) < max(ratios) < 5.0


def test_fair_pairs_compare_the_same_work(tmp_path):
    rows = [("Newton step, evolver", 2.0), ("Newton step, pardiso", 1.0), ("evolver, linear", 3.0),
            ("height of one mesh", 2.0), ("evolver, linear, extrapolated by us", 1.0),
            ("height, extrapolated", 4.0)]  # fmt: skip
    folder = Folder(tmp_path / "benchmark")
    folder.write_table("full", pd.DataFrame(rows, columns=["what", "median"]))
    said = " ".join(report.fair_pairs(tmp_path)[0].split())
    assert "takes Evolver 2.0 times as long" in said
    assert "takes it 1.5 times as long; both extrapolated, 0.25 times, so Evolver is the faster one" in said
    folder.write_table("full", pd.DataFrame(rows[:-1], columns=["what", "median"]))
    assert report.fair_pairs(tmp_path) == []


def test_fields_are_filled_and_a_missing_number_is_said():
    assert fill("{a.x:.1f} and {b.y}, {ours}", {"a.x": 1.25}, {"ours": "2"}) == f"1.2 and {MISSING}, 2"


def test_the_comparison_is_that_of_what_is_measured(tmp_path):
    """``python -m studies readme`` writes it."""
    for name, frame in zip(("comparison", "figures"), compare(MEASURED), strict=True):
        Folder(tmp_path).write_table(name, frame)
        stored = (RESULTS / f"{name}.csv").read_text(encoding="utf-8")
        assert (tmp_path / f"{name}.csv").read_text(encoding="utf-8") == stored
