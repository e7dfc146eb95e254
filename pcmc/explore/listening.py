"""Connections: how many wait, and how long one may take to send a request or take an answer."""

from __future__ import annotations

import math
import socket
import time
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from ..base.errors import OptionError

REQUEST_SECONDS = 30.0  # to send a request, from its first byte or the last answer; and to take an answer
WAITING = 128  # connections that the system keeps until they are accepted
LOOPBACK = ("127.0.0.1", "localhost", "::1")


class Listener(ThreadingHTTPServer):
    """A server that closes connections whose requests or answers take too long."""

    daemon_threads = True
    request_queue_size = WAITING
    explorer: Any

    def __init__(self, address: tuple[str, int], handler: type[BaseHTTPRequestHandler]) -> None:
        self._deadlines: dict[socket.socket, float] = {}
        super().__init__(address, handler)

    def get_request(self) -> tuple[socket.socket, Any]:
        connection, address = super().get_request()
        self.limit(connection)
        return connection, address

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
