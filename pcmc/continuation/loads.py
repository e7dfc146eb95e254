"""Weights of patches, snow on them and tensions of cables that change in proportion to a parameter λ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..base.arrays import Floats
from ..base.errors import OptionError
from ..energy.functional import gradient_by, weighted
from ..energy.weight import moments
from ..surface import Surface
from ..surface.geometry import segment_lengths
from ..surface.wall_pressures import wall_pressure_changes


@dataclass(frozen=True)
class Load:
    """A weight, snow or a cable's tension: its value at the start, and its rate with λ."""

    kind: str
    name: str
    index: int
    start: float
    rate: float


@dataclass(frozen=True)
class Loads:
    """The loads that vary; ``change`` is that of λ since the start."""

    parts: tuple[Load, ...] = ()

    @classmethod
    def of(
        cls,
        surface: Surface,
        weights: Mapping[str, float],
        cables: Mapping[str, float],
        snows: Mapping[str, float],
    ) -> Loads:
        """Those of a surface, with their rates by the names of patches and cables."""
        parts = []
        for kind, rates in (("weight", weights), ("snow", snows)):
            for name, rate in rates.items():
                index = surface.patch_index(name)
                parts.append(Load(kind, name, index, getattr(surface.patches[index], kind), rate))
        for name, rate in cables.items():
            index = surface.cable_index(name)
            parts.append(Load("cable", name, index, surface.cables[index].tension, rate))
        return cls(tuple(parts))

    def with_walls(self, surface: Surface) -> Loads:
        """The same with the snow of walls, which follows from that of the patches beside them."""
        snows = {load.index: load.rate for load in self.parts if load.kind == "snow"}
        rates = np.zeros(len(surface.patches))
        rates[list(snows)] = list(snows.values())
        follow = wall_pressure_changes(surface, rates, snows)
        names = {surface.patches[k].name: float(follow[k]) for k in np.flatnonzero(follow)}
        return replace(self, parts=(*self.parts, *Loads.of(surface, {}, {}, names).parts))

    def check(self) -> None:
        """Refuse a cable of tension 0: from there on its curve would slide for nothing."""
        for load in self.parts:
            if load.kind == "cable" and load.start <= 0.0:
                message = f"the tension of the cable {load.name!r} is 0; start from one > 0"
                raise OptionError(message, what="parameter", where=load.name, found=load.start)

    @property
    def starts(self) -> Floats:
        """(l,) the values at the start."""
        return np.array([load.start for load in self.parts])

    @property
    def rates(self) -> Floats:
        """(l,) the rates."""
        return np.array([load.rate for load in self.parts])

    def allow(self, change: float) -> bool:
        """Whether every cable still pulls."""
        return all(load.kind != "cable" or load.start + load.rate * change > 0.0 for load in self.parts)

    def at(self, change: float) -> dict[str, Any]:
        """The loads as arguments of ``Surface.retensioned``."""
        values: dict[str, Any] = {"weights": {}, "snows": {}, "cables": {}}
        for load in self.parts:
            values[f"{load.kind}s"][load.name] = load.start + load.rate * change
        return values

    def columns(self, change: float) -> dict[str, float]:
        """The loads as columns of a table."""
        return {f"{load.kind} {load.name}": load.start + load.rate * change for load in self.parts}

    def energy_derivative(self, surface: Surface, X: Floats) -> float:
        """∂E/∂λ = Σ ẇ ∫ z dA + Σ ṡ V + Σ τ̇ L at X (n,3)."""
        total, one = 0.0, np.ones(len(surface.patches))
        for load in self.parts:
            if load.kind == "weight":
                total += load.rate * float(moments(surface, X, one)[load.index])
            elif load.kind == "snow":
                total += load.rate * float(weighted(surface, X=X)[1][load.index])
            else:
                total += load.rate * float(segment_lengths(X, surface.cables[load.index].edges).sum())
        return total

    def add_gradient(self, surface: Surface, X: Floats, gradient: Floats) -> Floats:
        """Add ∂∇E/∂λ, supports not applied, to ``gradient`` (n,3); returns it."""
        for load in self.parts:
            gradient += load.rate * gradient_by(surface, load.kind, load.index, X)
        return gradient
