"""How a search for targets ended, and the surface that it found."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import pandas as pd

from ..base.errors import SurfaceError
from ..certificate.certificate import Certificate
from ..solvers.result import Result
from ..surface import Surface


class DesignStatus(Enum):
    """How a search for targets ended. The value is a sentence."""

    MET = "met: every target is reached"
    AT_BOUND = "out of reach: a bound on the parameters is in the way"
    AT_FOLD = "out of reach: beyond these parameters no equilibrium was found"
    CONFLICT = "out of reach: no values of these parameters meet all targets"
    SOLVES = "not met: stopped at the limit of solves"
    STOPPED = "not met: stopped on request; the returned surface is the best so far"


class NoStart(SurfaceError):
    """There is no equilibrium to start a search for targets from; the message says why."""


@dataclass(frozen=True, eq=False)
class Design:
    """The end of a search for targets. Every value describes exactly ``surface``.

    Attributes
    ----------
    status : how the search ended.
    result : of the solve that gave ``surface``. If the search was stopped before any equilibrium was
        found, ``surface`` is the one given.
    targets : a row per target: ``value``, ``wanted``, relative ``misfit``, ``met``, and ``limit``, the
        nearest reachable value (at a fold, which is only approached, extrapolated; NaN where the search
        stopped before it was known).
    parameters : a row per parameter: ``start``, ``value``, ``low``, ``high``.
    solves : number of solves.
    history : a row per point tried: parameters, quantities, status, misfit. The status is the solve's
        in small letters, or ``"overloaded"`` if the load is more than the tension of the boundary could
        carry and no solve was tried.
    reason : why there was no equilibrium at the last point that was tried and failed; empty if none did.
    """

    status: DesignStatus
    result: Result
    targets: pd.DataFrame
    parameters: pd.DataFrame
    solves: int
    history: pd.DataFrame
    reason: str = ""

    @property
    def met(self) -> bool:
        """Whether every target is met."""
        return self.status is DesignStatus.MET

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
        text = self.status.value
        missed = self.targets[~self.targets["met"]]
        for label, row in missed.iterrows():
            known = not math.isnan(row["limit"])
            reached = f"nearest reachable {row['limit']:.6g}" if known else f"so far {row['value']:.6g}"
            text += f"; {label}: wanted {row['wanted']:.6g}, {reached}"
        if len(missed):
            values = (f"{name} {value:.6g}" for name, value in self.parameters["value"].items())
            text += f" ({', '.join(values)})"
            text += f"; a step further, {self.reason}" if self.reason else ""
        return text
