"""How a branch is followed, and how it may end."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ..base import validate
from ..base.errors import OptionError

CONTROLS = ("arclength", "parameter", "volume", "height")


class Ending(Enum):
    """Why a branch ends. The value is a sentence."""

    REACHED = "the branch reached the value asked for"
    FOLDS = "the branch passed as many folds as asked for"
    STEPS = "stopped after the number of steps allowed; raise steps to go on"
    LOST = "the branch could not be followed further: the steps became too short"
    DEGENERATE = (
        "the branch could not be followed further: triangles collapse; try remesh=, or a finer mesh"
    )
    STOPPED = "stopped on request"


@dataclass(frozen=True)
class FollowOptions:
    """How a branch is followed.

    Parameters
    ----------
    control : what a step prescribes: ``"arclength"``; ``"volume"`` or ``"height"`` of the highest
        vertex, which end where that turns; ``"parameter"``, which ends at a fold.
    step : length of the first step; the branch starts towards smaller λ where it is negative. A
        relative change of λ by 1 has length 1, as has a mean displacement by the surface's size.
    smallest, largest : the shortest and the longest step.
    steps : the most steps.
    tolerance : relative residual of each point.
    folds : end after this many folds; None for any number.
    min_quality : triangles are spread along the shape while the worst has less than this quality.
    remesh : edge length of a new mesh (`pcmc.remesh`) where spreading leaves a triangle below that
        quality; None keeps the triangles.
    keep : every so many points the surface is kept; the last one is in any case.
    backend : factorisation, ``"pardiso"`` or ``"superlu"``; None for the fastest here.
    """

    control: str = "arclength"
    step: float = 0.05
    smallest: float = 1e-5
    largest: float = 0.15
    steps: int = 200
    tolerance: float = 1e-10
    folds: int | None = None
    min_quality: float = 0.45
    remesh: float | None = None
    keep: int = 1
    backend: str | None = None

    def __post_init__(self) -> None:
        validate.choice("control", self.control, CONTROLS)
        if validate.number("step", self.step) == 0.0:
            raise OptionError("step: expected a number that is not 0; its sign is the first dλ's")
        validate.number("smallest", self.smallest, above=0.0)
        validate.number("largest", self.largest, least=self.smallest)
        validate.integer("steps", self.steps)
        validate.number("tolerance", self.tolerance, above=0.0)
        if self.folds is not None:
            validate.integer("folds", self.folds, least=1)
        validate.number("min_quality", self.min_quality, least=0.0, below=1.0)
        if self.remesh is not None:
            validate.number("remesh", self.remesh, above=0.0)
        validate.integer("keep", self.keep, least=1)
