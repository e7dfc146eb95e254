"""Where stability and pressure turn: lengths of tubes of given volume, and the fold of a cap."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import brentq

import generators
from pcmc import Direction, Parameter, Room, Surface, Target, follow, sensitivities, solve
from pcmc.base.arrays import Floats

from .cases import tube

LENGTHS = {"plates": np.pi, "rings": 2.0 * np.pi}  # over the radius
ALPHA, VOLUMES = 0.6, (0.5, 6.0)  # of the cap over the unit disc
HEMISPHERE = 2.0 * np.pi / 3.0  # its volume where the pressure is largest
EDGES = 0.6, 0.3, 0.15  # of the tubes
CAP_EDGES = 0.4, 0.2, 0.1


def lengths(short: bool) -> pd.DataFrame:
    """``length`` at which the lowest eigenvalue of a tube of prescribed volume is 0, and theory's."""
    rows = []
    for between, limit in LENGTHS.items():
        for edge_length in EDGES[: 1 if short else None]:
            span = 0.95 * limit, 1.01 * limit
            found = brentq(_softest, *span, args=(edge_length, between), xtol=1e-6)
            rows.append({"between": between, "edge_length": edge_length, "length": found, "theory": limit})
    return pd.DataFrame(rows).round(6)


def _softest(length: float, edge_length: float, between: str) -> float:
    """The lowest eigenvalue of the tube of this length, among motions that keep its volume."""
    certificate = solve(tube(edge_length, length, between), target="stationary").certificate
    return float(certificate.eigenvalues[0])


def cap(volume: float, edge_length: float) -> Surface:
    """A cap over the unit disc of prescribed volume."""
    start = generators.spherical_cap(edge_length, alpha=ALPHA)
    return replace(start, rooms=(Room("room", (("cap", 1),), volume),))


def cap_pressure(volume: Floats) -> Floats:
    """p = 4 α h / (1 + h²) of caps of these volumes, V = π h (3 + h²) / 6.

    >>> round(float(cap_pressure(np.array([HEMISPHERE]))[0]), 12)
    1.2
    """
    heights = [np.roots([1.0, 0.0, 3.0, -6.0 * v / np.pi]).real.max() for v in np.ravel(volume)]
    h = np.array(heights)
    return 4.0 * ALPHA * h / (1.0 + h**2)


def branches(short: bool) -> pd.DataFrame:
    """Pressure and index of caps along their volume, from a flat one to far beyond the hemisphere."""
    tables = []
    for edge_length in CAP_EDGES[: 1 if short else None]:
        start = solve(cap(VOLUMES[0], edge_length)).surface
        branch = follow(start, Direction(volumes={"room": 1.0}), VOLUMES[1], largest=0.3)
        points = branch.points[["volume room", "pressure room", "index"]]
        points = points.rename(columns={"volume room": "volume", "pressure room": "pressure"})
        tables.append(points.assign(edge_length=edge_length, ending=branch.ending.name.lower()))
    table = pd.concat(tables, ignore_index=True)
    return table.assign(exact=cap_pressure(table.volume.to_numpy())).round(6)


def folds(short: bool) -> pd.DataFrame:
    """Volume and pressure where dp/dV = 0: the hemisphere's, of order 2."""
    rows: list[dict[str, Any]] = []
    for edge_length in CAP_EDGES[: 1 if short else None]:
        start = solve(cap(HEMISPHERE, edge_length)).surface

        def slope(volume: float, start: Surface = start) -> float:
            there = solve(start.retensioned(volumes={"room": volume})).surface
            table = sensitivities(there, Target("pressure", "room"), Parameter("room", "volume"))
            return float(table.to_numpy()[0, 0])

        volume = brentq(slope, 0.9 * HEMISPHERE, 1.1 * HEMISPHERE, xtol=1e-6)
        pressure = float(solve(start.retensioned(volumes={"room": volume})).surface.pressures[0])
        rows.append({"edge_length": edge_length, "volume": volume, "pressure": pressure})
    return pd.DataFrame(rows).round(6)
