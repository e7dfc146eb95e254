"""Explore in a real browser: the picture, the messages, and what every control does."""

from __future__ import annotations

import time
from contextlib import closing

import numpy as np
import pytest
from browsing import Explored, changed, needs_browser, until
from explore_cases import followed
from shapes import bubbles

import pcmc
from generators import four_fans, spherical_cap
from pcmc import explore
from pcmc.explore.session import Session

CAP = spherical_cap(edge_length=0.25)
RIGHT, CONTROL, ENTER = "\ue014", "\ue009", "\ue007"  # keys
pytestmark = needs_browser


def newest(explorer):
    """The session of the page that was opened or used last."""
    return explorer.sessions[next(reversed(explorer.sessions))]


def chosen(page):
    """The ticked boxes of what may change, by their labels."""
    boxes = page.driver.find_elements("css selector", "#targets .vary input")
    return {box.get_attribute("aria-label"): box for box in boxes if box.is_selected()}


def test_the_page_loads_draws_and_complains_of_nothing(page):
    assert page.verdict == "stable"
    assert "At rest" in page.text("#verdict")
    assert page.text("#title") == "the hall"
    picture = page.picture()
    assert 0.2 < (np.abs(picture - picture[0, 0]).max(axis=2) > 0.1).mean() < 0.9
    assert page.complaints() == []


def test_a_slider_moves_the_surface_and_undo_brings_it_back(page):
    before, words = page.picture(), page.text("#findings")
    assert page.find("#undo").get_attribute("disabled")
    page.slider("Tension α of left wall").send_keys(RIGHT * 60)
    page.idle()
    after = page.picture()
    assert changed(before, after) > 0.01
    assert page.text("#findings") != words
    assert float(page.number("Tension α of left wall").get_attribute("value")) > 11.0
    page.driver.execute_script("document.activeElement.blur()")
    for _ in range(60):
        if page.find("#undo").get_attribute("disabled"):
            break
        page.find("body").send_keys(CONTROL + "z")
        page.idle()
    assert changed(before, page.picture()) == 0.0
    assert page.text("#findings") == words
    assert page.number("Tension α of left wall").get_attribute("value") == "10"
    page.find("#redo").click()
    page.idle()
    assert float(page.number("Tension α of left wall").get_attribute("value")) > 10.0
    assert page.complaints() == []


def test_a_number_may_have_a_decimal_comma_and_what_is_none_is_not_taken(page):
    name = "Tension α of left wall"
    page.enter(name, "10,5")
    assert page.number(name).get_attribute("value") == "10.5"
    page.enter(name, "1.2.3")
    assert page.number(name).get_attribute("value") == "10.5"
    page.find("#undo").click()
    page.idle()
    assert page.number(name).get_attribute("value") == "10"
    assert page.complaints() == []


@pytest.mark.nightly
def test_dragging_a_slider_with_the_mouse_is_one_step(page):
    from selenium.webdriver import ActionChains

    before = page.picture()
    hand = ActionChains(page.driver).click_and_hold(page.slider("Tension α of left wall"))
    for _ in range(8):
        hand = hand.move_by_offset(3, 0).pause(0.03)
    hand.release().perform()
    page.idle()
    assert page.verdict == "stable"
    assert changed(before, page.picture()) > 0.01
    page.find("#undo").click()
    page.idle()
    assert page.find("#undo").get_attribute("disabled")
    assert changed(before, page.picture()) == 0.0


def test_without_an_equilibrium_the_verdict_shows_it_and_the_last_surface_stays(driver):
    with closing(explore.start(CAP)) as running:
        page = Explored(driver, running.url)
        before = page.picture()
        page.enter("Tension α of cap", 0.2)
        assert page.verdict == "no_equilibrium"
        assert "No smooth surface is at rest" in page.text("#verdict")
        assert "Shown: the last surface at rest" in page.text("#verdict")
        drawn = newest(running).surface
        assert 0.47 < drawn.patches[0].tension < 0.6
        assert changed(before, page.picture()) > 0.01  # it went as far as there was a way
        page.find("#back").click()
        page.idle()
        assert page.verdict == "stable"
        assert float(page.number("Tension α of cap").get_attribute("value")) > 0.47
        page.enter("Tension α of cap", -1)
        assert "expected a finite number" in until(lambda: page.text("#note"), "the note")
        assert float(page.number("Tension α of cap").get_attribute("value")) > 0.47
        assert all("400 (Bad Request)" in line for line in page.complaints())
        running.close()  # the page then says that the program has ended
        page.enter("Tension α of cap", 0.7)
        assert "has stopped" in until(
            lambda: "stopped" in page.text("#note") and page.text("#note"), "the note"
        )
        page.complaints()


def test_a_roof_that_cuts_itself_is_named(driver):
    with closing(explore.start(bubbles(0.9 * 2.0 * CAP.vertices[:, 0].max()))) as running:
        page = Explored(driver, running.url)
        warning = "ot to be built as it is: 'west' cuts 'east' near ("
        assert page.verdict == "stable"
        assert warning in page.text("#verdict")
        assert page.find("#verdict .detail").is_displayed()
        page.slider("Tension α of west").send_keys(RIGHT)
        page.idle()
        assert warning in page.text("#verdict")
        assert page.complaints() == []


@pytest.mark.nightly
def test_a_saddle_is_named_and_its_motion_shown(driver):
    with closing(explore.start(four_fans(rings=5, alpha_aux=6.0))) as running:
        page = Explored(driver, running.url)
        assert page.verdict == "saddle"
        assert page.find("#stabilise").is_displayed()
        before = page.picture()
        page.find("#sway").click()
        until(lambda: changed(before, page.picture()) > 0.01, "the surface to move")
        page.find("#sway").click()
        until(lambda: changed(before, page.picture()) == 0.0, "the surface to be as before")
        page.find("#together").click()
        page.enter("Tension α of wall 2", 1.0)
        numbers = [page.number(f"Tension α of wall {k}") for k in (1, 2, 3, 4)]
        assert [n.get_attribute("value") for n in numbers] == ["1"] * 4
        assert page.verdict == "stable"
        assert not page.find("#stabilise").is_displayed()


def test_the_export_downloads_the_surface(page, driver, explorer, monkeypatch):
    page.enter("Tension α of right wall", 12)
    for suffix in (".obj", ".pcmc", ".png"):
        page.find("#export summary").send_keys("\n")
        page.find(f"#export button[value='{suffix}']").send_keys("\n")
        until(lambda: driver.switch_to.active_element.text == "Export", "the keyboard to be where it was")
        path = driver.downloads / f"the hall{suffix}"
        # the browser keeps the name with an empty file while it downloads
        until(lambda path=path: path.exists() and path.stat().st_size, f"the download of {path.name}")
        if suffix == ".png":
            assert path.read_bytes().startswith(b"\x89PNG")
            continue
        read = pcmc.read(path)
        shown = newest(explorer).surface
        assert [p.name for p in read.patches] == [p.name for p in shown.patches]
        np.testing.assert_allclose(read.vertices, shown.vertices, atol=1e-6 * shown.size)
    assert read.patches[4].tension == 12.0
    monkeypatch.setattr(explorer, "export", lambda *_: ("hall.stl", b"solid", "a .stl file loses a plane Π"))
    page.find("#export summary").send_keys("\n")
    page.find("#export button[value='.stl']").send_keys("\n")
    until(lambda: page.text("#note") == "A .stl file loses a plane Π", "the note")
    assert page.complaints() == []


def test_the_mesh_check_is_shown_until_the_surface_changes(page):
    assert not page.find("#check-result").is_displayed()
    page.find("#check").click()
    until(lambda: page.find("#check-result").is_displayed(), "the mesh check")
    assert page.text("#check-result .word").startswith("Persists")
    assert "Height of left" in page.text("#check-result tbody")
    assert "±" in page.text("#check-result tbody")
    aside = page.find("aside")
    assert aside.get_property("scrollWidth") <= aside.get_property("clientWidth")
    page.enter("Tension α of left wall", 12)
    assert not page.find("#check-result").is_displayed()
    assert page.complaints() == []


PROJECT = """# the hall
units = "m"
force = "kN"
[plan]
edge_length = 1.0
outline = [[0, 0], [12, 0], [12, 6], [0, 6]]
[[plan.dividers]]
curve = [[6, 0], [6, 6]]  # the valley
wall = 2.0
[plan.patches]
west = {tension = 5.0}  # left
east = {tension = 5.0}
[targets]
meet = [{quantity = "apex", of = "west", value = 1.2}]
vary = ["west", "east", {patch = "east", kind = "pressure", low = 0.5, high = 2.0}]
"""


@pytest.mark.nightly
def test_a_project_from_its_target_through_variants_to_a_saved_and_watched_file(driver, tmp_path):
    path = tmp_path / "hall.toml"
    path.write_text(PROJECT)
    with followed(path) as running:
        page = Explored(driver, running.url)
        assert page.text("#targets .message").startswith("met")
        assert "kN/m" in page.text("#parts")
        assert "west 1.2 " in page.text("#parts")
        page.driver.execute_script("document.querySelector('#targets details').open = true")
        assert [*chosen(page)] == ["west may change", "east may change", "pressure of east may change"]
        # a target is met from the page; one that cannot be met keeps the surface
        page.find("#variants button[type=submit]").click()
        page.idle()
        for value, state in (("1.5", "met"), ("90", "missed")):
            wanted = page.find("#targets input[aria-label='Value wanted']")
            wanted.clear()
            wanted.send_keys(value)
            page.find("#targets .meet").click()
            told = page.find("#targets .message")
            until(lambda told=told, state=state: told.get_attribute("data-state") == state, state)
            page.idle()
            assert "west 1.5 " in page.text("#parts")
        assert "nearest reachable" in page.text("#targets .message")
        # compared with what was kept
        before = page.picture()
        page.find("#variants button[aria-pressed]").click()
        page.idle()
        assert changed(before, page.picture()) > 0.1
        assert "Distance from Variant 1, m" in page.text("#legend .name")
        table = page.text("#variants table")
        assert "west\nApex m 1.2 1.5 +0.3 +25\n" in table
        assert "Pressure kN/m²" not in table.partition("east\n")[0]  # it does not differ
        assert "more numbers are the same to four digits" in table
        page.find("#variants button[aria-pressed]").click()
        page.idle()
        assert changed(before, page.picture()) == 0.0
        # saved: a name is asked for, and a file is replaced only when that is allowed
        page.find("#save-project").click()
        page.find("#saving .same").click()
        page.find("#saving input[type=checkbox]").click()
        page.find("#saving button[type=submit]").click()
        until(lambda: "is there already" in page.text("#saving .message"), "the refusal")
        assert path.read_text() == PROJECT
        name = page.find("#saving input[type=text]")
        name.clear()
        name.send_keys("higher")
        page.find("#saving button[type=submit]").click()
        until(lambda: "Saved as higher.toml" in page.text("#note"), "the saved file")
        text = (tmp_path / "higher.toml").read_text()
        assert "# the valley" in text
        assert "value = 1.5" in text
        page.complaints()  # the refused save
        # followed: another plan, then a broken one
        path.write_text(PROJECT.replace("[6, 0], [6, 6]", "[7, 0], [7, 6]"))
        until(lambda: "west 1.2 " in page.text("#parts"), "the new roof")
        page.idle()
        assert changed(before, page.picture()) > 0.01
        assert page.text("#variants li").startswith("Variant 1")
        path.write_text("[plan]\n")
        until(lambda: page.find("#watch").get_attribute("data-state") == "problem", "the problem")
        assert "edge_length" in page.text("#watch") or "outline" in page.text("#watch")
        assert "west 1.2 " in page.text("#parts")
        assert page.complaints() == []


def test_tied_tensions_are_one_choice_and_stay_equal(driver, tmp_path):
    path = tmp_path / "hall.toml"
    path.write_text(PROJECT.replace('["west", "east", {', '[["west", "east"], {'))
    with followed(path) as running:
        page = Explored(driver, running.url)
        driver.execute_script("document.querySelector('#targets details').open = true")

        def box(name):
            return page.find(f"#targets .vary input[aria-label='{name} may change']")

        pressure = "pressure of east may change"
        assert [*chosen(page)] == ["tension of west and east may change", pressure]
        box("west").click()
        assert [*chosen(page)] == ["west may change", pressure]  # the tie is let go
        box("tension of west and east").click()
        assert [*chosen(page)] == ["tension of west and east may change", pressure]
        wanted = page.find("#targets input[aria-label='Value wanted']")
        wanted.clear()
        wanted.send_keys("1.4")
        page.find("#targets .meet").click()
        until(lambda: "west 1.4 " in page.text("#parts"), "the targets")
        page.idle()
        west, east = (page.number(f"Tension α of {name}").get_attribute("value") for name in ("west", "east"))
        assert west == east
        assert page.complaints() == []


def test_wrong_targets_are_named_on_the_page(page):
    message = page.find("#targets .message")
    page.find("#targets .meet").click()
    assert "number" in message.text
    page.find("#targets input[aria-label='Value wanted']").send_keys("3")
    page.driver.execute_script("document.querySelector('#targets details').open = true")
    for box in chosen(page).values():
        box.click()
    page.find("#targets .meet").click()
    assert "at least one tension" in message.text
    page.find("#targets .target-row button").click()
    page.find("#targets .meet").click()
    assert "number" in message.text
    assert page.complaints() == []


@pytest.mark.nightly
def test_sliders_agree_with_their_numbers(page, explorer):
    """Also for values beyond the slider's ends, zero, and another sign."""
    page.enter("Pressure p of right", 500)
    place = float(page.slider("Pressure p of right").get_attribute("value"))
    assert 100 < place < 950  # not at its end
    page.enter("Pressure p of right", 1)
    for value in (40, 3, 0):
        page.enter("Tension α of left wall", value)
        number, slider = page.number("Tension α of left wall"), page.slider("Tension α of left wall")
        assert float(number.get_attribute("value")) == value
        assert float(slider.get_attribute("aria-valuetext")) == value
        place, low = float(slider.get_attribute("value")), float(slider.get_attribute("min"))
        assert (place == low) == (value == 0)
    page.enter("Tension α of left wall", 3)
    page.enter("Pressure p of left", -0.5)
    place = float(page.slider("Pressure p of left").get_attribute("value"))
    assert 0.0 < place < 300.0
    page.slider("Pressure p of left").send_keys(RIGHT * 20)
    page.idle()
    shown = float(page.number("Pressure p of left").get_attribute("value"))
    assert shown == newest(explorer).state().wanted.patches[0].pressure  # to the last digit
    page.complaints()


@pytest.mark.nightly
def test_slow_work_is_said(page, monkeypatch):
    real = Session.settle

    def slow(self, values, turn):
        time.sleep(2.0)
        return real(self, values, turn=turn)

    monkeypatch.setattr(Session, "settle", slow)
    page.number("Tension α of left wall").send_keys(CONTROL + "a\ue000", "11", "\ue004")
    sign = page.find("#verdict .sign")
    green = sign.value_of_css_property("color")
    until(lambda: "Working" in page.text("#verdict .work"), "the words", seconds=1.9)
    words = page.text("#verdict")
    assert words.splitlines()[1].startswith("Working")  # first, after the sign
    assert sign.value_of_css_property("color") != green
    page.idle()
    assert not page.text("#verdict .work")
    assert sign.value_of_css_property("color") == green


@pytest.mark.nightly
def test_two_pages_are_two_sessions(driver, explorer):
    one = Explored(driver, explorer.url)
    first = driver.current_window_handle
    one.enter("Tension α of left wall", 20)
    changed_words = one.text("#findings")
    driver.switch_to.new_window("tab")
    two = Explored(driver, explorer.url)
    assert two.number("Tension α of left wall").get_attribute("value") == "10"
    assert two.text("#findings") != changed_words
    driver.close()
    driver.switch_to.window(first)
    assert one.text("#findings") == changed_words
    driver.refresh()
    one.idle()
    assert one.text("#findings") == changed_words  # the same tab finds its session again


def test_the_diagram_of_equilibria_shows_each_of_them_by_a_click(driver):
    with closing(explore.start(spherical_cap(0.3))) as running:
        page = Explored(driver, running.url)
        page.find("#equilibria").click()
        until(lambda: page.text("#equilibria-result ol"), "the equilibria")
        assert page.text("#equilibria-result ol").splitlines()[0].startswith("stable, E = ")
        assert "Barrier from 1 over saddle 2" in page.text("#equilibria-result .detail")
        before = page.picture()
        page.find("#equilibria-result li:nth-child(2) button").click()
        page.idle()
        assert page.verdict == "saddle"
        assert changed(before, page.picture()) > 0.05
        dashed, lines = (
            driver.find_elements("css selector", f".diagram polyline{of}") for of in (".saddle", "")
        )
        assert 0 < len(dashed) < len(lines)
        marks = [text.text for text in driver.find_elements("css selector", ".diagram text")]
        numbers = [mark for mark in marks if mark[-1].isdigit()]
        assert len(numbers) >= 4
        assert all(len(mark.replace(".", "").strip("-0")) <= 2 for mark in numbers)
        points = page.driver.find_elements("css selector", ".diagram circle.way")
        pressures = {float(point.get_attribute("aria-label").split()[1].strip(",")) for point in points}
        assert min(pressures) < 0.6
        points[0].send_keys(ENTER)  # on the branch, at another pressure, and by the keyboard
        page.idle()
        there = float(points[0].get_attribute("aria-label").split()[1].strip(","))
        shown = page.number("Pressure p of cap").get_attribute("value")
        assert float(shown) == pytest.approx(there, rel=1e-3)
        assert len(page.driver.find_elements("css selector", ".diagram [aria-current=true]")) == 1
        page.find("#undo").click()
        page.idle()
        assert page.verdict == "saddle"
        assert not page.find("#equilibria-result").is_displayed()  # it is about the surface shown
        assert page.complaints() == []
