"""HTTP: connections, who may ask, requests checked by one table, and answers in one run of bytes.

The server is the standard library's, so that exploring needs the core install alone. An answer is a JSON
header and the arrays that it names:
4 bytes     length of the header, little-endian
header      JSON, padded with spaces to a multiple of 4 bytes; "arrays" lists [name, type, count]
arrays      one after another, little-endian, 4 bytes a number: "f" float32, "u" uint32
"""

from __future__ import annotations

import json
import math
import re
import secrets
import select
import socket
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import fields
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from types import NoneType
from typing import Any
from urllib.parse import parse_qs, quote, urlsplit

import numpy as np
import numpy.typing as npt

from ..base.arrays import plain
from ..base.errors import MissingExtra, OptionError, PcmcError, unknown
from ..base.validate import checked_name
from ..design import Parameter, Target
from ..surface.values import KINDS

REQUEST_SECONDS = 30.0  # to send a request, from its first byte or the last answer; and to take an answer
WAITING = 128  # connections that the system keeps until they are accepted
LONGEST_REQUEST = 1_000_000  # bytes
LOOPBACK = ("127.0.0.1", "localhost", "::1")
MEDIA = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
BYTES = "application/octet-stream"
HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Content-Security-Policy": "default-src 'self'; img-src 'self' blob: data:",
}


class Listener(ThreadingHTTPServer):
    """A server that closes connections whose requests or answers take too long."""

    daemon_threads = True
    request_queue_size = WAITING
    explorer: Any

    def __init__(self, address: tuple[str, int], handler: type[BaseHTTPRequestHandler]) -> None:
        self._deadlines: dict[socket.socket, float] = {}
        super().__init__(address, handler)

    def limit(self, connection: Any, seconds: float | None = None) -> None:
        """Close the connection after so many seconds, by default a request's, unless limited again."""
        self._deadlines[connection] = time.monotonic() + (REQUEST_SECONDS if seconds is None else seconds)

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


def listen(host: str, port: int, handler: type[BaseHTTPRequestHandler]) -> Listener:
    """A server on an address; OptionError if it cannot listen there."""
    try:
        return Listener((host, port), handler)
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or error
        text = f"cannot listen on {host!r}, port {port}: {reason}; with port 0 pcmc takes a free one"
        what = "port" if host in LOOPBACK else "host"
        raise OptionError(text, what=what, found=(host, port)) from None


class PageHandler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True  # else the body waits up to 40 ms for the header
    wbufsize = -1  # header and body leave together
    server: Listener

    def handle_one_request(self) -> None:
        self.server.limit(self.connection)
        super().handle_one_request()

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: the terminal is the user's."""

    def do_POST(self) -> None:
        try:
            content = self._read_content()
            self._check_sender()
            self._respond(content)
        except (RequestError, PcmcError, MissingExtra) as error:
            self._refuse(str(error), getattr(error, "status", HTTPStatus.BAD_REQUEST))
        except OSError:
            raise  # the browser has left
        except Exception as error:  # the net: no request may end without an answer
            self._refuse(f"{type(error).__name__}: {error}", HTTPStatus.INTERNAL_SERVER_ERROR)

    do_GET = do_POST

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

    def _check_sender(self) -> None:
        """Refuse requests from other sites' pages, under other names of this machine, and without token."""
        host, origin = self.headers.get("Host", ""), self.headers.get("Origin")
        explorer = self.server.explorer
        try:
            source = None if origin is None else urlsplit(origin).netloc
            parts = urlsplit(self.path)
        except ValueError as error:
            raise RequestError(f"a broken address: {error}") from None
        if explorer.local and host.rsplit(":", 1)[0].strip("[]") not in LOOPBACK:
            raise RequestError("open the address that pcmc explore printed", HTTPStatus.FORBIDDEN)
        if source is not None and source != host:
            raise RequestError("requests from pages of other sites are refused", HTTPStatus.FORBIDDEN)
        given = self.headers.get("X-Token") or parse_qs(parts.query).get("token", [""])[0]
        known = secrets.compare_digest(given.encode(), explorer.token.encode())
        if not (known or parts.path.startswith("/page/")):
            text = "open the address that pcmc explore printed: its token is missing here, or of another run"
            raise RequestError(text, HTTPStatus.FORBIDDEN)

    def _respond(self, content: bytes) -> None:
        parts, explorer = urlsplit(self.path), self.server.explorer
        match [self.command, *parts.path.strip("/").split("/")]:
            case ["GET", ""]:
                self._send_file("index.html")
            case ["GET", "page", name]:
                self._send_file(name)
            case ["GET", "api", session, "export"]:
                name, body, note = explorer.export(session, parse_qs(parts.query).get("suffix", [""])[0])
                self._send(body, BYTES, name, note)
            case ["POST", "api", *session, act] if act in REQUESTS and len(session) == (act != "open"):
                turn = re.fullmatch(r"(\w{1,20}) (\d{1,9})", self.headers.get("X-Turn", ""))
                place = None if turn is None else (turn[1], int(turn[2]))
                given = "".join(session), act, json_object(content)
                self._send(explorer.answer(*given, self._gone, place), BYTES)
            case _:
                raise RequestError(f"there is nothing at {parts.path:.60}", HTTPStatus.NOT_FOUND)

    def _gone(self) -> bool:
        """Whether the page has closed the connection, and waits for no answer."""
        ready = select.select([self.connection], [], [], 0.0)[0]
        return bool(ready) and not self.connection.recv(1, socket.MSG_PEEK)

    def _refuse(self, line: str, status: HTTPStatus) -> None:
        """Answer with one line, and close: what is left of the request must not be read as another one."""
        self.close_connection = True
        line = " ".join(line.split())
        if len(line) > LONGEST_LINE:  # it repeats what was asked; what to type stands at its end
            line = f"{line[:200]}…{line[-80:]}"
        self._send(json.dumps({"error": line}).encode(), "application/json", status=status)

    def _send_file(self, name: str) -> None:
        kind = MEDIA.get(Path(name).suffix)
        file = files(str(__package__)).joinpath("page", name)
        if kind is None or not re.fullmatch(r"[\w.-]{1,80}", name) or not file.is_file():
            raise RequestError(f"there is no file {name!r:.60}", HTTPStatus.NOT_FOUND)
        self._send(file.read_bytes(), f"{kind}; charset=utf-8")

    def _send(
        self, body: bytes, kind: str, file: str = "", note: str = "", status: HTTPStatus = HTTPStatus.OK
    ) -> None:
        """Answer with a body, which the browser saves under the name of a ``file`` if there is one; the page
        shows the ``note``."""
        headers = {**HEADERS, "Content-Type": kind, "Content-Length": str(len(body))}
        if file:
            headers["Content-Disposition"] = f"attachment; filename*=UTF-8''{quote(file, safe='')}"
            headers["X-Note"] = quote(note)
        if self.close_connection:
            headers["Connection"] = "close"
        self.server.limit(self.connection)
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)


TYPES = {"f": "<f4", "u": "<u4"}
LONGEST_LINE = 1000  # characters
MOST_AIMS = 100  # targets, and parameters, of one request
Check = Callable[[str, Any], Any]  # the value of a key, given its place in the request; else RequestError


class RequestError(Exception):
    """A request that the server answers with one line of error."""

    def __init__(self, line: str, status: HTTPStatus = HTTPStatus.BAD_REQUEST) -> None:
        super().__init__(line)
        self.status = status


def check_request(keys: Mapping[str, Check], asked: Mapping[str, Any], where: str = "") -> dict[str, Any]:
    """The values in a request; a key that is not in the table is refused, one ending in ? may be missing.

    >>> check_request({"number": whole, "name?": name}, {"number": 3})
    {'number': 3}
    """
    known = {key.removesuffix("?"): check for key, check in keys.items()}
    if odd := [key for key in asked if key not in known]:
        raise RequestError(where + unknown("key", odd[0][:60], known))
    given = (key for key in known if key in asked or key in keys)
    return {key: known[key](where + key, asked.get(key)) for key in given}


def json_object(content: bytes) -> dict[str, Any]:
    """The body of a request; without one it is empty."""
    try:
        asked = json.loads(content or b"{}")
    except RecursionError:
        raise RequestError("not JSON: nested too deep") from None
    except ValueError as error:
        raise RequestError(f"not JSON: {error}") from None
    if not isinstance(asked, dict):
        raise RequestError("expected a JSON object")
    return asked


def of_type(words: str, *types: type) -> Check:
    """The check of a value of one of these types; true and false are no numbers."""

    def check(what: str, value: Any) -> Any:
        if not isinstance(value, types) or (isinstance(value, bool) and bool not in types):
            raise RequestError(f"{what}: expected {words}, found {value!r:.60}")
        return value

    return check


whole, truth, name = of_type("a whole number", int), of_type("true or false", bool), of_type("a name", str)


def variant_name(what: str, value: Any) -> str:
    words = " ".join(name(what, value).split())
    if not 0 < len(words) <= 60:
        raise RequestError(f"{what}: expected 1 to 60 characters, found {len(words)}")
    return checked_name(what, words)


def as_given(_: str, value: Any) -> Any:
    """A value that is checked where it is used, with a tuple for a list."""
    return tuple(value) if isinstance(value, list) else value


def entries(made: Any) -> Check:
    """Objects of a class, at least one: their keys are its fields, and each has the first of them."""
    first, *others = (field.name for field in fields(made))
    keys: dict[str, Check] = {first: as_given, **{f"{other}?": as_given for other in others}}

    def objects(what: str, listed: Any) -> tuple[Any, ...]:
        if not isinstance(listed, list) or not listed or not all(isinstance(entry, dict) for entry in listed):
            raise RequestError(f"{what}: expected a list of objects, at least one")
        if len(listed) > MOST_AIMS:
            raise RequestError(f"{what}: {len(listed)} are too many; at most {MOST_AIMS}")
        if not all(first in entry for entry in listed):
            raise RequestError(f"{what}: each needs a {first}")
        return tuple(made(**check_request(keys, entry, f"{what}: ")) for entry in listed)

    return objects


VALUES = {f"{kind}?": of_type("numbers by name", dict) for kind in (*KINDS, "points")}
ACTS: dict[str, dict[str, Check]] = {
    **dict.fromkeys(("follow", "settle"), VALUES),
    "meet": {"targets": entries(Target), "vary": entries(Parameter)},
    "keep": {"name": variant_name},
    **{act: {"number": whole} for act in ("forget", "recall", "visit")},
    "compare": {"number?": of_type("a whole number or null", int, NoneType)},
    **{act: {} for act in ("stabilise", "remesh", "undo", "redo", "reset", "stop", "state")},
}
"""The acts of a session, with the arguments that each takes; they answer with its state."""
REQUESTS: dict[str, dict[str, Check]] = ACTS | {
    "open": {"session?": of_type("a name or null", str, NoneType)},
    **{act: {"what": name} for act in ("margin", "equilibria")},
    "save": {"name": name, "replace?": truth},
    **{act: {} for act in ("check", "verify", "families", "news")},
}
"""All requests; those that are no acts answer with something else."""


def pack(header: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]] | None = None) -> bytes:
    """One answer; float arrays become float32, integers uint32.

    >>> packed = pack({"a": float("nan")}, {"x": np.array([1.5])})
    >>> unpack(packed)
    ({'a': None}, {'x': array([1.5], dtype=float32)})
    """
    listed, blocks = [], []
    for name, array in (arrays or {}).items():
        kind = "f" if array.dtype.kind == "f" else "u"
        listed.append([name, kind, int(array.size)])
        blocks.append(np.ascontiguousarray(array, dtype=TYPES[kind]).tobytes())
    packed = json.dumps(plain({**header, "arrays": listed}), allow_nan=False).encode()
    packed += b" " * (-len(packed) % 4)
    return b"".join([len(packed).to_bytes(4, "little"), packed, *blocks])


def unpack(message: bytes) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    """Header and flat arrays of an answer: the inverse of ``pack``."""
    start = 4 + int.from_bytes(message[:4], "little")
    header = json.loads(message[4:start])
    arrays = {}
    for name, kind, count in header.pop("arrays"):
        arrays[name] = np.frombuffer(message, TYPES[kind], count, start)
        start += 4 * count
    return header, arrays
