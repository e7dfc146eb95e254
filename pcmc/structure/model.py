"""The structural model: a surface with a material, a thickness and loads."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats, Ints, cached_array
from ..base.errors import OptionError
from ..base.units import NO_UNITS, Units, length_factor
from ..certificate import Certificate
from ..certificate.certificate import certified
from ..forces.cables import directions
from ..forces.pinching import standing_part
from ..forces.triangles import effective_tensions
from ..surface import Surface, expect_surface
from ..surface.checks import LARGEST, SMALLEST
from ..surface.geometry import area_vectors, face_areas, segment_lengths, vertex_sums
from ..surface.parts import Cable
from ..surface.supports import apply_supports
from .loads import GRAVITY, Load, SelfWeight, Snow, Step, Wind, acting_together, check_loads, load_steps

THINNEST = 1e-9  # a thickness, in the size of the surface: thinner ones overflow the stresses


@dataclass(frozen=True)
class Material:
    """A linear elastic, isotropic material.

    Parameters
    ----------
    young : E > 0, force per area.
    poisson : ν, 0 ≤ ν < 0.5.
    density : ρ ≥ 0, mass per volume, in the mass that a unit of force accelerates by a unit of length per
        s²: t/m³ with kN and m, t/mm³ with N and mm, slug/ft³ with lbf and ft.

    >>> Material(young=1e6)
    Material(young=1000000.0, poisson=0.3, density=0.0)
    """

    young: float
    poisson: float = 0.3
    density: float = 0.0

    def __post_init__(self) -> None:
        most: dict[str, Any] = {"most": LARGEST}
        limits = {"young": {"least": SMALLEST, **most}, "poisson": {"least": 0.0, "below": 0.5}}
        for name, bounds in (limits | {"density": {"least": 0.0, **most}}).items():
            vars(self)[name] = validate.number(f"Material.{name}", getattr(self, name), **bounds)


@dataclass(frozen=True, eq=False)
class StructuralModel:
    """A surface at rest as a membrane: each patch prestressed with α/t, which balances its pressure.

    Parameters
    ----------
    surface : a certified surface, or the result of a solver.
    material : of all patches.
    thickness : t > 0, length, or one for each patch, by name.
    loads : a step of the analysis for each; a tuple of loads acts in one step. The form-finding pressure is
        the first step and acts in all others, too, as self-weight does once it has come.
    anyway : accept a surface that is not certified; the file's heading then names its verdict.
    elements : "membrane", without bending stiffness, or "shell". CalculiX's shells of three nodes are too
        stiff in bending where triangles are much wider than thick: their deflections are too small.
    cable_area : length², of the sections of the surface's cables, or one for each, by name.
    cable_material, certificate : by default those of the patches, and the one of the surface.
    units : of the numbers: for the file's heading, and for the gravity of ``SelfWeight`` where it is not
        given. Without a unit of length that takes metres.

    Raises
    ------
    OptionError : for a material, thickness or load that is not allowed or names no patch.
    SurfaceError : for a surface that is not certified.

    Examples
    --------
    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> model = StructuralModel(roof, Material(young=1e6), thickness=0.001)
    >>> model.prestress.tolist(), [step.name for step in model.steps]
    ([1000.0, 1000.0, 1000.0, 1000.0], ['form pressure'])
    """

    surface: Surface
    material: Material
    thickness: float | Mapping[str, float]
    loads: Sequence[Load | tuple[Load, ...]] = ()
    anyway: bool = False
    elements: str = "membrane"
    cable_area: float | Mapping[str, float] | None = None
    cable_material: Material | None = None
    certificate: Any = field(default=None, repr=False)
    units: Units = NO_UNITS

    def __post_init__(self) -> None:
        solved: Any = self.surface  # or a surface, which has neither of these
        surface = getattr(solved, "surface", solved)
        expect_surface(surface)
        if not isinstance(self.material, Material):
            hint = "give Material(young=..., poisson=...)"
            validate.refuse("material", self.material, "a Material", hint=hint)
        thickness = checked_thickness(self.thickness, surface)
        validate.choice("elements", self.elements, ("membrane", "shell"))
        checked_areas(self.cable_area, surface)
        if not isinstance(self.cable_material, Material | None):
            validate.refuse("cable_material", self.cable_material, "a Material or None")
        vars(self).update(surface=surface, thickness=thickness, loads=check_loads(self.loads, surface))
        if self.material.density == 0.0 and self.weights:
            hint = "SelfWeight needs it"
            validate.refuse("Material.density", 0.0, "a finite number > 0", hint=hint)
        known = self.certificate or getattr(solved, "certificate", None)
        vars(self).update(certificate=certified(surface, self.anyway, known))

    @property
    def weights(self) -> list[SelfWeight]:
        single = [load for entry in self.loads for load in acting_together(entry)]
        return [load for load in single if isinstance(load, SelfWeight)]

    @property
    def verdict(self) -> str:
        """The sentence of the certificate's verdict."""
        return str(self.certificate.verdict.value)

    @property
    def certified(self) -> bool:
        """Whether the surface is certified."""
        return bool(self.certificate.certified)

    @property
    def note(self) -> str:
        """The units of the file's numbers in a line, or what was assumed as they are not known."""
        if self.units:
            return f"{self.units.sentence}, masses in {self.units.mass}, times in s"
        if all(load.gravity for load in self.weights):
            return ""
        return f"no unit of length is given: gravity is {GRAVITY}, as in metres; give the units or gravity"

    @cached_array
    def thicknesses(self) -> Floats:
        """(k,) thickness t of each patch."""
        return np.array([t for _, t in _each(self.thickness, self.surface.patches)], dtype=float)

    @cached_array
    def prestress(self) -> Floats:
        """(e,) the membrane stress of each element under the form-finding load, force/area: α/t, with a
        weight w per area (α + w z)/t, z the height of the middle above Π, as E = ∫ (α + w z) dA has it.
        """
        s = self.standing
        faces, patch = s.faces[self.active], s.patch_of_face[self.active]
        return effective_tensions(s, s.vertices, faces, patch) / self.thicknesses[patch]

    @cached_property
    def cable_areas(self) -> tuple[float, ...]:
        """The area of each cable's section, length²; its elements come after the faces' numbers."""
        return checked_areas(self.cable_area, self.surface)

    def cable_edges(self) -> Iterator[tuple[Cable, float, Ints, Floats]]:
        """Each cable, the area of its section, and the numbers (k,) and directions (k,3) of its elements."""
        first = self.surface.m + 1
        for cable, area in zip(self.standing.cables, self.cable_areas, strict=True):
            along = directions(self.standing.vertices, cable.edges)[0]
            yield cable, area, first + np.arange(len(along)), along
            first += len(along)

    @cached_property
    def standing(self) -> Surface:
        """The surface without pinched walls: its vertices, and the faces that are elements."""
        return standing_part(self.surface).surface

    @cached_array
    def active(self) -> Ints:
        """(e,) the faces of the standing surface with a tension or a pressure: the others carry nothing."""
        pulls = (self.surface.tensions != 0.0) | (self.surface.net_pressures != 0.0)
        return np.flatnonzero(pulls[self.standing.patch_of_face])

    @cached_array
    def faces(self) -> Ints:
        """(e,) the face of the surface that each element is; the element's number is one more."""
        return standing_part(self.surface).faces_of_whole[self.active]

    @cached_array
    def nodes(self) -> Bools:
        """(n,) the vertices of elements."""
        used = np.zeros(self.surface.n, dtype=bool)
        used[self.standing.faces[self.active]] = True
        for cable in self.standing.cables:
            used[cable.edges] = True
        return used

    @cached_array
    def allowed(self) -> Floats:
        """(n,3,3) the projection onto the directions in which the supports let each vertex move."""
        columns = [apply_supports(self.standing, np.tile(axis, (self.surface.n, 1))) for axis in np.eye(3)]
        return np.stack(columns, axis=2)

    @cached_array
    def held(self) -> Bools:
        """(n,) the nodes that a support holds."""
        return self.nodes & self.standing.held

    @cached_array
    def freedom(self) -> Ints:
        """(n,) the number of directions in which each vertex can move: 0 fixed, 1 on a line, 2 on a plane."""
        return np.rint(np.trace(self.allowed, axis1=1, axis2=2)).astype(np.int64)

    @cached_array
    def axes(self) -> Floats:
        """(n,3,3) rows: the axes in which supports hold a vertex. On a plane the first is its normal, held;
        along a line it is the line, and the others are held.
        """
        axes = np.tile(np.eye(3), (self.surface.n, 1, 1))
        guided = np.flatnonzero(self.held & (self.freedom > 0))
        along = self.allowed[guided]
        first = np.where((self.freedom[guided] == 2)[:, None, None], np.eye(3) - along, along)
        longest = np.linalg.norm(first, axis=1).argmax(axis=1)  # all columns are multiples of one direction
        first = np.take_along_axis(first, longest[:, None, None], axis=2)[:, :, 0]
        first /= np.linalg.norm(first, axis=1)[:, None]
        second = np.cross(np.eye(3)[np.abs(first).argmin(axis=1)], first)
        second /= np.linalg.norm(second, axis=1)[:, None]
        axes[guided] = np.stack([first, second, np.cross(first, second)], axis=1)
        return axes

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        """The steps of the analysis, the form-finding load first."""
        metre = length_factor("m", self.units.length) if self.units.length else 1.0
        return load_steps(self.standing, self.loads, GRAVITY * metre)

    def nodal_loads(self, step: Step, displacements: Floats | None = None) -> Floats:
        """(n,3) the loads of a step as forces on the vertices: thirds of triangles', halves of cable edges';
        ``displacements`` (n,3) turn the pressures with the surface.
        """
        s, down = self.standing, -np.array(self.standing.plane.normal)
        X = s.vertices if displacements is None else s.vertices + displacements
        per_face = step.pressures[s.patch_of_face, None] * area_vectors(X[s.faces])
        mass = self.material.density * self.thicknesses[s.patch_of_face] * face_areas(s.vertices[s.faces])
        per_face += step.gravity * mass[:, None] * down
        forces = step.forces + vertex_sums(per_face[self.active] / 3.0, s.faces[self.active], s.n)
        density = (self.cable_material or self.material).density
        for cable, area, *_ in self.cable_edges():
            half = 0.5 * density * area * step.gravity * segment_lengths(s.vertices, cable.edges)
            forces += np.bincount(cable.edges.ravel(), np.repeat(half, 2), s.n)[:, None] * down
        return forces


@dataclass(frozen=True)
class Structure:
    """Material, thickness and loads of the structural model, in the units of the surface.

    Attributes
    ----------
    young : Young's modulus E > 0, force per area.
    poisson : Poisson's ratio ν, 0 ≤ ν < 0.5.
    density : mass per volume, as of ``Material``: t/m³ with kN and m. With a density, self-weight is a load.
    thickness : of all patches, length, or a table with one for each patch.
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

    def __post_init__(self) -> None:  # refuses bad values before any work
        for name in ("young", "thickness"):
            if getattr(self, name) is None:
                text = f"a structural model needs {name}; give --{name} or the key {name} of [structure]"
                raise OptionError(text, what=name)
        self.material, self.loads  # noqa: B018

    @property
    def material(self) -> Material:
        """The material of the patches and cables."""
        return Material(young=self.young or 0.0, poisson=self.poisson, density=self.density)

    @property
    def loads(self) -> tuple[Load, ...]:
        """Self-weight, snow and wind, each in a step of its own."""
        weight = [SelfWeight(self.gravity)] if self.density > 0.0 else []
        snow = [Snow(self.snow)] if self.snow != 0.0 else []
        return (*weight, *snow, *([Wind(self.wind)] if self.wind else []))

    def check(self, surface: Surface) -> None:
        """Refuse values that name no patch or cable of the surface, before it is solved."""
        checked_thickness(self.thickness, surface)
        check_loads(self.loads, surface)
        checked_areas(self.cable_area, surface)

    def model(
        self,
        surface: Any,
        anyway: bool = False,
        certificate: Certificate | None = None,
        units: Units = NO_UNITS,
    ) -> StructuralModel:
        """The structural model of a surface at rest or of a result; errors as in ``pcmc.StructuralModel``."""
        about: dict[str, Any] = {"cable_area": self.cable_area, "certificate": certificate, "units": units}
        thickness = self.thickness or 0.0
        return StructuralModel(surface, self.material, thickness, self.loads, anyway=anyway, **about)


def expect_model(value: object) -> None:
    """Refuse anything but a StructuralModel."""
    if not isinstance(value, StructuralModel):
        validate.refuse("model", type(value).__name__, "a StructuralModel")


def checked_thickness(given: object, surface: Surface) -> float | dict[str, float]:
    """A number > 0, or one for each patch of the surface, between 1e-9 of its size and its size."""
    limits: dict[str, Any] = {"least": THINNEST * surface.size, "most": surface.size}
    if not isinstance(given, Mapping):
        return validate.number("thickness", given, **limits)
    values = _each(given, surface.patches, "patch")
    return {name: validate.number("thickness", value, where=name, **limits) for name, value in values}


def checked_areas(given: object, surface: Surface) -> tuple[float, ...]:
    """The area of each cable's section, from one number or one by name."""
    limits: dict[str, Any] = {"least": (THINNEST * surface.size) ** 2, "most": surface.size**2}
    if given is None and surface.cables:
        name = surface.cables[0].name
        message = f"cable_area is missing: give the area of the section of cable {name!r}, length²"
        raise OptionError(message, what="cable_area", where=name)
    areas = _each(given, surface.cables, "cable")
    return tuple(validate.number("cable_area", area, where=name, **limits) for name, area in areas)


def _each(given: Any, parts: Iterable[Any], kind: str = "") -> list[tuple[str, Any]]:
    """The name of each part, and the value given for it or for all; a ``kind`` refuses other names."""
    names = [part.name for part in parts]
    if not isinstance(given, Mapping):
        return [(name, given) for name in names]
    for name in given if kind else ():
        validate.choice(kind, name, names)
    return [(name, given.get(name)) for name in names]
