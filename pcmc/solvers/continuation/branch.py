"""``follow``, and the branch that it returns."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from ...base import validate
from ...base.arrays import Floats
from ...base.errors import MissingExtra, OptionError
from ...surface import Surface, expect_surface
from ...surface.lagrange import expect_flat
from ..result import Callback, Progress, until_stopped
from .branch_point import ALONG, leaving
from .options import Ending, FollowOptions
from .parameters import BoundaryMotion, Direction, ParameterLine
from .state import QUANTITIES, BranchMesh
from .tracing import Tracer

if TYPE_CHECKING:
    from ...certificate.quantities import Parameter


@dataclass(frozen=True, eq=False)
class Branch:
    """A branch of equilibria: its bifurcation diagram as tables.

    Attributes
    ----------
    points : a row per point: arclength s (a number), parameter λ, the values that vary (``tension NAME``,
        ``pressure NAME``), energy (force·length), volume (length³, that of certificates), height over Π
        (length), index, lowest_eigenvalue (force/length³), residual (relative), quality of the worst
        triangle, slope dλ/ds, iterations of Newton's method.
    events : a row per event: kind ("fold", "index" or "contact"), parameter, energy, volume, height,
        arclength, the index before and after, and along_branch, the cosine between the mode that turns and
        the branch: 1 at a fold; 0 where the branch goes on and others leave it.
    surfaces, event_surfaces : by row of ``points``, and of ``events``.
    ending, detail : why the branch ends, and the last difficulty.
    """

    parameter: Direction | BoundaryMotion
    points: pd.DataFrame
    events: pd.DataFrame
    surfaces: Mapping[int, Surface] = field(repr=False)
    ending: Ending
    detail: str = ""
    event_surfaces: Mapping[int, Surface] = field(default_factory=dict, repr=False)
    _line: ParameterLine | None = field(default=None, repr=False)
    _options: FollowOptions = field(default=FollowOptions(), repr=False)

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

    @property
    def bifurcations(self) -> pd.DataFrame:
        """The events at which the index changes and λ does not turn; rows are numbered as in ``events``."""
        return self.events[(self.events.kind == "index") & (self.events.along_branch < ALONG)]

    def pieces(self, x: str, y: str) -> list[tuple[bool, Floats]]:
        """Lines (k,2) of column y against x, cut where the index passes 0: whether stable, and the points.

        Events are points of them, too. A diagram draws them solid where stable, and dashed elsewhere.
        """
        known = self.points.columns.intersection(self.events.columns).tolist()
        columns = ["arclength", *(validate.choice("column", name, known) for name in (x, y))]
        events = self.events[columns].assign(index=self.events.index_after)
        every = np.concatenate([self.points[[*columns, "index"]].to_numpy(float), events.to_numpy(float)])
        every = every[np.argsort(every[:, 0], kind="stable")]
        stable = every[:, 3] == 0.0
        cuts = np.flatnonzero(stable[1:] != stable[:-1]) + 1
        ends = zip([0, *cuts], [*cuts, len(every)], strict=True)
        return [(bool(stable[i]), every[i : k + 1, 1:3]) for i, k in ends]

    def switch(
        self,
        event: int | None = None,
        *,
        stop: float | None = None,
        until: Mapping[str, float] | None = None,
        callback: Callback | None = None,
        **options: Any,
    ) -> tuple[Branch, Branch]:
        """Follow the two branches that leave this one at a bifurcation, along the mode that turns.

        Parameters
        ----------
        event : row of ``events``; by default the first of ``bifurcations``.
        stop, until, callback : as in ``follow``; here ``stop`` does not decide the direction.
        options : fields of ``FollowOptions``; by default those of this branch. ``step`` is the distance
            of the first point from the bifurcation.

        Returns
        -------
        (Branch, Branch)
            Along the mode and against it; in the first the surface rises over Π, if the mode lifts it at
            all. Of a symmetric bifurcation (a pitchfork) they are images of each other, and λ turns at their
            start; of others λ passes it. ``points`` begins off the bifurcation.

        Raises
        ------
        OptionError : the event is no bifurcation, or several modes turn at once.

        Notes
        -----
        The mesh must have the symmetry that makes the bifurcation. On another mesh the branches pass
        each other at a small distance, without an event.

        The event is where an eigenvalue of the Hessian passes 0. The equations of equilibrium on a mesh
        are singular a little beside it, to second order in the edge length; there the branches leave.

        Examples
        --------
        A roof of two tops, equally high until its tension is too small; then one of them sinks:

        >>> from pcmc import Patch, Surface, solve
        >>> X = [[-3, -1, 0], [0, -1, 0], [3, -1, 0], [3, 1, 0], [0, 1, 0], [-3, 1, 0], [-1, 0, 1], [1, 0, 1]]
        >>> F = [[0, 1, 6], [1, 7, 6], [1, 2, 7], [2, 3, 7], [3, 4, 7], [4, 6, 7], [4, 5, 6], [5, 0, 6]]
        >>> roof = Surface(X, F, [0] * 8, [Patch("roof", 0.6)], fixed=range(6))
        >>> branch = follow(solve(roof).surface, "roof", 0.4, min_quality=0.1)
        >>> [round(x, 2) for x in branch.bifurcations.parameter]
        [0.41]
        >>> left, right = branch.switch(steps=2)
        >>> tops = [side.last.vertices[6:, 2].round(6).tolist() for side in (left, right)]
        >>> tops[0] == tops[1][::-1], tops[0][0] != tops[0][1]
        (True, True)
        """
        row, goals = self._bifurcation(event), _goals(stop, until)
        chosen = validate.options_from(FollowOptions, "switch", vars(self._options) | options)
        line = replace(self._known_line("switch"), value=float(self.events.parameter[row]))
        surface = self.event_surfaces[row]
        one, other = (
            _traced(self.parameter, Tracer(surface, line, goals, chosen, callback, start))
            for start in leaving(BranchMesh(surface, line, chosen.backend), line.value, chosen, row)
        )
        return one, other

    def resume(self, row: int, stop: float, *, callback: Callback | None = None) -> Branch:
        """Follow the branch again from one of its points to a value of λ exactly, with its own options.

        Parameters
        ----------
        row : of ``points``, at which the surface is stored.
        stop : value of λ; the branch starts towards it.
        callback : as in ``follow``.

        Raises
        ------
        OptionError : no surface is stored at that row.

        Examples
        --------
        A pyramid's height between two points of its branch, with α h/√(1 + h²) = 1/3:

        >>> from pcmc import Patch, Surface
        >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
        >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
        ...                [Patch("roof", 1.0)], fixed=range(4))
        >>> branch = follow(roof, "roof", 0.5)
        >>> between = branch.resume(1, 2 / 3).points.iloc[-1]
        >>> float(between.parameter), float((3 * between.height**2).round(6))
        (0.6666666666666666, 1.0)
        """
        if validate.integer("row", row) not in self.surfaces:
            validate.refuse("row", row, "a row of points with its surface stored")
        stop = validate.number("stop", stop)
        value = float(self.points.parameter[row])
        chosen = replace(self._options, step=math.copysign(self._options.step, stop - value))
        line, goals = replace(self._known_line("resume"), value=value), _goals(stop, None)
        return _traced(self.parameter, Tracer(self.surfaces[row], line, goals, chosen, callback))

    def _known_line(self, what: str) -> ParameterLine:
        if self._line is None:
            message = f"{what}: this branch was put together from tables; only one that follow gave can"
            raise OptionError(f"{message} {what}", what="branch")
        return self._line

    def _bifurcation(self, event: int | None) -> int:
        """The row of the event, which must be a bifurcation along one mode."""
        if event is None:
            if self.bifurcations.empty:
                message = "switch: no bifurcation on this branch, no index changes beside its folds"
                raise OptionError(message, what="event", expected="a bifurcation")
            event = int(self.bifurcations.index[0])
        if validate.integer("event", event) >= len(self.events):
            validate.refuse("event", event, f"a row of events, below {len(self.events)}")
        row: Any = self.events.loc[event]
        if row.kind == "fold" or row.along_branch >= ALONG:
            message = f"event {event} is a fold: the branch itself turns there, and no other leaves it"
            raise OptionError(message, what="event", where=event, found="fold", expected="a bifurcation")
        count = abs(int(row.index_after) - int(row.index_before))
        if row.kind != "index" or count != 1:
            found = row.kind if row.kind != "index" else f"{count} modes that turn at once"
            message = f"event {event}: expected a change of index by 1, found {found}"
            raise OptionError(message, what="event", where=event, found=found, expected="a bifurcation")
        return event


def _traced(parameter: Direction | BoundaryMotion, tracer: Tracer) -> Branch:
    """The branch that a tracer follows to its end."""
    ending, detail = until_stopped(tracer.run, (Ending.STOPPED, ""))
    columns = list(tracer.event("", tracer.here.state, 0.0, 0, 0))
    points, events = pd.DataFrame(tracer.rows), pd.DataFrame(tracer.events, columns=columns)
    at_events = dict(enumerate(events.pop("surface")))
    return Branch(
        parameter, points, events, tracer.surfaces, ending, detail, at_events, tracer.line, tracer.options
    )


def follow(
    surface: Surface,
    parameter: str | Parameter | Direction | BoundaryMotion,
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
        ``Direction``, for several tensions and pressures that change together; or a ``BoundaryMotion``,
        which moves the fixed vertices.
    stop : end where the parameter has exactly this value. The branch starts towards it.
    until : end where one of ``parameter``, ``energy``, ``volume`` or ``height`` has the value given: the
        parameter exactly, the others, which are results, to rounding.
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
    expect_surface(surface)
    expect_flat(surface, "follow")
    validate.callback("callback", callback, "a function of a Progress")
    chosen = validate.options_from(FollowOptions, "follow", options)
    if chosen.remesh is not None and find_spec("mmgpy") is None:
        raise MissingExtra("mmgpy", "remesh")
    goals = _goals(stop, until)
    direction: object = Direction({parameter: 1.0}) if isinstance(parameter, str) else parameter
    if not isinstance(direction, Direction | BoundaryMotion):
        from ...certificate.quantities import Parameter  # slow to import

        if not isinstance(direction, Parameter):
            expected = "the name of a patch, a Parameter, a Direction or a BoundaryMotion"
            validate.refuse("parameter", parameter, expected)
        by_kind: dict[str, Any] = {direction.key: dict.fromkeys(direction.names, 1.0)}
        direction = Direction(**by_kind)
    if chosen.remesh is not None and isinstance(direction, BoundaryMotion):
        message = "remesh: a new mesh has other boundary vertices than BoundaryMotion moves; leave remesh out"
        raise OptionError(message, what="remesh", found=chosen.remesh)
    line = direction.line(surface)
    if stop is not None and stop != line.value:
        chosen = replace(chosen, step=math.copysign(chosen.step, stop - line.value))
    return _traced(direction, Tracer(surface, line, goals, chosen, callback))


def follow_until(
    over: Callable[[Progress], bool], callback: Callback | None, *what: Any, **options: Any
) -> Branch:
    """``follow`` to the first point that is ``over``; KeyboardInterrupt where it is stopped before."""
    ended = False

    def watch(progress: Progress) -> None:
        nonlocal ended
        if callback is not None:
            callback(progress)
        if ended := over(progress):
            raise StopIteration

    branch = follow(*what, callback=watch, **options)
    if branch.ending is Ending.STOPPED and not ended:
        raise KeyboardInterrupt
    return branch


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
