"""Linear elastic materials, isotropic or of a cloth, and cross-sections of members."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..base import validate
from ..base.errors import OptionError
from ..surface.checks import LARGEST, SMALLEST

STIFF: dict[str, Any] = {"least": SMALLEST, "most": LARGEST}  # limits of stiffnesses and sizes


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
        if (self.weft is None) != (self.shear is None):
            missing = "shear" if self.shear is None else "weft"
            text = f"Material.{missing} is missing: a cloth needs young, weft and shear"
            raise OptionError(text, what=f"Material.{missing}")
        limits: dict[str, Any] = {"young": STIFF, "poisson": {"least": 0.0, "below": 0.5}}
        limits |= {"density": {"least": 0.0, "most": LARGEST}}
        limits |= {"weft": STIFF, "shear": STIFF} if self.cloth else {}
        for name, bounds in limits.items():
            vars(self)[name] = validate.number(f"Material.{name}", getattr(self, name), **bounds)
        if self.weft is not None:
            text = "Material.weft: expected less than young/poisson²"
            validate.cloth("Material.weft", text, self.young, self.weft, self.poisson)
        vars(self)["warp"] = validate.triple("Material.warp", self.warp)

    @property
    def cloth(self) -> bool:
        """Whether it has a warp and a weft."""
        return self.weft is not None


@dataclass(frozen=True)
class Profile:
    """The cross-section of a member: its area and second moments of area.

    Parameters
    ----------
    area : A > 0, length².
    upright : I > 0, length⁴, for bending in the upright plane through the member: E I w'' = -M.
    sideways : the same for bending out of that plane; by default as ``upright``.
    shape : "rectangle", "circle", "tube", or empty for any other.
    sizes : of the shape, length: width and height, the diameter, or the outer diameter and the thickness.

    >>> beam = Profile.rectangle(0.2, 0.4)
    >>> round(beam.area, 6), round(beam.upright, 9), round(beam.sideways, 9)
    (0.08, 0.001066667, 0.000266667)
    """

    area: float
    upright: float
    sideways: float | None = None
    shape: str = ""
    sizes: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for name in ("area", "upright", "sideways"):
            value = self.upright if getattr(self, name) is None else getattr(self, name)
            vars(self)[name] = _size(name, value)

    @classmethod
    def rectangle(cls, width: float, height: float) -> Profile:
        """Of a width across and a height in the upright plane: A = b h, I = b h³/12."""
        b, h = (_size(name, x) for name, x in (("width", width), ("height", height)))
        return cls(b * h, b * h**3 / 12.0, h * b**3 / 12.0, "rectangle", (b, h))

    @classmethod
    def circle(cls, diameter: float) -> Profile:
        """Solid: A = π d²/4, I = π d⁴/64.

        >>> round(Profile.circle(2.0).area, 6)
        3.141593
        """
        d = _size("diameter", diameter)
        return cls(math.pi * d**2 / 4.0, math.pi * d**4 / 64.0, shape="circle", sizes=(d,))

    @classmethod
    def tube(cls, diameter: float, thickness: float) -> Profile:
        """Of an outer diameter D and a thickness s: A = π (D² - d²)/4, I = π (D⁴ - d⁴)/64 with d = D - 2 s.

        >>> round(Profile.tube(2.0, 1.0).upright, 6) == round(Profile.circle(2.0).upright, 6)
        True
        """
        outer, s = _size("diameter", diameter), _size("thickness", thickness)
        inner = outer - 2.0 * s
        if inner < 0.0:
            text = f"Profile.thickness: expected at most half the diameter, {outer / 2.0:g}, found {s:g}"
            raise OptionError(text, what="Profile.thickness", found=s)
        area, inertia = math.pi * (outer**2 - inner**2) / 4.0, math.pi * (outer**4 - inner**4) / 64.0
        return cls(area, inertia, shape="tube", sizes=(outer, s))

    @property
    def label(self) -> str:
        """Its shape and sizes; without a shape, "given".

        >>> Profile.tube(0.1, 0.005).label
        'tube 0.1 × 0.005'
        """
        return f"{self.shape} {' × '.join(f'{size:g}' for size in self.sizes)}" if self.shape else "given"

    @property
    def moments(self) -> tuple[float, float]:
        """I for bending in the upright plane, and out of it."""
        return self.upright, self.upright if self.sideways is None else self.sideways

    @property
    def equal_rectangle(self) -> tuple[float, float, float]:
        """Width b, height h and a factor f on E and the density, with which a rectangle is as stiff:
        f b h = A, f b h³/12 = I, f h b³/12 = I across.

        >>> Profile.rectangle(0.2, 0.4).equal_rectangle
        (0.2, 0.4, 1.0)
        """
        up, side = self.moments
        b, h = math.sqrt(12.0 * side / self.area), math.sqrt(12.0 * up / self.area)
        return float(f"{b:.12g}"), float(f"{h:.12g}"), float(f"{self.area / (b * h):.12g}")

    @property
    def torsion(self) -> float:
        """J, length⁴: of a rectangle c a³ b with its shorter side a and c = 1/3 - 0.21 a/b (1 - a⁴/12 b⁴), as
        in Roark's Formulas for Stress and Strain; of others 4 I I'/(I + I'), as of circles, tubes, ellipses.

        >>> tube = Profile.tube(2.0, 0.1)
        >>> tube.torsion == 2.0 * tube.upright
        True
        """
        if self.shape == "rectangle":
            a, b = sorted(self.sizes)
            return a**3 * b * (1.0 / 3.0 - 0.21 * a / b * (1.0 - (a / b) ** 4 / 12.0))
        up, side = self.moments
        return 4.0 * up * side / (up + side)


def _size(name: str, value: object) -> float:
    return validate.number(f"Profile.{name}", value, **STIFF)
