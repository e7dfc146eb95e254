"""Universal Scene Description (.usda), written only: a mesh per patch, in single precision, z up.

A surface far from the origin is written about its middle, and the transform of the roof places it. Each patch
has a material, or colours at the vertices. Supports and scalars are primvars, the rest custom data.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Floats
from ..base.errors import MissingExtra
from ..base.units import length_factor
from ..surface import Surface
from ..surface.colours import linear, scalar_colors
from ..surface.geometry import file_origin
from .formats import Content
from .mesh_data import support_of
from .metadata import patch_meshes

ROOF = "/Roof"
SUPPORT = "support"


def write(path: Path, surface: Surface, content: Content) -> None:
    try:
        from pxr import Sdf, Usd, UsdGeom, Vt
    except ImportError:
        raise MissingExtra("usd-core", "usd") from None

    stage: Any = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, length_factor(content.units.length, "m"))
    roof: Any = UsdGeom.Xform.Define(stage, ROOF)
    stage.SetDefaultPrim(roof.GetPrim())
    for key, text in {"pcmc": content.metadata, "mark": content.mark, "walls": content.walls}.items():
        if text:
            roof.GetPrim().SetCustomDataByKey(key, text)
    middle = file_origin(surface.vertices, surface.size)
    if middle.any():
        roof.AddTranslateOp().Set(tuple(middle.tolist()))
    at_vertices = {SUPPORT: support_of(surface).astype(float), **content.scalars}
    shades = linear(scalar_colors(content.scalars[content.colour])[0]) if content.colour else None
    for k, patch_color, used, faces in patch_meshes(surface):
        color = linear(patch_color)
        mesh: Any = UsdGeom.Mesh.Define(stage, f"{ROOF}/patch_{k}")
        mesh.GetPrim().SetDisplayName(surface.patches[k].name)
        points = Vt.Vec3fArray.FromNumpy((surface.vertices[used] - middle).astype(np.float32))
        mesh.CreatePointsAttr(points)
        mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
        mesh.CreateFaceVertexCountsAttr([3] * len(faces))
        mesh.CreateFaceVertexIndicesAttr(faces.ravel().tolist())
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        mesh.CreateDoubleSidedAttr(True)
        shown = color[None] if shades is None else shades[used]
        colors = mesh.CreateDisplayColorPrimvar("constant" if shades is None else "vertex")
        colors.Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(shown, dtype=np.float32)))
        primvars = UsdGeom.PrimvarsAPI(mesh)
        for name, values in at_vertices.items():
            kind = re.sub(r"\W+", "_", name), Sdf.ValueTypeNames.FloatArray, UsdGeom.Tokens.vertex
            primvars.CreatePrimvar(*kind).Set(Vt.FloatArray.FromNumpy(values[used].astype(np.float32)))
        _bind_material(stage, mesh, k, color, vertex_colors=shades is not None)
    path.write_text(stage.GetRootLayer().ExportToString(), encoding="utf-8")


def _bind_material(stage: Any, mesh: Any, k: int, color: Floats, vertex_colors: bool) -> None:
    """A material of the patch's name, in its colour or in the colours of the vertices."""
    from pxr import Gf, Sdf, UsdShade

    types: Any = Sdf.ValueTypeNames
    place = f"{ROOF}/Materials/material_{k}"
    material: Any = UsdShade.Material.Define(stage, place)
    material.GetPrim().SetDisplayName(mesh.GetPrim().GetDisplayName())
    shader: Any = UsdShade.Shader.Define(stage, f"{place}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("roughness", types.Float).Set(0.9)
    diffuse = shader.CreateInput("diffuseColor", types.Color3f)
    if vertex_colors:
        reader: Any = UsdShade.Shader.Define(stage, f"{place}/colors")
        reader.CreateIdAttr("UsdPrimvarReader_float3")
        reader.CreateInput("varname", types.String).Set("displayColor")
        diffuse.ConnectToSource(reader.CreateOutput("result", types.Float3))
    else:
        diffuse.Set(Gf.Vec3f(*color.tolist()))
    material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", types.Token))
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
