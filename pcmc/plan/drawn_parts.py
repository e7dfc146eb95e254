"""The parts of a plan that the layers of a drawing hold, joined and checked."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import PlanError
from ..curves.curves import Curve, polyline
from ..curves.pieces import point_text, two_digits
from .layers import Layer, layer_of, left_out, listed, understood
from .parts import check_count, hole_label
from .paths import JoinedPath, join_strokes
from .strokes import Stroke, Strokes

GAP = 1e-3  # of the diagonal of the outline: gaps up to this are closed
LEAST_GAP = 1e-9  # of the diagonal: a thousandth of it, the grid that lines are cut on, is above rounding
ALONG = 2e-3  # of that diagonal: lines on an edge are compared with it at points so far apart
FLAT = 1e-9  # of that diagonal: heights nearer to each other than this are one


class DrawnParts:
    """The strokes of a drawing by what their layers mean, and the parts of a plan that they make."""

    def __init__(
        self, path: Path, content: Strokes, strokes: Sequence[Stroke], units: str, gap: float | None
    ) -> None:
        self.path, self.content, self.units = path, content, units
        self.by_layer: dict[str, list[Stroke]] = {}
        for stroke in strokes:
            self.by_layer.setdefault(stroke.layer, []).append(stroke)
        self.layers: dict[str, str] = {}
        self.uprights: list[str] = []
        self.notes: list[str] = []
        outline = [s.curve for s in self.strokes_of("outline") if s.curve is not None]
        if not outline:
            raise self._no_outline()
        points = np.concatenate([curve.at(curve.dense) for curve in outline])
        self.size = float(np.linalg.norm(np.ptp(points, axis=0)))
        if gap is not None:
            validate.number("gap", gap, least=LEAST_GAP * self.size, hint="or leave it out")
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
        apart, nearest = (np.ravel(found) for found in cKDTree(points).query(points, k=[2]))
        place = int(np.argmin(apart))
        one, two = (ends[k] for k in sorted((place, int(nearest[place]))))
        gap = float(apart[place])
        first, second = (end[0].labels[-1 if end[1] else 0] for end in (one, two))
        between = f"between {first} at {point_text(one[2])} and {second} at {point_text(two[2])}"
        allow = f"draw what is missing, or close it with gap = {two_digits(gap):g}"
        text = f"{where} is not closed: a gap of {gap:.3g} {between}; {allow}"
        return PlanError(text, what=where, where=(_plain(one[2]), _plain(two[2])), found=gap)

    def outline(self) -> Curve:
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

    def loops(self) -> dict[str, Curve]:
        """The closed curves of the layers "hole", by name."""
        loops: dict[str, Curve] = {}
        for layer, strokes in self.layers_of("hole"):
            paths = self._closed(layer, strokes)
            for name, path in zip(_names(layer, "hole", len(paths), loops), paths, strict=True):
                loops[name] = path.curve
                self.layers[hole_label(name)] = f"layer {strokes[0].layer!r}: {listed(path.labels)}"
        check_count("holes", len(loops))
        return loops

    def _named(self, role: str, what: str, usual: str, curves: dict[str, Curve]) -> list[str]:
        """Add the paths of a role's layers to ``curves``, by name; the new names."""
        new = []
        for layer, strokes in self.layers_of(role):
            paths = self._joined(layer, strokes)
            for name, path in zip(_names(layer, usual, len(paths), curves), paths, strict=True):
                curves[name] = path.curve
                new.append(name)
                self.layers[f"{what} {name!r}"] = f"layer {strokes[0].layer!r}: {listed(path.labels)}"
        check_count(f"{what}s", len(curves))
        return new

    def moved(self, curves: Mapping[str, Curve], edges: Sequence[Curve], what: str) -> dict[str, Curve]:
        """The curves with their ends moved over small gaps to the lines that they should reach."""
        from .extending import extended  # needs shapely

        longer, note = extended(curves, edges, self.gap, what)
        self.notes += [note] if note else []
        return longer

    def settled(self, supports: Sequence[Any], edges: Sequence[Curve]) -> list[Any]:
        """The supports moved over small gaps to the edges that they just miss."""
        from .extending import settled  # needs shapely

        places, note = settled(supports, edges, self.gap)
        self.notes += [note] if note else []
        return places

    def dividers(self, edges: Sequence[Curve], ridges: Mapping[str, Curve]) -> dict[str, Curve]:
        """The dividers by name, upright ones and cables across the roof among them."""
        dividers = dict(ridges)
        self._named("divider", "divider", "wall", dividers)
        self.uprights = self._named("upright", "divider", "wall", dividers)
        return self.moved(dividers, edges, "dividers")

    def cables(self, edges: Sequence[Curve]) -> tuple[dict[str, Curve], dict[str, Curve]]:
        """The cables across the roof and those along edges, by name; free edges have cables, too."""
        from .lines import Kind, Line, LineTree  # needs shapely

        cables: dict[str, Curve] = {}
        self._named("cable", "cable", "cable", cables)
        free = self._named("free", "cable", "free", cables)
        tree = LineTree([Line("an edge", Kind.OUTLINE, edge) for edge in edges])
        along = {
            name: all(tree.at(curve.samples(ALONG * self.size)[:, :2], self.gap))
            for name, curve in cables.items()
        }
        for name in free:
            if not along[name]:
                where = self.layers[f"cable {name!r}"]
                text = f"{where} is on no edge of the outline or of a hole; draw it along one, or across the"
                raise PlanError(f"{text} roof on a layer 'cable NAME'", what=where)
        across = {name: curve for name, curve in cables.items() if not along[name]}
        self.layers |= {f"divider {name!r}": self.layers[f"cable {name!r}"] for name in across}
        return across, {name: curve for name, curve in cables.items() if along[name]}

    def mirrors(self) -> dict[str, Curve]:
        """The straight lines of mirrors, numbered; those that go on in one direction are one."""
        mirrors: list[Floats] = []
        for layer, strokes in self.layers_of("mirror"):
            for path in self._joined(layer, strokes):
                begin = len(mirrors)
                for piece in path.curve.pieces:
                    start, end = piece.at(np.array([0.0, 1.0]))
                    if piece.sweep or len(piece.points) > 2:
                        where = f"layer {strokes[0].layer!r}"
                        text = f"{where}: {listed(path.labels)} is not straight; a mirror is a straight edge"
                        raise PlanError(f"{text} of the outline", what=where, where=_plain(start))
                    if len(mirrors) > begin and polyline([mirrors[-1][0], start, end]).corners.size == 0:
                        mirrors[-1] = np.stack([mirrors[-1][0], end])
                    else:
                        mirrors.append(np.stack([start, end]))
                    self.layers[f"mirror {len(mirrors)}"] = (
                        f"layer {strokes[0].layer!r}: {listed(path.labels)}"
                    )
        return {f"mirror {k}": polyline(ends) for k, ends in enumerate(mirrors, 1)}

    def check(self, curves: Mapping[str, Curve]) -> None:
        """Refuse a line that crosses itself, before what is inside it is looked for."""
        from .lines import Kind, Line, check_line  # needs shapely

        for name, curve in curves.items():
            try:
                check_line(Line(name, Kind.DIVIDER, curve))
            except PlanError as error:
                text = f"{error} ({self.layers[name]})"
                raise PlanError(text, what=name, where=error.where, found=error.found) from None

    def loose(self, outline: Curve, supports: Sequence[Any], masts: Sequence[Any], cables: bool) -> bool:
        """Whether masts and raised supports hold the outline, and nothing between them."""
        from .lines import Kind, Line  # needs shapely

        rim = Line("the outline", Kind.OUTLINE, outline)

        def above(support: Any) -> float:
            """How far a support is above the outline; NaN away from it."""
            points = support.samples(ALONG * self.size) if isinstance(support, Curve) else support[None]
            t, away = rim.nearest(points[:, :2])
            steps = np.abs(points[:, 2] - outline.at(t)[:, 2]).max()
            return float(steps) if (away <= self.gap).all() else math.nan

        heights = [above(support) for support in supports]
        tops = [above(top) for top in masts]
        if any(map(math.isnan, tops)):
            text = "a roof held at a point has a peak there as thin as the triangles, which comes to rest on"
            text += " some meshes and not on others; draw a mast's top as a ring, and the roof is the same on"
            self.notes.append(f"layer 'mast': {text} all")
        if not all(map(math.isnan, tops)) or np.nanmax([0.0, *heights]) > FLAT * self.size:
            return True
        if not cables and not all(map(math.isnan, heights)):
            self.notes.append(
                "all of the outline is held, and supports on it change nothing; draw what is not held on a"
                " layer 'free' or 'cable NAME', or the points that hold it on a layer 'mast'"
            )
        return False

    def supports(self) -> list[Any]:
        supports: list[Any] = []
        for layer, strokes in self.layers_of("support"):
            supports += [stroke.point for stroke in strokes if stroke.point is not None and not stroke.text]
            supports += [path.curve for path in self._joined(layer, strokes)]
        return supports

    def masts(self, holes: dict[str, Curve]) -> list[Any]:
        """The tops of masts; rings are added to the holes."""
        tops: list[Any] = []
        for layer, strokes in self.layers_of("mast"):
            tops += [stroke.point for stroke in strokes if stroke.point is not None and not stroke.text]
            paths = self._joined(layer, strokes)
            rings = [path for path in paths if path.curve.closed]
            for name, path in zip(_names(layer, "mast", len(rings), holes), rings, strict=True):
                holes[name] = path.curve
                self.layers[hole_label(name)] = f"layer {strokes[0].layer!r}: {listed(path.labels)}"
            for path in paths:
                if path.curve.closed:
                    continue
                foot, top = sorted(path.ends, key=lambda point: float(point[2]))
                if np.linalg.norm((top - foot)[:2]) > self.gap:
                    where = f"layer {strokes[0].layer!r}"
                    text = f"{where}: {listed(path.labels)} from {point_text(foot)} to {point_text(top)} is"
                    text += " neither vertical nor a closed ring; draw a mast as a vertical line, or its top"
                    text += " as a point"
                    raise PlanError(text, what=where, where=_plain(foot))
                tops.append(top)
        return tops

    def note_rest(self) -> None:
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


def _plain(point: Floats) -> tuple[float, ...]:
    """A point as plain numbers."""
    return tuple(point.tolist())
