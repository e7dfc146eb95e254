"""Explore in a real browser: how the page is looked at, and that every part of it can be reached."""

from __future__ import annotations

import re
from contextlib import contextmanager
from itertools import pairwise

import numpy as np
import pytest
from browsing import Explored, browser, changed, needs_browser, until
from explore_cases import HALL_TOML, followed
from pictures import near

from generators import spherical_cap, two_squares
from pcmc import explore
from pcmc.base.units import Units
from pcmc.panelling.families import family_of_face
from pcmc.plan import Plan

CAP = spherical_cap(edge_length=0.25)
pytestmark = needs_browser


@pytest.mark.nightly
def test_terms_are_explained_where_they_stand_by_keys_too(page):
    from selenium.webdriver.common.keys import Keys

    for name, words in (
        ("Morse index", "saddle"),
        ("Load over capacity", "raise tensions or lower pressures"),
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


def test_forces_at_masts_have_arrows_with_a_scale_of_their_own(driver):
    masts = [[0, 0, 0], [8, 0, 1], [8, 6, 0], [0, 6, 1]]
    sail = Plan(
        [m[:2] for m in masts],
        edge_length=1.0,
        tension=4.0,
        pressure=0.0,
        edge="cable",
        cable=30.0,
        supports=masts,
    )
    running = explore.start(sail.surface(), units=Units("m", "kN"))
    try:
        page = Explored(driver, running.url)

        def blue():
            return near(255.0 * page.picture(), (0.13, 0.4, 0.67)).sum()

        before = blue()
        page.find("#colours input[value=reactions]").click()
        page.idle()
        most = np.linalg.norm(running.start.certificate.reactions, axis=1).max()
        assert f"blue: at points, up to {most:.3g} kN" in page.text("#legend .name")
        assert blue() > before + 10
        assert not page.complaints()
    finally:
        running.close()


def test_the_table_of_patches_with_snow_fits_its_panel(driver):
    driver.set_window_size(1280, 860)
    patches = {name: {"tension": 6.0, "weight": 0.05} for name in ("west", "east")}
    plan = Plan(
        [[0, 0], [12, 0], [12, 8], [0, 8]],
        [[[6, 0], [6, 8]]],
        edge_length=1.5,
        snow=0.25,
        patches=patches,
    )
    running = explore.start(plan.surface(), units=Units("m", "kN"))
    try:
        parts = Explored(driver, running.url).find("#parts")
        assert "Net p" in parts.text
        assert parts.get_property("scrollWidth") <= parts.get_property("clientWidth")
    finally:
        running.close()


def test_colours_come_with_their_scale(page):
    before = page.picture()
    assert not page.find("#legend").is_displayed()
    units = {"curvature": "1/length", "error": "%", "reactions": "force/length"}
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


@pytest.mark.nightly
def test_many_families_of_panels_are_coloured_by_how_many_are_alike(page, explorer):
    family = family_of_face(explorer.start.surface)
    sizes = np.bincount(family[np.isfinite(family)].astype(int))[1:]
    assert len(sizes) > 8
    before = page.picture()
    page.find("#colours input[value=family]").click()
    until(lambda: "congruent" in page.text("#legend .name"), "the scale")
    page.idle()
    words = page.text("#legend")
    assert (
        f"{len(sizes)} families of congruent panels, {sizes.sum()} panels in all, {sizes.max()} in" in words
    )
    assert f"one of a kind: {(sizes == 1).sum()} panels" in words
    assert f"2 to 4 alike: {sizes[(sizes > 1) & (sizes < 5)].sum()} panels" in words
    assert not page.find("#legend .ends").is_displayed()
    assert changed(before, page.picture()) > 0.1


def test_few_families_of_panels_have_a_colour_each(driver):
    running = explore.start(two_squares(2))
    try:
        page = Explored(driver, running.url)
        family = family_of_face(running.start.surface)
        count = int(np.nanmax(family))
        assert 1 < count <= 8
        page.find("#colours input[value=family]").click()
        until(lambda: page.find("#legend").is_displayed(), "the scale")
        words = page.text("#legend ul").splitlines()
        assert words == [f"family {k}: {int((family == k).sum())} panels" for k in range(1, count + 1)]
        assert not page.complaints()
    finally:
        running.close()


def test_scale_and_views_do_not_lie_over_each_other(page, driver):
    page.find("#colours input[value=curvature]").click()
    try:
        for width in (800, 900, 970, 990, 1280):
            driver.set_window_size(width, 700)
            page.idle()
            legend, views = (page.find(name).rect for name in ("#legend", "#views"))
            beside = legend["x"] + legend["width"] <= views["x"]
            assert beside or legend["y"] + legend["height"] <= views["y"], width
    finally:
        driver.set_window_size(1280, 860)


@pytest.mark.nightly
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


@contextmanager
def small_screen(page, width=400, height=800):
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    page.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        page.idle()
        yield
    finally:
        page.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


@pytest.mark.nightly
def test_a_wide_page_never_scrolls_its_header_away(page):
    page.find("#variants button[type=submit]").click()
    page.idle()
    page.enter("Tension α of left wall", 12)
    page.find("#variants button[aria-pressed]").click()
    page.idle()
    with small_screen(page):
        page.driver.execute_script("window.scrollTo(0, document.body.scrollHeight)")
        assert page.driver.execute_script("return scrollY") > 200
    page.idle()
    scrolled, tall, window = page.driver.execute_script("""
        for (const one of document.querySelectorAll("caption, aside section")) one.scrollIntoView();
        window.scrollTo(0, 1e6);
        return [scrollY, document.documentElement.scrollHeight, innerHeight]""")
    assert (scrolled, tall) == (0, window)
    top = page.driver.execute_script("return document.querySelector('header').getBoundingClientRect().top")
    assert top == 0


@pytest.mark.nightly
def test_on_a_small_screen_half_is_left_for_the_values_and_nothing_lies_over_the_roof(driver, tmp_path):
    path = tmp_path / "hall.toml"
    path.write_text(HALL_TOML)
    with followed(path) as running:
        page = Explored(driver, running.url)
        with small_screen(page):
            page.find("#colours input[value=curvature]").click()
            page.driver.execute_script("window.scrollTo(0, document.body.scrollHeight)")
            page.idle()
            parts = ("#watch", "#verdict", "#canvas", "#legend", "#views")
            boxes = page.driver.execute_script(
                """return arguments[0].map((name) => {
                const box = document.querySelector(name).getBoundingClientRect();
                return [box.top, box.bottom]; })""",
                parts,
            )
            assert boxes[0][0] >= 0.0
            for (_, bottom), (top, _) in pairwise(boxes):
                assert top >= bottom - 0.5
            assert boxes[-1][1] <= 400
            canvas = boxes[2]
            assert canvas[1] - canvas[0] > 120


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


@pytest.mark.nightly
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


@pytest.mark.nightly
def test_points_are_measured_by_mouse_and_keys_and_a_section_follows_its_slider(driver):
    from selenium.webdriver.common.keys import Keys
    from selenium.webdriver.support.select import Select

    running = explore.start(CAP)
    page = Explored(driver, running.url)
    page.find("#views [data-view=plan]").click()
    page.find("#views .measure").click()
    page.idle()  # a point is picked in the view that is drawn
    page.find("#canvas").click()
    until(lambda: page.text("#measured").startswith("Height "), "the height")
    top = float(page.text("#measured").split()[1])
    assert top == pytest.approx(running.start.surface.vertices[:, 2].max(), rel=0.05)
    page.find("#canvas").send_keys(
        Keys.ARROW_LEFT, Keys.SHIFT + Keys.ARROW_UP + Keys.ARROW_UP + Keys.NULL, Keys.ENTER
    )
    told = until(
        lambda: page.text("#measured").startswith("Distance ") and page.text("#measured"), "the distance"
    )
    distance, plan, height = (float(part.split()[-1]) for part in told.split(","))
    assert distance == pytest.approx(np.hypot(plan, height), rel=2e-3)
    assert distance > 0.0
    page.find("#views .measure").click()
    assert not page.text("#measured")
    whole = page.picture()
    place = page.find("#section input")
    assert not place.is_enabled()
    Select(page.find("#section select")).select_by_value("0")
    page.idle()
    half = page.picture()
    assert changed(whole, half) > 0.05
    place.send_keys(*[Keys.ARROW_RIGHT] * 100)
    page.idle()
    assert changed(half, page.picture()) > 0.01
    assert place.get_attribute("aria-valuetext")
    Select(page.find("#section select")).select_by_value("")
    page.idle()
    assert changed(whole, page.picture()) == 0.0
    assert page.complaints() == []
    running.close()


@pytest.mark.nightly
def test_colours_are_light_or_dark_as_the_system_or_the_user_wants(page):
    def ground():
        page.idle()
        return page.picture()[0, 0].mean()

    def system(scheme):
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        page.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})

    light = ground()
    page.find("#theme").click()
    assert ground() < 0.2 < light
    page.find("#theme").click()
    assert ground() == light
    page.driver.refresh()
    system("dark")
    assert ground() < 0.2
    system("light")
    assert page.complaints() == []


def test_every_control_has_a_name_and_is_reached_by_keys(page):
    unnamed = page.driver.execute_script(
        "const named = (one) => one.ariaLabel || one.textContent.trim() || one.labels?.length;"
        "return [...document.querySelectorAll('button, input, select, summary, canvas')]"
        ".filter((one) => one.tabIndex < 0 || !named(one)).map((one) => one.outerHTML)"
    )
    assert unnamed == []
    assert page.find("#verdict").get_attribute("aria-live") == "polite"
