"""A gas that is shut in: its pressure follows its volume, and the volume the loads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from ..base import validate
from ..base.arrays import Floats, mask_of
from ..base.errors import OptionError
from ..base.units import NEWTONS, Units, length_factor
from ..surface import Surface
from ..surface.checks import LARGEST, SMALLEST
from ..surface.geometry import area_vectors

ATMOSPHERE = 101_325.0  # Pa, the standard atmosphere
EVEN = 1e-9  # of a pressure: a smaller difference of two patches' is none
EXACT = 1e-6  # of the absolute pressure: p V = const holds so well
MOST_RUNS = 25
FARTHEST = 0.25  # of the pressure: the most that a run changes it by, before both sides are known
KEPT = "the file keeps the pressure of the gas; only pcmc.analyse and --run change it with the volume"
Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Gas:
    """Air that is shut in under a roof or in a cushion, at constant temperature: (p_a + p) V = const.

    Parameters
    ----------
    patches : that enclose it; by default all under pressure that are no walls. Their pressures have one
        size p, against the air outside.
    ambient : p_a ≥ 0, pressure of the air outside, force per area; by default the standard atmosphere,
        101.325 kPa, in the model's units. With 0 it is p V = const.
    volume : V > 0 of the form, length³; by default what the patches enclose with Π. In a project with mirrors
        it is that of the part that is drawn.

    >>> Gas(patches=["top", "bottom"], ambient=100.0).outside(Units("m", "kN"))
    100.0
    """

    patches: Sequence[str] = ()
    ambient: float | None = None
    volume: float | None = None

    def __post_init__(self) -> None:
        validate.sequence("Gas.patches", self.patches, "a sequence of patch names")
        if self.ambient is not None:
            vars(self)["ambient"] = validate.number("Gas.ambient", self.ambient, least=0.0, most=LARGEST)
        if self.volume is not None:
            vars(self)["volume"] = validate.number("Gas.volume", self.volume, least=SMALLEST, most=LARGEST)

    def check(self, surface: Surface, units: Units) -> None:
        """Refuse patches that are not there or under several pressures, and a roof in unknown units."""
        self.signs(surface)
        self.outside(units)
        if (volume := self.enclosed(surface)) <= 0.0:
            text = "gas: the patches enclose no volume above Π; give Gas.volume, or name those that do"
            raise OptionError(text, what="Gas.volume", found=volume)

    def outside(self, units: Units) -> float:
        """The pressure of the air outside, p_a."""
        if self.ambient is not None:
            return self.ambient
        if not units.force:
            text = "gas: the pressure of the air outside is not known without units; add units and force"
            raise OptionError(f"{text}, or give Gas.ambient", what="Gas.ambient")
        return ATMOSPHERE / NEWTONS[units.force] * length_factor(units.length, "m") ** 2

    def signs(self, surface: Surface) -> Floats:
        """(k,) of each patch: 1 where it has the gas on its negative side, -1 on its positive one, else 0."""
        chosen, pressures = [surface.patch_index(name) for name in self.patches], surface.pressures
        mine = np.unique(chosen) if chosen else np.flatnonzero(surface.roof & (pressures != 0.0))
        sizes = np.abs(pressures[mine])
        if not len(sizes) or sizes.min() == 0.0:
            text = "gas: no patch is under pressure" if not chosen else "gas: a patch of it has no pressure"
            raise OptionError(f"{text}; give it one, or leave out gas", what="Gas.patches")
        if np.ptp(sizes) > EVEN * sizes.max():
            low, high = (surface.patches[mine[k]].name for k in (sizes.argmin(), sizes.argmax()))
            text = f"gas: it has one pressure, but {low!r} has {sizes.min():g} and {high!r} {sizes.max():g}"
            raise OptionError(f"{text}; name the patches of one gas", what="Gas.patches")
        return np.sign(pressures) * mask_of(mine, len(pressures))

    def pressure(self, surface: Surface) -> float:
        """p of the form, against the air outside."""
        return float(np.abs(surface.pressures[self.signs(surface) != 0.0]).max())

    def enclosed(self, surface: Surface, displacements: Floats | float = 0.0) -> float:
        """The volume, length³, of a surface with displacements (n,3): that between the patches and Π, and
        what ``volume`` has more than this in the form."""
        signs, up = self.signs(surface)[surface.patch_of_face], np.array(surface.plane.normal)
        volumes = []
        for moved in (displacements, 0.0):
            P = (surface.vertices + moved)[surface.faces]
            volumes.append(float(signs @ (surface.plane.height(P).mean(axis=1) * (area_vectors(P) @ up))))
        return volumes[0] if self.volume is None else self.volume + volumes[0] - volumes[1]


def balanced_pressure(
    first: float, law: Callable[[float], tuple[Answer, float | None]], outside: float
) -> tuple[Answer, float, bool]:
    """The pressure p with which the gas and the structure agree, by a secant that is kept in bounds.

    ``law(p)`` is the answer under the pressure p and the pressure that the gas has then; None where the
    structure does not carry the load at p, or leaves the gas no volume: it is compressed until it does, so
    that p is taken as too low. Returned are the last answer, its pressure, and whether both agree.

    >>> balanced_pressure(1.0, lambda p: ("", 3.0 - p), outside=100.0)[1:]
    (1.5, True)
    """
    low, high, known, p = -outside, np.inf, list[tuple[float, float]](), first
    for _ in range(MOST_RUNS):
        answer, then = law(p)
        gap = np.inf if then is None else then - p
        if abs(gap) <= EXACT * max(outside + abs(p), abs(first)):
            return answer, p, True
        low, high = (p, high) if gap > 0.0 else (low, p)
        step = FARTHEST * max(abs(p), abs(first))
        if high - low <= EXACT * abs(first):  # below it the structure does not carry, above it is too much
            break
        known += [(p, gap)] if np.isfinite(gap) else []
        better = p + np.clip(gap, -step, step)
        if len(known) > 1:
            (a, f), (b, g) = known[-2:]
            better = b - g * (b - a) / (g - f) if g != f else p
        if not low < better < high:
            better = 0.5 * (low + high)
        p = float(np.clip(better, p - step, p + step))
    return answer, p, False
