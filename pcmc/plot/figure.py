"""The common style of all figures, their layout and files (PNG, SVG or PDF), and what the colours mean."""

from __future__ import annotations

import io
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import Floats
from ..base.files import atomic_write, suffix_of, writing
from ..base.libraries import require
from ..surface.colours import patch_colors, rgb
from .scene import FIXED_DOT, NO_VALUE, SLIDING_DOT, Frame, Image, Rendering

DPI = 200.0
TEXT, SMALL = 7.0, 6.0  # points
INK = "#202020"
MARGIN = 10.0  # pixels around each picture, for lines and dots that stick out
TALLEST = 1.1  # height of a picture at most, as a part of its width
EFFORT = 6  # of compression; 9 takes six times as long for 2 % fewer bytes
SUFFIXES = (".png", ".svg", ".pdf")
# Okabe and Ito's scheme, in an order whose first few differ most.
CURVES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")

Path = str | os.PathLike[str]


def new(width: float, height: float, pad: float = 4.0) -> Any:
    """A figure of a size in pixels, drawn by Agg, its parts ``pad`` pixels apart; no global state."""
    require("matplotlib", extra="plot")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    layout = ConstrainedLayoutEngine(w_pad=pad / DPI, h_pad=pad / DPI, wspace=0.0, hspace=0.0)
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="white", layout=layout)
    FigureCanvasAgg(figure)
    return figure


def grid(figure: Any, count: int, columns: int, **options: Any) -> list[Any]:
    """``count`` axes in rows of ``columns``."""
    axes = figure.subplots(-(-count // columns), columns, squeeze=False, **options).ravel().tolist()
    for unused in axes[count:]:
        unused.remove()
    return list(axes[:count])


def fit_height(figure: Any, ratios: Mapping[Any, float]) -> None:
    """Choose the figure's height so that each row of axes has its ratio of height to width; end the layout.

    ``ratios`` are height / width by axes, one of each row; titles, scales and legends keep their space.
    """
    _as_written(figure)
    layout = figure.get_layout_engine()
    for _ in range(5):
        layout.execute(figure)
        boxes = {axes: axes.get_window_extent() for axes in ratios}
        missing = sum(ratio * boxes[axes].width - boxes[axes].height for axes, ratio in ratios.items())
        if abs(missing) < 0.5:  # pixels
            break
        figure.set_figheight(round(figure.get_figheight() * DPI + missing) / DPI)
    figure.set_layout_engine("none")


def _as_written(figure: Any) -> None:
    """Draw names as they are, and no mathematics between two signs $; powers of ten at axes come later."""
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        if "$" in text.get_text() and "mathdefault" not in text.get_text():
            text.set_parse_math(False)


def frames_of(points: Sequence[Floats], columns: int, width: int, one_scale: bool = True) -> list[Frame]:
    """Frames around the given points (k,2), row by row; those of a row are of one height."""
    spans, wide = np.array([np.ptp(p, axis=0) for p in points]), width // columns
    room = np.array([wide, TALLEST * wide]) - 2 * MARGIN
    scales = (room / np.maximum(spans, 1e-9 * spans.max())).min(axis=1)
    if one_scale:
        scales[:] = scales.min()
    frames = []
    for k, (corners, span, scale) in enumerate(zip(points, spans, scales.tolist(), strict=True)):
        row = slice(k - k % columns, k - k % columns + columns)
        high = math.ceil((spans[row, 1] * scales[row]).max() + 2 * MARGIN)
        low = corners.min(axis=0) - np.array([(wide / scale - span[0]) / 2.0, MARGIN / scale])
        frames.append(Frame((wide, high), low, scale))
    return frames


def style(axes: Any) -> Any:
    """Thin frame on two sides, small ticks, light grid."""
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set(linewidth=0.6, color=INK)
    axes.tick_params(labelsize=SMALL, width=0.6, length=2.5, colors=INK, which="major")
    axes.tick_params(labelsize=SMALL, width=0.4, length=1.5, which="minor", colors=INK)
    axes.grid(True, linewidth=0.3, color="#D0D0D0")
    axes.set_axisbelow(True)
    return axes


def overlap_style(k: int, count: int) -> dict[str, Any]:
    """Line style of curve ``k`` of ``count`` by which curves that lie on each other all stay visible: wide
    and solid, then thinner and thinner, dashed in each other's gaps.
    """
    if k == 0:
        return {"linewidth": 2.6, "linestyle": "-"}
    width = 1.6 - 0.6 * (k - 1) / max(1, count - 2)
    return {"linewidth": width, "linestyle": (3.0 * (k % 2), (3.0, 3.0))}


def finish(figure: Any, path: Path | None) -> Image:
    """The figure as an (h,w,3) image, written as a PNG, SVG or PDF if there is a path.

    No date and no program's name: the same figure gives the same bytes. In SVG and PDF, text is lines.
    """
    _as_written(figure)
    figure.canvas.draw()
    image = np.ascontiguousarray(np.asarray(figure.canvas.buffer_rgba())[..., :3])
    if path is None:
        return image
    kind = suffix_of(path, SUFFIXES, "a picture")
    nobody = dict.fromkeys(("Date",) if kind == ".svg" else ("CreationDate", "Creator", "Producer"))
    with writing(path), atomic_write(path) as temporary:
        if kind == ".png":
            temporary.write_bytes(png(image))
            return image
        from matplotlib import rc_context

        with rc_context({"svg.hashsalt": "pcmc", "pdf.fonttype": 42}):
            figure.savefig(temporary, format=kind[1:], metadata=nobody, dpi=DPI)
    return image


def png(image: Image) -> bytes:
    from PIL import Image as Pillow

    stream = io.BytesIO()
    Pillow.fromarray(image).save(stream, format="PNG", compress_level=EFFORT)
    return stream.getvalue()


IN_A_LINE = 6
ALIKE = 0.03  # difference of two colours' directions up to which one may be the other in a shade
SHADES = (0.5, 1.06)  # brightness of a sheet, lit or not, of its colour's

Picture = tuple[Rendering, bool, Image]  # with whether its supports are dots, and (h,w,3) as painted


@dataclass(frozen=True)
class ColorScale:
    """A colour map between two values."""

    low: float
    high: float
    cmap: Any

    def rgb(self, values: Floats) -> Floats:
        """(k,3) colours, NaN where the value is."""
        span = self.high - self.low
        colors = self.cmap((values - self.low) / span if span > 0.0 else 0.5 + 0.0 * values)[:, :3]
        colors[np.isnan(values)] = np.nan
        return colors

    def bar(self, figure: Any, axes: Sequence[Any], label: str) -> None:
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        bar = color_bar(figure, ScalarMappable(Normalize(self.low, self.high), self.cmap), axes, label)
        bar.ax.locator_params(nbins=5)
        bar.formatter.set_powerlimits((-3, 4))


def color_bar(figure: Any, mappable: Any, axes: Sequence[Any], label: str) -> Any:
    """A horizontal scale below the axes, half as wide as they are together."""
    bar = figure.colorbar(mappable, ax=axes, location="bottom", shrink=0.5, aspect=34)
    bar.outline.set(linewidth=0.5)
    bar.ax.tick_params(labelsize=SMALL, width=0.5, length=2.0, pad=1.5, colors=INK)
    bar.ax.xaxis.get_offset_text().set(size=SMALL)
    bar.set_label(label, size=SMALL, color=INK, labelpad=2.0)
    return bar


def color_map(name: str) -> Any:
    require("matplotlib", extra="plot")
    from matplotlib import colormaps

    return colormaps[validate.choice("cmap", name, sorted(colormaps))]


def color_scale(
    values: Sequence[Floats | None], limits: tuple[float, float] | None, cmap: str | None
) -> ColorScale | None:
    """The scale for all the values together, or None when there are none."""
    given = [v[np.isfinite(v)] for v in values if v is not None]
    if not given:
        return None
    known = np.concatenate(given)
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    signed = low < 0.0 < high
    if limits is not None:
        low, high = (float(v) for v in limits)
        if not (np.isfinite([low, high]).all() and low < high):
            validate.refuse("limits", limits, "two finite numbers, low < high")
    elif signed:
        low, high = -max(-low, high), max(-low, high)
    return ColorScale(low, high, color_map(cmap or ("RdBu_r" if signed else "viridis")))


def legend_entries(pictures: Iterable[Picture]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Colours of areas by name, and of dots by name, that can be seen in all the pictures together."""
    colors: dict[str, Any] = {}
    dots: dict[str, Any] = {}
    for drawing, dotted, image in pictures:
        surface, values, names, shown = drawing.surface, drawing.values, drawing.patches, drawing.shown
        if values is None:
            for patch, color in zip(surface.patches, patch_colors(surface), strict=True):
                if (names is None or patch.name in names) and _visible(image, color):
                    colors.setdefault(patch.name, tuple(color))
        elif np.isnan(values[shown] if len(values) == surface.n else values).any():
            colors["no value"] = NO_VALUE
        sliding = surface.held & ~surface.pinned
        for name, held, dot in (("fixed", surface.pinned, FIXED_DOT), ("sliding", sliding, SLIDING_DOT)):
            if dotted and held[shown].any() and _visible(image, rgb(dot), step=1):
                dots[name] = dot
    return colors, dots


def _visible(image: Image, color: Floats, step: int = 2) -> bool:
    """Whether a square of 2 ``step`` pixels has the colour, in any shade: thinner lines are mixed colours."""
    pixels = image[::step, ::step].astype(np.float32)
    size, reference = np.linalg.norm(pixels, axis=2), float(np.linalg.norm(color))
    direction = pixels / np.maximum(size, 1.0)[..., None]
    alike = np.linalg.norm(direction - color / reference, axis=2) < ALIKE
    alike &= (size > SHADES[0] * 255.0 * reference) & (size < SHADES[1] * 255.0 * reference)
    return bool((alike[1:, 1:] & alike[1:, :-1] & alike[:-1, 1:] & alike[:-1, :-1]).any())


def add_picture_legend(figure: Any, pictures: Iterable[Picture]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch as Swatch

    colors, dots = legend_entries(pictures)
    area: dict[str, Any] = {"edgecolor": INK, "linewidth": 0.4}
    dot: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 2.6}
    handles: list[Any] = [Swatch(facecolor=color, label=name, **area) for name, color in colors.items()]
    handles += [Line2D([], [], color=color, label=name, **dot) for name, color in dots.items()]
    if handles:
        space = {"handlelength": 1.2, "handleheight": 1.0, "borderaxespad": 0.3, "borderpad": 0.9}
        text = {"fontsize": SMALL, "labelcolor": INK, "ncols": min(len(handles), IN_A_LINE)}
        figure.legend(handles=handles, loc="outside lower center", frameon=False, **text, **space)
