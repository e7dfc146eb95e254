"""The sections of a project file as values: [mesh], [remesh], the accuracy of [solve], and [output]."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from .. import io
from ..accuracy.adaptive import ACCURACY_OF, TRIANGLES, accuracies
from ..advice.rises import Rise
from ..base import validate
from ..base.errors import FileError, OptionError, unknown
from ..base.files import PathLike, suffix_of
from ..base.units import LENGTHS, Units, expect_length
from ..cloth.settings import CuttingOptions
from ..cloth.sheets import SUFFIXES as PATTERNS
from ..cloth.sheets import TABLES as PATTERN_TABLES
from ..drawings.drawing_set import NET_SUFFIXES, NET_TABLES, table_paths
from ..drawings.drawing_set import SUFFIXES as DRAWINGS
from ..drawings.sheet import FORMATS
from ..io.georeference import Georeference
from ..meshing.remeshing import check_lengths, remesh, size_note
from ..panelling.panel_net import PATTERNS as NET_PATTERNS
from ..panelling.panel_net import check_grid
from ..plot.figure import SUFFIXES
from ..plot.scene import VIEWS
from ..report.document import SUFFIXES as REPORTS
from ..structure.section import Structure
from ..surface import Surface

PATCH_KEYS = ("tension", "pressure", "snow", "weight", "wall")  # of a patch of a mesh
BOUNDARY, GROUND = "boundary", "ground"
WHEN = ("before", "after")
COLOURS = ("patches", "curvature", "error", "reactions")
CSV, INP, IFC = ".csv", ".inp", ".ifc"
SAME_WARP = 1.0  # degree: directions of [pattern] and [structure] that differ by less are one
DOCUMENTS = {  # keys of files for those who build, with their suffixes and what they are
    "drawings": (DRAWINGS, "a drawing"),
    "net": (NET_SUFFIXES, "a net of panels"),
    "panels": ((CSV,), "a schedule of panels"),
    "structure": ((INP,), "a structural model"),
    "pattern": (PATTERNS, "a cutting pattern"),
    "report": (REPORTS, "a report"),
}
SCHEDULE_TABLES = ("", "families", "edges")  # of panels, their families and edges
TABLES = {"panels": SCHEDULE_TABLES, "pattern": PATTERN_TABLES, "net": NET_TABLES}  # that a .csv is
SINGLE = ("picture", "panels", "structure", "report")  # keys of one file each
LISTS = ("files", "drawings", "net", "pattern")  # keys of several files
NET_KEYS, PICTURE_KEYS = ("net_pattern", "net_direction"), ("view", "views", "colour")
SECTION = TypeVar("SECTION")


def section_of(kind: type[SECTION], name: str, table: Mapping[str, Any]) -> SECTION:
    """The value of a section; an error names the section and its key.

    >>> section_of(Remeshing, "remesh", {"edge_length": 0.5}).when
    'after'
    """
    try:
        return kind(**table)
    except OptionError as error:
        raise error.in_file(name, what=f"{name}.{error.what}" if error.what else name) from None


@dataclass(frozen=True)
class MeshFile:
    """The mesh of a project.

    Attributes
    ----------
    file : its name, beside the project.
    units : of the file's numbers, where it has none itself; by default those of the project.
    tension : of all patches under pressure that ``patches`` does not name.
    patches : by the names in the file: ``tension``, ``pressure``, ``snow``, ``weight``, ``wall``.
    supports : what is fixed instead of the file's supports: "boundary", all of it; "ground", its lowest
        level; or a list of points and lines [x, y, z], whose vertices are fixed.
    rises : heights that it has instead of tensions.
    """

    file: str
    units: str = field(default="", metadata={"kind": LENGTHS})
    tension: float | None = None
    patches: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    supports: str | Sequence[Any] = field(default=(), metadata={"kind": "a name or a list"})
    rises: Sequence[Rise] = ()

    def __post_init__(self) -> None:
        if isinstance(self.supports, str):
            validate.choice("mesh.supports", self.supports, (BOUNDARY, GROUND))
        if self.tension is not None:
            validate.positive("mesh.tension", self.tension)


@dataclass(frozen=True)
class Remeshing:
    """New triangles before or after a project is solved.

    Attributes
    ----------
    edge_length : of the triangles, length.
    near_curves : edge length at junctions and boundaries, if shorter, length.
    growth : largest ratio of the lengths of neighbouring edges, > 1.
    chord : largest distance between the triangles and the smooth surface, length; without it a
        tenth of ``edge_length``.
    when : "before" the surface is solved, or "after"; then it is solved again.
    """

    edge_length: float
    near_curves: float | None = None
    growth: float = 1.2
    chord: float | None = None
    when: str = field(default="after", metadata={"kind": WHEN})

    def __post_init__(self) -> None:
        validate.choice("when", self.when, WHEN)
        check_lengths(**self._lengths)

    @property
    def _lengths(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "when"}

    def remeshed(self, surface: Surface) -> tuple[Surface, str]:
        """The surface with these triangles, and a note where they had to be finer; "" for none."""
        fine = remesh(surface, **self._lengths)
        return fine, size_note(fine, self.edge_length)


@dataclass(frozen=True)
class AccuracyWanted:
    """What ``pcmc.solve_to_accuracy`` is asked for; nothing if ``accuracy`` is empty.

    Attributes
    ----------
    accuracy : error bars wanted, by quantity, such as {height = 1e-3, "area of north" = 0.01}; triangles get
        finer where the error comes from until they are reached. Needs the extra ``remesh``.
    accuracy_of : "mesh", the value on the mesh is to be so accurate; "limit", the extrapolated value is.
    most_triangles : the most that a mesh made for the accuracy may have.
    """

    accuracy: Mapping[str, float] = field(default_factory=dict)
    accuracy_of: str = field(default="mesh", metadata={"kind": ACCURACY_OF})
    most_triangles: int = TRIANGLES

    def __post_init__(self) -> None:
        validate.choice("accuracy_of", self.accuracy_of, ACCURACY_OF)
        validate.integer("most_triangles", self.most_triangles, least=1)
        if self.accuracy:
            object.__setattr__(self, "accuracy", accuracies(self.accuracy))
        for name in () if self.accuracy else ("accuracy_of", "most_triangles"):
            if getattr(self, name) != getattr(AccuracyWanted, name):
                text = f"{name}: counts only with an accuracy; give accuracy, too, or leave it out"
                raise OptionError(text, what=name, found=getattr(self, name))


@dataclass(frozen=True)
class Output:
    """What a project writes: files of the surface, a picture, and documents for those who build.

    Attributes
    ----------
    files : files of the surface; the suffix names the format.
    picture : name of a picture, .png, .svg or .pdf.
    view : of the picture: diagonal, elevation, plan, or [azimuth, elevation] in degrees.
    views : of the picture, side by side, instead of ``view``.
    colour : of the picture.
    whole : whether to write and draw the whole roof that a plan with mirrors is a part of, and to certify it.
    drawings : files of drawings: .dxf, .pdf, .svg; see ``pcmc draw``.
    sheet : format of their sheets.
    panels : the schedule of panels, .csv; NAME-families.csv and NAME-edges.csv come with it.
    tolerance : largest difference of edges in a family of panels; with it drawings and report have them.
    panel_sheets : whether drawings have each panel at true size; needs ``tolerance``.
    net : files of a net of quads or hexagons: .csv, .obj, .dxf, .pdf, .svg; see ``pcmc panels --pattern``.
    net_pattern : of the net: planar-quads along lines of curvature; quads or hexagons of a grid in plan.
    net_size : edge of its panels, length; needs ``net``.
    net_direction : of a grid in plan, degrees from x.
    structure : the structural model, .inp; needs the section [structure].
    pattern : files of the cutting pattern: .dxf, .pdf, .svg, .csv; needs the section [pattern].
    report : the report, .pdf; see ``pcmc report``.
    date : printed in the report, which reads no clock.
    georeference : where the .ifc files are on a map: {crs = "EPSG:25832", eastings = ..., northings = ...}.
    """

    files: Sequence[PathLike] = ()
    picture: PathLike | None = None
    view: Any = field(default="diagonal", metadata={"kind": "a name or two angles"})
    views: Sequence[Any] | None = field(default=None, metadata={"kind": "a list of views"})
    colour: str = field(default="patches", metadata={"kind": COLOURS})
    whole: bool = False
    drawings: Sequence[PathLike] = ()
    sheet: str = field(default="A1", metadata={"kind": tuple(FORMATS)})
    panels: PathLike | None = None
    tolerance: float | None = None
    panel_sheets: bool = False
    net: Sequence[PathLike] = ()
    net_pattern: str = field(default="planar-quads", metadata={"kind": NET_PATTERNS})
    net_size: float | None = None
    net_direction: float = 0.0
    structure: PathLike | None = None
    pattern: Sequence[PathLike] = ()
    report: PathLike | None = None
    date: str = ""
    georeference: Any = field(default=None, metadata={"kind": "a table"})

    def __post_init__(self) -> None:
        if isinstance(self.georeference, Mapping):
            place = section_of(Georeference, "output.georeference", self.georeference)
            object.__setattr__(self, "georeference", place)
        check_names(self.files, self.picture)
        check_picture(self.all_views, self.colour)
        validate.choice("sheet", self.sheet, tuple(FORMATS))
        if self.tolerance is not None:
            validate.positive("tolerance", self.tolerance)
        for key, (suffixes, what) in DOCUMENTS.items():
            for file in self.files_of(key):
                suffix_of(file, suffixes, what)
        check_grid(self.net_pattern, self.net_direction, "net_")
        if self.net_size is not None:
            validate.positive("net_size", self.net_size)
        if bool(self.net) != (self.net_size is not None):
            text = "files of a net need net_size = LENGTH, the edge of its panels, and net_size needs net"
            raise OptionError(f"net: {text}", what="net_size" if self.net else "net")
        parts = {"net = [...]": self.net, "picture = ...": self.picture}
        for part, names in zip(parts, (NET_KEYS, PICTURE_KEYS), strict=True):
            for name in () if parts[part] else names:
                if getattr(self, name) != getattr(Output, name):
                    text = f"{name}: counts only with {part}; give it, too, or leave {name} out"
                    raise OptionError(text, what=name, found=getattr(self, name))
        for name in ("panels", "panel_sheets"):
            if getattr(self, name) and self.tolerance is None:
                text = f"{name}: needs the largest difference of edges in a family; add tolerance = LENGTH"
                raise OptionError(text, what="tolerance", expected="a length")

    @property
    def all_views(self) -> Sequence[Any]:
        """The views of the picture, side by side."""
        return [self.view] if self.views is None else self.views

    @property
    def documents(self) -> bool:
        """Whether there are any besides files and a picture."""
        return any(map(self.files_of, DOCUMENTS))

    def files_of(self, key: str) -> list[PathLike]:
        """The files of a key, as they are given."""
        given = getattr(self, key)
        return [*given] if key in LISTS else [] if given is None else [given]

    @property
    def names(self) -> list[str]:
        return [str(name) for key in (*LISTS, *SINGLE) for name in self.files_of(key)]

    @property
    def paths(self) -> list[Path]:
        """All files that are known before the roof is; sheets as .svg get numbers."""
        paths = [*map(Path, self.names)]
        for key, tables in TABLES.items():
            paths += [path for file in self.files_of(key) for path in table_paths(Path(file), tables)[1:]]
        return paths

    def in_folder(self, folder: Path) -> Output:
        lists: dict[str, Any] = {name: [folder / path for path in getattr(self, name)] for name in LISTS}
        lists |= {name: folder / path for name in SINGLE if (path := getattr(self, name)) is not None}
        return replace(self, **lists)

    def check(self, units: Units, structure: Structure | None, pattern: CuttingOptions | None) -> None:
        """Refuse documents that need a unit of length or a section which the project does not have."""
        if self.georeference and not any(Path(file).suffix.lower() == IFC for file in self.files):
            text = 'georeference: is of .ifc files; name one, such as files = ["roof.ifc"], or leave it out'
            raise OptionError(text, what="output.georeference")
        for key in ("drawings", "pattern", "net", "report"):
            if any(Path(file).suffix.lower() in (*DRAWINGS, *REPORTS) for file in self.files_of(key)):
                expect_length(units.length, DOCUMENTS[key][1])
        if self.pattern and pattern is None:
            text = "a cutting pattern needs the width of the cloth; add [pattern] with width, strips or seams"
            raise OptionError(text, what="pattern", expected="a table")
        if self.structure is not None and structure is None:
            text = "a structural model needs material and thickness; add [structure] with young and thickness"
            raise OptionError(text, what="structure", expected="a table")


def of_material(pattern: CuttingOptions, structure: Structure | None, surface: Surface) -> CuttingOptions:
    """The pattern with the stiffness of [structure], unless it has its own compensation, and with its warp if
    that is a cloth. Refuses another stiffness or another warp: one roof has one cloth."""
    pattern.check(surface)
    if structure is None:
        return pattern
    values: dict[str, dict[str, Any]] = {key: {} for key in ("stiffness", "poisson", "direction")}
    given, thicknesses = structure.materials(surface), structure.thicknesses(surface)
    for name in (patch.name for patch, roof in zip(surface.patches, surface.roof, strict=True) if roof):
        material = given[name] if isinstance(given, dict) else given
        t = thicknesses[name] if isinstance(thicknesses, dict) else thicknesses
        model = [material.young * t, (material.weft or material.young) * t]
        if pattern.compensation is None:
            values["stiffness"][name], values["poisson"][name] = model, material.poisson
        own, poisson = pattern.of_patch("stiffness", name), pattern.of_patch("poisson", name)
        both = [*model, material.poisson], [*(own or model), poisson]
        if own is not None and not np.allclose(*both, rtol=1e-6, atol=0.0):
            of_strips, of_model = (" and ".join(f"{x:g}" for x in one) for one in (own, model))
            text = f"stiffness: [pattern] has {of_strips} with poisson {poisson:g}, and young times thickness"
            text += f" in [structure] gives {of_model} with poisson {material.poisson:g}; make both the same"
            raise OptionError(f"{text} cloth", what="stiffness", found=own, expected=model)
        degrees, (x, y) = pattern.of_patch("direction", name), surface.plane.axes[:2] @ material.warp
        if material.cloth and np.hypot(x, y) > 0.0:
            warp = float(np.degrees(np.arctan2(y, x)))
            if degrees is not None and abs((degrees - warp + 90.0) % 180.0 - 90.0) > SAME_WARP:
                text = f"direction: the warp of {name!r} lies at {degrees:g} degrees in [pattern], and at"
                text += f" {warp:g} in [structure]; leave out direction, or change warp"
                raise OptionError(text, what="direction", found=degrees, expected=warp)
            degrees = warp if degrees is None else degrees
        if degrees is not None:
            values["direction"][name] = degrees
    found: dict[str, Any] = {key: value for key, value in values.items() if value}
    pattern = replace(pattern, **found)
    pattern.check(surface)  # a warp of the model that is oblique to a mirror plane is named
    return pattern


def cost_paths(path: Path) -> list[Path]:
    """The table and the picture of the costs beside a schedule of panels."""
    return [path.with_name(f"{path.stem}-costs{suffix}") for suffix in (path.suffix, ".svg")]


def check_names(files: Iterable[PathLike], picture: PathLike | None = None) -> None:
    """Refuse empty file names, and those whose suffix is no format of surfaces, or of pictures."""
    for file in files:
        if not str(file).strip():
            text = "the name of an output file is empty; give one, such as 'roof.obj'"
            raise FileError(text, what="output")
        suffix = Path(file).suffix.lower()
        if suffix not in io.FORMATS:
            text = f"{file}: {unknown('suffix', suffix, io.FORMATS)}"
            text += "; a picture has its own option" * (suffix in SUFFIXES)
            raise FileError(text, what=str(file), found=suffix)
    if picture is not None:
        suffix_of(picture, SUFFIXES, "a picture")


def check_picture(views: Sequence[Any], colour: str) -> None:
    """Refuse views or a colour that a picture of a project cannot have."""
    validate.choice("colour", colour, COLOURS)
    if not views:
        validate.refuse("views", views, "at least one view")
    if colour == "reactions" and len(views) > 1:
        validate.refuse("views", len(views), "one view for a picture of reactions")
    for view in views:
        angles = view if isinstance(view, Sequence) and len(view) == 2 else [math.nan]
        if isinstance(view, str):
            validate.choice("view", view, tuple(VIEWS))
        elif not all(math.isfinite(validate.real(angle)) for angle in angles):
            validate.refuse("view", view, "a name or two angles in degrees")
