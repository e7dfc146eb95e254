"""The solves of a search: their steps are counted on, and a request to stop ends them all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from .. import solvers
from ..base.errors import NoBranch
from ..continuation import BoundaryMotion, Branch, Direction, follow
from ..forces.functional import gradient
from ..solvers.result import Callback, Progress, Result, Status
from ..surface import Surface
from .folding import until_turned

MIN_QUALITY = 0.3  # of triangles along a branch, below which vertices are redistributed


class LimitReached(Exception):
    """A solve of the search has taken as many steps as it may; ``result`` is its end."""

    def __init__(self, result: Result) -> None:
        super().__init__()
        self.result = result


@dataclass
class Attempts:
    """Solves in a row, whose steps go to one callback and are counted on.

    Attributes
    ----------
    callback : the user's; it gets the steps of solves and of branches.
    options : of every solve.
    steps, evaluations : taken so far.
    """

    callback: Callback | None
    options: Mapping[str, Any]
    steps: int = 0
    evaluations: int = 0

    def solve(self, surface: Surface, **changes: Any) -> Result:
        """Solve from one start; StopIteration if stopped, LimitReached at the limit asked for."""
        before = self.steps

        def count(progress: Progress) -> None:
            self.show(progress.surface, {**progress.row, "iteration": before + progress.iteration})

        result = solvers.solve(surface, "newton", count, **{**self.options, **changes})
        self.steps = before + len(result.rows)
        self.evaluations += result.evaluations
        if result.status is Status.STOPPED:
            raise StopIteration
        rows = [{**row, "iteration": before + row["iteration"]} for row in result.rows]
        result = replace(result, rows=rows)
        if result.status is Status.ITERATION_LIMIT and "iterations" in self.options:
            raise LimitReached(result)
        return result

    def follow(
        self,
        surface: Surface,
        direction: Direction | BoundaryMotion,
        stop: float,
        back: float | None = None,
        *,
        steps: int,
        smallest: float,
    ) -> Branch | None:
        """Follow a branch until it arrives or turns; StopIteration if that was stopped.

        None where no branch starts: rigid motions are free, or the parameter moves nothing. ``back`` is as in
        ``way``. It has at most ``steps`` points, or as many as a solve may take steps.
        """
        steps = min(steps, self.options.get("iterations", steps))
        interrupted: list[BaseException] = []

        def count(progress: Progress) -> None:
            square = float((gradient(progress.surface()) ** 2).sum())
            row = {**progress.row, "iteration": self.steps, "step": "branch", "gradient_squared": square}
            self.steps += 1
            try:
                self.show(progress.surface, row)
            except BaseException as error:
                interrupted.append(error)
                raise

        watch = until_turned(count, back)
        try:
            branch = follow(
                surface,
                direction,
                stop,
                callback=watch,
                min_quality=MIN_QUALITY,
                steps=steps,
                smallest=smallest,
            )
        except NoBranch:
            return None
        if interrupted:  # by the callback, whatever it raised
            raise interrupted[0]
        self.evaluations += int(branch.points.iterations.sum())
        return branch

    def show(self, surface: Any, row: Mapping[str, Any]) -> None:
        """Call the user's callback."""
        if self.callback is not None:
            self.callback(Progress(row["iteration"], surface, row))
