"""The legend below a picture: what its colours and dots mean."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..base.arrays import Floats
from ..surface.colours import patch_colors, rgb
from .figure import INK, SMALL, Image
from .scene import FIXED_DOT, NO_VALUE, SLIDING_DOT, Drawing

IN_A_LINE = 6
ALIKE = 0.03  # difference of two colours' directions up to which one may be the other in a shade
SHADES = (0.5, 1.06)  # brightness of a sheet, lit or not, of its colour's

Picture = tuple[Drawing, bool, Image]  # with whether its supports are dots, and (h,w,3) as painted


def entries(pictures: Iterable[Picture]) -> tuple[dict[str, Any], dict[str, Any]]:
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
        for name, held, dot in (
            ("fixed", surface.pinned, FIXED_DOT),
            ("sliding", surface.held & ~surface.pinned, SLIDING_DOT),
        ):
            if dotted and held[shown].any() and _visible(image, rgb(dot)):
                dots[name] = dot
    return colors, dots


def _visible(image: Image, color: Floats) -> bool:
    """Whether a square of four pixels has the colour, in any shade: thinner lines are mixed colours."""
    image = image[::2, ::2].astype(np.float32)
    size = np.linalg.norm(image, axis=2)
    reference = float(np.linalg.norm(color))
    direction = image / np.maximum(size, 1.0)[..., None]
    alike = np.linalg.norm(direction - color / reference, axis=2) < ALIKE
    alike &= (size > SHADES[0] * 255.0 * reference) & (size < SHADES[1] * 255.0 * reference)
    return bool((alike[1:, 1:] & alike[1:, :-1] & alike[:-1, 1:] & alike[:-1, :-1]).any())


def add_legend(figure: Any, pictures: Iterable[Picture]) -> None:
    """The legend at the foot of the figure."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch as Swatch

    colors, dots = entries(pictures)
    area: dict[str, Any] = {"edgecolor": INK, "linewidth": 0.4}
    dot: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 2.6}
    handles: list[Any] = [Swatch(facecolor=color, label=name, **area) for name, color in colors.items()]
    handles += [Line2D([], [], color=color, label=name, **dot) for name, color in dots.items()]
    if handles:
        space = {"handlelength": 1.2, "handleheight": 1.0, "borderaxespad": 0.3, "borderpad": 0.9}
        text = {"fontsize": SMALL, "labelcolor": INK, "ncols": min(len(handles), IN_A_LINE)}
        figure.legend(handles=handles, loc="outside lower center", frameon=False, **text, **space)
