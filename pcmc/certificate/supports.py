"""The table of supports: each line, point, plane, mirror and end of a cable that holds a surface; balance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ..base.arrays import Bools, Floats, Ints, mask_of
from ..base.tolerances import FORCE_ROUNDING, PARALLEL, SAME_PLACE
from ..surface import Surface
from ..surface.geometry import segment_lengths
from ..surface.pieces import point_text
from ..surface.topology import POINT, EdgeCurve, vertex_kind
from .forces import Forces, at_both_ends, held_boundary, load_places, rounding_of, sheet_pulls
from .tables import middle, names_of

FORCE, MOMENT = (tuple(f"{kind}_{axis}" for axis in "xyz") for kind in ("force", "moment"))
COLUMNS = ["support", "name", "kind", "length", *"xyz", *FORCE, *MOMENT, "per_length_max"]
LETTERS = {"point": "S", "cable end": "C"}  # of the kinds whose forces act at one point; B for the others
COARSE = 0.05  # of the loads: above this the sentence about the balance adds a hint to refine
SLIGHT = 1e-12  # the weight of a plane beside a line, which alone can hold what acts along the plane
NONE: Ints = np.empty(0, dtype=np.int64)


class _Part(NamedTuple):
    """A support, or a group of vertices that share a force with others."""

    name: str
    kind: str
    vertices: Ints  # (k,)
    place: Floats  # (3,)
    edges: Ints = NONE  # (j,)
    pulls: Floats | None = None  # (j,3) along each edge, force/length, where they are not those of its lines
    forces: Floats = np.empty((0, 3))  # (k,3) its share of the force at each
    label: str = ""


def support_table(acting: Forces) -> pd.DataFrame:
    """A row per support of the part of a surface that stands; together they carry all its reactions.

    Where curves meet in a corner, each has half the pulls on its own edges there. The rest of the force,
    which vanishes as the mesh is refined, is shared equally by the lines, or by planes where there are none.

    Columns: ``support``, the number in plans and reports: B1, B2, … for what is as long as a curve, S1, S2, …
    for points, C1, C2, … for ends of cables. ``name``, that of the patches there, or of the cables.
    ``kind``: "line", a boundary or line inside that is held; "ground", what slides or rests on Π; "upright
    plane" ("plane" if it leans), across which what slides in it is held; "mirror", the pull of the image;
    "point", a single fixed point with the cables that end there; "cable end", the force of cables that end
    on a line, which has no part in it. ``length``, 0 for points; ``x``, …, the middle; ``force_x``, …, of
    the support on the surface; ``moment_x``, …, that of these forces about the middle; ``per_length_max``,
    the largest of the ``pulls`` along its edges, NaN for points.
    """
    rows, X, edges = [], acting.surface.vertices, acting.surface.topology.sides
    for part in _labelled(acting):
        at = np.where(np.abs(part.place) <= SAME_PLACE * acting.surface.size, 0.0, part.place)
        moment = np.cross(X[part.vertices] - at, part.forces).sum(axis=0)
        _, pulls = _pulled(acting, part)
        most = float(np.linalg.norm(pulls, axis=1).max()) if len(pulls) else np.nan
        force = part.forces.sum(axis=0)
        force[np.abs(force) <= rounding_of(part.forces)] = 0.0
        numbers = [segment_lengths(X, edges[part.edges]).sum(), *at, *force, *moment, most]
        rows.append([part.label, part.name or part.label, part.kind, *map(float, numbers)])
    return pd.DataFrame(rows, columns=COLUMNS)


def pull_table(acting: Forces) -> pd.DataFrame:
    """A row per edge of the supports that are as long as a curve: where it is, and how it is pulled.

    Columns: ``support``, as in the table of supports; ``x``, ``y``, ``z``, the middle of the edge;
    ``length``; ``pull_x``, ``pull_y``, ``pull_z``, the force per length with which the support holds the
    sheets there, Σ (α + w z) n with their outward co-normals n: of a plane the part across it.
    """
    topo, X = acting.surface.topology, acting.surface.vertices
    rows: list[tuple[object, ...]] = []
    for part in _labelled(acting):
        edges, pulls = _pulled(acting, part)
        ends = topo.sides[edges]
        numbers = [*X[ends].mean(axis=1).T, segment_lengths(X, ends), *pulls.T]
        rows += zip([part.label] * len(ends), *numbers, strict=True)
    return pd.DataFrame(rows, columns=["support", *"xyz", "length", "pull_x", "pull_y", "pull_z"])


def support_vertices(acting: Forces) -> dict[str, Ints]:
    """The vertices (k,) of each support, by its number in the table.

    >>> from pcmc import Patch, Surface
    >>> flat = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("a", 1.0)], fixed=range(3))
    >>> {name: sorted(on.tolist()) for name, on in support_vertices(Forces.of(flat)).items()}
    {'B1': [0, 1, 2]}
    """
    return {part.label: part.vertices for part in _labelled(acting)}


def held_lines(acting: Forces) -> Ints:
    """(k,) the rows of the table of supports that are curves of the held boundary, and held lines inside.

    >>> from pcmc import Patch, Surface
    >>> flat = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("a", 1.0)], fixed=range(3))
    >>> held_lines(Forces.of(flat)).tolist()
    [0]
    """
    boundary = len(held_curves(acting.surface))
    kinds = [part.kind for part in _labelled(acting)]
    return np.array([k for k, kind in enumerate(kinds) if k < boundary or kind == "line"], dtype=np.int64)


def line_shares(acting: Forces, name: str) -> tuple[Floats, Floats, Bools]:
    """What the held lines with a name take of the forces that they share: (n,) shares s and (e,2) halves c of
    the pulls at the ends of edges; and (e,) their own edges.

    The table's force is Σ s f over the vertices and Σ c L q over the ends of the edges of length L under the
    pulls q: c = ½ (δ - s) on the edges of lines, δ is 1 on the own ones. Without that name it is all lines.
    """
    topo, share = acting.surface.topology, np.zeros(acting.surface.n)
    halves, own = np.zeros(topo.edges.shape), np.zeros(len(topo.edges), dtype=bool)
    groups = [parts for _, parts in _held_lines(acting)]
    named = any(part.name == name for parts in groups for part in parts)
    for parts, there in zip(groups, (acting.on_boundary, ~acting.on_boundary), strict=True):
        taken, edges = np.zeros((2, acting.surface.n)), list[Ints]()
        for part in parts:
            chosen = part.name == name or not named
            taken[: 1 + chosen, part.vertices] += _weights(acting, part)
            own[part.edges] |= chosen
            edges.append(part.edges)
        share += np.divide(taken[1], taken[0], out=np.zeros_like(share), where=there & (taken[0] > 0.0))
        lines = np.concatenate([NONE, *edges])
        halves[lines] = 0.5 * there[topo.edges[lines]] * (own[lines, None] - share[topo.edges[lines]])
    return share, halves, own


def boundary_view(supports: pd.DataFrame) -> pd.DataFrame:
    """The rows of a table of supports that are as long as a curve, as ``Certificate.boundaries`` has them."""
    names = {"name": "boundary"} | {f"force_{c}": f"reaction_{c}" for c in "xyz"}
    names |= {c: f"middle_{c}" for c in "xyz"}
    chosen = ["name", "length", *"xyz", *FORCE, "per_length_max"]
    rows = supports[~supports["kind"].isin([*LETTERS])]
    return rows[chosen].rename(columns=names).reset_index(drop=True)


def balance_table(acting: Forces, supports: pd.DataFrame) -> pd.DataFrame:
    """Force and moment of the loads, of the supports, and what remains of both: a row each.

    The supports are the rows of their table. What remains are the forces at vertices that nothing holds: a
    mesh at rest balances along its normals; along the sheets forces are left, smaller ones on finer meshes.

    Columns: ``of``; ``force_x``, …, and ``moment_x``, …, about the middle of the surface's bounding box at
    ``x``, ``y``, ``z`` (what remains of moments is NaN of a periodic surface); ``force_share``,
    ``moment_share``, the largest component over the sum of the loads' sizes, triangle by triangle; without
    loads, over that of the supports.
    """
    X, force, columns = acting.standing.vertices, acting.loads, [*FORCE, *MOMENT, *"xyz"]
    about = 0.5 * (X.min(axis=0) + X.max(axis=0))
    arm = load_places(acting.standing) - about
    rows, moments, places = np.split(supports[columns].to_numpy(float), 3, axis=1)
    loads = np.array([force.sum(axis=0), np.cross(arm, force).sum(axis=0)])
    carried = np.array([rows.sum(axis=0), (moments + np.cross(places - about, rows)).sum(axis=0)])
    each = (force, arm) if force.any() else (rows, places - about)
    sizes, away = (np.linalg.norm(part, axis=1) for part in each)
    scale = np.array([sizes.sum(), sizes @ away])
    parts = np.array([loads, carried, loads + carried])
    if acting.surface.periodic:  # the forces across the seam have moments, and no resultant
        parts[2, 1] = np.nan
    pulled = float((supports["length"] * supports["per_length_max"]).sum())  # may cancel along each line
    most = np.maximum(scale, pulled * np.array([1.0, acting.surface.size]))
    parts[np.abs(parts) <= FORCE_ROUNDING * most[:, None]] = 0.0
    shares = np.abs(parts).max(axis=2) / np.where(scale > 0.0, scale, 1.0)
    values = np.column_stack([parts.reshape(3, 6), np.tile(about, (3, 1)), shares]).T
    columns = ["of", *columns, "force_share", "moment_share"]
    return pd.DataFrame(dict(zip(columns, [["loads", "supports", "remainder"], *values], strict=True)))


def balance_sentence(table: pd.DataFrame, mirrors: Sequence[str] = ()) -> str:
    """How exactly the supports carry the loads, of the piece between ``mirrors`` if there are any."""
    left = table.iloc[-1]
    force, moment = left["force_share"], left["moment_share"]
    share = f"to {force:.1g} of them in x, y and z"
    if np.isnan(moment):  # of a periodic surface
        return f"the supports carry the loads {share}" if table.iloc[0][[*FORCE]].any() else ""
    share += f", and to {moment:.1g} in moments"
    if not table.iloc[0][[*FORCE]].any():
        return f"the forces of the supports cancel {share}"
    place = point_text(left[[*"xyz"]].to_numpy(float))
    whose = " of the piece between the mirror planes" if mirrors else ""
    hint = "; the rest is what the mesh leaves along its sheets: refine it" if force > COARSE else ""
    return f"the supports carry the loads{whose} {share} about {place}{hint}"


def held_curves(surface: Surface) -> tuple[EdgeCurve, ...]:
    """The curves of the held boundary but for mirror planes, each along one patch and one support."""
    topo, held = surface.topology, held_boundary(surface)
    stop = vertex_kind(topo.edges[topo.boundary_edge & ~surface.mirror_edge], surface.n) == POINT
    for keys in (_patch_of_edge(surface), _support_of_edge(surface)):
        for key in np.unique(keys[held]):
            own, others = (mask_of(topo.edges[held & of], surface.n) for of in (keys == key, keys != key))
            stop |= own & others
    return topo.chains(topo.edges[held], stop)


def _labelled(acting: Forces) -> Iterator[_Part]:
    """Each support with its forces and its number."""
    count: dict[str, int] = dict.fromkeys("BSC", 0)
    for forces, parts, rest in _sources(acting):
        sharing = np.zeros(len(forces))
        for part in parts:
            sharing[part.vertices] += _weights(acting, part)
        if rest is not None:
            mask, name, kind = rest
            left = np.flatnonzero(mask & forces.any(axis=1) & (sharing == 0.0))
            if len(left):
                parts = [*parts, _Part(name, kind, left, acting.surface.vertices[left].mean(axis=0))]
                sharing[left] = _weights(acting, parts[-1])
        # no pulls where others, such as ends of members, take all
        pulls_at = np.asarray(forces.any(axis=1, keepdims=True))
        own = [(acting.half_pulls(*_pulled(acting, part)) * pulls_at)[part.vertices] for part in parts]
        every = np.zeros_like(forces)
        for part, pulled in zip(parts, own, strict=True):
            every[part.vertices] += pulled
        for part, pulled in zip(parts, own, strict=True):
            letter = LETTERS.get(part.kind, "B")
            count[letter] += 1
            share = (_weights(acting, part) / sharing[part.vertices])[:, None]
            share = pulled + share * (forces - every)[part.vertices]
            yield part._replace(forces=share, label=f"{letter}{count[letter]}")


def _sources(acting: Forces) -> Iterator[tuple[Floats, list[_Part], tuple[Bools, str, str] | None]]:
    """All supports, by the forces (n,3) that they share; the vertices of a mask (n,) that are in none of them
    are one more, of a name and kind."""
    surface, topo = acting.surface, acting.surface.topology
    support, patch = _support_of_edge(surface), _patch_of_edge(surface)
    upright = [abs(float(np.dot(p.normal, surface.plane.normal))) <= PARALLEL for p, _ in surface.on_planes]
    of_plane = ["upright plane" if steep else "plane" for steep in upright]
    kinds = [*of_plane, "plane", "line", "ground"]  # -2 and -1 count from the end
    boundary, within = _held_lines(acting)
    parts = [part._replace(kind=kinds[support[part.edges[0]]]) for part in boundary[1]]
    yield boundary[0], parts, None

    for k, (plane, mask) in enumerate(surface.on_planes, start=1):
        if plane.mirror:
            edges = surface.mirror_edge & at_both_ends(mask, topo.edges)
            curves = [c for p in np.unique(patch[edges]) for c in topo.curves_among(edges & (patch == p))]
            normal, parts = np.array(plane.normal), []
            for curve in curves:
                across = np.outer(sheet_pulls(acting.standing, curve.pairs) @ normal, normal)
                parts.append(_line(surface, "mirror", curve, f" in the {plane}", across))
            yield acting.by_plane[k], parts, (mask, f"single points in the {plane}", "mirror")

    yield *within, None

    inside, standing = ~acting.clamped & ~acting.on_boundary, acting.standing
    at_rest = standing.on_ground | (acting.by_plane[0].any(axis=1) & ~acting.clamped)
    for k, (plane, mask) in enumerate([(surface.plane, at_rest), *surface.on_planes]):
        if not plane.mirror and (mask & inside).any():
            kind = "ground" if k == 0 else of_plane[k - 1]
            where = ", at rest" if k == 0 else f", {kind.split()[0]}"
            where = f" in the {plane}" if plane.name else where
            ends = np.where(acting.lengths[:, None] > 0.0, acting.by_plane_ends[k], 0.0)  # of cables: below
            pull = np.where(inside[:, None], acting.by_plane[k] - ends, 0.0)
            parts = _on_plane(acting, mask, inside, kind, where)
            yield pull, parts, (mask & inside, f"single points{where}", kind)

    X, names = surface.vertices, dict[int, list[str]]()
    single = np.flatnonzero(acting.single)[:, None]
    yield acting.points, [_Part("", "point", v, X[v[0]]) for v in single], None
    for cable, vertex, _ in acting.cable_ends:
        if acting.lengths[vertex] > 0.0 and acting.points[vertex].any():
            names.setdefault(vertex, []).append(cable.name)
    cables = [_Part(" + ".join(names[v]), "cable end", np.array([v]), X[v]) for v in sorted(names)]
    yield acting.points, cables, None


def _held_lines(acting: Forces) -> tuple[tuple[Floats, list[_Part]], tuple[Floats, list[_Part]]]:
    """The forces (n,3) and the parts of the held boundary, and of the held lines inside the surface, where
    several sheets may end."""
    surface, topo = acting.surface, acting.surface.topology
    boundary = [_line(surface, "", curve) for curve in held_curves(surface)]
    chosen = acting.lines.all(axis=1) & ~topo.boundary_edge & at_both_ends(acting.clamped, topo.edges)
    within = [
        _line(surface, "line", c, "" if len({*c.sheets}) > 1 else ", inside")
        for c in topo.curves_among(chosen)
    ]
    return (acting.along, boundary), (np.where(acting.on_boundary[:, None], 0.0, acting.along), within)


def _on_plane(acting: Forces, mask: Bools, inside: Bools, kind: str, where: str) -> list[_Part]:
    """What a plane carries away from the held boundary: walls that lie in it, then curves of junctions."""
    surface, topo = acting.surface, acting.surface.topology
    held = (topo.junction_edge | topo.seam_edge) & at_both_ends(mask | acting.clamped, topo.edges)
    held &= ~at_both_ends(acting.clamped, topo.edges)  # there a line holds, as below a junction at rest
    flat = mask[surface.faces].all(axis=1) & (kind != "ground")
    groups: list[tuple[str, Ints, Ints]] = []
    done = np.zeros_like(inside)
    for wall in np.unique(surface.patch_of_face[flat]).tolist():
        faces = flat & (surface.patch_of_face == wall)
        edges = topo.edges_of(faces)
        done[surface.faces[faces]] = True
        if held[edges].any():
            groups.append((surface.patches[wall].name, np.unique(surface.faces[faces]), edges[held[edges]]))
    for curve in topo.curves_among(held & (mask & inside & ~done)[topo.edges].any(axis=1)):
        edges = np.sort(topo.edge_numbers(curve.pairs))
        groups.append((names_of(surface, dict.fromkeys(curve.sheets)), curve.vertices, edges))
    parts = []
    for name, vertices, edges in groups:
        ends = topo.edges[edges]
        lengths = segment_lengths(surface.vertices, ends)
        points = surface.vertices[ends].mean(axis=1) if len(edges) else surface.vertices[vertices]
        place = np.average(points, axis=0, weights=lengths if lengths.sum() > 0.0 else None)
        parts.append(_Part(name + where, kind, vertices, place, edges))
    return parts


def _line(surface: Surface, kind: str, curve: EdgeCurve, where: str = "", pulls: Any = None) -> _Part:
    """A support along a curve, with its pulls (j,3) where they are not those of its lines."""
    place, edges = np.array(list(middle(surface, curve).values())), surface.topology.edge_numbers(curve.pairs)
    name = names_of(surface, dict.fromkeys(curve.sheets)) + where
    return _Part(name, kind, curve.vertices, place, edges, pulls)


def _pulled(acting: Forces, part: _Part) -> tuple[Ints, Floats]:
    """The edges of a support along which it is pulled, and its pulls (j,3)."""
    if part.pulls is not None:
        return part.edges, part.pulls
    edges = part.edges[acting.lines[part.edges].any(axis=1)]
    return edges, acting.pulls[edges]


def _weights(acting: Forces, part: _Part) -> Floats:
    """(k,) how much of the rest of a force a support takes: a plane next to none where a line is clamped."""
    return np.where(acting.clamped[part.vertices] & (part.kind != "line"), SLIGHT, 1.0)


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
