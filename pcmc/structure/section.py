"""The section [structure] of a project: material, thickness, loads and members of its structural model."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

from ..base import validate
from ..base.errors import LoadWarning, OptionError, unknown
from ..plan import Plan
from ..plan.parts import check_keys, curve_of
from ..surface import Surface
from ..surface.curves import Curve
from ..surface.parts import image_names, with_images
from ..surface.symmetry import mirrored
from ..surface.values import in_the_open
from .gas import Gas
from .loads import STEEPEST, Load, SelfWeight, Snow, Wind, check_combinations, check_loads, in_area
from .material import Material, Profile
from .members import ENDS, KINDS, Member, bars_on, lines_on
from .model import StructuralModel, checked_areas, checked_thickness

MATERIAL = ("young", "poisson", "density", "weft", "shear", "warp")  # keys of a material
SHAPES: dict[tuple[str, ...], Callable[..., Profile]] = {
    ("diameter", "thickness"): Profile.tube,
    ("diameter",): Profile.circle,
    ("width", "height"): Profile.rectangle,
    ("area", "upright", "sideways"): Profile,
    ("area", "upright"): Profile,
    ("area",): lambda area: Profile(area, area**2 / 12.0),  # of a cable, which does not bend
}


@dataclass(frozen=True)
class Zone:
    """Snow or wind on a part of the roof; those of one case act together, as one case of loads.

    Attributes
    ----------
    case : the name of the case.
    snow : load per plan area, besides the snow that the form was found under.
    wind : pressure, above 0 for suction on a roof.
    patches : that carry it; by default all that are no walls and under no other sheet.
    slopes : it acts on slopes over the first of these and up to the second, degrees; from 0, flat parts, too.
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
class MemberSection:
    """A member: an arch, a beam or a cable; dividers and holes of the plan name it.

    Attributes
    ----------
    young : Young's modulus E > 0, force per area.
    poisson : Poisson's ratio ν, 0 ≤ ν < 0.5.
    density : mass per volume, as of the membranes.
    kind : a beam, which an arch is, too, or a cable, without bending stiffness.
    ends : of a beam at supports: hinged, or clamped.
    diameter : of a round section, length.
    thickness : of the wall of a tube, length; without it a round section is solid.
    width, height : of a rectangle, length; the height is upright.
    area : of any other section, length².
    upright, sideways : its second moments of area, length⁴, for bending in the upright plane and out of it;
        by default both are alike. A cable needs none.
    on : names of walls and cables that it takes the place of, besides those of dividers that name it.
    along : curves on edges of the outline or of a hole that it carries, from end to end of each.
    propped : whether columns or a wall carry it upright, all along such an edge.
    bars : columns, or stays where the kind is cable: pairs of points, the support point of the roof, by its
        name in [plan.points] or [x, y], and the foot or anchor, [x, y, z] or [x, y] on Π.
    strength : stress that a column or a stay may have, force per area.
    """

    young: float | None = None
    poisson: float = 0.3
    density: float = 0.0
    kind: str = field(default="beam", metadata={"kind": KINDS})
    ends: str = field(default="hinged", metadata={"kind": ENDS})
    diameter: float | None = None
    thickness: float | None = None
    width: float | None = None
    height: float | None = None
    area: float | None = None
    upright: float | None = None
    sideways: float | None = None
    on: Sequence[str] = ()
    along: Sequence[Any] = field(default=(), metadata={"kind": "a list of curves or tables"})
    propped: bool = False
    bars: Sequence[Any] = field(default=(), metadata={"kind": "a list of pairs of points"})
    strength: float = 0.0

    def profile(self, name: str) -> Profile:
        """Its cross-section; OptionError, with the member's ``name``, where none is given, or two."""
        given = {key: getattr(self, key) for keys in SHAPES for key in keys if getattr(self, key) is not None}
        for keys, make in SHAPES.items():
            if set(keys) == set(given) and (keys != ("area",) or self.kind == "cable"):
                return make(*(validate.number(key, given[key], above=0.0, where=name) for key in keys))
        wanted = "diameter and thickness, width and height, or area and upright"
        found = " and ".join(given) or "none"
        text = f"member {name!r} has no section: expected {wanted} (of a cable area alone), found {found}"
        raise OptionError(text, what="structure.members", where=name)

    def member(self, name: str, on: Any) -> Member:
        """The member along a line, or between two points."""
        if self.young is None:
            text = f"member {name!r} has no material; give it young, Young's modulus"
            raise OptionError(text, what="structure.members", where=name)
        about = self.profile(name), Material(self.young, self.poisson, self.density), self.kind, self.ends
        label = on if isinstance(on, str) else name
        return Member(on, *about, self.propped and isinstance(on, Curve), label, self.strength)

    def between(self, name: str, points: Mapping[str, Any]) -> Iterator[Member]:
        """Its columns or stays; ``points`` are those of the plan by name."""
        for pair in self.bars:
            on = list(pair) if isinstance(pair, Sequence) and not isinstance(pair, str) else pair
            if isinstance(on, list) and on and isinstance(on[0], str):
                if on[0] not in points:
                    text = f"member {name!r}: {unknown('point', on[0], list(points))} in [plan.points]"
                    raise OptionError(text, what="structure.members", where=name, found=on[0])
                on[0] = points[on[0]]
            yield self.member(name, on)


@dataclass(frozen=True)
class Structure:
    """Material, thickness and loads of the structural model, in the units of the surface.

    Attributes
    ----------
    young : Young's modulus E > 0, force per area; of a cloth along its warp.
    poisson : Poisson's ratio ν, 0 ≤ ν < 0.5.
    density : mass per volume, as of ``Material``: t/m³ with kN and m. With one here, of a patch or of a
        member, self-weight is a load.
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
    cable_area : of the cables' sections, length², or a table with one for each cable; their material is that
        of [structure]. A member of kind = "cable" that is on them has its own.
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
        if self.gravity is not None and not self._heavy:
            text = "gravity: nothing has a weight; give a density, too, or leave it out"
            raise OptionError(text, what="gravity", found=self.gravity)
        plain = [own for own in self.patches.values() if self.weft is None and "weft" not in own]
        no_cloth = self.weft is None and len(plain) == len(self.patches)
        if any("warp" in own for own in plain) or (no_cloth and tuple(self.warp) != Structure.warp):
            text = "warp: is of a cloth; give its weft and shear, too, or leave it out"
            raise OptionError(text, what="warp")
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
        own = {key: of["thickness"] for key, of in self.patches.items() if "thickness" in of}
        every: Any = self.thickness
        if own and not isinstance(every, Mapping):
            every = dict.fromkeys((patch.name for patch in surface.patches), every)
        return checked_thickness({**every, **own} if isinstance(every, Mapping) else every, surface)

    @property
    def enclosed(self) -> Gas | None:
        """The gas that is shut in."""
        if not isinstance(self.gas, Mapping):
            return Gas() if validate.flag("gas", self.gas) else None
        check_keys(self.gas, Gas, "structure.gas")
        return Gas(**self.gas)

    @property
    def _heavy(self) -> bool:
        parts = (*self.patches.values(), *self.members.values())
        return bool(self.density) or any(part.get("density") for part in parts)

    def loads(self, roof: Sequence[str]) -> tuple[Load | tuple[Load, ...], ...]:
        """Self-weight, snow and wind, each in a step of its own, and the cases of the zones; ``roof`` are the
        names of the patches that wind acts on by default."""
        loads: list[Load] = [SelfWeight(self.gravity)] if self._heavy else []
        loads += [Snow(self.snow)] if self.snow != 0.0 else []
        loads += [Wind(self.wind)] if self.wind else []
        cases: dict[str, tuple[Load, ...]] = {}
        for zone in (Zone(**given) for given in self.zones):
            cases[zone.case] = (*cases.get(zone.case, ()), zone.loads(roof or ("roof",)))
        return (*loads, *cases.values())

    def loads_on(self, surface: Surface) -> tuple[Load | tuple[Load, ...], ...]:
        """The loads on a surface."""
        on = in_the_open(surface)
        return self.loads([patch.name for patch, out in zip(surface.patches, on, strict=True) if out])

    def of_whole(self, piece: Surface, whole: Surface, plan: Plan | None) -> Structure:
        """The same for the whole of a piece: what it has by names holds for their images, too."""
        images = image_names(piece, whole)
        ropes = {new: old for new, old in images.items() if new in [cable.name for cable in whole.cables]}
        by_name = "thickness", "patches", "wind", "cable_area"
        values = {key: with_images(getattr(self, key), images) for key in by_name}
        tables = [{"patches": (), **zone} for zone in self.zones]
        values["zones"] = [zone | {"patches": with_images(zone["patches"], images)} for zone in tables]
        if isinstance(self.gas, Mapping):
            gas = values["gas"] = dict(self.gas)
            gas["patches"] = with_images(gas.get("patches", ()), images)
            if gas.get("volume") is not None:  # that of the piece
                gas["volume"] *= round(whole.m / piece.m)
        values["members"] = {}
        for name, table in self.members.items():  # walls find their images themselves
            drawn = [d.name for d in plan.dividers if d.member == name] if plan else []
            on = table.get("on", ())
            more = [new for new, old in ropes.items() if old in (*on, *drawn)]
            values["members"][name] = {**table, "on": [*on, *more]}
        return replace(self, **values)

    def check(self, surface: Surface, plan: Plan | None = None, unfold: bool = False) -> None:
        """Refuse values that name no patch, wall or cable of the surface, or of its whole if it is to
        ``unfold``, before it is solved."""
        if unfold:
            whole = mirrored(surface)
            for zone, (plane, _) in product(self.zones, surface.on_planes):
                area = zone.get("area", ())
                if not (plane.mirror and len(area)) or in_area(area, surface, plane).any():
                    continue  # what goes on behind the plane, the part refuses, or has the same
                if in_area(area, surface).any():
                    text = f"{zone['case']}: its area is on one side of the {plane}, and the whole has it"
                    text += " there alone; if its image is meant, too, draw it"
                    warnings.warn(text, LoadWarning, stacklevel=3)
            structure = self.of_whole(surface, whole, plan)
            _name_oblique_warps(structure.materials(whole), surface)
            return structure.check(whole, plan)
        self.thicknesses(surface)
        materials = self.materials(surface)
        _name_oblique_warps(materials, surface)
        heavy = [part.name for part in (*surface.patches, *surface.cables) if part.weight]
        own = materials if isinstance(materials, Mapping) else dict.fromkeys(heavy, materials)
        if twice := [name for name in heavy if own.get(name, self.material).density]:
            text = f"{twice[0]!r} has a weight, under which it is at rest; self-weight by its density comes"
            warnings.warn(f"{text} on top; if both are the same, leave one out", LoadWarning, stacklevel=3)
        members = members_of(self.members, plan)
        lines = lines_on(surface, members)
        check_loads(self.loads_on(surface), surface, [line.wall for line in lines])
        bars_on(surface, members, lines)
        checked_areas(self.cable_area, surface, [str(member.on) for member in members])
        if self.enclosed is not None:
            self.enclosed.signs(surface)

    def model(self, surface: Any, plan: Plan | None = None, **about: Any) -> StructuralModel:
        """The structural model of a surface at rest or of a result, with the members that its ``plan`` names;
        ``about``: ``anyway``, ``certificate`` and ``units``. Errors as of ``pcmc.StructuralModel``."""
        plain: Surface = getattr(surface, "surface", surface)
        about |= {"combinations": self.combinations, "gas": self.enclosed, "cable_area": self.cable_area}
        about |= {"cable_material": self.material} if plain.cables else {}
        about["members"] = members_of(self.members, plan)
        of_patches = self.materials(plain), self.thicknesses(plain)
        return StructuralModel(surface, *of_patches, self.loads_on(plain), **about)


def _name_oblique_warps(materials: Material | Mapping[str, Material], piece: Surface) -> None:
    """Warn of a cloth whose warp is another one behind a mirror plane of a ``piece``."""
    mirrors = [plane for plane, _ in piece.on_planes if plane.mirror]
    named = materials if isinstance(materials, Mapping) else {"": materials}
    for (name, material), mirror in product(named.items(), mirrors):
        if material.cloth and mirror.oblique_to(material.warp):
            of = f" of {name!r}" if name else ""
            text = f"warp {list(material.warp)}{of} is neither along the {mirror} nor square to it; behind it"
            text += " the part has the image of the warp, and the whole, --whole, the same direction"
            warnings.warn(text, LoadWarning, stacklevel=4)
            return


def members_of(given: Mapping[str, Mapping[str, Any]], plan: Plan | None) -> tuple[Member, ...]:
    """The members of [structure.members] where they and the plan say; OptionError for what is not there.

    >>> line = {"curve": [[2, 0], [2, 2]], "member": "arch"}
    >>> plan = Plan([[0, 0], [4, 0], [4, 2], [0, 2]], [line], tension=2.0)
    >>> [arch] = members_of({"arch": {"young": 2.1e8, "width": 0.1, "height": 0.2}}, plan)
    >>> arch.on, arch.profile.sizes
    ('wall 1', (0.1, 0.2))
    """
    known, members = dict[str, MemberSection](), list[Member]()
    for name, table in given.items():
        check_keys(table, MemberSection, f"structure.members.{name}")
        section = known[name] = MemberSection(**table)
        section.profile(name)
        curves = (curve_of(curve, f"member {name!r}") for curve in section.along)
        members += [section.member(name, on) for on in (*section.on, *curves)]
        members += section.between(name, plan.points) if plan is not None else ()
    sites = list[tuple[str, str, str | Curve]]()  # dividers and holes, their members, and where these are
    for number, divider in enumerate(() if plan is None else plan.dividers, 1):
        if divider.member and divider.wall is None and divider.cable is None:
            text = f"divider {number}: member = {divider.member!r} takes the place of a wall; give it one"
            raise OptionError(text, what="member", where=divider.name)
        sites.append((f"divider {number}", divider.member, divider.name))
    for hole in () if plan is None else plan.holes:
        if hole.member and hole.edge not in ("fixed", "sliding"):
            text = f'{hole.name}: a member carries a held edge, but this is edge = "{hole.edge}"'
            raise OptionError(f'{text}; make it edge = "fixed"', what="member", where=hole.name)
        sites.append((hole.name, hole.member, hole.curve))
    for owner, name, on in (site for site in sites if site[1]):
        if name not in known:
            text = f"{owner}: {unknown('member', name, list(known))}; add [structure.members.{name}]"
            raise OptionError(text, what="member", where=owner, found=name)
        members.append(known[name].member(name, on))
    return tuple(members)


def check_members(given: Mapping[str, Mapping[str, Any]], plan: Plan | None) -> None:
    """Refuse keys of [structure.members] that count for nothing where the plan has the members."""
    curves = {member.name for member in members_of(given, plan) if isinstance(member.on, Curve)}
    lines = curves | {divider.member for divider in (plan.dividers if plan else ())}
    lines |= {name for name, table in given.items() if table.get("on")}
    for name, table in given.items():
        for key, counts, of in (
            ("propped", name in curves, "a member along edges or around a hole"),
            ("strength", table.get("bars"), "columns and stays, bars ="),
            (
                "ends",
                table.get("kind") != "cable" and name in lines,
                "a beam along edges, as columns have hinges",
            ),
            ("density", name in lines, "a member along edges, as no weight of columns counts"),
        ):
            if table.get(key, getattr(MemberSection, key)) != getattr(MemberSection, key) and not counts:
                text = f"member {name!r}: {key} is of {of}; leave it out"
                raise OptionError(text, what=key, where=name, found=table[key])
