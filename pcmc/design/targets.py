"""What a search aims at and what it may change: targets and parameters."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from ..base import validate
from ..base.errors import OptionError
from ..certificate.measures import MEASURES as MEASURED
from ..certificate.measures import Measure, Measurement
from ..certificate.quantities import KINDS, Parameter, as_list, as_parameters, dimension_of
from ..surface import Surface

__all__ = ["KINDS", "MEASURES", "Parameter", "Target", "as_parameters", "as_targets", "measure"]

NAMED = {"curvature": "patch", "pressure": "room"} | dict.fromkeys(("sag", "length", "force"), "cable")
"""Quantities of one patch, room or cable alone."""


def _margin(surface: Surface, of: str | None) -> Measurement:
    """The factor of ``pcmc.margin``."""
    from ..accuracy.margins import measured_margin  # takes long to import

    return measured_margin(surface, of)


MEASURES = {**MEASURED, "margin": Measure(_margin, lambda surface: 1.0)}
"""How each quantity is measured."""


@dataclass(frozen=True)
class Target:
    """A quantity of a surface, and the value or limits wanted for it.

    Parameters
    ----------
    quantity : ``"apex"``, greatest height over Π of a patch; ``"height"`` over a point of Π; ``"volume"``
        between a patch and Π (``volumes_below``), and ``"area"``; ``"curvature"``, (p - s) / (2α), a patch's
        mean curvature at rest; ``"reaction per length"``, the greatest pull along an edge that holds a
        patch; ``"lean"`` of a wall, its largest angle from the vertical, degrees; ``"margin"``, the factor
        of ``pcmc.margin`` up to which the roof stays stable; ``"pressure"`` of a room of prescribed volume;
        of a cable ``"sag"``, the largest distance of its vertices from the chord between its ends, its
        ``"length"``, and its ``"force"``, which is its tension.
    of : name of the patch, room or cable; what a margin varies, such as ``"tension of west"``, by default
        the pressure; for ``"height"`` the point (x, y) in the coordinates of Π. By default all patches
        under pressure together (for reactions all edges that are held), where the quantity is not of one
        alone.
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
        validate.choice("quantity", self.quantity, tuple(MEASURES))
        if self.quantity == "height":
            object.__setattr__(self, "of", _point(self.of))
        elif not (isinstance(self.of, str) or (self.of is None and self.quantity not in NAMED)):
            kind = NAMED.get(self.quantity, "patch")
            message = f"{self.quantity}: expected the name of a {kind}, found {validate.shown(self.of)}"
            raise OptionError(message, what="of", found=self.of)
        if not isinstance(self.name, str):
            validate.refuse("name", self.name, "a text")
        if self.name and self.quantity != "height":
            text = f"name: is of the point of a height; leave it out, or name a part: of = {self.name!r}"
            raise OptionError(text, what="name", found=self.name)
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
            return f"height at {self.name or f'({self.of[0]:.12g}, {self.of[1]:.12g})'}"
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


def as_targets(given: Target | Iterable[Target]) -> list[Target]:
    """One target or several as a list."""
    return as_list(given, (Target,), "a Target")


def _point(of: Any) -> tuple[float, float]:
    try:
        x, y = of
    except (TypeError, ValueError):
        message = f"height: expected a point (x, y) of Π, found {of!r}"
        raise OptionError(message, what="of", found=of) from None
    return validate.number("height: x", x), validate.number("height: y", y)
