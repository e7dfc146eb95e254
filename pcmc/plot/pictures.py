"""Surfaces: one, several side by side, and vector fields on one."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.arrays import Bools, Floats
from ..base.errors import OptionError
from ..surface import Surface
from ..surface.colours import patch_colors
from ..surface.geometry import area_vectors
from .colors import color_scale
from .figure import DPI, INK, SMALL, TEXT, Image, finish, new
from .raster import paint
from .scene import FIXED_DOT, NO_VALUE, SLIDING_DOT, View, mean_edge, scene, view_of

Path = str | os.PathLike[str]
ViewName = str | tuple[float, float]

MARGIN = 10.0  # pixels around each picture, for lines and dots that stick out
TITLE, BAR, LEGEND = 34.0, 92.0, 34.0  # pixels of height
EDGES_FROM = 9.0  # pixels: a mesh edge shorter than this is not drawn
DOTS_FROM = 7.0  # pixels: nor are supports closer together than this
NAMES = 6  # in a line of the legend
TALLEST = 1.1  # height of a picture at most, as a part of its width
ARROW = "#B2182B"


def draw(
    surface: Surface,
    path: Path | None = None,
    *,
    view: ViewName = "diagonal",
    scalars: npt.ArrayLike | None = None,
    label: str = "",
    limits: tuple[float, float] | None = None,
    cmap: str | None = None,
    supports: bool = True,
    edges: bool | None = None,
    numbers: npt.ArrayLike | None = None,
    form: str = ".3f",
    legend: bool = False,
    patches: Sequence[str] | None = None,
    title: str = "",
    width: int = 900,
    renderer: str = "auto",
) -> Image:
    """A picture of a surface, in parallel projection.

    Parameters
    ----------
    path : PNG file to write, or None.
    view : "diagonal", "elevation" (along Π), "plan" (onto Π), or (azimuth, elevation) in degrees.
    scalars : (n,) or (m,) values shown as colours, with a scale; NaN is grey. None: patch colours.
    label : what the scalars are, beneath the scale.
    limits : range of the scale; by default that of the values, symmetric if they have both signs.
    cmap : a matplotlib colour map; by default "viridis", or "RdBu_r" if the values have both signs.
    supports : dots, red at fixed vertices and blue at sliding ones.
    edges : the mesh's edges; by default where they are long enough to be told apart.
    numbers : (n,) values printed at the vertices that face the viewer, NaN not.
    form : the format of the numbers.
    legend : what the colours mean: patches, or places without a value; supports.
    patches : names of those to draw, such as the walls; by default all.
    width : of the picture in pixels.
    renderer : "pyvista", "matplotlib", or "auto": pyvista where the system has OpenGL.

    Returns
    -------
    (h,w,3) uint8 array, the picture.

    Raises
    ------
    OptionError : for an unknown view, renderer or colour map, or arrays of a wrong shape.
    MissingExtra : when pyvista or matplotlib is not installed.
    """
    return panel(
        [surface], path, views=[view], scalars=None if scalars is None else [scalars], label=label,
        limits=limits, cmap=cmap, supports=supports, edges=edges, patches=patches,
        numbers=None if numbers is None else [numbers], form=form, legend=legend,
        titles=[title] if title else (), width=width, renderer=renderer,
    )  # fmt: skip


def panel(
    surfaces: Sequence[Surface],
    path: Path | None = None,
    *,
    titles: Sequence[str] = (),
    columns: int | None = None,
    views: ViewName | Sequence[ViewName] = "diagonal",
    scalars: Sequence[npt.ArrayLike | None] | None = None,
    label: str = "",
    limits: tuple[float, float] | None = None,
    cmap: str | None = None,
    supports: bool = True,
    edges: bool | None = None,
    numbers: Sequence[npt.ArrayLike | None] | None = None,
    form: str = ".3f",
    legend: bool = False,
    patches: Sequence[str] | Sequence[Sequence[str] | None] | None = None,
    one_scale: bool = True,
    width: int = 1200,
    renderer: str = "auto",
) -> Image:
    """Several surfaces in one picture, with one scale of colour.

    ``views``, ``scalars``, ``numbers`` and ``patches`` are one per surface (``views`` and ``patches``
    may be one for all).
    ``one_scale`` draws a length equally long everywhere; without it what is drawn of each surface
    fills its place.
    The rest is as in ``draw``.
    """
    if not len(surfaces):
        raise OptionError("panel: expected at least one surface, found none")
    count = len(surfaces)
    given = _per_surface("views", [views] * count if _is_view(views) else views, count)
    named = _per_surface("titles", titles, count) if len(titles) else [""] * count
    values = _arrays("scalars", scalars, surfaces, faces=True)
    printed = _arrays("numbers", numbers, surfaces, faces=False)
    parts = _parts(patches, count)
    scale = color_scale(values, limits, cmap)
    seen = [view_of(s, v) for s, v in zip(surfaces, given, strict=True)]
    flat = [
        v.project(s.vertices if one_scale else s.vertices[_shown(s, part)])
        for s, v, part in zip(surfaces, seen, parts, strict=True)
    ]
    tiles, height = _arrange(flat, columns, width, TITLE if len(titles) else 0.0, one_scale)
    spacings = [mean_edge(s) * tile.scale for s, tile in zip(surfaces, tiles, strict=True)]
    dotted = [supports and spacing >= DOTS_FROM for spacing in spacings]
    names = _meanings(surfaces, parts, values, dotted) if legend else []
    key = LEGEND * math.ceil(len(names) / NAMES)
    foot = (BAR if scale else 0.0) + key
    figure = new(width, height + foot)
    for k, tile in enumerate(tiles):
        value, number = values[k], printed[k]
        one = scene(
            surfaces[k],
            seen[k],
            None if scale is None or value is None else scale.rgb(value),
            supports=dotted[k],
            edges=spacings[k] >= EDGES_FROM if edges is None else edges,
            patches=parts[k],
        )
        axes = _axes(figure, tile, height + foot)
        axes.imshow(paint(one, tile.low, tile.scale, tile.size, renderer), extent=tile.extent)
        axes.set_title(named[k], fontsize=TEXT, color=INK, pad=5.0)
        if number is not None:
            _print_numbers(axes, surfaces[k], seen[k], number, form)
    if scale is not None:
        scale.bar(figure, key, height + foot, label)
    if names:
        _legend(figure, names)
    return finish(figure, path)


def vectors(
    surface: Surface,
    field: npt.ArrayLike,
    path: Path | None = None,
    *,
    length: float = 0.12,
    most: int = 400,
    view: ViewName = "diagonal",
    label: str = "",
    title: str = "",
    supports: bool = True,
    edges: bool | None = None,
    width: int = 900,
    renderer: str = "auto",
) -> Image:
    """Vectors at the vertices (a mode, the reactions, the forces) as arrows on the surface.

    Parameters
    ----------
    field : (n,3).
    length : of the longest arrow, as a part of the surface's size.
    most : number of arrows; where there would be more, the longest of each neighbourhood shows.
    label : beside the arrow of unit (or round) length that tells the scale.
    view, title, supports, edges, width, renderer : as in ``draw``.
    """
    arrows = np.asarray(field, dtype=float)
    if arrows.shape != (surface.n, 3) or not np.isfinite(arrows).all():
        raise OptionError(
            f"field: expected finite numbers of shape ({surface.n}, 3), found {arrows.shape}"
        )
    seen = view_of(surface, view)
    longest = float(np.linalg.norm(arrows, axis=1).max())
    stretch = length * surface.size / longest if longest > 0.0 else 0.0
    at = seen.project(surface.vertices)
    tips = at + stretch * seen.project(arrows)
    tiles, height = _arrange([np.concatenate([at, tips])], 1, width, TITLE if title else 0.0)
    tile = tiles[0]
    spacing = mean_edge(surface) * tile.scale
    one = scene(
        surface, seen, None, supports=supports and spacing >= DOTS_FROM,
        edges=spacing >= EDGES_FROM if edges is None else edges,
    )  # fmt: skip
    figure = new(width, height + (LEGEND if label else 0.0))
    axes = _axes(figure, tile, height + (LEGEND if label else 0.0))
    axes.imshow(paint(one, tile.low, tile.scale, tile.size, renderer), extent=tile.extent)
    axes.set_title(title, fontsize=TEXT, color=INK, pad=5.0)
    if longest > 0.0:
        chosen = _thinned(at, np.linalg.norm(arrows, axis=1), most)
        quiver = axes.quiver(
            *at[chosen].T, *(tips - at)[chosen].T, angles="xy", scale_units="xy", scale=1.0,
            color=ARROW, width=2.2 / width, headwidth=4.0, headlength=5.0, headaxislength=4.5,
        )  # fmt: skip
        if label:
            unit = float(f"{longest:.1g}")
            axes.quiverkey(
                quiver, 0.5, -LEGEND / 2.0 / tile.size[1], unit * stretch,
                f"{unit:g} {label}", labelpos="E", fontproperties={"size": SMALL}, labelcolor=INK,
            )  # fmt: skip
    return finish(figure, path)


@dataclass(frozen=True, eq=False)
class _Tile:
    """A rectangle of pixels (from the upper left) and the picture coordinates in it."""

    corner: tuple[int, int]
    size: tuple[int, int]
    low: Floats
    scale: float

    @property
    def extent(self) -> tuple[float, float, float, float]:
        right, top = self.low + np.array(self.size) / self.scale
        return (float(self.low[0]), float(right), float(self.low[1]), float(top))


def _arrange(
    flat: Sequence[Floats], columns: int | None, width: int, title: float, one_scale: bool = True
) -> tuple[list[_Tile], int]:
    """Tiles around the given points (k,2), row by row, and the height of all."""
    count = len(flat)
    columns = min(columns or (count if count <= 3 else 2 if count == 4 else 3), count)
    lows = np.array([f.min(axis=0) for f in flat])
    spans = np.array([np.ptp(f, axis=0) for f in flat])
    wide = width // columns
    room = np.array([wide, TALLEST * wide]) - 2 * MARGIN
    scales = (room / np.maximum(spans, 1e-9 * spans.max())).min(axis=1)
    if one_scale:
        scales[:] = scales.min()
    tiles, top = [], 0.0
    for start in range(0, count, columns):
        row = range(start, min(start + columns, count))
        high = math.ceil(max(spans[k][1] * scales[k] for k in row) + 2 * MARGIN)
        for k in row:
            beside = (wide / scales[k] - spans[k][0]) / 2.0
            low = lows[k] - np.array([beside, MARGIN / scales[k]])
            corner = ((k - start) * wide, int(top + title))
            tiles.append(_Tile(corner, (wide, high), low, float(scales[k])))
        top += title + high
    return tiles, math.ceil(top)


def _axes(figure: Any, tile: _Tile, height: float) -> Any:
    width = figure.get_figwidth() * DPI
    (x, y), (w, h) = tile.corner, tile.size
    axes = figure.add_axes((x / width, 1.0 - (y + h) / height, w / width, h / height))
    axes.set_axis_off()
    return axes


def _print_numbers(axes: Any, surface: Surface, view: View, numbers: Floats, form: str) -> None:
    from matplotlib.patheffects import withStroke

    shown = np.flatnonzero(np.isfinite(numbers) & _facing(surface, view))
    for (x, y), number in zip(view.project(surface.vertices[shown]), numbers[shown], strict=True):
        axes.text(
            x, y, format(number, form), fontsize=SMALL, color=INK, ha="center", va="center",
            path_effects=[withStroke(linewidth=1.4, foreground="white")],
        )  # fmt: skip


def _facing(surface: Surface, view: View) -> Bools:
    """(n,) vertices whose sheet turns its upper side, along the normal of Π, to the viewer."""
    X, F = surface.vertices, surface.faces
    area = area_vectors(X[F])
    area *= np.where(area @ np.array(surface.plane.normal) < 0.0, -1.0, 1.0)[:, None]
    towards = np.repeat(area @ view.axes[2], 3)
    return np.bincount(F.ravel(), towards, surface.n) > 0.0


def _parts(patches: Any, count: int) -> list[Sequence[str] | None]:
    """The names of the patches to draw, or None for all, for each surface."""
    if patches is None or all(isinstance(entry, str) for entry in patches):
        return [patches] * count
    return _per_surface("patches", patches, count)


def _shown(surface: Surface, patches: Sequence[str] | None) -> Bools:
    """(n,) vertices of the patches drawn."""
    shown = np.full(surface.n, patches is None)
    faces = surface.patch_faces([surface.patch_index(name) for name in patches or ()])
    shown[surface.faces[faces]] = True
    return shown


def _meanings(
    surfaces: Sequence[Surface],
    parts: Sequence[Sequence[str] | None],
    values: Sequence[Floats | None],
    dotted: Sequence[bool],
) -> list[tuple[str, Any, bool]]:
    """Name, colour and whether it is a dot, of all that a picture's colours can mean."""
    colors: dict[str, Any] = {}
    dots: dict[str, Any] = {}
    for surface, part, value, supports in zip(surfaces, parts, values, dotted, strict=True):
        shown = _shown(surface, part)
        for patch, color in zip(surface.patches, patch_colors(surface), strict=True):
            if value is None and (part is None or patch.name in part):
                colors.setdefault(patch.name, tuple(color))
        if value is not None and np.isnan(value[shown] if len(value) == surface.n else value).any():
            colors["no value"] = NO_VALUE
        if supports and surface.fixed[shown].any():
            dots["fixed"] = FIXED_DOT
        if supports and surface.on_plane[shown].any():
            dots["sliding"] = SLIDING_DOT
    return [(n, c, False) for n, c in colors.items()] + [(n, c, True) for n, c in dots.items()]


def _legend(figure: Any, names: Sequence[tuple[str, Any, bool]]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch as Swatch

    drawn: list[Any] = [
        Line2D([], [], linestyle="", marker="o", markersize=2.6, color=color, label=name)
        if dot
        else Swatch(facecolor=color, edgecolor=INK, linewidth=0.4, label=name)
        for name, color, dot in names
    ]
    figure.legend(
        handles=drawn, loc="lower center", ncols=min(len(names), NAMES), fontsize=SMALL,
        frameon=False, labelcolor=INK, handlelength=1.2, handleheight=1.0, borderaxespad=0.3,
    )  # fmt: skip


def _thinned(at: Floats, size: Floats, most: int) -> npt.NDArray[np.intp]:
    """Indices of the longest arrow in each square of a grid of about ``most`` squares."""
    keep = np.flatnonzero(size > 1e-6 * size.max())
    if len(keep) <= most:
        return keep
    span = np.ptp(at[keep], axis=0)
    cell = np.sqrt(max(span[0] * span[1], 1e-12 * span.max() ** 2) / most)
    square = np.floor((at[keep] - at[keep].min(axis=0)) / cell).astype(np.int64)
    order = np.lexsort((-size[keep], square[:, 1], square[:, 0]))
    first = np.ones(len(order), dtype=bool)
    first[1:] = (np.diff(square[order], axis=0) != 0).any(axis=1)
    return keep[order[first]]


def _is_view(view: object) -> bool:
    return isinstance(view, str) or (
        isinstance(view, Sequence) and len(view) == 2 and not isinstance(view[0], str | Sequence)
    )


def _per_surface(name: str, entries: Any, count: int) -> list[Any]:
    if len(entries) != count:
        raise OptionError(f"{name}: expected {count}, one per surface, found {len(entries)}")
    return list(entries)


def _arrays(
    name: str,
    given: Sequence[npt.ArrayLike | None] | None,
    surfaces: Sequence[Surface],
    faces: bool,
) -> list[Floats | None]:
    """One float array or None per surface, of length n (or m, where ``faces``)."""
    if given is None:
        return [None] * len(surfaces)
    result: list[Floats | None] = []
    for values, surface in zip(_per_surface(name, given, len(surfaces)), surfaces, strict=True):
        array = None if values is None else np.asarray(values, dtype=float)
        shapes = [(surface.n,), (surface.m,)] if faces else [(surface.n,)]
        if array is not None and array.shape not in shapes:
            wanted = " or ".join(map(str, shapes))
            raise OptionError(f"{name}: expected shape {wanted}, found {array.shape}")
        result.append(array)
    return result
