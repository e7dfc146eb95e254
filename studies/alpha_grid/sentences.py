"""What Sec. 4.2 says of small and large tensions, each sentence beside the table of the grid."""

from __future__ import annotations

import math
from typing import Any

import pandas as pd

from .grid import AXES


def sentences(cases: pd.DataFrame) -> pd.DataFrame:
    """What Sec. 4.2 says of small and large α, each beside the table: confirmed or corrected.

    Every verdict is a comparison of two shares of cases.
    """
    wall, large, small = (cases[name] for name in AXES)
    ratio = (small / large).round(6)
    like = (ratio >= 0.6) & (ratio <= 1.7)
    low = (large <= 3.0) | (small <= 2.0)  # no more than half the radius of its disc
    patches = ~low & cases.balanced

    def share(of: pd.Series[bool], among: pd.Series[bool]) -> float:
        return float(of[among].mean()) if among.any() else math.nan

    rested = cases.equilibrium & (cases.pinched > 0)
    rows = [
        _sentence(
            "α of the auxiliary patch: no adverse effect on convergence if it is small",
            "share well converged, wall ≤ 2, equal patches above the fold",
            share(cases.near, (wall <= 2.0) & ~low & (ratio == 1.0)),
            "the same, unequal patches",
            share(cases.near, (wall <= 2.0) & ~low & (ratio != 1.0)),
            lambda a, b: b >= a,
            "it holds for equal patches; a wall weaker than the difference of their tensions leaves"
            " no equilibrium to converge to",
        ),
        _sentence(
            "if it is too large, the area of the auxiliary patch will approach 0",
            "share of the equilibria whose wall rests on the plane somewhere, wall ≥ 8",
            share(rested, (wall >= 8.0) & cases.equilibrium),
            "the same, wall ≤ 2",
            share(rested, (wall <= 2.0) & cases.equilibrium),
            lambda a, b: a > b,
            "",
        ),
        _sentence(
            "... causing instability in the analysis due to shape distortion",
            "share well converged of the equilibria, wall ≥ 8",
            share(cases.near, (wall >= 8.0) & cases.equilibrium),
            "the same, wall ≤ 4",
            share(cases.near, (wall <= 4.0) & cases.equilibrium),
            lambda a, b: a < b,
            "",
        ),
        _sentence(
            "well-converged solutions especially when α of the smaller patch is slightly smaller",
            "share well converged, α_small / α_large from 0.6 to below 1",
            share(cases.near, (ratio >= 0.6) & (ratio < 1.0)),
            "the same, equal α",
            share(cases.near, ratio == 1.0),
            lambda a, b: a > b,
            "equal tensions converge more often; slightly smaller ones only with a wall that is"
            " stronger than the difference",
        ),
        _sentence(
            "the convergence worsened when the α of the two patches were too different",
            "share well converged, ratio below 0.6 or above 1.7",
            share(cases.near, ~like),
            "the same, ratio between",
            share(cases.near, like),
            lambda a, b: a < b,
            "",
        ),
        _sentence(
            "... (and so does existence: share of cases with an equilibrium)",
            "ratio below 0.6 or above 1.7, above the fold and balanced",
            share(cases.equilibrium, patches & ~like),
            "the same, ratio between",
            share(cases.equilibrium, patches & like),
            lambda a, b: a < b,
            "",
        ),
        _sentence(
            "the process diverged due to over-inflation when too small α was assigned",
            "share of × where a patch has α ≤ half its radius",
            share(cases.crossed, low),
            "the same, elsewhere",
            share(cases.crossed, ~low),
            lambda a, b: a > b,
            "",
        ),
    ]
    return pd.DataFrame(rows)


def _sentence(
    says: str, what: str, ours: float, against: str, other: float, holds: Any, correction: str
) -> dict[str, Any]:
    """A sentence beside two numbers; where the relation fails, what is true instead."""
    if math.isnan(ours) or math.isnan(other):
        verdict = "no such cases"
    else:
        verdict = "confirmed" if holds(ours, other) else "corrected"
    return {
        "paper": says,
        "measured": what,
        "value": ours,
        "against": against,
        "other": other,
        "verdict": verdict,
        "instead": correction if verdict == "corrected" else "",
    }
