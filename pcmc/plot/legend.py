"""The legend below a picture: what its colours and dots mean."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.arrays import Bools, Floats
from ..surface import Surface
from ..surface.colours import patch_colors, rgb
from .figure import INK, SMALL, Image
from .scene import FIXED_DOT, NO_VALUE, SLIDING_DOT

IN_A_LINE = 6
ALIKE = 0.03  # difference of two colours' directions up to which one may be the other in a shade
SHADES = (0.5, 1.06)  # brightness of a sheet, lit or not, of its colour's


@dataclass(frozen=True, eq=False)
class Shown:
    """A surface in a picture: the patches drawn, the values that colour it, whether supports are dots."""

    surface: Surface
    patches: Sequence[str] | None
    values: Floats | None
    dots: bool
    image: Image  # (h,w,3), as painted


def shown_vertices(surface: Surface, patches: Sequence[str] | None) -> Bools:
    """(n,) vertices of the patches drawn; None: all."""
    shown = np.full(surface.n, patches is None)
    faces = surface.patch_faces([surface.patch_index(name) for name in patches or ()])
    shown[surface.faces[faces]] = True
    return shown


def entries(pictures: Iterable[Shown]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Colours of areas by name, and of dots by name, that can be seen in all the pictures together."""
    colors: dict[str, Any] = {}
    dots: dict[str, Any] = {}
    for picture in pictures:
        surface, values, names = picture.surface, picture.values, picture.patches
        shown = shown_vertices(surface, names)
        if values is None:
            for patch, color in zip(surface.patches, patch_colors(surface), strict=True):
                if (names is None or patch.name in names) and _visible(picture.image, color):
                    colors.setdefault(patch.name, tuple(color))
        elif np.isnan(values[shown] if len(values) == surface.n else values).any():
            colors["no value"] = NO_VALUE
        for name, held, dot in (
            ("fixed", surface.pinned, FIXED_DOT),
            ("sliding", surface.held & ~surface.pinned, SLIDING_DOT),
        ):
            if picture.dots and held[shown].any() and _visible(picture.image, rgb(dot)):
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


def add_legend(figure: Any, pictures: Iterable[Shown]) -> None:
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
