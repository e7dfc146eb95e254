"""The server behind the page: its files, and a session for each page.

It is the standard library's, so that exploring needs the core install alone.
"""

from __future__ import annotations

import json
import math
import re
import secrets
import socket
import tempfile
import threading
import time
import warnings
from collections import OrderedDict
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

from ..base.errors import MissingExtra, OptionError, PcmcError, SurfaceError, unknown
from ..base.units import NO_UNITS, Units
from ..certificate.certificate import Certificate
from ..io import FORMATS, write
from ..project.output import fields as written_fields
from ..surface import Patch, Surface
from .messages import pack, plain
from .page_data import centre, fields, findings, mesh_findings, outline, unit_texts
from .session import Session, State, solved_start

MOST_SESSIONS = 32  # more pages than this end the least recently used session
SOLVES_AT_ONCE = 2
LONGEST_REQUEST = 1_000_000  # bytes
LONGEST_NAME = 1000  # characters
REQUEST_SECONDS = 30.0  # to send a request, from its first byte or the last answer; and to take an answer
WAITING = 128  # connections that the system keeps until they are accepted
LOOPBACK = ("127.0.0.1", "localhost", "::1")
TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Content-Security-Policy": "default-src 'self'; img-src 'self' blob: data:",
}
ACTS = ("follow", "settle", "stabilise", "undo", "redo", "reset", "state")


class RequestError(Exception):
    """A request that the server answers with one line of error."""

    def __init__(self, line: str, status: HTTPStatus = HTTPStatus.BAD_REQUEST) -> None:
        super().__init__(line)
        self.status = status


class Explorer:
    """A running server. ``url`` is the page; ``close`` ends it.

    Each page has its own session in ``sessions``, the most recently used last.
    """

    def __init__(self, surface: Surface, host: str, port: int, title: str, units: Units = NO_UNITS) -> None:
        if not isinstance(surface, Surface):
            found = type(surface).__name__
            raise SurfaceError(f"explore: expected a Surface, found {found}", what="surface", found=found)
        self._server = _listen(host, port)
        self._server.explorer = self
        self.title, self.units = title, units
        self.local = host in LOOPBACK
        self.origin = centre(surface)
        self.start = solved_start(surface)
        self.sessions: OrderedDict[str, Session] = OrderedDict()
        self._turn = threading.Semaphore(SOLVES_AT_ONCE)
        self._lock = threading.Lock()
        self.port = int(self._server.server_address[1])
        named = f"[{host}]" if ":" in host else host
        self.url = f"http://{'127.0.0.1' if host in ('', '0.0.0.0') else named}:{self.port}/"
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def open(self) -> tuple[str, Session]:
        """A new session and its name in addresses."""
        name, session = secrets.token_urlsafe(12), Session(self.start, self._turn)
        with self._lock:
            self.sessions[name] = session
            while len(self.sessions) > MOST_SESSIONS:
                self.sessions.popitem(last=False)
        return name, session

    def session(self, name: str) -> Session:
        """The session of that name."""
        with self._lock:
            if name not in self.sessions:
                raise RequestError("this session has expired; reload the page", HTTPStatus.GONE)
            self.sessions.move_to_end(name)
            return self.sessions[name]

    def wait(self) -> None:
        """Return when the server is closed."""
        while self._thread.is_alive():
            self._thread.join(0.5)

    def close(self) -> None:
        """Stop listening."""
        self._server.shutdown()
        self._server.server_close()
        self._server.close_connections()
        self._thread.join()


class View:
    """The page in a notebook; ``surface`` is the one it shows now."""

    def __init__(self, surface: Surface, height: int, title: str) -> None:
        self.explorer = Explorer(surface, "127.0.0.1", 0, title)
        self._name, self._session = self.explorer.open()
        self.height = int(height)

    @property
    def surface(self) -> Surface:
        """The surface that the page shows now."""
        return self._session.surface

    @property
    def url(self) -> str:
        """The page's address, to open it in a window."""
        return f"{self.explorer.url}?session={self._name}"

    def close(self) -> None:
        """End the server behind the page."""
        self.explorer.close()

    def _repr_html_(self) -> str:
        return (
            f'<iframe src="{self.url}" width="100%" height="{self.height}" style="border:0"'
            ' allow="fullscreen" title="pcmc explore"></iframe>'
        )


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = WAITING
    explorer: Explorer

    def __init__(self, address: tuple[str, int]) -> None:
        self._deadlines: dict[socket.socket, float] = {}
        super().__init__(address, _Handler)

    def get_request(self) -> tuple[socket.socket, Any]:
        connection, address = super().get_request()
        self.limit(connection, REQUEST_SECONDS)
        return connection, address

    def limit(self, connection: Any, seconds: float) -> None:
        """Close the connection after so many seconds, unless another limit is set before."""
        self._deadlines[connection] = time.monotonic() + seconds

    def shutdown_request(self, request: Any) -> None:
        self._deadlines.pop(request, None)
        super().shutdown_request(request)

    def service_actions(self) -> None:
        """Close the connections whose request or answer takes too long; ``serve_forever`` calls this."""
        self.close_connections(time.monotonic())

    def close_connections(self, now: float = math.inf) -> None:
        """Close the connections whose time is over; by default all, for browsers leave them open."""
        for connection, deadline in list(self._deadlines.items()):
            if deadline <= now:
                with suppress(OSError):
                    connection.shutdown(socket.SHUT_RDWR)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing: a browser may leave in the middle of an answer."""


def _listen(host: str, port: int) -> _Server:
    try:
        return _Server((host, port))
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or error
        text = f"cannot listen on {host!r}, port {port}: {reason}; with port 0 pcmc takes a free one"
        what = "port" if host in LOOPBACK else "host"
        raise OptionError(text, what=what, found=(host, port)) from None


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True  # else the body waits up to 40 ms for the header
    wbufsize = -1  # header and body leave together
    server: _Server

    def do_GET(self) -> None:
        self._answer(self._get)

    def do_POST(self) -> None:
        self._answer(self._post)

    def handle_one_request(self) -> None:
        self.server.limit(self.connection, REQUEST_SECONDS)
        super().handle_one_request()

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: the terminal is the user's."""

    # -- requests ----------------------------------------------------------------------------------

    def _answer(self, act: Any) -> None:
        try:
            self._content = self._read_content()
            self._check_origin()
            act()
        except (RequestError, PcmcError, MissingExtra) as error:
            self._refuse(str(error), getattr(error, "status", HTTPStatus.BAD_REQUEST))
        except OSError:
            raise  # the browser has left
        except Exception as error:  # the net: no request may end without an answer
            self._refuse(f"{type(error).__name__}: {error}", HTTPStatus.INTERNAL_SERVER_ERROR)

    def _refuse(self, line: str, status: HTTPStatus) -> None:
        """Answer with one line, and close: what is left of the request must not be read as another one."""
        self.close_connection = True
        self._send(json.dumps({"error": " ".join(line.split())}).encode(), "application/json", status=status)

    def _check_origin(self) -> None:
        """Refuse requests from pages of other sites, and under other names of this machine."""
        host = self.headers.get("Host", "")
        origin = self.headers.get("Origin")
        explorer = self.server.explorer
        name = host.rsplit(":", 1)[0].strip("[]")
        try:
            source = None if origin is None else urlsplit(origin).netloc
            urlsplit(self.path)
        except ValueError as error:
            raise RequestError(f"a broken address: {error}") from None
        if explorer.local and name not in LOOPBACK:
            raise RequestError(f"open this page at {explorer.url}", HTTPStatus.FORBIDDEN)
        if source is not None and source != host:
            raise RequestError("requests from pages of other sites are refused", HTTPStatus.FORBIDDEN)

    def _get(self) -> None:
        parts = urlsplit(self.path)
        steps = parts.path.strip("/").split("/")
        if parts.path == "/":
            self._send_file("index.html")
        elif steps[0] == "page" and len(steps) == 2:
            self._send_file(steps[1])
        elif steps[0] == "api" and len(steps) == 3 and steps[2] == "export":
            suffix = parse_qs(parts.query).get("suffix", [""])[0]
            self._export(self.server.explorer.session(steps[1]), suffix)
        else:
            raise RequestError(f"there is nothing at {parts.path:.60}", HTTPStatus.NOT_FOUND)

    def _post(self) -> None:
        asked = self._json()
        steps = urlsplit(self.path).path.strip("/").split("/")
        explorer = self.server.explorer
        if steps == ["api", "open"]:
            name = asked.get("session")
            if not isinstance(name, str | None):
                raise RequestError(f"session: expected a name, found {name!r:.60}")
            name, session = (name, explorer.session(name)) if name else explorer.open()
            header, arrays = outline(session.surface)
            about = {"title": explorer.title, "units": unit_texts(explorer.units)}
            first = {"session": name, "formats": list(FORMATS), **about, **header}
            self._send_state(session.state(), first, arrays)
        elif len(steps) == 3 and steps[0] == "api" and steps[2] == "check":
            check = explorer.session(steps[1]).check_mesh()
            header = {"superseded": True} if check is None else {"check": mesh_findings(check)}
            self._send(pack(header, {}), "application/octet-stream")
        elif len(steps) == 3 and steps[0] == "api" and steps[2] in ACTS:
            session = explorer.session(steps[1])
            given = (_values(asked),) if steps[2] in ("follow", "settle") else ()
            self._send_state(getattr(session, steps[2])(*given))
        else:
            raise RequestError(f"there is nothing at {self.path:.60}", HTTPStatus.NOT_FOUND)

    def _read_content(self) -> bytes:
        """What follows the headers: all of it, or what is left would be read as another request."""
        length = self.headers.get("Content-Length", "0" if self.command == "GET" else "")
        sized = re.fullmatch("[0-9]{1,8}", length) and "Transfer-Encoding" not in self.headers
        if not sized or int(length) > LONGEST_REQUEST:
            raise RequestError(f"a request needs a length of at most {LONGEST_REQUEST} bytes")
        content = self.rfile.read(int(length))
        self.server.limit(self.connection, math.inf)
        if len(content) < int(length):
            raise RequestError(f"cut off: {len(content)} of {length} bytes arrived")
        return content

    def _json(self) -> dict[str, Any]:
        try:
            asked = json.loads(self._content or b"{}")
        except RecursionError:
            raise RequestError("not JSON: nested too deep") from None
        except ValueError as error:
            raise RequestError(f"not JSON: {error}") from None
        if not isinstance(asked, dict):
            raise RequestError("expected a JSON object")
        return asked

    # -- answers -----------------------------------------------------------------------------------

    def _send_state(
        self, state: State, first: dict[str, Any] | None = None, arrays: dict[str, Any] | None = None
    ) -> None:
        header: dict[str, Any] = {"superseded": state.superseded, **(first or {})}
        drawn: dict[str, Any] = dict(arrays or {})
        if not state.superseded:
            header |= {
                "asked": _patches(state.asked),
                "shown": _patches(state.surface.patches),
                "verdict": _verdict(state.failure or state.certificate),
                "at_rest": state.failure is None,
                "findings": findings(state.surface, state.certificate),
                "undo": state.undo,
                "redo": state.redo,
            }
            drawn |= fields(state.surface, state.certificate, self.server.explorer.origin)
        self._send(pack(header, drawn), "application/octet-stream")

    def _export(self, session: Session, suffix: str) -> None:
        state = session.state()
        if suffix not in FORMATS:
            raise RequestError(unknown("format", suffix[:60], FORMATS))
        with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the page says which formats carry the numbers
            path = Path(folder) / f"surface{suffix}"
            scalars = written_fields(state.surface, state.certificate)
            numbers = plain(state.certificate.numbers())
            write(path, state.surface, scalars=scalars, certificate=numbers, units=self.server.explorer.units)
            body = path.read_bytes()
        self._send(body, "application/octet-stream", f'attachment; filename="surface{suffix}"')

    def _send_file(self, name: str) -> None:
        kind = TYPES.get(Path(name).suffix)
        file = files(__package__).joinpath("page", name)
        if kind is None or not re.fullmatch(r"[\w.-]{1,80}", name) or not file.is_file():
            raise RequestError(f"there is no file {name!r:.60}", HTTPStatus.NOT_FOUND)
        self._send(file.read_bytes(), f"{kind}; charset=utf-8")

    def _send(
        self, body: bytes, kind: str, disposition: str = "", status: HTTPStatus = HTTPStatus.OK
    ) -> None:
        headers = {**HEADERS, "Content-Type": kind, "Content-Length": str(len(body))}
        if disposition:
            headers["Content-Disposition"] = disposition
        if self.close_connection:
            headers["Connection"] = "close"
        self.server.limit(self.connection, REQUEST_SECONDS)
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)


def _values(asked: dict[str, Any]) -> dict[str, dict[str, float]]:
    """Tensions and pressures by patch; RequestError unless they are numbers."""
    values: dict[str, dict[str, float]] = {}
    for key in ("tensions", "pressures"):
        given = asked.get(key, {})
        if not isinstance(given, dict):
            raise RequestError(f"{key}: expected numbers by patch")
        values[key] = {}
        for name, value in given.items():
            if len(name) > LONGEST_NAME:
                raise RequestError(f"{key}: a name of {len(name)} characters: {name[:40]!r}...")
            if not isinstance(value, int | float) or isinstance(value, bool):
                raise RequestError(f"{key}: {name!r}: expected a number, found {value!r:.60}")
            try:
                values[key][name] = float(value)
            except OverflowError:
                raise RequestError(f"{key}: {name!r}: expected a number up to 1.8e308") from None
    return values


def _patches(patches: tuple[Patch, ...]) -> list[dict[str, Any]]:
    return [
        {"name": p.name, "tension": p.tension, "pressure": p.pressure, "target": p.target_curvature}
        for p in patches
    ]


def _verdict(certificate: Certificate) -> dict[str, str]:
    word, _, rest = certificate.verdict.value.partition(": ")
    name = certificate.verdict.name.lower()
    return {"name": name, "word": word, "sentence": rest, "detail": certificate.detail}
