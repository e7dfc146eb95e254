"""A parameter λ of a surface: its tensions, pressures and prescribed volumes depend linearly on λ,

    α_i(λ) = a_i + w_i λ,    p_i(λ) = b_i + u_i λ,    V̄_r(λ) = c_r + v_r λ,

and so do weights, snow, and the tensions and weights of cables; or λ moves its boundary, P(λ).

Then the inside follows harmonically, so that triangles keep their shape: a change of P by d moves the
vertices by w, L w = 0 inside and w = d at the fixed ones, L the cotangent Laplacian. With v the w of dP/dλ,

    dr/dλ = Bᵀ Df[v],    dE/dλ = Σ ⟨∇E, dP/dλ⟩ over the fixed vertices,

f the forces that ``jacobian`` linearises.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ...base import validate
from ...base.arrays import Floats
from ...base.errors import OptionError
from ...base.tolerances import ON, ON_BRANCH
from ...forces.functional import Rates, by_rates, energy_and_gradient
from ...forces.rooms import refuse_varied_pressure
from ...surface import Surface
from ...surface.supports import apply_supports
from ...surface.values import KINDS, part_index, part_values, rates_of

VARIED = ("tensions", "pressures", "volumes", "weights", "snows", "cables", "cable_weights")
DIFFERENCE = 1e-5  # of the size of λ: step of the central difference for dP/dλ


@dataclass(frozen=True)
class Direction:
    """Which tensions, pressures and prescribed volumes change with λ, and how fast.

    Parameters
    ----------
    tensions : weight w_i by patch name.
    pressures : weight u_i by patch name. The pressure of a wall that is not named changes with the
        difference between its rooms, as in ``Surface.retensioned``. Snow stays.
    weights, snows : rates of the self-weight and of the snow by patch name; walls under snow follow, too.
    cables, cable_weights : rates of the tension and of the weight per length by the cable's name.
    volumes : weight v_r by the name of a room of prescribed volume, whose pressure is a result.
    relative : False: α_i = w_i λ, so that with ``{"roof": 1.0}`` λ is the tension of "roof" itself.
        True: α_i = α_i(start) + w_i λ, so that λ = 0 at the start. The same for all others.

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
    cable_weights: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for kind in VARIED:
            weights = getattr(self, kind)
            if not isinstance(weights, Mapping):
                validate.refuse(f"Direction.{kind}", weights, "weights by name, such as {'roof': 1.0}")
            for name, weight in weights.items():
                if validate.number(f"Direction.{kind}", weight, where=name) == 0.0:
                    validate.refuse(f"Direction.{kind}", weight, "a weight other than 0", name)
        if not self.named:
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

    @property
    def named(self) -> dict[str, Mapping[str, float]]:
        """The weights by kind and name."""
        return {kind: getattr(self, kind) for kind in VARIED if getattr(self, kind)}

    def line(self, surface: Surface) -> ParameterLine:
        """The values along this direction, starting from those of a surface."""
        rates = {kind: rates_of(surface, kind, weights) for kind, weights in self.named.items()}
        value = 0.0 if self.relative else self._common_value(surface)
        start = {}
        for kind, of_kind in rates.items():
            start[kind] = part_values(surface, kind) - of_kind * value
            if not self.relative:
                # not only to rounding: so a value of λ that is asked for gives exactly the values named
                start[kind][[part_index(surface, kind, name) for name in self.named[kind]]] = 0.0
        line = ParameterLine(value, start, rates, {kind: usual_size(surface, kind) for kind in rates})
        refuse_varied_pressure(surface, np.flatnonzero(rates.get("pressures", ())))
        why = {"tensions": "{!r} is 0, where its triangles stop pulling", "cables": "the cable {!r} is 0"}
        for kind in [kind for kind in why if kind in rates]:  # from 0 on they would slide for nothing
            for part in np.flatnonzero((rates[kind] != 0.0) & (part_values(surface, kind) <= 0.0)):
                name = getattr(surface, KINDS[kind][0])[part].name
                message = f"the tension of {why[kind].format(name)}; start from one > 0"
                raise OptionError(message, what="parameter", where=name, found=0.0)
        surface.retensioned(snows=line.named(surface, value + 1.0).get("snows"))  # refuses it at free edges
        return line

    def _common_value(self, surface: Surface) -> float:
        """λ of the surface; everything that is named must agree on it."""
        given = []
        for kind, weights in self.named.items():
            parts, field, _ = KINDS[kind]
            for part in getattr(surface, parts):
                if part.name in weights:
                    label = f"{kind[:-1].replace('_', ' ')} of {part.name!r}"
                    given.append((label, getattr(part, field) / weights[part.name]))
        (first, value), *others = given
        for name, other in others:
            if abs(other - value) > ON_BRANCH * max(abs(value), abs(other)):
                text = f"the {first} makes the parameter {value:g}, the {name} makes it {other:g}: give"
                text += " weights in proportion to the surface's own values, or relative=True"
                raise OptionError(text, what="parameter", where=name, found=other, expected=value)
        return float(value)


def usual_size(surface: Surface, kind: str) -> float:
    """The size of the loads of one kind where all are 0: the largest pressure, or tension over size."""
    usual = float(np.abs(surface.pressures).max()) or float(surface.tensions.max()) / surface.size
    return usual * surface.size if kind == "cable_weights" else usual


@dataclass(frozen=True, eq=False)
class ParameterLine:
    """The values of a surface as functions of λ: a ``Direction`` with its start.

    ``value`` is λ of that surface; ``start`` and ``rates`` are the values at λ = 0 and their rates, by the
    kinds that vary; ``usual`` their sizes where all are 0.
    """

    value: float
    start: Rates
    rates: Rates
    usual: Mapping[str, float]

    @cached_property
    def scale(self) -> float:
        """The size of λ in the metric of arclength: what varies, or its usual size, over its rates."""
        varied = self._varied(self.value)
        size = np.linalg.norm(np.concatenate(list(varied.values())))
        usual = np.linalg.norm([self.usual[kind] for kind, values in varied.items() for _ in values])
        rates = np.concatenate([rates[rates != 0.0] for rates in self.rates.values()])
        return float((size or usual) / np.linalg.norm(rates))

    def _varied(self, value: float) -> dict[str, Floats]:
        """The values that vary, at λ."""
        return {kind: (self.start[kind] + r * value)[r != 0.0] for kind, r in self.rates.items()}

    def named(self, surface: Surface, value: float) -> dict[str, dict[str, float]]:
        """The values that vary, at λ, by kind and name."""
        return {
            kind: {
                getattr(surface, KINDS[kind][0])[part].name: x
                for part, x in zip(np.flatnonzero(self.rates[kind]), values.tolist(), strict=True)
            }
            for kind, values in self._varied(value).items()
        }

    def allows(self, value: float) -> bool:
        """Whether every varied tension is still positive at λ, and no volume 0, which no room can have."""
        varied = self._varied(value)
        if not np.all(varied.get("volumes", 1.0)):
            return False
        return all((varied[kind] > 0.0).all() for kind in ("tensions", "cables") if kind in varied)

    def surface_at(self, surface: Surface, value: float) -> Surface:
        named = self.named(surface, value)
        under = (name for kind in ("pressures", "snows") for name in named.get(kind, ()))
        walls = [name for name in under if surface.walls[surface.patch_index(name)]]
        return surface.retensioned(walls=walls, **named)

    def columns(self, surface: Surface, value: float) -> dict[str, float]:
        """The values that vary, at λ, as columns of a table."""
        named = self.named(surface, value)
        return {
            f"{kind[:-1].replace('_', ' ')} {name}": x
            for kind, by_name in named.items()
            for name, x in by_name.items()
        }

    def boundary(self, value: float) -> Floats | None:
        """The positions (k,3) of the fixed vertices at λ; None as none of them moves."""
        return None

    def velocity(self, value: float) -> Floats | None:
        """dP/dλ (k,3); None as no fixed vertex moves."""
        return None

    def energy_derivative(self, surface: Surface, X: Floats, value: float) -> float:
        """∂E/∂λ at X (n,3)."""
        return by_rates(surface, self.rates, X)[0]

    def gradient(self, surface: Surface, X: Floats) -> Floats:
        """∂∇E/∂λ (n,3), supports applied."""
        return apply_supports(surface, by_rates(surface, self.rates, X)[1], X)


@dataclass(frozen=True)
class BoundaryMotion:
    """λ moves the fixed vertices.

    Parameters
    ----------
    positions : P, a smooth function of λ; the positions (k,3) of the fixed vertices in the order of their
        numbers, ``surface.vertices[surface.pinned]``.
    start : λ of the surface that ``follow`` starts from.

    Examples
    --------
    Two rings move apart; λ is half their distance:

    >>> def rings(half_distance):
    ...     x, y, z = film.vertices[film.fixed].T
    ...     return np.stack([x, y, np.sign(z) * half_distance], axis=1)
    >>> distance = BoundaryMotion(rings, start=0.5)
    """

    positions: Callable[[float], npt.ArrayLike]
    start: float

    def __post_init__(self) -> None:
        if not callable(self.positions):
            validate.refuse("BoundaryMotion.positions", self.positions, "a function of the parameter")
        object.__setattr__(self, "start", validate.number("BoundaryMotion.start", self.start))

    def line(self, surface: Surface) -> BoundaryLine:
        """The boundary along this motion, which at its start must be that of the surface."""
        if not surface.pinned.any():
            message = "BoundaryMotion: the surface has no fixed vertex that could move"
            raise OptionError(message, what="parameter", found=0)
        if surface.rooms:
            name = surface.rooms[0].name
            message = f"BoundaryMotion: room {name!r} prescribes a volume, which is not followed as the"
            message += " boundary moves; remove the room, and give its pressure"
            raise OptionError(message, what="parameter", found=name)
        line = BoundaryLine(self.start, {}, {}, {}, self.positions, int(surface.pinned.sum()))
        off = np.linalg.norm(line.boundary(self.start) - surface.vertices[surface.pinned], axis=1)
        if off.max() > ON * surface.size:
            worst = int(np.flatnonzero(surface.pinned)[off.argmax()])
            message = f"BoundaryMotion: positions({self.start:g}) is not the surface's boundary: fixed vertex"
            message += f" {worst} is {off.max():.3g} away; check start= and the order of the vertices"
            raise OptionError(message, what="positions", where=worst, found=float(off.max()), expected=0.0)
        return line


@dataclass(frozen=True, eq=False)
class BoundaryLine(ParameterLine):
    """The ``count`` fixed vertices as functions P of λ; no tension or pressure varies."""

    positions: Callable[[float], npt.ArrayLike]
    count: int

    @property
    def scale(self) -> float:
        """The size of λ in the metric of arclength: its value at the start, or 1."""
        return abs(self.value) or 1.0

    def surface_at(self, surface: Surface, value: float) -> Surface:
        return surface

    def boundary(self, value: float) -> Floats:
        """P(λ) (count,3)."""
        P = np.asarray(self.positions(value), dtype=float)
        if P.shape != (self.count, 3) or not np.isfinite(P).all():
            found = f"shape {P.shape}" if P.shape != (self.count, 3) else "numbers that are not finite"
            expected = f"({self.count}, 3) finite numbers, one row per fixed vertex"
            validate.refuse(f"BoundaryMotion.positions({value:g})", found, expected)
        return P

    def velocity(self, value: float) -> Floats:
        """dP/dλ (count,3)."""
        h = DIFFERENCE * self.scale
        return (self.boundary(value + h) - self.boundary(value - h)) / (2.0 * h)

    def energy_derivative(self, surface: Surface, X: Floats, value: float) -> float:
        """Σ ⟨∇E, dP/dλ⟩ over the fixed vertices at X (n,3), force·length per unit of λ."""
        forces = energy_and_gradient(surface, X, supports=False)[1]
        return float((forces[surface.pinned] * self.velocity(value)).sum())
