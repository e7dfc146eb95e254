"""Weights of patches, snow on them and tensions of cables that change in proportion to a parameter λ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..base.arrays import Floats
from ..base.errors import OptionError
from ..forces.functional import gradient_by, weighted
from ..forces.weight import moments
from ..surface import Surface
from ..surface.geometry import segment_lengths
from ..surface.values import wall_changes


@dataclass(frozen=True)
class Load:
    """A weight, snow or a cable's tension: value at the start, or (``Loads.line``) at λ = 0; its rate."""

    kind: str
    name: str
    index: int
    start: float
    rate: float


@dataclass(frozen=True)
class Loads:
    """The loads that vary."""

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

    def with_walls(self, surface: Surface, value: float) -> Loads:
        """The same with the snow of walls, which follows from that of the patches beside them.

        ``value`` is λ of the surface, at which they have the snow that they have there.
        """
        snows = {load.index: load.rate for load in self.parts if load.kind == "snow"}
        rates = np.zeros(len(surface.patches))
        rates[list(snows)] = list(snows.values())
        follow = wall_changes(surface, rates, snows)
        names = {surface.patches[k].name: float(follow[k]) for k in np.flatnonzero(follow)}
        walls = Loads.of(surface, {}, {}, names).parts
        at_zero = (replace(load, start=load.start - load.rate * value) for load in walls)
        return Loads((*self.parts, *at_zero))

    def check(self) -> None:
        """Refuse a cable of tension 0: from there on its curve would slide for nothing."""
        for load in self.parts:
            if load.kind == "cable" and load.start <= 0.0:
                message = f"the tension of the cable {load.name!r} is 0; start from one > 0"
                raise OptionError(message, what="parameter", where=load.name, found=load.start)

    def line(self, relative: bool) -> Loads:
        """These with their values at λ = 0 for those at the start, where λ is 0 if ``relative``."""
        return self if relative else Loads(tuple(replace(load, start=0.0) for load in self.parts))

    def values(self, value: float) -> Floats:
        """(l,) the values at λ."""
        return np.array([load.start + load.rate * value for load in self.parts])

    @property
    def rates(self) -> Floats:
        """(l,) the rates."""
        return np.array([load.rate for load in self.parts])

    def allow(self, value: float) -> bool:
        """Whether every cable still pulls at λ."""
        return all(
            load.kind != "cable" or pull > 0.0
            for load, pull in zip(self.parts, self.values(value), strict=True)
        )

    def at(self, value: float) -> dict[str, Any]:
        """The loads at λ as arguments of ``Surface.retensioned``."""
        kinds: dict[str, Any] = {"weights": {}, "snows": {}, "cables": {}}
        for load, load_value in zip(self.parts, self.values(value).tolist(), strict=True):
            kinds[f"{load.kind}s"][load.name] = load_value
        return kinds

    def columns(self, value: float) -> dict[str, float]:
        """The loads at λ as columns of a table."""
        names = [f"{load.kind} {load.name}" for load in self.parts]
        return dict(zip(names, self.values(value).tolist(), strict=True))

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
