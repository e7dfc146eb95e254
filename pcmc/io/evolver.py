"""Surface Evolver datafiles (.fe): the same discrete energy in another program.

A patch's tension is its faces' ``tension``; the patches of one pressure p ≠ 0 are one body with
``pressure p``; fixed vertices are ``fixed``, sliding ones lie on ``constraint 1``, the plane Π, and on
``constraint 2`` and so on, the other planes. A cable is a line ``tension`` of its edges. A weight w is one
quantity ``self_weight_k``: the integral of w z. Evolver measures volumes from the origin (det/6 per face,
Eq. 10b), so coordinates are relative to ``Surface.origin``. A plane that does not pass there has the
``content`` of its flat pieces, as an integral along its edges:
∫ ⟨-c × x / 6, dx⟩ = -⟨c, a × b⟩ / 6; the ends of these pieces are a quantity ``corner_k`` of their vertex.
Then ``total_energy`` is E of Eq. (20). A room of prescribed volume is a body with that ``volume``; its
Lagrange multiplier is the pressure, ``volconst`` the part of the volume that the cones do not see.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Ints, format_rows
from ..base.errors import FileError
from ..forces.flat_pieces import flat_pieces
from ..forces.rooms import closing_volumes, room_pressures
from ..meshing.refinement import edges_on_planes, held_midpoints
from ..surface import Surface
from .evolver_reading import ROUNDING, read
from .formats import Content
from .mesh_data import FIXED, FREE, SLIDING, support_of
from .text import escaped

__all__ = ["read", "write"]

SPECIAL = "\\*"  # in names: the program joins lines at a backslash, and "/*" begins a comment

HEADER = """\
// Piecewise constant-mean-curvature surface, written by pcmc.{mark}
// total_energy is E = sum tension * area - sum pressure * volume, volumes seen from the origin.
// Pressures are net: those of the air less the snow, an attribute of faces.
// origin {origin}
{names}
SPACE_DIMENSION 3
SYMMETRIC_CONTENT
DEFINE FACET ATTRIBUTE patch INTEGER

"""


def write(path: Path, surface: Surface, content: Content) -> None:
    patches = list(enumerate(surface.patches, 1))
    weights = np.unique(surface.weights[surface.weights != 0.0]).tolist()
    face_tags = []
    for k, p in patches:
        snow = f" snow {p.snow!r}" if p.snow else ""
        weight = f" weight {p.weight!r} self_weight_{1 + weights.index(p.weight)}" if p.weight else ""
        face_tags.append(f" tension {p.tension!r} patch {k}{snow}{weight}")
    named = [("patch", k, p.name) for k, p in patches]
    named += [("bare", k, p.name) for k, p in patches if p.name in content.bare]
    named += [("wall", k, "") for k, p in patches if p.wall]
    named += [("room", k, room.name) for k, room in enumerate(surface.rooms, 1)]
    named += [("cable", k, cable.name) for k, cable in enumerate(surface.cables, 1)]
    names = "\n".join(f"// {kind} {k} {escaped(name, SPECIAL)}".rstrip() for kind, k, name in named)
    mark, origin = content.mark and f"\n// {content.mark}", " ".join(map(repr, surface.origin.tolist()))
    topo = surface.topology
    sides = ((topo.edge_of_face + 1) * topo.sense)[:, [2, 0, 1]]
    vertex_tag, edge_tag = _tags(surface)
    sections = {
        "VERTICES": ("%r %r %r", surface.vertices - surface.origin, vertex_tag),
        "EDGES": ("%d %d", topo.edges + 1, edge_tag),
        "FACES": ("%d %d %d", sides, np.array(face_tags)[surface.patch_of_face]),
    }
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(HEADER.format(mark=mark, origin=origin, names=names) + _definitions(surface, weights))
        for name, (template, rows, tag) in sections.items():
            numbers = np.arange(1, len(rows) + 1)
            file.write(f"\n{name}\n" + format_rows(f"%d {template}%s\n", numbers, *rows.T, tag))
        file.write("\nBODIES\n" + _bodies(surface) + "\nREAD\n")


def _linear(coefficients: Sequence[float]) -> str:
    return " + ".join(f"({c!r})*{axis}" for c, axis in zip(coefficients, "xyz", strict=True))


def _definitions(surface: Surface, weights: Sequence[float]) -> str:
    """Π and the other planes as constraints 1, 2, …, the latter with the content of their flat pieces; the
    attributes of edges and faces; a quantity for each weight."""
    origin, pieces, text = surface.origin, flat_pieces(surface), ""
    tail = surface.faces[pieces.face, pieces.corner]
    head = surface.faces[pieces.face, (pieces.corner + 1) % 3]
    for number, (plane, mask) in enumerate(((surface.plane, surface.on_plane), *surface.on_planes), 1):
        terms = zip(plane.normal, "xyz", strict=True)
        formula = " + ".join(c if a == 1.0 else f"({a!r})*{c}" for a, c in terms if a != 0.0)
        if number > 1:
            kind = "mirror" if plane.mirror else "support"
            text += f"// plane {number} {kind} {escaped(plane.name, SPECIAL)}".rstrip() + "\n"
        offset = -float(plane.height(origin)) or 0  # and not -0.0
        text += f"CONSTRAINT {number}\nFORMULA: {formula} = {offset!r}\n"
        own = np.flatnonzero(mask[tail] & mask[head])
        if number > 1 and len(own):
            x, y, z = (pieces.apex[own[0]] / -6.0).tolist()
            text += f"CONTENT\nC1: ({y!r})*z - ({z!r})*y\nC2: ({z!r})*x - ({x!r})*z\n"
            text += f"C3: ({x!r})*y - ({y!r})*x\n"
    for k, (patch, normal) in enumerate(zip(pieces.end_patch, pieces.normal, strict=True)):
        pull = _linear((-surface.net_pressures[patch] * normal).tolist())
        text += f"QUANTITY corner_{k} ENERGY METHOD VERTEX_SCALAR_INTEGRAL\nSCALAR_INTEGRAND: {pull}\n"
    text += "DEFINE EDGE ATTRIBUTE cable INTEGER\n" if surface.cables else ""
    text += "DEFINE FACET ATTRIBUTE snow REAL\n" if surface.snows.any() else ""
    text += "DEFINE FACET ATTRIBUTE weight REAL\n" if weights else ""
    height = f"{_linear(surface.plane.normal)} + ({float(surface.plane.height(origin))!r})"
    for k, weight in enumerate(weights, 1):
        text += f"QUANTITY self_weight_{k} ENERGY METHOD FACET_SCALAR_INTEGRAL\n"
        text += f"SCALAR_INTEGRAND: ({weight!r})*({height})\n"
    return text


def _tags(surface: Surface) -> tuple[Any, Any]:
    """What follows the numbers of each vertex (n,) and edge (e,). Edges are held as on a refined surface."""
    support, (fixed, slides) = support_of(surface, planes=True), held_midpoints(surface)
    of_edge = np.where(fixed, FIXED, np.where(slides, SLIDING, FREE))
    at_vertices, at_edges = [mask for _, mask in surface.on_planes], edges_on_planes(surface)
    kinds, tags = np.array(["", " constraint 1", " fixed"]), []
    for kind, masks in ((support, at_vertices), (of_edge, at_edges)):
        tag = kinds[kind]
        for number, mask in enumerate(masks, 2):
            more = np.where(np.strings.find(tag, "constraint") < 0, f" constraint {number}", f" {number}")
            tag = np.strings.add(tag, np.where(mask, more, ""))
        tags.append(tag.astype(object))
    vertices, edges = tags
    for k, vertex in enumerate(flat_pieces(surface).end):
        vertices[vertex] += f" corner_{k}"
    for k, cable in enumerate(surface.cables, 1):
        edges[surface.topology.edge_numbers(cable.edges)] += f" tension {cable.tension!r} cable {k}"
    return vertices, edges


def _bodies(surface: Surface) -> str:
    """A body for each room, and one for each net pressure, on the side of a face where no room is."""
    pressures, signs = surface.net_pressures, surface.room_signs
    side = np.where((signs > 0.0).any(axis=0), -1, 1)[surface.patch_of_face]
    numbers, bodies = np.arange(1, surface.m + 1), list[tuple[Ints, str]]()
    if surface.rooms:
        multipliers = room_pressures(surface)
        left = surface.pressures - multipliers @ signs
        left[np.abs(left) <= ROUNDING * np.abs(surface.pressures).max(initial=0.0)] = 0.0
        left -= surface.snows
        both = np.flatnonzero((signs > 0.0).any(axis=0) & (signs < 0.0).any(axis=0) & (left != 0.0))
        if len(both):
            name = surface.patches[both[0]].name
            text = f"patch {name!r} has a net pressure of {left[both[0]]:g} beside that of its rooms, and a"
            text += " datafile has one body on each side of a face; give all patches of its rooms its load"
            raise FileError(text, where=name, found=float(left[both[0]]))
        pressures = left  # as of snow, beside those of the rooms
        beyond = closing_volumes(surface).tolist()
        for k, room in enumerate(surface.rooms):
            members = signs[k, surface.patch_of_face].astype(int) * numbers
            rest = f" volume {room.volume!r} volconst {beyond[k]!r}"
            bodies.append((members[members != 0], f"{rest} lagrange_multiplier {float(multipliers[k])!r}"))
    of_face = side * pressures[surface.patch_of_face]
    for pressure in np.unique(of_face[of_face != 0.0]).tolist():
        bodies.append(((side * numbers)[of_face == pressure], f" pressure {pressure!r}"))
    text = ""
    for number, (members, rest) in enumerate(bodies, 1):
        lines = [" ".join(members[k : k + 15].astype(str)) for k in range(0, len(members), 15)]
        text += f"{number} " + " \\\n  ".join(lines) + f"{rest}\n"
    return text
