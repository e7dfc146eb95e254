"""``meet``: find the tensions and pressures that give a surface the heights, volumes, ... wanted."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import pandas as pd

from ..base import validate
from ..base.errors import OptionError, SurfaceError
from ..surface import Surface
from .outcome import Design
from .search import Search
from .targets import Parameter, Target, as_parameters, as_targets, measure


def meet(
    surface: Surface,
    targets: Target | Iterable[Target],
    vary: Parameter | str | Iterable[Parameter | str],
    *,
    tolerance: float = 1e-7,
    solves: int = 40,
    callback: Callable[[pd.Series], object] | None = None,
    **options: Any,
) -> Design:
    """Find tensions and pressures with which the surface at rest meets the targets.

    Parameters
    ----------
    surface : where to start; it need not be at rest.
    targets : one or several, each with a value or limits.
    vary : the parameters, or names of patches for their tensions. All others stay the same.
    tolerance : largest relative misfit of a target that counts as met.
    solves : largest number of solves.
    callback : called with each new row of the history. Raise StopIteration in it to stop with the best
        surface so far, as Ctrl-C does; any other exception passes through.
    options : of the solver, as in ``pcmc.solve`` with ``method="newton"``.

    Returns
    -------
    Design
        If the targets are out of reach, its ``status`` says so; that is no exception.

    Raises
    ------
    OptionError : an unknown patch, a target without a value, bad bounds, a quantity that cannot be
        measured.
    SurfaceError : no equilibrium was found to start from, however high the tensions.

    Examples
    --------
    The pyramid's height h obeys α h / √(1 + h²) = p / 3, so h = 0.75 needs α = 5/9:

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> pyramid = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                   [Patch("roof", 1.0)], fixed=range(4))
    >>> design = meet(pyramid, Target("apex", "roof", 0.75), "roof")
    >>> design.met, round(design.surface.patches[0].tension, 6)
    (True, 0.555556)
    """
    if not isinstance(surface, Surface):
        found = type(surface).__name__
        raise SurfaceError(f"meet: expected a Surface, found {found}", what="surface", found=found)
    aims, parameters = as_targets(targets), as_parameters(vary)
    for target in aims:
        if not target.limits:
            raise OptionError(f"{target.label}: give value, at_most or at_least", what=target.label)
        measure(surface, target)
    if callback is not None and not callable(callback):
        raise OptionError(
            f"callback: expected a function of a row, found {callback!r}",
            what="callback",
            found=callback,
        )
    validate.number("tolerance", tolerance, above=0.0)
    validate.integer("solves", solves, least=1)
    return Search(surface, aims, parameters, tolerance, solves, callback, options).run()
