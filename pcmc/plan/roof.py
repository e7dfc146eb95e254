"""A roof given by the lines of its plan: outline, dividers, holes, patches, supports."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from ..base.errors import MissingExtra, OptionError, unknown
from ..surface import Plane, Surface
from .curves import Curve, curve
from .parts import BOTTOMS, EDGES, Area, Divider, Hole


@dataclass(frozen=True, eq=False)
class Plan:
    """A roof given by the lines of its plan.

    Attributes
    ----------
    outline : closed Curve or its plain data (see ``curves.curve``); it may leave Π, but its course
        in plan must not cross itself.
    dividers : Divider, or curves (walls of tension 1).
    holes : Hole, or curves (fixed).
    patches : Area for each part that the dividers cut the plan into, or a mapping from names to
        ``{"tension": …, "pressure": …, "at": …}``; without any, ``tension`` is every part's.
    edge_length : of the triangles, length.
    edge : what holds the outline: "fixed"; "sliding" on Π, which the roof then meets at a right angle;
        or "free" but for ``supports``. At a free edge the tension has nothing to pull against: for a
        roof on a few points draw the edges between them as curves in space (arches), and hold those.
    supports : points (2,) or (3,) and curves along which vertices are fixed. A curve on the outline
        or a hole holds that part of it; one inside a patch is held where it is drawn.
    plane : Π.
    rise : height of the initial surface above what the boundary spans, length; by default 0.3 of
        the radius of the largest circle clear of supports.
    tension : α of all patches, in place of ``patches``.

    Raises
    ------
    MissingExtra
        When ``surface`` is called without the library shapely.
    PlanError
        When ``surface`` is called: the lines do not divide the plan as they should; names the line.
    PlanWarning
        When ``surface`` is called: an edge is free.
    OptionError
        For a value that an attribute may not have.

    Examples
    --------
    >>> plan = Plan([[0, 0], [8, 0], [8, 4], [0, 4]], [[[4, 0], [4, 4]]], edge_length=0.5,
    ...             patches={"west": {"tension": 2.0}, "east": {"tension": 2.5}})
    >>> [p.name for p in plan.surface().patches]
    ['west', 'east', 'wall 1']
    """

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
            "outline": _curve(self.outline, "outline", closed=True),
            "dividers": tuple(_divider(d, k + 1) for k, d in enumerate(self.dividers)),
            "holes": tuple(_hole(h, k + 1) for k, h in enumerate(self.holes)),
            "patches": _areas(self.patches),
            "supports": tuple(_support(s, k + 1) for k, s in enumerate(self.supports)),
        }
        for key, value in parsed.items():
            object.__setattr__(self, key, value)
        _one_of(self.edge, EDGES, "outline: edge")
        _positive(self.edge_length, "edge_length")
        if self.rise is not None:
            _positive(self.rise, "rise")
        if not self.patches and self.tension is None:
            raise OptionError("a plan needs patches with tensions, or one tension= for all")
        if self.patches and self.tension is not None:
            raise OptionError(
                "a plan has patches, each with its tension, or one tension= for all; leave one of them out"
            )
        _unique(
            [w.name for w in self.dividers if w.wall is not None] + [a.name for a in self.patches]
        )

    def surface(self) -> Surface:
        """The mesh of the plan at its initial height, with its walls and supports."""
        try:
            from .drafting import surface  # needs shapely, which a plan by itself does not
        except ModuleNotFoundError as error:
            if error.name != "shapely":
                raise
            raise MissingExtra("shapely", "plan") from None
        return surface(self)


def plan_from(data: Mapping[str, Any]) -> Plan:
    """A Plan from plain data, such as a table of a project file; keys are Plan's attributes.

    >>> plan_from({"outline": [[0, 0], [4, 0], [0, 3]], "edge_length": 0.5, "tension": 2.0}).edge
    'fixed'
    """
    values = dict(data)
    _known_keys(values, Plan, "plan key")
    if "outline" not in values:
        raise OptionError("a plan needs an outline")
    if isinstance(values.get("plane"), Mapping):
        _known_keys(values["plane"], Plane, "plane key")
        values["plane"] = Plane(**values["plane"])
    return Plan(**values)


def _curve(spec: Any, what: str, closed: bool = False) -> Curve:
    try:
        return curve(spec, closed=closed)
    except OptionError as error:
        raise OptionError(f"{what}: {error}") from None


def _divider(spec: Any, number: int) -> Divider:
    what = f"divider {number}"
    made = _made(Divider, spec, what)
    _one_of(made.bottom, BOTTOMS, f"{what}: bottom")
    return Divider(_curve(made.curve, what), made.wall, made.name or f"wall {number}", made.bottom)


def _hole(spec: Any, number: int) -> Hole:
    what = f"hole {number}"
    made = _made(Hole, spec, what)
    _one_of(made.edge, EDGES, f"{what}: edge")
    name = f"hole {made.name!r}" if made.name else what
    return Hole(_curve(made.curve, what, closed=True), made.edge, name)


def _made(kind: Any, spec: Any, what: str) -> Any:
    """A Divider or Hole from itself, from a mapping of its attributes, or from a curve alone."""
    if isinstance(spec, kind):
        return spec
    if isinstance(spec, Mapping) and "curve" in spec:
        _known_keys(spec, kind, f"{what} key")
        return kind(**spec)
    return kind(spec)


def _areas(spec: Any) -> tuple[Area, ...]:
    if not isinstance(spec, Mapping):
        return tuple(spec)
    areas = []
    for name, values in spec.items():
        _known_keys(values, Area, f"patch {name!r} key")
        if "tension" not in values:
            raise OptionError(f"patch {name!r} needs a tension")
        areas.append(Area(name, **values))
    return tuple(areas)


def _support(spec: Any, number: int) -> Any:
    """A point (2,) or (3,), or a Curve."""
    if isinstance(spec, Sequence | np.ndarray) and len(spec) in (2, 3) and np.ndim(spec) == 1:
        point = np.array(spec, dtype=float)
        if not np.isfinite(point).all():
            raise OptionError(f"support {number}: the point {point.tolist()} is not finite")
        return point
    return _curve(spec, f"support {number}")


def _known_keys(values: Any, kind: Any, what: str) -> None:
    if not isinstance(values, Mapping):
        raise OptionError(f"{what}: expected a table, found {values!r}")
    known = [f.name for f in fields(kind)]
    for key in values:
        if key not in known:
            raise OptionError(unknown(what, key, known))


def _one_of(value: str, known: Sequence[str], what: str) -> None:
    if value not in known:
        raise OptionError(f"{what}: {unknown('value', value, known)}")


def _positive(value: float, what: str) -> None:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (number and math.isfinite(value) and value > 0):
        raise OptionError(f"{what} must be a finite number > 0, found {value!r}")


def _unique(names: Sequence[str]) -> None:
    for place, name in enumerate(names):
        if name in names[:place]:
            raise OptionError(f"the name {name!r} is used twice; patches and walls need their own")
