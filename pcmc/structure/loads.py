"""Loads on a structural model, and the steps that they make."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base import validate
from ..base.arrays import Floats
from ..base.units import length_factor
from ..surface import Surface
from ..surface.checks import LARGEST, SMALLEST
from ..surface.geometry import area_vectors, face_areas, vertex_sums

GRAVITY = 9.81  # m/s²


def standard_gravity(length: str) -> float:
    """9.81 m/s² in a unit of length per s²; without a unit, in metres.

    >>> standard_gravity("mm"), round(standard_gravity("ft"), 3), standard_gravity("")
    (9810.0, 32.185, 9.81)
    """
    return GRAVITY * (length_factor("m", length) if length else 1.0)


@dataclass(frozen=True)
class SelfWeight:
    """The weight of the elements, ρ t g per area, against Π's normal; it stays in all later steps.

    Parameters
    ----------
    gravity : g > 0, length/time²; by default 9.81 m/s² in the model's unit of length, and seconds.
    name : of its step.
    """

    gravity: float | None = None
    name: str = "self-weight"

    def __post_init__(self) -> None:
        if self.gravity is not None:
            object.__setattr__(
                self,
                "gravity",
                validate.number("SelfWeight.gravity", self.gravity, least=SMALLEST, most=LARGEST),
            )
        _check_name(self.name)


@dataclass(frozen=True)
class Snow:
    """A load per plan area, against Π's normal, besides the snow that the form was found under.

    It keeps its size and direction while the surface deforms.

    Parameters
    ----------
    load : s, force per area of the plan; negative for a lift.
    patches : names of the patches that carry it; by default all that are not walls.
    name : of its step.
    """

    load: float
    patches: Sequence[str] = ()
    name: str = "snow"

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "load", validate.number("Snow.load", self.load, least=-LARGEST, most=LARGEST)
        )
        if isinstance(self.patches, str) or not isinstance(self.patches, Sequence):
            validate.refuse("Snow.patches", self.patches, "a sequence of patch names")
        object.__setattr__(self, "patches", tuple(self.patches))
        _check_name(self.name)


@dataclass(frozen=True)
class Wind:
    """Pressures of wind zones, which are patches. They add to the patches' own pressures.

    Parameters
    ----------
    pressures : force per area by patch name, along the patch's positive normal as ``Patch.pressure``: above
        0 for suction on a roof. The load follows the normal while the surface deforms.
    name : of its step.
    """

    pressures: Mapping[str, float]
    name: str = "wind"

    def __post_init__(self) -> None:
        if not isinstance(self.pressures, Mapping) or not self.pressures:
            validate.refuse(
                "Wind.pressures", self.pressures, "pressures by patch name, such as {'roof': 0.5}"
            )
        checked = {
            zone: validate.number("Wind.pressures", value, least=-LARGEST, most=LARGEST, where=str(zone))
            for zone, value in self.pressures.items()
        }
        object.__setattr__(self, "pressures", checked)
        _check_name(self.name)


Load = SelfWeight | Snow | Wind


@dataclass(frozen=True, eq=False)
class Step:
    """All loads at the end of a step of the analysis.

    Attributes
    ----------
    name : "form pressure" ("… less snow", where the form was found under snow), or the names of its loads.
    pressures : (k,) force per area on each patch along its normal; the form's, net of its snow, and wind.
    forces : (n,3) forces on the vertices that keep their direction.
    gravity : length/time², 0 without self-weight.
    """

    name: str
    pressures: Floats
    forces: Floats
    gravity: float = 0.0


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
    name = "form pressure less snow" if surface.snows.any() else "form pressure"
    form = Step(name, surface.net_pressures, _dead_weight(surface))
    permanent, steps = form, [form]
    for entry in loads:
        together = entry if isinstance(entry, tuple) else (entry,)
        step = replace(permanent, name=" and ".join(load.name for load in together))
        for load in together:
            step = _added(step, load, surface, gravity)
            if isinstance(load, SelfWeight):
                permanent = replace(permanent, gravity=step.gravity)
        steps.append(step)
    return tuple(steps)


def _added(step: Step, load: Load, surface: Surface, gravity: float) -> Step:
    """The step with one more load."""
    if isinstance(load, SelfWeight):
        return replace(step, gravity=gravity if load.gravity is None else load.gravity)
    if isinstance(load, Snow):
        return replace(step, forces=step.forces + _snow(surface, load))
    pressures = step.pressures.copy()
    for zone, value in load.pressures.items():
        pressures[surface.patch_index(zone)] += value
    return replace(step, pressures=pressures)


def _snow(surface: Surface, snow: Snow) -> Floats:
    """(n,3) a third of each triangle's load at each of its corners; triangles below others carry none."""
    named = [surface.patch_index(name) for name in snow.patches]
    carrying = named or np.flatnonzero(surface.roof).tolist()
    if not carrying:
        hint = "all patches are walls; name those that carry snow"
        validate.refuse("Snow.patches", snow.patches, "names of patches", hint=hint)
    normal = np.array(surface.plane.normal)
    plan = area_vectors(surface.vertices[surface.faces]) @ normal
    side = np.sign(np.bincount(surface.patch_of_face, plan, len(surface.patches)))
    plan = np.maximum(plan * side[surface.patch_of_face], 0.0)
    plan[~np.isin(surface.patch_of_face, carrying)] = 0.0
    return -snow.load / 3.0 * vertex_sums(plan[:, None] * normal, surface.faces, surface.n)


def _dead_weight(surface: Surface) -> Floats:
    """(n,3) forces of the patches' own weights per area, which belong to the form-finding load."""
    per_face = surface.weights[surface.patch_of_face] * face_areas(surface.vertices[surface.faces])
    downwards = -np.array(surface.plane.normal) / 3.0
    return vertex_sums(per_face[:, None] * downwards, surface.faces, surface.n)


def check_loads(loads: object, surface: Surface) -> tuple[Load | tuple[Load, ...], ...]:
    """Loads, or tuples of them, whose patches are there."""
    expected = "a sequence of SelfWeight, Snow or Wind, or of tuples of these"
    if isinstance(loads, Load) or not isinstance(loads, Sequence):
        validate.refuse("loads", loads, expected)
    for entry in loads:
        together = entry if isinstance(entry, tuple) and entry else (entry,)
        for load in together:
            if not isinstance(load, Load):
                validate.refuse("loads", load, expected)
            named = load.pressures if isinstance(load, Wind) else getattr(load, "patches", ())
            for name in named:
                surface.patch_index(name)
    return tuple(loads)


def _check_name(name: object) -> None:
    """A name is a line of text."""
    if not isinstance(name, str) or not name.strip() or "\n" in name:
        validate.refuse("name of a load", name, "a line of text")
