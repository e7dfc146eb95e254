"""Numbers as colours, and the scale that explains them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import MissingExtra
from .figure import INK, SMALL


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
        """Draw the scale below the axes."""
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
    """The matplotlib colour map of this name."""
    try:
        from matplotlib import colormaps
    except ImportError:
        raise MissingExtra("matplotlib", "plot") from None
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
