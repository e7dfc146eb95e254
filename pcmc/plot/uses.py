"""Pictures of cutting patterns, and of a roof under load."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..base import validate
from ..base.errors import unknown
from ..base.units import Units
from ..surface import Patch, Surface
from .figure import Image, Path
from .pictures import draw, panel

if TYPE_CHECKING:
    from ..cloth import CuttingPattern
    from ..structure import Analysis


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


MOST = 6  # cases of a picture
SHOWN = ("deflection", "least force")


def under_load(
    analysis: Analysis,
    path: Path | None = None,
    *,
    what: str = "deflection",
    cases: tuple[str, ...] = (),
    units: Units | None = None,
    **options: Any,
) -> Image:
    """What a roof does under its cases, side by side; see ``pcmc.analyse``.

    Parameters
    ----------
    what : "deflection", along Π's normal, or "least force", the smaller principal membrane force; grey where
        it is not above 0, so that the membrane is slack and wrinkles.
    cases : names of those to draw; by default those with the largest displacements, six at most.
    units : of the scale; by default those of the model.
    options : as of ``panel``, such as ``views`` and ``width``.
    """
    validate.choice("what", what, SHOWN)
    units, surface = units or analysis.model.units, analysis.model.surface
    names = [case.name for case in analysis.cases]
    for name in cases:
        if name not in names:
            validate.refuse("cases", name, "names of cases", hint=unknown("case", name, names))
    if not cases:
        by_size = sorted(names[1:], key=lambda name: -analysis[name].results.largest_displacement)
        cases = tuple(name for name in names if name in by_size[:MOST] or len(names) == 1)
    chosen = [analysis[name] for name in cases]
    if what == "deflection":
        scalars = [case.results.deflections for case in chosen]
        look: dict[str, Any] = {"label": f"deflection, {units.length or 'length'}"}
    else:
        scalars = [np.where(c.results.slack, np.nan, c.results.principal_forces[:, 0]) for c in chosen]
        known = [values[np.isfinite(values)] for values in scalars]
        most = max((float(values.max()) for values in known if len(values)), default=1.0)
        look = {"label": f"least membrane force, {units.tension}; grey: slack", "limits": (0.0, most)}
    parts = [(c.name, f"{100.0 * c.share:.0f} %", f"{100.0 * c.taut:.0f} %", c) for c in chosen]
    titles = [n if c.carried else f"{n}, at {share} of it, slack from {taut}" for n, share, taut, c in parts]
    look |= {"edges": False, "supports": False, "titles": titles}
    look |= {"columns": 1} if len(chosen) == 1 else {}
    return panel([surface] * len(chosen), path, scalars=scalars, **(look | options))
