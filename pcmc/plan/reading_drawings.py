"""The part of the reading process that reads drawings: entities of a .dxf or .3dm as plain values.

``base.libraries`` loads this file by its path, so it imports nothing of pcmc. Every reader returns a dict
with the ``unit`` as the format names it, the ``entities``, and the counts of ``others``, by layer and kind,
and of ``hidden`` ones, by layer. An entity has its ``layer``, ``kind`` and ``handle``, and one of:
``pieces``, the smooth pieces of a curve in order; ``point``; ``text`` with its ``point``. A piece is
("bezier", points (k,3)); ("arc", [centre, vector to its start, vector a quarter turn on], sweep in radians);
("nurbs", degree, knots, points, weights).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

MOST_ENTITIES = 20_000  # of a drawing, with those of its blocks
MOST_POINTS = 200_000  # of all its curves
ROUND = 1e-10  # of its size: a NURBS curve this near to an arc is one
DEPTH = 8  # of blocks in blocks
SOLID = ("3DFACE", "MESH", "3DSOLID", "BODY", "REGION", "SURFACE", "SOLID", "PLANESURFACE", "polyface")


class Contents:
    """The entities of a drawing; refuses more than the limits."""

    def __init__(self, unit: int | str) -> None:
        self.points = 0
        self.entities: list[dict[str, Any]] = []
        self.others: dict[str, dict[str, int]] = {}
        self.hidden: dict[str, int] = {}
        self.values = {"unit": unit, "entities": self.entities, "others": self.others, "hidden": self.hidden}

    def add(self, layer: str, kind: str, handle: str, **held: Any) -> None:
        """An entity that a plan may use."""
        self.points += sum(len(piece[3 if piece[0] == "nurbs" else 1]) for piece in held.get("pieces", ()))
        if len(self.entities) >= MOST_ENTITIES:
            raise RuntimeError(f"more than {MOST_ENTITIES} entities; export the roof's layers alone")
        if self.points > MOST_POINTS:
            problem = f"its curves have more than {MOST_POINTS} points"
            raise RuntimeError(f"{problem}; export the roof's layers alone")
        self.entities.append({"layer": layer, "kind": kind, "handle": handle, **held})

    def leave_out(self, layer: str, kind: str) -> None:
        """An entity of a kind that no plan uses."""
        kinds = self.others.setdefault(layer, {})
        kinds[kind] = kinds.get(kind, 0) + 1

    def hide(self, layer: str) -> None:
        """An entity that its layer's state or its own hides."""
        self.hidden[layer] = self.hidden.get(layer, 0) + 1


def dxf_entities(path: str) -> dict[str, Any]:
    """The entities of a .dxf in model space, those of blocks in their places. Broken files are recovered."""
    import ezdxf
    from ezdxf import recover

    try:
        document = ezdxf.readfile(path)
    except (ezdxf.DXFError, UnicodeDecodeError, ValueError, KeyError, IndexError, AttributeError, TypeError):
        document, _ = recover.readfile(path)
    contents = Contents(int(document.header.get("$INSUNITS", 0)))
    unseen = {layer.dxf.name.lower() for layer in document.layers if layer.is_off() or layer.is_frozen()}
    for layer, entity in _with_blocks(document.modelspace(), None, 0):
        if layer.lower() in unseen or entity.dxf.get("invisible", 0) or getattr(entity, "is_invisible", 0):
            contents.hide(layer)
            continue
        kind, handle = entity.dxftype(), str(entity.dxf.get("handle") or "in a block")
        if kind == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline):
            kind = "polyface"
        if kind == "POINT":
            contents.add(layer, kind, handle, point=tuple(entity.dxf.location))
        elif kind in ("TEXT", "MTEXT", "ATTRIB"):
            place = entity.dxf.insert if kind == "MTEXT" else entity.get_placement()[1]
            contents.add(layer, kind, handle, point=tuple(place), text=entity.plain_text())
        elif (pieces := _dxf_pieces(kind, entity)) is not None:
            contents.add(layer, kind, handle, pieces=pieces)
        else:
            contents.leave_out(layer, "3-D faces" if kind in SOLID else kind)
    return contents.values


def _with_blocks(entities: Any, layer: str | None, depth: int) -> Iterator[tuple[str, Any]]:
    """Entities with their layers; in blocks, layer 0 stands for that of the block's reference."""
    for entity in entities:
        own = entity.dxf.get("layer", "0")
        own = layer if layer is not None and own == "0" else own
        if entity.dxftype() == "INSERT" and depth < DEPTH:
            if entity.mcount > 1000:
                raise RuntimeError(f"block reference {entity.dxf.handle} repeats {entity.mcount} times")
            for copy in entity.multi_insert() if entity.mcount > 1 else (entity,):
                yield from _with_blocks([*copy.virtual_entities(), *copy.attribs], own, depth + 1)
        else:
            yield own, entity


def _dxf_pieces(kind: str, entity: Any) -> list[tuple[Any, ...]] | None:
    from ezdxf.entities import Ellipse

    if kind == "LINE":
        return [("bezier", [tuple(entity.dxf.start), tuple(entity.dxf.end)])]
    if kind in ("LWPOLYLINE", "POLYLINE"):
        if kind == "POLYLINE":  # one smoothed as a spline has its control points, too
            frame = entity.vertices[0].SPLINE_FRAME_CONTROL_POINT if entity.vertices else 0
            entity.vertices[:] = [vertex for vertex in entity.vertices if not vertex.dxf.flags & frame]
        parts = (_dxf_pieces(part.dxftype(), part) for part in entity.virtual_entities())
        return [piece for part in parts for piece in part or ()]
    if kind in ("ARC", "CIRCLE", "ELLIPSE"):
        form = (entity if kind == "ELLIPSE" else Ellipse.from_arc(entity)).construction_tool()
        sweep = (form.end_param - form.start_param) % math.tau or math.tau
        if not math.isfinite(sweep):
            raise RuntimeError(f"{kind} {entity.dxf.get('handle')}: its ends are no angles; draw it again")
        c, s = math.cos(form.start_param), math.sin(form.start_param)
        u, v = form.major_axis, form.minor_axis
        return [("arc", [tuple(form.center), tuple(u * c + v * s), tuple(v * c - u * s)], sweep)]
    if kind == "SPLINE":
        tool = entity.construction_tool()
        points, weights = [tuple(p) for p in tool.control_points], list(tool.weights()) or None
        return [("nurbs", tool.degree, list(tool.knots()), points, weights)]
    return None


def rhino_entities(path: str) -> dict[str, Any]:
    """Points, texts and curves of a .3dm, those of blocks in their places."""
    import rhino3dm

    rhino: Any = rhino3dm
    model = rhino.File3dm.Read(path)
    if model is None:
        raise RuntimeError("not a Rhino file, or cut off")
    contents = Contents(str(model.Settings.ModelUnitSystem.name))
    layers = {layer.Index: (layer.Name, layer.Visible) for layer in model.Layers}
    blocks = {str(block.Id): block for block in model.InstanceDefinitions}
    items = {str(item.Attributes.Id): item for item in model.Objects}
    inside = {str(name) for block in blocks.values() for name in block.GetObjectIds()}

    def visit(item: Any, places: list[Any], depth: int) -> None:
        """Add an object, moved by the transforms of the blocks around it, innermost first."""
        name, visible = layers.get(item.Attributes.LayerIndex, ("", True))
        geometry, handle = item.Geometry, str(item.Attributes.Id)[:8]
        if not (visible and item.Attributes.Visible):
            contents.hide(name)
        elif isinstance(geometry, rhino.InstanceReference) and depth < DEPTH:
            block = blocks.get(str(geometry.ParentIdefId))
            for member in block.GetObjectIds() if block is not None else ():
                if str(member) in items:
                    visit(items[str(member)], [geometry.Xform, *places], depth + 1)
        else:
            geometry = geometry.Duplicate() if places else geometry
            for place in places:
                if isinstance(geometry, rhino.Curve):
                    geometry = geometry.ToNurbsCurve()  # any transform keeps it exact
                geometry.Transform(place)
            _add_rhino(rhino, contents, name, handle, geometry)

    for key, item in items.items():
        if key not in inside:
            visit(item, [], 0)
    return contents.values


def _xyz(point: Any) -> tuple[float, float, float]:
    return (point.X, point.Y, point.Z)


def _add_rhino(rhino: Any, contents: Contents, layer: str, handle: str, geometry: Any) -> None:
    kind = type(geometry).__name__
    if isinstance(geometry, (rhino.Point, rhino.PointCloud)):
        for point in geometry.GetPoints() if kind == "PointCloud" else [geometry.Location]:
            contents.add(layer, kind, handle, point=_xyz(point))
    elif isinstance(geometry, rhino.TextDot):
        contents.add(layer, kind, handle, point=_xyz(geometry.Point), text=geometry.Text)
    elif isinstance(geometry, rhino.Text):
        contents.add(layer, kind, handle, point=_xyz(geometry.Plane.Origin), text=geometry.PlainText)
    elif isinstance(geometry, rhino.Curve):
        contents.add(layer, kind, handle, pieces=list(_rhino_pieces(rhino, geometry)))
    else:
        solid = isinstance(geometry, (rhino.Mesh, rhino.Brep, rhino.Surface, rhino.Extrusion))
        contents.leave_out(layer, "3-D faces" if solid else kind)


def _rhino_pieces(rhino: Any, curve: Any) -> Iterator[tuple[Any, ...]]:
    if isinstance(curve, rhino.PolyCurve):
        for number in range(curve.SegmentCount):
            yield from _rhino_pieces(rhino, curve.SegmentCurve(number))
    elif isinstance(curve, rhino.PolylineCurve):
        points = [_xyz(curve.Point(k)) for k in range(curve.PointCount)]
        yield from (("bezier", list(pair)) for pair in pairwise(points))
    elif isinstance(curve, rhino.LineCurve):
        yield ("bezier", [_xyz(curve.PointAtStart), _xyz(curve.PointAtEnd)])
    elif isinstance(curve, rhino.ArcCurve):
        yield _rhino_arc(curve, curve.Arc)
    else:
        form = curve if isinstance(curve, rhino.NurbsCurve) else curve.ToNurbsCurve()
        homogeneous = [form.Points[k] for k in range(len(form.Points))]
        weights = [p.W for p in homogeneous]
        points = [tuple(value / p.W for value in _xyz(p)) for p in homogeneous]
        span = max(max(column) - min(column) for column in zip(*points, strict=True))
        arc = form.TryGetArc(ROUND * span) if form.IsRational else None
        if arc is not None:  # what Rhino's own lists of objects hold for arcs and circles
            yield _rhino_arc(form, arc)
            return
        inner = [form.Knots[k] for k in range(len(form.Knots))]
        knots = [inner[0], *inner, inner[-1]]  # Rhino leaves out the first and the last
        yield ("nurbs", form.Degree, knots, points, weights if form.IsRational else None)


def _rhino_arc(curve: Any, arc: Any) -> tuple[Any, ...]:
    """The piece of an arc or circle, from the start of its curve in the curve's direction."""
    centre, start, along = map(_xyz, (arc.Center, curve.PointAtStart, curve.TangentAt(curve.Domain.T0)))
    length = math.hypot(*along) or 1.0
    quarter = [arc.Radius * value / length for value in along]
    return ("arc", [centre, [a - b for a, b in zip(start, centre, strict=True)], quarter], arc.AngleRadians)
