"""The legend below a picture: what its colours and dots mean."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..base.arrays import Bools, Floats
from ..surface import Surface
from ..surface.colours import patch_colors
from .figure import INK, SMALL
from .scene import FIXED_DOT, NO_VALUE, SLIDING_DOT

IN_A_LINE = 6
Shown = tuple[Surface, Sequence[str] | None, Floats | None, bool]
"""A surface, the patches of it that are drawn, the values that colour it, whether supports are dots."""


def shown_vertices(surface: Surface, patches: Sequence[str] | None) -> Bools:
    """(n,) vertices of the patches drawn; None: all."""
    shown = np.full(surface.n, patches is None)
    faces = surface.patch_faces([surface.patch_index(name) for name in patches or ()])
    shown[surface.faces[faces]] = True
    return shown


def entries(pictures: Iterable[Shown]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Colours of areas by name, and of dots by name, in all the pictures together."""
    colors: dict[str, Any] = {}
    dots: dict[str, Any] = {}
    for surface, patches, values, supports in pictures:
        shown = shown_vertices(surface, patches)
        if values is None:
            for patch, color in zip(surface.patches, patch_colors(surface), strict=True):
                if patches is None or patch.name in patches:
                    colors.setdefault(patch.name, tuple(color))
        elif np.isnan(values[shown] if len(values) == surface.n else values).any():
            colors["no value"] = NO_VALUE
        if supports and surface.fixed[shown].any():
            dots["fixed"] = FIXED_DOT
        if supports and surface.on_plane[shown].any():
            dots["sliding"] = SLIDING_DOT
    return colors, dots


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
