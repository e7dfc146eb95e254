"""How a search for targets ended, and what it found."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import pandas as pd

from ..certificate.certificate import Certificate
from ..solvers.result import Result
from ..surface import Surface


class Reach(Enum):
    """How a search for targets ended. The value is a sentence."""

    MET = "met: every target is reached"
    AT_BOUND = "out of reach: a bound on the parameters is in the way"
    AT_FOLD = "out of reach: beyond these parameters no equilibrium was found"
    CONFLICT = "out of reach: no values of these parameters meet all targets"
    SOLVES = "not met: stopped at the limit of solves"
    STOPPED = "not met: stopped on request; the returned surface is the best so far"


@dataclass(frozen=True, eq=False)
class Design:
    """The end of a search for targets. Every value describes exactly ``surface``.

    Attributes
    ----------
    reach : how it ended.
    result : of the solve that gave ``surface``; that is the one given where the search was stopped
        before any equilibrium was found.
    targets : a row per target: ``found``, ``wanted``, relative ``misfit``, ``met``, and ``limit``, the
        nearest reachable value (at a fold, where it is only approached, extrapolated; NaN where the
        search was stopped before it knew).
    parameters : a row per parameter: ``start``, ``value``, ``low``, ``high``.
    solves : how many surfaces were solved for.
    history : a row per point tried: parameters, quantities, status, misfit. The status is the solve's
        in small letters, or ``"overloaded"`` where none was tried: the load is more than the
        boundary's tension could carry.
    """

    reach: Reach
    result: Result
    targets: pd.DataFrame
    parameters: pd.DataFrame
    solves: int
    history: pd.DataFrame

    @property
    def met(self) -> bool:
        """Whether every target is met."""
        return self.reach is Reach.MET

    @property
    def surface(self) -> Surface:
        """The surface that meets the targets, or comes nearest."""
        return self.result.surface

    @property
    def certificate(self) -> Certificate:
        """The certificate of ``surface``."""
        return self.result.certificate

    @property
    def message(self) -> str:
        """A sentence, with the nearest reachable value of each target that is not met."""
        text = self.reach.value
        missed = self.targets[~self.targets["met"]]
        for label, row in missed.iterrows():
            known = not math.isnan(row["limit"])
            reached = (
                f"nearest reachable {row['limit']:.6g}" if known else f"so far {row['found']:.6g}"
            )
            text += f"; {label}: wanted {row['wanted']:.6g}, {reached}"
        if len(missed):
            values = (f"{name} {value:.6g}" for name, value in self.parameters["value"].items())
            text += f" ({', '.join(values)})"
        return text
