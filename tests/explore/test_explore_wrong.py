"""Requests that are broken, half sent or many at once: each ends with an answer of one line, or is closed."""

from __future__ import annotations

import json
import socket
import threading
import time
from contextlib import ExitStack
from http.server import BaseHTTPRequestHandler

import pytest
from asking import asked

from generators import spherical_cap
from pcmc import explore
from pcmc.explore import listening, server
from pcmc.explore.listening import unpack

CAP = spherical_cap(edge_length=0.5)
DEEP = "[" * 100_000


@pytest.fixture(scope="module")
def explorer():
    running = explore.start(CAP)
    yield running
    running.close()


@pytest.fixture(scope="module")
def session(explorer):
    return unpack(asked(explorer, "POST", "/api/open", "{}")[1])[0]["session"]


def sent(explorer, data):
    """All that comes back for these bytes until the server closes the connection."""
    with socket.create_connection(("127.0.0.1", explorer.port), timeout=60) as line:
        line.sendall(data)
        return b"".join(iter(lambda: line.recv(65536), b""))


@pytest.mark.parametrize(
    ("path", "body", "line"),
    [
        ("open", '{"session": ["a"]}', "session: expected a name"),
        ("open", '{"session": {"a": 1}}', "session: expected a name"),
        ("open", '{"session": 5}', "session: expected a name"),
        ("NAME/follow", '{"tensions": {"cap": %s}}' % ("9" * 400), "expected a finite number"),
        ("NAME/follow", '{"tensions": {"cap": %s}}' % ("9" * 5000), "not JSON"),
        ("NAME/follow", '{"tensions": {"cap": NaN}}', "finite"),
        ("NAME/follow", '{"tensions": {"cap": [1]}}', "expected a finite number"),
        ("NAME/follow", '{"tensions": {"%s": 1}}' % ("a" * 500_000), "unknown patch 'aaaaaaaa"),
        ("NAME/settle", '{"tensions": null}', "expected numbers by name"),
        ("NAME/settle", DEEP, "nested too deep"),
        (
            "NAME/meet",
            '{"targets": [{"value": 1}], "vary": [{"patch": "cap"}]}',
            "targets: each needs a quantity",
        ),
        (
            "NAME/meet",
            '{"targets": [{"quantity": "apex", "value": 1}], "vary": [{"low": 1}]}',
            "vary: each needs a patch",
        ),
        ("NAME/settle", '{"tensions": ' + DEEP, "nested too deep"),
        ("NAME/settle", '{"tension": {"cap": 1}}', "unknown key 'tension'; did you mean 'tensions'?"),
        ("NAME/undo", '{"steps": 2}', "unknown key 'steps'"),
        ("NAME/news", '{"since": 2}', "unknown key 'since'"),
        ("NAME/save", '{"name": "a", "replace": 1}', "replace: expected true or false"),
    ],
)
def test_wrong_values_are_answered_in_one_line(explorer, session, path, body, line):
    answer, content = asked(explorer, "POST", f"/api/{path.replace('NAME', session)}", body)
    error = json.loads(content)["error"]
    assert answer.status == 400
    assert line in error
    assert "\n" not in error
    assert len(error) < 300


def test_what_to_type_at_the_end_of_a_long_line_is_kept(explorer, session):
    body = json.dumps({"tensions": {"a" * 300: 1.0}})
    _, content = asked(explorer, "POST", f"/api/{session}/follow", body)
    assert json.loads(content)["error"].endswith("known: cap")


@pytest.mark.parametrize("token", ["", "x", "\xe9"])
@pytest.mark.parametrize(("method", "path"), [("POST", "/api/open"), ("GET", "/"), ("GET", "/api/x/export")])
def test_without_the_token_of_its_address_nothing_is_answered(explorer, method, path, token):
    answer, content = asked(explorer, method, path, "{}", **{"X-Token": token})
    assert answer.status == 403
    assert "token" in json.loads(content)["error"]
    assert asked(explorer, "GET", f"/?token={explorer.token}", **{"X-Token": ""})[0].status == 200


@pytest.mark.parametrize("headers", [{"Host": "evil.example"}, {"Host": ""}, {"Origin": "null"}])
def test_a_refusal_does_not_tell_the_token(explorer, headers):
    answer, content = asked(explorer, "GET", "/", **{"X-Token": "", **headers})
    assert answer.status == 403
    assert explorer.token not in content.decode() + str(answer.getheaders())


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Origin": "http://[broken"}, 400),
        ({"Origin": "null"}, 403),
        ({"Host": "["}, 403),
        ({"Content-Length": "\u00b2"}, 400),
        ({"Content-Length": "-1"}, 400),
        ({"Transfer-Encoding": "chunked"}, 400),
    ],
)
def test_broken_headers_are_answered(explorer, headers, status):
    lines = {"Host": f"127.0.0.1:{explorer.port}", "Content-Length": "2"} | headers
    head = "".join(f"{name}: {value}\r\n" for name, value in lines.items())
    answer = sent(explorer, f"POST /api/open HTTP/1.1\r\n{head}\r\n{{}}".encode("latin-1"))
    assert answer.startswith(f"HTTP/1.1 {status} ".encode())
    assert "\n" not in json.loads(answer.split(b"\r\n\r\n")[1])["error"]


@pytest.mark.parametrize(
    "path", ["/page/" + "a" * 300 + ".js", "/page/a\0.js", "//[", "/page/" + "%00" * 20 + ".js"]
)
def test_broken_addresses_are_answered(explorer, path):
    answer = sent(explorer, f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
    assert answer[:12] in (b"HTTP/1.1 400", b"HTTP/1.1 403", b"HTTP/1.1 404")
    assert len(json.loads(answer.split(b"\r\n\r\n")[1])["error"]) < 300


def test_the_rest_of_a_refused_request_is_no_request(explorer):
    """Else a page of another site could send one without its Origin, as the content of the first."""
    inner = f"POST /api/open HTTP/1.1\r\nHost: 127.0.0.1:{explorer.port}\r\nContent-Length: 2\r\n\r\n{{}}"
    head = f"Host: 127.0.0.1:{explorer.port}\r\nOrigin: http://evil.example\r\nContent-Length: {len(inner)}"
    answer = sent(explorer, f"POST /api/open HTTP/1.1\r\n{head}\r\n\r\n{inner}".encode())
    assert answer.startswith(b"HTTP/1.1 403 ")
    assert answer.count(b"HTTP/1.1 ") == 1


def test_forty_browsers_at_once_are_all_served(explorer):
    lines = [socket.create_connection(("127.0.0.1", explorer.port), timeout=60) for _ in range(40)]
    request = f"GET /?token={explorer.token} HTTP/1.1\r\nHost: 127.0.0.1:{explorer.port}\r\n\r\n".encode()
    for line in lines:
        line.sendall(request)
    answers = [line.recv(12) for line in lines]
    for line in lines:
        line.close()
    assert answers == [b"HTTP/1.1 200"] * 40


def test_connections_wait_for_a_busy_server():
    """A server that accepts none for a while: the system keeps their connections."""
    waiting = listening.listen("127.0.0.1", 0, BaseHTTPRequestHandler)
    with ExitStack() as stack:
        stack.callback(waiting.server_close)
        for _ in range(40):
            stack.enter_context(socket.create_connection(waiting.server_address, timeout=5))


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"POST /api/op",
        b"POST /api/open HTTP/1.1\r\nHost: 127.0.0.1\r\n",
        b"POST /api/open HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 100\r\n\r\n{",
    ],
)
def test_a_half_sent_request_is_closed(explorer, monkeypatch, data):
    monkeypatch.setattr(listening, "REQUEST_SECONDS", 0.2)
    answer = sent(explorer, data)
    assert not answer or answer.startswith(b"HTTP/1.1 400 ")


def test_a_request_that_trickles_is_closed(explorer, monkeypatch):
    monkeypatch.setattr(listening, "REQUEST_SECONDS", 0.5)
    end = time.monotonic() + 60.0
    with socket.create_connection(("127.0.0.1", explorer.port), timeout=60) as line:
        while time.monotonic() < end:
            try:
                line.sendall(b"G")
            except OSError:
                return
            time.sleep(0.05)
    pytest.fail("it is still open")


@pytest.mark.nightly
def test_a_long_computation_is_not_cut_off(explorer, monkeypatch):
    monkeypatch.setattr(listening, "REQUEST_SECONDS", 0.5)
    real = server.Explorer.open

    def slow(self):
        time.sleep(2.0)
        return real(self)

    monkeypatch.setattr(server.Explorer, "open", slow)
    assert asked(explorer, "POST", "/api/open", "{}")[0].status == 200


def test_an_error_that_nobody_foresaw_is_answered_too(explorer, monkeypatch):
    def broken(self):
        raise KeyError("two\nlines")

    monkeypatch.setattr(server.Explorer, "open", broken)
    answer, content = asked(explorer, "POST", "/api/open", "{}")
    assert answer.status == 500
    assert "\n" not in json.loads(content)["error"]


@pytest.fixture
def endless(monkeypatch):
    """A mesh check that goes on until it is ended; the events of its begin and its end."""
    begun, ended = threading.Event(), threading.Event()

    def check(surface, callback):
        begun.set()
        try:
            while not ended.wait(0.02):
                callback(None)
        except StopIteration:
            ended.set()
            raise KeyboardInterrupt from None

    monkeypatch.setattr("pcmc.explore.session.check_mesh", check)
    yield begun, ended
    ended.set()


def test_a_mesh_check_leaves_the_sliders_free_and_ends_with_its_tab(explorer, session, endless):
    begun, ended = endless
    head = f"POST /api/{session}/check HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Token: {explorer.token}\r\n"
    with ExitStack() as tabs:
        for _ in range(2):
            tab = tabs.enter_context(socket.create_connection(("127.0.0.1", explorer.port), timeout=60))
            tab.sendall(f"{head}Content-Length: 2\r\n\r\n{{}}".encode())
        assert begun.wait(30)
        other = unpack(asked(explorer, "POST", "/api/open", "{}")[1])[0]["session"]
        moved = asked(explorer, "POST", f"/api/{other}/follow", '{"tensions": {}}')
        assert moved[0].status == 200
        assert not ended.is_set()
    assert ended.wait(30)
