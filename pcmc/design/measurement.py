"""What is measured on a surface: a value with its exact derivatives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..base.arrays import Floats


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
    """

    value: float
    by_position: Floats
    by_tension: Floats | None = None
    by_pressure: Floats | None = None
    by_load: Mapping[str, Floats] = field(default_factory=dict)

    def by(self, kind: str) -> Floats | None:
        """The derivatives by a kind of parameter."""
        direct = {"tension": self.by_tension, "pressure": self.by_pressure}
        if self.by_pressure is not None:
            direct["snow"] = -self.by_pressure
        return {**direct, **self.by_load}.get(kind)
