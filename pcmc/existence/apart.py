"""Moving held curves apart, from near to each other to where they are, with the film between them."""

from __future__ import annotations

from dataclasses import dataclass

from ..certificate.proof import Fold
from ..surface import Surface
from .attempts import Attempts


@dataclass(frozen=True, eq=False)
class Apart:
    """What moving the curves apart has shown: a surface at the full distance, or a fold on the way."""

    surface: Surface | None = None
    fold: Fold | None = None


def move_apart(surface: Surface, attempts: Attempts) -> Apart:
    return Apart()
