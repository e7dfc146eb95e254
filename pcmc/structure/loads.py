"""Loads on a structural model, and the steps that they make."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base import validate
from ..base.arrays import Floats
from ..surface import Surface
from ..surface.checks import LARGEST, SMALLEST
from ..surface.geometry import area_vectors, face_areas, segment_lengths, vertex_sums

GRAVITY = 9.81  # m/s²


@dataclass(frozen=True, eq=False)
class Step:
    """All loads at the end of a step of the analysis."""

    name: str  # "form pressure" ("… less snow", where the form was found under snow), or those of its loads
    pressures: Floats  # (k,) force per area on each patch along its normal: the form's, net of snow, and wind
    forces: Floats  # (n,3) forces on the vertices that keep their direction
    gravity: float = 0.0  # length/time², 0 without self-weight


@dataclass(frozen=True)
class SelfWeight:
    """The weight of the elements, ρ t g per area, against Π's normal; it stays in all later steps."""

    gravity: float | None = None  # g > 0, length/time²; by default 9.81 m/s² in the model's unit of length
    name: str = "self-weight"  # of its step

    def __post_init__(self) -> None:
        if self.gravity is not None:
            gravity = validate.number("SelfWeight.gravity", self.gravity, least=SMALLEST, most=LARGEST)
            vars(self)["gravity"] = gravity
        _check_name(self.name)

    def added_to(self, step: Step, surface: Surface, standard: float) -> Step:
        return replace(step, gravity=standard if self.gravity is None else self.gravity)


@dataclass(frozen=True)
class Snow:
    """A load per plan area, against Π's normal, besides the snow that the form was found under.

    It keeps its size and direction while the surface deforms.
    """

    load: float  # s, force per area of the plan; negative for a lift
    patches: Sequence[str] = ()  # names of those that carry it; by default all that are not walls
    name: str = "snow"  # of its step

    def __post_init__(self) -> None:
        load = validate.number("Snow.load", self.load, least=-LARGEST, most=LARGEST)
        if isinstance(self.patches, str) or not isinstance(self.patches, Sequence):
            validate.refuse("Snow.patches", self.patches, "a sequence of patch names")
        vars(self).update(load=load, patches=tuple(self.patches))
        _check_name(self.name)

    def added_to(self, step: Step, surface: Surface, standard: float) -> Step:
        """A third of each triangle's load at each of its corners; triangles below others carry none."""
        named = [surface.patch_index(name) for name in self.patches]
        carrying = named or np.flatnonzero(surface.roof).tolist()
        if not carrying:
            hint = "all patches are walls; name those that carry snow"
            validate.refuse("Snow.patches", self.patches, "names of patches", hint=hint)
        normal = np.array(surface.plane.normal)
        plan = area_vectors(surface.vertices[surface.faces]) @ normal
        side = np.sign(np.bincount(surface.patch_of_face, plan, len(surface.patches)))
        plan = np.maximum(plan * side[surface.patch_of_face], 0.0)
        plan[~np.isin(surface.patch_of_face, carrying)] = 0.0
        snow = -self.load / 3.0 * vertex_sums(plan[:, None] * normal, surface.faces, surface.n)
        return replace(step, forces=step.forces + snow)


@dataclass(frozen=True)
class Wind:
    """Pressures of wind zones, which are patches. They add to the patches' own pressures.

    They act along the patch's positive normal as ``Patch.pressure``, above 0 for suction on a roof, and
    follow it while the surface deforms.
    """

    pressures: Mapping[str, float]  # force per area by patch name
    name: str = "wind"  # of its step

    def __post_init__(self) -> None:
        if not isinstance(self.pressures, Mapping) or not self.pressures:
            expected = "pressures by patch name, such as {'roof': 0.5}"
            validate.refuse("Wind.pressures", self.pressures, expected)
        checked = {
            zone: validate.number("Wind.pressures", value, least=-LARGEST, most=LARGEST, where=str(zone))
            for zone, value in self.pressures.items()
        }
        object.__setattr__(self, "pressures", checked)
        _check_name(self.name)

    @property
    def patches(self) -> tuple[str, ...]:
        return tuple(self.pressures)

    def added_to(self, step: Step, surface: Surface, standard: float) -> Step:
        pressures = step.pressures.copy()
        for zone, value in self.pressures.items():
            pressures[surface.patch_index(zone)] += value
        return replace(step, pressures=pressures)


Load = SelfWeight | Snow | Wind


def load_steps(
    surface: Surface, loads: Sequence[Load | Sequence[Load]], gravity: float = GRAVITY
) -> tuple[Step, ...]:
    """The form-finding load first, then a step for each load; loads in one tuple act together.

    ``gravity`` is that of self-weight where it has none of its own, length/time².

    >>> from pcmc import Patch
    >>> square = Surface([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], [[0, 1, 2], [2, 3, 0]],
    ...                  [0, 0], [Patch("roof", 1.0)], fixed=range(4))
    >>> form, both = load_steps(square, [(Snow(0.5), Wind({"roof": 2.0}))])
    >>> both.name, both.pressures.tolist(), both.forces.sum(axis=0).round(9).tolist()
    ('snow and wind', [3.0], [0.0, 0.0, -2.0])
    """
    per_face = surface.weights[surface.patch_of_face] * face_areas(surface.vertices[surface.faces])
    downwards = -np.array(surface.plane.normal) / 3.0
    weight = vertex_sums(per_face[:, None] * downwards, surface.faces, surface.n)
    ends, _, per_length = surface.cable_edges
    per_edge = 1.5 * per_length * segment_lengths(surface.vertices, ends)
    np.add.at(weight, ends, per_edge[:, None, None] * downwards)
    name = "form pressure less snow" if surface.snows.any() else "form pressure"
    permanent = Step(name, surface.net_pressures, weight)
    steps = [permanent]
    for together in map(acting_together, loads):
        step = replace(permanent, name=" and ".join(load.name for load in together))
        for load in together:
            step = load.added_to(step, surface, gravity)
        steps.append(step)
        permanent = replace(permanent, gravity=step.gravity)
    return tuple(steps)


def acting_together(entry: Load | Sequence[Load]) -> tuple[Load, ...]:
    """The loads of one step: those of a tuple, or a single one."""
    return entry if isinstance(entry, tuple) else (entry,)


def check_loads(loads: object, surface: Surface) -> tuple[Load | tuple[Load, ...], ...]:
    """Loads, or tuples of them, whose patches are there."""
    expected = "a sequence of SelfWeight, Snow or Wind, or of tuples of these"
    if isinstance(loads, Load) or not isinstance(loads, Sequence):
        validate.refuse("loads", loads, expected)
    for entry in loads:
        for load in entry if isinstance(entry, tuple) and entry else (entry,):
            if not isinstance(load, Load):
                validate.refuse("loads", load, expected)
            for name in getattr(load, "patches", ()):
                surface.patch_index(name)
    return tuple(loads)


def _check_name(name: object) -> None:
    if not isinstance(name, str) or not name.strip() or "\n" in name:
        validate.refuse("name of a load", name, "a line of text")
