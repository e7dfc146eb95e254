"""What colours mean in a picture: the scale of values, and the legend of patches and supports."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..base import validate
from ..base.arrays import Floats
from ..base.libraries import require
from ..surface.colours import patch_colors, rgb
from .figure import INK, SMALL
from .scene import FIXED_DOT, NO_VALUE, SLIDING_DOT, Image, Rendering

IN_A_LINE = 6
ALIKE = 0.03  # difference of two colours' directions up to which one may be the other in a shade
SHADES = (0.5, 1.06)  # brightness of a sheet, lit or not, of its colour's

Picture = tuple[Rendering, bool, Image]  # with whether its supports are dots, and (h,w,3) as painted


class ColorScale(NamedTuple):
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
