"""Pictures of surfaces: one, or several side by side, also with arrows at the vertices."""

from __future__ import annotations

import html
from base64 import b64encode
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import MissingExtra, OptionError
from ..base.files import PathLike
from ..base.units import NO_UNITS, Units
from ..certificate.forces import Forces
from ..surface import Surface
from ..surface.geometry import area_vectors
from .colours import add_picture_legend, color_scale
from .figure import DPI, INK, SMALL, TEXT, finish, fit_height, grid, new, png
from .scene import Camera, Image, Rendering, frames_of, mean_edge, paint, scene, view_of

if TYPE_CHECKING:
    from .. import PanelNet, Panels

ViewName = str | tuple[float, float]

EDGES_FROM = 9.0  # pixels: a mesh edge shorter than this is not drawn
DOTS_FROM = 7.0  # pixels: nor are supports closer together than this
CELL_WIDTH = 700  # pixels of a picture in a notebook
ABOVE = 7.0  # pixels above a title and below a picture
WIDEST = 0.93  # of its picture's width: a title, whose letters shrink in steps
FLAT_PERCENT = 1.0  # the least end of the scale of planarity: a glass pane bears a few tenths
RED = ARROW = "#B2182B"
AT_POINTS = "#2166AC"


def draw(
    surface: Surface,
    path: PathLike | None = None,
    *,
    view: ViewName = "diagonal",
    scalars: npt.ArrayLike | None = None,
    numbers: npt.ArrayLike | None = None,
    title: str = "",
    width: int = 900,
    **options: Any,
) -> Image:
    """A picture of a surface, in parallel projection: an (h,w,3) uint8 array.

    Parameters
    ----------
    path : PNG, SVG or PDF file to write, or None.
    view : "diagonal", "elevation" (along Π), "plan" (onto Π), or (azimuth, elevation) in degrees.
    scalars : (n,) or (m,) values shown as colours, with a scale; NaN is grey. None: patch colours.
    label : what the scalars are, beneath the scale.
    limits : range of the scale; by default that of the values, symmetric if they have both signs.
    cmap : a matplotlib colour map; by default "viridis", or "RdBu_r" if the values have both signs.
    supports : dots, red at fixed vertices and blue at sliding ones.
    edges : the mesh's edges; by default if they are long enough to be distinguished.
    numbers : (n,) values printed at the vertices that face the viewer, NaN not.
    form : the format of the numbers.
    legend : explain the colours of patches, supports, and places without a value.
    patches : names of those to draw, such as the walls; by default all.
    mark : a text in the corner, of a roof that is not in order.
    width : of the picture in pixels.
    renderer : "pyvista", "matplotlib", or "auto": pyvista for many triangles where the system has OpenGL.

    Raises
    ------
    OptionError : for an unknown view, renderer or colour map, or arrays of a wrong shape.
    MissingExtra : when pyvista or matplotlib is not installed.

    Examples
    --------
    >>> from pcmc import Patch
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    >>> film = Surface(corners, [[0, 1, 2]], [0], [Patch("film", 1.0)], fixed=[0, 1])
    >>> draw(film, view="plan", width=300, renderer="matplotlib").shape[1:]
    (300, 3)
    """
    given = {"views": view, "scalars": scalars, "numbers": numbers}
    one: dict[str, Any] = {name: None if value is None else [value] for name, value in given.items()}
    return panel([surface], path, titles=[title] if title else (), width=width, **one, **options)


def panel(
    surfaces: Sequence[Surface],
    path: PathLike | None = None,
    *,
    titles: Sequence[str] = (),
    columns: int | None = None,
    views: ViewName | Sequence[ViewName] = "diagonal",
    scalars: Sequence[npt.ArrayLike | None] | None = None,
    numbers: Sequence[npt.ArrayLike | None] | None = None,
    patches: Sequence[str] | Sequence[Sequence[str] | None] | None = None,
    width: int = 1200,
    **options: Any,
) -> Image:
    """Several surfaces in one picture, with one scale of colour.

    ``views``, ``scalars``, ``numbers`` and ``patches`` are one per surface; ``views`` and ``patches``
    may be one for all. ``one_scale`` draws a length equally long everywhere; without it each surface
    fills its place. The rest is as in ``draw``.
    """
    count = len(surfaces)
    if not count:
        validate.refuse("surfaces", 0, "at least one surface")
    angles = isinstance(views, Sequence) and len(views) == 2 and not isinstance(views[0], str | Sequence)
    given: dict[str, Any] = {
        "views": [views] * count if angles or isinstance(views, str) else views,
        "titles": titles or [""] * count,
        "scalars": [None] * count if scalars is None else scalars,
        "numbers": [None] * count if numbers is None else numbers,
        "patches": patches,
    }
    if patches is None or all(isinstance(entry, str) for entry in patches):
        given["patches"] = [patches] * count
    for name, entries in given.items():
        if len(entries) != count:
            validate.refuse(name, len(entries), f"{count}, one per surface")
    drawings = []
    for surface, view, title, *arrays, names in zip(surfaces, *given.values(), strict=True):
        shapes = {"scalars": [(surface.n,), (surface.m,)], "numbers": [(surface.n,)]}
        values = [None if array is None else np.asarray(array, dtype=float) for array in arrays]
        for (name, allowed), array in zip(shapes.items(), values, strict=True):
            if array is not None and array.shape not in allowed:
                validate.refuse(name, array.shape, f"shape {' or '.join(map(str, allowed))}")
        drawings.append(Rendering(surface, view_of(surface, view), title, values[0], values[1], names))
    columns = min(columns or (3 if len(drawings) not in (1, 2, 4) else 2), len(drawings))
    return compose(drawings, path, columns, width, **options)


def compose(
    drawings: Sequence[Rendering],
    path: PathLike | None,
    columns: int,
    width: int,
    *,
    label: str = "",
    limits: tuple[float, float] | None = None,
    cmap: str | None = None,
    supports: bool = True,
    edges: bool | None = None,
    form: str = ".3f",
    legend: bool = False,
    one_scale: bool = True,
    renderer: str = "auto",
    around: Sequence[Floats] = (),
    foot: str = "",
    mark: str = "",
    overlay: Callable[[Any], None] | None = None,
) -> Image:
    """The picture of all drawings; the options are those of ``draw`` and ``panel``.

    Points ``around`` (k,2) and a text at the ``foot`` have a place; ``overlay`` draws on the last axes.
    """
    points = [np.concatenate([drawing.points(one_scale), *around]) for drawing in drawings]
    frames = frames_of(points, columns, width, one_scale)
    edge = [mean_edge(d.surface) * f.scale for d, f in zip(drawings, frames, strict=True)]
    dotted = [supports and length >= DOTS_FROM for length in edge]
    colors = color_scale([drawing.values for drawing in drawings], limits, cmap)
    heights = [frame.size[1] for frame in frames[::columns]]
    figure = new(width, sum(heights) + 100.0, pad=0.0)
    if mark or colors is not None or any(drawing.title for drawing in drawings):
        figure.get_layout_engine().set(h_pad=ABOVE / DPI)
    axes = grid(figure, len(frames), columns, height_ratios=heights)
    for place, drawing, frame in zip(axes, drawings, frames, strict=True):
        place.set_axis_off()
        title = place.set_title(drawing.title, fontsize=TEXT, color=INK, pad=5.0)
        title.set_parse_math(False)
        title.set_fontsize(TEXT * min(1.0, WIDEST * frame.size[0] / (title.get_window_extent().width + 1.0)))
    if colors is not None:
        colors.bar(figure, axes, label)
    images = []
    for k, drawing in enumerate(drawings):
        fill = None if colors is None or drawing.values is None else colors.rgb(drawing.values)
        look = {"supports": dotted[k], "edges": edge[k] >= EDGES_FROM if edges is None else edges}
        images.append(paint(scene(drawing, fill, **look), frames[k], renderer))
    if legend:
        add_picture_legend(figure, list(zip(drawings, dotted, images, strict=True)))
    if mark:
        figure.suptitle(mark, x=0.01, ha="left", color=RED, weight="bold", fontsize=TEXT)
    if foot:
        figure.supxlabel(foot, fontsize=2.0 * SMALL)
    first = zip(axes[::columns], frames[::columns], strict=True)
    fit_height(figure, {one: frame.size[1] / frame.size[0] for one, frame in first})
    for drawing, frame, image, place in zip(drawings, frames, images, axes, strict=True):
        frame.show(place, image)
        if drawing.numbers is not None:
            _print_numbers(place, drawing.surface, drawing.view, drawing.numbers, form)
    if overlay is not None:
        overlay(axes[-1])
    return finish(figure, path)


def families(schedule: Panels, path: PathLike | None = None, **options: Any) -> Image:
    """The panels of a roof that ``pcmc.panels`` returns, each in the colour of its family.

    ``options`` are as in ``draw``, such as ``view`` and ``width``.

    >>> from pcmc import Patch, Surface, panels
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> families(panels(roof, tolerance=0.01), width=200).shape[1]
    200
    """
    label = f"family of {schedule.count}, the largest first; within {schedule.tolerance:g}"
    look: dict[str, Any] = {"label": label, "cmap": "turbo", "edges": True, "supports": False} | options
    if schedule.count > 1:
        look.setdefault("limits", (1.0, float(schedule.count)))
    names = sorted(set(schedule.panels["patch"]))
    return draw(schedule.surface, path, scalars=schedule.family_of_face, patches=names, **look)


def panel_planarity(net: PanelNet, path: PathLike | None = None, **options: Any) -> Image:
    """The panels of a net that ``pcmc.panel_net`` returns, coloured by how far they are from planar.

    ``options`` are as in ``draw``, such as ``view`` and ``width``.

    >>> from generators import delaunay
    >>> from pcmc import panel_net
    >>> panel_planarity(panel_net(delaunay(exact=True), 0.5, anyway=True), width=200).shape[1]
    200
    """
    mesh, percent = net.mesh, 100.0 * net.panels["planarity"].to_numpy()
    look: dict[str, Any] = {"label": "distance of the diagonals over their length, %", "supports": False}
    look |= {"edges": False, "limits": (0.0, max(FLAT_PERCENT, float(percent.max()))), "cmap": "YlGnBu"}
    return draw(mesh, path, scalars=percent[mesh.patch_of_face], **look | options)


def vectors(
    surface: Surface,
    field: npt.ArrayLike,
    path: PathLike | None = None,
    *,
    length: float = 0.12,
    most: int = 400,
    view: ViewName = "diagonal",
    label: str = "",
    points: npt.ArrayLike | None = None,
    points_label: str = "",
    title: str = "",
    width: int = 900,
    **options: Any,
) -> Image:
    """Vectors at the vertices (a mode, the reactions, the forces) as arrows on the surface.

    Parameters
    ----------
    field : (n,3).
    length : of the longest arrow, as a part of the surface's size.
    most : number of arrows; if there were more, the longest of each neighbourhood is drawn.
    label : the unit, beside an arrow of round length that shows the scale.
    points, points_label : (n,3) vectors of another unit, such as forces at points beside forces per length,
        drawn in blue with a scale of their own; all of them are drawn.
    view, title, width, options : as in ``draw``; options are supports, edges, renderer.
    """
    seen, fields = view_of(surface, view), []
    given = (("field", field, label, ARROW), ("points", points, points_label, AT_POINTS))
    for what, values, unit, color in given:
        arrows = np.zeros((surface.n, 3)) if values is None else np.asarray(values, dtype=float)
        if arrows.shape != (surface.n, 3) or not np.isfinite(arrows).all():
            validate.refuse(what, arrows.shape, f"finite numbers of shape ({surface.n}, 3)")
        if longest := float(np.linalg.norm(arrows, axis=1).max()):
            fields.append((arrows, length * surface.size / longest, longest, unit, color))
    at = seen.project(surface.vertices)
    tips = [at + stretch * seen.project(arrows) for arrows, stretch, *_ in fields]

    def add_arrows(axes: Any) -> None:
        for k, ((arrows, stretch, longest, unit, color), tip) in enumerate(zip(fields, tips, strict=True)):
            chosen = _thinned(at, np.linalg.norm(arrows, axis=1), most if color == ARROW else surface.n)
            in_plane = {"angles": "xy", "scale_units": "xy", "scale": 1.0}
            heads = {"headwidth": 4.0, "headlength": 5.0, "headaxislength": 4.5}
            arrow = [*at[chosen].T, *(tip - at)[chosen].T]
            quiver = axes.quiver(*arrow, color=color, width=2.2 / width, **in_plane, **heads)
            if unit:  # an arrow at the foot tells the scale
                rounded, middle = float(f"{longest:.1g}"), 0.5 * axes.get_position().y0
                look = {"labelpos": "E", "fontproperties": {"size": SMALL}, "labelcolor": INK}
                place, text = (2 * k + 1) / (2 * len(fields)), f"{rounded:g} {unit}"
                axes.quiverkey(quiver, place, middle, rounded * stretch, text, coordinates="figure", **look)

    drawing, foot = Rendering(surface, seen, title, None, None, None), " " if label or points_label else ""
    return compose([drawing], path, 1, width, around=tips, foot=foot, overlay=add_arrows, **options)


def reactions(
    surface: Surface, path: PathLike | None = None, *, units: Units = NO_UNITS, **options: Any
) -> Image:
    """Arrows of the reactions: along lines force per length, in blue the forces at single points.

    Forces of cables that end on a line are forces at points; see ``pcmc.certificate.forces``.
    ``options`` are those of ``vectors``: view, length, most, title, supports, edges, width, renderer.

    Raises
    ------
    OptionError : when nothing holds the surface, so that there are no reactions.
    """
    acting = Forces.of(surface)
    lines, held = acting.per_length, acting.points.any(axis=1)
    if np.isnan(lines).all() and not held.any():
        raise OptionError("nothing holds the surface: no reactions to draw", what="surface")
    options = {"points_label": f"{units.force or 'force'} at points", **options}
    options = {"label": f"{units.tension} along lines", **options}
    return vectors(surface, np.nan_to_num(lines), path, points=acting.points, **options)


def _print_numbers(axes: Any, surface: Surface, view: Camera, numbers: Floats, form: str) -> None:
    """Numbers at the vertices whose sheet turns its upper side, along the normal of Π, to the viewer."""
    from matplotlib.patheffects import withStroke

    area = area_vectors(surface.vertices[surface.faces])
    area *= np.where(area @ np.array(surface.plane.normal) < 0.0, -1.0, 1.0)[:, None]
    facing = np.bincount(surface.faces.ravel(), np.repeat(area @ view.axes[2], 3), surface.n) > 0.0
    shown = np.flatnonzero(np.isfinite(numbers) & facing)
    for (x, y), number in zip(view.project(surface.vertices[shown]), numbers[shown], strict=True):
        text = axes.text(x, y, format(number, form), fontsize=SMALL, color=INK, ha="center", va="center")
        text.set_path_effects([withStroke(linewidth=1.4, foreground="white")])


def cell_html(value: Any) -> str:
    """A picture of a surface, or of the one in a result, above its ``repr``; without ``plot`` the text alone.

    >>> from pcmc import Patch
    >>> one = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("a<b", 1.0)], fixed=[0])
    >>> "a&lt;b" in cell_html(one), cell_html(one).count("<img")
    (True, 1)
    """
    text = f"<pre>{html.escape(repr(value))}</pre>"
    try:
        image = draw(value if isinstance(value, Surface) else value.surface, width=CELL_WIDTH, legend=True)
    except MissingExtra:
        return text
    return f'<img alt="surface" src="data:image/png;base64,{b64encode(png(image)).decode()}">{text}'


def _thinned(at: Floats, size: Floats, most: int) -> npt.NDArray[np.intp]:
    """Indices of the longest arrow in each square of a grid of about ``most`` squares."""
    keep = np.flatnonzero(size > 1e-6 * size.max())
    if len(keep) <= most:
        return keep
    span = np.ptp(at[keep], axis=0)
    cell = np.sqrt(max(span[0] * span[1], 1e-12 * span.max() ** 2) / most)
    square = np.floor((at[keep] - at[keep].min(axis=0)) / cell).astype(np.int64)
    order = np.argsort(-size[keep], kind="stable")
    return keep[order[np.unique(square[order], axis=0, return_index=True)[1]]]
