"""Pictures of cutting patterns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..surface import Patch, Surface
from .figure import Image, Path
from .pictures import draw

if TYPE_CHECKING:
    from ..cloth import CuttingPattern


def strains(pattern: CuttingPattern, path: Path | None = None, **options: Any) -> Image:
    """The strips of a cutting pattern on the roof, coloured by the larger principal strain of the cloth.

    ``options`` are as in ``draw``, such as ``view`` and ``width``.

    >>> from pcmc import cutting_pattern
    >>> flat = Surface([[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]], [[0, 1, 2], [0, 2, 3]], [0, 0],
    ...                [Patch("sail", 2.0, pressure=0.0)], fixed=range(4))
    >>> strains(cutting_pattern(flat, strips=2), width=200).shape[1]
    200
    """
    strips = pattern.strips
    first = np.cumsum([0, *(len(strip.roof) for strip in strips)])
    faces = np.concatenate([strip.faces + start for strip, start in zip(strips, first[:-1], strict=True)])
    owner = np.repeat(np.arange(len(strips)), [len(strip.faces) for strip in strips])
    patches = [Patch(f"strip {strip.number}", 1.0) for strip in strips]
    roof = np.concatenate([strip.roof for strip in strips])
    held: dict[str, Any] = {"fixed": range(len(roof)), "plane": pattern.surface.plane}
    cut = Surface(roof, faces, owner, tuple(patches), **held)
    strain = np.concatenate([strip.strain for strip in strips])
    largest = 100.0 * np.take_along_axis(strain, np.abs(strain).argmax(axis=1)[:, None], axis=1)[:, 0]
    look: dict[str, Any] = {"label": "strain of the cloth, %", "supports": False, "edges": False} | options
    return draw(cut, path, scalars=largest, **look)
