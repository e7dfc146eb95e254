"""The server behind the page: its files, and a session for each page.

It is the standard library's, so that exploring needs the core install alone.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re
import secrets
import select
import socket
import tempfile
import threading
import warnings
from collections import OrderedDict
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, quote, urlsplit

from ..base.arrays import plain
from ..base.errors import FileWarning, MissingExtra, PcmcError, SurfaceError, unknown
from ..io import FORMATS, write
from ..project import load, vertex_fields
from ..project.values import values_of
from ..surface import Surface
from . import requests, saving
from .listening import LOOPBACK, Listener, listen
from .messages import pack
from .own_way import OwnWay
from .page_data import (
    aims_data,
    centre,
    families_drawn,
    fields,
    findings,
    margin_findings,
    mesh_findings,
    mesh_key,
    outline,
    patch_data,
    target_choices,
    unit_texts,
    variant_data,
    verdict_data,
)
from .requests import RequestError
from .roof import Roof, signature
from .session import Session, State, solved_start
from .variants import figures_data
from .watching import Watch

MOST_SESSIONS = 32  # more pages than this end the least recently used session
SOLVES_AT_ONCE = 2
LONGEST_REQUEST = 1_000_000  # bytes
TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Content-Security-Policy": "default-src 'self'; img-src 'self' blob: data:",
}
OTHERS = ("check", "verify", "families", "margin", "news", "save")  # acts that answer with no surface


class Explorer:
    """A running server. ``url`` is the page; ``close`` ends it.

    Each page has its own session in ``sessions``, the most recently used last.
    """

    def __init__(self, roof: Roof, host: str, port: int, watch: Callable[[], Roof] | None = None) -> None:
        if not isinstance(roof.surface, Surface):
            found = type(roof.surface).__name__
            raise SurfaceError(f"explore: expected a Surface, found {found}", what="surface", found=found)
        self._server = listen(host, port, _Handler)
        self._server.explorer = self
        self.local = host in LOOPBACK
        self.roof, self.origin = roof, centre(roof.surface)
        self.start = solved_start(roof.surface)
        self.version = 0
        self.sessions: OrderedDict[str, Session] = OrderedDict()
        self.token = secrets.token_urlsafe(16)
        self._turn, self._checks = threading.Semaphore(SOLVES_AT_ONCE), threading.Semaphore(1)
        self._lock, self._saving = threading.Lock(), threading.Lock()
        self.port = int(self._server.server_address[1])
        named = f"[{host}]" if ":" in host else host
        self.url = (
            f"http://{'127.0.0.1' if host in ('', '0.0.0.0') else named}:{self.port}/?token={self.token}"
        )
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()
        self.watch: Watch | None = None
        if watch is not None and roof.path is not None:
            self.watch = Watch(roof.path, roof.signature, watch, self.show)

    def show(self, roof: Roof) -> None:
        """Show another roof on every page."""
        start = solved_start(roof.surface)
        if start.failure is not None:
            raise SurfaceError(f"{start.failure.verdict.value}; {start.failure.detail}", what="surface")
        with self._lock:
            self.roof, self.origin, self.start = roof, centre(roof.surface), start
            sessions = list(self.sessions.values())
        for session in sessions:
            session.renew(start, roof.units, self._own_way())
        self.version += 1

    def _own_way(self) -> OwnWay:
        return OwnWay(self.roof.path or Path(), self.roof.data)

    def save(self, session: Session, name: str, replace: bool) -> dict[str, Any]:
        """Save the surface of a session as a project beside the file that was opened."""
        if not self.local:
            text = "only a page of this machine saves files; this server listens for others, too"
            raise RequestError(text, HTTPStatus.FORBIDDEN)
        start, state = self.start, session.state()  # after all that was asked for before
        with self._saving:
            if self.start is not start:
                raise RequestError("the file was changed while this save waited; save again")
            path, note = saving.save(self.roof, state.surface, name, replace, state.aims)
            if path == self.roof.path:
                outcome = dataclasses.replace(self.roof.outcome, project=load(path))
                self.roof = dataclasses.replace(self.roof, outcome=outcome)
                if self.watch is not None:  # the page shows this already
                    self.watch.seen = signature(path)
        return {"saved": path.name, "note": note}

    def open(self) -> tuple[str, Session]:
        """A new session and its name in addresses."""
        name = secrets.token_urlsafe(12)
        session = Session(self.start, self._turn, self.roof.units, self._own_way(), self._checks)
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
        if self.watch is not None:
            self.watch.close()
        self._server.shutdown()
        self._server.server_close()
        self._server.close_connections()
        self._thread.join()


class View:
    """The page in a notebook; ``surface`` is the one it shows now."""

    def __init__(self, roof: Roof, height: int) -> None:
        self.explorer = Explorer(roof, "127.0.0.1", 0)
        self._name, self._session = self.explorer.open()
        self.height = int(height)

    @property
    def surface(self) -> Surface:
        """The surface that the page shows now."""
        return self._session.surface

    @property
    def url(self) -> str:
        """The page's address, to open it in a window."""
        return f"{self.explorer.url}&session={self._name}"

    def close(self) -> None:
        """End the server behind the page."""
        self.explorer.close()

    def _repr_html_(self) -> str:
        return (
            f'<iframe src="{self.url}" width="100%" height="{self.height}" style="border:0"'
            ' allow="fullscreen" title="pcmc explore"></iframe>'
        )


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True  # else the body waits up to 40 ms for the header
    wbufsize = -1  # header and body leave together
    server: Listener

    def do_GET(self) -> None:
        self._answer(self._get)

    def do_POST(self) -> None:
        self._answer(self._post)

    def handle_one_request(self) -> None:
        self.server.limit(self.connection)
        super().handle_one_request()

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: the terminal is the user's."""

    # -- requests ----------------------------------------------------------------------------------

    def _answer(self, act: Any) -> None:
        try:
            self._content = self._read_content()
            self._check_sender()
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

    def _check_sender(self) -> None:
        """Refuse requests from pages of other sites, under other names of this machine, and without token."""
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
            raise RequestError("open the address that pcmc explore printed", HTTPStatus.FORBIDDEN)
        if source is not None and source != host:
            raise RequestError("requests from pages of other sites are refused", HTTPStatus.FORBIDDEN)
        parts = urlsplit(self.path)
        given = self.headers.get("X-Token") or parse_qs(parts.query).get("token", [""])[0]
        if not parts.path.startswith("/page/") and not secrets.compare_digest(
            given.encode(), explorer.token.encode()
        ):
            text = "open the address that pcmc explore printed: its token is missing here, or of another run"
            raise RequestError(text, HTTPStatus.FORBIDDEN)

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
            name = requests.session_name(asked)
            name, session = (name, explorer.session(name)) if name else explorer.open()
            self._send_state(session, session.state(), self._opening(name, session))
            return
        if len(steps) != 3 or steps[0] != "api" or steps[2] not in (*requests.ACTS, *OTHERS):
            raise RequestError(f"there is nothing at {self.path:.60}", HTTPStatus.NOT_FOUND)
        session, act = explorer.session(steps[1]), steps[2]
        if act == "check":
            check = session.check_mesh(self._gone)
            found = None if check is None else mesh_findings(check, explorer.roof.units)
            self._send_header({"superseded": True} if found is None else {"check": found})
        elif act == "margin":
            margin = session.margin(requests.varied(asked), self._gone)
            about, arrays = margin_findings(margin, explorer.origin, explorer.roof.units)
            self._send(pack(about, arrays), "application/octet-stream")
        elif act == "verify":
            theorem, units = session.verify(), explorer.roof.units
            self._send_header({"badge": theorem.brief(units), "text": theorem.text(units)})
        elif act == "families":
            self._send(pack({}, {"family": families_drawn(session.state())}), "application/octet-stream")
        elif act == "news":
            watch = explorer.watch
            news = {"working": bool(watch and watch.working), "problem": watch.problem if watch else ""}
            self._send_header({"version": explorer.version, "progress": session.progress, **news})
        elif act == "save":
            self._send_header(explorer.save(session, *requests.file_to_save(asked)))
        else:
            arguments = requests.ACTS[act](asked)
            more = (self._gone,) if act == "meet" else ()
            state = getattr(session, act)(*arguments, *more)
            self._send_state(session, state, moving=act == "follow")

    def _gone(self) -> bool:
        """Whether the page has closed the connection, and waits for no answer."""
        ready = select.select([self.connection], [], [], 0.0)[0]
        return bool(ready) and not self.connection.recv(1, socket.MSG_PEEK)

    def _opening(self, name: str, session: Session) -> dict[str, Any]:
        """What the page learns once."""
        explorer = self.server.explorer
        roof = explorer.roof
        return {
            "session": name,
            "formats": list(FORMATS),
            "title": roof.title,
            "name": roof.name,
            "units": unit_texts(roof.units),
            "note": roof.note,
            "note_met": roof.outcome.result is not None and roof.outcome.good,
            "project": roof.project is not None and explorer.local,
            "file": roof.path.name if roof.path is not None else "",
            "quantities": target_choices(session.surface),
            "aims": aims_data(*(session.aims or roof.aims)),
            "watching": explorer.watch is not None,
            "version": explorer.version,
        }

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

    def _send_header(self, header: dict[str, Any]) -> None:
        self._send(pack(header, {}), "application/octet-stream")

    def _send_state(
        self, session: Session, state: State, first: dict[str, Any] | None = None, *, moving: bool = False
    ) -> None:
        """A state; with ``first``, what the page learns once, and the mesh; ``moving`` with a slider."""
        header: dict[str, Any] = {"superseded": state.superseded and first is None}
        drawn: dict[str, Any] = {}
        origin = self.server.explorer.origin
        if first is not None:
            about, drawn = outline(state.surface, origin)
            header |= {**about, **first}
        if not header["superseded"]:
            header |= {
                "mesh": mesh_key(state.surface, origin),
                "asked": patch_data(state.asked),
                "shown": patch_data(state.surface.patches),
                "values": {"asked": values_of(state.wanted), "shown": values_of(state.surface)},
                "verdict": verdict_data(state.failure or state.certificate),
                "at_rest": state.failure is None,
                "findings": findings(state.certificate, moving),
                "figures": figures_data(state.surface, state.certificate),
                "undo": state.undo,
                "redo": state.redo,
                "message": state.message,
                "met": state.met,
                "number": state.number,
                "way": state.note,
                "variants": [variant_data(variant) for variant in state.variants],
                "compared": state.compared,
            }
            drawn |= fields(state, origin)
        self._send(pack(header, drawn), "application/octet-stream")

    def _export(self, session: Session, suffix: str) -> None:
        state, roof = session.state(), self.server.explorer.roof
        if suffix not in FORMATS:
            raise RequestError(unknown("format", suffix[:60], FORMATS))
        # the page lists what formats carry; a rule for this module alone, as threads share the rules
        warnings.filterwarnings("ignore", category=FileWarning, module=re.escape(__name__))
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"surface{suffix}"
            scalars = vertex_fields(state.surface, state.certificate)
            numbers = plain(state.certificate.numbers())
            write(path, state.surface, scalars=scalars, certificate=numbers, units=roof.units)
            body = path.read_bytes()
        name = quote(f"{roof.name}{suffix}", safe="")
        self._send(body, "application/octet-stream", f"attachment; filename*=UTF-8''{name}")

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
        self.server.limit(self.connection)
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)
