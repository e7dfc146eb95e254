"""Vectors at the vertices as arrows on a surface: modes, forces, reactions of the supports."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import OptionError
from ..base.units import NO_UNITS, Units
from ..certificate.reactions import support_forces
from ..surface import Surface
from .figure import INK, SMALL, Image, Path
from .pictures import ViewName, compose
from .scene import Drawing, view_of

ARROW, AT_POINTS = "#B2182B", "#2166AC"


def vectors(
    surface: Surface,
    field: npt.ArrayLike,
    path: Path | None = None,
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
    for what, values, unit, color in (
        ("field", field, label, ARROW),
        ("points", points, points_label, AT_POINTS),
    ):
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

    drawing, foot = Drawing(surface, seen, title, None, None, None), " " if label or points_label else ""
    return compose([drawing], path, 1, width, around=tips, foot=foot, overlay=add_arrows, **options)


def reactions(
    surface: Surface, path: Path | None = None, *, units: Units = NO_UNITS, **options: Any
) -> Image:
    """Arrows of the reactions: along lines force per length, in blue the forces at single points.

    Forces of cables that end on a line are forces at points; see ``pcmc.certificate.reactions``.
    ``options`` are those of ``vectors``: view, length, most, title, supports, edges, width, renderer.

    Raises
    ------
    OptionError : when nothing holds the surface, so that there are no reactions.
    """
    acting = support_forces(surface)
    lines, held = acting.per_length, acting.points.any(axis=1)
    if np.isnan(lines).all() and not held.any():
        raise OptionError("nothing holds the surface: no reactions to draw", what="surface")
    labels = {"label": f"{units.tension} along lines", "points_label": f"{units.force or 'force'} at points"}
    return vectors(surface, np.nan_to_num(lines), path, points=acting.points, **labels | options)


def _thinned(at: Floats, size: Floats, most: int) -> npt.NDArray[np.intp]:
    """Indices of the longest arrow in each square of a grid of about ``most`` squares."""
    keep = np.flatnonzero(size > 1e-6 * size.max())
    if len(keep) <= most:
        return keep
    span = np.ptp(at[keep], axis=0)
    cell = np.sqrt(max(span[0] * span[1], 1e-12 * span.max() ** 2) / most)
    square = np.floor((at[keep] - at[keep].min(axis=0)) / cell).astype(np.int64)
    order = np.lexsort((-size[keep], square[:, 1], square[:, 0]))
    first = np.ones(len(order), dtype=bool)
    first[1:] = (np.diff(square[order], axis=0) != 0).any(axis=1)
    return keep[order[first]]
