"""A plan drawn in a CAD program: what its layers hold, joined and checked."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import PlanError
from ..base.units import conversion_note, length_factor, size_note
from .curves import Curve
from .layers import Layer, layer_of, left_out, listed, understood
from .paths import JoinedPath, join_strokes
from .pieces import Piece
from .strokes import Stroke, Strokes, read_strokes
from .texts import Label, heights_of, labels_of, point_text

GAP = 1e-3  # of the diagonal of the outline: gaps up to this are closed
FLAT = 1e-9  # of that diagonal: heights nearer to each other than this are one


@dataclass(frozen=True, eq=False)
class Drawing:
    """A plan as it is drawn. Curves are plane, on Π, or in space.

    Attributes
    ----------
    path : the file.
    unit : the name of the drawing's unit, such as "mm"; "" if it has none.
    units : the unit of the numbers here: that asked for, else the drawing's.
    outline : closed.
    dividers, holes : by name.
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
        return _Sorted(path, content, strokes, units or content.unit, gap).drawing(factor)
    except PlanError as error:
        raise error.in_file(path) from None


def _scaled(stroke: Stroke, factor: float) -> Stroke:
    if stroke.curve is None:
        return replace(stroke, point=factor * np.asarray(stroke.point))
    pieces = (replace(piece, points=factor * piece.points) for piece in stroke.curve.pieces)
    return replace(stroke, curve=Curve(tuple(pieces)))


class _Sorted:
    """The strokes of a drawing by what their layers mean, on the way to a Drawing."""

    def __init__(
        self, path: Path, content: Strokes, strokes: Sequence[Stroke], units: str, gap: float | None
    ) -> None:
        self.path, self.content, self.units = path, content, units
        self.by_layer: dict[str, list[Stroke]] = {}
        for stroke in strokes:
            self.by_layer.setdefault(stroke.layer, []).append(stroke)
        self.layers: dict[str, str] = {}
        self.notes: list[str] = []
        outline = [s.curve for s in self.strokes_of("outline") if s.curve is not None]
        if not outline:
            raise self._no_outline()
        points = np.concatenate([curve.at(curve.dense) for curve in outline])
        self.size = float(np.linalg.norm(np.ptp(points, axis=0)))
        if gap is not None:
            validate.positive("gap", gap)
        self.gap = GAP * self.size if gap is None else gap
        self.level = float(points[0, 2]) if np.ptp(points[:, 2]) <= FLAT * self.size else 0.0

    def strokes_of(self, role: str) -> list[Stroke]:
        """All strokes of the layers of a role."""
        return [stroke for _, strokes in self.layers_of(role) for stroke in strokes]

    def layers_of(self, role: str) -> list[tuple[Layer, list[Stroke]]]:
        """The layers of a role with their strokes."""
        parsed = [(layer_of(name), strokes) for name, strokes in self.by_layer.items()]
        return [(layer, strokes) for layer, strokes in parsed if layer is not None and layer.role == role]

    def _no_outline(self) -> PlanError:
        """The error of a drawing without an outline: what it has instead."""
        counts = {name: len(strokes) for name, strokes in self.by_layer.items()}
        solid = sum(kinds.get("3-D faces", 0) for kinds in self.content.others.values())
        if not counts and solid:
            text = f"has only 3-D faces ({solid}); draw the lines of the plan, the edge on a layer 'outline'"
        elif not counts:
            hidden = sum(self.content.hidden.values())
            text = (
                "is empty" if not hidden else f"shows nothing: its {hidden} entities are on layers turned off"
            )
            text += "; draw the edge of the roof on a layer 'outline'"
        else:
            strange = {name: count for name, count in counts.items() if layer_of(name) is None}
            why = left_out(strange) if strange else f"all are on {listed(list(map(repr, counts)))}"
            text = f"has no curve on a layer 'outline'; {why}"
        return PlanError(text, what="outline", found=counts, expected=understood())

    def drawing(self, factor: float) -> Drawing:
        """All parts, each checked."""
        outline = self._outline()
        holes = self._loops("hole")
        supports = self._supports()
        masts = self._masts(holes)
        dividers = self._dividers([outline, *holes.values()])
        heights = heights_of(self.strokes_of("height"), self.content.unit, self.units)
        labels = labels_of(self.layers_of("patch"))
        self._note_rest()
        width = float(np.ptp(outline.at(outline.dense), axis=0)[:2].max())
        if note := size_note(width, self.units, self.content.unit):
            self.notes.append(note)
        if note := self.content.note or conversion_note(self.content.unit, self.units):
            self.notes.insert(0, note)
        return Drawing(
            self.path,
            self.content.unit,
            self.units,
            self._on_plane(outline),
            {name: _projected(curve) for name, curve in dividers.items()},
            {name: self._on_plane(curve) for name, curve in holes.items()},
            [s if isinstance(s, np.ndarray) else self._on_plane(s) for s in (*supports, *masts)],
            heights,
            labels,
            self.level,
            self.gap,
            self.layers,
            tuple(self.notes),
        )

    def _on_plane(self, curve: Curve) -> Curve:
        """The curve as a plane one if all of it is at the level of Π."""
        heights = curve.at(curve.dense)[:, 2]
        return _projected(curve) if np.abs(heights - self.level).max() <= FLAT * self.size else curve

    def _joined(self, layer: Layer, strokes: Sequence[Stroke]) -> list[JoinedPath]:
        """The paths of a layer; what was changed is noted."""
        drawn = [stroke for stroke in strokes if stroke.curve is not None]
        if not drawn:
            return []
        joined = join_strokes(drawn, self.gap)
        where = f"layer {drawn[0].layer!r}"
        if joined.closed_gaps:
            number = f"{joined.closed_gaps} gap{'s' if joined.closed_gaps > 1 else ''}"
            largest = f"up to {joined.largest_gap:.3g} long (closed are gaps up to {self.gap:.3g})"
            self.notes.append(f"{where}: {number} closed, {largest}")
        if joined.doubles:
            self.notes.append(f"{where}: drawn twice or without length, left out: {listed(joined.doubles)}")
        return list(joined.paths)

    def _closed(self, layer: Layer, strokes: Sequence[Stroke]) -> list[JoinedPath]:
        """The loops of a layer; PlanError if one is open or forks."""
        paths = self._joined(layer, strokes)
        where = f"layer {strokes[0].layer!r}"
        if not paths:
            raise PlanError(f"{where} has no curve; draw a closed one", what=where)
        open_paths = [path for path in paths if not path.curve.closed]
        if open_paths and len(open_paths) < len(paths):
            stray = open_paths[0]
            ends = f"from {point_text(stray.ends[0])} to {point_text(stray.ends[1])}"
            text = f"{where}: {listed(stray.labels)} {ends} is no part of the closed curve there; delete it,"
            text += " or put it on the layer of what it is"
            raise PlanError(text, what=where, where=_plain(stray.ends[0]))
        for path in open_paths:
            for end, count in zip(path.ends, path.strokes_at_ends, strict=True):
                if count > 2:
                    text = (
                        f"{where}: {count} curves meet at {point_text(end)} ({listed(path.labels)}); a closed"
                    )
                    raise PlanError(f"{text} edge has two at each point", what=where, where=_plain(end))
        if open_paths:
            raise self._gap_error(where, open_paths)
        return paths

    def _gap_error(self, where: str, paths: Sequence[JoinedPath]) -> PlanError:
        """The error for an open loop: the smallest gap between two of its ends."""
        ends = [(path, k, point) for path in paths for k, point in enumerate(path.ends)]
        points = np.array([point for *_, point in ends])
        apart, nearest = cKDTree(points).query(points, k=[2])
        first = int(np.argmin(apart))
        one, two = (ends[k] for k in sorted((first, int(nearest[first, 0]))))
        gap = float(apart[first, 0])
        first, second = (end[0].labels[-1 if end[1] else 0] for end in (one, two))
        between = f"between {first} at {point_text(one[2])} and {second} at {point_text(two[2])}"
        allow = f"draw what is missing, or close it with gap = {_upwards(gap):g}"
        text = f"{where} is not closed: a gap of {gap:.3g} {between}; {allow}"
        return PlanError(text, what=where, where=(_plain(one[2]), _plain(two[2])), found=gap)

    def _outline(self) -> Curve:
        layers = self.layers_of("outline")
        strokes = [stroke for _, of_layer in layers for stroke in of_layer if stroke.curve is not None]
        paths = self._closed(layers[0][0], strokes)
        if len(paths) > 1:
            ends = ", ".join(f"{listed(path.labels)} at {point_text(path.ends[0])}" for path in paths[:3])
            text = (
                f"layer {strokes[0].layer!r} has {len(paths)} closed curves ({ends}); a roof has one outline"
            )
            text += ": put the edges of openings on a layer 'hole NAME'"
            raise PlanError(text, what=f"layer {strokes[0].layer!r}", found=len(paths), expected=1)
        self.layers["the outline"] = f"layer {strokes[0].layer!r}: {listed(paths[0].labels)}"
        return paths[0].curve

    def _loops(self, role: str) -> dict[str, Curve]:
        """The closed curves of a role's layers, by name."""
        loops: dict[str, Curve] = {}
        for layer, strokes in self.layers_of(role):
            paths = self._closed(layer, strokes)
            for name, path in zip(_names(layer, role, len(paths), loops), paths, strict=True):
                loops[name] = path.curve
                self.layers[f"{role} {name!r}"] = f"layer {strokes[0].layer!r}: {listed(path.labels)}"
        return loops

    def _dividers(self, edges: Sequence[Curve]) -> dict[str, Curve]:
        """The dividers by name, their ends extended over small gaps to the lines that they should reach."""
        dividers: dict[str, Curve] = {}
        for layer, strokes in self.layers_of("divider"):
            paths = self._joined(layer, strokes)
            for name, path in zip(_names(layer, "wall", len(paths), dividers), paths, strict=True):
                dividers[name] = path.curve
                self.layers[f"divider {name!r}"] = f"layer {strokes[0].layer!r}: {listed(path.labels)}"
        from .extending import extended  # needs shapely

        longer, note = extended(dividers, edges, self.gap)
        self.notes += [note] if note else []
        return longer

    def _supports(self) -> list[Any]:
        supports: list[Any] = []
        for layer, strokes in self.layers_of("support"):
            supports += [stroke.point for stroke in strokes if stroke.point is not None and not stroke.text]
            supports += [path.curve for path in self._joined(layer, strokes)]
        return supports

    def _masts(self, holes: dict[str, Curve]) -> list[Any]:
        """The tops of masts; rings are added to the holes."""
        tops: list[Any] = []
        for layer, strokes in self.layers_of("mast"):
            tops += [stroke.point for stroke in strokes if stroke.point is not None and not stroke.text]
            paths = self._joined(layer, strokes)
            rings = [path for path in paths if path.curve.closed]
            for name, path in zip(_names(layer, "mast", len(rings), holes), rings, strict=True):
                holes[name] = path.curve
                self.layers[f"hole {name!r}"] = f"layer {strokes[0].layer!r}: {listed(path.labels)}"
            for path in paths:
                if path.curve.closed:
                    continue
                foot, top = sorted(path.ends, key=lambda point: float(point[2]))
                if np.linalg.norm((top - foot)[:2]) > self.gap:
                    where = f"layer {strokes[0].layer!r}"
                    text = f"{where}: {listed(path.labels)} from {point_text(foot)} to {point_text(top)} is neither"
                    text += (
                        " vertical nor a closed ring; draw a mast as a vertical line, or its top as a point"
                    )
                    raise PlanError(text, what=where, where=_plain(foot))
                tops.append(top)
        if tops:
            text = "a roof held at a point has a peak there as thin as the triangles, which comes to rest on"
            text += (
                " some meshes and not on others; draw a mast's top as a ring, and the roof is the same on all"
            )
            self.notes.append(f"layer 'mast': {text}")
        return tops

    def _note_rest(self) -> None:
        """Note layers that mean nothing here, entities of other kinds, and hidden ones."""
        strange = {name: len(s) for name, s in self.by_layer.items() if layer_of(name) is None}
        if strange:
            self.notes.append(left_out(strange))
        for layer, kinds in self.content.others.items():
            if layer_of(layer) is not None:
                listed_kinds = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
                self.notes.append(f"layer {layer!r}: no lines, left out: {listed_kinds}")
        hidden = {name: n for name, n in self.content.hidden.items() if layer_of(name) is not None}
        if hidden:
            names = ", ".join(f"{name!r} ({n})" for name, n in hidden.items())
            self.notes.append(f"hidden, left out: entities of the layers {names}")


def _names(layer: Layer, role: str, count: int, taken: Mapping[str, object]) -> list[str]:
    """Names for the curves of a layer: its own, numbered if there are several."""
    if layer.name and count == 1 and layer.name not in taken:
        return [layer.name]
    names: list[str] = []
    number = 1
    while len(names) < count:
        name = f"{layer.name or role} {number}"
        names += [] if name in taken else [name]
        number += 1
    return names


def _projected(curve: Curve) -> Curve:
    """The curve's course in plan."""
    return replace(curve, pieces=tuple(Piece(p.points[:, :2], p.sweep, p.weights) for p in curve.pieces))


def _plain(point: Floats) -> tuple[float, ...]:
    """A point as plain numbers."""
    return tuple(point.tolist())


def _upwards(length: float) -> float:
    """The length rounded up to two digits."""
    step = 10.0 ** (math.floor(math.log10(length)) - 1)
    return math.ceil(length / step + 1e-9) * step
