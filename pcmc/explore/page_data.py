"""The data that the page draws: sheets, lines and supports once, fields and findings at every change."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from zlib import crc32

import numpy as np
import numpy.typing as npt

from ..accuracy.mesh_check import MeshCheck, with_bar
from ..accuracy.varied import named
from ..base.arrays import Floats
from ..base.errors import SurfaceError
from ..base.units import NO_UNITS, Units
from ..certificate import Certificate
from ..certificate.forces import Forces
from ..certificate.quantities import dimension_of
from ..design.targets import MEASURES, NAMED
from ..equilibria import Equilibria
from ..equilibria.found import INCOMPLETE
from ..forces.curvature import curvature_error, mean_curvature
from ..panelling.families import family_of_face
from ..project.values import changeable_values
from ..structure import PlacedMember
from ..surface import Surface
from ..surface.colours import patch_colors
from ..surface.distance import difference
from ..surface.symmetry import Whole, unfolded
from .session import SessionState, figures_data

Arrays = dict[str, npt.NDArray[Any]]


def outline(surface: Surface, origin: Floats) -> tuple[dict[str, Any], Arrays]:
    """Everything that stays the same while the surface moves.

    A vertex is drawn once for each sheet that meets there, so that colours break: ``sheet_faces`` (m,3) index
    these corners, ``sheet_vertex`` and ``sheet_patch`` are their vertex and patch.
    """
    piece, surface = surface, drawn(surface)
    patches = zip(surface.patches, surface.walls.tolist(), patch_colors(surface).tolist(), strict=True)
    header = {
        "patches": [{"name": p.name, "wall": wall, "color": colour} for p, wall, colour in patches],
        "controls": _controls(piece),
        "whole": round(surface.m / piece.m),
        "vertices": surface.n,
        "triangles": surface.m,
        "size": surface.size,
        "up": surface.plane.normal,
        "origin": origin.tolist(),
        "axes": surface.plane.axes.tolist(),
        "foot": surface.plane.point,
        "mirrors": [[p.point, p.normal] for p, _ in piece.on_planes if p.mirror],
        "ground": float(surface.plane.height(origin)),
    }
    keys = surface.patch_of_face[:, None].astype(np.int64) * surface.n + surface.faces
    corners, faces = np.unique(keys, return_inverse=True)
    topo, curves = surface.topology, surface.topology.curve_edge.copy()
    curves[topo.edge_numbers(surface.cable_edges[0])] = True
    of_wall = np.ones(len(topo.edges), dtype=bool)  # edges all of whose triangles belong to walls
    of_wall[topo.edge_of_face[surface.roof[surface.patch_of_face]]] = False
    return header, {
        "sheet_faces": faces.reshape(-1, 3),
        "sheet_vertex": corners % surface.n,
        "sheet_patch": corners // surface.n,
        "edges": topo.edges[~curves],
        "edge_wall": of_wall[~curves],
        "curves": topo.edges[curves],
        "curve_wall": of_wall[curves],
        "fixed": np.flatnonzero(surface.pinned),
        "sliding": np.flatnonzero(surface.held & ~surface.pinned),
    }


def _controls(surface: Surface) -> list[dict[str, Any]]:
    """What has sliders: a group for each patch, cable and room, with the kinds of its values."""
    groups, values = [], changeable_values(surface)
    for number, (patch, wall) in enumerate(zip(surface.patches, surface.walls.tolist(), strict=True)):
        kinds = [kind for kind in ("tensions", "pressures", "snows", "weights") if patch.name in values[kind]]
        groups.append({"name": patch.name, "patch": number, "wall": wall, "kinds": kinds})
    for kinds in (["cables", "cable_weights"], ["volumes"], ["points"]):
        for name in values[kinds[0]]:
            own = [kind for kind in kinds if name in values[kind]]
            groups.append({"name": name, "patch": None, "wall": False, "kinds": own})
    return groups


def whole_of(surface: Surface) -> Whole | None:
    """The whole of a surface that ends at mirror planes; None without these, and where images never end."""
    if not any(plane.mirror for plane, _ in surface.on_planes):
        return None
    try:
        return unfolded(surface)
    except SurfaceError:
        return None


def drawn(surface: Surface) -> Surface:
    """The surface that the page draws: the whole of one that ends at mirror planes."""
    whole = whole_of(surface)
    return surface if whole is None else whole.surface


def unit_texts(units: Units) -> dict[str, Any]:
    """The units that the page shows; ``given`` is whether they are more than "force" and "length"."""
    names = ("area", "volume", "curvature", "tension", "pressure", "energy", "angle")
    texts = {name: getattr(units, name) for name in names}
    bare = {"length": units.length or "length", "force": units.force or "force"}
    return {"given": bool(units), **bare, **texts}


def centre(surface: Surface) -> Floats:
    """(3,) middle of the bounding box: the page's origin, near which single precision is best."""
    X = surface.vertices
    return 0.5 * (X.min(axis=0) + X.max(axis=0))


def state_data(state: SessionState, origin: Floats, moving: bool = False) -> dict[str, Any]:
    """A state in words and numbers; while a slider is ``moving``, without the tables of supports."""
    surface, certificate = state.surface, state.certificate
    names = repr([p.name for p in surface.patches]) + repr(surface.walls.tolist())
    cuts = "" if moving or state.failure else certificate.cuts_itself
    return {
        "mesh": crc32(surface.faces.tobytes() + origin.tobytes() + names.encode()),  # that ``outline`` has
        "values": {"asked": changeable_values(state.wanted), "shown": changeable_values(surface)},
        "verdict": _verdict(state.failure or certificate, cuts and f"not to be built as it is: {cuts}"),
        "at_rest": state.failure is None,
        "findings": _findings(certificate, moving),
        "figures": figures_data(surface, certificate),
        "way": state.note,
        "variants": [{**v.data, "word": _verdict(v.certificate)["word"]} for v in state.variants],
        **{key: getattr(state, key) for key in ("undo", "redo", "message", "met", "number", "compared")},
    }


def _verdict(finding: Certificate | MeshCheck, advice: str = "") -> dict[str, str]:
    """The verdict as a code, ``name``, and in words."""
    word, _, rest = finding.verdict.value.partition(": ")
    detail = "; ".join(filter(None, (finding.detail, advice)))
    return {"name": finding.verdict.name.lower(), "word": word, "sentence": rest, "detail": detail}


def _findings(certificate: Certificate, moving: bool) -> dict[str, Any]:
    """Numbers and tables of a certificate."""
    tables = {"rooms": certificate.rooms}
    if not moving:
        tables |= {"supports": certificate.supports, "balance": certificate.balance}
    rows: dict[str, Any] = {}
    for name, table in tables.items():  # pandas' own ``to_dict`` takes ten times as long, at every answer
        columns = [table[column].tolist() for column in table]
        rows[name] = [dict(zip(table, row, strict=True)) for row in zip(*columns, strict=True)]
    return {**certificate.numbers(), **rows}


def fields(state: SessionState, origin: Floats) -> Arrays:
    """Vertices relative to the origin, and the values that colours may show."""
    surface, certificate, whole = state.surface, state.certificate, whole_of(state.surface)
    shown = surface if whole is None else whole.surface
    acting = certificate.acting if whole is None else Forces.of(shown)
    arrays: Arrays = {
        "vertices": shown.vertices - origin,
        "curvature": mean_curvature(shown, "variational"),
        "error": curvature_error(shown, "cotangent"),
        "reactions": acting.per_length,
        "points": acting.points,
    }
    if len(certificate.modes) and whole is None:
        arrays["mode"] = certificate.modes[0] / (np.abs(certificate.modes[0]).max() or 1.0)
    if state.compared is not None:
        away = difference(surface, state.variants[state.compared].surface)
        arrays["difference"] = away if whole is None else away[whole.vertex]
    return arrays


def members_data(members: Sequence[PlacedMember], origin: Floats) -> tuple[list[dict[str, Any]], Arrays]:
    """The least and the largest normal force of each member at rest, as rows of the key figures; the ends
    (k,3) of the straight pieces of all, two by two, relative to the origin."""
    rows, row = [], {"owner": "member", "dimension": "force"}
    for one in members:
        named = zip(("least", "largest"), one.forces or (), strict=False)
        rows += [{"quantity": f"{which} N", "of": one.name, "value": value, **row} for which, value in named]
    pieces = [np.repeat(one.path - origin, 2, axis=0)[1:-1] for one in members]
    return rows, {"member_ends": np.concatenate(pieces)} if pieces else {}


def families_drawn(state: SessionState) -> Floats:
    """``family_of_face`` of the surface that is drawn. It takes longer than an answer to a slider."""
    return family_of_face(drawn(state.surface))


def target_choices(surface: Surface) -> list[dict[str, Any]]:
    """The quantities that targets may have on a surface: the names of what each may be of, and "" for all."""
    names: dict[str, list[str]] = {"patch": [], "wall": []}
    for patch, kept in zip(surface.patches, surface.roof.tolist(), strict=True):
        names["patch" if kept else "wall"].append(patch.name)
    names |= {"cable": [c.name for c in surface.cables], "room": [room.name for room in surface.rooms]}
    varied: dict[Any, str] = {}  # of margins, each once
    for what, parts in named(surface).items():
        varied.setdefault(parts, what)
    choices = []
    for quantity in MEASURES:
        own = names[NAMED.get(quantity, "wall" if quantity == "lean" else "patch")]
        if own and quantity != "height":
            of = [*varied.values()] if quantity == "margin" else own if quantity in NAMED else ["", *own]
            choices.append({"quantity": quantity, "of": of, "dimension": dimension_of(quantity)})
    return choices


def equilibria_data(found: Equilibria, units: Units = NO_UNITS) -> dict[str, Any]:
    """The branches and equilibria of a search, and in words; in the order of ``found.surfaces``."""
    (along,), columns = found.lines, ["parameter", "height", "index"]
    branches = found.branches[along.name]
    pieces = [piece for branch in branches for piece in branch.pieces(*columns[:2])]
    shown = [branch.points.loc[sorted(branch.surfaces), columns] for branch in branches]
    return {
        "parameter": along.name,
        "value": along.value,
        "pieces": [{"stable": stable, "points": points.tolist()} for stable, points in pieces],
        "equilibria": found.table[["height", "index", "energy"]].to_dict(orient="records"),
        "beside": [row for points in shown for row in points.to_dict(orient="records")],
        "words": [*found.barrier_lines(units), *found.failed, INCOMPLETE],
    }


def mesh_findings(check: MeshCheck, units: Units = NO_UNITS) -> dict[str, Any]:
    """The verdict of the mesh check, and its table in words."""
    rows = []
    for row in check.table.to_dict(orient="records"):
        unit = units.behind(dimension_of(row["quantity"]))
        bars = {"value": "error", "limit": "limit_error"}
        texts = {key: with_bar(row[key], row[bar], unit) for key, bar in bars.items()}
        name = " of ".join(filter(None, (row["quantity"], row["of"])))
        rows.append({"name": name, **texts, "order": float(row["order"])})
    return {**_verdict(check, check.advice), "rows": rows}
