"""The table of supports: each line, point, plane, mirror and end of a cable that holds a surface."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from ..base.arrays import Bools, Floats, Ints
from ..surface import Plane, Surface
from ..surface.geometry import segment_lengths
from ..surface.topology import POINT, EdgeCurve, vertex_kind
from .cables import cable_ends
from .reactions import SupportForces, at_both_ends, held_boundary, sheet_pulls
from .tables import middle, names_of

COLUMNS = ["support", "name", "kind", "length", *"xyz", "force_x", "force_y", "force_z"]
COLUMNS += ["moment_x", "moment_y", "moment_z", "per_length_max"]
LETTERS = {"point": "S", "cable end": "C"}  # of the kinds whose forces act at one point; B for the others
STEEP = 1e-9  # of a normal's part along that of Π, up to which a plane is upright


class _Part(NamedTuple):
    """A support."""

    name: str
    kind: str
    vertices: Ints  # (k,)
    forces: Floats  # (k,3) its share of the force at each
    length: float
    place: Floats  # (3,)
    edges: Ints = np.empty(0, dtype=np.int64)  # (j,)
    pulls: Floats = np.empty((0, 3))  # (j,3) along each edge, force/length


def support_table(acting: SupportForces) -> pd.DataFrame:
    """A row per support of the part of a surface that stands; together they carry all its reactions.

    Where curves meet in a corner, they share its force equally.

    Columns: ``support``, the number in plans and reports: B1, B2, … for what is as long as a curve, S1, S2, …
    for points, C1, C2, … for ends of cables. ``name``, that of the patches there, or of the cables.
    ``kind``: "line", a boundary or line inside that is held; "ground", what slides or rests on Π; "upright
    plane" ("plane" if it leans), across which what slides in it is held; "mirror", the pull of the image;
    "point", a single fixed point with the cables that end there; "cable end", the force of cables that end
    on a line, which has no part in it. ``length``, 0 for points; ``x``, …, the middle; ``force_x``, …, of
    the support on the surface; ``moment_x``, …, that of these forces about the middle; ``per_length_max``,
    the largest of the ``pulls`` along its edges, NaN for points.
    """
    rows, surface = [], acting.surface
    for label, part in _labelled(acting):
        at = np.where(np.abs(part.place) <= 1e-12 * surface.size, 0.0, part.place)
        moment = np.cross(surface.vertices[part.vertices] - at, part.forces).sum(axis=0)
        most = float(np.linalg.norm(part.pulls, axis=1).max()) if len(part.pulls) else np.nan
        numbers = [part.length, *at, *part.forces.sum(axis=0), *moment, most]
        rows.append([label, part.name or label, part.kind, *map(float, numbers)])
    return pd.DataFrame(rows, columns=COLUMNS)


def pull_table(acting: SupportForces) -> pd.DataFrame:
    """A row per edge of the supports that are as long as a curve: where it is, and how it is pulled.

    Columns: ``support``, as in the table of supports; ``x``, ``y``, ``z``, the middle of the edge;
    ``length``; ``pull_x``, ``pull_y``, ``pull_z``, the force per length with which the support holds the
    sheets there, Σ (α + w z) n with their outward co-normals n: of a plane the part across it.
    """
    topo, X = acting.surface.topology, acting.surface.vertices
    rows: list[tuple[object, ...]] = []
    for label, part in _labelled(acting):
        ends = topo.edges[part.edges]
        numbers = [*X[ends].mean(axis=1).T, segment_lengths(X, ends), *part.pulls.T]
        rows += zip([label] * len(ends), *numbers, strict=True)
    return pd.DataFrame(rows, columns=["support", *"xyz", "length", "pull_x", "pull_y", "pull_z"])


def support_vertices(acting: SupportForces) -> dict[str, Ints]:
    """The vertices (k,) of each support, by its number in the table.

    >>> from pcmc import Patch, Surface
    >>> from pcmc.certificate.reactions import support_forces
    >>> flat = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("a", 1.0)], fixed=range(3))
    >>> {name: sorted(on.tolist()) for name, on in support_vertices(support_forces(flat)).items()}
    {'B1': [0, 1, 2]}
    """
    return {label: part.vertices for label, part in _labelled(acting)}


def boundary_view(supports: pd.DataFrame) -> pd.DataFrame:
    """The rows of a table of supports that are as long as a curve, as ``Certificate.boundaries`` has them."""
    names = {"name": "boundary"} | {f"force_{c}": f"reaction_{c}" for c in "xyz"}
    names |= {c: f"middle_{c}" for c in "xyz"}
    chosen = ["name", "length", *"xyz", "force_x", "force_y", "force_z", "per_length_max"]
    rows = supports[~supports["kind"].isin([*LETTERS])]
    return rows[chosen].rename(columns=names).reset_index(drop=True)


def _labelled(acting: SupportForces) -> Iterator[tuple[str, _Part]]:
    """Each support with its number."""
    count = {"B": 0, "S": 0, "C": 0}
    sources = _held_lines, _mirrors, _inner_lines, _planes, _points
    for part in (part for source in sources for part in source(acting)):
        letter = LETTERS.get(part.kind, "B")
        count[letter] += 1
        yield f"{letter}{count[letter]}", part


def held_curves(surface: Surface) -> tuple[EdgeCurve, ...]:
    """The curves of the held boundary but for mirror planes, each along one patch and one support."""
    topo, held = surface.topology, held_boundary(surface)
    stop = vertex_kind(topo.edges[topo.boundary_edge & ~surface.mirror_edge], surface.n) == POINT
    for keys in (_patch_of_edge(surface), _support_of_edge(surface)):
        for key in np.unique(keys[held]):
            there = np.zeros((2, surface.n), dtype=bool)
            there[0, topo.edges[held & (keys == key)]] = there[1, topo.edges[held & (keys != key)]] = True
            stop |= there.all(axis=0)
    return topo.chains(topo.edges[held], stop)


def _patch_of_edge(surface: Surface) -> Ints:
    """(e,) a patch at each edge: the patch, at the boundary."""
    patch = np.empty(len(surface.topology.edges), dtype=np.int64)
    patch[surface.topology.edge_of_face] = surface.patch_of_face[:, None]
    return patch


def _support_of_edge(surface: Surface) -> Ints:
    """(e,) what holds an edge: -2 where it cannot move, -1 for Π, else the number in ``on_planes``."""
    edges = surface.topology.edges
    support = np.where(at_both_ends(surface.pinned, edges), -2, -1)
    support[~at_both_ends(surface.pinned | surface.on_ground, edges)] = len(surface.on_planes)
    for k, (plane, mask) in enumerate(surface.on_planes):
        if not plane.mirror:
            support[(support > k) & at_both_ends(mask, edges)] = k
    return support


def _held_lines(acting: SupportForces) -> Iterator[_Part]:
    """The held boundary."""
    surface, curves = acting.surface, held_curves(acting.surface)
    support = _support_of_edge(surface)
    planes = [_kind(surface, plane) for plane, _ in surface.on_planes]
    kinds = [*planes, "plane", "line", "ground"]  # -2 and -1 count from the end
    for curve, forces in zip(curves, _shared(acting.along, [c.vertices for c in curves]), strict=True):
        kind = kinds[support[surface.topology.edge_numbers(curve.pairs[:1])[0]]]
        yield _line(acting, kind, curve, forces)


def _mirrors(acting: SupportForces) -> Iterator[_Part]:
    """The pull of the image along each curve in a mirror plane, and of single vertices there."""
    surface, topo = acting.surface, acting.surface.topology
    patch = _patch_of_edge(surface)
    for k, (plane, mask) in enumerate(surface.on_planes, start=1):
        if not plane.mirror:
            continue
        edges = surface.mirror_edge & at_both_ends(mask, topo.edges)
        curves = [c for p in np.unique(patch[edges]) for c in topo.curves_among(edges & (patch == p))]
        pull, normal = acting.by_plane[k], np.array(plane.normal)
        groups = [curve.vertices for curve in curves]
        for curve, forces in zip(curves, _shared(pull, groups), strict=True):
            across = np.outer(sheet_pulls(acting.standing, curve.pairs) @ normal, normal)
            yield _line(acting, "mirror", curve, forces, f" in the {plane}", across)
        yield from _others(acting, "mirror", pull, mask, groups, f"single points in the {plane}")


def _inner_lines(acting: SupportForces) -> Iterator[_Part]:
    """The lines inside the surface that are held."""
    topo = acting.surface.topology
    chosen = acting.lines.all(axis=1) & ~topo.boundary_edge & at_both_ends(acting.clamped, topo.edges)
    curves, along = topo.curves_among(chosen), np.where(acting.on_boundary[:, None], 0.0, acting.along)
    for curve, forces in zip(curves, _shared(along, [c.vertices for c in curves]), strict=True):
        yield _line(acting, "line", curve, forces, ", inside")


def _planes(acting: SupportForces) -> Iterator[_Part]:
    """What Π and the planes carry away from the held boundary: upright walls, and junctions at rest."""
    surface, standing = acting.surface, acting.standing
    inside = ~acting.clamped & ~acting.on_boundary
    at_rest = standing.on_ground | (acting.by_plane[0].any(axis=1) & ~acting.clamped)
    for k, (plane, mask) in enumerate([(surface.plane, at_rest), *surface.on_planes]):
        if plane.mirror or not (mask & inside).any():
            continue
        kind = "ground" if k == 0 else _kind(surface, plane)
        where = ", at rest" if k == 0 else f", {kind.split()[0]}"
        where = f" in the {plane}" if plane.name else where
        listed = np.where(acting.lengths[:, None] > 0.0, acting.cables[k], 0.0)  # as ends of cables
        pull = np.where(inside[:, None], acting.by_plane[k] - listed, 0.0)
        groups = _groups_on_plane(acting, mask, inside, walls=k > 0)
        vertices = [vertices for _, vertices, _ in groups]
        for (name, on, edges), forces in zip(groups, _shared(pull, vertices), strict=True):
            ends = surface.topology.edges[edges]
            lengths = segment_lengths(surface.vertices, ends)
            points = surface.vertices[ends].mean(axis=1) if len(edges) else surface.vertices[on]
            place = np.average(points, axis=0, weights=lengths if lengths.sum() > 0.0 else None)
            pulled = edges[acting.lines[edges].any(axis=1)]
            length = float(lengths.sum())
            yield _Part(name + where, kind, on, forces, length, place, pulled, acting.pulls[pulled])
        yield from _others(acting, kind, pull, mask & inside, vertices, f"single points{where}")


def _groups_on_plane(
    acting: SupportForces, mask: Bools, inside: Bools, walls: bool
) -> list[tuple[str, Ints, Ints]]:
    """Name, vertices and edges of what one plane carries: walls that lie in it, then curves of junctions."""
    surface, topo = acting.surface, acting.surface.topology
    held = (topo.junction_edge | topo.seam_edge) & at_both_ends(mask | acting.clamped, topo.edges)
    flat = mask[surface.faces].all(axis=1)
    groups: list[tuple[str, Ints, Ints]] = []
    done = np.zeros_like(inside)
    for wall in np.unique(surface.patch_of_face[flat]).tolist() if walls else ():
        faces = flat & (surface.patch_of_face == wall)
        edges = np.unique(topo.edge_of_face[faces])
        groups.append((surface.patches[wall].name, np.unique(surface.faces[faces]), edges[held[edges]]))
        done[surface.faces[faces]] = True
    for curve in topo.curves_among(held & (mask & inside & ~done)[topo.edges].any(axis=1)):
        edges = np.sort(topo.edge_numbers(curve.pairs))
        groups.append((_unique_names(surface, curve), curve.vertices, edges))
    return groups


def _points(acting: SupportForces) -> Iterator[_Part]:
    """The single fixed points, and the vertices of lines where cables end, with the force of these."""
    X, names = acting.surface.vertices, dict[int, list[str]]()
    for v in np.flatnonzero(acting.single)[:, None]:
        yield _Part("", "point", v, acting.points[v], 0.0, X[v[0]])
    for cable, vertex, _ in cable_ends(acting.standing):
        names.setdefault(vertex, []).append(cable.name)
    for v in sorted(names):
        if acting.lengths[v] > 0.0 and acting.points[v].any():
            yield _Part(" + ".join(names[v]), "cable end", np.array([v]), acting.points[[v]], 0.0, X[v])


def _line(
    acting: SupportForces,
    kind: str,
    curve: EdgeCurve,
    forces: Floats,
    where: str = "",
    pulls: Floats | None = None,
) -> _Part:
    """A support along a curve; the ``pulls`` (k,3) along its edges are those of the lines if not given."""
    surface = acting.surface
    edges = surface.topology.edge_numbers(curve.pairs)
    pulls = acting.pulls[edges] if pulls is None else pulls
    length = float(segment_lengths(surface.vertices, curve.pairs).sum())
    place = np.array(list(middle(surface, curve).values()))
    name = _unique_names(surface, curve) + where
    return _Part(name, kind, curve.vertices, forces, length, place, edges, pulls)


def _shared(forces: Floats, groups: Sequence[Ints]) -> list[Floats]:
    """The forces (n,3) at the vertices of each group; groups with a vertex in common share its force."""
    count = np.zeros(len(forces))
    for vertices in groups:
        count[vertices] += 1.0
    return [forces[vertices] / count[vertices, None] for vertices in groups]


def _others(
    acting: SupportForces, kind: str, forces: Floats, mask: Bools, groups: Sequence[Ints], name: str
) -> Iterator[_Part]:
    """The vertices of a mask with a force that are in none of the groups, as one support."""
    left = mask & forces.any(axis=1)
    left[[v for group in groups for v in group]] = False
    vertices = np.flatnonzero(left)
    if len(vertices):
        place = acting.surface.vertices[vertices].mean(axis=0)
        yield _Part(name, kind, vertices, forces[vertices], 0.0, place)


def _kind(surface: Surface, plane: Plane) -> str:
    steep = abs(float(np.dot(plane.normal, surface.plane.normal))) <= STEEP
    return "upright plane" if steep else "plane"


def _unique_names(surface: Surface, curve: EdgeCurve) -> str:
    return names_of(surface, dict.fromkeys(curve.sheets))
