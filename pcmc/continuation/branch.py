"""``follow``, and the branch that it returns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from typing import Any

import pandas as pd

from ..base import validate
from ..base.errors import MissingExtra, OptionError, SurfaceError
from ..design import Parameter
from ..solvers.result import Callback
from ..surface import Surface
from .direction import Direction
from .options import Ending, FollowOptions
from .state import QUANTITIES
from .tracing import Tracer


@dataclass(frozen=True, eq=False)
class Branch:
    """A branch of equilibria: its bifurcation diagram as tables.

    Attributes
    ----------
    points : one row per point: arclength s (a number), parameter λ, the tensions and pressures that
        vary (``tension NAME``, ``pressure NAME``), energy (force·length), volume (length³), height
        over Π (length), index, lowest_eigenvalue (force/length³), residual (relative), quality of the
        worst triangle, slope dλ/ds, iterations of Newton's method.
    events : one row per event: kind ("fold", "index" or "contact"), parameter, energy, volume, height,
        arclength, and the index before and after it.
    surfaces : by row of ``points``.
    ending, detail : why the branch ends, and the last difficulty.
    """

    parameter: Direction
    points: pd.DataFrame
    events: pd.DataFrame
    surfaces: Mapping[int, Surface] = field(repr=False)
    ending: Ending
    detail: str = ""

    @property
    def message(self) -> str:
        """A sentence that says why the branch ends."""
        return f"{self.ending.value} ({self.detail})" if self.detail else self.ending.value

    @property
    def last(self) -> Surface:
        """The surface at the end."""
        return self.surfaces[max(self.surfaces)]

    @property
    def folds(self) -> pd.DataFrame:
        """The events at which λ turns."""
        return self.events[self.events.kind == "fold"].reset_index(drop=True)


def follow(
    surface: Surface,
    parameter: str | Parameter | Direction,
    stop: float | None = None,
    *,
    until: Mapping[str, float] | None = None,
    callback: Callback | None = None,
    **options: Any,
) -> Branch:
    """Follow the equilibria of a surface as a parameter changes.

    Parameters
    ----------
    surface : where the branch starts: at rest (a minimum or a saddle) and held against rigid motions.
    parameter : a patch's name for its tension; a ``Parameter``, whose bounds are ignored; or a
        ``Direction``, for several tensions and pressures that change together.
    stop : end where the parameter has this value. The branch starts towards it.
    until : end where one of ``parameter``, ``energy``, ``volume`` or ``height`` has the value given.
    callback : called with a Progress after each point. Raise StopIteration in it to stop.
    options : fields of ``FollowOptions``.

    Returns
    -------
    Branch
        If the branch cannot be followed further, see its ``ending``; no exception is raised.

    Raises
    ------
    OptionError : an unknown patch, option or column, or a value outside its range.
    SurfaceError : the surface is not at rest, or not held against rigid motions.

    Notes
    -----
    Changes of index are located to 2e-5 of arclength on the current mesh; folds to that or a thousandth
    of the step, which hardly changes λ. The position of the vertices along the surface matters as much
    as the fineness of the mesh, to second order in the edge length. So other steps move a fold a
    little: the cap's by 6e-5 with 5 rings, 2e-5 with 10. If a step passes a goal twice, before and
    behind a fold, the branch ends at the first. Two folds within one step are both missed; shorten
    ``largest``.

    Where a smooth branch folds, an eigenvalue passes 0. The eigenvalue of a mesh does so near the fold:
    within 1e-6 of the tension for the cap, but farther away, or not at all, where a junction ends at a
    corner that only the mesh holds. Sliding triangles along after the junction moves the fold there,
    but not the eigenvalues.

    A change of contact with Π is solved for at one λ and not located within its step. A branch that
    folds just there is lost.

    Examples
    --------
    A pyramid of tension α over a square: E = 4 α √(1 + h²) - 4h/3 is stationary where
    α h/√(1 + h²) = 1/3. No fold: h runs to infinity as α falls to 1/3.

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> branch = follow(roof, "roof", until={"height": 1.0}, step=-0.05)
    >>> float((branch.points.parameter.iloc[-1] * 3 / 2**0.5).round(9)), len(branch.events)
    (1.0, 0)
    """
    if not isinstance(surface, Surface):
        validate.refuse("surface", type(surface).__name__, "a Surface", error=SurfaceError)
    if callback is not None and not callable(callback):
        validate.refuse("callback", callback, "a function of a Progress")
    chosen = validate.build(FollowOptions, "follow", options)
    if chosen.remesh is not None and find_spec("mmgpy") is None:
        raise MissingExtra("mmgpy", "remesh")
    direction, goals = _direction(parameter), _goals(stop, until)
    line = direction.line(surface)
    if stop is not None and stop != line.value:
        chosen = replace(chosen, step=math.copysign(chosen.step, stop - line.value))
    tracer = Tracer(surface, line, goals, chosen, callback)
    ending, detail = tracer.run()
    columns = list(tracer.event("", tracer.here.state, 0.0, 0, 0))
    events = pd.DataFrame(tracer.events, columns=columns)
    return Branch(direction, pd.DataFrame(tracer.rows), events, tracer.surfaces, ending, detail)


def _direction(parameter: object) -> Direction:
    if isinstance(parameter, Direction):
        return parameter
    if isinstance(parameter, str):
        return Direction({parameter: 1.0})
    if isinstance(parameter, Parameter):
        weights = {parameter.patch: 1.0}
        return Direction(weights) if parameter.kind == "tension" else Direction(pressures=weights)
    validate.refuse("parameter", parameter, "the name of a patch, a Parameter or a Direction")


def _goals(stop: float | None, until: Mapping[str, float] | None) -> dict[str, float]:
    if not isinstance(until, Mapping | None):
        validate.refuse("until", until, "a value by column, such as {'height': 1.0}")
    goals = dict(until or {})
    if stop is not None and "parameter" in goals:
        raise OptionError("stop and until['parameter'] are the same goal; give one of them", what="until")
    for name, value in goals.items():
        validate.choice("column in until", name, QUANTITIES)
        validate.number(f"until[{name!r}]", value)
    if stop is not None:
        goals["parameter"] = validate.number("stop", stop)
    return goals
