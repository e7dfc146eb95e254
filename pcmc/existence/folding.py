"""How a branch of equilibria ends on its way to a value: it arrives, folds, or is lost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from ..certificate.proof import Attempt
from ..continuation import Branch, Ending
from ..solvers.result import Progress
from ..surface import Surface

BACK = 0.03  # of the farthest value: how far behind a turn a way down may open, and the branch is followed
SOUND = 0.2  # triangle quality from which a turn counts as the surface's, not the mesh's
POOR = 0.1  # triangle quality at which a branch is given up


class Arrival(Enum):
    """How a branch ends on its way to a value."""

    REACHED = "it arrives"
    FOLD = "it turns back, and a way down opens: a fold"
    LOST = "triangles become poor, or the branch cannot be followed"


@dataclass(frozen=True)
class Way:
    """The end of a branch: how, at which largest value of the parameter, with which triangles there."""

    arrival: Arrival
    farthest: float
    quality: float


@dataclass(frozen=True, eq=False)
class Further:
    """What a further way has shown: a surface to solve from and ``how`` it was reached, or how the way ended.

    Without either the way does not apply. ``way`` is as in Attempt.
    """

    surface: Surface | None = None
    how: str = ""
    way: str = ""
    attempt: Attempt | None = None


def until_turned(
    extra: Callable[[Progress], None] | None = None, back: float | None = None
) -> Callable[[Progress], None]:
    """A callback for ``follow``: ends a branch that has turned back, or whose triangles are poor.

    ``extra`` is called with each point; ``back`` is as in ``way``.
    """
    farthest = [0.0]

    def watch(progress: Progress) -> None:
        farthest[0] = max(farthest[0], progress.row["parameter"])
        if extra is not None:
            extra(progress)
        slack = BACK * farthest[0] if back is None else back
        if progress.row["parameter"] < farthest[0] - slack or progress.row["quality"] < POOR:
            raise StopIteration

    return watch


def way(branch: Branch, back: float | None = None) -> Way:
    """How a branch ends that was followed towards larger values.

    It folds where the parameter turns for good, with an eigenvalue that changes its sign not far from
    the turn and triangles that are sound: otherwise the mesh may be what turns. ``back`` is how far from the
    turn; by default 0.03 of the farthest value.
    """
    points = branch.points
    if branch.ending is Ending.REACHED:
        return Way(Arrival.REACHED, float(points.parameter.iloc[-1]), float(points.quality.iloc[-1]))
    farthest = float(max(points.parameter.max(), branch.folds.parameter.max()))
    quality = float(points.quality.iloc[int(points.parameter.argmax())])
    opened = branch.events[branch.events.kind == "index"].parameter
    turned = len(branch.folds) and branch.folds.parameter.max() >= points.parameter.max()
    slack = BACK * farthest if back is None else back
    folded = turned and quality > SOUND and (farthest - opened <= slack).any()
    return Way(Arrival.FOLD if folded else Arrival.LOST, farthest, quality)
