"""Explore on projects: designed roofs, targets, and variants."""

from __future__ import annotations

import threading
from contextlib import closing

import numpy as np
import pytest
from asking import Client
from browsing import until
from scipy.spatial import cKDTree
from small_project import HALL_WITH_ARCH, PLACE

import pcmc
from generators import spherical_cap
from pcmc import cli, explore
from pcmc.base.units import Units
from pcmc.design import Parameter, Target
from pcmc.design.targets import measure
from pcmc.explore.roof import ShownRoof, read_roof
from pcmc.explore.session import Session, figures_data
from pcmc.surface.distance import difference

CAP = spherical_cap(edge_length=0.25)
HALF = """
units = "mm"
[plan]
edge_length = 2000
outline = [[0, 0], [6000, 0], [6000, 8000], [0, 8000]]
mirrors = [[[6000, 0], [6000, 8000]]]
patches = {roof = {tension = 2e4}}
[output]
whole = true
"""


@pytest.fixture(scope="module")
def explorer(hall_roof):
    running = explore.start(hall_roof)
    yield running
    running.close()


@pytest.fixture
def client(explorer):
    return Client(explorer)


def apex(surface, name):
    return measure(surface, Target("apex", name)).value


def test_the_page_has_the_members_with_their_forces_at_every_state(tmp_path):
    """Their pieces lie on the surface, and follow it; of a part of a roof they are left out."""
    (tmp_path / "hall.toml").write_text(HALL_WITH_ARCH, encoding="utf-8")
    explorer = explore.start(read_roof(tmp_path / "hall.toml"))

    def force(header):
        rows = [r for r in header["figures"] if r["owner"] == "member"]
        assert [(r["quantity"], r["of"]) for r in rows] == [("least N", "wall 1"), ("largest N", "wall 1")]
        return rows[1]["value"]

    try:
        client = Client(explorer)
        header, arrays = client.ask("/api/open")
        assert "members" not in header["note"]
        ends = arrays["member_ends"].reshape(-1, 3)
        away, _ = cKDTree(arrays["vertices"].reshape(-1, 3)).query(ends)
        assert away.max() < 1e-6
        assert len(ends) == 10
        name = header["session"]
        higher, moved = client.ask(f"/api/{name}/settle", {"pressures": {"west": 0.36, "east": 0.36}})
        assert moved["member_ends"].reshape(-1, 3)[5, 2] > ends[5, 2]
        assert force(higher) != pytest.approx(force(header), rel=0.01)
    finally:
        explorer.close()


@pytest.mark.parametrize(
    ("text", "suffix"),
    [(f"{HALL_WITH_ARCH}{PLACE}", ".ifc"), (HALF, ".pcmc"), (HALF, ".glb")],
    ids=["members and a place on a map", "whole", "whole, in metres"],
)
def test_an_export_is_the_file_that_the_command_writes(tmp_path, text, suffix):
    """With the members and the place on a map, and the whole roof where the project asks for it."""
    roof = tmp_path / "hall.toml"
    roof.write_text(text)
    written = roof.with_suffix(suffix)
    assert cli.main(["solve", str(roof), "-o", str(written), "--no-mesh-check"]) == 0
    with closing(explore.start(read_roof(roof, use_cache=False))) as running:
        assert running.export(running.open()[0], suffix)[:2] == (written.name, written.read_bytes())


def test_an_export_that_misses_the_targets_is_marked(client):
    name = client.ask("/api/open")[0]["session"]
    assert "TARGETS" not in client.explorer.export(name, ".obj")[1].decode()
    client.ask(f"/api/{name}/settle", {"tensions": {"west": 4.0}})
    assert client.explorer.export(name, ".obj")[1].decode().splitlines()[1] == "# TARGETS NOT MET"


def test_a_project_opens_at_its_targets(hall_roof, client):
    header, _ = client.ask("/api/open")
    assert header["note"] == "met: every target is reached"
    assert header["units"]["tension"] == "kN/m"
    assert (header["name"], header["project"], header["file"]) == ("hall", True, "hall.toml")
    rows = {(r["quantity"], r["of"]): r["value"] for r in header["figures"]}
    assert rows["apex", "west"] == pytest.approx(1.2, rel=1e-6)
    assert rows["apex", "east"] == pytest.approx(1.0, rel=1e-6)
    assert rows["volume", ""] == pytest.approx(rows["volume", "west"] + rows["volume", "east"])
    assert [t["label"] for t in header["aims"]["targets"]] == ["apex of west", "apex of east"]


def test_the_start_shape_is_shown_only_when_asked_for(hall_folder, hall_roof):
    shape = read_roof(hall_folder / "hall.toml", start_shape=True)
    assert "not met yet" in shape.note
    assert shape.surface.patches[0].tension == 5.0
    assert hall_roof.surface.patches[0].tension != 5.0


def test_what_is_measured_agrees_with_targets(hall_roof):
    rows = figures_data(hall_roof.surface, pcmc.certify(hall_roof.surface))
    for row in rows:
        if row["quantity"] in ("apex", "area", "volume", "reaction per length", "lean"):
            value = measure(hall_roof.surface, Target(row["quantity"], row["of"] or None)).value
            assert row["value"] == pytest.approx(value, rel=1e-9), row


def test_targets_are_met_from_the_page(hall_session):
    aims = (Target("apex", "west", 1.4),), (Parameter("west"), Parameter("east"))
    state = hall_session.meet(*aims)
    assert state.message == "met: every target is reached"
    assert apex(state.surface, "west") == pytest.approx(1.4, rel=1e-6)
    assert state.undo == 1
    assert hall_session.now.aims == aims
    assert apex(hall_session.undo().surface, "west") == pytest.approx(1.2, rel=1e-6)


def test_a_target_out_of_reach_keeps_the_surface_and_says_why(hall_session):
    before = hall_session.surface
    state = hall_session.meet((Target("apex", "west", 9.0),), (Parameter("west"),))
    assert state.surface is before
    assert state.message.startswith("out of reach")
    assert "nearest reachable" in state.message
    assert state.undo == 0
    assert hall_session.undo().message == ""


def test_a_search_tells_its_progress_and_can_be_stopped(hall_session, monkeypatch):
    told = []
    real = Session.stop

    def met(surface, targets, vary, callback):
        callback(None)
        told.append(hall_session.progress)
        stopping = threading.Thread(target=real, args=(hall_session,))
        stopping.start()
        until(lambda: hall_session.arrived == 2, "the stop")
        with pytest.raises(StopIteration):
            callback(None)
        return pcmc.meet(surface, targets, vary, solves=1)

    monkeypatch.setattr("pcmc.explore.session.meet", met)
    before = hall_session.surface
    state = hall_session.meet((Target("apex", "west", 1.3),), (Parameter("west"),))
    assert told == ["1 solves"]
    assert state.superseded
    assert hall_session.state().surface is before
    assert hall_session.progress == ""


@pytest.mark.parametrize(
    ("body", "line"),
    [
        ({}, "targets: expected a list of objects"),
        ({"targets": []}, "at least one"),
        ({"targets": [3]}, "expected a list of objects"),
        ({"targets": [{"quantity": "apex", "of": "west", "value": 1}]}, "vary: expected a list"),
        ({"targets": [{"quantity": "apex", "colour": 1}]}, "unknown key 'colour'"),
        ({"targets": [{"quantity": "apex", "of": "west", "value": "1"}]}, "a finite number, found '1'"),
        ({"targets": [{"quantity": "apex", "of": "west", "value": True}]}, "a finite number, found True"),
        ({"targets": [{"quantity": "apex", "of": "west", "value": 10**400}]}, "a finite number"),
        ({"targets": [{"quantity": "apex", "of": "w" * 5000, "value": 1}]}, "vary: expected a list"),
        ({"targets": [{"quantity": ["apex"]}]}, "unknown quantity"),
        ({"targets": [{"quantity": "height", "of": [3, 3], "value": 1, "name": {"a": 1}}]}, "name: expected"),
        ({"targets": [{"quantity": "height", "of": [1], "value": 1}]}, "height: expected a point"),
        (
            {"targets": [{"quantity": "height", "of": [10**400, 1], "value": 1}]},
            "height: x: expected a finite",
        ),
        ({"targets": [{"quantity": "height", "of": "12"}]}, "height: x: expected a finite"),
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
        ("keep", {"name": "\ud800"}, "expected printable characters"),
        ("keep", {"name": "a\u202eb"}, "expected printable characters"),
        ("keep", {"name": "a\0b"}, "expected printable characters"),
        ("recall", {"number": 0}, "there is no variant 1"),
        ("recall", {"number": "0"}, "expected a whole number"),
        ("forget", {"number": -1}, "there is no variant"),
        ("forget", {"number": True}, "expected a whole number"),
        ("compare", {"number": 1.5}, "expected a whole number"),
        ("compare", {"number": 10**30}, "there is no variant"),
        ("save", {"name": 3}, "expected a name"),
        ("save", {"name": ""}, "a name without folder is needed"),
        ("save", {"name": "a.toml", "replace": 1}, "expected true or false"),
        ("save", {"name": "../a.toml"}, "a name without folder"),
        ("save", {"name": "/tmp/a.toml"}, "a name without folder"),
        ("save", {"name": "a\\b.toml"}, "a name without folder"),
        ("save", {"name": "a\0b"}, "a name without folder"),
        ("save", {"name": ".bashrc"}, "a name without folder"),
        ("save", {"name": "x" * 96}, "at most 100"),
        ("save", {"name": "屋" * 90}, "at most"),
        ("save", {"name": "hall.toml"}, "is there already"),
    ],
)
def test_wrong_requests_are_refused_in_one_line(client, hall_folder, act, body, line):
    before = sorted(hall_folder.iterdir())
    name = client.ask("/api/open")[0]["session"]
    error = client.ask(f"/api/{name}/{act}", body, status=400)
    assert line in error
    assert "\n" not in error
    assert sorted(hall_folder.iterdir()) == before


def test_variants_are_kept_compared_shown_again_and_removed(client):
    name = client.ask("/api/open")[0]["session"]
    first, arrays = client.ask(f"/api/{name}/keep", {"name": "low"})
    assert [v["name"] for v in first["variants"]] == ["low"]
    assert "difference" not in arrays
    moved, _ = client.ask(f"/api/{name}/settle", {"tensions": {"west": 2.2, "east": 2.4}})
    assert moved["verdict"]["name"] == "stable"
    header, arrays = client.ask(f"/api/{name}/compare", {"number": 0})
    assert header["compared"] == 0
    rows = {(r["quantity"], r["of"]): r["value"] for r in header["figures"]}
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


def test_a_wall_nearby_does_not_hide_a_difference(hall_roof):
    higher = pcmc.solve(hall_roof.surface.retensioned({"west": 2.6, "east": 3.0})).surface
    on_roof = np.unique(hall_roof.surface.faces[~hall_roof.surface.walls[hall_roof.surface.patch_of_face]])
    away = difference(higher, hall_roof.surface)[on_roof]
    assert away.min() > -0.02 * away.max()  # lower tensions: higher everywhere


def test_names_of_downloads_are_those_of_files():
    assert ShownRoof.of(CAP, "a/b", Units("m")).name == "a-b"
