"""A plan drawn in a CAD program: what its layers hold, joined and checked."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import PlanError
from ..base.tolerances import ON
from ..base.units import conversion_note, unlikely_size
from ..surface.curves import Curve, polyline
from ..surface.parts import listed
from ..surface.pieces import Piece, point_text, two_digits
from . import strokes as reading
from .lines import Kind, LineTree, PlanLine, check_line
from .parts import check_count, hole_label
from .paths import JoinedPath, join_strokes, meet_edges, meet_lines
from .strokes import Label, Layer, Stroke, Strokes, layer_of, left_out, read_strokes

GAP = 1e-3  # of the diagonal of the outline: gaps up to this are closed
MOST_GAP = 0.05  # of the diagonal: a wider gap is a part that is missing
LEAST_GAP = 1e-9  # of the diagonal: a thousandth of it, the grid that lines are cut on, is above rounding
ALONG = 2e-3  # of that diagonal: lines on an edge are compared with it at points so far apart


@dataclass(frozen=True, eq=False)
class Drawing:
    """A plan as it is drawn. Curves are plane, on Π, or in space."""

    path: Path
    unit: str  # the name of the drawing's unit, such as "mm"; "" if it has none
    units: str  # of the numbers here: that asked for, else the drawing's
    outline: Curve
    dividers: Mapping[str, Curve]
    holes: Mapping[str, Curve]
    supports: Sequence[Any]  # points (3,) and curves
    heights: Floats  # (h,3) points through which the roof should pass
    labels: Sequence[Label]  # of patches
    level: float  # the height of Π
    gap: float  # gaps up to this length are closed
    layers: Mapping[str, str]  # by line ("the outline", "divider 'north'"), its layer and entities
    upright: frozenset[str]  # the names of the dividers with an upright wall
    ridges: frozenset[str]  # the names of the dividers with a cable and no wall
    cables: Mapping[str, Curve]  # along free parts of the outline and of holes
    mirrors: Sequence[Curve]  # straight lines along the outline
    loose: bool  # whether supports on the outline hold it, and nothing between them
    notes: Sequence[str]  # what was changed and left out, a sentence each

    @property
    def flat(self) -> bool:
        """Whether the outline is on Π; holes may be above it."""
        return self.outline.pieces[0].points.shape[1] == 2


def read_drawing(path: Path, units: str = "", gap: float | None = None) -> Drawing:
    """The plan in a .dxf or .3dm drawing, in ``units``, such as "m", or in its own.

    ``gap``: gaps up to this length are closed; by default a thousandth of the outline's diagonal.
    FileError for a file that cannot be read, PlanError for a drawing that is no plan (``what`` is the layer,
    ``where`` the place), MissingExtra without the library that reads it.
    """
    content = read_strokes(path, units)
    try:
        return _Reader(content, units, gap).drawing(path)
    except PlanError as error:
        raise error.in_file(path) from None


class _Reader:
    """The strokes of a drawing by layer, and the parts of a plan that they make."""

    def __init__(self, content: Strokes, units: str, gap: float | None) -> None:
        self.content, self.units = content, units or content.unit
        self.by_layer: dict[str, list[Stroke]] = {}
        for stroke in content.strokes:
            self.by_layer.setdefault(stroke.layer, []).append(stroke)
        self.layers: dict[str, str] = {}
        self.notes: list[str] = []
        self.edge = [s for _, strokes in self.layers_of("outline") for s in strokes if s.curve is not None]
        if not self.edge:
            raise self._no_outline()
        points = np.concatenate([s.curve.at(s.curve.dense) for s in self.edge if s.curve is not None])
        self.size = float(np.linalg.norm(np.ptp(points, axis=0)))
        if gap is not None:
            hint = "leave it out, and draw what is missing"  # a wide one would swallow short lines
            validate.number("gap", gap, least=LEAST_GAP * self.size, most=MOST_GAP * self.size, hint=hint)
        self.gap = GAP * self.size if gap is None else gap
        self.level = float(points[0, 2]) if np.ptp(points[:, 2]) <= ON * self.size else 0.0

    def layers_of(self, role: str) -> list[tuple[Layer, list[Stroke]]]:
        parsed = [(layer_of(name), strokes) for name, strokes in self.by_layer.items()]
        return [(layer, strokes) for layer, strokes in parsed if layer is not None and layer.role == role]

    def _no_outline(self) -> PlanError:
        """The error of a drawing without an outline: what it has instead."""
        counts = {name: len(strokes) for name, strokes in self.by_layer.items()}
        others = sum(map(Counter, self.content.others.values()), Counter[str]())
        if not counts and others:
            only = listed([f"{count} {kind}" for kind, count in others.items()])
            text = f"has no lines, only {only}; draw those of the plan, the edge on a layer 'outline'"
        elif not counts:
            hidden = sum(self.content.hidden.values())
            shown = f"shows nothing: its {hidden} entities are on layers turned off" if hidden else "is empty"
            text = f"{shown}; draw the edge of the roof on a layer 'outline'"
        else:
            strange = {name: count for name, count in counts.items() if layer_of(name) is None}
            why = left_out(strange) if strange else f"all are on {listed(list(map(repr, counts)))}"
            why += "" if strange else "; draw the whole edge of the roof on 'outline', too"
            text = f"has no curve on a layer 'outline'; {why}"
        return PlanError(text, what="outline", found=counts, expected=reading.UNDERSTOOD)

    def drawing(self, path: Path) -> Drawing:
        loops = self._loops(self.edge)
        if len(loops) > 1:
            ends = ", ".join(f"{listed(loop.labels)} at {point_text(loop.ends[0])}" for loop in loops[:3])
            where = f"layer {loops[0].layer!r}"
            text = f"{where} has {len(loops)} closed curves ({ends}); a roof has one outline: put the edges"
            text += " of openings on a layer 'hole NAME', and draw another roof in its own file"
            raise PlanError(text, what=where, found=len(loops), expected=1)
        outline, self.layers["the outline"] = loops[0].curve, loops[0].source
        holes: dict[str, Curve] = {}
        self._add("hole", hole_label, "hole", holes, self._loops)
        check_count("holes", len(holes))
        drawn: list[Any] = []
        for _, strokes in self.layers_of("support"):
            drawn += [*_points(strokes), *(path.curve for path in self._joined(strokes))]
        masts = self._masts(holes)
        edges = [outline, *holes.values()]
        places, notes = meet_edges([*drawn, *masts], edges, self.gap)
        self.notes += notes
        dividers, cables = self._cables(edges)
        ridges = frozenset(dividers)
        self._add("divider", "divider {!r}".format, "wall", dividers)
        upright = frozenset(self._add("upright", "divider {!r}".format, "wall", dividers))
        check_count("dividers", len(dividers))
        dividers = self._moved(dividers, edges, "dividers")
        cables = self._moved(cables, edges, "cables")
        mirrors = self._moved(self._mirrors(), edges, "mirrors")
        lines = {"the outline": outline} | {hole_label(name): curve for name, curve in holes.items()}
        for name, curve in (lines | {f"divider {n!r}": curve for n, curve in dividers.items()}).items():
            try:  # a line that crosses itself, before what is inside it is looked for
                check_line(PlanLine(name, Kind.DIVIDER, curve))
            except PlanError as error:
                text = f"{error} ({self.layers[name]})"
                raise PlanError(text, what=name, where=error.where, found=error.found) from None
        loose = self._loose(outline, places[: len(drawn)], places[len(drawn) :], bool(cables))
        texts = [stroke for _, strokes in self.layers_of("height") for stroke in strokes]
        heights = reading.heights_of(texts, self.content.unit, self.units)
        labels = reading.labels_of(self.layers_of("patch"))
        self._note_rest(outline)
        parts: dict[str, Any] = {"outline": self._on_plane(outline), "upright": upright, "ridges": ridges}
        parts["dividers"] = {name: _projected(curve) for name, curve in dividers.items()}
        parts["cables"] = {name: _projected(curve) for name, curve in cables.items()}
        parts["mirrors"] = [_projected(curve) for curve in mirrors.values()]
        parts["holes"] = {name: self._on_plane(curve) for name, curve in holes.items()}
        parts["supports"] = [s if isinstance(s, np.ndarray) else self._on_plane(s) for s in places]
        parts |= {"heights": heights, "labels": labels, "layers": self.layers, "loose": loose}
        parts |= {"level": self.level, "gap": self.gap, "notes": tuple(self.notes)}
        return Drawing(path, self.content.unit, self.units, **parts)

    def _joined(self, strokes: Sequence[Stroke]) -> list[JoinedPath]:
        paths, notes = join_strokes(strokes, self.gap)
        self.notes += notes
        return paths

    def _loops(self, strokes: Sequence[Stroke]) -> list[JoinedPath]:
        """The closed curves of a layer; PlanError if one is open or forks."""
        paths = self._joined(strokes)
        where = f"layer {strokes[0].layer!r}"
        if not paths:
            raise PlanError(f"{where} has no curve; draw a closed one", what=where)
        open_paths = [path for path in paths if not path.curve.closed]
        if open_paths and len(open_paths) < len(paths):
            first, last = open_paths[0].ends
            text = f"{open_paths[0].source} from {point_text(first)} to {point_text(last)} is no part of the"
            text += " closed curve there; delete it, or put it on the layer of what it is"
            raise PlanError(text, what=where, where=_plain(first))
        for path in open_paths:
            for end, count in zip(path.ends, path.strokes_at_ends, strict=True):
                if count > 2:
                    text = f"{where}: {count} curves meet at {point_text(end)} ({listed(path.labels)});"
                    text += " a closed edge has two at each point"
                    raise PlanError(text, what=where, where=_plain(end))
        if open_paths:  # the smallest gap between two of the ends
            ends = [(path.labels[-k], point) for path in open_paths for k, point in enumerate(path.ends)]
            points = [point for _, point in ends]
            apart, nearest = (np.ravel(found) for found in cKDTree(points).query(points, k=[2]))
            place = int(np.argmin(apart))
            one, two = (ends[k] for k in sorted((place, int(nearest[place]))))
            between = f"between {one[0]} at {point_text(one[1])} and {two[0]} at {point_text(two[1])}"
            gap = float(apart[place])
            enough = two_digits(gap, math.ceil)
            allow = f", or close it: gap = {enough:g} in [plan], pcmc plan --gap {enough:g}"
            if enough > MOST_GAP * self.size:
                allow = "; edges on layers 'mirror', 'free' and 'cable' are drawn on 'outline', too"
            text = f"{where} is not closed: a gap of {gap:.3g} {between}; draw what is missing{allow}"
            raise PlanError(text, what=where, where=(_plain(one[1]), _plain(two[1])), found=gap)
        return paths

    def _add(
        self,
        role: str,
        label: Callable[[str], str],
        usual: str,
        curves: dict[str, Curve],
        paths_of: Callable[[Sequence[Stroke]], list[JoinedPath]] | None = None,
    ) -> list[str]:
        """Add the paths of a role's layers to ``curves`` by the layer's name, or numbered; the new names."""
        before = len(curves)
        for layer, strokes in self.layers_of(role):
            paths = (paths_of or self._joined)(strokes)
            own = [layer.name] if layer.name and len(paths) == 1 else []
            names = itertools.chain(own, (f"{layer.name or usual} {k}" for k in itertools.count(1)))
            for path in paths:
                name = next(name for name in names if name not in curves)
                curves[name], self.layers[label(name)] = path.curve, path.source
        return list(curves)[before:]

    def _masts(self, holes: dict[str, Curve]) -> list[Floats]:
        tops: list[Floats] = []

        def rings(strokes: Sequence[Stroke]) -> list[JoinedPath]:
            tops.extend(_points(strokes))
            paths = self._joined(strokes)
            for path in paths:
                if path.curve.closed:
                    continue
                foot, top = sorted(path.ends, key=lambda point: float(point[2]))
                if np.linalg.norm((top - foot)[:2]) > self.gap:
                    text = f"{path.source} from {point_text(foot)} to {point_text(top)} is neither vertical"
                    text += " nor a closed ring; draw a mast as a vertical line, or its top as a point"
                    raise PlanError(text, what=f"layer {path.layer!r}", where=_plain(foot))
                tops.append(top)
            return [path for path in paths if path.curve.closed]

        self._add("mast", hole_label, "mast", holes, rings)
        return tops

    def _cables(self, edges: Sequence[Curve]) -> tuple[dict[str, Curve], dict[str, Curve]]:
        """The cables across the roof and those along edges, by name; free edges have cables, too."""
        cables: dict[str, Curve] = {}
        self._add("cable", "cable {!r}".format, "cable", cables)
        free = self._add("free", "cable {!r}".format, "free", cables)
        check_count("cables", len(cables))
        tree = LineTree([PlanLine("an edge", Kind.OUTLINE, edge) for edge in edges])
        leaves = {n: tree.leaves(c, ALONG * self.size, self.gap) is not None for n, c in cables.items()}
        for name in free:
            if leaves[name]:
                where = self.layers[f"cable {name!r}"]
                text = f"{where} is on no edge of the outline or of a hole; draw it along one, or across the"
                raise PlanError(f"{text} roof on a layer 'cable NAME'", what=where)
        across = {name: cables.pop(name) for name, away in leaves.items() if away}
        self.layers |= {f"divider {name!r}": self.layers[f"cable {name!r}"] for name in across}
        return across, cables

    def _mirrors(self) -> dict[str, Curve]:
        """The straight lines of mirrors, numbered; those that go on in one direction are one."""
        mirrors = list[Floats]()
        for path in (path for _, strokes in self.layers_of("mirror") for path in self._joined(strokes)):
            begin = len(mirrors)
            for piece in path.curve.pieces:
                start, end = piece.at(np.array([0.0, 1.0]))
                if piece.sweep or len(piece.points) > 2:
                    text = f"{path.source} is not straight; a mirror is a straight edge of the outline"
                    raise PlanError(text, what=f"layer {path.layer!r}", where=_plain(start))
                if len(mirrors) > begin and polyline([mirrors[-1][0], start, end]).corners.size == 0:
                    start = mirrors.pop()[0]
                mirrors.append(np.stack([start, end]))
                self.layers[f"mirror {len(mirrors)}"] = path.source
        return {f"mirror {k}": polyline(ends) for k, ends in enumerate(mirrors, 1)}

    def _moved(self, curves: Mapping[str, Curve], edges: Sequence[Curve], what: str) -> dict[str, Curve]:
        """The curves with their ends moved over small gaps to the lines that they should reach."""
        moved, notes = meet_lines(curves, edges, self.gap, what)
        self.notes += notes
        return moved

    def _loose(self, outline: Curve, supports: Sequence[Any], masts: Sequence[Any], cables: bool) -> bool:
        """Whether masts and raised supports hold the outline, and nothing between them."""
        rim = PlanLine("the outline", Kind.OUTLINE, outline)

        def above(support: Any) -> float:
            """How far a support is above the outline; NaN away from it."""
            points = support.samples(ALONG * self.size) if isinstance(support, Curve) else support[None]
            t, away = rim.nearest(points[:, :2])
            steps = np.abs(points[:, 2] - outline.at(t)[:, 2]).max()
            return float(steps) if (away <= self.gap).all() else math.nan

        heights, tops = [above(support) for support in supports], [above(top) for top in masts]
        if not all(map(math.isnan, tops)) or np.nanmax([0.0, *heights]) > ON * self.size:
            return True
        if not cables and not all(map(math.isnan, heights)):
            self.notes.append(
                "all of the outline is held, and supports on it change nothing; draw what is not held on a"
                " layer 'free' or 'cable NAME', or the points that hold it on a layer 'mast'"
            )
        return False

    def _note_rest(self, outline: Curve) -> None:
        """Note layers that mean nothing here, entities of other kinds, hidden ones, and a doubtful unit."""
        strange = {name: len(s) for name, s in self.by_layer.items() if layer_of(name) is None}
        if strange:
            self.notes.append(left_out(strange))
        for layer, kinds in self.content.others.items():
            if layer_of(layer) is not None:
                counts = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
                self.notes.append(f"layer {layer!r}: no lines, left out: {counts}")
        hidden = [f"{name!r} ({n})" for name, n in self.content.hidden.items() if layer_of(name) is not None]
        if hidden:
            self.notes.append(f"hidden, left out: entities of the layers {', '.join(hidden)}")
        width = float(np.ptp(outline.at(outline.dense), axis=0)[:2].max())
        first = self.content.note or conversion_note(self.content.unit, self.units)
        last = unlikely_size(width, self.units, self.content.unit)
        self.notes = [*filter(None, [first, *self.notes, last])]

    def _on_plane(self, curve: Curve) -> Curve:
        """The curve as a plane one if all of it is at the level of Π."""
        heights = curve.at(curve.dense)[:, 2]
        return _projected(curve) if np.abs(heights - self.level).max() <= ON * self.size else curve


def _points(strokes: Sequence[Stroke]) -> list[Floats]:
    return [stroke.point for stroke in strokes if stroke.point is not None and not stroke.text]


def _projected(curve: Curve) -> Curve:
    """The curve's course in plan."""
    return replace(curve, pieces=tuple(Piece(p.points[:, :2], p.sweep, p.weights) for p in curve.pieces))


def _plain(point: Floats) -> tuple[float, ...]:
    return tuple(point.tolist())
