"""When a project is remeshed, and to which edge length."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from ..base.errors import OptionError, unknown
from ..meshing.remeshing import check_lengths

WHEN = ("before", "after")


@dataclass(frozen=True)
class Remeshing:
    """Other triangles at some time in a project.

    Attributes
    ----------
    edge_length, near_curves, growth, chord : as of ``pcmc.remesh.remesh``.
    when : "before" the surface is solved, or "after" it: then it is solved again.
    """

    edge_length: float
    near_curves: float | None = None
    growth: float = 1.2
    chord: float | None = None
    when: str = "after"

    def __post_init__(self) -> None:
        if self.when not in WHEN:
            raise OptionError(unknown("when", self.when, WHEN))
        check_lengths(**self.options)

    @property
    def options(self) -> dict[str, Any]:
        """The arguments of ``pcmc.remesh.remesh``."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "when"}


def remeshing(table: Mapping[str, Any]) -> Remeshing:
    """A Remeshing from a table of a project file.

    >>> remeshing({"edge_length": 0.5}).when
    'after'
    """
    if "edge_length" not in table:
        raise OptionError("[remesh] needs an edge_length")
    try:
        return Remeshing(**table)
    except OptionError as error:
        raise OptionError(f"remesh: {error}") from None
