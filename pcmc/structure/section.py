"""The section [structure] of a project: material, thickness and loads of its structural model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ..base import validate
from ..base.errors import OptionError
from ..base.units import NO_UNITS, Units
from ..certificate import Certificate
from ..plan import Plan
from ..plan.parts import check_keys
from ..surface import Surface
from .gas import Gas
from .loads import STEEPEST, Load, SelfWeight, Snow, Wind, check_combinations, check_loads, in_the_open
from .material import Material
from .member_keys import members_of
from .members import bars_on, lines_on
from .model import StructuralModel, checked_areas, checked_thickness

MATERIAL = ("young", "poisson", "density", "weft", "shear", "warp")  # keys of a material


@dataclass(frozen=True)
class PatchMaterial:
    """The material of one patch, where it is another one than the others'.

    Attributes
    ----------
    young, poisson, density, weft, shear, warp, thickness : as in [structure], for this patch.
    """

    young: float | None = None
    poisson: float | None = None
    density: float | None = None
    weft: float | None = None
    shear: float | None = None
    warp: Sequence[float] | None = field(default=None, metadata={"kind": "a point [x, y, z]"})
    thickness: float | None = None


@dataclass(frozen=True)
class Zone:
    """Snow or wind on a part of the roof; those of one case act together, as one case of loads.

    Attributes
    ----------
    case : the name of the case.
    snow : load per plan area, besides the snow that the form was found under.
    wind : pressure, above 0 for suction on a roof.
    patches : that carry it; by default all that are no walls and under no other sheet.
    slopes : it acts where the slope is between these two, degrees.
    area : corners [x, y] of a polygon in the plan that it acts within; by default everywhere.
    slides : two slopes, degrees: snow is whole up to the first, none from the second on, linear between.
    """

    case: str
    snow: float = 0.0
    wind: float = 0.0
    patches: Sequence[str] = ()
    slopes: Sequence[float] = field(default=(0.0, STEEPEST), metadata={"kind": "a value"})
    area: Sequence[Sequence[float]] = field(default=(), metadata={"kind": "a list of points"})
    slides: Sequence[float] = field(default=(), metadata={"kind": "a value"})

    def __post_init__(self) -> None:
        if (self.snow != 0.0) == (self.wind != 0.0):
            text = f"zone of {self.case!r}: give snow or wind, one of them"
            raise OptionError(text, what="structure.zones", found=self.case)

    def loads(self, roof: Sequence[str]) -> Load:
        """The load; ``roof`` are the names of the patches that are not walls."""
        where: dict[str, Any] = {"name": self.case, "slopes": self.slopes, "area": self.area}
        if self.snow:
            return Snow(self.snow, self.patches, slides=self.slides, **where)
        if self.slides:
            text = f"zone of {self.case!r}: slides is for snow; leave it out"
            raise OptionError(text, what="structure.zones", found=self.case)
        return Wind(dict.fromkeys(self.patches or roof, self.wind), **where)


@dataclass(frozen=True)
class Structure:
    """Material, thickness and loads of the structural model, in the units of the surface.

    Attributes
    ----------
    young : Young's modulus E > 0, force per area; of a cloth along its warp.
    poisson : Poisson's ratio ν, 0 ≤ ν < 0.5.
    density : mass per volume, as of ``Material``: t/m³ with kN and m. With a density, self-weight is a load.
    weft, shear : of a cloth: Young's modulus along its weft, and shear modulus, force per area.
    warp : of a cloth: a direction in space, whose projection onto each triangle is its warp.
    thickness : of all patches, length, or a table with one for each patch.
    patches : other materials, by the names of patches.
    gravity : length/s²; by default 9.81 m/s² in the unit of length.
    snow : load per plan area, besides the snow that the form was found under; 0 for none.
    wind : pressures by patch, above 0 for suction on a roof.
    zones : snow and wind on parts of the roof, as more cases.
    combinations : factors by case, by the name of each combination: {uls = {form = 1.0, snow = 1.5}}.
    gas : true for air that is shut in, whose pressure follows its volume; or a table as of ``Gas``.
    cable_area : of the cables' sections, length², or a table with one for each cable.
    members : arches, beams and cables by name; dividers and holes of the plan name them.
    run : whether to run CalculiX: tables and a picture beside the model, and a chapter of the report.
    """

    young: float | None = None
    thickness: float | Mapping[str, float] | None = None
    poisson: float = 0.3
    density: float = 0.0
    weft: float | None = None
    shear: float | None = None
    warp: Sequence[float] = field(default=(1.0, 0.0, 0.0), metadata={"kind": "a point [x, y, z]"})
    patches: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    gravity: float | None = None
    snow: float = 0.0
    wind: Mapping[str, float] = field(default_factory=dict)
    zones: Sequence[Mapping[str, Any]] = field(default=(), metadata={"kind": "a list of tables"})
    combinations: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    gas: bool | Mapping[str, Any] = field(default=False, metadata={"kind": "a value"})
    cable_area: float | Mapping[str, float] | None = None
    members: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    run: bool = False

    def __post_init__(self) -> None:  # refuses bad values before any work
        validate.flag("run", self.run)
        for name in ("young", "thickness"):
            if getattr(self, name) is None:
                text = f"a structural model needs {name}; give --{name} or the key {name} of [structure]"
                raise OptionError(text, what=name)
        self.material, self.enclosed  # noqa: B018
        members_of(self.members, None)
        check_combinations(self.combinations, self.loads(()))

    @property
    def material(self) -> Material:
        """The material of the patches that have none of their own."""
        return Material(**{name: getattr(self, name) for name in MATERIAL})

    def materials(self, surface: Surface) -> Material | dict[str, Material]:
        """The material of all patches, or of each by name."""
        if not self.patches:
            return self.material
        found = dict.fromkeys((patch.name for patch in surface.patches), self.material)
        for name, given in self.patches.items():
            validate.choice("patch", name, tuple(found))
            own = {key: value for key, value in given.items() if key in MATERIAL}
            if "young" in own and not {"weft", "shear"} & set(own):  # another cloth, or a sheet that is none
                own |= {"weft": None, "shear": None}
            found[name] = replace(self.material, **own)
        return found

    def thicknesses(self, surface: Surface) -> float | dict[str, float]:
        """The thickness of all patches, or of each by name."""
        own = {name: given["thickness"] for name, given in self.patches.items() if "thickness" in given}
        if not own:
            return checked_thickness(self.thickness, surface)
        every = self.thickness
        if not isinstance(every, Mapping):
            every = dict.fromkeys((patch.name for patch in surface.patches), every or 0.0)
        return checked_thickness({**every, **own}, surface)

    @property
    def enclosed(self) -> Gas | None:
        """The gas that is shut in."""
        if not isinstance(self.gas, Mapping):
            return Gas() if validate.flag("gas", self.gas) else None
        check_keys(self.gas, Gas, "structure.gas")
        return Gas(**self.gas)

    def loads(self, roof: Sequence[str]) -> tuple[Load | tuple[Load, ...], ...]:
        """Self-weight, snow and wind, each in a step of its own, and the cases of the zones; ``roof`` are the
        names of the patches that wind acts on by default."""
        heavy = self.density > 0.0 or any(given.get("density", 0.0) for given in self.patches.values())
        weight = [SelfWeight(self.gravity)] if heavy else []
        snow = [Snow(self.snow)] if self.snow != 0.0 else []
        wind = [Wind(self.wind)] if self.wind else []
        cases: dict[str, list[Load]] = {}
        for zone in (Zone(**given) for given in self.zones):
            cases.setdefault(zone.case, []).append(zone.loads(roof or ("roof",)))
        zoned = [entry[0] if len(entry) == 1 else tuple(entry) for entry in cases.values()]
        return (*weight, *snow, *wind, *zoned)

    def loads_on(self, surface: Surface) -> tuple[Load | tuple[Load, ...], ...]:
        """The loads on a surface."""
        on = in_the_open(surface)
        return self.loads([patch.name for patch, out in zip(surface.patches, on, strict=True) if out])

    def check(self, surface: Surface, plan: Plan | None = None) -> None:
        """Refuse values that name no patch, wall or cable of the surface, before it is solved."""
        self.thicknesses(surface)
        self.materials(surface)
        check_loads(self.loads_on(surface), surface)
        members = members_of(self.members, plan)
        bars_on(surface, members, lines_on(surface, members))
        checked_areas(self.cable_area, surface, [str(member.on) for member in members])

    def model(
        self,
        surface: Any,
        anyway: bool = False,
        certificate: Certificate | None = None,
        units: Units = NO_UNITS,
        plan: Plan | None = None,
    ) -> StructuralModel:
        """The structural model of a surface at rest or of a result, with the members that its ``plan`` names;
        errors as in ``pcmc.StructuralModel``."""
        plain: Surface = getattr(surface, "surface", surface)
        return StructuralModel(
            surface,
            self.materials(plain),
            self.thicknesses(plain),
            self.loads_on(plain),
            anyway=anyway,
            cable_area=self.cable_area,
            cable_material=self.material if plain.cables else None,
            certificate=certificate,
            units=units,
            combinations=self.combinations,
            gas=self.enclosed,
            members=members_of(self.members, plan),
        )
