"""Plain HTTP to a running explorer."""

from __future__ import annotations

import http.client
import json
from typing import Any

from pcmc.explore.listening import unpack


def asked(explorer: Any, method: str, path: str, body: str | None = None, **headers: str) -> Any:
    """An answer and its body."""
    line = http.client.HTTPConnection("127.0.0.1", explorer.port, timeout=60)
    line.request(method, path, body, {"X-Token": explorer.token} | headers)
    answer = line.getresponse()
    content = answer.read()
    line.close()
    return answer, content


class Client:
    """The page's side of a running explorer."""

    def __init__(self, explorer: Any) -> None:
        self.explorer = explorer

    def raw(self, method: str, path: str, body: str | None = None, **headers: str) -> Any:
        """An answer and its body."""
        return asked(self.explorer, method, path, body, **headers)

    def ask(self, path: str, values: object = None, status: int = 200) -> Any:
        """Header and arrays of an answer; the error where another status is expected."""
        answer, body = self.raw("POST", path, json.dumps(values or {}))
        assert answer.status == status, body
        return unpack(body) if status == 200 else json.loads(body)["error"]
