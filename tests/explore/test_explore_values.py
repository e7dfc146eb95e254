"""Explore: the values beside the sliders are those of the surface, whatever came before."""

from __future__ import annotations

import pytest
from asking import Client
from browsing import Explored, needs_browser

import pcmc
from pcmc import explore
from pcmc.plan import Plan

SQUARE = [[0, 0], [4, 0], [4, 4], [0, 4]]


def test_the_lower_sheet_of_a_cushion_follows_the_slider_of_the_upper_one():
    running = explore.start(Plan(SQUARE, edge_length=1.0, tension=2.0, cushion=1.5).surface())
    try:
        client = Client(running)
        header, _ = client.ask("/api/open")
        values = header["values"]["asked"]
        assert [group["kinds"] for group in header["controls"]] == [["tensions", "pressures"], []]
        values["tensions"]["patch 1"] = 4.0
        client.ask(
            f"/api/{header['session']}/settle", {key: values[key] for key in ("tensions", "pressures")}
        )
        surface = running.session(header["session"]).surface
        assert [patch.tension for patch in surface.patches] == [4.0, 6.0]
    finally:
        running.close()


def test_a_page_that_is_opened_again_says_nothing_of_targets_that_its_roof_no_longer_meets(hall_roof):
    running = explore.start(hall_roof)
    try:
        client = Client(running)
        header, _ = client.ask("/api/open")
        name = {"session": header["session"]}
        assert client.ask("/api/open", name)[0]["note"] == "met: every target is reached"
        client.ask(f"/api/{name['session']}/settle", {"tensions": {"west": 4.0}})
        again, _ = client.ask("/api/open", name)
        assert (again["note"], again["note_met"]) == ("", False)
    finally:
        running.close()


@needs_browser
def test_a_snow_of_zero_is_one_value_among_others(driver):
    """Undo brings it back, its slider comes back with it, and the card names it where it is the last."""
    snowy = pcmc.solve(Plan(SQUARE, edge_length=1.0, tension=2.0, snow=0.25).surface()).surface
    running = explore.start(snowy)
    try:
        page = Explored(driver, running.url)
        label = "Snow s of patch 1"
        for value in (0, 0.5):
            page.enter(label, value)
        page.find("#undo").click()
        page.idle()
        assert page.number(label).get_attribute("value") == "0"
        driver.refresh()
        page.idle()
        assert label not in page.find("#patches").get_attribute("innerHTML")
        page.find("#reset").click()
        page.idle()
        assert page.number(label).get_attribute("value") == "0.25"
        page.enter(label, -30)
        assert "the last surface at rest, patch 1 s = -" in page.text("#verdict .detail")
    finally:
        running.close()


@needs_browser
def test_coordinates_far_from_zero_keep_the_digits_that_tell_points_apart(driver):
    masts = [[512340.25 + x, 5412340.75 + y, z] for x, y, z in ((0, 0, 2), (4, 0, 0), (4, 4, 2), (0, 4, 0))]
    lines = {"edge": "cable", "cable": 9.0, "supports": masts}
    sail = Plan([m[:2] for m in masts], edge_length=1.0, tension=1.0, pressure=0.0, **lines).surface()
    running = explore.start(sail)
    try:
        page = Explored(driver, running.url)
        x, y, z = (
            page.find(f"input[aria-label='{axis} of point 1']").get_attribute("value") for axis in "xyz"
        )
        assert [float(number) for number in (x, y, z)] == masts[0]
        page.find("#views .measure").click()
        page.find("#canvas").click()
        page.find("#measured button").click()
        picked = driver.execute_script("return window.pcmc.targets.rows.at(-1).target.of")
        exact = driver.execute_script("return window.pcmc.tools.local(window.pcmc.tools.picked[0])")
        assert picked == pytest.approx(exact[:2], abs=1e-4)
        assert f"({exact[0]:.3f}".rstrip("0") in page.text("#measured")
        assert page.complaints() == []
    finally:
        running.close()


@needs_browser
def test_large_and_small_numbers_have_as_many_digits_as_others(page):
    script = (
        "import('./page/elements.js').then(({ digits }) => arguments[1](arguments[0].map((x) => digits(x))))"
    )
    shown = page.driver.execute_async_script(script, [51234567, -0.000051234567, 5.1e7, 51234.567])
    assert shown == ["5.123e+7", "-5.123e-5", "5.1e+7", "51230"]


def test_no_two_numbers_at_an_axis_read_alike(page):
    """A roof in millimetres whose height hardly changes. Before, it had 1235 twice, and 1236."""
    script = """import('./page/diagram.js').then(({ showDiagram }) => {
        const root = document.createElement('div');
        root.innerHTML = '<div class="diagram"></div><ol></ol><div class="detail"></div>';
        const pieces = [{ stable: true, points: [[1, 1234.3], [2, 1236.8]] }];
        const found = { parameter: 'p', value: 1, pieces, equilibria: [], beside: [], words: [] };
        showDiagram(root, found, {}, () => {});
        arguments[0]([...root.querySelectorAll('text')].map((text) => text.textContent));
    })"""
    marks = page.driver.execute_async_script(script)
    assert {"1234.5", "1235", "1235.5"} <= set(marks)
    assert len(marks) == len(set(marks))
