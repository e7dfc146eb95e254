"""Remeshing as a step of a project."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from ..base import validate
from ..base.errors import OptionError
from ..meshing.remeshing import check_lengths

WHEN = ("before", "after")


@dataclass(frozen=True)
class Remeshing:
    """New triangles before or after a project is solved.

    Attributes
    ----------
    edge_length : of the triangles, length.
    near_curves : edge length at junctions and boundaries, if shorter, length.
    growth : largest ratio of the lengths of neighbouring edges, > 1.
    chord : largest distance between the triangles and the smooth surface, length; without it a
        tenth of ``edge_length``.
    when : "before" the surface is solved, or "after"; then it is solved again.
    """

    edge_length: float
    near_curves: float | None = None
    growth: float = 1.2
    chord: float | None = None
    when: str = "after"

    def __post_init__(self) -> None:
        validate.choice("when", self.when, WHEN)
        check_lengths(**self.options)

    @property
    def options(self) -> dict[str, Any]:
        """The arguments of ``pcmc.meshing.remeshing.remesh``."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "when"}


def remeshing(table: Mapping[str, Any]) -> Remeshing:
    """A Remeshing from a table of a project file.

    >>> remeshing({"edge_length": 0.5}).when
    'after'
    """
    try:
        return Remeshing(**table)
    except OptionError as error:
        what = f"remesh.{error.what}" if error.what else "remesh"
        raise OptionError(f"remesh: {error}", what=what, found=error.found) from None
