"""Explore: messages, and the server that gives each page a session of its own."""

from __future__ import annotations

import http.client
import json
import re
import threading
from contextlib import closing
from importlib.resources import files
from urllib.parse import unquote

import numpy as np
import pytest
from asking import Client
from refusals import refused

import pcmc
from generators import spherical_cap
from pcmc import explore
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.certificate import Verdict
from pcmc.explore import server
from pcmc.explore.listening import pack, unpack
from pcmc.explore.roof import ShownRoof
from pcmc.plan import Plan

CAP = spherical_cap(edge_length=0.25)


def test_messages_come_back_as_they_went():
    arrays = {"x": np.array([[1.0, np.nan]]), "i": np.arange(3), "none": np.zeros((0, 2), int)}
    header, back = unpack(pack({"ü": [1, np.float64(np.inf), {"a": True}]}, arrays))
    assert header == {"ü": [1, None, {"a": True}]}
    np.testing.assert_array_equal(back["x"], [1.0, np.nan])
    np.testing.assert_array_equal(back["i"], [0, 1, 2])
    assert back["none"].size == 0


@pytest.fixture
def client(explorer):
    return Client(explorer)


def test_each_page_gets_its_own_draft(client):
    first, _ = client.ask("/api/open")
    second, _ = client.ask("/api/open")
    assert first["session"] != second["session"]
    values = {"tensions": {"left wall": 14.0}}
    moved, arrays = client.ask(f"/api/{first['session']}/settle", values)
    assert moved["verdict"]["name"] == "stable"
    assert moved["values"]["shown"]["tensions"]["left wall"] == 14.0
    other, still = client.ask(f"/api/{second['session']}/state")
    assert other["values"]["shown"]["tensions"]["left wall"] == 10.0
    assert np.abs(arrays["vertices"] - still["vertices"]).max() > 0.01
    again, same = client.ask("/api/open", {"session": first["session"]})
    assert again["session"] == first["session"]
    np.testing.assert_array_equal(same["vertices"], arrays["vertices"])


def test_many_pages_at_once_do_not_mix(client, explorer):
    wanted = [11.0, 12.0, 13.0, 14.0, 15.0, 16.0]
    seen = {}

    def user(value):
        name = client.ask("/api/open")[0]["session"]
        for part in (0.3, 0.6):
            step = 10.0 + part * (value - 10.0)
            client.ask(f"/api/{name}/follow", {"tensions": {"left wall": step}})
        seen[value] = client.ask(f"/api/{name}/settle", {"tensions": {"left wall": value}})

    users = [threading.Thread(target=user, args=(value,)) for value in wanted]
    for thread in users:
        thread.start()
    for thread in users:
        thread.join()
    for value in wanted:
        header, _ = seen[value]
        assert header["values"]["shown"]["tensions"]["left wall"] == value
        assert header["verdict"]["name"] == "stable"
        alone = pcmc.solve(explorer.start.surface.retensioned({"left wall": value}))
        assert header["findings"]["energy"] == pytest.approx(alone.energy, rel=1e-4)
    energies = [seen[value][0]["findings"]["energy"] for value in wanted]
    assert energies == sorted(energies)  # a stronger wall costs more


def test_what_is_drawn_is_the_surface(client, explorer):
    header, arrays = client.ask("/api/open")
    surface = explorer.start.surface
    corner = arrays["sheet_vertex"][arrays["sheet_faces"]].reshape(-1, 3)
    np.testing.assert_array_equal(corner, surface.faces)
    patch = arrays["sheet_patch"][arrays["sheet_faces"]].reshape(-1, 3)
    np.testing.assert_array_equal(patch, np.repeat(surface.patch_of_face[:, None], 3, axis=1))
    X = arrays["vertices"].reshape(-1, 3) + explorer.origin
    np.testing.assert_allclose(X, surface.vertices, atol=1e-6 * surface.size)
    drawn = np.concatenate([arrays["edges"], arrays["curves"]])
    assert len(drawn) == 2 * len(surface.topology.edges)
    wall_only = arrays["curves"].reshape(-1, 2)[arrays["curve_wall"] == 1]
    assert 0 < len(wall_only) < len(arrays["curves"]) / 2
    assert header["title"] == "the hall"
    assert [p["wall"] for p in header["patches"]] == [False, False, False, True, True]
    held = np.isfinite(arrays["reactions"].reshape(-1, 3)[:, 0])
    assert held.sum() == (surface.fixed & surface.topology.on_boundary).sum()


def test_reactions_per_length_are_the_certificates_pulls(client, explorer):
    """Summed along the boundary: what one vertex shows is the mean of its edges."""
    _, arrays = client.ask("/api/open")
    surface, pulls = explorer.start.surface, explorer.start.certificate.pulls
    edges = surface.topology.edges[surface.topology.boundary_edge]
    length = np.linalg.norm(np.diff(surface.vertices[edges], axis=1)[:, 0], axis=1)
    per_length = np.nan_to_num(arrays["reactions"].reshape(-1, 3))
    shown = 0.5 * (per_length[edges].sum(axis=1) * length[:, None]).sum(axis=0)
    total = pulls["length"].to_numpy() @ pulls[["pull_x", "pull_y", "pull_z"]].to_numpy()
    np.testing.assert_allclose(shown, total, rtol=1e-4, atol=1e-4 * np.abs(total).max())
    assert explorer.start.certificate.largest_reaction == pytest.approx(surface.tensions.max(), rel=1e-12)


@pytest.mark.parametrize("suffix", [".obj", ".fe", ".pcmc", ".stl"])
def test_exports_are_the_surface_shown(client, suffix, tmp_path):
    name = client.ask("/api/open")[0]["session"]
    client.ask(f"/api/{name}/settle", {"tensions": {"right wall": 18.0}})
    answer, body = client.raw("GET", f"/api/{name}/export?suffix={suffix}")
    assert answer.status == 200
    assert answer.getheader("Content-Disposition") == f"attachment; filename*=UTF-8''the%20hall{suffix}"
    path = tmp_path / f"surface{suffix}"
    path.write_bytes(body)
    read = pcmc.read(path)
    shown = client.explorer.session(name).surface
    assert read.m == shown.m
    assert np.isclose(read.vertices[:, 2].max(), shown.vertices[:, 2].max(), rtol=1e-6)
    if suffix != ".stl":
        assert [p.name for p in read.patches] == [p.name for p in shown.patches]


def test_an_export_tells_what_its_format_loses(tmp_path):
    """Before, a .stl of a roof in the coordinates of a survey was elsewhere without a word."""
    corners = [[691000, 5334000], [691008, 5334000], [691008, 5334008], [691000, 5334008]]
    roof = ShownRoof.of(pcmc.solve(Plan(corners, edge_length=2.0, tension=6.0).surface()).surface)
    with closing(explore.start(roof)) as running:
        client = Client(running)
        place = f"/api/{client.ask('/api/open')[0]['session']}/export?suffix="
        notes = [client.raw("GET", place + kind)[0].getheader("X-Note") for kind in (".obj", ".stl")]
    assert notes[0] == ""
    assert unquote(notes[1]).startswith("its coordinates are relative to [691004, 5334004, 0]")


def test_the_least_recently_used_session_expires(client, monkeypatch):
    monkeypatch.setattr(server, "MOST_SESSIONS", 3)
    names = [client.ask("/api/open")[0]["session"] for _ in range(3)]
    client.ask(f"/api/{names[0]}/state")
    client.ask("/api/open")
    assert len(client.explorer.sessions) == 3
    assert "expired; reload the page" in client.ask(f"/api/{names[1]}/state", status=410)
    client.ask(f"/api/{names[0]}/state")


def test_the_mesh_check_comes_as_a_table_in_words(client):
    header, arrays = client.ask(f"/api/{client.ask('/api/open')[0]['session']}/check")
    check = header["check"]
    assert (check["name"], check["word"], arrays) == ("persists", "persists", {})
    names = [row["name"] for row in check["rows"]]
    assert {"height of left", "volume", "energy", "lowest eigenvalue"} <= set(names)
    height = check["rows"][names.index("height of left")]
    value, bar = map(float, height["value"].split(" ± "))
    limit, narrower = map(float, height["limit"].split(" ± "))
    assert abs(value - limit) <= bar
    assert narrower < bar


def test_a_surface_that_is_not_at_rest_has_no_mesh_check():
    running = explore.start(CAP.retensioned({"cap": 0.2}))
    try:
        client = Client(running)
        name = client.ask("/api/open")[0]["session"]
        assert "needs a surface at rest" in client.ask(f"/api/{name}/check", status=400)
    finally:
        running.close()


@pytest.mark.parametrize(
    ("path", "body", "status", "line"),
    [
        ("/api/NAME/follow", '{"tensions": {"lefft": 3}}', 400, "did you mean 'left'"),
        ("/api/NAME/settle", '{"tensoins": {"left": 3}}', 400, "did you mean 'tensions'"),
        ("/api/NAME/follow", '{"tensions": {"left": -3}}', 400, "expected a finite number"),
        (
            "/api/NAME/follow",
            '{"tensions": {"left": "a"}}',
            400,
            "'left': expected a finite number ≥ 0, found 'a'",
        ),
        ("/api/NAME/follow", '{"tensions": {"left": true}}', 400, "found True"),
        ("/api/NAME/follow", '{"points": {"left": [0, 0]}}', 400, "expected three finite numbers"),
        ("/api/NAME/settle", '{"pressures": [1]}', 400, "pressures: expected numbers by name"),
        ("/api/NAME/settle", '{"tensions": {"left": 1e999}}', 400, "finite"),
        ("/api/NAME/settle", "{", 400, "not JSON"),
        ("/api/NAME/settle", "\xff", 400, "not JSON"),
        ("/api/NAME/settle", "[]", 400, "expected a JSON object"),
        ("/api/NAME/fly", "{}", 404, "nothing at"),
        ("/api/nobody/follow", "{}", 410, "reload the page"),
        ("/other", "{}", 404, "nothing at"),
    ],
)
def test_bad_requests_are_answered_in_one_line(client, path, body, status, line):
    name = client.ask("/api/open")[0]["session"]
    answer, told = client.raw("POST", path.replace("NAME", name), body.encode("latin-1"))
    assert answer.status == status
    error = json.loads(told)["error"]
    assert line in error
    assert "\n" not in error


@pytest.mark.parametrize(
    "path",
    [
        "/page/../server.py",
        "/page/..%2fserver.py",
        "/page/none.js",
        "/page/__init__.py",
        "/x",
        "/api/nobody/export?suffix=.obj",
        "/page/",
    ],
)
def test_only_the_pages_own_files_are_served(client, path):
    answer, body = client.raw("GET", path)
    assert answer.status in (404, 410)
    assert json.loads(body)["error"]


def test_exports_of_unknown_formats_are_refused(client):
    name = client.ask("/api/open")[0]["session"]
    for suffix in (".xyz", "", "/../x.obj"):
        answer, body = client.raw("GET", f"/api/{name}/export?suffix={suffix}")
        assert answer.status == 400
        assert "unknown format" in json.loads(body)["error"]


def test_other_sites_may_not_ask(client):
    for headers in ({"Host": "evil.example:80"}, {"Origin": "http://evil.example"}):
        answer, body = client.raw("POST", "/api/open", "{}", **headers)
        assert answer.status == 403
        assert "error" in json.loads(body)
        assert client.explorer.token.encode() not in body  # nor does the page of another name learn it
    port = client.explorer.port
    for headers in ({"Host": f"localhost:{port}"}, {"Origin": f"http://127.0.0.1:{port}"}):
        assert client.raw("POST", "/api/open", "{}", **headers)[0].status == 200


def test_requests_without_a_length_or_too_long_are_refused(client):
    for length in ("", "-1", "99999999"):
        line = http.client.HTTPConnection("127.0.0.1", client.explorer.port, timeout=60)
        line.putrequest("POST", "/api/open")
        line.putheader("Content-Length", length)
        line.endheaders()
        assert line.getresponse().status == 400
        line.close()


def test_an_address_that_is_taken_or_is_none_is_an_error_in_one_line(explorer):
    for host, port in (("127.0.0.1", explorer.port), ("256.0.0.1", 0), ("127.0.0.1", 70000)):
        with refused(OptionError, found=(host, port)) as caught:
            explore.start(CAP, host=host, port=port)
        assert "\n" not in str(caught.value)


def test_only_surfaces_are_explored():
    with refused(SurfaceError, what="surface", found="str"):
        explore.start("roof")


def test_serve_prints_the_address_opens_the_page_and_ends_with_ctrl_c(monkeypatch, capsys):
    opened = []

    def interrupted(self):
        raise KeyboardInterrupt

    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr(server.Explorer, "wait", interrupted)
    explore.serve(CAP)
    said = capsys.readouterr().out
    assert len(opened) == 1
    assert opened[0] in said
    assert said.endswith("stopped: the page can compute and save nothing more\n")
    with pytest.raises(ConnectionRefusedError):
        http.client.HTTPConnection(opened[0].split("/")[2], timeout=5).request("GET", "/")
    explore.serve(CAP, open_browser=False)
    assert len(opened) == 1


def test_listening_for_everyone_is_only_when_told(monkeypatch):
    bound = []
    real = server.listen
    monkeypatch.setattr(server, "listen", lambda host, *rest: bound.append(host) or real(host, *rest))
    for host in (None, "0.0.0.0"):
        running = explore.start(CAP) if host is None else explore.start(CAP, host=host)
        running.close()
    assert bound == ["127.0.0.1", "0.0.0.0"]


def test_in_a_notebook_the_page_is_a_frame_and_its_surface_is_at_hand():
    view = explore.show(CAP, height=500)
    try:
        html = view._repr_html_()
        assert f'src="{view.url}"' in html
        assert 'height="500"' in html
        name = view.url.split("session=")[1]
        Client(view.explorer).ask(f"/api/{name}/settle", {"tensions": {"cap": 0.8}})
        assert view.surface.patches[0].tension == 0.8
    finally:
        view.close()


def test_the_page_has_a_sign_and_a_colour_for_every_verdict():
    folder = files("pcmc.explore").joinpath("page")
    signs, style = (folder.joinpath(name).read_text("utf-8") for name in ("findings.js", "style.css"))
    for verdict in Verdict:
        assert f'{verdict.name.lower()}: "' in signs
        assert f"#verdict[data-verdict={verdict.name.lower()}]" in style


def test_importing_pcmc_does_not_import_the_server():
    import subprocess
    import sys

    code = "import sys, pcmc; assert pcmc.explore.serve; print('http.server' in sys.modules)"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "False"


def test_only_disabled_buttons_are_faded():
    style = files("pcmc.explore").joinpath("page", "style.css").read_text(encoding="utf-8")
    faded = re.findall(r"^([^{}]*) \{[^{}]*opacity: \.45", style, re.M)
    assert faded == ["button:disabled"]
