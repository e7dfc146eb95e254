"""IFC4 (.ifc), for building information models: a roof of one element per patch, with its properties.

Project, site, building, storey and one IfcRoof. Its parts are an IfcSlab of type ROOF for each patch and an
IfcWall for each wall, with an IfcTriangulatedFaceSet in double precision, a colour, and the property set
``Pcmc_Patch``; and an IfcTendon for each cable, with its axis, its force, and ``Pcmc_Cable``. The roof has
``Pcmc_Certificate`` and, so that pcmc can read the file, ``Pcmc_Surface``. The same surface gives the same
bytes: the content makes the identifiers, and the time stamp is always the same.
"""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Callable, Iterable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.errors import FileError, MissingExtra
from ..base.units import NEWTONS, TABLE, Units, length_factor
from ..forces.functional import patch_areas
from ..surface import Cable, Surface
from ..surface.origin import file_origin
from .libraries import load_library
from .mesh_data import MeshData, support_of
from .metadata import parse_metadata
from .patch_meshes import patch_meshes
from .reading_process import read_arrays

SPACE = uuid.UUID("6fb0c1f4-5b0c-5f0b-9d5a-0b4c2f6f7a10")  # of our identifiers
TIME = "2000-01-01T00:00:00"
NAMES = {name: unit.ifc for name, unit in TABLE.items()}
NAMES |= {"N": "", "kN": "KILO", "MN": "MEGA", "lbf": "pound-force", "kip": "kip"}
NUMBERS = {  # in the property set of the certificate, by the name there
    "Residual": "residual",
    "CurvatureError": "curvature_error",
    "TriangleQuality": "quality",
    "LoadRatio": "load_ratio",
}


def write(
    path: Path,
    surface: Surface,
    certificate: Mapping[str, Any],
    walls: str | None,
    units: Units,
    metadata: str,
    **_: Any,
) -> None:
    """The whole file; without a unit of length, its lengths are metres."""
    load_library("ifcopenshell", "ifc")
    model = _Model(surface, units, metadata)
    roof = model.add_roof(certificate, walls)
    areas = patch_areas(surface) * length_factor(units.length, "m") ** 2
    parts = []
    for k, color, used, faces in patch_meshes(surface):
        parts.append(model.add_part(k, color, used, faces, float(areas[k]), roof.ObjectPlacement))
    parts += [model.add_cable(cable, roof.ObjectPlacement) for cable in surface.cables]
    model.aggregate("roof's parts", roof, parts)
    path.write_text(model.text(), encoding="ascii")


class _Model:
    """An IFC4 file that grows: each method adds entities."""

    def __init__(self, surface: Surface, units: Units, metadata: str) -> None:
        import ifcopenshell

        self.surface, self.metadata, self.units = surface, metadata, units or Units("m")
        self.file: Any = ifcopenshell.file(schema="IFC4")
        self.add = self.file.create_entity
        content = (surface.vertices, surface.faces, surface.patch_of_face, support_of(surface))
        digest = hashlib.sha256(metadata.encode())
        for array in content:
            digest.update(np.ascontiguousarray(array).tobytes())
        self.digest = digest.hexdigest()
        self.middle = file_origin(surface.vertices, surface.size)  # viewers work in single precision

    def rooted(self, kind: str, role: str, **values: Any) -> Any:
        """An entity with an identifier made from the surface and its role in the file."""
        from ifcopenshell.guid import compress

        return self.add(kind, GlobalId=compress(uuid.uuid5(SPACE, f"{self.digest} {role}").hex), **values)

    def placement(self, relative: Any = None, point: Iterable[float] = (0.0, 0.0, 0.0)) -> Any:
        """A place without rotation."""
        origin = self.add("IfcCartesianPoint", Coordinates=tuple(map(float, point)))
        axes = self.add("IfcAxis2Placement3D", Location=origin)
        return self.add("IfcLocalPlacement", PlacementRelTo=relative, RelativePlacement=axes)

    def aggregate(self, role: str, whole: Any, parts: list[Any]) -> None:
        """Parts of a whole."""
        self.rooted("IfcRelAggregates", role, RelatingObject=whole, RelatedObjects=parts)

    def add_roof(self, certificate: Mapping[str, Any], walls: str | None) -> Any:
        """The roof in its storey, with the properties of the whole surface."""
        origin = self.add("IfcCartesianPoint", Coordinates=(0.0, 0.0, 0.0))
        context = self.add(
            "IfcGeometricRepresentationContext",
            ContextType="Model",
            CoordinateSpaceDimension=3,
            Precision=1e-9 * self.surface.size,
            WorldCoordinateSystem=self.add("IfcAxis2Placement3D", Location=origin),
        )
        self.body, self.axis = (
            self.add(
                "IfcGeometricRepresentationSubContext",
                ContextIdentifier=name,
                ContextType="Model",
                ParentContext=context,
                TargetView=view,
            )
            for name, view in (("Body", "MODEL_VIEW"), ("Axis", "GRAPH_VIEW"))
        )
        units = assigned_units(self.add, self.units)
        whole = self.rooted(
            "IfcProject", "project", Name="Roof", RepresentationContexts=[context], UnitsInContext=units
        )
        place = None
        for kind in ("Site", "Building", "BuildingStorey"):
            place = self.placement(place)
            values = {"Name": kind.replace("BuildingS", "S"), "ObjectPlacement": place}
            part = self.rooted(f"Ifc{kind}", kind, CompositionType="ELEMENT", **values)
            self.aggregate(f"{kind} aggregated", whole, [part])
            whole = part
        place = self.placement(place, self.middle)
        roof = self.rooted("IfcRoof", "roof", Name="Roof", ObjectPlacement=place, PredefinedType="FREEFORM")
        self.rooted(
            "IfcRelContainedInSpatialStructure",
            "roof contained",
            RelatedElements=[roof],
            RelatingStructure=whole,
        )
        if certificate:
            self.add_properties("Pcmc_Certificate", roof, self._findings(certificate))
        texts = {"Description": self._text(self.metadata)}
        if walls is not None:
            texts["Walls"] = self._text(walls)
        self.add_properties("Pcmc_Surface", roof, texts)
        return roof

    def add_part(self, k: int, color: Floats, used: Ints, faces: Ints, area: float, place: Any) -> Any:
        """The element of patch k, with its vertices and triangles as in ``patch_meshes``."""
        surface, patch = self.surface, self.surface.patches[k]
        points = (surface.vertices[used] - self.middle).tolist()
        mesh = self.add(
            "IfcTriangulatedFaceSet",
            Coordinates=self.add("IfcCartesianPointList3D", CoordList=points),
            CoordIndex=(faces + 1).tolist(),
        )
        rgb = self.add("IfcColourRgb", None, *color.tolist())
        shading = self.add("IfcSurfaceStyleShading", SurfaceColour=rgb, Transparency=0.0)
        style = self.add("IfcSurfaceStyle", Name=patch.name, Side="BOTH", Styles=[shading])
        self.add("IfcStyledItem", Item=mesh, Styles=[style])
        wall = bool(surface.walls[k])
        element = self.rooted(
            "IfcWall" if wall else "IfcSlab",
            f"patch {k}",
            Name=patch.name,
            ObjectPlacement=self.placement(place),
            Representation=self._shape(self.body, "Tessellation", [mesh]),
            PredefinedType="NOTDEFINED" if wall else "ROOF",
        )
        force = bool(self.units.force)
        per_area = {"Pressure": patch.pressure, "Weight": patch.weight, "Snow": patch.snow}
        values = {
            "Tension": self.add("IfcLinearForceMeasure" if force else "IfcReal", patch.tension),
            **{k: self.add("IfcPlanarForceMeasure" if force else "IfcReal", v) for k, v in per_area.items()},
            "Area": self.add("IfcAreaMeasure", area),
            "Supports": self._text("".join(map(str, support_of(surface)[used].tolist()))),
        }
        if patch.tension > 0.0:
            values["TargetMeanCurvature"] = self.add("IfcReal", patch.target_curvature)
        self.add_properties("Pcmc_Patch", element, values, str(k))
        return element

    def add_cable(self, cable: Cable, place: Any) -> Any:
        """The tendon of a cable: its axis as polylines, and its force."""
        chains = self.surface.topology.chains(cable.edges, np.zeros(self.surface.n, dtype=bool))
        lines = []
        for chain in chains:
            points = (self.surface.vertices[chain.vertices] - self.middle).tolist()
            entities = [self.add("IfcCartesianPoint", Coordinates=point) for point in points]
            lines.append(self.add("IfcPolyline", Points=entities + entities[:1] * chain.closed))
        force = self.add("IfcForceMeasure" if self.units.force else "IfcReal", cable.tension)
        tendon = self.rooted(
            "IfcTendon",
            f"cable {cable.name}",
            Name=cable.name,
            ObjectPlacement=self.placement(place),
            Representation=self._shape(self.axis, "Curve3D", lines),
            TensionForce=cable.tension if self.units.force else None,
            PredefinedType="NOTDEFINED",
        )
        self.add_properties("Pcmc_Cable", tendon, {"Force": force}, cable.name)
        return tendon

    def _shape(self, context: Any, kind: str, items: list[Any]) -> Any:
        """The representation of an element in a context."""
        shape = self.add(
            "IfcShapeRepresentation",
            ContextOfItems=context,
            RepresentationIdentifier=context.ContextIdentifier,
            RepresentationType=kind,
            Items=items,
        )
        return self.add("IfcProductDefinitionShape", Representations=[shape])

    def add_properties(self, name: str, of: Any, values: Mapping[str, Any], role: str = "") -> None:
        """A property set of an element; values are entities of IFC's types."""
        listed = [
            self.add("IfcPropertySingleValue", Name=key, NominalValue=value) for key, value in values.items()
        ]
        these = self.rooted("IfcPropertySet", f"{name} {role}", Name=name, HasProperties=listed)
        self.rooted(
            "IfcRelDefinesByProperties",
            f"{name} {role} defined",
            RelatedObjects=[of],
            RelatingPropertyDefinition=these,
        )

    def text(self) -> str:
        """The file's text, without the time at which it was written."""
        header = self.file.header
        header.file_name.time_stamp = TIME
        header.file_name.originating_system = "pcmc"
        header.file_description.description = ("ViewDefinition [ReferenceView_V1.2]",)
        return str(self.file.to_string())

    def _findings(self, certificate: Mapping[str, Any]) -> dict[str, Any]:
        """The certificate's verdict and numbers, as far as they are there."""
        verdict = certificate.get("verdict")
        found: dict[str, Any] = {}
        if verdict is not None:
            found["Verdict"] = self.add("IfcLabel", str(getattr(verdict, "name", verdict)).lower())
        if certificate.get("detail"):
            found["Detail"] = self._text(str(certificate["detail"]))
        if certificate.get("index") is not None:
            found["MorseIndex"] = self.add("IfcInteger", int(certificate["index"]))
        values = {name: certificate.get(key) for name, key in NUMBERS.items()}
        eigenvalues = certificate.get("eigenvalues", ())
        lowest = eigenvalues[0] if len(eigenvalues) else certificate.get("lowest_eigenvalue")
        for name, value in (values | {"LowestEigenvalue": lowest}).items():
            if isinstance(value, int | float | np.number) and np.isfinite(value):
                found[name] = self.add("IfcReal", float(value))
        return found

    def _text(self, value: str) -> Any:
        return self.add("IfcText", value)


def assigned_units(add: Callable[..., Any], units: Units) -> Any:
    """Units of length and angle; areas and volumes in m², m³; and the units of tensions and pressures.

    ``add`` makes an entity.
    """
    length = _unit(add, "LENGTHUNIT", "METRE", units.length, (1, 0, 0), length_factor(units.length, "m"))
    listed = [
        length,
        add("IfcSIUnit", UnitType="AREAUNIT", Name="SQUARE_METRE"),
        add("IfcSIUnit", UnitType="VOLUMEUNIT", Name="CUBIC_METRE"),
        add("IfcSIUnit", UnitType="PLANEANGLEUNIT", Name="RADIAN"),
    ]
    if units.force:
        force = _unit(add, "FORCEUNIT", "NEWTON", units.force, (1, 1, -2), NEWTONS[units.force])
        listed.append(force)
        for kind, power in (("LINEARFORCEUNIT", -1), ("PLANARFORCEUNIT", -2)):
            factors = [
                add("IfcDerivedUnitElement", Unit=force, Exponent=1),
                add("IfcDerivedUnitElement", Unit=length, Exponent=power),
            ]
            listed.append(add("IfcDerivedUnit", Elements=factors, UnitType=kind))
    return add("IfcUnitAssignment", Units=listed)


def _unit(
    add: Callable[..., Any], kind: str, name: str, unit: str, powers: tuple[int, int, int], factor: float
) -> Any:
    """A unit of the SI with its prefix, or one that is a multiple of it."""
    prefix = NAMES[unit] if NAMES[unit].isupper() else None
    plain = add("IfcSIUnit", UnitType=kind, Prefix=prefix, Name=name)
    if prefix or not NAMES[unit]:
        return plain
    exponents = add("IfcDimensionalExponents", *powers, 0, 0, 0, 0)
    measure = "IfcLengthMeasure" if kind == "LENGTHUNIT" else "IfcForceMeasure"
    one = add("IfcMeasureWithUnit", ValueComponent=add(measure, factor), UnitComponent=plain)
    return add(
        "IfcConversionBasedUnit",
        Dimensions=exponents,
        UnitType=kind,
        Name=NAMES[unit],
        ConversionFactor=one,
    )


def read(path: Path) -> MeshData:
    """The surface in a file that pcmc wrote; other .ifc files are refused."""
    if find_spec("ifcopenshell") is None:
        raise MissingExtra("ifcopenshell", "ifc")
    arrays = read_arrays("io/reading_surfaces.py", "ifc_arrays", path)
    if arrays["text"] is None or not arrays["parts"]:
        text = "pcmc reads only .ifc files that it wrote; export the mesh of the roof as .obj or .3dm"
        raise FileError(text, where="Pcmc_Surface")
    metadata = parse_metadata(arrays["text"])
    meshes = [(part["name"], part["points"], part["faces"]) for part in arrays["parts"]]
    if metadata.counts is not None:  # a vertex of two patches is in both, so vertices count for nothing
        metadata.check_counts(metadata.counts[0], sum(len(faces) for *_, faces in meshes))
    support = np.array(list(map(int, "".join(part["supports"] for part in arrays["parts"]))), dtype=np.int8)
    return metadata.of_meshes(meshes, support=support, walls=arrays["walls"])
