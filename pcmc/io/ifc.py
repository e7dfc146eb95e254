"""IFC4 (.ifc), for building information models: a roof of one element per patch, with its properties.

The parts of an IfcRoof are an IfcSlab of type ROOF for each patch and an IfcWall for each wall, as
IfcTriangulatedFaceSet, and an IfcTendon for each cable. Members of a structural model are an IfcMember in the
place of a wall, which is an IfcVirtualElement then, an IfcBeam along an edge, an IfcColumn, or an IfcTendon
where they are cables and stays, with profile and material.
pcmc reads ``Pcmc_Surface`` back. The same surface gives the same bytes: the content makes the identifiers,
and the time stamp is always the same.
"""

from __future__ import annotations

import hashlib
import math
import uuid
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.errors import FileError
from ..base.libraries import load_library, read_arrays, require
from ..base.units import NEWTONS, TABLE, Units, length_factor
from ..base.validate import real
from ..forces.cables import pull_along
from ..forces.functional import patch_areas
from ..surface import Cable, Surface
from ..surface.geometry import file_origin
from .formats import Content
from .mesh_data import MeshData, support_of
from .metadata import parse_metadata, patch_meshes

SPACE = uuid.UUID("6fb0c1f4-5b0c-5f0b-9d5a-0b4c2f6f7a10")  # of our identifiers
TIME = "2000-01-01T00:00:00"
NAMES = {name: unit.ifc for name, unit in TABLE.items()}
NAMES |= {"N": "", "kN": "KILO", "MN": "MEGA", "lbf": "pound-force", "kip": "kip"}
FINDINGS = {  # in the property set of the certificate, by the name there
    "Verdict": ("IfcLabel", "verdict"),
    "Detail": ("IfcText", "detail"),
    "Mark": ("IfcLabel", "mark"),
    "MorseIndex": ("IfcInteger", "index"),
    "Residual": ("IfcReal", "residual"),
    "CurvatureError": ("IfcReal", "curvature_error"),
    "TriangleQuality": ("IfcReal", "quality"),
    "LoadRatio": ("IfcReal", "load_ratio"),
    "LowestEigenvalue": ("IfcReal", "lowest_eigenvalue"),
}
TYPES: dict[str, Any] = {"IfcText": str, "IfcLabel": str, "IfcInteger": int, "IfcReal": float}
Properties = Mapping[str, tuple[str, Any]]  # by name, the type and value


def write(path: Path, surface: Surface, content: Content) -> None:
    """The whole file; without a unit of length, its lengths are metres."""
    load_library("ifcopenshell", "ifc")
    model = _Model(surface, content.units or Units("m"), content)
    roof = model.add_roof()
    if content.certificate:
        model.add_properties("Pcmc_Certificate", roof, _findings(content.certificate))
    texts = {"Description": content.metadata} | ({} if content.walls is None else {"Walls": content.walls})
    model.add_properties("Pcmc_Surface", roof, {name: ("IfcText", text) for name, text in texts.items()})
    place = roof.ObjectPlacement
    parts = [model.add_part(*mesh, place) for mesh in patch_meshes(surface)]
    parts += [model.add_cable(cable, place) for cable in surface.cables]
    parts += [model.add_member(line, place) for line in content.members]
    model.aggregate("roof's parts", roof, parts)
    header = model.file.header  # without the time at which it was written
    header.file_name.time_stamp, header.file_name.originating_system = TIME, "pcmc"
    header.file_description.description = ("ViewDefinition [ReferenceView_V1.2]",)
    path.write_text(model.file.to_string(), encoding="ascii")


class _Model:
    """An IFC4 file that grows: each method adds entities."""

    def __init__(self, surface: Surface, units: Units, content: Content) -> None:
        import ifcopenshell

        self.surface, self.units = surface, units
        self.square_metres = length_factor(units.length, "m") ** 2  # in the roof's unit of area
        self.areas = patch_areas(surface) * self.square_metres
        self.name, self.place = ", ".join(filter(None, ("Roof", content.mark))), content.georeference
        self.replaced = {member.wall for member in content.members}
        self.cable_areas = content.cable_areas
        self.file: Any = ifcopenshell.file(schema="IFC4")
        self.add = self.file.create_entity
        digest = hashlib.sha256(content.metadata.encode())
        for array in (surface.vertices, surface.faces, surface.patch_of_face, support_of(surface)):
            digest.update(np.ascontiguousarray(array).tobytes())
        self.digest = digest.hexdigest()
        self.middle = file_origin(surface.vertices, surface.size)  # viewers work in single precision

    def rooted(self, kind: str, role: str, **values: Any) -> Any:
        """An entity with an identifier made from the surface and its role in the file."""
        from ifcopenshell.guid import compress

        return self.add(kind, GlobalId=compress(uuid.uuid5(SPACE, f"{self.digest} {role}").hex), **values)

    def axes(self, point: Iterable[float] = (0.0, 0.0, 0.0)) -> Any:
        origin = self.add("IfcCartesianPoint", Coordinates=tuple(map(float, point)))
        return self.add("IfcAxis2Placement3D", Location=origin)

    def placement(self, relative: Any = None, point: Iterable[float] = (0.0, 0.0, 0.0)) -> Any:
        return self.add("IfcLocalPlacement", PlacementRelTo=relative, RelativePlacement=self.axes(point))

    def of_force(self, measure: str) -> str:
        """The type of a number with a unit of force; without such a unit it is a bare number."""
        return measure if self.units.force else "IfcReal"

    def aggregate(self, role: str, whole: Any, parts: list[Any]) -> None:
        self.rooted("IfcRelAggregates", role, RelatingObject=whole, RelatedObjects=parts)

    def add_roof(self) -> Any:
        context = self.add(
            "IfcGeometricRepresentationContext",
            ContextType="Model",
            CoordinateSpaceDimension=3,
            Precision=1e-9 * self.surface.size,
            WorldCoordinateSystem=self.axes(),
        )
        about = {"ContextType": "Model", "ParentContext": context}
        kind = "IfcGeometricRepresentationSubContext"
        self.body = self.add(kind, ContextIdentifier="Body", TargetView="MODEL_VIEW", **about)
        self.axis = self.add(kind, ContextIdentifier="Axis", TargetView="GRAPH_VIEW", **about)
        self.add_georeference(context)
        about = {"RepresentationContexts": [context], "UnitsInContext": assigned_units(self.add, self.units)}
        whole, place = self.rooted("IfcProject", "project", Name=self.name, **about), None
        for kind in ("Site", "Building", "BuildingStorey"):
            place = self.placement(place)
            values = {"Name": kind.replace("BuildingS", "S"), "ObjectPlacement": place}
            part = self.rooted(f"Ifc{kind}", kind, CompositionType="ELEMENT", **values)
            self.aggregate(f"{kind} aggregated", whole, [part])
            whole = part
        place = self.placement(place, self.middle)
        about = {"Name": self.name, "ObjectPlacement": place, "PredefinedType": "FREEFORM"}
        roof = self.rooted("IfcRoof", "roof", **about)
        inside = {"RelatedElements": [roof], "RelatingStructure": whole}
        self.rooted("IfcRelContainedInSpatialStructure", "roof contained", **inside)
        return roof

    def add_georeference(self, context: Any) -> None:
        """The map's coordinate system, in metres, and how to get there from that of the file."""
        if (place := self.place) is None:
            return
        place.check(self.surface, self.units)
        metre, turn = self.add("IfcSIUnit", UnitType="LENGTHUNIT", Name="METRE"), math.radians(place.rotation)
        self.add(
            "IfcMapConversion",
            SourceCRS=context,
            TargetCRS=self.add("IfcProjectedCRS", Name=place.crs, MapUnit=metre),
            Eastings=place.eastings,
            Northings=place.northings,
            OrthogonalHeight=place.height,
            XAxisAbscissa=math.cos(turn),
            XAxisOrdinate=math.sin(turn),
            Scale=length_factor(self.units.length, "m"),
        )

    def add_part(self, k: int, color: Floats, used: Ints, faces: Ints, place: Any) -> Any:
        """The element of patch k, with its vertices and triangles as in ``patch_meshes``."""
        surface, patch = self.surface, self.surface.patches[k]
        points = (surface.vertices[used] - self.middle).tolist()
        places = self.add("IfcCartesianPointList3D", CoordList=points)
        mesh = self.add("IfcTriangulatedFaceSet", Coordinates=places, CoordIndex=(faces + 1).tolist())
        rgb = self.add("IfcColourRgb", None, *color.tolist())
        shading = self.add("IfcSurfaceStyleShading", SurfaceColour=rgb, Transparency=0.0)
        style = self.add("IfcSurfaceStyle", Name=patch.name, Side="BOTH", Styles=[shading])
        self.add("IfcStyledItem", Item=mesh, Styles=[style])
        kind, use = ("IfcWall", "NOTDEFINED") if surface.walls[k] else ("IfcSlab", "ROOF")
        about, shape = {"PredefinedType": use}, (self.body, "Tessellation", [mesh])
        if patch.name in self.replaced:
            kind, about = "IfcVirtualElement", {}
        element = self.element(kind, f"patch {k}", patch.name, place, shape, **about)
        per_area = self.of_force("IfcPlanarForceMeasure")
        values = {
            "Tension": (self.of_force("IfcLinearForceMeasure"), patch.tension),
            "Pressure": (per_area, patch.pressure),
            "Weight": (per_area, patch.weight),
            "Snow": (per_area, patch.snow),
            "Area": ("IfcAreaMeasure", float(self.areas[k])),
            "Supports": ("IfcText", "".join(map(str, support_of(surface)[used].tolist()))),
        }
        if patch.tension > 0.0 and not patch.weight:  # with one it differs from place to place
            values["TargetMeanCurvature"] = ("IfcCurvatureMeasure", patch.target_curvature)
        self.add_properties("Pcmc_Patch", element, values, str(k))
        return element

    def add_cable(self, cable: Cable, place: Any) -> Any:
        """The tendon of a cable: its axis as polylines, and its force."""
        chains = self.surface.topology.chains(cable.edges)
        lines = [self.polyline(self.surface.vertices[c.vertices], c.closed) for c in chains]
        pull = float(pull_along(self.surface, cable, np.unique(cable.edges)).max())  # a weight lets it vary
        about = {"TensionForce": pull if self.units.force else None, "PredefinedType": "NOTDEFINED"}
        if cable.name in self.cable_areas:
            about["CrossSectionArea"] = self.cable_areas[cable.name] * self.square_metres
        shape = self.axis, "Curve3D", lines
        tendon = self.element("IfcTendon", f"cable {cable.name}", cable.name, place, shape, **about)
        force = {"Force": (self.of_force("IfcForceMeasure"), pull)}
        self.add_properties("Pcmc_Cable", tendon, force, cable.name)
        return tendon

    def add_member(self, line: Any, place: Any) -> Any:
        """A member: a disk swept along its line, or a rectangle along each edge; its profile and material."""
        member, profile, sizes = line.member, line.member.profile, line.member.profile.sizes
        axis = self.polyline(line.points, line.closed)
        about = {"ProfileType": "AREA", "ProfileName": profile.label}
        if profile.shape == "rectangle":
            section = self.add("IfcRectangleProfileDef", XDim=sizes[0], YDim=sizes[1], **about)
            shape = self.body, "SweptSolid", self.extruded(line, section)
        elif profile.shape:
            radius, wall = 0.5 * sizes[0], sizes[1] if profile.shape == "tube" else 0.5 * sizes[0]
            hollow = {"WallThickness": wall} if wall < radius else {}
            kind = "IfcCircleHollowProfileDef" if hollow else "IfcCircleProfileDef"
            section = self.add(kind, Radius=radius, **hollow, **about)
            radii = {"Radius": radius, "InnerRadius": radius - wall if hollow else None}
            swept = self.add("IfcSweptDiskSolidPolygonal", Directrix=axis, **radii)
            shape = self.body, "AdvancedSweptSolid", [swept]
        else:  # an area and second moments alone have no shape
            section, shape = self.add("IfcProfileDef", **about), (self.axis, "Curve3D", [axis])
        kind = {"column": "IfcColumn", "stay": "IfcTendon", "cable": "IfcTendon"}.get(line.kind, "IfcBeam")
        kind = "IfcMember" if line.wall and kind == "IfcBeam" else kind
        use = "NOTDEFINED" if kind == "IfcTendon" else kind.removeprefix("Ifc").upper()
        area, about = profile.area * self.square_metres, {"PredefinedType": use}
        if kind == "IfcTendon":
            pull = max(line.forces) if line.forces and self.units.force else None
            about |= {"CrossSectionArea": area, "TensionForce": pull}
        element = self.element(kind, f"member {line.name}", line.name, place, shape, **about)
        material = self.add("IfcMaterial", Name=f"material of {line.name}")
        of_profile = self.add("IfcMaterialProfile", Name=line.name, Material=material, Profile=section)
        profiles = self.add("IfcMaterialProfileSet", Name=line.name, MaterialProfiles=[of_profile])
        used = self.add("IfcMaterialProfileSetUsage", ForProfileSet=profiles)
        ends = {"RelatedObjects": [element], "RelatingMaterial": used}
        self.rooted("IfcRelAssociatesMaterial", f"member {line.name} material", **ends)
        values = {
            "Kind": ("IfcLabel", line.kind),
            "Area": ("IfcAreaMeasure", area),
            "SecondMomentUpright": ("IfcMomentOfInertiaMeasure", profile.moments[0]),
            "SecondMomentAcross": ("IfcMomentOfInertiaMeasure", profile.moments[1]),
            "YoungsModulus": (self.of_force("IfcPlanarForceMeasure"), member.material.young),
            "PoissonsRatio": ("IfcReal", member.material.poisson),
        }
        if density := member.material.density:  # else it is not known, as of a column
            values["MassDensity"] = self.of_force("IfcMassDensityMeasure"), density
        for key, value in zip(("LeastForceAtRest", "LargestForceAtRest"), line.forces or (), strict=False):
            values[key] = self.of_force("IfcForceMeasure"), value
        self.add_properties("Pcmc_Member", element, values, line.name)
        return element

    def extruded(self, line: Any, section: Any) -> list[Any]:
        """A section along each edge of a line, its width across, its height in the upright plane."""
        solids = []
        segments = line.segments(np.array(self.surface.plane.normal))
        for start, (along, across, _), length in zip(*segments, strict=True):
            position = self.axes(start - self.middle)
            for name, direction in (("Axis", along), ("RefDirection", across)):
                setattr(position, name, self.add("IfcDirection", DirectionRatios=direction.tolist()))
            up = self.add("IfcDirection", DirectionRatios=(0.0, 0.0, 1.0))
            about = {"Position": position, "ExtrudedDirection": up, "Depth": float(length)}
            solids.append(self.add("IfcExtrudedAreaSolid", SweptArea=section, **about))
        return solids

    def polyline(self, places: Floats, closed: bool) -> Any:
        """A line through points (k,3)."""
        points = [self.add("IfcCartesianPoint", Coordinates=at) for at in (places - self.middle).tolist()]
        return self.add("IfcPolyline", Points=points + points[:1] * closed)

    def element(
        self, kind: str, role: str, name: str, place: Any, shape: tuple[Any, str, list[Any]], **values: Any
    ) -> Any:
        """A part of the roof; ``shape`` has the context, the type and the items of its representation."""
        (context, form, items), where = shape, self.placement(place)
        about = {"RepresentationIdentifier": context.ContextIdentifier, "RepresentationType": form}
        representation = self.add("IfcShapeRepresentation", ContextOfItems=context, Items=items, **about)
        whole = self.add("IfcProductDefinitionShape", Representations=[representation])
        return self.rooted(kind, role, Name=name, ObjectPlacement=where, Representation=whole, **values)

    def add_properties(self, name: str, of: Any, values: Properties, role: str = "") -> None:
        """A property set of an element: the type and value of each property."""
        rows = [(key, self.add(kind, value)) for key, (kind, value) in values.items()]
        listed = [self.add("IfcPropertySingleValue", Name=key, NominalValue=value) for key, value in rows]
        these = self.rooted("IfcPropertySet", f"{name} {role}", Name=name, HasProperties=listed)
        ends = {"RelatedObjects": [of], "RelatingPropertyDefinition": these}
        self.rooted("IfcRelDefinesByProperties", f"{name} {role} defined", **ends)


def _findings(certificate: Mapping[str, Any]) -> dict[str, tuple[str, Any]]:
    """The certificate's verdict and numbers, as far as they are there and finite."""
    found, values = dict[str, tuple[str, Any]](), dict(certificate)
    if len(eigenvalues := values.get("eigenvalues", ())):
        values["lowest_eigenvalue"] = eigenvalues[0]
    for name, (kind, key) in FINDINGS.items():
        value = values.get(key)
        if name == "Verdict" and value is not None:
            found[name] = kind, str(getattr(value, "name", value)).lower()
        elif value not in (None, "") and (kind != "IfcReal" or np.isfinite(real(value))):
            found[name] = kind, TYPES[kind](value)
    return found


def assigned_units(add: Callable[..., Any], units: Units) -> Any:
    """The units of length, angle, area, volume, curvature and second moments, and with a unit of force those
    of forces, tension, pressure and density, whose mass is force · s² / length; ``add`` makes an entity."""
    length = _unit(add, "LENGTHUNIT", "METRE", units.length, [1, 0, 0], length_factor(units.length, "m"))
    kinds = {"AREAUNIT": "SQUARE_METRE", "VOLUMEUNIT": "CUBIC_METRE", "PLANEANGLEUNIT": "RADIAN"}
    listed = [length, *(add("IfcSIUnit", UnitType=kind, Name=name) for kind, name in kinds.items())]
    derived = [("CURVATUREUNIT", [(length, -1)]), ("MOMENTOFINERTIAUNIT", [(length, 4)])]
    if units.force:
        force = _unit(add, "FORCEUNIT", "NEWTON", units.force, [1, 1, -2], NEWTONS[units.force])
        second = add("IfcSIUnit", UnitType="TIMEUNIT", Name="SECOND")
        listed += [force, second]
        derived += [("LINEARFORCEUNIT", [(force, 1), (length, -1)])]
        derived += [("PLANARFORCEUNIT", [(force, 1), (length, -2)])]
        derived += [("MASSDENSITYUNIT", [(force, 1), (second, 2), (length, -4)])]
    for kind, powers in derived:
        factors = [add("IfcDerivedUnitElement", Unit=unit, Exponent=power) for unit, power in powers]
        listed.append(add("IfcDerivedUnit", Elements=factors, UnitType=kind))
    return add("IfcUnitAssignment", Units=listed)


def _unit(add: Callable[..., Any], kind: str, name: str, unit: str, powers: list[int], size: float) -> Any:
    """A unit of the SI with its prefix, or one of this ``size`` in it, such as a foot."""
    prefix = NAMES[unit] if NAMES[unit].isupper() else None
    plain = add("IfcSIUnit", UnitType=kind, Prefix=prefix, Name=name)
    if prefix or not NAMES[unit]:
        return plain
    exponents = add("IfcDimensionalExponents", *powers, 0, 0, 0, 0)
    measure = "IfcLengthMeasure" if kind == "LENGTHUNIT" else "IfcForceMeasure"
    one = add("IfcMeasureWithUnit", ValueComponent=add(measure, size), UnitComponent=plain)
    about = {"UnitType": kind, "Name": NAMES[unit], "ConversionFactor": one}
    return add("IfcConversionBasedUnit", Dimensions=exponents, **about)


def read(path: Path) -> MeshData:
    """The surface in a file that pcmc wrote; other .ifc files are refused."""
    require("ifcopenshell", extra="ifc")
    arrays = read_arrays("io/reading_scripts.py", "ifc_arrays", path)
    if arrays["text"] is None or not arrays["parts"]:
        text = "pcmc reads only .ifc files that it wrote; export the mesh of the roof as .obj or .3dm"
        raise FileError(text, where="Pcmc_Surface")
    metadata = parse_metadata(arrays["text"])
    meshes = [(part["name"], part["points"], part["faces"]) for part in arrays["parts"]]
    if metadata.counts is not None:  # a vertex of two patches is in both, so vertices count for nothing
        metadata.check_counts(metadata.counts[0], sum(len(faces) for *_, faces in meshes))
    support = np.array(list(map(int, "".join(part["supports"] for part in arrays["parts"]))), dtype=np.int8)
    notes = ["its place on a map is left out"] * arrays["placed"]
    return metadata.of_meshes(meshes, support=support, walls=arrays["walls"], notes=notes)
