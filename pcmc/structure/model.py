"""The structural model: a surface with a material, a thickness and loads."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats, Ints, cached_array, mask_of
from ..base.errors import OptionError
from ..base.units import NO_UNITS, Units, length_factor
from ..certificate.certificate import certified
from ..forces.cables import directions
from ..forces.motion_space import perpendicular
from ..forces.pinching import standing_part
from ..forces.triangles import effective_tensions
from ..surface import Surface, expect_surface
from ..surface.geometry import area_vectors, face_areas, segment_lengths, unit_vectors, vertex_sums
from ..surface.lagrange import expect_flat
from ..surface.parts import Cable
from ..surface.supports import apply_supports
from .frames import balancing_force, corner_forces, in_planes
from .gas import KEPT, Gas
from .loads import (
    GRAVITY,
    Load,
    SelfWeight,
    Step,
    acting_together,
    check_combinations,
    check_loads,
    load_steps,
)
from .material import Material
from .members import WHOLE, Member, PlacedMember, bars_on, lines_on

ACROSS = 1e-3  # of a direction: a shorter projection gives no warp
THINNEST = 1e-9  # a thickness, in the size of the surface: thinner ones overflow the stresses


@dataclass(frozen=True, eq=False)
class StructuralModel:
    """A surface at rest as a membrane: each patch prestressed with α/t, which balances its pressure.

    Parameters
    ----------
    surface : a certified surface, or the result of a solver.
    material, thickness : of all patches, or one for each, by name; t > 0, length.
    loads : a step of the analysis for each; a tuple of loads acts in one step. The form-finding pressure is
        the first step and acts in all others, too, as self-weight does once it has come.
    anyway : accept a surface that is not certified; the file's heading then names its verdict.
    elements : "membrane", without bending stiffness, or "shell". CalculiX's shells of three nodes are too
        stiff in bending where triangles are much wider than thick: their deflections are too small.
    cable_area : length², of the sections of the surface's cables, or one for each, by name.
    cable_material, certificate : by default those of the patches, and the one of the surface.
    units : of the numbers; without a unit of length the gravity of ``SelfWeight`` takes metres.
    combinations : of each, by name, factors by the names of the steps, and of "form" for the form-finding
        load, such as {"uls": {"form": 1, "snow": 1.5}}: one more step each. The form-finding load and
        self-weight have the factor 1 where they are not named.
    gas : what is enclosed and changes its pressure with its volume; see ``Gas``. ``analyse`` finds it.
    members : beams and cables in the place of walls, which the model leaves out, along edges, or with a
        profile for a cable of the surface; columns and stays; see ``Member``.

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
    material: Material | Mapping[str, Material]
    thickness: float | Mapping[str, float]
    loads: Sequence[Load | tuple[Load, ...]] = ()
    anyway: bool = False
    elements: str = "membrane"
    cable_area: float | Mapping[str, float] | None = None
    cable_material: Material | None = None
    certificate: Any = field(default=None, repr=False)
    units: Units = NO_UNITS
    combinations: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    gas: Gas | None = None
    members: Sequence[Member] = ()

    def __post_init__(self) -> None:
        solved: Any = self.surface  # or a surface, which has neither of these
        surface = getattr(solved, "surface", solved)
        expect_surface(surface)
        expect_flat(surface, "the structural model")
        hint = "give Material(young=..., poisson=...)"
        for name, material in _each(self.material, surface.patches, "patch"):
            if not isinstance(material, Material):
                where = name if isinstance(self.material, Mapping) else None
                validate.refuse("material", material, "a Material", where, hint)
        thickness = checked_thickness(self.thickness, surface)
        validate.choice("elements", self.elements, ("membrane", "shell"))
        if self.elements == "shell" and any(plane.mirror for plane, _ in surface.on_planes):
            text = f"elements: shells would be hinged in a mirror; {WHOLE}, or pcmc.mirrored(surface)"
            raise OptionError(text, what="elements", found="shell")
        for name, kind in (("cable_material", Material), ("gas", Gas)):
            if not isinstance(getattr(self, name), kind | None):
                validate.refuse(name, getattr(self, name), f"a {kind.__name__} or None")
        if self.cable_material is None and surface.cables and isinstance(self.material, Mapping):
            validate.refuse("cable_material", None, "a Material, as the patches have several", hint=hint)
        if self.gas is not None:
            self.gas.check(surface, self.units)
        members = tuple(validate.sequence("members", self.members, "a sequence of Members"))
        if not all(isinstance(member, Member) for member in members):
            validate.refuse("members", self.members, "a sequence of Members")
        vars(self).update(surface=surface, thickness=thickness, members=members)
        vars(self)["loads"] = check_loads(self.loads, surface, [line.wall for line in self.lines])
        vars(self)["combinations"] = check_combinations(self.combinations, self.loads)
        self.bars  # noqa: B018
        of_lines = [line.member.material for line in self.beams] + [of for _, of in self.cable_sections]
        cables = self.standing.cable_edges.ends if self.elements == "shell" else ()
        for line in (line for line in self.beams if np.isin(cables, line.vertices).any()):
            text = f"elements: in shells a cable would be a hinge of {line.name!r}, which it meets"
            raise OptionError(f"{text}; take membranes", what="elements", found="shell")
        if self.weights and not any(material.density for material in (*self.materials, *of_lines)):
            validate.refuse("Material.density", 0.0, "a finite number > 0", hint="SelfWeight needs it")
        known = self.certificate or getattr(solved, "certificate", None)
        vars(self)["certificate"] = certified(surface, self.anyway, known)

    @property
    def weights(self) -> list[SelfWeight]:
        return [one for of in self.loads for one in acting_together(of) if isinstance(one, SelfWeight)]

    @property
    def note(self) -> str:
        """The units of the file's numbers, or what was assumed; that its steps keep the pressure of a gas."""
        known = f"no unit of length is given: gravity is {GRAVITY}, as in metres; give the units or gravity"
        if self.units or all(load.gravity for load in self.weights):
            known = f"{self.units.sentence}, masses in {self.units.mass}, times in s" if self.units else ""
        return "; ".join(filter(None, (known, KEPT if self.gas else "")))

    @cached_property
    def materials(self) -> tuple[Material, ...]:
        """The material of each patch."""
        return tuple(material for _, material in _each(self.material, self.surface.patches))

    def warps(self, patch: int) -> Floats:
        """(k,2,3) the directions of warp and weft in the elements of a patch of cloth; OptionError where the
        warp stands across a triangle."""
        s = self.standing
        P = s.vertices[s.faces[self.active[s.patch_of_face[self.active] == patch]]]
        normal, direction = unit_vectors(area_vectors(P)), np.array(self.materials[patch].warp)
        direction /= np.linalg.norm(direction) or 1.0
        warp = direction - (normal @ direction)[:, None] * normal
        length = np.linalg.norm(warp, axis=1)
        if length.min(initial=1.0) < ACROSS:
            at = "({:.4g}, {:.4g}, {:.4g})".format(*P[length.argmin()].mean(axis=0))
            text = f"Material.warp: at {at} {s.patches[patch].name!r} stands across the direction"
            raise OptionError(f"{text} {list(direction)}; give it another one", what="Material.warp")
        warp /= length[:, None]
        return np.stack([warp, np.cross(normal, warp)], axis=1)

    @cached_array
    def thicknesses(self) -> Floats:
        """(k,) thickness t of each patch."""
        return np.array([t for _, t in _each(self.thickness, self.surface.patches)], dtype=float)

    @cached_array
    def prestress(self) -> Floats:
        """(e,) the membrane stress of each element under the form-finding load, force/area: α/t, with a
        weight w per area (α + w z)/t, z the height of the middle above Π, as E = ∫ (α + w z) dA has it."""
        s, patch = self.standing, self.standing.patch_of_face[self.active]
        return effective_tensions(s, s.vertices, s.faces[self.active], patch) / self.thicknesses[patch]

    @cached_array
    def stresses(self) -> Floats:
        """(e,3,3) σ (I - ν ν): the prestress in the plane of each element, whose normal is ν."""
        corners = self.standing.vertices[self.standing.faces[self.active]]
        return self.prestress[:, None, None] * in_planes(corners)

    @cached_property
    def cable_sections(self) -> tuple[tuple[float, Material], ...]:
        """Of each cable of the standing surface the area of its section, length², and its material: those of
        a member, or of all cables, by default the patches' along their warp. A cable in a mirror plane is cut
        in half: it has half its tension, and half its section."""
        named = {str(one.on): one for one in self.members} | {line.name: line.member for line in self.lines}
        own = {name: (one.profile.area, one.material) for name, one in named.items()}
        others = checked_areas(self.cable_area, self.surface, without=own)
        usual = self.cable_material or replace(self.materials[0], weft=None, shear=None)
        mirrors = [mask for plane, mask in self.standing.on_planes if plane.mirror]
        found = [(c, *own.get(c.name, (others.get(c.name, 0.0), usual))) for c in self.standing.cables]
        cuts = [sum(bool(mask[c.edges].all()) for mask in mirrors) for c, *_ in found]
        return tuple((area * 0.5**k, of) for k, (_, area, of) in zip(cuts, found, strict=True))

    @property
    def cable_areas(self) -> dict[str, float]:
        """Those areas by the names of the cables."""
        return {cable.name: area for cable, area, *_ in self.cable_edges()}

    def cable_edges(self) -> Iterator[tuple[Cable, float, Material, Ints, Floats]]:
        """Each cable, the area of its section, its material, and the numbers (k,) and directions (k,3) of its
        elements, which come after the faces' numbers."""
        first = self.surface.m + 1
        for cable, (area, material) in zip(self.standing.cables, self.cable_sections, strict=True):
            along = directions(self.standing.vertices, cable.edges)[0]
            yield cable, area, material, first + np.arange(len(along)), along
            first += len(along)

    @cached_array
    def beam_vertices(self) -> Ints:
        """The vertices of beams."""
        return np.unique([v for beam in self.beams for v in beam.vertices.tolist()]).astype(np.int64)

    @cached_property
    def member_nodes(self) -> tuple[Ints, list[Ints]]:
        """The vertices (k,) where beams, and the cables of shells, have nodes of their own, tied to those of
        the sheets, with numbers after the vertices'; and of each beam the places (b+1,) of its points there.
        At a fixed vertex each beam with a hinged end has its own, to bend without those beside it."""
        cables = self.standing.cables if self.elements == "shell" else ()
        tied = np.unique(np.concatenate([self.beam_vertices, *(cable.edges.ravel() for cable in cables)]))
        bars = np.bincount([v for beam in self.beams for v in beam.pairs.ravel()], minlength=self.surface.n)
        vertices, places = tied.tolist(), list[Ints]()
        for beam in self.beams:
            places.append(np.searchsorted(tied, np.append(beam.pairs[:, 0], beam.pairs[-1, 1])))
            for end in (0, -1) if beam.member.ends == "hinged" and not beam.closed else ():
                if self.held[v := beam.vertices[end]] and self.freedom[v] == 0 and bars[v] > 1:
                    places[-1][end], bars[v] = len(vertices), bars[v] - 1
                    vertices.append(int(v))
        return np.array(vertices, dtype=np.int64), places

    @cached_property
    def lines(self) -> tuple[PlacedMember, ...]:
        """The lines of the members, but for those of the surface's own cables."""
        return lines_on(self.surface, self.members)

    @cached_property
    def beams(self) -> tuple[PlacedMember, ...]:
        """Those that are beams."""
        return tuple(line for line in self.lines if line.member.kind == "beam")

    @cached_property
    def bars(self) -> tuple[PlacedMember, ...]:
        """The columns and stays: they carry what the points of supports do, and are no elements."""
        return bars_on(self.surface, self.members, self.lines)

    @cached_property
    def standing(self) -> Surface:
        """The surface without pinched walls: its vertices, and the faces that are elements. Members that are
        cables are cables of it."""
        s, more = standing_part(self.surface).surface, list[Cable]()
        for line in (line for line in self.lines if line.member.kind == "cable"):
            wall = s.patch_index(line.wall)  # in whose place it has the tension that balances the sheets best
            faces = s.faces[s.patch_of_face == wall]
            P = s.vertices[faces]
            load = s.net_pressures[wall] / 3.0 * area_vectors(P)[:, None]
            of_wall = vertex_sums(corner_forces(P, s.tensions[wall] * in_planes(P)) + load, faces, s.n)
            N, _ = balancing_force(s.vertices[line.vertices], -of_wall[line.vertices], line.closed)
            if N <= 0.0:
                text = f'member {line.name!r}: the sheets press along it; no cable can; kind = "beam" does'
                raise OptionError(text, what="Member.kind", where=line.name, found="cable")
            more.append(Cable(line.name, N, np.sort(line.pairs, axis=1)))
        return s.rebuilt(cables=(*s.cables, *more)) if more else s

    @cached_array
    def active(self) -> Ints:
        """(e,) the faces of the standing surface with a tension or a pressure, but for walls with a member in
        their place: the others carry nothing."""
        pulls = (self.surface.tensions != 0.0) | (self.surface.net_pressures != 0.0)
        pulls[[self.surface.patch_index(line.wall) for line in self.lines if line.wall]] = False
        return np.flatnonzero(pulls[self.standing.patch_of_face])

    @cached_array
    def faces(self) -> Ints:
        """(e,) the face of the surface that each element is; the element's number is one more."""
        return standing_part(self.surface).faces_of_whole[self.active]

    @cached_array
    def nodes(self) -> Bools:
        """(n,) the vertices of elements."""
        s = self.standing
        used = s.faces[self.active].ravel(), self.beam_vertices, s.cable_edges.ends.ravel()
        return mask_of(np.concatenate(used), s.n)

    @cached_array
    def on_members(self) -> Bools:
        """(n,) the vertices that members carry in the place of walls and supports."""
        on = [np.empty(0, int), *(line.vertices for line in self.lines)]
        return mask_of(np.concatenate(on), self.surface.n) & ~self.held

    @cached_array
    def freed(self) -> Ints:
        """(n,) what a member carries in the place of a support: 1 where it is propped, 2 where it is not."""
        found = np.zeros(self.surface.n, dtype=np.int64)
        for line in (line for line in self.lines if not line.wall):  # all of it but its ends
            found[line.vertices if line.closed else line.vertices[1:-1]] = 1 if line.member.propped else 2
        return found

    @cached_array
    def allowed(self) -> Floats:
        """(n,3,3) the projection onto the directions in which the supports let each vertex move."""
        columns = [apply_supports(self.standing, np.tile(axis, (self.surface.n, 1))) for axis in np.eye(3)]
        allowed, up = np.stack(columns, axis=2), self.surface.plane.normal
        allowed[self.freed == 1] = np.eye(3) - np.outer(up, up)
        allowed[self.freed == 2] = np.eye(3)
        return allowed

    @cached_array
    def held(self) -> Bools:
        """(n,) the nodes that a support holds."""
        return self.nodes & self.standing.held & (self.freed < 2)

    @cached_array
    def freedom(self) -> Ints:
        """(n,) the number of directions in which each vertex can move: 0 fixed, 1 on a line, 2 on a plane."""
        return np.rint(np.trace(self.allowed, axis1=1, axis2=2)).astype(np.int64)

    @cached_array
    def axes(self) -> Floats:
        """(n,3,3) rows: the axes in which supports hold a vertex. On a plane the first is its normal, held;
        along a line it is the line, and the others are held."""
        axes = np.tile(np.eye(3), (self.surface.n, 1, 1))
        guided = np.flatnonzero(self.held & (self.freedom > 0))
        along = self.allowed[guided]
        first = np.where((self.freedom[guided] == 2)[:, None, None], np.eye(3) - along, along)
        longest = np.linalg.norm(first, axis=1).argmax(axis=1)  # all columns are multiples of one direction
        first = unit_vectors(np.take_along_axis(first, longest[:, None, None], axis=2)[:, :, 0])
        axes[guided] = np.stack([first, *perpendicular(first)], axis=1)
        return axes

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        """The steps of the analysis, the form-finding load first."""
        metre = length_factor("m", self.units.length) if self.units.length else 1.0
        return load_steps(self.standing, self.loads, GRAVITY * metre, self.combinations)

    def nodal_loads(self, step: Step, displacements: Floats | None = None) -> Floats:
        """(n,3) the loads of a step as forces on the vertices: thirds of triangles', halves of cable edges';
        ``displacements`` (n,3) turn the pressures with the surface."""
        s, down = self.standing, -np.array(self.standing.plane.normal)
        X = s.vertices if displacements is None else s.vertices + displacements
        density = np.array([material.density for material in self.materials])
        of_faces = (density * self.thicknesses)[s.patch_of_face] * face_areas(s.vertices[s.faces])
        per_face = (
            step.pressures[:, None] * area_vectors(X[s.faces]) + step.gravity * of_faces[:, None] * down
        )
        forces = step.forces + vertex_sums(per_face[self.active] / 3.0, s.faces[self.active], s.n)
        masses = sum((beam.masses(s.vertices) for beam in self.beams), np.zeros(s.n))
        for cable, area, of, *_ in self.cable_edges():
            half = 0.5 * area * of.density * segment_lengths(s.vertices, cable.edges)
            np.add.at(masses, cable.edges, half[:, None])
        return forces + step.gravity * masses[:, None] * down


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


def checked_areas(given: object, surface: Surface, without: Container[str] = ()) -> dict[str, float]:
    """The area of each cable's section by name, from one number or one by name; not of those ``without``."""
    limits: dict[str, Any] = {"least": (THINNEST * surface.size) ** 2, "most": surface.size**2}
    wanting = [cable.name for cable in surface.cables if cable.name not in without]
    if given is None and wanting:
        text = f"cable_area is missing: give the area of the section of cable {wanting[0]!r}, length²"
        raise OptionError(text, what="cable_area", where=wanting[0])
    if given is not None and not isinstance(given, Mapping):
        validate.number("cable_area", given, **limits)
        if not wanting:
            text = "cable_area: no cable of the surface needs it; leave it out"
            raise OptionError(text, what="cable_area", found=given)
    areas = dict(_each(given, surface.cables, "cable"))
    return {name: validate.number("cable_area", areas[name], where=name, **limits) for name in wanting}


def _each(given: Any, parts: Iterable[Any], kind: str = "") -> list[tuple[str, Any]]:
    """The name of each part, and the value given for it or for all; a ``kind`` refuses other names."""
    names = [part.name for part in parts]
    if not isinstance(given, Mapping):
        return [(name, given) for name in names]
    for name in given if kind else ():
        validate.choice(kind, name, names)
    return [(name, given.get(name)) for name in names]
