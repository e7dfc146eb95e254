"""Every quantity that pcmc shows, sweeps or aims at, the key figures of a roof, and what of it may vary.

A number of a roof is computed once, here or in its certificate; page, report, sweep and command show it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..base import validate
from ..base.arrays import mask_of
from ..base.errors import OptionError
from ..forces.cables import pull_along
from ..forces.rooms import refuse_varied_pressure
from ..surface import Surface, values
from ..surface.geometry import segment_lengths
from ..surface.values import part_index, part_values
from .cables import chord
from .certificate import Certificate

KINDS = ("tension", "pressure", "volume", "weight", "snow", "cable", "cable_weight")
FACTOR = 20.0  # a parameter without bounds may change by this factor, up or down
QUANTITIES = {
    "apex": "length",  # greatest height over Π
    "height": "length",  # height over Π at a point; of a patch the greatest, below Π the least
    "rise": "length",  # apex less the height of the lowest support of a sheet
    "area": "area",  # Σ A_T
    "volume": "volume",  # ∫ z ν·n dA, the volume between patch and Π
    "energy": "energy",  # E = Σ α A - Σ p V, with cables and weights
    "tension": "tension",  # α
    "pressure": "pressure",  # p of the air, without snow
    "snow": "pressure",  # s, per area of the plan
    "net pressure": "pressure",  # p - s
    "weight": "pressure",  # w, per area of the patch
    "curvature": "curvature",  # (p - s) / (2 α)
    "lean": "angle",  # largest angle between the wall and Π's normal
    "force": "force",  # τ, the tension of the cable
    "length": "length",  # Σ of its edges
    "sag": "length",  # largest distance from the chord between its ends
    "load": "force",  # pressure, snow and weight along Π's normal
    "reaction": "force",  # force of the supports along Π's normal
    "thrust": "force",  # force of the supports along Π
    "reaction per length": "tension",  # largest |Σ (α + w z) n|
    "margin": "times",  # factor on a load or tension up to which the roof stays stable
    "lowest eigenvalue": "eigenvalue",  # smallest second variation per unit area
}
"""Every quantity of a roof or of a part of it, and its unit as a name of ``Units``: one word, one meaning."""

CHANGED = {kind: values.KINDS[f"{kind}s"].dimension for kind in KINDS if kind not in QUANTITIES}
"""The dimensions of kinds of parameters that are no quantities of a roof."""


def dimension_of(name: str) -> str:
    """The unit of a quantity or of a kind of parameter, as a name of ``Units``; OptionError for another.

    >>> dimension_of("apex"), dimension_of("reaction per length"), dimension_of("cable")
    ('length', 'tension', 'force')
    """
    return CHANGED.get(name) or QUANTITIES[validate.choice("quantity", name, [*QUANTITIES])]


class Figure(NamedTuple):
    """A number of a roof."""

    quantity: str  # one of ``QUANTITIES``
    of: str  # the patch, wall, cable or room it belongs to; empty for the whole roof
    owner: str  # what that is: roof, patch, wall, cable or room
    value: float | None  # in the surface's units; None where it has none

    @property
    def dimension(self) -> str:
        """Its unit, as a name of ``Units``."""
        return dimension_of(self.quantity)


def figures(surface: Surface, certificate: Certificate) -> list[Figure]:
    """The key figures: of each patch, wall, cable and room, then of the whole roof.

    >>> from pcmc import Patch, certify
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> {f.quantity: round(f.value, 3) for f in figures(roof, certify(roof)) if f.of == "roof"}["apex"]
    0.354
    """
    rows: list[Figure] = []

    def add(of: str, owner: str, values: Mapping[str, float | None]) -> None:
        rows.extend(Figure(quantity, of, owner, value) for quantity, value in values.items())

    height, area = surface.plane.height(surface.vertices), certificate.patches["area"].to_numpy()
    volume, acting, roof = certificate.volumes, certificate.acting, surface.roof
    for k, patch in enumerate(surface.patches):
        weight = {"weight": patch.weight} if patch.weight else {}
        if not roof[k]:
            add(patch.name, "wall", {"area": float(area[k]), "tension": patch.tension, **weight})
            continue
        snow = {"snow": patch.snow, "net pressure": patch.net_pressure} if surface.snows.any() else {}
        own = {
            "apex": float(height[surface.faces[surface.patch_of_face == k]].max()),
            "area": float(area[k]),
            "volume": float(volume[k]),
            "reaction per length": acting.largest_per_length(k),
            "tension": patch.tension,
            "pressure": patch.pressure,
        }
        add(patch.name, "patch", own | snow | weight)
    leaning = certificate.leaning
    for name, lean in zip(leaning.get("wall", ()), leaning.get("lean", ()), strict=True):
        add(str(name), "wall", {"lean": float(lean)})
    for cable in surface.cables:
        length = float(segment_lengths(surface.vertices, cable.edges).sum())
        pull = float(pull_along(surface, cable, cable.edges.ravel()).max())
        add(cable.name, "cable", {"force": pull, "length": length})
        with suppress(OptionError):  # a closed cable has no sag
            out = chord(surface, cable.name).out
            add(cable.name, "cable", {"sag": float(np.linalg.norm(out, axis=1).max())})
    for room in surface.rooms:
        add(room.name, "room", {"volume": room.volume})
    sheets = mask_of(surface.faces[roof[surface.patch_of_face]], surface.n)
    held = sheets & surface.supported
    apex, lowest = float(height[sheets].max()), height[held if held.any() else sheets].min()
    whole = {
        "apex": apex,
        "rise": apex - float(lowest),
        "area": float(area[roof].sum()),
        "volume": float(certificate.volume),
        "energy": float(certificate.energy),
        "load": float(certificate.load),
        "reaction": float(certificate.support),
        "reaction per length": acting.largest_per_length(),
    }
    add("", "roof", whole)
    return rows


@dataclass(frozen=True)
class Parameter:
    """A tension, a pressure, a weight, snow, a cable's tension or weight, or a room's volume, that may vary.

    Parameters
    ----------
    patch : name of the patch, or of the room or cable; or several names, which all get one value.
    kind : ``"tension"``, ``"pressure"``, ``"weight"`` or ``"snow"`` of a patch, ``"cable"``, the tension of a
        cable, ``"cable_weight"``, its weight per length, or ``"volume"`` of a room. Where the pressure of a
        room, or the snow over it, varies, that of its walls, the difference between rooms, is updated, unless
        it is a parameter itself.
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
        parts, field, _ = values.KINDS[self.key]
        if parts == "cables":  # which may have the name "cable 1"
            return f"{field} of cable {names.removeprefix('cable ')}"
        return f"{self.kind} of {names}"

    @property
    def dimension(self) -> str:
        """The unit of its value, as a name of ``Units``."""
        return dimension_of(self.kind)

    @property
    def plain(self) -> Any:
        """The parameter as in a project: its name, a list of names, or a table.

        >>> Parameter(["west", "east"]).plain, Parameter("hall", "volume", low=2.0).plain
        (['west', 'east'], {'patch': 'hall', 'kind': 'volume', 'low': 2.0})
        """
        names = list(self.names) if len(self.names) > 1 else self.names[0]
        entry = {k: v for k, v in vars(self).items() if v is not None} | {"patch": names}
        return names if entry == {"patch": names, "kind": "tension"} else entry

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
    several = as_list(given, (Parameter, str, list, tuple), "a Parameter or the name of a patch")
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
