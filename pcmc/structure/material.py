"""Linear elastic materials, isotropic or of a cloth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..base import validate
from ..base.errors import OptionError
from ..surface.checks import LARGEST, SMALLEST


@dataclass(frozen=True)
class Material:
    """A linear elastic material: isotropic, or a cloth with a warp and a weft.

    Parameters
    ----------
    young : E > 0, force per area; of a cloth along its warp.
    poisson : ν, 0 ≤ ν < 0.5; of a cloth the contraction along the weft under tension along the warp.
    density : ρ ≥ 0, mass per volume, in the mass that a unit of force accelerates by a unit of length per
        s²: t/m³ with kN and m, t/mm³ with N and mm, slug/ft³ with lbf and ft.
    weft, shear : of a cloth: E along the weft, and the shear modulus G, force per area; without them the
        material is isotropic. Its stiffness needs ν² weft < young.
    warp : of a cloth: a direction in space; in each triangle the warp is its projection onto the plane.

    >>> Material(young=1e6)
    Material(young=1000000.0, poisson=0.3, density=0.0, weft=None, shear=None, warp=(1.0, 0.0, 0.0))
    """

    young: float
    poisson: float = 0.3
    density: float = 0.0
    weft: float | None = None
    shear: float | None = None
    warp: Sequence[float] = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        most: dict[str, Any] = {"most": LARGEST}
        stiff = {"least": SMALLEST, **most}
        limits = {"young": stiff, "poisson": {"least": 0.0, "below": 0.5}, "density": {"least": 0.0, **most}}
        if (self.weft is None) != (self.shear is None):
            missing = "shear" if self.shear is None else "weft"
            text = f"Material.{missing} is missing: a cloth needs young, weft and shear"
            raise OptionError(text, what=f"Material.{missing}")
        for name, bounds in (limits | ({"weft": stiff, "shear": stiff} if self.cloth else {})).items():
            vars(self)[name] = validate.number(f"Material.{name}", getattr(self, name), **bounds)
        if self.weft is not None and self.poisson**2 * self.weft >= self.young:
            text = f"Material.weft: expected less than young/poisson² = {self.young / self.poisson**2:.4g}"
            raise OptionError(f"{text}, found {self.weft:g}", what="Material.weft", found=self.weft)
        vars(self)["warp"] = validate.vector("Material.warp", self.warp)

    @property
    def cloth(self) -> bool:
        """Whether it has a warp and a weft."""
        return self.weft is not None
