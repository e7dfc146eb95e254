"""Rhino (.3dm): a layer per patch with its mesh in double precision, in the patch's colour.

Metadata are the layers' user text; supports are point clouds on the layers "fixed" and "sliding". Each cable
is polylines on a layer "cable NAME", each member of a structural model on one "member NAME", with section
and force as user text; the layer of a wall in whose place it is, is hidden. Ridges, rims and wall lines are
curves. Reading leaves out these curves and the members.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from ..base.arrays import Floats
from ..base.errors import FileError
from ..base.libraries import load_library, read_arrays, require
from ..base.units import TABLE, Units, length_factor, unit_in_file
from ..surface import Surface
from ..surface.geometry import bounding_size
from ..surface.sections import curves_by_kind
from .formats import Content
from .mesh_data import FIXED, FREE, HELD, SLIDING, TOLERANCE, MeshData, support_of, within
from .metadata import WALLS, Metadata, parse_metadata, patch_meshes
from .polygons import cut_polygons

KEY, CABLE, NAME, MEMBER = "pcmc", "pcmc cable", "pcmc name", "pcmc member"
VERSION = 7  # of Rhino's format
UNIT = "m"  # of files whose surface has none
MARK = "PCMC-MARK"  # the layer of the text that marks a roof which is not in order
PRECISION = 1e-6  # of the size of the surface: the tolerance that Rhino works with, a power of ten
CURVES = {
    MARK: (200, 0, 0, 255),
    "PCMC-RIDGE": (200, 0, 0, 255),
    "PCMC-RIM": (0, 0, 0, 255),
    "PCMC-WALL": (0, 128, 0, 255),
    "PCMC-MIRROR": (128, 128, 128, 255),
}
COLORS = {"fixed": (200, 16, 46, 255), "sliding": (31, 79, 191, 255), "cable": (128, 0, 128, 255)}
ORANGE = (224, 112, 0, 255)  # of members


def write(path: Path, surface: Surface, content: Content) -> None:
    """A layer per patch, in the unit of the surface; in metres if there is none."""
    rhino = load_library("rhino3dm")
    model = rhino.File3dm()
    model.Settings.ModelUnitSystem = getattr(rhino.UnitSystem, TABLE[content.units.length or UNIT].rhino)
    # Rhino joins and cuts up to this length: its own, 0.001, would be a third of a roof of 3 mm in metres
    model.Settings.ModelAbsoluteTolerance = 10.0 ** math.floor(math.log10(PRECISION * surface.size))
    replaced = {member.wall for member in content.members}
    for k, color, used, faces in patch_meshes(surface):
        rgba = (*(round(255 * float(c)) for c in color), 255)
        attributes = _layer(rhino, model, surface.patches[k].name, rgba, content.metadata)
        model.Layers[attributes.LayerIndex].Visible = surface.patches[k].name not in replaced
        mesh = rhino.Mesh()
        mesh.Vertices.UseDoublePrecisionVertices = True
        for point in surface.vertices[used].tolist():  # the library takes them one by one
            mesh.Vertices.AddPoint3d(*point)
        for corners in faces.tolist():
            mesh.Faces.AddFace(*corners)
        mesh.Normals.ComputeNormals()
        model.Objects.AddMesh(mesh, attributes)
    if content.walls is not None:
        model.Layers[0].SetUserString(WALLS, content.walls)  # of the whole model, so once
    for name, kind in HELD.items():
        held = surface.vertices[support_of(surface) == kind]
        if len(held):
            cloud = rhino.PointCloud()
            for point in held.tolist():
                cloud.Add(rhino.Point3d(*point))
            model.Objects.AddPointCloud(cloud, _layer(rhino, model, name, COLORS[name], content.metadata))
    _add_curves(rhino, model, surface, replaced, content)
    for member in content.members:
        attributes = _layer(rhino, model, f"member {member.name}", ORANGE)
        model.Layers[attributes.LayerIndex].SetUserString(MEMBER, member.kind)
        for key, text in member.texts(content.units).items():
            attributes.SetUserString(key, text)
        _add_line(rhino, model, member.points, member.closed, attributes)
    if content.mark:
        low = rhino.Point3d(*surface.vertices.min(axis=0).tolist())
        model.Objects.AddTextDot(content.mark, low, _layer(rhino, model, MARK, CURVES[MARK]))
    if not model.Write(str(path), VERSION):
        raise FileError("rhino3dm cannot write it; check that the folder exists and the disk has space")


def _add_curves(rhino: Any, model: Any, surface: Surface, replaced: set[str], content: Content) -> None:
    """Ridges, rims, wall lines and cables with their sections as polylines, each kind and each cable on its
    layer; none of walls that are ``replaced``."""
    layers: dict[str, Any] = {}
    curves = [(f"PCMC-{kind}", curve, "") for kind, curve in curves_by_kind(surface, replaced)]
    for cable in surface.cables:
        own = json.dumps([cable.name, cable.tension, *[cable.weight] * bool(cable.weight)])
        curves += [(f"cable {cable.name}", chain, own) for chain in surface.topology.chains(cable.edges)]
    for name, curve, cable_text in curves:
        if name not in layers:
            layers[name] = _layer(rhino, model, name, CURVES.get(name, COLORS["cable"]), "", cable_text)
            area = content.cable_areas.get(name.removeprefix("cable ")) if cable_text else None
            if area is not None:
                layers[name].SetUserString("area", f"{area:.4g}{content.units.behind('area')}")
        _add_line(rhino, model, surface.vertices[curve.vertices], curve.closed, layers[name])


def _add_line(rhino: Any, model: Any, points: Floats, closed: bool, attributes: Any) -> None:
    """A polyline through points (k,3)."""
    line = rhino.Polyline(len(points) + 1)
    for point in points.tolist() + points[:1].tolist() * closed:
        line.Add(*point)
    model.Objects.AddPolyline(line, attributes)


def _layer(rhino: Any, model: Any, name: str, color: tuple[int, ...], text: str = "", cable: str = "") -> Any:
    """A new layer, and object attributes that put an object on it."""
    layer, attributes = rhino.Layer(), rhino.ObjectAttributes()
    layer.Name, layer.Color = name, color
    layer.SetUserString(KEY, text)
    layer.SetUserString(CABLE, cable)
    attributes.LayerIndex, attributes.Name = model.Layers.Add(layer), name
    added = model.Layers[attributes.LayerIndex]
    if added.Name != name:  # Rhino's names do not begin with a bracket, nor differ in case alone
        added.SetUserString(NAME, f"{added.Name}\n{name}")
    return attributes


def read(path: Path) -> MeshData:
    """Layers as patches; curves, surfaces and other objects are left out, with a note."""
    require("rhino3dm")
    arrays = read_arrays("io/reading_scripts.py", "rhino_arrays", path)
    layers = arrays["layers"]
    X, corners, counts, named = [], [], [], []
    held: dict[int, list[Floats]] = {SLIDING: [], FIXED: []}  # where a point is in both, it is fixed
    metadata, walls, others, start = Metadata(), None, 0, 0
    cables: dict[str, list[Any]] = {}
    for item in arrays["objects"]:
        known = 0 <= item["layer"] < len(layers)
        layer: Any = layers[item["layer"]] if known else {"name": path.stem, "texts": {}}
        name, texts = layer["name"], layer["texts"]
        in_file, _, own = texts.get(NAME, "").partition("\n")
        name = own if in_file == name else name
        if texts.get(KEY):
            metadata = parse_metadata(texts[KEY])
            walls = texts.get(WALLS) or walls
        if "faces" in item:
            faces = item["faces"]
            X.append(item["points"])
            size = np.where(faces[:, 2] == faces[:, 3], 3, 4)  # a triangle names its last corner twice
            local = within(faces[np.arange(4) < size[:, None]], f"corners in layer {name!r}", len(X[-1]))
            corners.append(local + start)
            counts.append(size)
            named += [name] * len(size)
            start += len(X[-1])
        elif "points" in item and name in HELD:
            held[HELD[name]].append(item["points"])
        elif "line" in item and CABLE in texts:
            cables.setdefault(texts[CABLE], []).extend(pairwise(item["line"].tolist()))
        elif name not in CURVES and MEMBER not in texts:
            others += 1
    if not X:
        text = f"the file has no meshes ({others} other objects); mesh the surfaces in Rhino"
        raise FileError(text, where="meshes", found=0)
    model, note = unit_in_file(arrays["unit"])
    if metadata.plane is not None:  # a file of pcmc, whose geometry Rhino may have scaled since
        own = metadata.units.length or UNIT
        factor, model = length_factor(model, own), own
        X = [factor * points for points in X]
        rows = []
        for text, pairs in cables.items():
            cable, pull, *weight = json.loads(text)
            rows.append([cable, pull, (factor * np.array(pairs)).tolist(), *weight])
        metadata = replace(metadata, parts={**metadata.parts, "cables": rows})
        held = {kind: [factor * points for points in parts] for kind, parts in held.items()}
    points = np.concatenate(X)
    F, source, cut = cut_polygons(points, np.concatenate(corners), np.concatenate(counts))
    left_out = f"{others} objects that are not meshes were left out" if others else ""
    notes = [*filter(None, (note, *cut, left_out))]
    support = None
    if metadata.plane is not None or any(held.values()):
        support = np.full(len(points), FREE, dtype=np.int8)
        tree, reach = cKDTree(points), TOLERANCE * bounding_size(points)
        for kind, clouds in held.items():
            for near in tree.query_ball_point(np.concatenate([np.empty((0, 3)), *clouds]), reach):
                support[near] = kind
    patch, names = pd.factorize(np.array(named, dtype=object))
    units = Units(model, metadata.units.force if model else "")
    about: dict[str, Any] = {"support": support, "walls": walls, "units": units}
    return metadata.mesh_data(points, F, patch[source], names.tolist(), notes, **about)
