"""Explore on projects: designed roofs, targets, variants, saving with comments, following the file."""

from __future__ import annotations

import os
import sys
import threading
import tomllib

import numpy as np
import pytest
from browsing import until
from refusals import refused
from test_explore import Client

import pcmc
from generators import spherical_cap
from pcmc import explore
from pcmc.base.errors import FileError, OptionError
from pcmc.base.units import Units
from pcmc.certificate import Verdict
from pcmc.design import Parameter, Target
from pcmc.design.targets import measure
from pcmc.explore import saving
from pcmc.explore.page_data import outline
from pcmc.explore.roof import Roof, read_roof
from pcmc.explore.session import Session, solved_start
from pcmc.explore.variants import difference, measures

TEXT = """# the hall
units = "m"
force = "kN"
[plan]
edge_length = 1.0  # coarse
outline = [[0, 0], [12, 0], [12, 6], [0, 6]]
[[plan.dividers]]
curve = [[6, 0], [6, 6]]
wall = 2.0  # the valley
[plan.patches]
west = {tension = 5.0}  # left
east = {tension = 5.0, pressure = 1}
[targets]  # two heights
meet = [{quantity = "apex", of = "west", value = 1.2}, {quantity = "apex", of = "east", value = 1.0}]
vary = ["west", "east"]
"""
CAP = spherical_cap(edge_length=0.25)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("project")


@pytest.fixture(scope="module")
def roof(folder):
    (folder / "hall.toml").write_text(TEXT)
    return read_roof(folder / "hall.toml", use_cache=False)


@pytest.fixture
def session(roof):
    return Session(solved_start(roof.surface))


@pytest.fixture
def explorer(roof):
    running = explore.start_roof(roof)
    yield running
    running.close()


@pytest.fixture
def client(explorer):
    return Client(explorer)


def apex(surface, name):
    return measure(surface, Target("apex", name)).value


def test_a_project_opens_at_its_targets(roof, client):
    header, _ = client.ask("/api/open")
    assert header["note"] == "met: every target is reached"
    assert header["units"]["tension"] == "kN/m"
    assert (header["name"], header["project"], header["file"]) == ("hall", True, "hall.toml")
    rows = {(r["quantity"], r["of"]): r["value"] for r in header["measures"]}
    assert rows["apex", "west"] == pytest.approx(1.2, rel=1e-6)
    assert rows["apex", "east"] == pytest.approx(1.0, rel=1e-6)
    assert rows["volume", ""] == pytest.approx(rows["volume", "west"] + rows["volume", "east"])
    assert [t["label"] for t in header["aims"]["targets"]] == ["apex of west", "apex of east"]


def test_the_start_shape_is_shown_only_when_asked_for(folder, roof):
    shape = read_roof(folder / "hall.toml", start_shape=True)
    assert "not met yet" in shape.note
    assert shape.surface.patches[0].tension == 5.0
    assert roof.surface.patches[0].tension != 5.0


def test_what_is_measured_agrees_with_targets(roof):
    rows = measures(roof.surface, pcmc.certify(roof.surface))
    for row in rows:
        if row["quantity"] in ("apex", "area", "volume", "reaction"):
            value = measure(roof.surface, Target(row["quantity"], row["of"] or None)).value
            assert row["value"] == pytest.approx(value, rel=1e-9), row


def test_targets_are_met_from_the_page(session):
    aims = (Target("apex", "west", 1.4),), (Parameter("west"), Parameter("east"))
    state = session.meet(*aims)
    assert state.message == "met: every target is reached"
    assert apex(state.surface, "west") == pytest.approx(1.4, rel=1e-6)
    assert state.undo == 1
    assert session.aims == aims
    assert apex(session.undo().surface, "west") == pytest.approx(1.2, rel=1e-6)


def test_a_target_out_of_reach_keeps_the_surface_and_says_why(session):
    before = session.surface
    state = session.meet((Target("apex", "west", 9.0),), (Parameter("west"),))
    assert state.surface is before
    assert state.message.startswith("out of reach")
    assert "nearest reachable" in state.message
    assert state.undo == 0
    assert session.undo().message == ""


def test_a_search_tells_its_progress_and_can_be_stopped(session, monkeypatch):
    told = []
    real = Session.stop

    def met(surface, targets, vary, callback):
        callback(None)
        told.append(session.progress)
        stopping = threading.Thread(target=real, args=(session,))
        stopping.start()
        until(lambda: session._requests == 2, "the stop")
        with pytest.raises(StopIteration):
            callback(None)
        return pcmc.meet(surface, targets, vary, solves=1)

    monkeypatch.setattr("pcmc.explore.session.meet", met)
    before = session.surface
    state = session.meet((Target("apex", "west", 1.3),), (Parameter("west"),))
    assert told == ["1 solves"]
    assert state.superseded
    assert session.state().surface is before
    assert session.progress == ""


@pytest.mark.parametrize(
    ("body", "line"),
    [
        ({}, "targets: expected a list of objects"),
        ({"targets": []}, "at least one"),
        ({"targets": [3]}, "expected a list of objects"),
        ({"targets": [{"quantity": "apex", "of": "west", "value": 1}]}, "vary: expected a list"),
        ({"targets": [{"quantity": "apex", "colour": 1}]}, "unknown key 'colour'"),
        ({"targets": [{"quantity": "apex", "of": "west", "value": "1"}]}, "expected a number, found '1'"),
        ({"targets": [{"quantity": "apex", "of": "west", "value": True}]}, "expected a number, found True"),
        ({"targets": [{"quantity": "apex", "of": "west", "value": 10**400}]}, "a number up to"),
        ({"targets": [{"quantity": "apex", "of": "w" * 5000, "value": 1}]}, "a name of 5000 characters"),
        ({"targets": [{"quantity": ["apex"]}]}, "quantity: expected a name"),
        ({"targets": [{"quantity": "height", "of": [1], "value": 1}]}, "expected a name or a point"),
        ({"targets": [{"quantity": "apx", "value": 1}]}, "did you mean 'apex'"),
        ({"targets": [{"quantity": "apex"}] * 101}, "too many"),
    ],
)
def test_targets_that_are_none_are_refused_in_one_line(client, body, line):
    name = client.ask("/api/open")[0]["session"]
    error = client.ask(f"/api/{name}/meet", body, status=400)
    assert line in error
    assert len(error) < 300


def test_an_unknown_patch_in_a_target_or_parameter_is_named(client):
    name = client.ask("/api/open")[0]["session"]
    good = {"quantity": "apex", "of": "west", "value": 1.3}
    for body in (
        {"targets": [{**good, "of": "wset"}], "vary": [{"patch": "west"}]},
        {"targets": [good], "vary": [{"patch": "wset"}]},
    ):
        assert "did you mean 'west'" in client.ask(f"/api/{name}/meet", body, status=400)


@pytest.mark.parametrize(
    ("act", "body", "line"),
    [
        ("keep", {}, "name: expected a name"),
        ("keep", {"name": " "}, "1 to 60 characters"),
        ("keep", {"name": "x" * 61}, "1 to 60 characters"),
        ("recall", {"number": 0}, "there is no variant 1"),
        ("recall", {"number": "0"}, "expected a whole number"),
        ("forget", {"number": -1}, "there is no variant"),
        ("forget", {"number": True}, "expected a whole number"),
        ("compare", {"number": 1.5}, "expected a whole number"),
        ("compare", {"number": 10**30}, "there is no variant"),
        ("save", {"name": 3}, "expected a name"),
        ("save", {"name": ""}, "give the file a name"),
        ("save", {"name": "a.toml", "replace": 1}, "expected true or false"),
        ("save", {"name": "../a.toml"}, "a name without folder"),
        ("save", {"name": "/tmp/a.toml"}, "a name without folder"),
        ("save", {"name": "a\\b.toml"}, "a name without folder"),
        ("save", {"name": "a\0b"}, "a name without folder"),
        ("save", {"name": ".bashrc"}, "a name without folder"),
        ("save", {"name": "hall.toml"}, "is there already"),
    ],
)
def test_wrong_requests_are_refused_in_one_line(client, folder, act, body, line):
    before = sorted(folder.iterdir())
    name = client.ask("/api/open")[0]["session"]
    error = client.ask(f"/api/{name}/{act}", body, status=400)
    assert line in error
    assert "\n" not in error
    assert sorted(folder.iterdir()) == before


def test_variants_are_kept_compared_shown_again_and_removed(client):
    name = client.ask("/api/open")[0]["session"]
    first, arrays = client.ask(f"/api/{name}/keep", {"name": "low"})
    assert [v["name"] for v in first["variants"]] == ["low"]
    assert "difference" not in arrays
    moved, _ = client.ask(f"/api/{name}/settle", {"tensions": {"west": 2.2, "east": 2.4}})
    assert moved["verdict"]["name"] == "stable"
    header, arrays = client.ask(f"/api/{name}/compare", {"number": 0})
    assert header["compared"] == 0
    rows = {(r["quantity"], r["of"]): r["value"] for r in header["measures"]}
    assert arrays["difference"].max() > 0.2
    assert arrays["difference"].max() < rows["apex", ""] - 1.0 + 1e-6
    back, arrays = client.ask(f"/api/{name}/recall", {"number": 0})
    assert np.abs(arrays["difference"]).max() < 1e-6
    assert back["undo"] == 2
    gone, arrays = client.ask(f"/api/{name}/forget", {"number": 0})
    assert (gone["variants"], gone["compared"]) == ([], None)
    assert "difference" not in arrays


def test_the_difference_of_two_caps_is_that_of_their_spheres():
    """A sphere through the unit circle of another curvature: the difference at the apex is exact."""
    flat = pcmc.solve(spherical_cap(edge_length=0.1)).surface
    higher = pcmc.solve(flat.retensioned({"cap": 0.9 * flat.patches[0].tension})).surface
    rise = higher.vertices[:, 2].max() - flat.vertices[:, 2].max()
    top = higher.vertices[:, 2].argmax()
    assert difference(higher, flat)[top] == pytest.approx(rise, rel=1e-3)
    assert difference(flat, higher)[flat.vertices[:, 2].argmax()] == pytest.approx(-rise, rel=5e-3)
    finer = pcmc.solve(spherical_cap(edge_length=0.05)).surface
    errors = [np.abs(difference(finer, s)).max() for s in (flat, higher)]
    assert errors[0] < 0.2 * errors[1]  # other triangles are hardly another shape


def test_a_wall_nearby_does_not_hide_a_difference(roof):
    higher = pcmc.solve(roof.surface.retensioned({"west": 2.6, "east": 3.0})).surface
    on_roof = np.unique(roof.surface.faces[~roof.surface.walls[roof.surface.patch_of_face]])
    away = difference(higher, roof.surface)[on_roof]
    assert away.min() > -0.02 * away.max()  # lower tensions: higher everywhere


def test_saving_keeps_comments_and_the_shape_found_by_sliders(roof, session, folder):
    state = session.settle({"tensions": {"west": 4.0, "wall 1": 2.5}, "pressures": {"east": 1.1}})
    assert state.failure is None
    path, note = saving.save(roof, state.surface, "found", False)
    assert path == folder / "found.toml"
    assert "without [targets]" in note
    assert "apex of west" in note
    text = path.read_text()
    for line in ("# the hall", "# coarse", "wall = 2.5  # the valley", "west = {tension = 4.0}  # left"):
        assert line in text
    assert tomllib.loads(text)["plan"]["patches"]["east"]["pressure"] == 1.1
    again = read_roof(path, use_cache=False).surface
    moved = np.abs(difference(state.surface, roof.surface)).max()
    assert np.abs(difference(again, state.surface)).max() < 0.05 * moved  # other triangles, the same shape
    path.unlink()


def test_saving_what_the_page_met_writes_its_targets(roof, session):
    targets = Target("apex", "west", at_least=1.4), Target("height", [9, 3], 1.0)
    vary = Parameter("west", low=1.0, high=9.0), Parameter("east")
    state = session.meet(targets, vary)
    assert state.message.startswith("met")
    path, note = saving.save(roof, state.surface, "met.toml", False, session.aims)
    assert note == "with its targets: apex of west, height at (9, 3)"
    again = read_roof(path, use_cache=False)
    assert again.targets == targets
    assert again.vary == vary
    assert again.note.startswith("met")
    path.unlink()


def test_an_unchanged_surface_is_saved_with_the_targets_of_the_file(roof, folder):
    text, note = saving.project_with(roof, roof.surface)
    assert note == ""
    assert tomllib.loads(text)["targets"] == tomllib.loads(TEXT)["targets"]


def test_the_same_file_is_replaced_only_if_it_is_as_it_was_read(folder, roof):
    with refused(FileError, what="name", found="hall.toml"):
        saving.save(roof, roof.surface, "hall.toml", False)
    path = folder / "hall.toml"
    path.write_text(TEXT + "# someone else\n")
    try:
        with pytest.raises(FileError, match="was changed since"):
            saving.save(roof, roof.surface, "hall.toml", True)
        assert path.read_text().endswith("# someone else\n")
    finally:
        path.write_text(TEXT)


@pytest.mark.skipif(sys.platform == "win32", reason="needs links")
def test_no_link_leads_a_save_out_of_the_folder(roof, folder, tmp_path):
    os.symlink(tmp_path / "elsewhere.toml", folder / "link.toml")
    try:
        with pytest.raises(FileError, match="without folder"):
            saving.save(roof, roof.surface, "link.toml", True)
        assert not list(tmp_path.iterdir())
    finally:
        (folder / "link.toml").unlink()


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


def test_surfaces_without_a_project_are_not_saved(tmp_path):
    with pytest.raises(FileError, match="use Export"):
        saving.save(Roof(CAP), CAP, "cap", False)


def test_on_the_network_nothing_is_saved(roof, folder):
    running = explore.start_roof(roof, host="0.0.0.0")
    try:
        client = Client(running)
        header, _ = client.ask("/api/open")
        assert header["project"] is False
        assert "only a page of this machine" in client.ask(
            f"/api/{header['session']}/save", {"name": "x"}, status=403
        )
        assert not (folder / "x.toml").exists()
    finally:
        running.close()


def test_the_page_follows_the_file_and_survives_a_broken_save(tmp_path):
    path = tmp_path / "hall.toml"
    path.write_text(TEXT)

    def read():
        return read_roof(path, use_cache=False)

    running = explore.start_roof(read(), watch=read)
    try:
        client = Client(running)
        name = client.ask("/api/open")[0]["session"]

        def news():
            return client.ask(f"/api/{name}/news")[0]

        assert news() == {"version": 0, "working": False, "problem": "", "progress": ""}
        path.write_text(TEXT.replace("edge_length", "edge_lenght"))
        until(lambda: "did you mean 'edge_length'" in news()["problem"], "the problem")
        assert str(tmp_path) not in news()["problem"]
        assert news()["version"] == 0
        kept, _ = client.ask(f"/api/{name}/state")
        path.write_text(
            TEXT.replace("value = 1.2", "value = 1.5").replace("[6, 0], [6, 6]", "[7, 0], [7, 6]")
        )
        until(lambda: news()["version"] == 1, "the new roof")
        assert news()["problem"] == ""
        renewed, _ = client.ask("/api/open", {"session": name})
        rows = {(r["quantity"], r["of"]): r["value"] for r in renewed["measures"]}
        assert rows["apex", "west"] == pytest.approx(1.5, rel=1e-6)
        assert renewed["mesh"] != kept["mesh"]
        assert renewed["undo"] == 1
        assert client.ask(f"/api/{name}/undo")[0]["mesh"] != renewed["mesh"]
        saved, _ = client.ask(f"/api/{name}/save", {"name": "hall.toml", "replace": True})
        assert saved["saved"] == "hall.toml"
        path.unlink()
        until(lambda: "cannot be read" in news()["problem"], "the missing file")
    finally:
        running.close()


def test_a_drawing_that_a_project_refers_to_is_followed(tmp_path):
    ezdxf = pytest.importorskip("ezdxf")

    def draw(width):
        drawing = ezdxf.new()
        corners = [(0, 0), (width, 0), (width, 5), (0, 5)]
        drawing.modelspace().add_lwpolyline(corners, close=True, dxfattribs={"layer": "outline"})
        drawing.units = 6
        drawing.saveas(tmp_path / "hall.dxf")

    draw(8)
    path = tmp_path / "roof.toml"
    path.write_text('[plan]\ndrawing = "hall.dxf"\nedge_length = 1.0\n')

    def read():
        return read_roof(path, use_cache=False)

    running = explore.start_roof(read(), watch=read)
    try:
        draw(11)
        until(lambda: running.version == 1, "the new drawing")
        assert np.ptp(running.start.surface.vertices[:, 0]) == pytest.approx(11.0)
        surface = running.start.surface.retensioned({running.start.surface.patches[0].name: 9.0})
        plan = tomllib.loads(saving.project_with(running.roof, surface)[0])["plan"]
        assert plan["drawing"] == "hall.dxf"
        assert [area["tension"] for area in plan["patches"].values()] == [9.0]
    finally:
        running.close()


def test_cables_weights_and_rooms_have_values_that_move_the_surface():
    square = pcmc.Surface(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0.2], [0.5, -0.1, 0]],
        [[0, 5, 4], [5, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
        [0] * 5,
        [pcmc.Patch("roof", 1.0, 0.5, weight=0.1)],
        fixed=[0, 1, 2, 3],
        cables=[pcmc.Cable("edge", 3.0, [[0, 5], [5, 1]]), pcmc.Cable("inner", 0.0, [[0, 4]])],
    )
    about, arrays = outline(square.retensioned(cables={"inner": 0.1}))
    assert [group["kinds"] for group in about["controls"]] == [
        ["tensions", "pressures", "weights"],
        ["cables"],
        ["cables"],
    ]
    drawn = {tuple(sorted(pair)) for pair in arrays["curves"].tolist()}
    assert {(0, 5), (1, 5), (0, 4)} < drawn
    session = Session(solved_start(square))
    state = session.settle({"cables": {"edge": 6.0}, "weights": {"roof": 0.2}})
    assert state.failure is None
    assert state.surface.cables[0].tension == 6.0
    assert state.surface.patches[0].weight == 0.2
    assert state.certificate.verdict is Verdict.STABLE
    depth = [s.vertices[5, 1] for s in (session.undo().surface, state.surface)]
    assert depth[0] > depth[1] > 0.0  # a stronger cable is straighter
    with refused(OptionError, what="cable", found="egde"):
        session.follow({"cables": {"egde": 1.0}})


def test_a_piece_between_mirror_planes_is_drawn_whole():
    planes = [pcmc.Plane(normal=n, mirror=True) for n in ((1, 0, 0), (0, 1, 0))]
    grid = np.linspace(0.0, 1.0, 5)
    X = np.array([[x, y, 0.0] for y in grid for x in grid])
    corner = np.array([5 * j + i for j in range(4) for i in range(4)])[:, None]
    F = np.concatenate([corner + np.array([0, 1, 6]), corner + np.array([0, 6, 5])])
    supports = {plane: np.flatnonzero(X[:, k] == 0.0) for k, plane in enumerate(planes)}
    fixed = np.flatnonzero((X[:, :2] == 1.0).any(axis=1))
    piece = pcmc.Surface(X, F, [0] * len(F), [pcmc.Patch("roof", 2.0)], fixed=fixed, on_planes=supports)
    running = explore.start(piece)
    try:
        client = Client(running)
        header, arrays = client.ask("/api/open")
        assert header["whole"]
        assert header["triangles"] == 4 * piece.m
        corners = arrays["vertices"].reshape(-1, 3) + running.origin
        assert corners.min(axis=0) == pytest.approx([-1.0, -1.0, 0.0])
        client.ask(f"/api/{header['session']}/keep", {"name": "a"})
        client.ask(f"/api/{header['session']}/compare", {"number": 0})
        header, arrays = client.ask(f"/api/{header['session']}/settle", {"tensions": {"roof": 3.0}})
        assert len(arrays["difference"]) == len(corners)
        assert arrays["difference"].min() < -0.01
        held = np.isfinite(arrays["reactions"].reshape(-1, 3)[:, 0])
        assert held.sum() == 32
    finally:
        running.close()


def test_names_of_downloads_are_those_of_files():
    assert Roof(CAP, "a/b", Units("m")).name == "a-b"
