"""The accuracy that a project asks for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from ..accuracy.adaptive import ACCURACY_OF, TRIANGLES
from ..accuracy.goals import accuracies
from ..base import validate
from ..base.errors import OptionError


@dataclass(frozen=True)
class AccuracyWanted:
    """What ``pcmc.solve_to_accuracy`` is asked for; nothing if ``accuracy`` is empty.

    Attributes
    ----------
    accuracy : error bars wanted, by quantity, such as {height = 1e-3, "area of north" = 0.01}; triangles get
        finer where the error comes from until they are reached. Needs the extra ``remesh``.
    accuracy_of : "mesh", the value on the mesh is to be so accurate; "limit", the extrapolated value is.
    most_triangles : the most that a mesh made for the accuracy may have.
    """

    accuracy: Mapping[str, float] = field(default_factory=dict)
    accuracy_of: str = "mesh"
    most_triangles: int = TRIANGLES

    def __post_init__(self) -> None:
        validate.choice("accuracy_of", self.accuracy_of, ACCURACY_OF)
        validate.integer("most_triangles", self.most_triangles, least=1)
        if self.accuracy:
            object.__setattr__(self, "accuracy", accuracies(self.accuracy))


def take_accuracy(options: dict[str, Any]) -> AccuracyWanted:
    """The accuracy wanted, whose keys are taken out of those of [solve].

    >>> options = {"accuracy": {"height": 1e-3}, "tolerance": 1e-9}
    >>> take_accuracy(options).accuracy, options
    ({'height': 0.001}, {'tolerance': 1e-09})
    """
    names = [f.name for f in fields(AccuracyWanted)]
    given = {name: options.pop(name) for name in names if name in options}
    try:
        return AccuracyWanted(**given)
    except OptionError as error:
        raise OptionError(f"solve: {error}", what=f"solve.{error.what}", found=error.found) from None
