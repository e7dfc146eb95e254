"""The data that the page draws: sheets, lines and supports once, fields at every change."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..accuracy.mesh_check import MeshCheck, with_bar
from ..base.arrays import Floats
from ..base.units import Units
from ..certificate.balance import reactions_per_length
from ..certificate.certificate import Certificate
from ..energy.curvature import curvature_error, mean_curvature
from ..energy.functional import patch_areas
from ..surface import Surface
from ..surface.colours import patch_colors

Arrays = dict[str, npt.NDArray[Any]]


def outline(surface: Surface) -> tuple[dict[str, Any], Arrays]:
    """Everything that stays the same while the surface moves.

    A vertex where sheets meet is drawn once for each sheet, so that colours and shading break there:
    ``sheet_faces`` (m,3) index these corners; ``sheet_vertex`` and ``sheet_patch`` are their vertex
    and patch.
    """
    corner = surface.patch_of_face[:, None].astype(np.int64) * surface.n + surface.faces
    corners, faces = np.unique(corner, return_inverse=True)
    topo = surface.topology
    header = {
        "patches": [
            {"name": p.name, "wall": p.auxiliary, "color": color}
            for p, color in zip(surface.patches, patch_colors(surface).tolist(), strict=True)
        ],
        "vertices": surface.n,
        "triangles": surface.m,
        "size": surface.size,
        "up": surface.plane.normal,
        "ground": float(surface.plane.height(centre(surface))),
    }
    inner, curves = ~topo.curve_edge, topo.curve_edge
    of_wall = np.ones(len(topo.edges), dtype=bool)  # edges all of whose triangles belong to walls
    of_wall[topo.edge_of_face[~surface.walls[surface.patch_of_face]]] = False
    return header, {
        "sheet_faces": faces.reshape(-1, 3),
        "sheet_vertex": corners % surface.n,
        "sheet_patch": corners // surface.n,
        "edges": topo.edges[inner],
        "edge_wall": of_wall[inner],
        "curves": topo.edges[curves],
        "curve_wall": of_wall[curves],
        "fixed": np.flatnonzero(surface.pinned),
        "sliding": np.flatnonzero(surface.held & ~surface.pinned),
    }


def unit_texts(units: Units) -> dict[str, Any]:
    """The units that the page shows; ``given`` is whether they are more than "force" and "length"."""
    names = ("area", "volume", "curvature", "tension", "pressure", "energy")
    texts = {name: getattr(units, name) for name in names}
    return {"given": bool(units), "length": units.length or "length", **texts}


def centre(surface: Surface) -> Floats:
    """(3,) middle of the bounding box: the page's origin, near which single precision is best."""
    X = surface.vertices
    return 0.5 * (X.min(axis=0) + X.max(axis=0))


def fields(surface: Surface, certificate: Certificate, origin: Floats) -> Arrays:
    """Vertices relative to the origin, and the values that colours may show."""
    arrays: Arrays = {
        "vertices": surface.vertices - origin,
        "curvature": mean_curvature(surface, "variational"),
        "error": curvature_error(surface, "cotangent"),
        "reactions": reactions_per_length(surface, certificate.reactions),
    }
    if len(certificate.modes):
        arrays["mode"] = certificate.modes[0] / (np.abs(certificate.modes[0]).max() or 1.0)
    return arrays


def findings(surface: Surface, certificate: Certificate) -> dict[str, Any]:
    """Numbers of the surface and its certificate, for the page's table."""
    height = surface.plane.height(surface.vertices)
    roof = ~surface.walls
    return {
        **certificate.numbers(),
        "height": float(height.max()),
        "area": float(patch_areas(surface)[roof].sum()),
        "patches": [
            {"name": row["patch"], "mean_H": row["mean_H"], "area": row["area"]}
            for row in certificate.patches.to_dict(orient="records")
        ],
    }


def mesh_findings(check: MeshCheck) -> dict[str, Any]:
    """The verdict of the mesh check, and its table in words."""
    word, _, sentence = check.verdict.value.partition(": ")
    rows = [
        {
            "name": " of ".join(filter(None, (row["quantity"], row["of"]))),
            "value": with_bar(row["value"], row["error"]),
            "limit": with_bar(row["limit"], row["limit_error"]),
            "order": float(row["order"]),
        }
        for row in check.table.to_dict(orient="records")
    ]
    detail = "; ".join(filter(None, (check.detail, check.advice)))
    return {
        "name": check.verdict.name.lower(),
        "word": word,
        "sentence": sentence,
        "detail": detail,
        "rows": rows,
    }
