"""The values of a plan, made from plain data and checked; no mesh yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ..base import validate
from ..base.errors import OptionError
from ..surface import Plane
from .parts import EDGES, areas_of, curve_of, divider_of, hole_of, support_of


@dataclass(frozen=True, eq=False)
class PlanData:
    """The attributes of a ``Plan``, where they are described: curves, parts and numbers."""

    outline: Any
    dividers: Sequence[Any] = ()
    holes: Sequence[Any] = ()
    patches: Any = ()
    edge_length: float = 1.0
    edge: str = "fixed"
    supports: Sequence[Any] = ()
    plane: Plane = field(default_factory=Plane)
    rise: float | None = None
    tension: float | None = None

    def __post_init__(self) -> None:
        parsed = {
            "outline": curve_of(self.outline, "outline", closed=True),
            "dividers": tuple(divider_of(d, k) for k, d in enumerate(self.dividers, 1)),
            "holes": tuple(hole_of(h, k) for k, h in enumerate(self.holes, 1)),
            "patches": areas_of(self.patches),
            "supports": tuple(support_of(s, k) for k, s in enumerate(self.supports, 1)),
        }
        for key, value in parsed.items():
            object.__setattr__(self, key, value)
        validate.choice("edge of the outline", self.edge, EDGES)
        validate.number("edge_length", self.edge_length, above=0.0)
        if self.rise is not None:
            validate.number("rise", self.rise, above=0.0)
        if not self.patches and self.tension is None:
            raise OptionError(
                "a plan needs patches with tensions, or one tension= for all", what="tension"
            )
        if self.patches and self.tension is not None:
            raise OptionError(
                "a plan has either patches, each with its tension, or one tension= for all; leave one"
                " of them out",
                what="tension",
            )
        names = [d.name for d in self.dividers if d.wall is not None]
        names += [a.name for a in self.patches]
        for place, name in enumerate(names):
            if name in names[:place]:
                raise OptionError(
                    f"the name {name!r} is used twice; each patch and wall needs its own",
                    what="name",
                    found=name,
                )
