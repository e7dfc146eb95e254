"""How a branch is followed, and how it may end."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ...base.validate import check_options, choice, integer, limited, number, positive, refuse

CONTROLS = ("arclength", "parameter", "volume", "height")


class Ending(Enum):
    """Why a branch ends.

    >>> Ending.FOLDS.value
    'the branch passed the requested number of folds'
    """

    REACHED = "the branch reached the requested value"
    FOLDS = "the branch passed the requested number of folds"
    STEPS = "stopped at the limit of steps; raise steps to go on"
    LOST = "the branch could not be followed further: the steps became too short"
    DEGENERATE = "the branch could not be followed further: triangles collapse; try remesh=, or a finer mesh"
    STOPPED = "stopped on request"


@dataclass(frozen=True)
class FollowOptions:
    """How a branch is followed.

    Parameters
    ----------
    control : the quantity that each step prescribes: ``"arclength"``; ``"volume"`` or ``"height"`` of
        the highest vertex, which end where it turns; ``"parameter"``, which ends at a fold.
    step : length of the first step. If it is negative, the branch starts towards smaller λ. A relative
        change of λ by 1 has length 1; so has a mean displacement by the surface's size. Loads that are 0
        change relative to the largest pressure or, without one, tension over size.
    smallest, largest : shortest and longest step.
    steps : largest number of steps.
    tolerance : relative residual of each point.
    folds : end after this many folds; None for any number.
    min_quality : vertices are redistributed along the shape while the worst triangle has less quality.
    remesh : edge length of a new mesh (`pcmc.remesh`), made where redistribution leaves a triangle
        below that quality; None: never remesh.
    keep : store the surface of every ``keep``-th point; the last one is always stored.
    backend : factorisation, ``"pardiso"`` or ``"superlu"``; None for the fastest one installed.

    Examples
    --------
    >>> FollowOptions(step=-0.05, folds=1).control  # towards smaller λ, through one fold
    'arclength'
    >>> FollowOptions(step=0.0)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    pcmc.base.errors.OptionError: step: expected a number ≠ 0, with the sign of...
    """

    control: str = limited("arclength", choice, known=CONTROLS)
    step: float = limited(0.05, number)
    smallest: float = limited(1e-5, positive)
    largest: float = 0.15
    steps: int = limited(200, integer)
    tolerance: float = limited(1e-10, positive)
    folds: int | None = limited(None, integer, least=1)
    min_quality: float = limited(0.45, number, least=0.0, below=1.0)
    remesh: float | None = limited(None, positive)
    keep: int = limited(1, integer, least=1)
    backend: str | None = None

    def __post_init__(self) -> None:
        check_options(self)
        if self.step == 0.0:
            refuse("step", self.step, "a number ≠ 0, with the sign of the first change of λ")
        number("largest", self.largest, least=self.smallest)
