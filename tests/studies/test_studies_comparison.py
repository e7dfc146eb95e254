"""What the paper prints against what is measured: verdicts, labels of figures, claims, the comparison."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from refusals import refused

from generators.calibration import PRINTED
from pcmc.base.errors import FileError
from studies.folder import Folder
from studies.paper import (
    CONDITIONAL,
    NOT,
    REPRODUCED,
    Claim,
    Figure,
    compare,
    judge,
    label,
    paper,
    printed,
    read_measured,
)
from studies.readme import with_block
from studies.registry import STUDIES

RESULTS = Path(__file__).resolve().parents[2] / "results"


@pytest.mark.parametrize(
    ("relation", "ours", "verdict"),
    [
        ("=", 2.04, "reproduced"),
        ("=", 2.3, "near"),
        ("=", 3.0, "differs"),
        ("<", 1.99, "reproduced"),
        ("<", 2.0, "near"),
        ("<", 9.0, "differs"),
        (">", 2.01, "reproduced"),
        (">", 0.1, "differs"),
        ("=", math.nan, "not measured"),
    ],
)
def test_verdict_of_a_printed_number(relation, ours, verdict):
    claim = Claim("a", "Sec. 1", "s.a", 2.0, relation, tolerance=0.05, near=0.2)
    assert judge(claim, {"s.a": ours}).verdict == verdict


def test_claim_between_two_of_our_numbers():
    claim = Claim("smaller", "Sec. 1", "s.fine", "s.coarse", "<")
    assert judge(claim, {"s.fine": 1.0, "s.coarse": 2.0}).verdict == "reproduced"
    assert judge(claim, {"s.fine": 2.0, "s.coarse": 1.0}).verdict == "differs"
    assert judge(claim, {"s.fine": 2.0}).verdict == "not measured"


def test_label_of_a_figure_follows_from_the_papers_claims():
    first = Claim("Ex. 1: first", "Sec. 1", "s.a", 1.0, tolerance=0.1, near=0.5, figures=("1",))
    second = Claim(
        "Ex. 1: second",
        "Sec. 1",
        "s.b",
        2.0,
        "<",
        figures=("1",),
        instead="s.c",
        fails="b is {ours}, printed {paper}; otherwise {instead}",
    )
    third = Claim("Ex. 1: third", "Sec. 1", "s.c", 2.0, "<", figures=("1",), own=True)
    side = Claim("Ex. 1: side", "Sec. 1", "s.d", 4.0, figures=("1",), given=True)
    failed = "b is 3, printed 2; otherwise "

    def labelled(a=1.0, b=1.0, c=1.0, d=4.0, unknown=""):
        measured = {"s.a": a, "s.b": b, "s.c": c, "s.d": d}
        findings = [judge(claim, measured) for claim in (first, second, third, side)]
        return label(Figure("1", "a shape", "s", unknown), findings)

    assert labelled() == (REPRODUCED, "2 of 2", "")
    assert labelled(c=9.0) == (REPRODUCED, "2 of 2", "")  # ours, and no claim of the paper's
    assert labelled(unknown="its scale") == (CONDITIONAL, "2 of 2", "its scale")
    assert labelled(b=3.0) == (CONDITIONAL, "1 of 2", failed + "1")
    assert labelled(b=3.0, c=9.0) == (NOT, "1 of 2", failed + "nan")
    near = "first: ours 1.4, printed 1 (+40.0%)"
    assert labelled(a=1.4) == (CONDITIONAL, "1 of 2, 1 near", near)
    assert labelled(a=1.4, b=3.0)[2] == f"{near}; {failed}1"
    assert labelled(a=9.0) == (NOT, "1 of 2", "first: ours 9, printed 1 (+800.0%)")
    assert labelled(d=5.0) == (NOT, "2 of 2", "side: ours 5, printed 4 (+25.0%)")
    assert label(Figure("1", "a shape", "s"), [])[0] == NOT
    assert label(Figure("1", "", "s", "all"), [judge(side, {"s.d": 4.0})])[1] == "inputs only"


def test_reasons_say_what_is_measured():
    bound = judge(Claim("Ex. 1: flat", "", "s.a", 0.5, "<", bound=True), {"s.a": 0.7})
    assert bound.reason() == "flat: ours 0.7, to hold it must be < 0.5"
    printed = judge(Claim("Ex. 1: rest", "", "s.a", 0.5, "<"), {"s.a": 0.7})
    assert printed.reason() == "rest: ours 0.7, printed < 0.5"


def test_no_claim_says_the_same_as_another_or_leans_on_the_one_before():
    claims, _ = paper()
    says = [claim.says.partition(": ")[2] for claim in claims]
    leaning = ("and ", "so ", "the same ")
    assert not [s for s in says if s.startswith(leaning) or " there" in s]
    assert len({claim.says for claim in claims}) == len(claims)


def test_every_figure_of_the_examples_rests_on_claims_of_a_study_that_exists():
    claims, figures = paper()
    assert [f.number for f in figures] == [str(k) for k in range(6, 26)]
    for figure in figures:
        assert figure.study in STUDIES
        assert any(figure.number in claim.figures for claim in claims), figure
    for claim in claims:
        for key in (claim.ours, claim.paper):
            assert not isinstance(key, str) or key.split(".")[0] in STUDIES


def test_numbers_printed_for_initial_shapes_are_the_same_wherever_they_stand():
    assert {name: printed(f"{name}.initial_gradient_squared") for name in PRINTED} == PRINTED
    with refused(FileError, found="example1.turn_2"):
        printed("example1.turn_2")


def test_paper_file_with_a_wrong_relation_or_key_is_refused(tmp_path):
    entry = '[[figure]]\nnumber="1"\nshows="x"\nstudy="s"\n[[claim]]\nsays="a"\nwhere="b"\nours="s.c"\n'
    bad = tmp_path / "bad.toml"
    for line, where, found in (
        ('paper=1\nrelation="~"', "relation", "~"),
        ('paper=1\nfigures=["7"]', "figures", "7"),
        ("paper=1\nnearly=3", "a", None),
        ('paper=1\ninstead="s.d"', "instead", "s.d"),
        ('paper=1\nfails="{theirs}"', "fails", "{theirs}"),
    ):
        bad.write_text(entry + line)
        paper.cache_clear()
        with refused(FileError, what=str(bad), where=where, found=found):
            paper(bad)


def test_comparison_in_results_is_what_the_measured_numbers_give(tmp_path):
    comparison, figures = compare(read_measured(RESULTS))
    for name, table in (("comparison", comparison), ("figures", figures)):
        Folder(tmp_path).write_table(name, table)
        new, kept = ((f / f"{name}.csv").read_text() for f in (tmp_path, RESULTS))
        assert new == kept, "run: python -m studies reproduce"
    assert not (comparison.verdict == "not measured").any()


def test_results_are_small():
    files = [path for path in RESULTS.rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in files) < 30e6
    assert max(path.stat().st_size for path in files if path.suffix == ".png") <= 150_000


def test_template_keeps_what_is_around_the_markers():
    text = "before\n<!-- comparison: begin -->old<!-- comparison: end -->\nafter"
    wanted = "before\n<!-- comparison: begin -->\n\nNEW\n\n<!-- comparison: end -->\nafter"
    assert with_block(text, "comparison", ["NEW"]) == wanted
    assert with_block(wanted, "comparison", ["NEW"]) == wanted
    with refused(FileError, what="README.md"):
        with_block("no markers", "comparison", ["NEW"])
