"""Roofs of quads and hexagons: nets of panels on the surface, planar where its shape allows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike

import numpy as np
import pandas as pd

from ..base import validate
from ..base.arrays import Floats, Ints
from ..base.errors import OptionError, SurfaceError
from ..base.files import atomic_write, writing
from ..base.units import NO_UNITS, Units
from ..certificate import Certificate
from ..certificate.certificate import certified
from ..certificate.tables import head_text
from ..io.obj import SPECIAL
from ..io.text import escaped
from ..surface import Patch, Surface, expect_surface
from ..surface.distance import distances
from ..surface.geometry import area_vectors, cross_2d, face_areas, segment_lengths
from ..surface.lagrange import expect_flat
from ..surface.pieces import point_text
from .net import INSIDE, Net, SheetNet, net, tidied, without_flat
from .planar import before, convex, middles, planarised, planarity, polygon_areas, torsion, torsion_free_axes
from .sheet import SheetMesh, curvature_coordinates, nudged, sheets_of

PATTERNS = ("planar-quads", "quads", "hexagons")
LARGEST = 0.5  # of a sheet's size: larger panels are refused
MOST = 100_000  # panels of a sheet; more mean a mistake in the unit
KINDS = np.array(["inside", "edge", "corner"])  # of nodes
WARPED = 0.02  # planarity from which sheets of glass or metal are no longer bent into place
FAR = 0.25  # of the size: a warning names nodes and panels that are farther from the surface
NO_AREA = 1e-3  # of the size squared: a warning names smaller panels


@dataclass(frozen=True, eq=False)
class PanelNet:
    """Panels of a roof with three or more corners each. ``print`` shows the totals.

    Panels, nodes and beams are numbered from 1. Lengths are in the surface's unit, angles in degrees.

    Attributes
    ----------
    surface, certificate : the surface and its certificate.
    pattern, size : as asked for.
    points : (n,3) the nodes.
    start, corner : the nodes of panel k are ``corner[start[k]:start[k + 1]]``, seen counter-clockwise from
        outside.
    axes : (n,3) node axes with as little torsion as can be; ``points + d * axes`` is a parallel net.
    normals : (n,3) unit normals of the surface at the nodes.
    nodes : a row per node: ``node``, ``x``, ``y``, ``z``, ``kind`` ("inside", "edge" on a ridge or rim,
        "corner"); its ``distance`` from the surface; ``lean``, the angle of its axis from the normal.
    panels : a row per panel: ``panel``, ``patch``, ``kind`` ("whole", "cut" by a ridge or rim that is no line
        of the net, "umbilic"), ``corners``, ``area``; ``planarity``, the distance between the diagonals over
        their mean length; ``distance`` from the surface, the largest of its corners and middle; ``turned``,
        the mean angle between the net and the principal directions, NaN if the net does not follow them.
    beams : a row per edge: ``beam``, ``node``, ``other``, ``length``, ``panel``, ``neighbour`` (0 for none);
        ``torsion`` with the ``axes``, ``torsion_normal`` with the normals.
    umbilics : (k,3) the places inside patches where the directions of a planar net have no sense.

    >>> from generators import delaunay
    >>> net = panel_net(delaunay(exact=True), 0.5, anyway=True)
    >>> bool(net.panels["planarity"].max() < 1e-6), len(net.umbilics)
    (True, 0)
    """

    surface: Surface
    pattern: str
    size: float
    certificate: Certificate
    points: Floats
    start: Ints
    corner: Ints
    axes: Floats
    normals: Floats
    nodes: pd.DataFrame
    panels: pd.DataFrame
    beams: pd.DataFrame
    umbilics: Floats

    @property
    def covered(self) -> float:
        """The panels' area over that of the roof's patches that have panels, 1.

        Below 1 by what chords cut off, and by slivers at rims that have no panel.

        >>> from generators import delaunay
        >>> round(panel_net(delaunay(exact=True), 0.5, anyway=True).covered, 3)
        0.985
        """
        roof = self.surface.roof[self.surface.patch_of_face]
        area = face_areas(self.surface.vertices[self.surface.faces[roof]]).sum()
        return float(self.panels["area"].sum() / area)

    @property
    def polygons(self) -> list[Ints]:
        """The nodes of each panel."""
        return np.split(self.corner, self.start[1:-1])

    @property
    def mesh(self) -> Surface:
        """The panels as triangles around their middles, a patch for each panel: "panel 1" and so on."""
        owner = np.repeat(np.arange(len(self.panels)), np.diff(self.start))
        faces = np.stack([self.corner[before(self.start)], self.corner, len(self.points) + owner], axis=1)
        tensions = {patch.name: patch.tension for patch in self.surface.patches}
        patches = tuple(Patch(f"panel {k}", tensions[name]) for k, name in enumerate(self.panels["patch"], 1))
        X = np.concatenate([self.points, middles(self.points, self.start, self.corner)])
        return Surface(X, faces, owner, patches, fixed=np.ones(len(X), dtype=bool), plane=self.surface.plane)

    def write_obj(self, path: str | PathLike[str], mark: str = "") -> None:
        """Write the panels as polygons of a Wavefront .obj, a group per patch; with the mark of the
        certificate, or else ``mark``, as a comment."""
        mark = self.certificate.mark or validate.one_line("mark", mark)
        lines = ["# panels of pcmc", *(f"# {text}" for text in (self.certificate.part, mark) if text)]
        lines += ("v {!r} {!r} {!r}".format(*at) for at in self.points.tolist())
        patch = self.panels["patch"].tolist()
        for k, loop in enumerate(self.polygons):
            lines += [f"g {escaped(patch[k], SPECIAL)}"] if k == 0 or patch[k] != patch[k - 1] else []
            lines.append("f " + " ".join(map(str, loop + 1)))
        with writing(path), atomic_write(path) as temporary:
            temporary.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")

    def offset(self, distance: float, *, torsion: bool = False) -> Floats:
        """(n,3) the nodes of a parallel net at a distance outside; with ``torsion``, along the normals."""
        distance = validate.number("distance", distance)
        return self.points + distance * (self.normals if torsion else self.axes)

    def text(self, units: Units = NO_UNITS) -> str:
        """Totals, with the units of the numbers if they are given."""
        table, beams, nodes = self.panels, self.beams, self.nodes
        kinds = ", ".join(f"{count} {kind}" for kind, count in table["kind"].value_counts().items())
        worst, area, bent = table.iloc[table["planarity"].argmax()], table["area"], table["planarity"]
        rows = {"panels": f"{len(table)}: {kinds}; {len(self.points)} nodes, {len(beams)} beams"}
        rows["area"] = f"{area.sum():.6g}, {100.0 * self.covered:.2f} % of the roof's;"
        rows["area"] += f" panels {area.min():.3g} to {area.max():.3g}"
        rows["planarity"] = f"median {bent.median():.2g}, largest {worst['planarity']:.2g}"
        rows["planarity"] += f" (panel {worst['panel']}, {worst['kind']})"
        if warped := int((bent > WARPED).sum()):
            at = point_text(self.points[self.polygons[int(worst["panel"]) - 1]].mean(axis=0).round(2))
            text = f"{warped} panels by more than {100.0 * WARPED:g} % of their diagonals, most at {at}:"
            rows["warped"] = f"{text} build these of triangles, or choose another pattern"
        far = nodes["distance"].max()
        rows["distance"] = f"from the surface, nodes {far:.3g}, panels {table['distance'].max():.3g}"
        turns = [f(beams[name]) for name in ("torsion", "torsion_normal") for f in (np.median, np.max)]
        torsion = "of beams, median {:.2g}, largest {:.3g} degrees; along normals {:.2g} and {:.3g}"
        rows["torsion"] = torsion.format(*turns)
        if len(self.umbilics):
            places = ", ".join(point_text(place.round(2)) for place in self.umbilics[:6])
            rows["umbilics"] = f"{len(self.umbilics)}: {places}"
        widest = table.iloc[table["distance"].argmax()]
        if far > FAR * self.size:
            text = f"nodes are up to {100.0 * far / self.size:.0f} % of the size from the surface: choose a"
            rows["far off"] = f"{text} smaller size, or pattern 'quads'"
        elif widest["distance"] > FAR * self.size:
            text = f"panel {widest['panel']} ({widest['kind']}), with an area of {widest['area']:.3g}, is"
            text += f" {100.0 * widest['distance'] / self.size:.0f} % of the size from the surface: choose"
            rows["far off"] = f"{text} a smaller size, or pattern 'quads'"
        if flat := table["panel"][area < NO_AREA * self.size**2].tolist():
            text = f"{len(flat)} panels have next to no area, as panel {flat[0]}: choose another size"
            rows["slivers"] = text
        return head_text(self.certificate, units, rows)

    __str__ = text


def panel_net(
    surface: Surface,
    size: float,
    pattern: str = "planar-quads",
    *,
    direction: float = 0.0,
    anyway: bool = False,
    certificate: Certificate | None = None,
) -> PanelNet:
    """Quads or hexagons on a roof.

    Parameters
    ----------
    size : of a panel's edge, length, in the mean.
    pattern : "planar-quads" along lines of curvature, made planar; "quads" between the lines of a grid in
        plan, with their nodes on the surface; or "hexagons" of a grid in plan, made planar.
    direction : of the grid in plan, degrees from x.
    anyway : accept a surface that is not certified.
    certificate : of the surface, where it is known; by default it is computed.

    Raises
    ------
    SurfaceError : the surface is not certified, or is all walls.
    OptionError : the size is too large or too small for a patch, or the pattern does not exist on one.
    MissingExtra : shapely is not installed.

    >>> from generators import delaunay
    >>> print(len(panel_net(delaunay(exact=True), 0.5, anyway=True).panels))
    70
    """
    expect_surface(surface)
    expect_flat(surface, "the net of panels")
    size = validate.positive("size", size)
    check_grid(pattern, direction)
    certificate = certified(surface, anyway, certificate)
    sheets = sheets_of(surface)
    if not sheets:
        text = "surface: no panels: every patch is a wall"
        raise SurfaceError(text, what="surface", found=0, expected="a patch that is no wall")
    parts = [_sheet_net(surface, *one, size, pattern, direction) for one in sheets]
    found = tidied(net(surface, parts, size, pattern == "hexagons"), size)
    if pattern != "quads":
        P = planarised(found.points, found.start, found.corner, found.kind == INSIDE)
        found = without_flat(found._replace(points=P), size)
    axes = torsion_free_axes(found.points, found.beams, found.normals)
    tables = net_tables(surface, parts, found, axes)
    umbilics = np.concatenate([part.sheet.X[part.umbilics] for part in parts])
    polygons = found.points, found.start, found.corner
    return PanelNet(surface, pattern, size, certificate, *polygons, axes, found.normals, *tables, umbilics)


def check_grid(pattern: str, direction: float, owner: str = "") -> None:
    """Refuse an unknown pattern, and a direction that counts for nothing. ``owner`` begins their names."""
    validate.choice(f"{owner}pattern", pattern, PATTERNS)
    if validate.number(f"{owner}direction", direction) and pattern == "planar-quads":
        text = f"{owner}direction: is of a grid in plan, and planar-quads follow lines of curvature"
        raise OptionError(f"{text}; leave it out", what=f"{owner}direction", found=direction)


def _sheet_net(
    surface: Surface, patch: int, faces: Ints, sheet: SheetMesh, size: float, pattern: str, direction: float
) -> SheetNet:
    name = surface.patches[patch].name
    most = LARGEST * float(np.ptp(sheet.X, axis=0).max())
    if size > most:
        text = f"size: panels of {size:g} are too large for patch {name!r}; choose at most {most:.2g}"
        raise OptionError(text, what="size", found=size, expected=most)
    least = float(np.sqrt(face_areas(sheet.X[sheet.F]).sum() / MOST))
    if size < least:
        text = f"size: panels of {size:g} would be more than {MOST} on patch {name!r}; choose at least"
        raise OptionError(f"{text} {1.01 * least:.2g}", what="size", found=size, expected=least)
    if pattern == "planar-quads":
        return SheetNet(name, faces, sheet, *curvature_coordinates(sheet, size, name))
    c, s = np.cos(np.radians(direction)), np.sin(np.radians(direction))
    plan, every = (X @ surface.plane.axes[:2].T for X in (sheet.X, surface.vertices))
    middle = 0.5 * (every.max(axis=0) + every.min(axis=0))
    steps = np.array([0.5 * np.sqrt(3.0), 1.5]) if pattern == "hexagons" else np.ones(2)
    grid = (plan - middle) @ np.array([[c, -s], [s, c]]) / (size * steps)
    if area_vectors(sheet.X[sheet.F]).sum(axis=0) @ surface.plane.normal < 0.0:
        grid[:, 0] *= -1.0  # seen from outside: from below, as of a cushion's lower sheet
    at = np.stack([nudged(grid[:, k], sheet.F) for k in range(2)], axis=2)
    over = cross_2d(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]) <= 0.0
    if over.any():
        place = point_text(sheet.X[sheet.F[over]].mean(axis=1)[0].round(3))
        text = f"pattern: patch {name!r} is upright or overhangs at {place}, where a grid in plan folds"
        raise OptionError(f"{text}; choose 'planar-quads'", what="pattern", found=pattern)
    none = np.zeros(len(sheet.X), dtype=bool)
    return SheetNet(name, faces, sheet, at, np.flatnonzero(none), none, np.full(len(faces), np.nan))


def net_tables(
    surface: Surface, parts: Sequence[SheetNet], net: Net, axes: Floats
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Nodes, panels and beams of a net; see ``PanelNet``."""
    P, N, start, corner = net.points, net.normals, net.start, net.corner
    roof = surface.faces[surface.roof[surface.patch_of_face]]
    away = distances(np.concatenate([P, middles(P, start, corner)]), surface.vertices, roof)
    cosine = np.einsum("ni,ni->n", axes, N) / np.linalg.norm(axes, axis=1)
    lean = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    nodes = pd.DataFrame({"node": np.arange(len(P)) + 1, **dict(zip("xyz", P.T, strict=True))})
    nodes = nodes.assign(kind=KINDS[net.kind], distance=away[: len(P)], lean=lean)
    inside = np.add.reduceat(net.kind[corner] != INSIDE, start[:-1]) == 0
    umbilic = inside & (np.diff(start) != 4) & any(len(part.umbilics) for part in parts)
    panels = pd.DataFrame({"panel": np.arange(1, len(start)), "patch": [parts[k].name for k in net.sheet]})
    panels["kind"] = np.select([net.cut, umbilic], ["cut", "umbilic"], "whole")
    panels["corners"] = np.diff(start)
    panels["area"] = polygon_areas(P, start, corner)
    panels["planarity"], panels["convex"] = planarity(P, start, corner), convex(P, start, corner)
    panels["distance"] = np.maximum(np.maximum.reduceat(away[corner], start[:-1]), away[len(P) :])
    panels["turned"] = net.turned
    # the first and the last panel at each side; a second one is its neighbour
    sides = pd.DataFrame(net.sides + 1, columns=["node", "other"])
    sides["panel"] = sides["neighbour"] = np.repeat(panels["panel"].to_numpy(), panels["corners"])
    groups = sides.groupby(["node", "other"])
    beams = groups.agg({"panel": "first", "neighbour": "last"}).reset_index()
    beams["neighbour"] *= groups.size().to_numpy() > 1
    ends = beams[["node", "other"]].to_numpy() - 1
    beams.insert(0, "beam", np.arange(len(ends)) + 1)
    beams.insert(3, "length", segment_lengths(P, ends))
    return nodes, panels, beams.assign(torsion=torsion(P, ends, axes), torsion_normal=torsion(P, ends, N))
