"""Explore: a surface saved as a project with its comments, and the page that follows its file."""

from __future__ import annotations

import os
import sys
import threading
import tomllib
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from asking import Client
from browsing import until
from explore_cases import HALL_TOML, followed
from refusals import refused

from generators import spherical_cap
from pcmc import explore
from pcmc.base.errors import FileError, OptionError
from pcmc.design import Parameter, Target
from pcmc.explore import roof as saving
from pcmc.explore.listening import RequestError
from pcmc.explore.roof import ShownRoof, read_roof
from pcmc.explore.session import Session, solved_start
from pcmc.project import load, surface_of
from pcmc.project.file import project_of
from pcmc.surface.distance import difference

CAP = spherical_cap(edge_length=0.25)


def test_saving_keeps_comments_and_the_shape_found_by_sliders(hall_roof, hall_session, hall_folder):
    state = hall_session.settle({"tensions": {"west": 4.0, "wall 1": 2.5}, "pressures": {"east": 1.1}})
    assert state.failure is None
    path, note = saving.save(hall_roof, state.surface, "found", False)
    assert path == hall_folder / "found.toml"
    assert "[targets] as comments" in note
    assert "apex of west" in note
    text = path.read_text()
    assert '\n# meet = [{quantity = "apex", of = "west", value = 1.2}' in text
    for line in ("# the hall", "# coarse", "wall = 2.5  # the valley", "west = {tension = 4.0}  # left"):
        assert line in text
    assert tomllib.loads(text)["plan"]["patches"]["east"]["pressure"] == 1.1
    again = read_roof(path, use_cache=False).surface
    moved = np.abs(difference(state.surface, hall_roof.surface)).max()
    assert np.abs(difference(again, state.surface)).max() < 0.05 * moved  # other triangles, the same shape
    path.unlink()


def test_saving_what_the_page_met_writes_its_targets(hall_roof, hall_session):
    targets = Target("apex", "west", at_least=1.4), Target("height", [9, 3], 1.0)
    vary = Parameter("west", low=1.0, high=9.0), Parameter("east")
    state = hall_session.meet(targets, vary)
    assert state.message.startswith("met")
    path, note = saving.save(hall_roof, state.surface, "met.toml", False, hall_session.now.aims)
    assert note == "with its targets: apex of west, height at (9, 3)"
    again = read_roof(path, use_cache=False)
    assert again.aims[0] == targets
    assert again.aims[1] == vary
    assert again.note.startswith("met")
    path.unlink()


def test_a_named_point_keeps_its_name(tmp_path):
    path = tmp_path / "hall.toml"
    named = HALL_TOML.replace('quantity = "apex", of = "west"', 'quantity = "height", of = "crown"')
    path.write_text(named.replace("outline", "points = {crown = [3.0, 3.0]}\noutline"))
    roof = read_roof(path, use_cache=False)
    assert roof.aims[0][0].label == "height at crown"
    state = Session(solved_start(roof.surface)).settle({"tensions": {"west": 4.0}})
    text, note, _ = saving.project_with(roof, state.surface)
    assert "(height at crown, apex of east)" in note
    met = Session(solved_start(roof.surface))
    targets = Target("height", (3, 3), 1.3, name="crown"), roof.aims[0][1]
    assert met.meet(targets, roof.aims[1]).message.startswith("met")
    text, note, _ = saving.project_with(roof, met.surface, met.now.aims)
    assert note == "with its targets: height at crown, apex of east"
    assert tomllib.loads(text)["targets"]["meet"][0] == {"quantity": "height", "of": "crown", "value": 1.3}


def test_an_unchanged_surface_is_saved_with_the_targets_of_the_file(hall_roof, hall_folder):
    text, note, _ = saving.project_with(hall_roof, hall_roof.surface)
    assert note == ""
    assert tomllib.loads(text)["targets"] == tomllib.loads(HALL_TOML)["targets"]


def test_the_same_file_is_replaced_only_if_it_is_as_it_was_read(hall_folder, hall_roof):
    with refused(FileError, what="name", found="hall.toml"):
        saving.save(hall_roof, hall_roof.surface, "hall.toml", False)
    path = hall_folder / "hall.toml"
    path.write_text(HALL_TOML + "# someone else\n")
    try:
        with pytest.raises(FileError, match="was changed since"):
            saving.save(hall_roof, hall_roof.surface, "hall.toml", True)
        assert path.read_text().endswith("# someone else\n")
    finally:
        path.write_text(HALL_TOML)


@pytest.mark.parametrize("text", ["[project]\nname = 'other'\n", "not TOML"])
def test_a_file_that_is_no_project_is_never_replaced(hall_roof, hall_folder, text):
    path = hall_folder / "pyproject.toml"
    path.write_text(text)
    with refused(FileError, what="name", found="pyproject.toml"):
        saving.save(hall_roof, hall_roof.surface, "pyproject.toml", True)
    assert path.read_text() == text
    path.unlink()


def test_values_that_a_project_cannot_hold_are_refused(hall_roof, hall_folder):
    heavy = hall_roof.surface.retensioned(weights={"wall 1": 0.1})
    with refused(OptionError, what="values") as caught:
        saving.save(hall_roof, heavy, "heavy", False)
    assert "weight of wall 1" in str(caught.value)
    assert not (hall_folder / "heavy.toml").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="there only administrators make links")
def test_no_link_leads_a_save_out_of_the_folder(hall_roof, hall_folder, tmp_path):
    os.symlink(tmp_path / "elsewhere.toml", hall_folder / "link.toml")
    try:
        with pytest.raises(FileError, match="is a link to another folder"):
            saving.save(hall_roof, hall_roof.surface, "link.toml", True)
        assert not list(tmp_path.iterdir())
    finally:
        (hall_folder / "link.toml").unlink()


def test_walls_are_found_by_name_number_and_as_bare_curves(tmp_path):
    path = tmp_path / "three.toml"
    path.write_text(
        "[plan]\nedge_length = 1.5\noutline = [[0, 0], [12, 0], [12, 4], [0, 4]]\n"
        'dividers = [[[4, 0], [4, 4]], {name = "valley", curve = [[8, 0], [8, 4]]}]\n'
        "[plan.patches]\na = {tension = 5.0}\nb = {tension = 5.0}\nc = {tension = 5.0}\n"
    )
    roof = read_roof(path, start_shape=True)
    surface = roof.surface.retensioned({"wall 1": 0.5, "valley": 0.25})
    dividers = tomllib.loads(saving.project_with(roof, surface)[0])["plan"]["dividers"]
    assert [d["wall"] for d in dividers] == [0.5, 0.25]
    assert dividers[0]["curve"] == [[4, 0], [4, 4]]


def test_a_saved_variant_writes_no_file_of_the_first_project(hall_folder):
    """Its output has other names, that of nets and patterns, too. Before, a run wrote over the first's."""
    text = HALL_TOML.partition("[targets]")[0] + '[pattern]\nstrips = 1\n[output]\npanels = "panels.csv"\n'
    text += 'tolerance = 0.1\npattern = ["nets-cloth.csv"]\nnet = ["net.csv"]\nnet_size = 1.0\n'
    (hall_folder / "nets.toml").write_text(text)
    roof = read_roof(hall_folder / "nets.toml", start_shape=True)
    path, _ = saving.save(roof, roof.surface, "other", False)
    assert tomllib.loads(path.read_text())["output"]["pattern"] == ["other-cloth.csv"]
    names = (project_of(file, tomllib.loads(file.read_text())).output.names for file in (roof.path, path))
    assert not set.intersection(*map(set, names))


def test_a_cable_that_ends_in_a_mirror_is_saved(tmp_path):
    """In the roof found its end has left the outline, along the mirror."""
    lines = "outline = [[0, 0], [4, 0], [4, 8], [0, 8]]\nmirrors = [[[4, 0], [4, 8]]]\n"
    lines += 'edge = "cable"\ncable = 9.0\nsupports = [[0, 0, 2], [0, 8, 1]]\n'
    path = tmp_path / "half.toml"
    path.write_text(f"[plan]\nedge_length = 1.0\n{lines}tension = 1.0\npressure = 0.0\n")
    roof = read_roof(path, use_cache=False)
    state = Session(solved_start(roof.surface)).settle({"cables": {"cable 1": 10.0}})
    saved = surface_of(load(saving.save(roof, state.surface, "other", False)[0]))
    assert {c.name: c.tension for c in saved.cables} == {c.name: c.tension for c in state.surface.cables}


def test_a_save_that_waits_saves_what_was_shown_when_it_was_asked_for(hall_roof, hall_folder):
    running, taken = explore.start(hall_roof), threading.Event()
    session = running.open()[1]
    real = session.state

    def state():
        found = real()
        taken.set()
        return found

    session.state = state
    try:
        with ThreadPoolExecutor() as pool:
            with running._saving:  # another save is under way
                saved = pool.submit(running.save, session, "before", False)
                taken.wait(2)
                session.meet((Target("apex", "west", at_least=1.1),), (Parameter("west"),))
                session.settle({"tensions": {"west": 4.0}})
            assert saved.result(60)["note"] == ""
            plan = tomllib.loads((hall_folder / "before.toml").read_text())
            assert plan == tomllib.loads(HALL_TOML)
            taken.clear()
            with running._saving:
                saved = pool.submit(running.save, session, "hall", True)
                taken.wait(2)
                running.show(hall_roof)  # the file was changed
            with pytest.raises(RequestError, match="was changed while this save waited"):
                saved.result(60)
        assert (hall_folder / "hall.toml").read_text() == HALL_TOML
    finally:
        running.close()
        (hall_folder / "before.toml").unlink(missing_ok=True)
        (hall_folder / "hall.toml").write_text(HALL_TOML)


def test_surfaces_without_a_project_are_not_saved(tmp_path):
    with pytest.raises(FileError, match="use Export"):
        saving.save(ShownRoof.of(CAP), CAP, "cap", False)


def test_on_the_network_nothing_is_saved(hall_roof, hall_folder):
    running = explore.start(hall_roof, host="0.0.0.0")
    try:
        client = Client(running)
        header, _ = client.ask("/api/open")
        assert header["project"] is False
        assert "only a page of this machine" in client.ask(
            f"/api/{header['session']}/save", {"name": "x"}, status=403
        )
        assert not (hall_folder / "x.toml").exists()
    finally:
        running.close()


def test_the_page_follows_the_file_and_survives_a_broken_save(tmp_path):
    path = tmp_path / "hall.toml"
    path.write_text(HALL_TOML)
    with followed(path) as running:
        client = Client(running)
        name = client.ask("/api/open")[0]["session"]

        def news():
            return client.ask(f"/api/{name}/news")[0]

        assert news() == {"version": 0, "working": False, "problem": "", "progress": ""}
        path.write_text(HALL_TOML.replace("edge_length", "edge_lenght"))
        until(lambda: "did you mean 'edge_length'" in news()["problem"], "the problem")
        assert str(tmp_path) not in news()["problem"]
        assert news()["version"] == 0
        kept, _ = client.ask(f"/api/{name}/state")
        path.write_text(
            HALL_TOML.replace("value = 1.2", "value = 1.5").replace("[6, 0], [6, 6]", "[7, 0], [7, 6]")
        )
        until(lambda: news()["version"] == 1, "the new roof")
        assert news()["problem"] == ""
        renewed, _ = client.ask("/api/open", {"session": name})
        rows = {(r["quantity"], r["of"]): r["value"] for r in renewed["figures"]}
        assert rows["apex", "west"] == pytest.approx(1.5, rel=1e-6)
        assert renewed["mesh"] != kept["mesh"]
        assert renewed["undo"] == 1
        assert client.ask(f"/api/{name}/undo")[0]["mesh"] != renewed["mesh"]
        saved, _ = client.ask(f"/api/{name}/save", {"name": "hall.toml", "replace": True})
        assert saved["saved"] == "hall.toml"
        path.unlink()
        until(lambda: "cannot be read" in news()["problem"], "the missing file")
        os.mkfifo(path)
        until(lambda: "a pipe or a device" in news()["problem"], "the pipe")
        path.unlink()
        path.symlink_to("/dev/null")
        until(lambda: "a pipe or a device" in news()["problem"], "the device")
        path.unlink()
        path.write_text(HALL_TOML)
        until(lambda: news()["version"] == 2, "the file again")


@pytest.mark.parametrize("line", ["", "rise = 1.5\n"])
def test_a_drawing_that_a_project_refers_to_is_followed(line, tmp_path):
    ezdxf = pytest.importorskip("ezdxf")

    def draw(width):
        drawing = ezdxf.new()
        corners = [(0, 0), (width, 0), (width, 5), (0, 5)]
        drawing.modelspace().add_lwpolyline(corners, close=True, dxfattribs={"layer": "outline"})
        drawing.units = 6
        drawing.saveas(tmp_path / "hall.dxf")

    draw(8)
    path = tmp_path / "roof.toml"
    path.write_text('[plan]\ndrawing = "hall.dxf"\nedge_length = 1.0\n' + line)
    with followed(path) as running:
        draw(11)
        until(lambda: running.version == 1, "the new drawing")
        assert np.ptp(running.start.surface.vertices[:, 0]) == pytest.approx(11.0)
        surface = running.start.surface.retensioned({running.start.surface.patches[0].name: 9.0})
        plan = tomllib.loads(saving.project_with(running.roof, surface)[0])["plan"]
        assert plan["drawing"] == "hall.dxf"
        assert [area["tension"] for area in plan["patches"].values()] == [9.0]
        assert "rise" not in plan
