"""How fast the explore page follows a slider: from a value asked for to the answer, over the network."""

from __future__ import annotations

import http.client
import json
import time

import numpy as np

from generators import bezier_hall
from pcmc import Surface
from pcmc.explore import start
from pcmc.explore.listening import unpack

from .timing import Row

LENGTH, FEW = 3.5, 16.0  # edge lengths: of 3 000 triangles, and of few
STEPS = 40
ASKED = 150.0  # ms


def slider(quick: bool) -> list[Row]:
    """Every answer while the tensions of one wall and of all bays are drawn to and fro."""
    surface = bezier_hall(edge_length=FEW if quick else LENGTH)
    names = [patch.name for patch in surface.patches if not patch.auxiliary]
    wall = next(patch for patch in surface.patches if patch.auxiliary)
    sway = np.sin(np.linspace(0.0, 2.0 * np.pi, STEPS))
    asked = [{wall.name: wall.tension * (1.0 + 0.5 * part)} for part in sway]
    asked += [dict.fromkeys(names, 30.0 * 1.2**part) for part in sway]
    times = 1e3 * np.array(answers(surface, asked))
    remark = f"{surface.m:,} triangles, server and network"
    return [
        Row("slider followed", float(np.median(times)), "ms", remark, most=ASKED),
        Row("slider followed, 95 of 100 within", float(np.percentile(times, 95)), "ms", remark, most=ASKED),
        Row("slider followed, slowest", float(times.max()), "ms", remark),
    ]


def answers(surface: Surface, asked: list[dict[str, float]]) -> list[float]:
    """Seconds until each answer, after a first one that is not counted."""
    explorer = start(surface)
    line = http.client.HTTPConnection("127.0.0.1", explorer.port, timeout=60)
    try:
        token = explorer.token
        name = unpack(_post(line, token, "/api/open", {}))[0]["session"]
        seconds = []
        for tensions in [asked[0], *asked]:
            begun = time.perf_counter()
            header, _ = unpack(_post(line, token, f"/api/{name}/follow", {"tensions": tensions}))
            seconds.append(time.perf_counter() - begun)
            assert header["at_rest"], header["verdict"]
        return seconds[1:]
    finally:
        line.close()
        explorer.close()


def _post(line: http.client.HTTPConnection, token: str, path: str, body: object) -> bytes:
    line.request("POST", path, json.dumps(body), {"X-Token": token})
    return line.getresponse().read()


EXPLORE = [slider]
