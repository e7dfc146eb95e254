"""A parameter λ of a surface, on which its tensions, pressures and prescribed volumes depend linearly.

    α_i(λ) = a_i + w_i λ,    p_i(λ) = b_i + u_i λ,    V̄_r(λ) = c_r + v_r λ

and in the same way weights, snow and the tensions of cables. E is linear in all but the volumes, so
∂E/∂λ = Σ w_i A_i - Σ (u_i - ṡ_i) V_i + Σ ẇ_i ∫ z dA + Σ τ̇_c L_c, whatever λ is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import OptionError
from ..forces.functional import apply_supports, weighted
from ..forces.rooms import prescribed_volumes, refuse_varied_pressure
from ..surface import Surface
from ..surface.values import wall_changes
from .loads import Loads

KINDS = ("tensions", "pressures", "volumes", "weights", "snows", "cables")
SAME_VALUE = 1e-9  # relative difference up to which two tensions give the same λ


@dataclass(frozen=True)
class Direction:
    """Which tensions, pressures and prescribed volumes change with λ, and how fast.

    Parameters
    ----------
    tensions : weight w_i by patch name.
    pressures : weight u_i by patch name. The pressure of a wall that is not named changes with the
        difference between its rooms, as in ``Surface.retensioned``. Snow stays.
    weights, snows : rates of the self-weight and of the snow by patch name; walls under snow follow, too.
    cables : rate of the tension by the cable's name.
    volumes : weight v_r by the name of a room of prescribed volume, whose pressure is a result.
    relative : False: α_i = w_i λ, so that with ``{"roof": 1.0}`` λ is the tension of "roof" itself.
        True: α_i = α_i(start) + w_i λ, so that λ = 0 at the start. The same for pressures and volumes.

    Examples
    --------
    The tension of one patch; of two walls together; a pressure; the ratio p/α of a patch of tension 2:

    >>> roof, walls = Direction({"roof": 1.0}), Direction({"wall 1": 1.0, "wall 2": 1.0})
    >>> load, ratio = Direction(pressures={"roof": 1.0}), Direction(pressures={"roof": 2.0})
    """

    tensions: Mapping[str, float] = field(default_factory=dict)
    pressures: Mapping[str, float] = field(default_factory=dict)
    relative: bool = False
    volumes: Mapping[str, float] = field(default_factory=dict)
    weights: Mapping[str, float] = field(default_factory=dict)
    snows: Mapping[str, float] = field(default_factory=dict)
    cables: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for key in KINDS:
            weights = getattr(self, key)
            if not isinstance(weights, Mapping):
                validate.refuse(f"Direction.{key}", weights, "weights by name, such as {'roof': 1.0}")
            for name, weight in weights.items():
                if validate.number(f"Direction.{key}", weight, where=name) == 0.0:
                    validate.refuse(f"Direction.{key}", weight, "a weight other than 0", name)
        if not any(getattr(self, key) for key in KINDS):
            message = "Direction: name at least one patch whose tension or pressure varies, a room or a cable"
            raise OptionError(message, what="Direction")

    @classmethod
    def ratio(cls, surface: Surface, upper: str, lower: str) -> Direction:
        """λ = α_upper / α_lower; the tension of ``lower`` stays as it is in ``surface``."""
        denominator = surface.patches[surface.patch_index(lower)].tension
        surface.patch_index(upper)
        if denominator == 0.0:
            message = f"Direction.ratio: the tension of {lower!r} is 0, so no ratio to it exists"
            raise OptionError(message, what="lower", found=lower)
        return cls({upper: denominator})

    def line(self, surface: Surface) -> ParameterLine:
        """The tensions and pressures along this direction, starting from those of a surface."""
        w, u = _rates(surface, self.tensions), _rates(surface, self.pressures)
        v = _volume_rates(surface, self.volumes)
        loads = Loads.of(surface, self.weights, self.cables, self.snows)
        value = 0.0 if self.relative else _common_value(surface, w, u, v, loads)
        followed = wall_changes(surface, u, {surface.patch_index(name) for name in self.pressures})
        # zero, and not only to rounding: so a value of λ that is asked for gives exactly the values named
        a, b, c = (
            values if self.relative else np.where(rates != 0.0, 0.0, values)
            for values, rates in (
                (surface.tensions, w),
                (surface.pressures - followed * value, u),
                (prescribed_volumes(surface), v),
            )
        )
        u = u + followed
        refuse_varied_pressure(surface, np.flatnonzero(u))
        if not (surface.tensions[w != 0.0] > 0.0).all():
            name = surface.patches[int(np.argmax((w != 0.0) & (surface.tensions <= 0.0)))].name
            message = f"the tension of {name!r} is 0, where its triangles stop pulling; start from one > 0"
            raise OptionError(message, what="parameter", where=name, found=0.0)
        loads.check()
        loads = loads.line(self.relative).with_walls(surface, value)
        surface.retensioned(snows=loads.at(value + 1.0)["snows"])  # refuses snow beside free edges
        return ParameterLine(value, a, b, w, u, c, v, loads)


@dataclass(frozen=True, eq=False)
class ParameterLine:
    """The tensions, pressures and volumes of a surface as functions of λ: a ``Direction`` with its start.

    Attributes
    ----------
    value : λ of that surface.
    tensions, pressures : (k,) a and b, those at λ = 0.
    tension_rates, pressure_rates : (k,) w and u.
    volumes, volume_rates : (r,) c, the volumes of the rooms at λ = 0, and v.
    loads : the weights, the snow and the tensions of cables that vary.
    """

    value: float
    tensions: Floats
    pressures: Floats
    tension_rates: Floats
    pressure_rates: Floats
    volumes: Floats = field(default_factory=lambda: np.zeros(0))
    volume_rates: Floats = field(default_factory=lambda: np.zeros(0))
    loads: Loads = field(default_factory=lambda: Loads(()))

    @cached_property
    def scale(self) -> float:
        """The size of λ in the metric of arclength: what varies over its weights."""
        w, u, v = self.tension_rates, self.pressure_rates, self.volume_rates
        tensions = (self.tensions + w * self.value)[w != 0.0]
        pressures = (self.pressures + u * self.value)[u != 0.0]
        volumes = (self.volumes + v * self.value)[v != 0.0]
        loads, rates = self.loads.values(self.value), self.loads.rates
        size = np.linalg.norm(np.concatenate([tensions, pressures, volumes, loads]))
        return float(size / np.linalg.norm(np.concatenate([w, u, v, rates]))) or 1.0

    def allows(self, value: float) -> bool:
        """Whether every varied tension is still positive at λ."""
        w = self.tension_rates
        pulling = bool(((self.tensions + w * value)[w != 0.0] > 0.0).all())
        return pulling and self.loads.allow(value)

    def surface_at(self, surface: Surface, value: float) -> Surface:
        """The surface with its tensions, pressures and prescribed volumes at λ."""
        names = [p.name for p in surface.patches]
        w, u = self.tension_rates, self.pressure_rates
        return surface.retensioned(
            {names[i]: self.tensions[i] + w[i] * value for i in np.flatnonzero(w)},
            {names[i]: self.pressures[i] + u[i] * value for i in np.flatnonzero(u)},
            walls=[names[i] for i in self._followed() if surface.walls[i]],
            volumes=self._varied_volumes(surface, value),
            **self.loads.at(value),
        )

    def _followed(self) -> list[int]:
        """The patches whose pressure or snow varies."""
        snowy = [load.index for load in self.loads.parts if load.kind == "snow"]
        return [*np.flatnonzero(self.pressure_rates).tolist(), *snowy]

    def _varied_volumes(self, surface: Surface, value: float) -> dict[str, float]:
        """The volumes that vary, at λ, by the names of their rooms."""
        volumes = self.volumes + self.volume_rates * value
        return {surface.rooms[r].name: float(volumes[r]) for r in np.flatnonzero(self.volume_rates)}

    def columns(self, surface: Surface, value: float) -> dict[str, float]:
        """The varied tensions and pressures at λ, as columns of a table."""
        columns = {}
        for i, patch in enumerate(surface.patches):
            if self.tension_rates[i]:
                columns[f"tension {patch.name}"] = self.tensions[i] + self.tension_rates[i] * value
            if self.pressure_rates[i]:
                columns[f"pressure {patch.name}"] = self.pressures[i] + self.pressure_rates[i] * value
        for name, volume in self._varied_volumes(surface, value).items():
            columns[f"volume {name}"] = volume
        return columns | self.loads.columns(value)

    def boundary(self, value: float) -> None:
        """No fixed vertex moves."""

    def velocity(self, value: float) -> None:
        """No fixed vertex moves."""

    def energy_derivative(self, surface: Surface, X: Floats, value: float) -> float:
        """∂E/∂λ = Σ w_i A_i - Σ u_i V_i at X (n,3)."""
        areas, volumes, _ = weighted(surface, X=X)
        own = float(self.tension_rates @ areas - self.pressure_rates @ volumes)
        return own + self.loads.energy_derivative(surface, X)

    def gradient(self, surface: Surface, X: Floats) -> Floats:
        """∂∇E/∂λ = Σ w_i ∇A_i - Σ u_i ∇V_i (n,3), with that of the loads, supports applied."""
        own = weighted(surface, self.tension_rates, self.pressure_rates, X)[2]
        return apply_supports(surface, self.loads.add_gradient(surface, X, own), X)


def _rates(surface: Surface, weights: Mapping[str, float]) -> Floats:
    rates = np.zeros(len(surface.patches))
    for name, weight in weights.items():
        rates[surface.patch_index(name)] = weight
    return rates


def _volume_rates(surface: Surface, weights: Mapping[str, float]) -> Floats:
    names = [room.name for room in surface.rooms]
    rates = np.zeros(len(names))
    for name, weight in weights.items():
        rates[names.index(validate.choice("room", name, names))] = weight
    return rates


def _common_value(surface: Surface, w: Floats, u: Floats, v: Floats, loads: Loads) -> float:
    """λ of the surface; everything that is named must agree on it."""
    sources = (
        ("tension", surface.patches, surface.tensions, w),
        ("pressure", surface.patches, surface.pressures, u),
        ("volume", surface.rooms, prescribed_volumes(surface), v),
    )
    given = [
        (f"{kind} of {parts[i].name!r}", values[i] / rates[i])
        for kind, parts, values, rates in sources
        for i in np.flatnonzero(rates)
    ]
    given += [(f"{load.kind} of {load.name!r}", load.start / load.rate) for load in loads.parts]
    (first, value), *others = given
    for name, other in others:
        if abs(other - value) > SAME_VALUE * max(abs(value), abs(other)):
            message = f"the {first} makes the parameter {value:g}, the {name} makes it {other:g}"
            hint = "give weights in proportion to the surface's own values, or relative=True"
            raise OptionError(
                f"{message}: {hint}", what="parameter", where=name, found=float(other), expected=float(value)
            )
    return float(value)
