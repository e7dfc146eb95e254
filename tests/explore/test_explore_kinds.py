"""Explore: each kind of project is opened, moved, aimed at a target, saved, and opened again."""

from __future__ import annotations

import tomllib

import pytest
from browsing import Explored, needs_browser, until
from explore_cases import followed
from nightly import night_but

from pcmc.design import Target
from pcmc.design.targets import measure
from pcmc.explore import roof as saving
from pcmc.explore.roof import read_roof
from pcmc.io import write
from pcmc.plan import Plan
from pcmc.project.values import changeable_values, differences, single_points

HALL = "[plan]\nedge_length = 1.0  # coarse\noutline = [[0, 0], [12, 0], [12, 6], [0, 6]]\n"
CUT = "dividers = [[[6, 0], [6, 6]]]\n"
PATCHES = "[plan.patches]\nwest = {tension = 5.0}\neast = {tension = 5.0, pressure = 1}\n"
OUTPUT = "[output]\nfiles = ['hall.obj', 'out.glb']\nreport = 'hall-report.pdf'\n"
SAIL = """units = "m"
[plan]
edge_length = 1.0
outline = [[0, 0], [8, 0], [8, 8], [0, 8]]
edge = "cable"
cable = 9.0
supports = [[0, 0, 4], [8, 0, 0], [8, 8, 4], [0, 8, 0]]
tension = 1.0
pressure = 0.0
"""
MIRROR = "mirrors = [[[6, 0], [6, 6]]]\n"
TEXTS = {
    "patches": f"units = 'm'\n{HALL}{CUT}{PATCHES}{OUTPUT}",
    "one tension": f"{HALL}tension = 5.0\nsnow = 0.25\n{CUT}",
    "rise": f"{HALL}rise = 1.4\n{CUT}",
    "drawing": 'units = "m"\n[plan]\ndrawing = "hall.dxf"\nedge_length = 1.0\n',
    "sail": SAIL,
    "half": f"{HALL.replace('[12, 0], [12, 6]', '[6, 0], [6, 6]')}{MIRROR}tension = 4.0\n",
}
MOVED = {  # what is changed: a slider's kind, and the name of its patch or cable
    "patches": ("tensions", "east"),
    "one tension": ("tensions", "patch 2"),
    "rise": ("tensions", "patch 1"),
    "drawing": ("tensions", "north"),
    "sail": ("cables", "cable 2"),
    "half": ("pressures", "patch 1"),
}


def written(kind, folder):
    """The file of a project of a kind."""
    if kind == "drawing":
        draw(folder / "hall.dxf")
    path = folder / "hall.toml"
    path.write_text(TEXTS[kind])
    return path


def test_a_project_of_a_mesh_is_saved_with_its_patches(tmp_path):
    hall = Plan([[0, 0], [8, 0], [8, 4], [0, 4]], tension=4.0, edge_length=1.0).surface()
    write(tmp_path / "hall.obj", hall)
    (tmp_path / "roof.toml").write_text('units = "m"\nmesh = "hall.obj"  # scanned\n')
    roof = read_roof(tmp_path / "roof.toml", start_shape=True)
    surface = changed(roof.surface, "tensions", roof.surface.patches[0].name)
    path, _ = saving.save(roof, surface, "other", False)
    assert not differences(read_roof(path, start_shape=True).surface, surface)
    moved = surface.retensioned(
        weights={surface.patches[0].name: 0.1}, pressures={surface.patches[0].name: 1.2}
    )
    again, _ = saving.save(roof, moved, "heavy", False)
    assert tomllib.loads(again.read_text())["mesh"]["patches"]["patch 1"]["weight"] == 0.1


def draw(path):
    """A hall of three parts: one wall is a single line that another one cuts in two."""
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new()
    space = drawing.modelspace()
    space.add_lwpolyline([(0, 0), (12, 0), (12, 6), (0, 6)], close=True, dxfattribs={"layer": "outline"})
    for line in (((6, 0), (6, 6)), ((9, 0), (9, 6))):
        space.add_line(*line, dxfattribs={"layer": "divider ridge"})
    for name, x, y in (("north", 3, 4), ("south", 10, 2)):
        space.add_text(f"{name} = 5", dxfattribs={"layer": "patch", "insert": (x, y)})
    drawing.units = 6
    drawing.saveas(path)


def changed(surface, kind, name, factor=1.1):
    """The surface with one value a little larger."""
    values = {kind: {name: factor * changeable_values(surface)[kind][name]}}
    return surface.retensioned(**values)


@pytest.mark.parametrize("kind", night_but(TEXTS, "rise", "half"))
def test_every_kind_of_project_is_saved_with_the_values_of_the_surface(kind, tmp_path):
    roof = read_roof(written(kind, tmp_path), start_shape=True)
    text, _, left = saving.project_with(roof, roof.surface)
    assert not left
    if kind != "rise":
        assert text == TEXTS[kind]  # nothing was changed
    surface = changed(roof.surface, *MOVED[kind])
    path, _ = saving.save(roof, surface, "other.toml", False)
    assert not differences(read_roof(path, start_shape=True).surface, surface)
    if kind == "one tension":
        plan = tomllib.loads(path.read_text())["plan"]
        assert (plan["snow"], plan["patches"]) == (
            0.25,
            {"patch 1": {"tension": 5.0}, "patch 2": {"tension": 5.5}},
        )
    if kind == "sail":
        lower = roof.surface.vertices.copy()
        lower[single_points(surface)[2]] = [7.0, 8.5, 3.0]
        path, _ = saving.save(roof, surface.moved(lower), "lower.toml", False)
        plan = tomllib.loads(path.read_text())["plan"]
        assert (plan["supports"][2], plan["outline"][2]) == ([7.0, 8.5, 3.0], [7.0, 8.5])
        assert plan["cables"][1] == {"name": "cable 2", "curve": [[8.0, 0.0], [7.0, 8.5]], "tension": 9.9}
    if kind == "patches":
        output = tomllib.loads(path.read_text())["output"]
        assert output == {"files": ["other.obj", "other-out.glb"], "report": "other-report.pdf"}
        assert "edge_length = 1.0  # coarse" in path.read_text()


TARGETS = {  # a quantity, what it is of, and the factor by which it is to change
    "patches": ("area", "west", 1.01),
    "one tension": ("volume", None, 1.05),
    "rise": ("apex", None, 0.9),
    "drawing": ("reaction per length", "south", 1.05),
    "sail": ("sag", "cable 1", 0.95),
    "half": ("height", None, 1.1),
}
LABELS = {"tensions": "Tension α", "pressures": "Pressure p", "cables": "Tension τ"}


@needs_browser
@pytest.mark.parametrize("kind", night_but(TEXTS, "patches"))
def test_every_kind_of_project_goes_through_the_page(kind, driver, tmp_path):
    """Opened, moved by hand, brought to a target, saved, and opened again with the same numbers."""
    with followed(written(kind, tmp_path)) as running:
        page = Explored(driver, running.url)
        session = next(reversed(running.sessions.values()))
        assert page.verdict == "stable"
        _drag(page, kind, session)
        quantity, of, factor = TARGETS[kind]
        _add_target(page, quantity, of)
        target = Target(quantity, page.picked if quantity == "height" else of)
        wanted = float(f"{factor * measure(session.surface, target).value:.4g}")
        page.find("#targets .target-row input[aria-label='Value wanted']").send_keys(str(wanted))
        page.find("#targets .meet").click()
        told = page.find("#targets .message")
        until(lambda: told.get_attribute("data-state") in ("met", "missed"), "the target")
        assert told.get_attribute("data-state") == "met", told.text
        page.idle()
        shown = session.state().surface
        assert measure(shown, target).value == pytest.approx(wanted, rel=1e-6)
        page.find("#save-project").click()
        name = page.find("#saving input[type=text]")
        name.clear()
        name.send_keys("other", "\ue007")
        until(lambda: "Saved as other.toml" in page.text("#note") + page.text("#saving .message"), "the file")
        assert page.complaints() == []
    assert not differences(read_roof(tmp_path / "other.toml", start_shape=True).surface, shown)
    with followed(tmp_path / "other.toml") as running:
        page = Explored(driver, running.url)
        assert page.verdict == "stable"
        label = f"{LABELS[MOVED[kind][0]]} of {MOVED[kind][1]}"
        value = float(page.number(label).get_attribute("value"))
        assert value == pytest.approx(
            changeable_values(shown)[MOVED[kind][0]][MOVED[kind][1]], rel=0.02
        )  # new mesh
        assert measure(running.start.surface, target).value == pytest.approx(wanted, rel=1e-6)
        assert page.complaints() == []


def _drag(page, kind, session):
    """Move a slider with the mouse; of the sail a mast, too."""
    from selenium.webdriver import ActionChains

    before = session.state().surface
    label = f"{LABELS[MOVED[kind][0]]} of {MOVED[kind][1]}"
    slider = page.slider(label)
    ActionChains(page.driver).click_and_hold(slider).move_by_offset(4, 0).move_by_offset(
        4, 0
    ).release().perform()
    page.idle()
    moved = session.state().surface
    assert differences(before, moved)
    if kind == "sail":
        x, y = page.driver.execute_script(
            "const v = window.pcmc.viewer; const p = window.pcmc.header.values.shown.points['point 3'];"
            "const s = v.camera.seen(p.map((x, k) => x - window.pcmc.tools.origin[k]));"
            "return [s[0] * v.canvas.clientWidth / 2, -s[1] * v.canvas.clientHeight / 2]"
        )
        hand = ActionChains(page.driver).move_to_element_with_offset(page.find("#canvas"), round(x), round(y))
        hand.click_and_hold().move_by_offset(0, -10).move_by_offset(0, -10).release().perform()
        page.idle()
        place = changeable_values(session.state().surface)["points"]["point 3"]
        assert place[2] > 4.1
        z = page.find("input[aria-label='z of point 3']")
        assert float(z.get_attribute("value")) == pytest.approx(place[2], rel=1e-5)
    assert page.verdict == "stable"


def _add_target(page, quantity, of):
    """The only target of the form: a quantity that is chosen, or the height at a point that is clicked."""
    from selenium.webdriver.support.select import Select

    for row in page.driver.find_elements("css selector", "#targets .target-row button")[1:]:
        row.click()
    if quantity == "height":
        page.find("#targets .target-row button").click()
        page.find("#views .measure").click()
        page.find("#canvas").click()
        until(lambda: page.text("#measured").startswith("Height"), "the point")
        page.find("#measured button").click()
        page.picked = page.driver.execute_script("return window.pcmc.targets.rows[0].target.of")
        return
    Select(page.find("#targets select[aria-label=Quantity]")).select_by_value(quantity)
    Select(page.find("#targets select[aria-label=Of]")).select_by_value(f"={of or ''}")
    wanted = page.find("#targets input[aria-label='Value wanted']")
    wanted.clear()
    page.driver.execute_script("document.querySelector('#targets details').open = true")
    if quantity == "sag":
        page.find(f"#targets input[aria-label='{of} may change']").click()
