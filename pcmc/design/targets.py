"""What a search aims at and what it may change: targets and parameters."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from ..base import validate
from ..base.errors import OptionError
from ..certificate.quantities import dimension_of
from ..forces.rooms import refuse_varied_pressure
from ..surface import Surface
from ..surface.values import part_index, part_values
from .quantities import MEASURES, Measurement

KINDS = ("tension", "pressure", "volume", "weight", "snow", "cable")
CABLE_QUANTITIES = ("sag", "length", "force")
NAMED = {"curvature": "patch", "pressure": "room"} | dict.fromkeys(CABLE_QUANTITIES, "cable")
"""Quantities of one patch, room or cable alone."""
SHORT = {"reaction": "reaction per length"}  # names that stand for others
FACTOR = 20.0  # a parameter without bounds may change by this factor, up or down


@dataclass(frozen=True)
class Target:
    """A quantity of a surface, and the value or limits wanted for it.

    Parameters
    ----------
    quantity : ``"apex"``, greatest height over Π of a patch; ``"height"`` over a point of Π; ``"volume"``
        between a patch and Π (``volumes_below``), and ``"area"``; ``"curvature"``, (p - s) / (2α), a patch's
        mean curvature at rest; ``"reaction per length"`` or ``"reaction"``, the greatest pull along an edge
        that holds a patch; ``"lean"`` of a wall, its largest angle from the vertical, degrees; ``"margin"``,
        the factor of ``pcmc.margin`` up to which the roof stays stable; ``"pressure"`` of a room of
        prescribed volume; of a cable ``"sag"``, the largest distance of its vertices from the chord between
        its ends, its ``"length"``, and its ``"force"``, which is its tension.
    of : name of the patch, room or cable; what a margin varies, such as ``"tension of west"``, by default
        the pressure; for ``"height"`` the point (x, y) in the coordinates of Π. None: all patches under
        pressure together (for reactions all edges that are held), where the quantity is not of one alone.
    value, at_most, at_least : a value, or limits. ``pcmc.sensitivities`` needs none.
    name : of the point of a height, such as ``"crown"``: shown instead of its coordinates.

    Examples
    --------
    >>> Target("apex", "north", 2.5).label
    'apex of north'
    >>> Target("height", (9, 9), 3.9).label, Target("height", (9, 9), 3.9, name="crown").label
    ('height at (9, 9)', 'height at crown')
    >>> Target("apx", "north")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: unknown quantity 'apx'; did you mean 'apex'? Known: apex, height, ...
    """

    quantity: str
    of: Any = None
    value: float | None = None
    at_most: float | None = None
    at_least: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "quantity", SHORT.get(self.quantity, self.quantity))
        validate.choice("quantity", self.quantity, tuple(MEASURES))
        if self.quantity == "height":
            object.__setattr__(self, "of", _point(self.of))
        elif not (isinstance(self.of, str) or (self.of is None and self.quantity not in NAMED)):
            kind = NAMED.get(self.quantity, "patch")
            message = f"{self.quantity}: expected the name of a {kind}, found {self.of!r}"
            raise OptionError(message, what="of", found=self.of)
        for key in ("value", "at_most", "at_least"):
            if getattr(self, key) is not None:
                validate.number(key, getattr(self, key), where=self.label)
        if self.value is not None and (self.at_most, self.at_least) != (None, None):
            raise OptionError(f"{self.label}: give a value or limits, not both", what="value")
        least, most = self.at_least, self.at_most
        if least is not None and most is not None and most < least:
            message = f"{self.label}: at_most {most:g} is less than at_least {least:g}"
            raise OptionError(message, what="at_most", found=most, expected=least)

    @property
    def label(self) -> str:
        """The quantity in words."""
        if self.quantity == "height":
            return f"height at {self.name or f'({self.of[0]:g}, {self.of[1]:g})'}"
        return self.quantity if self.of is None else f"{self.quantity} of {self.of}"

    @property
    def dimension(self) -> str:
        """The unit of its value, as a name of ``Units``."""
        return dimension_of(self.quantity)

    @property
    def limits(self) -> tuple[float, ...]:
        """The value or limits given; empty if the quantity is only measured."""
        return tuple(v for v in (self.value, self.at_most, self.at_least) if v is not None)

    def nearest(self, measured: float) -> float:
        """The wanted value nearest to a measured one."""
        if self.value is not None:
            return self.value
        low = -math.inf if self.at_least is None else self.at_least
        high = math.inf if self.at_most is None else self.at_most
        return min(max(measured, low), high)

    def scale(self, surface: Surface) -> float:
        """What a misfit is divided by: the value wanted or, if that is 0, the quantity's usual size."""
        return max(map(abs, self.limits)) or MEASURES[self.quantity].size(surface)


@dataclass(frozen=True)
class Parameter:
    """A tension, a pressure, a weight, snow, a cable's tension, or a room's prescribed volume, that may vary.

    Parameters
    ----------
    patch : name of the patch, or of the room or cable; or several names, which all get one value.
    kind : ``"tension"``, ``"pressure"``, ``"weight"`` or ``"snow"`` of a patch, ``"cable"``, the tension of a
        cable, or ``"volume"`` of a room. Where the pressure of a room, or the snow over it, varies, that of
        its walls, the difference between rooms, is updated, unless it is a parameter itself.
    low, high : bounds; by default a twentieth of the present value and twenty times it.

    >>> Parameter("wall", low=0.0, high=3.0).label
    'tension of wall'
    """

    patch: str | Sequence[str]
    kind: str = "tension"
    low: float | None = None
    high: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.patch, str):
            names = tuple(self.patch) if isinstance(self.patch, Sequence) else ()
            if not names or not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
                validate.refuse("patch", self.patch, "the name of a patch, or several different ones")
            object.__setattr__(self, "patch", names if len(names) > 1 else names[0])
        validate.choice("kind of parameter", self.kind, KINDS)
        if self.kind == "volume" and len(self.names) > 1:
            validate.refuse("patch", self.patch, "the name of one room")
        for key in ("low", "high"):
            if getattr(self, key) is not None:
                validate.number(key, getattr(self, key), where=self.label)

    @property
    def key(self) -> str:
        """Its kind as in ``pcmc.surface.values.KINDS``."""
        return f"{self.kind}s"

    @property
    def names(self) -> tuple[str, ...]:
        """The names as a tuple, also of a single one."""
        return (self.patch,) if isinstance(self.patch, str) else tuple(self.patch)

    @property
    def label(self) -> str:
        """The parameter in words."""
        names = " and ".join(self.names)
        if self.kind == "cable":  # which may have the name "cable 1"
            return f"tension of cable {names.removeprefix('cable ')}"
        return f"{self.kind} of {names}"

    @property
    def dimension(self) -> str:
        """The unit of its value, as a name of ``Units``."""
        return dimension_of(self.kind)

    def value(self, surface: Surface) -> float:
        """Its value on a surface; of several patches that of the first."""
        return float(part_values(surface, self.key)[part_index(surface, self.key, self.names[0])])

    def check(self, surface: Surface) -> None:
        """Refuse a patch or room that is not there, and a pressure that follows from a prescribed volume."""
        parts = [part_index(surface, self.key, name) for name in self.names]
        if self.kind == "pressure":
            refuse_varied_pressure(surface, parts)

    def tension_under_pressure(self, surface: Surface) -> bool:
        """Whether it is the tension of a patch with a pressure, weight or snow; such a tension is never 0."""
        if self.kind != "tension":
            return False
        patches = [surface.patches[surface.patch_index(name)] for name in self.names]
        return any((patch.pressure, patch.weight, patch.snow) != (0.0, 0.0, 0.0) for patch in patches)

    def bounds(self, surface: Surface) -> tuple[float, float]:
        """(low, high), with the defaults that follow from its present value."""
        present = self.value(surface)
        if present == 0.0 and None in (self.low, self.high):
            raise OptionError(f"{self.label} is 0 now; give low and high", what=self.label, found=0.0)
        least, most = sorted((present / FACTOR, present * FACTOR))
        low, high = least if self.low is None else self.low, most if self.high is None else self.high
        validate.number("high", high, above=low, where=self.label)
        if self.tension_under_pressure(surface):
            validate.number("low", low, above=0.0, where=self.label)
        elif self.kind in ("tension", "cable"):
            validate.number("low", low, least=0.0, where=self.label)
        return low, high


def measure(surface: Surface, target: Target) -> Measurement:
    """Value and derivatives of the target's quantity on a surface.

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> pyramid = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                   [Patch("roof", 1.0)], fixed=range(4))
    >>> volume = measure(pyramid, Target("volume", "roof"))
    >>> round(volume.value, 12), volume.by_position[4].round(12).tolist()
    (1.333333333333, [0.0, 0.0, 1.333333333333])
    """
    return MEASURES[target.quantity].measure(surface, target.of)


def as_parameters(given: Parameter | str | Iterable[Parameter | str]) -> list[Parameter]:
    """One parameter or several as a list; a name, or a list of names, stands for the tension of these."""
    kinds = (Parameter, str, list, tuple)
    several = _as_list(given, kinds, "a Parameter or the name of a patch")
    parameters = [p if isinstance(p, Parameter) else Parameter(p) for p in several]
    labels = [Parameter(name, p.kind).label for p in parameters for name in p.names]
    for k, label in enumerate(labels):
        if label in labels[:k]:
            raise OptionError(f"the {label} is given twice; remove one", what=label, where=k)
    return parameters


def as_targets(given: Target | Iterable[Target]) -> list[Target]:
    """One target or several as a list."""
    return _as_list(given, (Target,), "a Target")


def _as_list(given: Any, kinds: tuple[type, ...], expected: str) -> list[Any]:
    """One value or several, by any iterable, as a list of values of these kinds."""
    if isinstance(given, kinds) and not isinstance(given, list | tuple):
        return [given]
    single = isinstance(given, str | bytes) or not isinstance(given, Iterable)
    values = [] if single else list(given)
    wrong = next((k for k, value in enumerate(values) if not isinstance(value, kinds)), None)
    if values and wrong is None:
        return values
    found = values[wrong] if wrong is not None else given if single else values
    message = f"expected {expected}, or several of them, found {found!r}"
    raise OptionError(message, where=wrong, found=found, expected=expected)


def _point(of: Any) -> tuple[float, float]:
    try:
        x, y = (float(c) for c in of)
    except (TypeError, ValueError):
        message = f"height: expected a point (x, y) of Π, found {of!r}"
        raise OptionError(message, what="of", found=of) from None
    return validate.number("height: x", x), validate.number("height: y", y)
