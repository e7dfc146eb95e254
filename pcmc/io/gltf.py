"""glTF 2.0 (.glb, .gltf in one file): a mesh per patch, in metres and single precision, y up.

A surface far from the origin is written about its middle, and the nodes place it. Each patch has a material
of its name, in its colour, or white where the vertices have the colours of a scalar. Supports and scalars are
attributes of vertices; tensions, pressures, plane and walls without height are metadata of the scene.
"""

from __future__ import annotations

import json
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..base.errors import FileError
from ..base.files import check_regular
from ..base.libraries import load_library, translated_errors
from ..surface import Surface
from ..surface.colours import linear, scalar_colors
from ..surface.geometry import file_origin
from .formats import Content
from .mesh_data import MeshData, support_kinds, support_of
from .metadata import WALLS, from_scene, parse_metadata, patch_meshes

SUPPORT = "_SUPPORT"
NO_VALUE = float(np.finfo(np.float32).min)  # in place of NaN, which glTF does not allow
ITEMS = 4  # of arrays, for each byte of a file; arrays may share their bytes


def write(path: Path, surface: Surface, content: Content) -> None:
    trimesh = load_library("trimesh")
    data = {SUPPORT: support_of(surface).astype(np.float32)}
    for name, values in content.scalars.items():
        finite = np.isfinite(values) & (np.abs(values) < -NO_VALUE)
        data["_" + re.sub(r"\W+", "_", name)] = np.where(finite, values, NO_VALUE).astype(np.float32)
    turned, place = surface.vertices[:, [0, 2, 1]] * [1.0, 1.0, -1.0], np.eye(4)
    place[:3, 3] = file_origin(turned, surface.size)
    turned -= place[:3, 3]
    scene, shades = trimesh.Scene(), None
    if content.colour:
        shades, least, most = scalar_colors(content.scalars[content.colour])
        scene.metadata["pcmc colours"] = {"scalar": content.colour, "least": least, "most": most}
    for k, color, used, faces in patch_meshes(surface):
        name = surface.patches[k].name
        mesh = trimesh.Trimesh(turned[used], faces, process=False)
        mesh.vertex_attributes.update({key: values[used] for key, values in data.items()})
        shine = {"metallicFactor": 0.0, "roughnessFactor": 0.9, "doubleSided": True}
        base = [1.0] * 4 if shades is not None else [*linear(color), 1.0]
        material = trimesh.visual.material.PBRMaterial(name, baseColorFactor=base, **shine)
        mesh.visual = trimesh.visual.TextureVisuals(material=material)
        if shades is not None:
            rgba = np.column_stack([linear(shades[used]), np.ones(len(used))])
            mesh.visual.vertex_attributes["color"] = np.round(255.0 * rgba).astype(np.uint8)
        scene.add_geometry(mesh, node_name=name, geom_name=name, transform=place)
    scene.metadata["pcmc"] = content.metadata
    if content.mark:
        scene.metadata["pcmc mark"] = content.mark
    if content.walls is not None:
        scene.metadata[WALLS] = content.walls
    library, options = trimesh.exchange.gltf, {"include_normals": True}
    if path.suffix.lower() == ".glb":
        path.write_bytes(library.export_glb(scene, **options))
    else:
        path.write_bytes(library.export_gltf(scene, embed_buffers=True, **options)["model.gltf"])


def read(path: Path) -> MeshData:
    """Meshes as patches, by the names of their nodes. trimesh believes the names and counts in a file."""
    trimesh, content = load_library("trimesh"), path.read_bytes()
    size, items = len(content), 0
    if path.suffix.lower() == ".glb":
        content = content[20 : 20 + int.from_bytes(content[12:16], "little")]
    with translated_errors("glTF"):
        header = json.loads(content)  # in a file that is cut off, trimesh would look for another file
        for buffer in header.get("buffers", ()):
            name = buffer.get("uri", "base64,").strip()
            if "base64," not in name:
                for place in {name, name.lstrip("/"), os.path.split(name)[-1]}:  # trimesh tries each
                    check_regular(part := path.parent / place)
                    size += part.stat().st_size if part.exists() else 0
        for number, accessor in enumerate(header.get("accessors", ())):
            count = accessor["count"]
            items += count
            if not isinstance(items, int) or count < 0 or items > ITEMS * size:
                text = f"accessor {number} has {count!r:.30} items, and the file only {size} bytes"
                raise FileError(text, where=number, found=count, expected=size)
        try:
            scene = trimesh.load_scene(path, process=False, skip_materials=True)
        except FileNotFoundError as error:
            text = f"its part {error} is missing; keep the files of a .gltf in one folder"
            raise FileError(text, where=str(error)) from None
    mesh = from_scene(scene, path.stem, parse_metadata(scene.metadata.get("pcmc")))
    X = mesh.vertices[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
    scalars = {k[1:]: np.where(v == NO_VALUE, np.nan, v) for k, v in mesh.scalars.items() if k[:1] == "_"}
    held = support_kinds(scalars.pop(SUPPORT[1:])) if SUPPORT in mesh.scalars else None
    return replace(mesh, vertices=X, scalars=scalars, support=held, walls=scene.metadata.get(WALLS))
