"""Parameters: the tensions, loads and volumes of a surface that may vary."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from ..base import validate
from ..base.errors import OptionError
from ..forces.rooms import refuse_varied_pressure
from ..surface import Surface
from ..surface.values import part_index, part_values
from .quantities import dimension_of

KINDS = ("tension", "pressure", "volume", "weight", "snow", "cable")
FACTOR = 20.0  # a parameter without bounds may change by this factor, up or down


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


def as_parameters(given: Parameter | str | Iterable[Parameter | str]) -> list[Parameter]:
    """One parameter or several as a list; a name, or a list of names, stands for the tension of these."""
    kinds = (Parameter, str, list, tuple)
    several = as_list(given, kinds, "a Parameter or the name of a patch")
    parameters = [p if isinstance(p, Parameter) else Parameter(p) for p in several]
    labels = [Parameter(name, p.kind).label for p in parameters for name in p.names]
    for k, label in enumerate(labels):
        if label in labels[:k]:
            raise OptionError(f"the {label} is given twice; remove one", what=label, where=k)
    return parameters


def as_list(given: Any, kinds: tuple[type, ...], expected: str) -> list[Any]:
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
