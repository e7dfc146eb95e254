"""What a margin varies: all pressures, snow, weights, tensions or volumes in proportion, or one of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import OptionError
from ..certificate.quantities import Parameter
from ..solvers.continuation import Direction
from ..solvers.continuation.parameters import usual_size
from ..surface import Surface
from ..surface.values import in_the_open

Part = tuple[str, str]  # the kind of a parameter, such as "tension", and the name of what it belongs to


@dataclass(frozen=True, eq=False)
class Varied:
    """Numbers that change together: in proportion to λ, which is 1 on the surface; where all are 0, to λ."""

    what: str  # in words, such as "pressure" or "tension of west"
    parts: tuple[Part, ...]
    values: Floats  # (k,) the present values
    more: bool  # whether they grow on the way to the edge
    unit: float = 0.0  # what λ = 1 means for each where all are 0 now; 0 where they are not

    @classmethod
    def of(cls, surface: Surface, what: str, towards: str | None = None) -> Varied:
        """What a text names on a surface. Errors as ``margin``."""
        known = named(surface)
        parts = known[validate.choice("load or tension", what, [*known])]
        walls = [surface.patches[k].name for k in np.flatnonzero(surface.walls)]
        pulls = any(kind == "cable" or (kind == "tension" and name not in walls) for kind, name in parts)
        more = not pulls
        if towards is not None:
            more = validate.choice("towards", towards, ("more", "less")) == "more"
        values = np.array([Parameter(name, kind).value(surface) for kind, name in parts])
        if what == parts[0][1]:
            what = Parameter(what, parts[0][0]).label
        if values.any():
            varied = tuple(part for part, value in zip(parts, values, strict=True) if value)
            return cls(what, varied, values[values != 0.0], more)
        if not more:
            raise OptionError(f"the {what} is 0, and cannot become less", what="towards", found=0.0)
        cables = [c for c in surface.cables if ("cable_weight", c.name) in parts]
        halves = [bool(surface.mirror_edge[surface.topology.edge_numbers(c.edges)].all()) for c in cables]
        if any(halves) and not all(halves):
            name = cables[halves.index(True)].name
            text = f"the {what} is 0, and of {name!r}, in a mirror plane, only a half is there; give weights,"
            raise OptionError(f"{text} or name one cable", what="what", where=name, found=0.0)
        return cls(what, parts, values, more, usual_size(surface, f"{parts[0][0]}s"))

    @property
    def direction(self) -> Direction:
        """The same as a direction of branches."""
        rates: dict[str, Any] = {}
        for (kind, name), value in zip(self.parts, self.values.tolist(), strict=True):
            rates.setdefault(f"{kind}s", {})[name] = value or self.unit
        return Direction(**rates)

    def at(self, factor: float) -> dict[str, float]:
        """The values at λ, by their labels."""
        labels = (Parameter(name, kind).label for kind, name in self.parts)
        return dict(zip(labels, ((self.values + self.unit) * factor).tolist(), strict=True))


def named(surface: Surface) -> Mapping[str, tuple[Part, ...]]:
    """All that a margin of a surface may vary, by name.

    Kinds alone mean all of a kind in proportion, the name of a patch or cable alone its tension.

    >>> from pcmc import Patch
    >>> tent = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 1]], [[0, 1, 2]], [0], [Patch("sail", 2.0)], fixed=[0])
    >>> [*named(tent)][:5], named(tent)["sail"]
    (['pressure', 'snow', 'weight', 'tension', 'pressure of sail'], (('tension', 'sail'),))
    """
    every = [patch.name for patch in surface.patches]
    sheets = [name for name, wall in zip(every, surface.walls, strict=True) if not wall]
    cables = [*dict.fromkeys(cable.name for cable in surface.cables)]
    owners = {"pressure": sheets, "snow": sheets, "weight": every, "tension": every, "cable": cables}
    owners |= {"cable_weight": cables, "volume": [room.name for room in surface.rooms]}
    listed = {kind: tuple((kind, name) for name in names) for kind, names in owners.items() if names}
    tensions = listed["tension"] + listed.get("cable", ())
    weights = listed["weight"] + listed.get("cable_weight", ())
    of = {part: Parameter(part[1], part[0]).value(surface) for part in (*tensions, *weights)}
    out = in_the_open(surface) | (surface.snows != 0.0)
    together = {
        "tension": tuple(part for part in tensions if of[part] > 0.0),
        "weight": tuple(part for part in weights if of[part] != 0.0),
        "snow": tuple(part for part in listed.get("snow", ()) if out[surface.patch_index(part[1])]),
    }
    single = {Parameter(name, kind).label: ((kind, name),) for kind, name in sum(listed.values(), ())}
    plain = {name: ((kind, name),) for kind, name in tensions[::-1]}
    return {**listed, **{kind: parts for kind, parts in together.items() if parts}, **single, **plain}
