"""A plan drawn in a CAD program: what its layers hold, joined and checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Floats
from ..base.errors import PlanError
from ..base.units import conversion_note, length_factor, size_note
from ..curves.curves import Curve
from ..curves.pieces import Piece
from .drawn_parts import FLAT, DrawnParts
from .parts import hole_label
from .strokes import Stroke, read_strokes
from .texts import Label, heights_of, labels_of


@dataclass(frozen=True, eq=False)
class Drawing:
    """A plan as it is drawn. Curves are plane, on Π, or in space.

    Attributes
    ----------
    path : the file.
    unit : the name of the drawing's unit, such as "mm"; "" if it has none.
    units : the unit of the numbers here: that asked for, else the drawing's.
    outline : closed.
    dividers, holes : by name; ``upright`` are the names of those with an upright wall,
        ``ridges`` of those with a cable and no wall.
    cables : along free parts of the outline and of holes, by name.
    mirrors : straight lines along the outline.
    loose : whether supports on the outline hold it, and nothing between them.
    supports : points (3,) and curves.
    heights : (h,3) points through which the roof should pass.
    labels : of patches.
    level : the height of Π.
    gap : gaps up to this length are closed.
    layers : by line ("the outline", "divider 'north'"), its layer and entities.
    notes : what was changed and left out, a sentence each.
    """

    path: Path
    unit: str
    units: str
    outline: Curve
    dividers: Mapping[str, Curve]
    holes: Mapping[str, Curve]
    supports: Sequence[Any]
    heights: Floats
    labels: Sequence[Label]
    level: float
    gap: float
    layers: Mapping[str, str]
    upright: frozenset[str] = frozenset()
    ridges: frozenset[str] = frozenset()
    cables: Mapping[str, Curve] = field(default_factory=dict)
    mirrors: Sequence[Curve] = ()
    loose: bool = False
    notes: Sequence[str] = field(default=())

    @property
    def flat(self) -> bool:
        """Whether the outline is on Π; holes may be above it."""
        return self.outline.pieces[0].points.shape[1] == 2


def read_drawing(path: Path, units: str = "", gap: float | None = None) -> Drawing:
    """The plan in a .dxf or .3dm drawing.

    Parameters
    ----------
    path : the file.
    units : the unit of length wanted, such as "m"; "" for the drawing's own.
    gap : gaps between ends up to this length are closed, in the unit wanted; by default a thousandth of the
        outline's diagonal.

    Raises
    ------
    FileError : for a file that cannot be read.
    PlanError : for a drawing that is no plan; ``what`` is the layer, ``where`` the place.
    MissingExtra : without the library that reads it.
    """
    content = read_strokes(path)
    factor = length_factor(content.unit, units)
    strokes = [_scaled(stroke, factor) for stroke in content.strokes]
    try:
        return _drawing(DrawnParts(path, content, strokes, units or content.unit, gap), factor)
    except PlanError as error:
        raise error.in_file(path) from None


def _scaled(stroke: Stroke, factor: float) -> Stroke:
    if stroke.curve is None:
        return replace(stroke, point=factor * np.asarray(stroke.point))
    pieces = (replace(piece, points=factor * piece.points) for piece in stroke.curve.pieces)
    return replace(stroke, curve=Curve(tuple(pieces)))


def _drawing(parts: DrawnParts, factor: float) -> Drawing:
    """All parts, each checked."""
    outline = parts.outline()
    holes = parts.loops()
    supports = parts.supports()
    masts = parts.masts(holes)
    edges = [outline, *holes.values()]
    places = parts.settled([*supports, *masts], edges)
    supports, masts = places[: len(supports)], places[len(supports) :]
    lines, loose_edges = parts.cables(edges)
    dividers = parts.dividers(edges, lines)
    cables = parts.moved(loose_edges, edges, "cables")
    mirrors = parts.moved(parts.mirrors(), edges, "mirrors")
    parts.check(
        {"the outline": outline}
        | {hole_label(name): curve for name, curve in holes.items()}
        | {f"divider {name!r}": curve for name, curve in dividers.items()}
    )
    loose = parts.loose(outline, supports, masts, bool(cables))
    heights = heights_of(parts.strokes_of("height"), parts.content.unit, parts.units)
    labels = labels_of(parts.layers_of("patch"))
    parts.note_rest()
    width = float(np.ptp(outline.at(outline.dense), axis=0)[:2].max())
    if note := size_note(width, parts.units, parts.content.unit):
        parts.notes.append(note)
    if note := parts.content.note or conversion_note(parts.content.unit, parts.units):
        parts.notes.insert(0, note)
    return Drawing(
        parts.path,
        parts.content.unit,
        parts.units,
        _on_plane(parts, outline),
        {name: _projected(curve) for name, curve in dividers.items()},
        {name: _on_plane(parts, curve) for name, curve in holes.items()},
        [s if isinstance(s, np.ndarray) else _on_plane(parts, s) for s in (*supports, *masts)],
        heights,
        labels,
        parts.level,
        parts.gap,
        parts.layers,
        frozenset(parts.uprights),
        frozenset(lines),
        {name: _projected(curve) for name, curve in cables.items()},
        [_projected(curve) for curve in mirrors.values()],
        loose,
        tuple(parts.notes),
    )


def _on_plane(parts: DrawnParts, curve: Curve) -> Curve:
    """The curve as a plane one if all of it is at the level of Π."""
    heights = curve.at(curve.dense)[:, 2]
    return _projected(curve) if np.abs(heights - parts.level).max() <= FLAT * parts.size else curve


def _projected(curve: Curve) -> Curve:
    """The curve's course in plan."""
    return replace(curve, pieces=tuple(Piece(p.points[:, :2], p.sweep, p.weights) for p in curve.pieces))
