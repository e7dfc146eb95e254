"""Margins where they are asked for: targets, projects, the command, the report, the page."""

import numpy as np
import pytest
from browsing import needs_browser, until
from refusals import refused
from small_project import WITH_UNITS, changed

from generators import spherical_cap, two_squares
from pcmc import Parameter, Target, margin, meet, sensitivities, solve
from pcmc.base.errors import OptionError
from pcmc.base.units import Units
from pcmc.cli import main
from pcmc.explore.page_data import target_choices
from pcmc.explore.session import Session, solved_start
from pcmc.project import run
from pcmc.project.varied import with_units
from pcmc.sweep import run as sweep
from pcmc.sweep import short_table
from pcmc.sweep.projects import project_sweep


@pytest.fixture(scope="module")
def cap():
    return solve(spherical_cap(0.25, alpha=0.75)).surface


@pytest.fixture
def roof(tmp_path):
    file = tmp_path / "roof.toml"
    file.write_text(WITH_UNITS + '[solve]\nmargin = ["pressure", "tension of roof"]\n', encoding="utf-8")
    return file


WANTED = Target("margin", "pressure", at_least=1.8)


def test_slopes_at_the_fold_are_those_of_differences(cap):
    changes = {"tension": [{"cap": 0.751}], "pressure": [None, {"cap": 1.001}], "weight": {"cap": 1e-3}}
    slopes = sensitivities(cap, WANTED, [Parameter("cap", kind) for kind in changes]).to_numpy()[0]
    before = margin(cap, "pressure", meshes=1).factor
    for slope, change in zip(slopes, changes.values(), strict=True):
        other = cap.retensioned(weights=change) if isinstance(change, dict) else cap.retensioned(*change)
        after = margin(solve(other, min_quality=0.0), "pressure", meshes=1).factor
        assert slope == pytest.approx((after - before) / 1e-3, rel=1e-2)


@pytest.mark.nightly
def test_a_margin_is_a_target(cap):
    design = meet(cap, WANTED, "cap")
    assert design.met
    assert design.targets["value"].iloc[0] >= 1.8 * (1.0 - 1e-7)
    exact = meet(cap, Target("margin", "pressure", 1.8), "cap")
    assert exact.met
    assert margin(exact.surface, "pressure", meshes=1).factor == pytest.approx(1.8, rel=1e-5)
    assert exact.surface.patches[0].tension == pytest.approx(0.9, rel=0.04)  # 2 α = 1.8 but for the mesh


def test_a_target_that_ends_otherwise_is_refused():
    squares = solve(two_squares(8)).surface
    with refused(OptionError, what="of", found="wall"):
        meet(squares, Target("margin", "wall", at_least=1.3), "left")
    with refused(OptionError, what="of", found="snow"):
        meet(squares, Target("margin", "snow", at_least=1.3), "left")


def test_a_project_asks_for_margins(roof, capsys):
    outcome = run(changed(roof, "[solve]", '[output]\nreport = "roof.pdf"\n[solve]\nmesh_check = false'))
    assert [found.what for found in outcome.margins] == ["pressure", "tension of roof"]
    assert outcome.margin("pressure") is outcome.margins[0]
    first, second = (found.factor for found in outcome.margins)
    assert first * second == pytest.approx(1.0, rel=1e-3)
    changed(roof, '"pressure", ', "")
    assert main(["certify", str(roof), "--margin", "snow"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("margin: ")]
    assert len(lines) == 2
    assert "kN/m² of snow" in lines[0]
    assert "times the tension of roof: then the roof inflates (fold" in lines[1]


@pytest.mark.nightly
def test_a_project_has_a_margin_as_a_target(roof):
    """Its start is not at rest, and has no margin."""
    target = """[targets]
vary = ["roof"]
meet = [{quantity = "margin", of = "pressure", value = 1.8}]
[solve]
mesh_check = false"""
    outcome = run(changed(roof, "[solve]", target))
    assert outcome.design.met
    assert outcome.margin("pressure").factor == pytest.approx(1.8, rel=1e-3)


def test_a_margin_of_what_is_0_now_is_a_value_with_its_unit(cap):
    numbers = margin(cap, "snow", meshes=1).numbers()
    assert "snow.margin" not in numbers
    assert with_units(numbers, Units("m", "kN"))["snow.margin_value"] == "snow.margin_value [kN/m²]"


def test_an_unknown_name_is_refused_before_solving(roof, capsys):
    assert main(["solve", str(changed(roof, '"pressure"', '"presure"'))]) == 2
    text = "roof.toml: line 9: unknown load or tension 'presure'; did you mean 'pressure'?"
    assert text in capsys.readouterr().err


@pytest.mark.nightly
def test_a_sweep_has_a_column(roof):
    table = sweep(project_sweep(roof, {"roof.tension": [2.0, 3.0]}), workers=1)
    margins = table["pressure.margin"].to_numpy()
    assert margins[1] == pytest.approx(1.5 * margins[0], rel=0.01)
    assert table["pressure.margin_ends_by"].tolist() == ["fold", "fold"]
    assert {"pressure.margin", "tension of roof.margin"} < {*short_table(table, ["roof.tension"])}


def test_the_page_offers_each_margin_once(cap):
    (offered,) = (one["of"] for one in target_choices(cap) if one["quantity"] == "margin")
    assert offered == ["pressure", "snow", "weight", "tension"]  # of the only patch


def test_the_page_asks_for_the_surface_shown(cap):
    session = Session(solved_start(cap))
    assert session.margin("pressure").surface.n == cap.n
    assert session.margin("pressure", lambda: True) is None


@pytest.mark.nightly
@needs_browser
def test_the_page_shows_the_sentence_and_the_shape_there(page):
    page.find("#margin").click()
    until(lambda: page.find("#margin-result").is_displayed(), "the margin")
    assert page.text("#margin-result .detail").startswith("Holds ")
    before = page.picture()
    page.find("#margin-result button").click()
    until(lambda: np.abs(page.picture() - before).max() > 0.1, "the shape there")
    page.enter("Tension α of left wall", 12)
    assert not page.find("#margin-result").is_displayed()
    assert page.complaints() == []
