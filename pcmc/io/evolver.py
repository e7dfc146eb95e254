"""Surface Evolver datafiles (.fe): the same discrete energy in another program.

A patch's tension is its faces' ``tension``; the patches of one pressure p ≠ 0 are one body with
``pressure p``; fixed vertices are ``fixed``, sliding ones lie on ``constraint 1``, the plane Π, and on
``constraint 2`` and so on, the other planes; a comment names these, and marks mirrors.
A cable is a line ``tension`` of its edges, which also have its number as the attribute ``cable``. A weight
w is the attribute ``weight`` of faces, and one quantity for each w, ``self_weight_k``: their integral of w z.
Snow is the attribute ``snow`` of faces, which the reader adds to the net pressures of the bodies.
Evolver measures volumes from the origin (``symmetric_content``: det/6 per face, Eq. 10b), so the
coordinates are relative to the point of Π, or with other planes to ``Surface.origin``, and a comment says
where that is. A plane that does not pass there has the ``content`` of its flat pieces, as an integral along
its edges: ∫ ⟨-c × x / 6, dx⟩ = -⟨c, a × b⟩ / 6; the ends of these pieces are a quantity ``corner_k`` of their
vertex, with its pressure. Then the program's ``total_energy`` is E of Eq. (20).
A room of prescribed volume is a body with that ``volume``; its Lagrange multiplier is the pressure, and
``volconst`` the part of the volume that the program's cones do not see. ``evolver_reading`` has the reader.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import FileError
from ..forces.flat_pieces import flat_pieces
from ..forces.plane_pieces import add_plane_volumes
from ..forces.rooms import room_pressures, room_volumes
from ..meshing.refinement import edges_on_planes
from ..surface import Surface
from .evolver_reading import ROUNDING, read
from .mesh_data import FREE, SLIDING, given_support
from .text import escaped, format_rows

__all__ = ["read", "write"]

SPECIAL = "\\*"  # in names: the program joins lines at a backslash, and "/*" begins a comment

HEADER = """\
// Piecewise constant-mean-curvature surface, written by pcmc.
// total_energy is E = sum tension * area - sum pressure * volume, volumes seen from the origin.
// Pressures are net: those of the air less the snow, an attribute of faces.
// origin {origin}
{names}
SPACE_DIMENSION 3
SYMMETRIC_CONTENT
DEFINE FACET ATTRIBUTE patch INTEGER

"""


def write(path: Path, surface: Surface, bare: Collection[str] = (), **_: Any) -> None:
    """The datafile of a surface."""
    edges = surface.topology.edges + 1
    patches = list(enumerate(surface.patches, 1))
    weights = np.unique(surface.weights[surface.weights != 0.0]).tolist()
    face_tags = []
    for k, p in patches:
        snow = f" snow {p.snow!r}" if p.snow else ""
        weight = f" weight {p.weight!r} self_weight_{1 + weights.index(p.weight)}" if p.weight else ""
        face_tags.append(f" tension {p.tension!r} patch {k}{snow}{weight}")
    face_tag = np.array(face_tags)
    origin = surface.origin if surface.on_planes else np.array(surface.plane.point)
    X = surface.vertices - origin
    sides = ((surface.topology.edge_of_face + 1) * surface.topology.sense)[:, [2, 0, 1]]
    header = HEADER.format(
        origin=" ".join(map(repr, origin.tolist())),
        names="\n".join(
            [f"// patch {k} {escaped(p.name, SPECIAL)}" for k, p in patches]
            + [f"// bare {k} {escaped(p.name, SPECIAL)}" for k, p in patches if p.name in bare]
            + [f"// wall {k}" for k, p in patches if p.wall]
            + [f"// room {k} {escaped(room.name, SPECIAL)}" for k, room in enumerate(surface.rooms, 1)]
            + [f"// cable {k} {escaped(cable.name, SPECIAL)}" for k, cable in enumerate(surface.cables, 1)]
        ),
    )
    vertex_tag, edge_tag = _tags(surface)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(header + _constraints(surface, origin) + _attributes(surface, origin, weights))
        file.write("\nVERTICES\n")
        file.write(format_rows("%d %r %r %r%s\n", _count(X), *X.T, vertex_tag))
        file.write("\nEDGES\n")
        file.write(format_rows("%d %d %d%s\n", _count(edges), *edges.T, edge_tag))
        file.write("\nFACES\n")
        file.write(format_rows("%d %d %d %d%s\n", _count(sides), *sides.T, face_tag[surface.patch_of_face]))
        file.write("\nBODIES\n" + _bodies(surface) + "\nREAD\n")


def _count(rows: Ints | Floats) -> Ints:
    return np.arange(1, len(rows) + 1)


def _constraints(surface: Surface, origin: Floats) -> str:
    """Π and the other planes as constraints 1, 2, …, the latter with the content of their flat pieces."""
    pieces, text = flat_pieces(surface), ""
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
            text += (
                f"CONTENT\nC1: ({y!r})*z - ({z!r})*y\nC2: ({z!r})*x - ({x!r})*z\nC3: ({x!r})*y - ({y!r})*x\n"
            )
    for k, (patch, normal) in enumerate(zip(pieces.end_patch, pieces.normal, strict=True)):
        x, y, z = (-surface.net_pressures[patch] * normal).tolist()
        text += f"QUANTITY corner_{k} ENERGY METHOD VERTEX_SCALAR_INTEGRAL\n"
        text += f"SCALAR_INTEGRAND: ({x!r})*x + ({y!r})*y + ({z!r})*z\n"
    return text


def _attributes(surface: Surface, origin: Floats, weights: Sequence[float]) -> str:
    """The attributes of edges and faces, and a quantity for each weight, coordinates from ``origin`` (3,)."""
    text = "DEFINE EDGE ATTRIBUTE cable INTEGER\n" if surface.cables else ""
    text += "DEFINE FACET ATTRIBUTE snow REAL\n" if surface.snows.any() else ""
    text += "DEFINE FACET ATTRIBUTE weight REAL\n" if weights else ""
    height = "".join(f"({c!r})*{axis} + " for c, axis in zip(surface.plane.normal, "xyz", strict=True))
    height += f"({float(surface.plane.height(origin))!r})"
    for k, weight in enumerate(weights, 1):
        text += f"QUANTITY self_weight_{k} ENERGY METHOD FACET_SCALAR_INTEGRAL\n"
        text += f"SCALAR_INTEGRAND: ({weight!r})*({height})\n"
    return text


def _tags(surface: Surface) -> tuple[Any, Any]:
    """What follows the numbers of each vertex (n,) and of each edge (e,)."""
    kinds = np.array(["", " constraint 1", " fixed"])
    masks = [mask for _, mask in surface.on_planes]
    vertices = _with_constraints(kinds[given_support(surface)], masks).astype(object)
    for k, vertex in enumerate(flat_pieces(surface).end):
        vertices[vertex] += f" corner_{k}"
    edges = _with_constraints(kinds[_edge_support(surface)], edges_on_planes(surface)).astype(object)
    for k, cable in enumerate(surface.cables, 1):
        edges[surface.topology.edge_numbers(cable.edges)] += f" tension {cable.tension!r} cable {k}"
    return vertices, edges


def _with_constraints(tags: Any, masks: Sequence[Bools]) -> Any:
    """The tags with the numbers of the constraints 2, 3, … where each of the masks is set."""
    for number, mask in enumerate(masks, 2):
        first = np.strings.find(tags, "constraint") < 0
        more = np.where(first, f" constraint {number}", f" {number}")
        tags = np.strings.add(tags, np.where(mask, more, ""))
    return tags


def _edge_support(surface: Surface) -> Ints:
    """(e,) support of the boundary edges with held ends, for vertices that refinement puts there."""
    topo, support = surface.topology, given_support(surface)
    along = support[topo.edges].min(axis=1)
    off_plane = np.abs(surface.plane.height(surface.vertices)) > 1e-9 * surface.size
    along[(along == SLIDING) & off_plane[topo.edges].any(axis=1)] = FREE
    return np.where(topo.boundary_edge, along, FREE)


def _bodies(surface: Surface) -> str:
    """A body for each room, with its volume, and one for each net pressure beside that of a room.

    It is on the positive side of a face or, where a room is there, on the other.
    """
    text, pressures = "", surface.net_pressures
    side = np.where((surface.room_signs > 0.0).any(axis=0), -1, 1)[surface.patch_of_face]
    if surface.rooms:
        multipliers, pressures = _room_pressures(surface)
        beyond = room_volumes(surface) - surface.room_signs @ _cones(surface)
        for k, (room, signs) in enumerate(zip(surface.rooms, surface.room_signs, strict=True)):
            members = signs[surface.patch_of_face].astype(int) * _count(surface.faces)
            rest = f" volume {room.volume!r} volconst {float(beyond[k])!r}"
            text += _body(
                k + 1, members[members != 0], f"{rest} lagrange_multiplier {float(multipliers[k])!r}"
            )
    of_face = side * pressures[surface.patch_of_face]
    for body, pressure in enumerate(np.unique(of_face[of_face != 0.0]), 1 + len(surface.rooms)):
        members = (side * _count(surface.faces))[of_face == pressure]
        text += _body(body, members, f" pressure {float(pressure)!r}")
    return text


def _body(number: int, members: Ints, rest: str) -> str:
    words = members.astype(str)
    lines = [" ".join(words[k : k + 15]) for k in range(0, len(words), 15)]
    return f"{number} " + " \\\n  ".join(lines) + f"{rest}\n"


def _cones(surface: Surface) -> Floats:
    """(k,) the volumes of the patches' cones seen from the point of Π, as the program sees them."""
    corners = surface.vertices[surface.faces] - np.array(surface.plane.point)
    volumes = np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    of_patch = np.bincount(surface.patch_of_face, volumes, len(surface.patches)).astype(float)
    return add_plane_volumes(surface, surface.vertices, of_patch)


def _room_pressures(surface: Surface) -> tuple[Floats, Floats]:
    """(r,) the pressures of the rooms, and (k,) the net ones of the patches beside them, as of snow."""
    signs = surface.room_signs
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
    return multipliers, left
