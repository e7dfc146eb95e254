"""What a structural model is made of: material, thickness and loads, as a project or a command gives them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import cast

from ..base.errors import OptionError
from ..base.units import NO_UNITS, Units
from ..certificate import Certificate
from ..solvers.result import Result
from ..surface import Surface
from .cables import checked_areas
from .loads import Load, SelfWeight, Snow, Wind, check_loads
from .model import Material, StructuralModel, checked_thickness


@dataclass(frozen=True)
class Structure:
    """Material, thickness and loads of the structural model, in the units of the surface.

    Attributes
    ----------
    young : Young's modulus, force per area.
    thickness : of all patches, length, or a table with one for each patch.
    poisson : Poisson's ratio.
    density : mass per volume, as of ``Material``: t/m³ with kN and m. Above 0, self-weight is a load.
    gravity : length/s²; by default 9.81 m/s² in the unit of length.
    snow : load per plan area, besides the snow that the form was found under; 0 for none.
    wind : pressures by patch, above 0 for suction on a roof.
    cable_area : of the cables' sections, length², or a table with one for each cable.
    """

    young: float | None = None
    thickness: float | Mapping[str, float] | None = None
    poisson: float = 0.3
    density: float = 0.0
    gravity: float | None = None
    snow: float = 0.0
    wind: Mapping[str, float] = field(default_factory=dict)
    cable_area: float | Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        self.material  # noqa: B018 (refuses bad values before any work)
        self.loads  # noqa: B018

    @property
    def material(self) -> Material:
        """The material of the patches and cables."""
        for name in ("young", "thickness"):
            if getattr(self, name) is None:
                text = f"a structural model needs {name}; give --{name} or the key {name} of [structure]"
                raise OptionError(text, what=name)
        return Material(young=self.young or 0.0, poisson=self.poisson, density=self.density)

    @property
    def loads(self) -> tuple[Load, ...]:
        """Self-weight, snow and wind, each in a step of its own."""
        loads: list[Load] = []
        if self.density > 0.0:
            loads.append(SelfWeight(self.gravity))
        if self.snow != 0.0:
            loads.append(Snow(self.snow))
        if self.wind:
            loads.append(Wind(self.wind))
        return tuple(loads)

    def check(self, surface: Surface) -> None:
        """Refuse values that name no patch or cable of the surface, before it is solved."""
        checked_thickness(self.thickness, surface)
        check_loads(self.loads, surface)
        checked_areas(self.cable_area, surface)

    def model(
        self,
        surface: Surface | Result,
        anyway: bool = False,
        certificate: Certificate | None = None,
        units: Units = NO_UNITS,
    ) -> StructuralModel:
        """The structural model of a surface at rest, with its units and the certificate if that is known.

        Errors as in ``pcmc.StructuralModel``.
        """
        thickness, given = 0.0 if self.thickness is None else self.thickness, cast("Surface", surface)
        return StructuralModel(
            given,
            self.material,
            thickness,
            self.loads,
            anyway=anyway,
            cable_area=self.cable_area,
            certificate=certificate,
            units=units,
        )
