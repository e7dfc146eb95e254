"""Explore in a real browser: the picture, the messages, and what every control does."""

from __future__ import annotations

import re
import time

import numpy as np
import pytest
from browsing import BROWSER, DRIVER, SOFTWARE_GL, Explored, browser, changed, until

import pcmc
from generators import bezier_hall, four_fans, spherical_cap
from pcmc import explore
from pcmc.base.units import Units
from pcmc.explore.roof import read_roof
from pcmc.explore.session import Session

CAP = spherical_cap(edge_length=0.25)
HALL = bezier_hall(edge_length=10.0)

pytestmark = pytest.mark.skipif(not (BROWSER and DRIVER), reason="chromium or chromedriver is not installed")


@pytest.fixture(scope="module")
def explorer():
    running = explore.start(HALL, title="the hall")
    yield running
    running.close()


@pytest.fixture(scope="module")
def driver(tmp_path_factory):
    folder = tmp_path_factory.mktemp("browser")
    running = browser(folder, *SOFTWARE_GL)
    running.downloads = folder / "downloads"
    yield running
    running.quit()


def newest(explorer):
    """The session of the page that was opened or used last."""
    return explorer.sessions[next(reversed(explorer.sessions))]


@pytest.fixture
def page(driver, explorer):
    return Explored(driver, f"{explorer.url}?session={explorer.open()[0]}")


def test_the_page_loads_draws_and_complains_of_nothing(page):
    assert page.verdict == "stable"
    assert "At rest" in page.text("#verdict")
    assert page.text("#title") == "the hall"
    picture = page.picture()
    ground = picture[0, 0]
    assert 0.2 < (np.abs(picture - ground).max(axis=2) > 0.1).mean() < 0.9
    assert page.complaints() == []


def test_a_slider_moves_the_surface_and_undo_brings_it_back(page):
    from selenium.webdriver.common.keys import Keys

    before, words = page.picture(), page.text("#findings")
    assert page.find("#undo").get_attribute("disabled")
    page.slider("Tension α of left wall").send_keys(*[Keys.ARROW_RIGHT] * 60)
    page.idle()
    after = page.picture()
    assert changed(before, after) > 0.01
    assert page.text("#findings") != words
    assert float(page.number("Tension α of left wall").get_attribute("value")) > 11.0
    page.driver.execute_script("document.activeElement.blur()")
    for _ in range(60):
        if page.find("#undo").get_attribute("disabled"):
            break
        page.find("body").send_keys(Keys.CONTROL + "z")
        page.idle()
    assert changed(before, page.picture()) == 0.0
    assert page.text("#findings") == words
    assert page.number("Tension α of left wall").get_attribute("value") == "10"
    page.find("#redo").click()
    page.idle()
    assert float(page.number("Tension α of left wall").get_attribute("value")) > 10.0
    assert page.complaints() == []


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
    running = explore.start(CAP)
    try:
        page = Explored(driver, running.url)
        before = page.picture()
        page.enter("Tension α of cap", 0.2)
        assert page.verdict == "no_equilibrium"
        assert "cannot balance" in page.text("#verdict")
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
        console = page.complaints()
        assert all("400 (Bad Request)" in line for line in console)
    finally:
        running.close()


def test_a_saddle_is_named_and_its_motion_shown(driver):
    running = explore.start(four_fans(rings=5, alpha_aux=6.0))
    try:
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
    finally:
        running.close()


def test_the_export_downloads_the_surface(page, driver, explorer):
    page.enter("Tension α of right wall", 12)
    for suffix in (".obj", ".pcmc", ".png"):
        page.find("#export summary").click()
        page.find(f"#export button[value='{suffix}']").click()
        path = driver.downloads / f"the hall{suffix}"
        until(path.exists, f"the download of {path.name}")
        if suffix == ".png":
            assert path.read_bytes().startswith(b"\x89PNG")
            continue
        read = pcmc.read(path)
        shown = newest(explorer).surface
        assert [p.name for p in read.patches] == [p.name for p in shown.patches]
        np.testing.assert_allclose(read.vertices, shown.vertices, atol=1e-6 * shown.size)
    assert read.patches[4].tension == 12.0
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


@pytest.mark.slow
def test_a_project_from_its_target_through_variants_to_a_saved_and_watched_file(driver, tmp_path):
    path = tmp_path / "hall.toml"
    path.write_text(PROJECT)

    def read():
        return read_roof(path, use_cache=False)

    running = explore.start_roof(read(), watch=read)
    try:
        page = Explored(driver, running.url)
        assert page.text("#targets .message").startswith("met")
        assert "kN/m" in page.text("#by-patch")
        assert "west 1.2 " in page.text("#by-patch")
        page.driver.execute_script("document.querySelector('#targets details').open = true")
        boxes = page.driver.find_elements("css selector", "#targets .vary input")
        chosen = [box.get_attribute("aria-label") for box in boxes if box.is_selected()]
        assert chosen == ["west may change", "east may change", "pressure of east may change"]
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
            assert "west 1.5 " in page.text("#by-patch")
        assert "nearest reachable" in page.text("#targets .message")
        # compared with what was kept
        before = page.picture()
        page.find("#variants button[aria-pressed]").click()
        page.idle()
        assert changed(before, page.picture()) > 0.1
        assert "Distance from Variant 1, m" in page.text("#legend .name")
        assert "Apex of west 1.2 1.5 +0.3 +25 %" in page.text("#variants table")
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
        until(lambda: "west 1.2 " in page.text("#by-patch"), "the new roof")
        page.idle()
        assert changed(before, page.picture()) > 0.01
        assert page.text("#variants li").startswith("Variant 1")
        path.write_text("[plan]\n")
        until(lambda: page.find("#watch").get_attribute("data-state") == "problem", "the problem")
        assert "edge_length" in page.text("#watch") or "outline" in page.text("#watch")
        assert "west 1.2 " in page.text("#by-patch")
        assert page.complaints() == []
    finally:
        running.close()


def test_wrong_targets_are_named_on_the_page(page):
    message = page.find("#targets .message")
    page.find("#targets .meet").click()
    assert "number" in message.text
    page.find("#targets input[aria-label='Value wanted']").send_keys("3")
    page.driver.execute_script("document.querySelector('#targets details').open = true")
    for box in page.driver.find_elements("css selector", "#targets .vary input"):
        if box.is_selected():
            box.click()
    page.find("#targets .meet").click()
    assert "at least one tension" in message.text
    page.find("#targets .target-row button").click()
    page.find("#targets .meet").click()
    assert "number" in message.text
    assert page.complaints() == []


@pytest.mark.slow
def test_sliders_agree_with_their_numbers(page, explorer):
    """Also for values beyond the slider's ends, zero, and another sign."""
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
    assert place == 0.0
    page.slider("Pressure p of left").send_keys("\ue014" * 20)  # to the right
    page.idle()
    shown = float(page.number("Pressure p of left").get_attribute("value"))
    asked = explorer.sessions[next(reversed(explorer.sessions))].state().asked[0].pressure
    assert shown == asked  # to the last digit
    page.complaints()


def test_terms_are_explained_where_they_stand_by_keys_too(page):
    from selenium.webdriver.common.keys import Keys

    for name, words in (
        ("Morse index", "saddle"),
        ("Load over capacity", "no equilibrium exists"),
        ("Error by Meyer's measure", "Voronoi"),
    ):
        (summary,) = [
            s for s in page.driver.find_elements("css selector", "#findings summary") if s.text == name
        ]
        assert words not in page.text("#findings")
        summary.send_keys(Keys.ENTER)
        assert words in page.text("#findings")
        page.driver.find_element("css selector", "#findings details[open] summary").click()


def test_the_walls_are_a_layer(page):
    page.find("#canvas").send_keys("\ue015" * 12)  # down: the roof from below
    page.idle()
    before = page.picture()
    page.find("#shows input[value=walls]").click()
    page.idle()
    assert changed(before, page.picture()) > 0.01


def test_slow_work_is_said(page, monkeypatch):
    real = Session.settle

    def slow(self, values):
        time.sleep(2.0)
        return real(self, values)

    monkeypatch.setattr(Session, "settle", slow)
    number = page.number("Tension α of left wall")
    number.send_keys("\ue009a\ue000", "11", "\ue004")
    until(lambda: "Working" in page.text("#verdict .work"), "the words", seconds=1.9)
    page.idle()
    assert not page.text("#verdict .work")


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


def test_units_stand_behind_the_numbers_where_they_are_given(driver):
    running = explore.start(CAP, units=Units("ft", "kip"))
    try:
        page = Explored(driver, running.url)
        rows = page.text("#findings")
        assert " ft\n" in rows
        assert " ft²\n" in rows
        assert " ft³\n" in rows
        assert " kip·ft\n" in rows
        for name, words in (("curvature", "1/ft"), ("reactions", "kip/ft")):
            page.find(f"#colours input[value={name}]").click()
            page.idle()
            assert words in page.text("#legend .name")
        titles = [
            label.get_attribute("title") for label in driver.find_elements("css selector", "#patches label")
        ]
        assert titles == ["kip/ft", "kip/ft²"]
        page.find("#check").click()
        rows = until(lambda: page.text("#check-result tbody"), "the mesh check")
        assert re.search(r"Height of cap\s+[\d.]+ ± [\d.]+ ft\s+[\d.]+ ± [\d.]+ ft\n", rows)
        assert " kip/ft³" in rows
        assert not page.complaints()
    finally:
        running.close()


def test_colours_come_with_their_scale(page):
    before = page.picture()
    assert not page.find("#legend").is_displayed()
    units = {"curvature": "1/length", "error": "%", "reactions": "force/length", "family": "1 %"}
    for name, words in units.items():
        page.find(f"#colours input[value={name}]").click()
        page.idle()
        until(lambda words=words: words in page.text("#legend .name"), "the scale")
        low, high = (float(page.text(f"#legend .{end}")) for end in ("low", "high"))
        assert low < high
        assert changed(before, page.picture()) > 0.1
    page.find("#colours input[value=patches]").click()
    page.idle()
    assert changed(before, page.picture()) == 0.0
    for name in ("mesh", "supports", "smooth", "grid"):
        page.find(f"#shows input[value={name}]").click()
        page.idle()
        assert changed(before, page.picture(), by=0.01) > 0.005, name
        page.find(f"#shows input[value={name}]").click()
        page.idle()
    assert page.complaints() == []


def test_the_view_turns_by_keys_mouse_and_fingers(page):
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.keys import Keys

    canvas, before = page.find("#canvas"), page.picture()

    def home():
        page.find("[data-view=diagonal]").click()
        page.idle()
        assert changed(before, page.picture()) == 0.0

    for keys in (Keys.ARROW_LEFT, Keys.ARROW_UP, "+"):
        canvas.send_keys(keys)
        page.idle()
        assert changed(before, page.picture()) > 0.01
        home()
    ActionChains(page.driver).drag_and_drop_by_offset(canvas, 60, 20).perform()
    page.idle()
    turned = page.picture()
    assert changed(before, turned) > 0.01
    home()
    box = canvas.rect
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    touch(page.driver, [middle], [(middle[0] + 60, middle[1] + 20)])
    page.idle()
    assert changed(turned, page.picture()) < 0.02
    home()
    apart = [(middle[0] - d, middle[1]) for d in (-40, 40)]
    touch(page.driver, apart, [(middle[0] - d, middle[1]) for d in (-90, 90)])
    page.idle()
    assert changed(before, page.picture()) > 0.05  # a pinch comes nearer
    home()
    for name in ("elevation", "plan"):
        page.find(f"[data-view={name}]").click()
        page.idle()
        assert changed(before, page.picture()) > 0.05
    assert page.complaints() == []


def touch(driver, start, end):
    """Put fingers down, move them and lift them."""

    def points(part):
        return [
            {"x": a[0] + part * (b[0] - a[0]), "y": a[1] + part * (b[1] - a[1]), "id": k}
            for k, (a, b) in enumerate(zip(start, end, strict=True))
        ]

    steps = [("touchStart", points(0.0)), *(("touchMove", points(k / 5)) for k in range(1, 6))]
    for kind, where in (*steps, ("touchEnd", [])):
        driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": where})


def test_every_control_has_a_name_and_the_keyboard_reaches_it(page):
    nameless = page.driver.execute_script("""
        return [...document.querySelectorAll("button, input, summary, canvas")].filter((e) => !(
          e.getAttribute("aria-label") || e.textContent.trim() || [...(e.labels || [])].some(
            (l) => l.textContent.trim()))).map((e) => e.outerHTML)""")
    assert nameless == []
    unreachable = page.driver.execute_script(
        "return [...document.querySelectorAll('button, input, summary, canvas')]"
        ".filter((e) => e.tabIndex < 0).length"
    )
    assert unreachable == 0
    doubled = page.driver.execute_script(
        "const ids = [...document.querySelectorAll('[id]')].map((e) => e.id);"
        "return ids.filter((id, i) => ids.indexOf(id) !== i)"
    )
    assert doubled == []


def test_on_a_small_screen_the_verdict_stays_in_view(page):
    page.driver.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": 360, "height": 700, "deviceScaleFactor": 1, "mobile": True},
    )
    try:
        page.idle()
        page.driver.execute_script("window.scrollTo(0, document.body.scrollHeight)")
        page.idle()
        scrolled, wide, top, bottom = page.driver.execute_script("""
            const box = document.querySelector("#verdict").getBoundingClientRect();
            return [scrollY, document.documentElement.scrollWidth, box.top, box.bottom]""")
        assert scrolled > 200
        assert wide <= 360
        assert top >= 0
        assert bottom <= 700
    finally:
        page.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_without_webgl_the_page_says_so_in_one_line_and_works(explorer, tmp_path):
    running = browser(tmp_path, "--disable-3d-apis")
    try:
        page = Explored(running, explorer.url)
        assert "WebGL 2 is missing" in page.text("#no-graphics")
        words = page.text("#findings")
        page.enter("Tension α of left wall", 14)
        assert page.verdict == "stable"
        assert page.text("#findings") != words
    finally:
        running.quit()


def test_when_the_program_has_ended_the_page_says_so(driver):
    running = explore.start(CAP)
    page = Explored(driver, running.url)
    running.close()
    page.enter("Tension α of cap", 0.7)
    assert "has stopped" in until(lambda: page.text("#note"), "the note")
    page.complaints()
