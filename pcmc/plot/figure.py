"""The common style of all figures, their layout, and their PNG files."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.errors import FileError, MissingExtra
from ..base.files import atomic_write

DPI = 200.0
TEXT, SMALL = 7.0, 6.0  # points
INK = "#202020"
LARGE = 149_000  # bytes
EFFORT = 6  # of compression; 9 takes six times as long for 2 % fewer bytes
# Okabe and Ito's scheme, in an order whose first few differ most.
CURVES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")

Image = npt.NDArray[np.uint8]


def new(width: float, height: float, pad: float = 4.0) -> Any:
    """A figure of the given size in pixels, drawn by Agg; no global state.

    Matplotlib's constrained layout places its parts, ``pad`` pixels apart.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
        from matplotlib.layout_engine import ConstrainedLayoutEngine
    except ImportError:
        raise MissingExtra("matplotlib", "plot") from None
    gap = pad / DPI
    layout = ConstrainedLayoutEngine(w_pad=gap, h_pad=gap, wspace=0.0, hspace=0.0)
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="white", layout=layout)
    FigureCanvasAgg(figure)
    return figure


def grid(figure: Any, count: int, columns: int, **options: Any) -> tuple[list[Any], int]:
    """``count`` axes in rows of ``columns``, and the number of rows."""
    rows = -(-count // columns)
    axes = figure.subplots(rows, columns, squeeze=False, **options).ravel().tolist()
    for unused in axes[count:]:
        unused.remove()
    return axes[:count], rows


def fit_height(figure: Any, ratios: Mapping[Any, float]) -> None:
    """Choose the figure's height so that each row of axes has its ratio of height to width.

    Parameters
    ----------
    ratios : height / width by axes, one of each row. Titles, labels, scales and legends take the
        space that the layout finds for them. The layout is then final: nothing moves any more.
    """
    for _ in range(4):
        figure.draw_without_rendering()
        boxes = {axes: axes.get_window_extent() for axes in ratios}
        missing = sum(ratio * boxes[axes].width - boxes[axes].height for axes, ratio in ratios.items())
        if abs(missing) < 0.5:  # pixels
            break
        figure.set_figheight(round(figure.get_figheight() * DPI + missing) / DPI)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")


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
    """Line style of curve ``k`` of ``count`` by which curves that lie on each other all stay visible.

    The first is wide and solid, the others are thinner and thinner, dashed in each other's gaps.
    """
    if k == 0:
        return {"linewidth": 2.6, "linestyle": "-"}
    width = 1.6 - 0.6 * (k - 1) / max(1, count - 2)
    return {"linewidth": width, "linestyle": (3.0 * (k % 2), (3.0, 3.0))}


def finish(figure: Any, path: str | os.PathLike[str] | None) -> Image:
    """The figure as an (h,w,3) image, written as a PNG if there is a path.

    The file has no date and no program's name: the same figure gives the same bytes.
    Above 149 kB it has 256 colours only.
    """
    from PIL import Image as Pillow

    figure.canvas.draw()
    image = np.ascontiguousarray(np.asarray(figure.canvas.buffer_rgba())[..., :3])
    if path is None:
        return image
    if os.path.splitext(path)[1].lower() != ".png":
        text = f"{os.fspath(path)}: pictures are PNG files; end the name with .png"
        raise FileError(text, what=os.fspath(path), expected=".png")
    picture = Pillow.fromarray(image)
    stream = io.BytesIO()
    picture.save(stream, format="PNG", compress_level=EFFORT)
    if stream.tell() > LARGE:
        stream = io.BytesIO()
        # the palette covers all colours, also those of a few pixels, such as a legend's
        small = picture.quantize(256, method=Pillow.Quantize.MAXCOVERAGE, kmeans=1)
        small.save(stream, format="PNG", optimize=True)
    try:
        with atomic_write(path) as temporary:
            temporary.write_bytes(stream.getvalue())
    except OSError as error:
        text = f"{os.fspath(path)}: cannot be written ({error.strerror or error})"
        raise FileError(text, what=os.fspath(path)) from None
    return image
