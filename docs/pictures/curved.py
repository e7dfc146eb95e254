"""How wrong the energy of a cap is after how many seconds, with flat triangles and with curved elements."""

import time
from pathlib import Path

import numpy as np

from pcmc import solve
from pcmc.plan import Plan, circle
from pcmc.plot import convergence

EDGES = {
    1: (0.3, 0.15, 0.07, 0.035, 0.0175, 0.009),
    2: (0.5, 0.3, 0.15, 0.07, 0.035),
    4: (0.5, 0.3, 0.15),
    8: (0.7, 0.5),
}
LEAST = 1e-13  # of the energy: below is rounding
TENSION, RADIUS = 0.6, 1.2

height = RADIUS - np.sqrt(RADIUS**2 - 1.0)
exact = TENSION * 2.0 * np.pi * RADIUS * height - np.pi * height**2 * (3.0 * RADIUS - height) / 3.0
curves = {}
for order, edges in EDGES.items():
    times, errors = [], []
    for edge in (edges[0], *edges):  # the first loads compiled code
        start = Plan(circle([0, 0], 1.0), edge_length=edge, patches={"roof": {"tension": TENSION}}).surface()
        begin = time.process_time()
        result = solve(start, order=order)
        times.append(time.process_time() - begin)
        errors.append(max(abs(result.energy / exact - 1.0), LEAST))
    curves[f"order {order}"] = (times[1:], errors[1:])
convergence(
    curves,
    Path("curved.png"),
    x="processor time, s",
    y="relative error of the energy",
    title="a cap over a circle, solved from a plan",
    fit=False,
)
