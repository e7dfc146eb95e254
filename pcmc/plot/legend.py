"""The legend below a picture: what its colours and dots mean."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.arrays import Bools, Floats
from ..surface import Surface
from ..surface.colours import patch_colors, rgb
from .figure import INK, SMALL
from .raster import Painted
from .scene import FIXED_DOT, NO_VALUE, SLIDING_DOT, Scene

IN_A_LINE = 6
LEAST_PATCH, LEAST_DOT = 9.0, 4.0  # pixels from which a patch, a dot counts as seen


@dataclass(frozen=True, eq=False)
class Shown:
    """A surface in a picture: the patches drawn, the values that colour it, and what is seen of it."""

    surface: Surface
    patches: Sequence[str] | None
    values: Floats | None
    scene: Scene
    painted: Painted


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
        surface, values = picture.surface, picture.values
        shown = shown_vertices(surface, picture.patches)
        if values is None:
            for patch in np.flatnonzero(_pixels_of_patches(picture) >= LEAST_PATCH):
                colors.setdefault(surface.patches[patch].name, tuple(patch_colors(surface)[patch]))
        elif np.isnan(values[shown] if len(values) == surface.n else values).any():
            colors["no value"] = NO_VALUE
        seen = picture.scene.dot_colors[picture.painted.dots >= LEAST_DOT]
        for name, dot in (("fixed", FIXED_DOT), ("sliding", SLIDING_DOT)):
            if (seen == rgb(dot)).all(axis=1).any():
                dots[name] = dot
    return colors, dots


def _pixels_of_patches(picture: Shown) -> Floats:
    """(k,) pixels on which each patch is seen."""
    surface, names = picture.surface, picture.patches
    patch = surface.patch_of_face
    if names is not None:
        patch = patch[surface.patch_faces([surface.patch_index(name) for name in names])]
    pixels = np.bincount(patch, picture.painted.triangles, len(surface.patches))
    return np.asarray(pixels, dtype=float)


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
