"""The notebooks run, and what they show is what they show when run."""

from __future__ import annotations

import re

import numpy as np
import pytest
from nightly import night_but
from running import FOLDER, NAMES, executed, load, outputs, text, words_and_numbers

ROUNDING = 1e-8  # numbers below are residuals at rest


def test_there_are_five():
    assert len(NAMES) == 5


@pytest.mark.parametrize("name", night_but(NAMES, "1-quick-start.ipynb"))
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_a_notebook_runs_and_says_what_is_stored(name):
    """Words are the same, numbers agree to a hundredth, pictures are where pictures were.

    What is zero but for rounding stays so: a residual of 1e-13 may become 1e-12, not 1e-6.
    """
    stored, now = load(name), executed(name)
    assert [o.output_type for o in outputs(now)] == [o.output_type for o in outputs(stored)]
    for old, new in zip(outputs(stored), outputs(now), strict=True):
        assert new.get("name") != "stderr", new
        assert old.get("data", {}).keys() == new.get("data", {}).keys()
        before, after = words_and_numbers(text(old)), words_and_numbers(text(new))
        assert before[0] == after[0]
        first, again = np.array(before[1]), np.array(after[1])
        rounding = np.abs(first) < ROUNDING
        np.testing.assert_allclose(again[~rounding], first[~rounding], rtol=1e-2)
        assert (np.abs(again[rounding]) <= 100.0 * np.abs(first[rounding]) + 1e-12).all()


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_is_complete_light_and_of_no_one_machine(name):
    notebook = load(name)
    source = (FOLDER / name).read_text(encoding="utf-8")
    assert len(source) < 1_500_000
    assert notebook.cells[0].cell_type == "markdown"
    assert notebook.cells[0].source.startswith("# ")
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    assert any("image/png" in o.get("data", {}) for o in outputs(notebook))
    assert all(o.output_type != "error" and o.get("name") != "stderr" for o in outputs(notebook))
    said = "".join(map(text, outputs(notebook))) + "".join(cell.source for cell in notebook.cells)
    assert not re.search(r"/(tmp|home|root|work|usr|Users)/|[A-Z]:\\", said)
    assert all(cell.metadata == {} for cell in notebook.cells)


@pytest.mark.parametrize("name", NAMES)
def test_links_between_notebooks_and_to_files_lead_somewhere(name):
    for cell in load(name).cells:
        if cell.cell_type == "markdown":
            for target in re.findall(r"\]\(([^)#]+)\)", cell.source):
                if not target.startswith(("http", "attachment:")):
                    assert (FOLDER / target).exists(), target
