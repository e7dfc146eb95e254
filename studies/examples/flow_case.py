"""One case of Fig. 16's grid, apart from its study: what a worker need not import, it need not wait for.

Each worker reads the initial mesh, for to make it takes a large part of scipy.
"""

from __future__ import annotations

import pickle
from functools import cache
from pathlib import Path
from typing import Any

from pcmc import Surface, solve

PAPER = {"gamma": 0.9, "xi": 0.2, "tau": 0.5, "floor_power": 5}  # Secs. 3.3, 3.4
T0 = 0.01


def flow_case(
    mesh: str, alpha_wall: float, alpha_large: float, alpha_small: float, iterations: int
) -> dict[str, Any]:
    """How the paper's flow from a mesh ends at three tensions; one case of the sweep."""
    surface = initial(mesh).retensioned({"wall": alpha_wall, "large": alpha_large, "small": alpha_small})
    options: dict[str, Any] = {**PAPER, "t0": T0, "tolerance": None, "iterations": iterations}
    result = solve(surface, "nesterov", **options)
    return {
        "status": result.status.name.lower(),
        "iterations_taken": result.iterations,
        "gradient_squared": result.rows[-1]["gradient_squared"],
        "energy": result.energy,
        "forced_steps": sum(not row["armijo_held"] for row in result.rows),
    }


@cache
def initial(mesh: str) -> Surface:
    """The surface in the file ``mesh``, read once for all the cases of a worker."""
    surface: Surface = pickle.loads(Path(mesh).read_bytes())
    return surface
