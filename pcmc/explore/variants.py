"""Variants of a roof, and the figures of each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ..certificate import Certificate
from ..certificate.quantities import figures
from ..surface import Surface

MOST_VARIANTS = 20


@dataclass(frozen=True, eq=False)
class Variant:
    """A surface that is kept, with its name and certificate."""

    name: str
    surface: Surface
    certificate: Certificate

    @cached_property
    def figures(self) -> list[dict[str, Any]]:
        """Its key figures."""
        return figures_data(self.surface, self.certificate)


def figures_data(surface: Surface, certificate: Certificate) -> list[dict[str, Any]]:
    """The key figures of a surface as plain data: quantity, of, owner, dimension and value of each."""
    rows = figures(surface, certificate)
    return [row._asdict() | {"dimension": row.dimension} for row in rows]
