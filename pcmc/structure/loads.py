"""Loads on a structural model, the steps that they make, and combinations of these with factors."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats
from ..base.errors import LoadWarning, OptionError, unknown
from ..surface import Plane, Surface
from ..surface.checks import LARGEST, SMALLEST
from ..surface.geometry import area_vectors, face_areas, segment_lengths, vertex_sums
from ..surface.images import leaning_mirrors
from ..surface.values import in_the_open

GRAVITY = 9.81  # m/s²
FORM = "form"  # what combinations call the form-finding load
FORM_STEPS = ("form pressure", "form pressure less snow")  # its step without snow, and with
EVEN = 1e-6  # of the size, squared: a patch with less area in the plan faces to neither side
STEEPEST = 180.0  # degrees: a face that looks down
PARTS = 10  # pieces along each side of a face: each piece is inside an area or outside
SAME = 0.1  # of a face: a smaller difference of two areas is none


@dataclass(frozen=True, eq=False)
class Step:
    """All loads at the end of a step of the analysis."""

    name: str  # "form pressure" ("… less snow", where the form was found under snow), or those of its loads
    pressures: Floats  # (m,) force per area on each face along its normal: the form's, net of snow, and wind
    forces: Floats  # (n,3) forces on the vertices that keep their direction
    gravity: float = 0.0  # length/time², 0 without self-weight

    def plus(self, last: Step, first: Step, factor: float) -> Step:
        """This step and ``factor`` times what ``last`` has more than ``first``: loads add up."""
        pressures = self.pressures + factor * (last.pressures - first.pressures)
        forces = self.forces + factor * (last.forces - first.forces)
        gravity = self.gravity + factor * (last.gravity - first.gravity)
        return Step(self.name, pressures, forces, gravity)


@dataclass(frozen=True)
class SelfWeight:
    """The weight of the elements, ρ t g per area, against Π's normal; it stays in all later steps."""

    gravity: float | None = None  # g > 0, length/time²; by default 9.81 m/s² in the model's unit of length
    name: str = "self-weight"  # of its step

    def __post_init__(self) -> None:
        if self.gravity is not None:
            gravity = validate.number("SelfWeight.gravity", self.gravity, least=SMALLEST, most=LARGEST)
            vars(self)["gravity"] = gravity
        validate.checked_name("name of a load", self.name)

    def added_to(self, step: Step, surface: Surface, standard: float) -> Step:
        return replace(step, gravity=standard if self.gravity is None else self.gravity)


@dataclass(frozen=True)
class Snow:
    """A load per plan area, against Π's normal, besides the snow that the form was found under. It keeps its
    size and direction while the surface deforms."""

    load: float  # s, force per area of the plan; negative for a lift
    patches: Sequence[str] = ()  # names of those that carry it; by default all ``in_the_open``
    name: str = "snow"  # of its step
    slopes: Sequence[float] = (0.0, STEEPEST)  # degrees: it lies on slopes over the first, up to the second
    area: Sequence[Sequence[float]] = ()  # points [x, y] of Π: it lies in their polygon; empty: everywhere
    slides: Sequence[float] = ()  # degrees: whole up to the first slope, none from the second, linear between

    def __post_init__(self) -> None:
        load = validate.number("Snow.load", self.load, least=-LARGEST, most=LARGEST)
        patches = validate.sequence("Snow.patches", self.patches, "a sequence of patch names")
        vars(self).update(load=load, patches=tuple(patches), **_checked_zone("Snow", self))
        if len(validate.sequence("Snow.slides", self.slides)):
            vars(self)["slides"] = _checked_slopes("Snow.slides", self.slides)
        validate.checked_name("name of a load", self.name)

    def added_to(self, step: Step, surface: Surface, standard: float) -> Step:
        """A third of each triangle's load at each of its corners; triangles below others carry none."""
        named = [surface.patch_index(name) for name in self.patches]
        carrying = named or np.flatnonzero(in_the_open(surface)).tolist()
        if not carrying:
            hint = "all patches are walls; name those that carry snow"
            validate.refuse("Snow.patches", self.patches, "names of patches", hint=hint)
        normal, plan = np.array(surface.plane.normal), np.maximum(plan_areas(surface), 0.0)
        plan *= _in_zone(self, surface, np.isin(surface.patch_of_face, carrying))
        if self.slides:
            whole, none = self.slides
            plan *= np.clip((none - roof_slopes(surface)) / (none - whole), 0.0, 1.0)
        snow = -self.load / 3.0 * vertex_sums(plan[:, None] * normal, surface.faces, surface.n)
        return replace(step, forces=step.forces + snow)


@dataclass(frozen=True)
class Wind:
    """Pressures of wind zones, which are patches, added to the patches' own: along the patch's positive
    normal as ``Patch.pressure``, above 0 for suction on a roof; they follow it while the surface deforms."""

    pressures: Mapping[str, float]  # force per area by patch name
    name: str = "wind"  # of its step
    slopes: Sequence[float] = (0.0, STEEPEST)  # degrees: it acts on slopes over the first, up to the second
    area: Sequence[Sequence[float]] = ()  # points [x, y] of Π: it acts in their polygon; empty: everywhere

    def __post_init__(self) -> None:
        if not isinstance(self.pressures, Mapping) or not self.pressures:
            expected = "pressures by patch name, such as {'roof': 0.5}"
            validate.refuse("Wind.pressures", self.pressures, expected)
        checked: dict[str, float] = {}
        limits: dict[str, Any] = {"least": -LARGEST, "most": LARGEST}
        for zone, value in self.pressures.items():
            checked[zone] = validate.number("Wind.pressures", value, where=str(zone), **limits)
        vars(self).update(pressures=checked, **_checked_zone("Wind", self))
        validate.checked_name("name of a load", self.name)

    @property
    def patches(self) -> tuple[str, ...]:
        return tuple(self.pressures)

    def added_to(self, step: Step, surface: Surface, standard: float) -> Step:
        by_patch, up = np.zeros(len(surface.patches)), np.array(surface.plane.normal)
        areas = area_vectors(surface.vertices[surface.faces]) @ up
        plan = np.bincount(surface.patch_of_face, areas, len(by_patch))
        down = in_the_open(surface) & (plan < -EVEN * surface.size**2)
        for name in (name for name in self.pressures if down[surface.patch_index(name)]):
            text = f"{self.name}: the triangles of {name!r} face down, so wind above 0 pushes it down and is"
            warnings.warn(f"{text} no suction; give the other sign, or turn them", LoadWarning, stacklevel=2)
        zones = [surface.patch_index(zone) for zone in self.pressures]
        by_patch[zones] = [*self.pressures.values()]
        more = by_patch[surface.patch_of_face]
        more *= _in_zone(self, surface, np.isin(surface.patch_of_face, zones))
        return replace(step, pressures=step.pressures + more)


Load = SelfWeight | Snow | Wind


def load_steps(
    surface: Surface,
    loads: Sequence[Load | Sequence[Load]],
    gravity: float = GRAVITY,
    combinations: Mapping[str, Mapping[str, float]] | None = None,
) -> tuple[Step, ...]:
    """The form-finding load first, then a step for each load, and one for each combination; loads in one
    tuple act together. ``gravity`` is that of self-weight where it has none of its own, length/time².

    A combination is Σ f L of the loads L of the steps that it names, with their factors f. The form-finding
    load and self-weight act in it with the factor 1 where it does not name them.

    >>> from pcmc import Patch
    >>> square = Surface([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], [[0, 1, 2], [2, 3, 0]],
    ...                  [0, 0], [Patch("roof", 1.0)], fixed=range(4))
    >>> loads = [(Snow(0.5), Wind({"roof": 2.0}))]
    >>> form, both, uls = load_steps(square, loads, combinations={"uls": {"snow and wind": 1.5}})
    >>> both.name, both.pressures.tolist(), both.forces.sum(axis=0).round(9).tolist()
    ('snow and wind', [3.0, 3.0], [0.0, 0.0, -2.0])
    >>> uls.pressures.tolist(), uls.forces.sum(axis=0).round(9).tolist()
    ([4.0, 4.0], [0.0, 0.0, -3.0])
    """
    per_face = surface.weights[surface.patch_of_face] * face_areas(surface.vertices[surface.faces])
    downwards = -np.array(surface.plane.normal) / 3.0
    weight = vertex_sums(per_face[:, None] * downwards, surface.faces, surface.n)
    ends, _, per_length = surface.cable_edges
    per_edge = 1.5 * per_length * segment_lengths(surface.vertices, ends)
    np.add.at(weight, ends, per_edge[:, None, None] * downwards)
    name = FORM_STEPS[int(surface.snows.any())]
    form = permanent = Step(name, surface.net_pressures[surface.patch_of_face], weight)
    steps, added = [form], {FORM: (form, nothing(form))}
    for together in map(acting_together, loads):
        step = replace(permanent, name=step_name(together))
        for load in together:
            step = load.added_to(step, surface, gravity)
        steps.append(step)
        added[step.name] = step, permanent
        permanent = replace(permanent, gravity=step.gravity)
    for name, factors in (combinations or {}).items():
        sum_ = replace(nothing(form), name=name)
        for case, (last, first) in added.items():
            if case in factors or case == FORM:
                sum_ = sum_.plus(last, first, factors.get(case, 1.0))
            else:
                sum_ = replace(sum_, gravity=sum_.gravity + last.gravity - first.gravity)
        steps.append(sum_)
    return tuple(steps)


def nothing(step: Step) -> Step:
    """A step without loads, of the same surface."""
    return Step("nothing", np.zeros_like(step.pressures), np.zeros_like(step.forces))


def acting_together(entry: Load | Sequence[Load]) -> tuple[Load, ...]:
    """The loads of one step: those of a tuple, or a single one."""
    together: tuple[Any, ...] = entry if isinstance(entry, tuple) and entry else (entry,)
    return together


def step_name(together: Sequence[Load]) -> str:
    """The name of the step of loads that act together: that of each, once."""
    return " and ".join(dict.fromkeys(load.name for load in together))


def check_loads(
    loads: object, surface: Surface, replaced: Sequence[str] = ()
) -> tuple[Load | tuple[Load, ...], ...]:
    """Loads, or tuples of them, whose patches are there; none on walls ``replaced`` by members, and none that
    acts downwards beside mirror planes that lean."""
    expected = "a sequence of SelfWeight, Snow or Wind, or of tuples of these"
    if isinstance(loads, Load) or not isinstance(loads, Sequence):
        validate.refuse("loads", loads, expected)
    every = [load for entry in loads for load in acting_together(entry)]
    if len({load.gravity for load in every if isinstance(load, SelfWeight)}) > 1:
        text = "loads: self-weights have different gravities, and a model has one; give all the same"
        raise OptionError(text, what="loads")
    leaning = leaning_mirrors(surface.plane, surface.on_planes)
    for load in every:
        if not isinstance(load, Load):
            validate.refuse("loads", load, expected)
        if leaning and not isinstance(load, Wind):
            text = f"{load.name}: the {leaning[0]} leans over Π, and behind it down is elsewhere"
            raise OptionError(f"{text}; take the whole roof, pcmc.mirrored(surface)", what="loads")
        for name in getattr(load, "patches", ()):
            surface.patch_index(name)
            if name in replaced:
                text = f"{load.name}: a member stands in the place of {name!r}, so no load acts on it"
                raise OptionError(f"{text}; leave it out", what="loads", where=name)
    return tuple(loads)


def check_combinations(given: object, loads: Sequence[Load | Sequence[Load]]) -> dict[str, dict[str, float]]:
    """Factors by the names of steps, by the name of each combination; every step named is there."""
    cases = [FORM, *(step_name(acting_together(entry)) for entry in loads)]
    if not isinstance(given, Mapping):
        validate.refuse("combinations", given, "factors by name, such as {'uls': {'snow': 1.5}}")
    taken = [*FORM_STEPS, *cases]
    if len(set(taken)) < len(taken):
        name = next(name for name in taken if taken.count(name) > 1)
        text = f"loads: two cases are called {name!r}; give each a name of its own"
        raise OptionError(text, what="loads", found=name)
    checked: dict[str, dict[str, float]] = {}
    for name, factors in given.items():
        validate.checked_name("name of a combination", name)
        if name in taken:
            text = f"combination {name!r}: a case has this name; give the combination another one"
            raise OptionError(text, what="combinations", found=name)
        if not isinstance(factors, Mapping) or not factors:
            validate.refuse("combinations", factors, "factors by name, such as {snow = 1.5}", where=name)
        for case in factors:
            if case not in cases:
                text = f"combination {name!r}: {unknown('case', case, cases)}"
                raise OptionError(text, what="combinations", where=name, found=case)
        one = {c: validate.number("factor", f, where=c, least=-1e3, most=1e3) for c, f in factors.items()}
        checked[name] = one
    return checked


def plan_areas(surface: Surface) -> Floats:
    """(m,) the area of each face in the plan, below 0 if it overhangs, length². The side of a patch that
    looks away from Π is the one of the larger part of its plan, or of an upright patch of its higher part."""
    P, patch = surface.vertices[surface.faces], surface.patch_of_face
    plan: Floats = area_vectors(P) @ np.array(surface.plane.normal)
    sides, higher = (np.bincount(patch, plan * by) for by in (1.0, surface.plane.height(P).mean(axis=1)))
    return plan * np.sign(np.where(np.abs(sides) > EVEN * surface.size**2, sides, higher))[patch]


def roof_slopes(surface: Surface) -> Floats:
    """(m,) the angle between each face and Π, degrees: 90 if it is upright, above 90 if it overhangs."""
    up = plan_areas(surface) / face_areas(surface.vertices[surface.faces])
    return np.asarray(np.degrees(np.arccos(np.clip(up, -1.0, 1.0))))


def _in_zone(load: Snow | Wind, surface: Surface, carrying: Bools) -> Floats:
    """(m,) how much of each face is in a load's area, if its slope is the load's and it is ``carrying`` (m,).

    OptionError where none is, and for an area that goes on behind a mirror plane, but not as the image of
    what is in front.
    """
    (least, most), slope = load.slopes, roof_slopes(surface)
    share = (carrying & ((slope > least + 1e-9) | (least == 0.0)) & (slope <= most + 1e-9)).astype(float)
    if len(load.area):
        here = in_area(load.area, surface)
        for mirror in (plane for plane, _ in surface.on_planes if plane.mirror):
            there = in_area(load.area, surface, mirror)
            if there.any() and np.abs(there - here).max() > SAME:
                text = f"{load.name}: its area goes on behind the {mirror}, and is another one there; let it"
                text += " end at the mirror, or take the whole roof: --whole, or pcmc.mirrored(surface)"
                raise OptionError(text, what=load.name)
        share *= here
    if not share.any():
        text = f"{load.name}: no triangle that carries it is in the area with its slope in {[least, most]}"
        raise OptionError(f"{text}; check the zone", what=load.name)
    return share


def in_area(area: Sequence[Sequence[float]], surface: Surface, behind: Plane | None = None) -> Floats:
    """(m,) the share of each face in the plan, or of its image ``behind`` a plane, that is in a polygon: of
    the middles of its ``PARTS``² parts of one size."""
    P = surface.vertices[surface.faces]
    if behind is not None:
        P = P - 2.0 * behind.height(P)[:, :, None] * np.array(behind.normal)
    P, rows = surface.plane.to_local(P), range(PARTS)
    thirds = [(3 * i + d, 3 * j + d) for d in (1, 2) for i in rows for j in range(PARTS + 1 - d - i)]
    places = (np.array([a, b, 3 * PARTS - a - b]) / (3.0 * PARTS) @ P for a, b in thirds)
    return np.mean([_within(area, place) for place in places], axis=0)


def _within(area: Sequence[Sequence[float]], places: Floats) -> Bools:
    """(m,) the places (m,3), in the coordinates of Π, that are within a polygon."""
    x, y = places.T[:2, :, None]
    (a, b), (c, d) = (np.roll(np.array(area), -k, axis=0).T for k in (0, 1))
    crossed = (b > y) != (d > y)  # (m,k) by the line from the place along x
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray((crossed & (x < a + (y - b) * (c - a) / (d - b))).sum(axis=1) % 2 == 1)


def _checked_zone(kind: str, load: Snow | Wind) -> dict[str, Any]:
    """Slopes and area of a load, as tuples of numbers."""
    try:
        points = np.array(load.area, dtype=float)
        good = not len(load.area) or (points.ndim == 2 and points.shape[1] == 2 and len(points) > 2)
    except (TypeError, ValueError, OverflowError):
        good = False
    if not (good and np.isfinite(points).all()):
        validate.refuse(f"{kind}.area", load.area, "three or more points [x, y]")
    area = tuple(map(tuple, points.tolist()))
    return {"slopes": _checked_slopes(f"{kind}.slopes", load.slopes), "area": area}


def _checked_slopes(what: str, given: Any) -> tuple[float, float]:
    try:
        least, most = (validate.number(what, value, least=0.0, most=STEEPEST) for value in given)
    except (TypeError, ValueError):
        validate.refuse(what, given, "two slopes in degrees, 0 to 180, such as [0, 30]")
    if not least < most:
        validate.refuse(what, given, "two slopes in degrees, the smaller one first")
    return least, most
