"""The common style of all figures, their layout and files (PNG, SVG or PDF)."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..base.files import PathLike, atomic_write, suffix_of, writing
from ..base.libraries import require
from .scene import Image

DPI = 200.0
TEXT, SMALL = 7.0, 6.0  # points
INK = "#202020"
EFFORT = 6  # of compression; 9 takes six times as long for 2 % fewer bytes
SUFFIXES = (".png", ".svg", ".pdf")
# Okabe and Ito's scheme, in an order whose first few differ most.
CURVES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")


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
    and solid, then thinner and thinner, dashed in each other's gaps."""
    if k == 0:
        return {"linewidth": 2.6, "linestyle": "-"}
    width = 1.6 - 0.6 * (k - 1) / max(1, count - 2)
    return {"linewidth": width, "linestyle": (3.0 * (k % 2), (3.0, 3.0))}


def finish(figure: Any, path: PathLike | None) -> Image:
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
