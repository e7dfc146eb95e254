"""Numbers of README and documentation that come from ``results/``: number, page, and the key that it is."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

HOME = Path(__file__).resolve().parents[2]
GRID = "corners.grid"


def table(name):
    return pd.read_csv(HOME / "results" / f"{name}.csv")


def measured(key):
    study = key.split(".")[0]
    return float(table(f"{study}/measured").set_index("key").value[key])


def held(study):
    """The quantities of a study that have a limit."""
    return measured(f"{study}.quantities") - measured(f"{study}.no_limit")


def savings(family, quantity, bar_of="extrapolated value"):
    rows = table("accuracy/savings")
    row = rows[(rows.family == family) & (rows.quantity == quantity) & (rows.bar_of == bar_of)]
    return float(row.saving.iloc[0])


def of_benchmark(what):
    rows = table("benchmark/full")
    return float(rows.loc[rows.what == what, "median"].iloc[0])


NUMBERS = (  # page, the sentence with the number's place, the number
    ("docs/how-to/mesh-check.md", "on {:.0f} quantities of", lambda: held("coverage") + held("mesh_check")),
    (
        "docs/how-to/mesh-check.md",
        "quantities of {:.0f} exact surfaces",
        lambda: measured("coverage.cases") + measured("mesh_check.closed_forms"),
    ),
    ("docs/how-to/mesh-check.md", "checks {:.0f} quantities", lambda: measured("coverage.quantities")),
    ("docs/how-to/mesh-check.md", "of {:.0f} surfaces of 13 families", lambda: measured("coverage.cases")),
    ("docs/how-to/mesh-check.md", "surfaces of {:.0f} families", lambda: measured("coverage.families")),
    ("docs/how-to/mesh-check.md", "| {:.1f} in the median", lambda: measured("coverage.limit_width_median")),
    ("docs/how-to/mesh-check.md", "median, {:.0f} at the 95th", lambda: measured("coverage.limit_width_95")),
    (
        "docs/how-to/mesh-check.md",
        "| {:.0f} % in the median",
        lambda: 100 * measured("coverage.limit_share_median"),
    ),
    ("docs/how-to/mesh-check.md", "{:.0f} % at the 95th", lambda: 100 * measured("coverage.limit_share_95")),
    (
        "docs/how-to/large-meshes.md",
        "takes {:.1f} times as",
        lambda: of_benchmark("Newton step, superlu") / of_benchmark("Newton step, pardiso"),
    ),
    ("docs/how-to/accuracy.md", "roof {:.0f} times fewer", lambda: savings("roof", "height of north")),
    ("docs/how-to/accuracy.md", "and {:.0f} times for the volume", lambda: savings("roof", "volume")),
    (
        "docs/how-to/accuracy.md",
        "needs {:.1f} times as many",
        lambda: 1 / savings("caps", "height of large", "value on the mesh"),
    ),
    (
        "docs/explanation/contact.md",
        "bottoms {:.0f} have a limit",
        lambda: measured("corners.grid_held_limit"),
    ),
    ("docs/explanation/contact.md", "limit: {:.0f} are lost", lambda: measured(f"{GRID}_sliding_lost")),
    (
        "docs/explanation/contact.md",
        "and {:.0f} are lost (patches",
        lambda: measured("corners.grid_held_lost"),
    ),
    (
        "docs/explanation/contact.md",
        "Of the {:.0f} equilibria in Fig. 16",
        lambda: measured("alpha_grid_geometric.equilibria"),
    ),
)


@pytest.mark.parametrize(("page", "sentence", "value"), NUMBERS, ids=[entry[1] for entry in NUMBERS])
def test_a_number_is_that_of_the_results(page, sentence, value):
    text = " ".join((HOME / page).read_text(encoding="utf-8").split())
    assert sentence.format(value()) in text
