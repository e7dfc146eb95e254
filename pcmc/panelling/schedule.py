"""The schedule of a roof's panels: families, sizes, angles, areas, edge totals; laid flat, side by side."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ..base import validate
from ..base.arrays import Floats, Ints
from ..base.errors import SurfaceError
from ..base.units import NO_UNITS, Units
from ..certificate import Certificate
from ..certificate.certificate import certified
from ..certificate.tables import head_text
from ..surface import Surface, expect_surface
from ..surface.geometry import area_vectors, edge_vectors, face_areas, segment_lengths
from ..surface.lagrange import expect_flat
from .families import STEPS, clockwise, triangle_families

MIRROR_IMAGES = ("alike", "apart")
SHOWN = 12  # families that ``print`` shows
SPACE, ROUNDING = 6.0, 1e-9  # mm: between panels; of their places
TURNS = np.radians(np.arange(180.0))  # in which a panel is tried that does not fit as it lies


@dataclass(frozen=True, eq=False)
class Panels:
    """The panels of a surface: its triangles, in families. ``print`` shows the table.

    Panels and families are numbered from 1; larger families first. Lengths are in the surface's unit, angles
    in degrees.

    Attributes
    ----------
    surface, certificate : the surface and its certificate.
    tolerance : corresponding edges of every two panels of a family differ in length by at most this.
    mirror_images : "alike", one family holds a panel and its mirror image; or "apart".
    families : a row per family: its number ``family``; ``count``, the number of its panels; ``mirrored``, how
        many are mirror images of the others, turned over; ``a``, ``b``, ``c``, the middle of the range of
        each edge's length, ascending; ``spread``, the largest difference of corresponding edges; ``area`` of
        its panels together, length².
    panels : a row per panel: ``panel``, its number; ``face``, its row in ``surface.faces``; ``patch``;
        ``family``; ``mirrored``, whether it is a mirror image of most others of its family; ``a``, ``b``,
        ``c``, its edges' lengths in the order of its family; ``edge_a``, ``edge_b``, ``edge_c``, their rows
        in ``surface.topology.edges``; ``area``, length².
    edges : a row per pair of neighbours, and per edge of a single panel: ``edge``, its row in
        ``surface.topology.edges``; ``kind``, "inside" a patch, "junction" (also a seam between patches),
        "mirror", where the roof goes on, or "boundary"; ``length``; ``panel``, ``neighbour``, their numbers,
        0 for none; ``dihedral``, the angle between both on the inner side of the first: 180 where they are
        flat, less at a ridge, more at a valley; NaN with one panel. Where more than two panels meet, the edge
        has a row for each pair, in turn around it.
    flat : (k,3,2) the panels laid flat, outside up, corners as in ``surface.faces``: the longest edge lies on
        the x axis and starts at the origin.
    at_least : no partition of these panels within the tolerance has fewer families.
    """

    surface: Surface
    tolerance: float
    mirror_images: str
    certificate: Certificate
    families: pd.DataFrame
    panels: pd.DataFrame
    edges: pd.DataFrame
    flat: Floats
    at_least: int

    @property
    def count(self) -> int:
        """Number of families."""
        return len(self.families)

    @property
    def area(self) -> float:
        """Area of all panels, length²."""
        return float(self.panels["area"].sum())

    @property
    def largest(self) -> pd.Series:
        """The row of the panel with the largest area."""
        return self.panels.iloc[self.panels["area"].argmax()]

    @property
    def smallest(self) -> pd.Series:
        """The row of the panel with the smallest area."""
        return self.panels.iloc[self.panels["area"].argmin()]

    @property
    def edge_totals(self) -> pd.DataFrame:
        """``kind``, ``count``, ``length``: of all edges, each once."""
        once = self.edges.drop_duplicates("edge")
        totals = once.groupby("kind")["length"].agg(["size", "sum"])
        return totals.set_axis(["count", "length"], axis=1).reset_index()

    @property
    def family_of_face(self) -> Floats:
        """(m,) the family of each face of the surface, NaN for walls that are no panels: for pictures."""
        family = self.panels.set_index("face")["family"]
        return family.reindex(range(self.surface.m)).to_numpy(dtype=float)

    def text(self, units: Units = NO_UNITS) -> str:
        """Totals and the largest families, with the units of the numbers if they are given."""
        total, angles = self.edge_totals, self.edges["dihedral"].dropna()
        lengths = ", ".join(f"{r.kind} {r.length:.6g} ({r['count']})" for _, r in total.iterrows())
        between = f"{angles.min():.1f} to {angles.max():.1f} degrees between neighbours"
        needed = f"at least {self.at_least} are needed"
        rows = {"panels": f"{len(self.panels)} in {self.count} families, {needed}"}
        rows["tolerance"] = f"{self.tolerance:g}, mirror images {self.mirror_images}"
        rows |= {"area": f"{self.area:.8g}", "largest panel": _described(self.largest)}
        rows["smallest panel"] = _described(self.smallest)
        rows["edges"] = f"{total['length'].sum():.6g} long: {lengths}"
        rows["angles"] = between if len(angles) else ""
        head = head_text(self.certificate, units, rows)
        table = self.families.head(SHOWN).to_string(index=False, float_format=lambda x: f"{x:.5g}")
        rest = self.count - SHOWN
        return f"{head}\n\n{table}" + (f"\n... {rest} more families" if rest > 0 else "")

    __str__ = text


def panels(
    surface: Surface,
    tolerance: float,
    *,
    mirror_images: str = "alike",
    walls: bool = False,
    anyway: bool = False,
    certificate: Certificate | None = None,
) -> Panels:
    """The panels of a roof, in as few families of congruent triangles as a search finds.

    Parameters
    ----------
    tolerance : largest difference between corresponding edges of two panels of a family, length, > 0.
    mirror_images : "alike": a panel that is turned over fits, as where both sides are the same; "apart":
        mirror images are of different families.
    walls : whether triangles of walls are panels, too.
    anyway : accept a surface that is not certified.
    certificate : of the surface, where it is known; by default it is computed.

    Raises
    ------
    SurfaceError : the surface is not certified, or has no panels; the certificate is another surface's.

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> schedule = panels(roof, tolerance=0.01)
    >>> schedule.families[["count", "a", "b", "c"]].round(9).to_numpy().tolist()
    [[4.0, 1.457737974, 1.457737974, 2.0]]
    """
    expect_surface(surface)
    expect_flat(surface, "panels")
    tolerance = validate.positive("tolerance", tolerance)
    validate.choice("mirror_images", mirror_images, MIRROR_IMAGES)
    validate.flag("walls", walls)
    certificate = certified(surface, anyway, certificate)
    faces = np.flatnonzero(surface.roof[surface.patch_of_face] | walls)
    if not len(faces):
        hint = "; pass walls=True to count walls as panels" if surface.m else ""
        text = f"surface: no panels: every patch is a wall{hint}"
        raise SurfaceError(text, what="surface", found=0, expected="a patch that is no wall")
    corners = surface.vertices[surface.faces[faces]]
    lengths = np.linalg.norm(edge_vectors(corners), axis=2)
    family, order, at_least = triangle_families(lengths, tolerance, mirror_images == "apart")
    table = _panel_table(surface, faces, lengths, family, order, tolerance)
    groups = table.groupby("family")
    least, most = groups[["a", "b", "c"]].min(), groups[["a", "b", "c"]].max()
    counts = pd.DataFrame({"count": groups.size(), "mirrored": groups["mirrored"].sum()})
    spread, area = (most - least).max(axis=1), groups["area"].sum()
    shown = counts.join(0.5 * (least + most)).assign(spread=spread, area=area).reset_index()
    tables = shown, table, _edge_table(surface, faces)
    return Panels(surface, tolerance, mirror_images, certificate, *tables, laid_flat(corners), at_least)


def _panel_table(
    surface: Surface, faces: Ints, lengths: Floats, family: Ints, order: Ints, tolerance: float
) -> pd.DataFrame:
    aligned = pd.DataFrame(np.take_along_axis(lengths, order, axis=1))
    mean = aligned.groupby(family).transform("mean").to_numpy()
    by_length = np.argsort(np.round(mean / tolerance * STEPS), axis=1, kind="stable")
    order = np.take_along_axis(order, by_length, axis=1)
    over = pd.Series(clockwise(order))
    table = pd.DataFrame({"panel": np.arange(len(faces)) + 1, "face": faces})
    table["patch"] = [surface.patches[k].name for k in surface.patch_of_face[faces]]
    table["family"], table["mirrored"] = family + 1, over != (over.groupby(family).transform("mean") > 0.5)
    table[["a", "b", "c"]] = np.take_along_axis(lengths, order, axis=1)
    edges = np.take_along_axis(surface.topology.edge_of_face[faces], order, axis=1)
    table[["edge_a", "edge_b", "edge_c"]] = edges
    return table.assign(area=face_areas(surface.vertices[surface.faces[faces]]))


def _edge_table(surface: Surface, faces: Ints) -> pd.DataFrame:
    topo = surface.topology
    pairs = joints(surface.vertices, surface.faces[faces], topo.edge_of_face[faces])
    kinds = {"junction": topo.junction_edge | topo.seam_edge}
    kinds |= {"mirror": surface.mirror_edge, "boundary": topo.boundary_edge}
    kind, edge = np.select([*kinds.values()], [*kinds], "inside"), pairs["edge"].to_numpy()
    lengths = segment_lengths(surface.vertices, topo.edges[edge])
    table = pairs[["edge"]].assign(kind=kind[edge], length=lengths, panel=pairs["first"] + 1)
    return table.assign(neighbour=pairs["second"] + 1, dihedral=pairs["dihedral"])


def _described(panel: pd.Series) -> str:
    sizes = " × ".join(f"{panel[name]:.4g}" for name in "abc")
    return f"{panel['panel']} of patch {panel['patch']!r}: {sizes}, area {panel['area']:.4g}"


def laid_flat(P: Floats) -> Floats:
    """(m,3,2) triangles with corners P (m,3,3) laid flat, their outside up: congruent, length.

    The longest edge lies on the x axis and starts at the origin; the third corner is above it.

    >>> laid_flat(np.array([[[0, 0, 1], [0, 0, 5], [0, 3, 1.0]]])).round(12).tolist()
    [[[3.2, 2.4], [0.0, 0.0], [5.0, 0.0]]]
    """
    edges = edge_vectors(P)
    lengths = np.linalg.norm(edges, axis=2)
    every, apex = np.arange(len(P)), lengths.argmax(axis=1)
    first, second = (apex + 1) % 3, (apex + 2) % 3
    base = lengths[every, apex]
    along = edges[every, apex] / base[:, None]
    flat = np.zeros((len(P), 3, 2))
    flat[every, second, 0] = base
    flat[every, apex, 0] = np.einsum("ij,ij->i", P[every, apex] - P[every, first], along)
    flat[every, apex, 1] = 2.0 * np.linalg.norm(area_vectors(P), axis=1) / base
    return flat


def joints(X: Floats, F: Ints, edge_of_face: Ints) -> pd.DataFrame:
    """A row for each pair of triangles that are neighbours at an edge, and for each edge of a single one.

    Columns: ``edge``; ``first``, ``second``, rows of F (-1 for none); ``dihedral``, the angle between the two
    on the inner side of the first, degrees: 180 where they are flat, less at a ridge, more at a valley. Where
    k > 2 triangles meet, the edge has k rows, in turn around it.

    >>> X = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, -1.0]])
    >>> joints(X, np.array([[0, 1, 2], [1, 0, 3]]), np.array([[1, 2, 0], [3, 4, 0]])).dihedral.tolist()
    [135.0, nan, nan, nan, nan]
    """
    order = np.argsort(edge_of_face.ravel(), kind="stable")
    edge, face, side = edge_of_face.ravel()[order], order // 3, order % 3
    _, start, group, count = np.unique(edge, return_index=True, return_inverse=True, return_counts=True)
    lead = start[group]  # the first triangle at each edge: angles are seen from it
    along, normal = edge_vectors(X[F])[face, side], area_vectors(X[F])[face]
    both = np.stack([np.cross(normal, along), normal])
    inward, normal = both / np.maximum(np.linalg.norm(both, axis=2), 1e-300)[..., None]
    sine, cosine = (np.einsum("ij,ij->i", inward, of[lead]) for of in (-normal, inward))
    angle = np.degrees(np.arctan2(sine, cosine)) % 360.0
    angle[start] = 0.0
    turn = np.lexsort((angle, edge))
    edge, face, angle = edge[turn], face[turn], angle[turn]
    after, last = np.arange(len(edge)) + 1, start + count - 1
    after[last] = start
    between = (angle[after] - angle) % 360.0
    between[count[group] == 1] = np.nan
    second = np.where(np.isnan(between), -1, face[after])
    table = pd.DataFrame({"edge": edge, "first": face, "second": second, "dihedral": between})
    return table.drop(last[count == 2]).reset_index(drop=True)  # two triangles are one pair


def packed(panels: Iterable[Floats], wide: float, high: float) -> Iterator[tuple[int, Floats]]:
    """The page of each panel (3,2), mm, and the panel placed on it: rows below one another, from y = 0 down.

    >>> panel = np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]])
    >>> [(page, placed[0].tolist()) for page, placed in packed([panel] * 3, 30.0, 12.0)]
    [(0, [0.0, -10.0]), (0, [16.0, 0.0]), (1, [0.0, -10.0])]
    """
    page, y, depth = 0, 0.0, 0.0  # of the row that is filled: its top below the page's, and its height
    row: list[tuple[float, Floats]] = []  # how far to the right each reaches, and where it is
    for panel in panels:
        size, placed = np.ptp(panel, axis=0), _beside(row, panel)
        if placed[:, 0].max() > wide + ROUNDING or y + size[1] > high + ROUNDING:
            y, depth, row = y + depth + SPACE, 0.0, []
            if y + size[1] > high + ROUNDING:
                page, y = page + 1, 0.0
            placed = _beside(row, panel)
        row.append((float(placed[:, 0].max()), placed))
        depth = max(depth, float(size[1]))
        yield page, placed - [0.0, y]


def _beside(row: list[tuple[float, Floats]], panel: Floats) -> Floats:
    """The panel (k,2) to the right of those of a row, one side up or the other, as far left as possible. Its
    highest point has y = 0, at the left end of a row its leftmost one x = 0."""
    placements = []
    for turned in (panel, -panel):
        at = turned - np.array([turned[:, 0].min(), turned[:, 1].max()])
        shift = 0.0
        for right, other in reversed(row):  # until it only touches, at a corner of one of the two
            if right + SPACE <= shift:
                continue
            low, high = max(other[:, 1].min(), at[:, 1].min()), min(other[:, 1].max(), at[:, 1].max())
            levels = np.clip(np.append(other[:, 1], at[:, 1]), low, high)
            gap = float((_reach(other, levels).max(axis=0) - _reach(at, levels).min(axis=0)).max())
            shift = max(shift, gap + SPACE)
        placements.append(at + np.array([shift, 0.0]))
    return min(placements, key=lambda placed: float(placed[:, 0].max()))


def _reach(triangle: Floats, levels: Floats) -> Floats:
    """(2,k) the least and the largest x of a triangle at each level y."""
    (a, b), (c, d) = (points.T[..., None] for points in (triangle, np.roll(triangle, -1, axis=0)))
    share = (levels - b) / np.where(d == b, np.nan, d - b)
    sides = np.where((share >= 0.0) & (share <= 1.0), a + share * (c - a), np.nan)
    x = np.concatenate([sides, np.where(levels == b, a, np.nan)])  # where a corner is, also of a level side
    return np.stack([np.nanmin(x, axis=0), np.nanmax(x, axis=0)])


def turned_to_fit(corners: Floats, wide: float, high: float) -> Floats | None:
    """A triangle (3,2) as it lies, or turned so that it is as low as possible; None if it fits in no way."""
    if (np.ptp(corners, axis=0) <= np.array([wide, high]) + ROUNDING).all():
        return corners
    cosine, sine = np.cos(TURNS), np.sin(TURNS)
    turned = corners @ np.array([[cosine, sine], [-sine, cosine]]).transpose(2, 0, 1)
    sizes = np.ptp(turned, axis=1)
    fit = np.flatnonzero((sizes <= np.array([wide, high]) + ROUNDING).all(axis=1))
    return turned[fit[sizes[fit, 1].argmin()]] if len(fit) else None
