"""The drawings of a roof, or of a net of panels on it: a model in three dimensions and sheets of paper, with
panels at true size."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import OptionError
from ..base.files import PathLike, atomic_writes, suffix_of, writing
from ..base.units import Units, as_units, expect_length, length_factor
from ..certificate import Certificate
from ..certificate.certificate import certified
from ..panelling import PanelNet, Panels, panels
from ..surface import Surface, expect_surface
from ..surface.images import expect_no_images
from . import dxf, views
from .panel_sheets import flat_panels, polygons_at_true_size, triangles_at_true_size
from .panel_sheets import panel_sheets as panels_at_true_size
from .sheet import FORMATS, MEMBERS, Sheet, SheetLine, add_frames, length_decimals, table_sheets
from .sheet import write_pdf as write_pages

SUFFIXES, CSV, OBJ = (".dxf", ".pdf", ".svg"), ".csv", ".obj"
NET_SUFFIXES = (*SUFFIXES, CSV, OBJ)
NET_TABLES = ("", "nodes", "beams")  # of panels, nodes and beams
SUPPORT = ["support", "name", "kind", "length", *"xyz", "force_x", "force_y", "force_z"]
Paths = Iterable[PathLike]
Ends = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, eq=False)
class DrawingSet:
    """The drawings of a roof."""

    surface: Surface
    units: str  # of its lengths
    certificate: Certificate  # of the surface
    curves: Sequence[SheetLine]  # ridges, rims, wall lines, cables and members
    sections: Sequence[SheetLine]  # in which each plane cuts the roof
    points: pd.DataFrame  # of setting out: ``point``, ``x``, ``y``, ``z``, ``on`` (ridge, rim, wall, …)
    marks: Sequence[tuple[str, Floats]]  # name and place (3,) of each mast or other support of one point
    schedule: Panels | None  # the panels, if a tolerance was given
    flat: Sheet | None  # all panels at true size, mm, where sheets of panels are asked for
    sheets: Sequence[Sheet]  # of paper, in order
    members: Mapping[str, Mapping[str, str]] = field(default_factory=dict)  # section, force, … by name
    mark: str = ""  # where the certificate has none

    def files(self, *paths: PathLike) -> list[tuple[Path, Callable[[Path], None]]]:
        """Each file that ``write`` would write, with the function that writes it."""
        jobs: list[tuple[Path, Callable[[Path], None]]] = []
        wanted = [(path, suffix_of(path, SUFFIXES, "a drawing")) for path in map(Path, paths)]
        document: Any = dxf.document(self) if any(suffix != ".pdf" for _, suffix in wanted) else None
        for path, suffix in wanted:
            if suffix != ".svg":
                write = partial(write_pages, self.sheets) if suffix == ".pdf" else document.saveas
                jobs.append((path, write))
                continue
            for k in range(len(self.sheets)):
                number = f"-{k + 1}" if len(self.sheets) > 1 else ""
                one = path.with_name(f"{path.stem}{number}{path.suffix}")
                jobs.append((one, partial(dxf.write_svg, document, k)))
        return jobs

    def write(self, *paths: PathLike) -> list[Path]:
        """Write .dxf, .pdf (a page per sheet) and .svg (a file NAME-1.svg and so on per sheet).

        All files appear together, or none. FileError for another suffix, or a file that cannot be written.
        """
        jobs = self.files(*paths)
        with atomic_writes([path for path, _ in jobs]) as temporaries:
            for (path, write), temporary in zip(jobs, temporaries, strict=True):
                with writing(path):
                    write(temporary)
        return [path for path, _ in jobs]


def table_paths(path: Path, tables: Iterable[str]) -> list[Path]:
    """The files that one is: a .csv is NAME-TABLE.csv for each table, and NAME.csv for one without a name."""
    names = tables if path.suffix.lower() == CSV else [""]
    return [path.with_name(f"{path.stem}{'-' * bool(name)}{name}{path.suffix}") for name in names]


def document_files(
    paths: Paths,
    draw: Callable[[], DrawingSet],
    tables: Mapping[str, pd.DataFrame],
    others: Mapping[str, Callable[[Path], None]],
    what: str,
) -> list[tuple[Path, Callable[[Path], Any]]]:
    """Each file of drawings and tables with the function that writes it, that of a suffix in ``others``, too;
    FileError for an unknown suffix of ``what``."""
    given = [(path, suffix_of(path, (*SUFFIXES, CSV, *others), what)) for path in map(Path, paths)]
    drawn = [path for path, suffix in given if suffix in SUFFIXES]
    jobs: list[tuple[Path, Callable[[Path], Any]]] = list(draw().files(*drawn)) if drawn else []
    for path, suffix in given:
        if suffix in others:
            jobs.append((path, others[suffix]))
        elif suffix == CSV:
            files = zip(table_paths(path, tables), tables.values(), strict=True)
            jobs += [(file, partial(table.to_csv, index=False)) for file, table in files]
    return jobs


def drawing_set(
    surface: Surface,
    units: str | Units,
    *,
    sheet: str = "A1",
    scale: int | None = None,
    heights: Sequence[float] | None = None,
    lines: Sequence[Ends] | None = None,
    tolerance: float | None = None,
    panel_sheets: bool = False,
    mirror_images: str = "alike",
    name: str = "",
    anyway: bool = False,
    certificate: Certificate | None = None,
    schedule: Panels | None = None,
    members: Sequence[Any] = (),
    mark: str = "",
) -> DrawingSet:
    """Draw a roof: plan, elevations, sections, setting-out points, cables, supports, panels at true size.

    Plan and sections are dimensioned between the corners of the outline and the walls, elevations over the
    outline; beside heights stand levels.

    Parameters
    ----------
    surface : a certified surface, z up.
    units : of its lengths: "m", "cm", "mm", "ft" or "in"; or ``Units("m", "kN")``, to name those of forces.
    sheet : format of the sheets, "A4" to "A0".
    scale : of plan, elevations and sections, 1 to this; by default the largest usual one that fits.
    heights : z of horizontal sections; by default at a quarter, half and three quarters of the height.
    lines : pairs of points (x, y), for vertical sections; by default through the middle, along x and y, where
        they meet the roof.
    tolerance : of the panels' families; None for no schedule.
    panel_sheets : draw every panel at true size, on sheets and flat in the .dxf's model space, where those
        larger than a sheet are alone; needs a tolerance.
    mirror_images : as in ``pcmc.panels``.
    name : of the roof, in the title strips.
    anyway : draw a surface that is not certified; every sheet is marked.
    certificate, schedule : of the surface, where they are known; otherwise computed.
    members : of its structural model, ``structure.drawn_members(model)``: lines in the place of their walls,
        and a table.
    mark : on every sheet and in the model, where the certificate has none.

    Raises
    ------
    SurfaceError : the surface is not certified.
    OptionError : for units that are missing; a section that misses the roof; a view that does not fit the
        sheet, with the smallest format that holds it.

    >>> from pcmc import Patch
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> drawings = drawing_set(roof, "m", sheet="A3")
    >>> [sheet.title for sheet in drawings.sheets]
    ['Plan', 'Elevations', 'Sections at heights', 'Sections along lines', 'Setting-out points', 'Supports']
    >>> drawings.sheets[0].scale
    '1:10'
    """
    expect_surface(surface)
    expect_no_images(surface, "drawings")
    units = as_units(units)
    length = expect_length(units.length, "a drawing")
    millimetres, decimals = length_factor(length, "mm"), length_decimals(length, surface.size)
    validate.choice("sheet", sheet, tuple(FORMATS))
    if scale is not None:
        validate.integer("scale", scale, least=1)
    validate.flag("panel_sheets", panel_sheets)
    if schedule is None:
        if panel_sheets and tolerance is None:
            text = "panel_sheets: needs the tolerance of the panels' families; add tolerance="
            raise OptionError(text, what="tolerance", expected="a length")
    elif schedule.surface is not surface or tolerance not in (None, schedule.tolerance):
        text = "schedule: belongs to another surface or tolerance; pass panels(surface, tolerance)"
        raise OptionError(text, what="schedule", found=schedule.tolerance, expected=tolerance)
    certificate = certified(surface, anyway, certificate)
    if tolerance is not None and schedule is None:
        options: dict[str, Any] = {"anyway": anyway, "certificate": certificate}
        schedule = panels(surface, tolerance, mirror_images=mirror_images, **options)
    replaced = {member.wall for member in members}
    curves = views.model_curves(surface, replaced)
    curves += [SheetLine(member.points, MEMBERS, member.closed, member.name) for member in members]
    points = _setting_out(curves)
    at_points = certificate.supports[certificate.supports["kind"] == "point"]
    marks = list(zip(at_points["support"], at_points[[*"xyz"]].to_numpy(), strict=True))
    named = [(at, name, "PCMC-SUPPORT") for name, at in marks]
    setting_out = zip(points["point"], points[[*"xyz"]].to_numpy(), strict=True)
    named += [(at, name, "PCMC-POINT") for name, at in setting_out]
    levels, profiles = _levels(surface, heights, replaced), _profiles(surface, lines, replaced)
    elevations = views.elevations(surface, curves)
    drawn = {"Plan": [views.plan_view(surface, curves, named)], "Elevations": elevations}
    drawn["Sections at heights"] = [views.contours(surface, curves, levels)] if levels else []
    drawn["Sections along lines"] = [view for view, _ in profiles]
    size = sheet, millimetres, scale, decimals
    sheets = [views.placed(shown, title, *size) for title, shown in drawn.items() if shown]
    tables, flat = {"Setting-out points": points}, None
    if len(certificate.cables):
        cables = certificate.cables[["cable", "tension", "length"]]
        tables["Cables"] = cables.rename(columns={"tension": "force"})
    about = [member.texts(units) for member in members]
    if about:
        tables["Members"] = pd.DataFrame(about).fillna("")
    if len(certificate.supports):
        tables["Supports"] = certificate.supports[SUPPORT]
    if schedule is not None:
        families = schedule.families[["family", "count", "mirrored", *"abc", "area"]]
        families = families.rename(columns={"count": "panels", "mirrored": "turned over"})
        tables["Families of panels"] = families.assign(family=[f"F{k}" for k in families["family"]])
    heads = {"area": units.area, **dict.fromkeys(("force", *SUPPORT[-3:]), units.force)}
    for title, table in tables.items():
        sheets += table_sheets(title, table, sheet, decimals, heads)
    if schedule is not None and panel_sheets:
        triangles = triangles_at_true_size(schedule, millimetres)
        flat = flat_panels(triangles)
        sheets += panels_at_true_size(triangles, sheet)
    add_frames(sheets, name, length, certificate, mark)
    cut = [one for _, group in levels for one in group] + [one for _, group in profiles for one in group]
    listed = (curves, cut, points, marks, schedule, flat, sheets)
    by_name = {texts["member"]: texts for texts in about}
    return DrawingSet(surface, length, certificate, *listed, by_name, mark)


def _setting_out(curves: Sequence[SheetLine]) -> pd.DataFrame:
    """Vertices of the curves, each once: the ends of curves first, then along them."""
    rows: dict[int, list[Any]] = {}
    ends = [c for c in curves if not (c.closed or c.layer in ("PCMC-CABLE", MEMBERS))]
    places = [(c, k) for c in ends for k in (0, -1)]
    places += [(c, k) for c in curves for k in range(len(c.vertices))]
    for c, k in places:
        on = c.layer.removeprefix("PCMC-").lower()
        rows.setdefault(c.vertices[k], [f"P{len(rows) + 1}", *c.points[k].tolist(), on])
    return pd.DataFrame(rows.values(), columns=["point", *"xyz", "on"])


def _levels(
    surface: Surface, heights: Sequence[float] | None, without: Collection[str]
) -> list[tuple[float, list[SheetLine]]]:
    """Each height with the lines of its section."""
    low, high = float(surface.vertices[:, 2].min()), float(surface.vertices[:, 2].max())
    given = [low + part * (high - low) for part in (0.25, 0.5, 0.75)] if heights is None else heights
    chosen, up = [validate.number("heights", height) for height in given], np.array([0.0, 0.0, 1.0])
    cuts = [(h, views.cut_lines(surface, h * up, up, without)) for h in chosen]
    for h, found in cuts:
        if not found and heights is not None:
            text = f"heights: z = {h:g} misses the roof, which lies between {low:g} and {high:g}"
            raise OptionError(text, what="heights", found=h, expected=(low, high))
    return [cut for cut in cuts if cut[1]]


def _profiles(
    surface: Surface, lines: Sequence[Ends] | None, without: Collection[str]
) -> list[tuple[views.DrawnView, list[SheetLine]]]:
    """Each vertical section as a view, with its lines."""
    (left, front), (right, back) = surface.vertices[:, :2].min(axis=0), surface.vertices[:, :2].max(axis=0)
    x, y, profiles = 0.5 * (left + right), 0.5 * (front + back), []
    for line in (((left, y), (right, y)), ((x, front), (x, back))) if lines is None else lines:
        ends = np.asarray(line, dtype=float)
        along = ends[1] - ends[0] if ends.shape == (2, 2) else np.zeros(2)
        length = float(np.linalg.norm(along))
        if not (np.isfinite(ends).all() and length > 0.0):
            validate.refuse("lines", line, "two different points (x, y)")
        along /= length
        normal = np.array([-along[1], along[0], 0.0])
        found = views.cut_lines(surface, np.append(ends[0], 0.0), normal, without)
        title = "from ({:.6g}, {:.6g}) towards ({:.6g}, {:.6g})".format(*ends.ravel())
        if not found and lines is not None:
            raise OptionError(f"lines: the section {title} misses the roof", what="lines", found=line)
        if found:
            profiles.append((views.profile(title, ends[0], along, found), found))
    return profiles


def net_drawings(
    net: PanelNet, units: str | Units, *, sheet: str = "A1", name: str = "", mark: str = ""
) -> DrawingSet:
    """The plan of a net, tables of its nodes and panels, and each panel at true size, for .dxf, .pdf, .svg.

    Parameters
    ----------
    units : of the lengths: "m", "cm", "mm", "ft" or "in".
    sheet : format of the sheets, "A4" to "A0".
    name, mark : of the roof, in the title strips and on every sheet.

    >>> from generators import delaunay
    >>> from pcmc import panel_net
    >>> drawings = net_drawings(panel_net(delaunay(exact=True), 0.9, anyway=True), "m", sheet="A0")
    >>> [page.title for page in drawings.sheets[:3]], drawings.sheets[3].title[7:]
    (['Panels and nodes in plan', 'Nodes', 'Panels'], ' at true size, outside up')
    """
    validate.choice("sheet", sheet, tuple(FORMATS))
    length = expect_length(as_units(units).length, "drawings of panels")
    millimetres, decimals = length_factor(length, "mm"), length_decimals(length, net.mesh.size)
    loops = enumerate(net.polygons, start=1)
    curves = [SheetLine(net.points[loop], "PCMC-PANEL", True, f"panel {k}") for k, loop in loops]
    lines = [line._replace(points=line.points[:, :2]) for line in curves]
    numbers = [(line.points.mean(axis=0), str(k), np.zeros(2)) for k, line in enumerate(lines, start=1)]
    ends = [np.array([column.min(), column.max()]) for column in net.points[:, :2].T]
    nodes = [(at, str(k), "PCMC-POINT") for k, at in enumerate(net.points[:, :2], start=1)]
    plan = views.DrawnView("", lines, numbers, nodes, stations=(ends[0], ends[1]))
    sheets = [views.placed([plan], "Panels and nodes in plan", sheet, millimetres, None, decimals)]
    tables: list[tuple[str, pd.DataFrame, dict[str, str]]] = [
        ("Nodes", net.nodes[["node", *"xyz", "kind"]], dict.fromkeys("xyz", length)),
        ("Panels", net.panels[["panel", "patch", "kind", "corners", "area"]], {"area": f"{length}²"}),
    ]
    for title, table, head in tables:
        sheets += table_sheets(title, table, sheet, decimals, head)
    panels = polygons_at_true_size(net, millimetres)
    sheets += panels_at_true_size(panels, sheet)
    add_frames(sheets, name, length, net.certificate, mark)
    points = net.nodes[["node", *"xyz"]].rename(columns={"node": "point"}).astype({"point": str})
    points = points.assign(on="panel")
    about = net.mesh, length, net.certificate, curves
    return DrawingSet(*about, (), points, (), None, flat_panels(panels), sheets, mark=mark)


def net_files(
    net: PanelNet, paths: Paths, units: str | Units, sheet: str, name: str, mark: str
) -> list[tuple[Path, Callable[[Path], Any]]]:
    """Each file of a net with the function that writes it; FileError for an unknown suffix."""
    tables = dict(zip(NET_TABLES, (net.panels, net.nodes, net.beams), strict=True))
    draw = partial(net_drawings, net, units, sheet=sheet, name=name, mark=mark)
    return document_files(paths, draw, tables, {OBJ: partial(net.write_obj, mark=mark)}, "a net of panels")
