"""What supports could carry of the loads, and proofs that no smooth surface is at rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..base.arrays import Bools, mask_of
from ..base.tolerances import EXCESS, HARDLY, ON, PARALLEL
from ..forces.cables import cable_pulls
from ..forces.pinching import standing_part
from ..surface import Surface
from ..surface.geometry import area_vectors, edge_vectors, segment_lengths
from ..surface.pieces import point_text
from ..surface.supports import common_point, uncancelled_pressures
from ..surface.values import balanced_wall
from .forces import at_both_ends, held_boundary, loads
from .proof import Overload, UnbalancedJunction, Unheld


def load_name(surface: Surface) -> str:
    """What sentences call the load: "pressure", "net pressure" less snow, "weight", or "load" for several."""
    if surface.heavy:
        return "load" if surface.net_pressures.any() else "weight"
    return "net pressure" if surface.snows.any() else "pressure"


def load_ratio(surface: Surface) -> float:
    """Pressure and weight along Π's normal over the most that tension at the supports could carry.

    Vertical balance of the whole: p |Ω| ≤ Σ α length(∂Ω) + Σ α_wall length(wall feet), along the held
    boundary. Fixed lines inside the surface carry, too: Σ α of all their sheets per length. So do single
    held vertices, at most what their triangles pull; and cables, τ at each end on a support. A free edge
    carries nothing. With weights, α + w z stands for α, and Σ w A counts against the pressure. 0 for a closed
    surface that nothing holds. Of several connected parts, that of the worst. Load and capacity may depend on
    the shape; ``overload`` is the proof.
    """
    topo = surface.topology
    fixed = at_both_ends(surface.fixed, topo.edges)
    outer = topo.boundary_edge & fixed
    # edges that cut off one triangle between two held edges
    corners = mask_of(topo.edge_of_face[outer[topo.edge_of_face].sum(axis=1) > 1], len(fixed))
    carrying = held_boundary(surface) | (fixed & (topo.boundary_edge | ~corners))
    return _load_over_capacity(surface, carrying)


def overload(surface: Surface) -> Overload | None:
    """Load over capacity, if no smooth surface with these supports can carry its load; else None.

    Where ``load_is_given``, both are the same for every shape. The capacity is then an upper bound: a sheet
    pulls at an edge with its tension α per length, whatever its direction, and an edge between two fixed
    vertices counts with all its sheets, whether it is held or only cuts off a corner of the mesh.

    >>> from pcmc import Patch
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> tent = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("tent", 0.2)], fixed=range(4))  # p |Ω| = 4, α length(∂Ω) = 1.6
    >>> print(overload(tent))
    the pressure is 2.50 times what the boundary's tension could carry on any smooth surface
    """
    if not (surface.net_pressures.any() and load_is_given(surface)):
        return None
    ratio = _load_over_capacity(surface, np.asarray(surface.pinned[surface.topology.edges].all(axis=1)))
    return Overload(ratio, load_name(surface)) if ratio > 1.0 + EXCESS else None


def load_is_given(surface: Surface) -> bool:
    """Whether load and capacity are the same for every shape that has these supports.

    The load of pressures p is Σ p n·∫ν dA = ½ Σ_e [p]_e n·(a × b) by Stokes' theorem, over the edges e from
    a to b at which the pressures of the sheets leave [p]_e ≠ 0. These must not move: both ends are fixed, or
    both slide in one plane along Π's normal n. In such a plane at a distance d from Π's point an edge adds
    d [p]_e times its length along Π, so that a chain of edges adds what its ends do, and these are fixed or
    in two such planes.

    The capacity is that of fixed edges and of cables' ends. So what pulls may not slide on Π, and nothing
    on a leaning plane, where the length that carries varies, or along lines. No single vertex may be held: it
    carries nothing on a smooth surface, but something on a mesh. There must be no weights and no prescribed
    volumes.
    """
    topo, pinned = surface.topology, surface.pinned
    pulling = surface.faces[surface.tensions[surface.patch_of_face] > 0.0]
    normals = [np.dot(plane.normal, surface.plane.normal) for plane, _ in surface.on_planes]
    varies = surface.rooms or surface.heavy or surface.given_supports.on_line
    if varies or surface.on_ground[pulling].any() or any(abs(float(up)) > PARALLEL for up in normals):
        return False
    alone = pinned.copy()
    alone[topo.edges[pinned[topo.edges].all(axis=1)]] = False
    masks = [pinned, *(mask for _, mask in surface.on_planes)]
    moving = uncancelled_pressures(topo, surface.net_pressures[surface.patch_of_face], masks)
    return not (alone.any() or moving.any())


def _load_over_capacity(surface: Surface, carrying: Bools) -> float:
    """Load over capacity of edges by their mask (e,) along Π's normal, in the worst connected part.

    Single vertices and the ends of cables carry, too.
    """
    topo, X, F, ends = surface.topology, surface.vertices, surface.faces, surface.cable_edges.ends
    parts, count = topo.components, int(topo.components.max()) + 1
    forces, first = loads(surface) @ np.array(surface.plane.normal), surface.nodes[:, 0]
    points = (len(forces) - len(ends)) // len(first)  # of the quadrature, on an element
    part = np.concatenate([np.repeat(parts[first], points), parts[ends[:, 0]]])
    load = np.abs(np.bincount(part, forces, count))

    pull = np.repeat(surface.tensions[surface.patch_of_face][:, None], 3, axis=1)  # at the sides' middles
    if surface.weights.any():
        height, weight = surface.plane.height(X)[F], surface.weights[surface.patch_of_face, None]
        pull += weight * (height.sum(axis=1, keepdims=True) - height) / 2.0
    pull = np.abs(pull)
    sheets = np.bincount(topo.edge_of_face.ravel(), pull.ravel(), len(topo.edges))
    lengths = segment_lengths(X, topo.sides[carrying])
    slides = ~surface.pinned[topo.edges[carrying]].all(axis=1)
    for plane, mask in surface.on_planes:  # a plane carries across itself; a mirror plane nothing at all
        steep = 0.0 if plane.mirror else abs(float(np.dot(plane.normal, surface.plane.normal)))
        lengths[slides & mask[topo.edges[carrying]].all(axis=1)] *= steep
    capacity = np.bincount(parts[topo.edges[carrying, 0]], sheets[carrying] * lengths, count)
    supports = surface.pinned | surface.on_ground
    single = (surface.fixed & ~topo.on_boundary) | (supports & topo.on_boundary)
    single[topo.edges[carrying]] = False
    if single.any():
        opposite = np.linalg.norm(edge_vectors(X[F]), axis=2)
        pulled = pull.mean(axis=1) * (opposite * single[F]).sum(axis=1)
        capacity = capacity + 0.5 * np.bincount(parts[F[:, 0]], pulled, count)
    last = supports[ends].sum(axis=1) == 1
    capacity = capacity + np.bincount(parts[ends[last, 0]], np.abs(cable_pulls(surface, X))[last], count)
    return float((load / np.where(capacity > 0.0, capacity, np.inf)).max())


def coarseness(surface: Surface) -> float:
    """(h / R)², h the mean length of the boundary's edges and R = 2 · area / length of the plan.

    The balance of a mesh has an error of about this size; 0 for a closed surface.

    >>> from pcmc import Patch
    >>> square = Surface([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], [[0, 1, 2], [2, 3, 0]],
    ...                  [0, 0], [Patch("floor", 1.0)], fixed=range(4))
    >>> coarseness(square)
    4.0
    """
    X, topo = surface.vertices, surface.topology
    length = segment_lengths(X, topo.sides[topo.boundary_edge & ~surface.mirror_edge])
    corners = X[surface.faces[~surface.auxiliary[surface.patch_of_face]]]
    plan = abs(float(area_vectors(corners).sum(axis=0) @ np.array(surface.plane.normal)))
    if not len(length) or plan == 0.0:
        return 0.0
    return float((length.mean() * length.sum() / (2.0 * plan)) ** 2)


def unbalanced(surface: Surface, pinchable: Bools, share: float = 1.0 + EXCESS) -> UnbalancedJunction | None:
    """A junction whose tensions cannot balance at any angles; None if there is none.

    Σ α n = 0 (7) needs the largest tension to be at most the sum of the others, or here ``share`` of it. A
    junction that is held all along is left out, as its support takes the difference, and so is one with a
    wall that slides on Π and is stronger than its sheets: it comes down to rest on Π. ``pinchable`` (k,)
    marks such walls. Nothing is known where a cable or pressures that do not cancel pull, too, or a sheet's
    weight changes its tension with the height.
    """
    held, numbers = surface.held, surface.topology.edge_numbers
    on_cable = numbers(surface.cable_edges.ends)
    for curve in surface.topology.junctions:
        sheets, edges = list(curve.sheets), numbers(curve.pairs)
        strongest = max(sheets, key=lambda patch: surface.tensions[patch])
        *others, largest = sorted(surface.tensions[sheets])
        excused = pinchable[strongest] or held[curve.vertices].all() or surface.weights[sheets].any()
        excused = excused or np.isin(edges, on_cable).any() or surface.uncancelled[edges].any()
        most = share if len(others) > 1 else 1.0 + EXCESS  # two of one tension go on into each other
        if largest > most * sum(others) and not excused:
            names = tuple(surface.patches[i].name for i in sheets)
            remedy = _remedy(surface, sheets)
            return UnbalancedJunction(names, float(largest), tuple(float(t) for t in others), remedy)
    return None


def strained_junction(surface: Surface) -> UnbalancedJunction | None:
    """A junction as in ``unbalanced`` whose tensions balance only with sheets nearly on each other.

    At the limit, 5 = 4.5 + 0.5, two of three lie on each other, and no mesh can follow.
    """
    return unbalanced(surface, standing_part(surface).walls.pinchable, HARDLY)


def hardly_balanced(surface: Surface, pinchable: Bools) -> str:
    """Names a ``strained_junction``; or empty."""
    strained = unbalanced(surface, pinchable, HARDLY)
    how = "could balance only with its sheets nearly on each other"
    return "" if strained is None else strained.told(how, "against") + strained.hint


def _remedy(surface: Surface, sheets: Sequence[int]) -> tuple[str, float, bool] | None:
    """A patch of a junction, a tension of it with which the junction balances, and whether it is a wall.

    A single wall is balanced; else the weakest sheet is made stronger. None if the sheets are one patch.
    """
    tensions, walls = surface.tensions, [i for i in sheets if surface.walls[i]]
    if len(walls) == 1:
        changed = walls[0]
        value = balanced_wall([[float(tensions[i]) for i in sheets if i != changed]])
    else:
        changed = min(sheets, key=lambda i: tensions[i])
        *others, largest = sorted(float(tensions[i]) for i in sheets if i != changed) or [0.0]
        value = largest if not others else 1.25 * largest - sum(others)
    name = surface.patches[changed].name
    return (name, float(value), bool(surface.walls[changed])) if value > 0.0 else None


def unheld(surface: Surface) -> Unheld | None:
    """A part without supports that shrinks, as nothing presses it, or falls under its weight; or None.

    A part around a room of prescribed volume cannot shrink. One under pressure has an equilibrium that is not
    stable (``growing_part``); that of a bubble of tension α is the sphere of radius 2 α/p.

    >>> from pcmc import Patch
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> tent = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("tent", 1.0)], on_plane=range(4))
    >>> unheld(tent), unheld(tent.retensioned(None, {"tent": 0.0})), growing_part(tent)[:42]
    (None, Unheld(vertex=0, falls=False), 'nothing fixes the part of the surface arou')
    """
    parts, patch = surface.topology.components, surface.patch_of_face
    resting = surface.supported.copy()
    resting[surface.topology.edges[surface.uncancelled != 0.0]] = True
    ends, _, weight = surface.cable_edges
    heavy = np.append(surface.faces[surface.weights[patch] > 0.0, 0], ends[weight > 0.0, 0])
    falling = np.setdiff1d(parts[heavy], parts[resting])
    if len(falling) and not ((surface.weights < 0.0).any() or (weight < 0.0).any()):
        return Unheld(int(np.flatnonzero(parts == falling[0])[0]), falls=True)
    for part, pressed in _scaled(surface):
        if not pressed and surface.tensions[patch[parts[surface.faces[:, 0]] == part]].any():
            return Unheld(int(np.flatnonzero(parts == part)[0]))
    return None


def growing_part(surface: Surface) -> str:
    """Names a part under pressure that nothing fixes, so that none of its equilibria is stable; or empty.

    Its homotheties about Π's point are free: E(s) = s² T - s³ P, or with cables s C + s² T - s³ P, where
    T = Σ α A and P = Σ p V. At rest C + 2 T = 3 P, and there E'' = 2 T - 6 P = -2 (T + C) < 0.
    """
    growing = next((part for part, pressed in _scaled(surface) if pressed), None)
    if growing is None:
        return ""
    vertex = np.flatnonzero(surface.topology.components == growing)[0]
    text = f"nothing fixes the part of the surface around vertex {vertex}: from every equilibrium it grows or"
    return f"{text} shrinks to nothing, so that none is stable; hold it, or prescribe its volume (rooms=)"


def _scaled(surface: Surface) -> list[tuple[int, bool]]:
    """The connected parts that may grow and shrink about a point, and whether there is pressure on them.

    Of a part that slides on several planes these must meet in a point, towards which it can shrink.
    """
    parts, used, given = surface.topology.components, surface.faces[:, 0], surface.given_supports
    pressed = np.unique(parts[used[surface.net_pressures[surface.patch_of_face] != 0.0]])
    held = given.fixed_and_sliding()[0]
    held[surface.images] = True  # it goes on: scaled, it would no longer meet itself
    beyond = surface.room_signs.any(axis=0) | (surface.weights != 0.0)
    held[surface.faces[beyond[surface.patch_of_face]]] = True
    held[surface.cable_edges.ends[surface.cable_edges.weight != 0.0]] = True
    loose = []
    for part in np.setdiff1d(parts[used], parts[held]):
        planes = [(surface.plane, given.on_plane), *surface.on_planes]
        there = [plane for plane, mask in planes if (mask & (parts == part)).any()]
        point = common_point(np.array(there[0].point), there) if len(there) > 1 else None
        if point is None or all(abs(plane.height(point)) <= ON * surface.size for plane in there):
            loose.append((part, bool(part in pressed)))
    return loose


def pressures_left_over(surface: Surface) -> str:
    """Names free edges where pressures do not cancel, so that the shape depends on Π's point; or empty."""
    edges = np.flatnonzero(surface.uncancelled)
    if not len(edges):
        return ""
    at = (surface.topology.edge_of_face == edges[0]).any(axis=1)
    names = " | ".join(surface.patches[k].name for k in np.unique(surface.patch_of_face[at]))
    place = point_text(surface.vertices[surface.topology.edges[edges[0]]].mean(axis=0), surface.size)
    return (
        f"along {len(edges)} edges that nothing holds ({names} near {place}) the pressures do not cancel:"
        f" {abs(surface.uncancelled[edges[0]]):.3g} is left over and acts from there to the point of Π, so"
        " the shape depends on that point; give a wall the pressure of one room less that of the other"
    )
