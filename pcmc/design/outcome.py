"""How a search for targets ended, and the surface that it found."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import pandas as pd

from ..base.errors import SurfaceError
from ..base.units import NO_UNITS, Units
from ..certificate.certificate import Certificate
from ..solvers.result import Result
from ..surface import Surface
from ..surface.pieces import two_digits


class DesignStatus(Enum):
    """How a search for targets ended. The value is a sentence.

    >>> DesignStatus.MET.value
    'met: every target is reached'
    """

    MET = "met: every target is reached"
    AT_BOUND = "out of reach: a bound on the parameters is in the way"
    AT_FOLD = "out of reach: beyond these parameters no equilibrium was found"
    CONFLICT = "out of reach: no values of these parameters meet all targets"
    SOLVES = "not met: stopped at the limit of solves"
    STOPPED = "not met: stopped on request; the returned surface is the best so far"


def values_text(table: pd.DataFrame, units: Units = NO_UNITS) -> str:
    """The values of targets or parameters in words, such as "apex of roof 1.2 m".

    >>> table = {"value": [1.2, 3.0], "dimension": ["length", "tension"]}
    >>> values_text(pd.DataFrame(table, index=["apex of roof", "tension of roof"]), Units("m", "kN"))
    'apex of roof 1.2 m, tension of roof 3 kN/m'
    """
    rows = zip(table.index, table["value"], table["dimension"], strict=True)
    return ", ".join(f"{label} {value:.6g}{units.behind(dimension)}" for label, value, dimension in rows)


class NoStart(SurfaceError):
    """There is no equilibrium to start a search for targets from; the message says why."""


@dataclass(frozen=True, eq=False, repr=False)
class Design:
    """The end of a search for targets. Every value describes exactly ``surface``.

    Attributes
    ----------
    status : how the search ended.
    result : of the solve that gave ``surface``. If the search was stopped before any equilibrium was
        found, ``surface`` is the one given.
    targets : a row per target: ``value``, its ``dimension`` (the unit, as a name of ``Units``), ``wanted``,
        relative ``misfit``, ``met``, and ``limit``, the nearest reachable value (at a fold, which is only
        approached, extrapolated; NaN where the search stopped before it was known).
    parameters : a row per parameter: ``start``, ``value``, ``dimension``, ``low``, ``high``.
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

    def __repr__(self) -> str:
        """How the search ended, what it reached and with what, above the surface."""
        values = f"  targets: {values_text(self.targets)}\n  parameters: {values_text(self.parameters)}"
        return f"{self.message}\n{values}\n  {self.solves} solves\n{self.surface!r}"

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
        """``text`` without units."""
        return self.text()

    def values(self, units: Units = NO_UNITS) -> str:
        """The values of the targets, and those of the parameters with which they are met."""
        return ", with ".join(values_text(table, units) for table in (self.targets, self.parameters))

    def text(self, units: Units = NO_UNITS) -> str:
        """A sentence, with the nearest reachable value of each target that is not met."""
        text = self.status.value
        missed = self.targets[~self.targets["met"]]
        for label, row in missed.iterrows():
            limit, wanted, unit = row["limit"], row["wanted"], units.behind(row["dimension"])
            reached = f"so far {row['value']:.6g}{unit}"
            if not math.isnan(limit):
                reached = f"nearest reachable {limit:.6g}{unit}"
            if wanted and not math.isnan(limit):
                away = 100.0 * (limit - wanted) / abs(wanted)
                reached += f", {two_digits(abs(away)):g} % {'more' if away > 0.0 else 'less'}"
            text += f"; {label}: wanted {wanted:.6g}{unit}, {reached}"
        if len(missed):
            text += f" ({values_text(self.parameters, units)})"
            why = self.reason.split(";")[0]  # what follows is advice for tensions that are given, not sought
            text += f"; a step further, {why}" if why else ""
        number, count = len(self.targets), len(self.parameters)
        if self.status is DesignStatus.CONFLICT and number > count:
            varied = " ".join(map(str, self.parameters.index))
            others = [repr(p.name) for p in self.surface.patches if p.pressure and p.name not in varied]
            such = f", such as {' or '.join(others)}" if others else ""
            text += f"; {number} targets need {number} parameters, and {count} may vary: add to vary{such}"
        return text
