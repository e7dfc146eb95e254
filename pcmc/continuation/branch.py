"""`follow`, and the branch it returns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from typing import Any

import pandas as pd

from ..base import validate
from ..base.errors import MissingExtra, OptionError, SurfaceError, unknown
from ..design import Parameter
from ..solvers.result import Callback
from ..surface import Surface
from .between import GOALS
from .direction import Direction
from .options import Ending, FollowOptions
from .tracing import Tracer


@dataclass(frozen=True, eq=False)
class Branch:
    """A branch of equilibria, its bifurcation diagram as tables.

    Attributes
    ----------
    points : a row a point: arclength s (a number), parameter λ, the tensions and pressures that vary
        (``tension NAME``, ``pressure NAME``), energy (force·length), volume (length³), height over Π
        (length), index, lowest_eigenvalue (force/length³), residual (relative), quality of the worst
        triangle, slope dλ/ds, iterations of Newton's method.
    events : a row an event: kind ("fold", "index" or "contact"), parameter, energy, volume, height,
        arclength, and the index before and after it.
    surfaces : by the row of ``points``.
    ending, detail : why it ends, and the last difficulty met.
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
    surface : at rest (a minimum or a saddle), held against rigid motions; where the branch starts.
    parameter : a patch's name for its tension; a ``Parameter``, whose bounds play no part here; or a
        ``Direction``, for several tensions and pressures that change together.
    stop : end where the parameter has this value; the branch starts towards it.
    until : end where one of these, ``parameter``, ``energy``, ``volume`` or ``height``, has the value
        given.
    callback : called with a Progress after each point. Raise StopIteration to stop.
    options : fields of ``FollowOptions``.

    Returns
    -------
    Branch
        Not getting further is an ending there, never an exception.

    Raises
    ------
    OptionError : an unknown patch, option or column, or a value that it may not have.
    SurfaceError : the surface is not at rest, or not held against rigid motions.

    Notes
    -----
    Changes of index are located to 2e-5 of arclength on the mesh as it stands there, folds to that or a
    thousandth of the step, which λ hardly feels. Where vertices stand along the surface matters as much
    as the mesh's fineness does, to second order in the edge length, so other steps find a fold a little
    elsewhere: the cap's by 6e-5 with 5 rings, 2e-5 with 10. A goal passed twice within a step, before a
    fold and behind it, is met the first time. Of two folds within one step neither is seen; shorten
    ``largest``.

    Where a smooth branch folds, an eigenvalue passes 0. That of a mesh does so near the fold, the cap's
    within 1e-6 of its tension, but farther off where a junction ends at a corner that the mesh alone
    holds, and there perhaps not at all: that triangles slide along after the junction moves the fold, and
    not the eigenvalues.

    A change of contact with Π is solved for at one λ and not located within its step; a branch that
    folds just there is lost.

    Examples
    --------
    A pyramid of tension α over a square: E = 4 α √(1 + h²) - 4h/3 is stationary where
    α h/√(1 + h²) = 1/3. No fold: h runs to infinity as α falls to 1/3.

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> found = follow(roof, "roof", until={"height": 1.0}, step=-0.05)
    >>> float((found.points.parameter.iloc[-1] * 3 / 2**0.5).round(9)), len(found.events)
    (1.0, 0)
    """
    if not isinstance(surface, Surface):
        raise SurfaceError(f"follow: expected a Surface, found {type(surface).__name__}")
    if callback is not None and not callable(callback):
        raise OptionError(f"callback: expected a function of a Progress, found {callback!r}")
    chosen = validate.build(FollowOptions, "follow", options)
    if chosen.remesh is not None and find_spec("mmgpy") is None:
        raise MissingExtra("mmgpy", "remesh")
    parameter = _direction(parameter)
    goals = _goals(stop, until)
    line = parameter.line(surface)
    if stop is not None and stop != line.value:
        chosen = replace(chosen, step=math.copysign(chosen.step, stop - line.value))
    tracer = Tracer(surface, line, goals, chosen, callback)
    ending, detail = tracer.run()
    return Branch(
        parameter,
        pd.DataFrame(tracer.rows),
        pd.DataFrame(tracer.events, columns=list(tracer.event("", tracer.here, 0.0, 0, 0))),
        tracer.surfaces,
        ending,
        detail,
    )


def _direction(parameter: object) -> Direction:
    if isinstance(parameter, Direction):
        return parameter
    if isinstance(parameter, str):
        return Direction({parameter: 1.0})
    if isinstance(parameter, Parameter):
        weights = {parameter.patch: 1.0}
        return Direction(weights) if parameter.kind == "tension" else Direction(pressures=weights)
    raise OptionError(
        f"parameter: expected the name of a patch, a Parameter or a Direction, found {parameter!r}"
    )


def _goals(stop: float | None, until: Mapping[str, float] | None) -> dict[str, float]:
    if not isinstance(until, Mapping | None):
        raise OptionError(f"until: expected a value by column, {{'height': 1.0}}, found {until!r}")
    goals = dict(until or {})
    if stop is not None and "parameter" in goals:
        raise OptionError("stop and until['parameter'] are the same goal; give one of them")
    for name, value in goals.items():
        if name not in GOALS:
            raise OptionError(unknown("column in until", name, GOALS))
        validate.number(f"until[{name!r}]", value)
    if stop is not None:
        goals["parameter"] = validate.number("stop", stop)
    return goals
