"""The cutting pattern of a roof: where it is cut, and strips that fit the cloth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..base.arrays import Floats, mask_of
from ..base.errors import OptionError, SurfaceError
from ..certificate import Certificate
from ..certificate.certificate import certified
from ..surface import Surface, expect_surface
from ..surface.geometry import face_areas, lengths_along
from ..surface.lagrange import expect_flat
from ..surface.pieces import point_text
from .cut_mesh import ClothSheet, CutMesh, cut_mesh, sheet_axes, with_levels, with_lines
from .settings import CuttingOptions
from .sewing import FOLDED, Cloth, seams_of
from .strips import CuttingPattern, Strip

ACROSS = 4  # edges across the narrowest strip, about
ROUNDS = 12  # in which levels are moved until every strip fits the cloth
STUCK, SMALLER = 3, 0.95  # rounds after which the widest strip must be smaller by this part,
TOO_WIDE = 1.25  # unless it is less than so much wider than the cloth
FILL = 0.995  # of the cloth's width that strips are laid out for
ROUNDING = 1e-9  # of a width
MOST_STRIPS = 1000  # of a sheet
MOST_STRAIN = 0.25  # of cloth: strips that need more are refused


def cutting_pattern(
    surface: Surface,
    width: float | None = None,
    *,
    anyway: bool = False,
    certificate: Certificate | None = None,
    **options: Any,
) -> CuttingPattern:
    """Cut a roof into strips of cloth along geodesics, and lay them flat.

    Junctions, seams between patches and cables are always cut. Each sheet between them is cut into strips of
    about the same width, from rim to rim; ends of seams that nearly meet at a junction meet. The strips are
    laid flat with the least strain for which the sides of each seam are equally long.

    Parameters
    ----------
    width : of the cloth: no strip is wider, with its allowances.
    anyway : cut a surface that is not certified.
    certificate : of the surface, where it is known; by default it is computed.
    options : of ``pcmc.cloth.CuttingOptions``: ``strips``, ``seams``, ``direction``, ``compensation``,
        ``stiffness``, ``poisson``, ``allowance``, ``hem``, ``notches``.

    Raises
    ------
    OptionError : for a seam off the roof or across another, a width that seams cannot reach, a strip that no
        cloth could follow.
    SurfaceError : the surface is not certified, or a sheet of it is closed.
    MissingExtra : potpourri3d is not installed.

    >>> from pcmc import Patch
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> pattern = cutting_pattern(roof, width=1.2)
    >>> len(pattern.strips), bool(pattern.largest_difference < 1e-6)
    (2, True)
    """
    return cutting_pattern_of(surface, CuttingOptions(width=width, **options), anyway, certificate)


def cutting_pattern_of(
    surface: Surface, options: CuttingOptions, anyway: bool = False, certificate: Certificate | None = None
) -> CuttingPattern:
    """The cutting pattern that ``options`` ask for; the rest as of ``cutting_pattern``."""
    expect_surface(surface)
    expect_flat(surface, "the cutting pattern")
    options.check(surface)
    certificate = certified(surface, anyway, certificate)
    areas = face_areas(surface.vertices[surface.faces])
    area = surface.roof * np.bincount(surface.patch_of_face, areas, len(surface.patches))
    counts = [options.of_patch("strips", patch.name) or np.inf for patch in surface.patches]
    widths = [options.net_width or np.inf, *(width for width in area**0.5 / counts if width > 0.0)]
    if drawn := sum(float(lengths_along(line)[-1]) for line in options.lines):
        widths.append(float(area.sum()) / drawn)
    base = with_lines(cut_mesh(surface, min(widths) / ACROSS), options.lines, surface.plane)
    if not len(base.F):
        text = "surface: it has no roof to be cut: every patch is a wall"
        raise SurfaceError(text, what="surface", found=0, expected="a patch that is no wall")
    sheets, widest = _sheets(surface, base, options), list[float]()
    for _ in range(ROUNDS):
        mesh = with_levels(base, sheets)
        piece = mesh.pieces.piece
        opened = np.unique(piece[mesh.cut_edge[mesh.topology.edge_of_face].any(axis=1)])
        for closed in np.setdiff1d(piece, opened).tolist():
            name = surface.patches[surface.patch_of_face[mesh.source[piece == closed][0]]].name
            text = f"patch {name!r} is closed, without a rim: no seam starts anywhere;"
            raise SurfaceError(f"{text} draw seams that open it", what="surface", where=name)
        cloth = Cloth.of(surface, mesh, sheets, options)
        points, before = cloth.laid_flat(), sheets
        sheets = _moved_levels(cloth, points, sheets, options, widest)
        if sheets == before:
            break
    return CuttingPattern(surface, certificate, options, _strips(cloth, points, options), seams_of(cloth))


def _sheets(surface: Surface, base: CutMesh, options: CuttingOptions) -> list[ClothSheet]:
    """The sheets without drawn seams, at even levels; in the order of patches and places, as seams of the
    later ones meet those of the earlier."""
    piece, topo, net = base.pieces.piece, base.topology, options.net_width
    drawn = mask_of(topo.edge_numbers(base.cuts[base.seam >= 0]), len(topo.edges))
    patch = surface.patch_of_face[base.source[np.unique(piece, return_index=True)[1]]]
    x, y, _ = (base.middles / base.size).round(6).T
    order, sheets = np.lexsort((y, x, patch)), list[ClothSheet]()
    for k in order[~np.isin(order, piece[drawn[topo.edge_of_face].any(axis=1)])].tolist():
        source, P = base.source[piece == k], base.X[base.F[piece == k]]
        name = surface.patches[surface.patch_of_face[source[0]]].name
        if (count := options.of_patch("strips", name)) is None and net is None:
            continue
        along, across = sheet_axes(P, surface.plane, options.of_patch("direction", name))
        low, high = (P @ across).min(), (P @ across).max()
        number = count if net is None else np.ceil((high - low) / net - 1e-9)
        if not number <= MOST_STRIPS:
            text = f"patch {name!r} would have {number:.3g} strips; at most {MOST_STRIPS} are made: give"
            raise OptionError(f"{text} a larger width, or fewer strips", what="width", found=number)
        mine = mask_of(source, surface.m)
        levels = np.linspace(low, high, max(int(number), 1) + 1)
        sheets.append(ClothSheet(name, mine, along, across, levels))
    return sheets


def _moved_levels(
    cloth: Cloth, points: Floats, sheets: Sequence[ClothSheet], options: CuttingOptions, widest: list[float]
) -> list[ClothSheet]:
    """Sheets with levels between which strips are equally wide, more of them where they were too wide; the
    same where all fit. OptionError for a strip that will not fit. ``widest`` are the widths of the widest
    strips of the rounds before; that of this one is added."""
    number, net = len(widest), options.net_width
    widths = np.array([np.ptp(points[cloth.strip_of_vertex == k, 1]) for k in range(len(cloth.sheet))])
    if net is None:
        widest.append(0.0)
        if number == 2:
            return list(sheets)
    else:
        wide = np.flatnonzero(widths > np.where(cloth.sheet < 0, net * (1.0 + ROUNDING), FILL * net))
        widest.append(float(widths[wide].max(initial=0.0)))
        stuck = number > STUCK and widest[-1] > max(TOO_WIDE * net, SMALLER * widest[-1 - STUCK])
        if (cloth.sheet[wide] < 0).any() or (len(wide) and number == ROUNDS - 1) or stuck:
            k = int(wide[np.lexsort((-widths[wide], cloth.sheet[wide]))[0]])
            around = point_text(cloth.mesh.X[cloth.mesh.F[cloth.strip_of_face == k]].mean(axis=(0, 1)))
            text = f"width: a strip of {cloth.names[k]!r} around {around} is {widths[k]:.4g} wide,"
            text += f" and {net:.4g} is there between allowances; draw seams in it"
            raise OptionError(text, what="width", found=options.width)
    rim = cloth.seam_of_edge[cloth.sides.edge] < 0  # its middle tells a strip's levels: seams bulge over them
    place, strip = cloth.mesh.X[cloth.mesh.topology.edges[cloth.sides.edge[rim]]], cloth.sides.strip[rim]
    count_of = np.maximum(np.bincount(strip, minlength=len(widths)), 1)
    moved = list(sheets)
    for k, sheet in enumerate(sheets):
        mine, count = np.flatnonzero(cloth.sheet == k), len(sheet.levels) - 1
        middle = (np.bincount(strip, place.mean(axis=1) @ sheet.across, len(widths)) / count_of)[mine]
        row = np.clip(np.searchsorted(sheet.levels, middle) - 1, 0, count - 1)
        found = np.zeros(count)
        np.maximum.at(found, row, widths[mine])
        found = np.where(found > 0.0, found, np.diff(sheet.levels))
        if net is not None:
            if (found <= FILL * net).all():
                continue
            count = max(count, int(np.ceil(found.sum() / (FILL * net)))) + int(number > 2)
        total = np.append(0.0, np.cumsum(found))
        levels = np.interp(np.linspace(0.0, total[-1], count + 1), total, sheet.levels)
        moved[k] = replace(sheet, levels=levels)
    return moved


def _strips(cloth: Cloth, points: Floats, options: CuttingOptions) -> list[Strip]:
    """The strips of a cloth laid flat, sewn; OptionError for one that no cloth follows."""
    stretches = list(map(options.stretch, cloth.tensions.tolist(), cloth.names))
    (flat, strain), strips = cloth.sewn(points, stretches), list[Strip]()
    for k, name in enumerate(cloth.names):
        mine, used = cloth.strip_of_face == k, cloth.strip_of_vertex == k
        faces, source = cloth.local[cloth.mesh.pieces.faces[mine]], cloth.mesh.source[mine]
        laid = cloth.X[used], flat[used], stretches[k], strain[mine]
        strips.append(Strip(k + 1, name, faces, source, *laid, cloth.outlines(k)))
        most = float(np.abs(strain[mine]).max())
        over = most > 0.5 * FOLDED or not strips[-1].polygon.is_valid
        if over or most > MOST_STRAIN:
            problem = "lies over itself" if over else f"stretches by {100.0 * most:.0f} %"
            text = f"strip {k + 1} of patch {name!r} {problem} where it is laid flat: no cloth"
            text += " follows it; make strips narrower, or draw a seam that opens it"
            raise OptionError(text, what="width")
    return strips
