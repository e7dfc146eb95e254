"""What is measured on a surface: a value with its exact derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ..base.arrays import Floats, Ints

TIE = 1e-6  # of a maximum's size: a change of parameters as small, relative, may bring another one to the top


class Branches(NamedTuple):
    """Quantities that a maximum is taken over: a row of derivatives for each.

    ``by_position`` (q,3n) is sparse; ``by`` has those by other kinds of numbers, such as "tension", (q,k).
    """

    by_position: csr_array
    by: Mapping[str, Floats] = {}

    @classmethod
    def of(cls, vertices: Ints, slopes: Floats, n: int, by: Mapping[str, Floats] | None = None) -> Branches:
        """Branches whose derivatives are ``slopes`` (q,p,3) at the ``vertices`` (q,p)."""
        column = (3 * vertices[:, :, None] + np.arange(3)).ravel()
        row = np.repeat(np.arange(len(vertices)), 3 * vertices.shape[1])
        return cls(csr_array((slopes.ravel(), (row, column)), shape=(len(vertices), 3 * n)), by or {})


@dataclass(frozen=True, eq=False)
class Measurement:
    """A quantity's value, and its derivatives.

    Attributes
    ----------
    value : of the quantity.
    by_position : (n,3).
    by_tension, by_pressure : (k,) by those of the patches; None where it depends on them only through the
        positions.
    by_load : the same by "weight", (k,), of the patches and by "cable", (c,), the tensions of the cables; by
        "snow", (k,), where that is not -``by_pressure``.
    ties : of a maximum, the branches that come within ``TIE`` of it, if there are several.
    """

    value: float
    by_position: Floats
    by_tension: Floats | None = None
    by_pressure: Floats | None = None
    by_load: Mapping[str, Floats] = field(default_factory=dict)
    ties: Branches | None = None

    def by(self, kind: str) -> Floats | None:
        """The derivatives by a kind of parameter."""
        direct = {"tension": self.by_tension, "pressure": self.by_pressure}
        if self.by_pressure is not None:
            direct["snow"] = -self.by_pressure
        return {**direct, **self.by_load}.get(kind)


def largest(values: Floats, size: float, branches: Callable[[Ints], Branches]) -> Measurement:
    """The largest of ``values``, of the usual ``size``; ``branches`` gives derivatives of some of them."""
    order = np.argsort(-values, kind="stable")
    near = order[values[order] >= values[order[0]] - TIE * size]
    found = branches(near)
    slope = found.by_position[[0]].toarray().reshape(-1, 3)
    first = {kind: rows[0] for kind, rows in found.by.items()}
    ties = found if len(near) > 1 else None
    return Measurement(float(values[order[0]]), slope, first.pop("tension", None), by_load=first, ties=ties)
