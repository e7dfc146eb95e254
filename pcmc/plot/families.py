"""Pictures of panels, coloured by family."""

from __future__ import annotations

from typing import Any

from ..panels import Panels
from .figure import Image
from .pictures import Path, draw


def families(schedule: Panels, path: Path | None = None, **options: Any) -> Image:
    """The panels of a roof, each in the colour of its family.

    Parameters
    ----------
    schedule : what ``pcmc.panels`` returns.
    path : PNG file to write, or None.
    options : as in ``draw``, such as ``view`` and ``width``.

    Returns
    -------
    (h,w,3) uint8 array, the picture.

    >>> from pcmc import Patch, Surface, panels
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> families(panels(roof, tolerance=0.01), width=200).shape[1]
    200
    """
    label = f"family of {schedule.count}, the largest first; within {schedule.tolerance:g}"
    look: dict[str, Any] = {"label": label, "cmap": "turbo", "edges": True, "supports": False} | options
    if schedule.count > 1:
        look.setdefault("limits", (1.0, float(schedule.count)))
    names = sorted(set(schedule.panels["patch"]))
    return draw(schedule.surface, path, scalars=schedule.family_of_face, patches=names, **look)
