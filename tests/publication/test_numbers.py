"""Numbers of README and documentation: each is measured and has a key, or is given and listed."""

from __future__ import annotations

import json
from collections import defaultdict
from pathlib import Path

import pandas as pd
import pytest
from numbers_in_text import numbers_in, prose

from studies import stated
from studies.__main__ import main
from studies.folder import Folder

HOME = Path(__file__).resolve().parents[2]
# other lists: years and pages of books; what was true at the time; made from the code by a test
ELSEWHERE = {"docs/bibliography.md", "docs/history.md", "docs/how-to/project-keys.md"}
MADE = {"docs/gallery.md", "docs/reference/command-line.md"}  # at each build of the site
FOUND = {
    path.relative_to(HOME).as_posix()
    for pattern in ("README.md", "docs/**/*.md", "notebooks/*.ipynb")
    for path in HOME.glob(pattern)
    if "_build" not in path.parts
}
PAGES = sorted(FOUND - ELSEWHERE - MADE)
SMALL = {"0", "1", "-1"}  # ends of ranges, indices, exit codes
SENTENCES = defaultdict(list)
for sentence in stated.sentences():
    SENTENCES[sentence.page].append(sentence.says)


def text_of(page):
    """The prose of a page; of a notebook, its words between the cells that run."""
    text = (HOME / page).read_text(encoding="utf-8")
    if page.endswith(".ipynb"):
        cells = json.loads(text)["cells"]
        text = "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    return prose(text)


def strange(text, page):
    """The numbers of a page's prose that are neither measured nor given."""
    for says in SENTENCES[page]:
        text = text.replace(prose(says), " … ")
    return [number for number in numbers_in(text) if number not in SMALL.union(stated.given(page))]


@pytest.mark.parametrize(("page", "says"), [(page, says) for page in SENTENCES for says in SENTENCES[page]])
def test_a_measured_number_is_that_of_the_results(page, says):
    words = " ".join((HOME / page).read_text(encoding="utf-8").split())
    if says not in words:
        pytest.fail(
            f"{page} says this no more, or with other numbers; see studies/stated.toml", pytrace=False
        )


@pytest.mark.parametrize("page", PAGES)
def test_every_other_number_is_given(page):
    assert strange(text_of(page), page) == [], (
        "new numbers: write the sentence with its keys to studies/stated.toml, or list what is given there"
    )


@pytest.mark.parametrize("page", sorted({*SENTENCES, *stated._stated()}))
def test_the_list_of_given_numbers_has_no_others(page):
    text = text_of(page)
    for says in SENTENCES[page]:
        text = text.replace(prose(says), " … ")
    assert sorted(set(stated.given(page)) - set(numbers_in(text))) == []


def test_a_number_without_a_key_is_found():
    page = "docs/how-to/mesh-check.md"
    assert strange(text_of(page) + " The bars hold on 1764 surfaces, 99.9 % of them.", page) == [
        "1764",
        "99.9",
    ]


def test_a_key_may_be_a_cell_a_share_or_a_bound(tmp_path):
    folder = Folder(tmp_path / "study")
    folder.write_table("measured", pd.DataFrame({"key": ["study.a", "study.b"], "value": [7.0, 26.0]}))
    rows = pd.DataFrame({"case": ["x", "y", "y"], "share": [0.5, 0.25, 0.966]})
    folder.write_table("table", rows)

    def says(template):
        return stated.filled(template, tmp_path).says

    assert says("{study.a:.0f} of {study.b:.0f}, {100 * study.a / study.b:.1f} %") == "7 of 26, 26.9 %"
    assert says("{study/table(share; only; case=x):.1f}") == "0.5"
    assert (
        says("{study/table(share; least; case!=x):.2f} to {study/table(share; largest):.2f}")
        == "0.25 to 0.97"
    )
    assert (
        says("{100 * study/table(share; largest):.0f down}, {study/table(share; median):.0f up}") == "96, 1"
    )
    assert says("{study/table(share; count; case=x|y):.0f}") == "3"
    with pytest.raises(ValueError, match="of 2 rows"):
        says("{study/table(share; only; case=y):.1f}")


def test_the_command_lists_each_number_with_its_key(capsys):
    assert main(["numbers"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.split() == ["docs/how-to/mesh-check.md", "1122", "coverage.quantities"] for line in lines)
    report = [line for line in lines if line.startswith("results/REPORT.md")]
    assert any(line.endswith("solvers.worst_quality_newton_minimum") for line in report)
    assert any(line.endswith("example4.best_largest_error") for line in report)
