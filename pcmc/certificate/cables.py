"""Where cables are too weak for the sheets along them, and how far they sag."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ..base.arrays import Floats, Ints
from ..base.errors import OptionError, SurfaceError
from ..base.tolerances import ON
from ..surface import Surface
from ..surface.geometry import cross_2d
from ..surface.parts import image_names
from ..surface.pieces import two_digits
from ..surface.symmetry import mirrored
from .forces import cable_parts
from .proof import WeakCable


class Chord(NamedTuple):
    """The straight line between the two ends of a cable, and where its vertices are beside it."""

    vertices: Ints  # (k,) of the cable, its two ends last
    ends: Ints  # (2,) of the chord; twice the same vertex for a vertex and its mirror image
    share: Floats  # (k,) of the chord that the vertices are at
    out: Floats  # (k,3) from it to them
    length: float


def chord(surface: Surface, of: str) -> Chord:
    """The chord of a cable. Where it ends in a mirror plane, in which nothing fixes it, it goes on behind, so
    there its chord is that of the whole cable, from the other end to its image. OptionError for a cable that
    is closed, branched or in several parts, or goes on behind mirror planes at both ends.
    """
    vertices, count = np.unique(surface.cables[surface.cable_index(of)].edges, return_counts=True)
    order = np.asarray(vertices[np.argsort(count == 1, kind="stable")])
    ends = _chord_ends(surface, order)
    if (count > 2).any() or (count == 1).sum() != 2 or ends is None:
        message = f"sag of {of}: the cable is closed, branched or in several parts, so it has no chord"
        raise OptionError(f"{message}; give each span a cable of its own", what="of", found=of)
    numbers, (first, last) = ends
    X, across = surface.vertices[order], last - first
    share = (X - first) @ across / (across @ across)
    return Chord(order, numbers, share, X - first - share[:, None] * across, float(np.linalg.norm(across)))


def _chord_ends(surface: Surface, cable: Ints) -> tuple[Ints, Floats] | None:
    """(2,) vertices and (2,3) places of a chord's ends, of a cable (k,) with its ends last; None behind two
    mirror planes."""
    ends, found = cable[-2:], []
    for end, other in (ends, ends[::-1]):
        for plane, on in surface.on_planes:
            if plane.mirror and on[end] and not on[cable].all() and not surface.pinned[end]:
                place = surface.vertices[other]
                image = place - 2.0 * plane.height(place) * np.array(plane.normal)
                found.append((ends[ends == other].repeat(2), np.stack([place, image])))
    if len(found) > 1:
        return None
    return found[0] if found else (ends, surface.vertices[ends])


def too_long(surface: Surface) -> str:
    """Names a cable along a free edge whose chord is over 2 τ/α, the diameter of its arc; or empty.

    In a plane no arc is as wide, so a flat sheet is not at rest there; another one hardly.
    """
    for cable, curve in cable_parts(surface):
        if curve.closed or len(curve.sheets) != 1 or cable.weight:
            continue
        if (ends := _chord_ends(surface, np.roll(curve.vertices, -1))) is None:
            continue
        chord = float(np.linalg.norm(ends[1][1] - ends[1][0]))
        tension, widest = float(surface.tensions[curve.sheets[0]]), 2.0 * cable.tension
        if chord * tension > widest:
            half, enough = 0.5 * chord * tension, two_digits(chord * tension, math.ceil)  # of an arc of 60°
            text = f"cable {cable.name!r} spans {chord:.4g}, more than 2 τ/α = {widest / tension:.4g}, the"
            text += f" diameter of the arc along a flat edge; raise its tension, well beyond {half:.3g}"
            return f"{text} (in a plan, cable = {enough:g}), or put a support between"
    return ""


def weak_cable(surface: Surface) -> WeakCable | None:
    """A cable that is too weak for the free edge of a flat sail, whatever its shape; or None.

    Without pressure and weight, and with all that is fixed in one plane, a sail at rest is flat. With h the
    distance from that plane and e its normal, h e vanishes at what is fixed, and the first variation along it
    is Σ α ∫|∇h|² dA + Σ τ ∫ h'² ds = 0. Along a free edge of a flat sheet a cable has the curvature α/τ,
    towards the sheet: it is an arc of radius r = τ/α, which turns by θ with L = 2 r sin(θ/2), L the distance
    of its ends. So τ = α L / (2 sin(θ/2)) ≥ α L/2.

    An immersed disc (one sheet, one boundary, nothing held inside) has at each corner the angle
    γ = β - θ/2 - θ'/2 + 2 π k, with the angle β of the polygon of the chords, and the turns θ, θ' of the
    edges beside it, 0 of a held one. As 0 ≤ γ ≤ 2 π and β < 2 π, k ≥ 0. The disc has Σ (π - γ) - Σ θ = 2 π,
    the polygon Σ (π - β) = 2 π, so Σ k = 0, every k = 0, and θ + θ' ≤ 2 β. The least factor f on both
    tensions obeys asin(α L/(2 f τ)) + asin(α L'/(2 f τ')) = β, and φ is θ there: f τ = α L / (2 sin(φ/2)).
    Of a piece between mirror planes the whole is looked at.

    >>> from pcmc import Cable, Patch
    >>> corners = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]
    >>> middles = [[1, 0.1, 0], [1.9, 1, 0], [1, 1.9, 0], [0.1, 1, 0], [1, 1, 0]]
    >>> ring = [[0, 4], [4, 1], [1, 5], [5, 2], [2, 6], [6, 3], [3, 7], [7, 0]]
    >>> sail = Surface(corners + middles, [[*edge, 8] for edge in ring], [0] * 8, [Patch("sail", 1.0, 0.0)],
    ...                fixed=range(4), cables=[Cable("rope", 1.2, ring)])
    >>> print(weak_cable(sail))
    cable 'rope' is too weak for a flat sail: 1.2 < α L / (2 sin(φ/2)) = 1.414, L = 2, φ = 90°; raise it
    """
    piece = surface
    if surface.on_planes and len(surface.cable_edges.ends) and all(p.mirror for p, _ in surface.on_planes):
        try:
            surface = mirrored(surface)
        except SurfaceError:  # its images never end, or overlap
            return None
    plane = _plane_of_sail(surface)
    if plane is None:
        return None
    topo, fixed = surface.topology, surface.fixed
    found: tuple[float, WeakCable | None] = 1.0 + ON, None
    alpha = float(surface.tensions[surface.patch_of_face[0]])
    inner = fixed[topo.edges].all(axis=1) & ~topo.boundary_edge
    disc = surface.n - len(topo.edges) + surface.m == 1 and not np.ptp(topo.components)
    disc = disc and bool(topo.on_boundary[fixed].all()) and not inner.any()
    for loop in topo.chains(topo.edges[topo.boundary_edge]):
        names, pulls = _sides(surface, loop.vertices)
        corners = surface.vertices[loop.vertices[fixed[loop.vertices]]] @ plane
        chords = np.roll(corners, -1, axis=0) - corners
        lengths = np.linalg.norm(chords, axis=1)
        arcs = np.nan_to_num(alpha * lengths / pulls)
        before, angles = np.roll(chords, 1, axis=0), np.full(len(arcs), math.inf)
        turns = np.arctan2(cross_2d(before, chords), np.einsum("ij,ij->i", before, chords))
        if disc and not np.isnan(pulls).any() and abs(abs(turns.sum()) - 2.0 * math.pi) < ON:
            angles = math.pi - np.sign(turns.sum()) * turns  # β, where the polygon turns once
        for k, beta in enumerate(angles):
            beside, side = sorted((k - 1, k), key=lambda i: arcs[i])
            factor = _least_factor(arcs[beside], arcs[side], beta)
            if factor > found[0]:
                turn = 2.0 * math.asin(min(1.0, 0.5 * arcs[side] / factor))
                numbers = (float(x) for x in (pulls[side], factor * pulls[side], lengths[side], turn))
                name = image_names(piece, surface).get(names[side], names[side])
                found = factor, WeakCable(name, *numbers)
    return found[1]


def _plane_of_sail(surface: Surface) -> Floats | None:
    """(3,2) directions of the plane in which a sail of one tension lies at rest; None if there is none."""
    topo, X = surface.topology, surface.vertices[surface.fixed]
    loads = surface.net_pressures.any() or surface.heavy or bool(surface.rooms)
    slides = surface.on_plane.any() or bool(surface.on_planes or surface.given_supports.on_line)
    tensions = surface.tensions[surface.patch_of_face]
    outer = topo.boundary_edge[topo.edge_numbers(surface.cable_edges.ends)]
    if loads or slides or not len(outer) or not outer.all() or topo.valence.max() > 2 or len(X) < 2:
        return None
    _, sizes, axes = np.linalg.svd(X - X.mean(axis=0))
    flat = len(X) < 3 or sizes[2] <= ON * sizes[0]
    return axes[:2].T if flat and not np.ptp(tensions) and tensions[0] > 0.0 else None


def _sides(surface: Surface, loop: Ints) -> tuple[list[str], Floats]:
    """The cable along each side of a boundary (k,), from one fixed vertex to the next, and its tension.

    The tension is infinite along a held edge, and NaN where no single cable runs along all of a side.
    """
    topo, held = surface.topology, np.flatnonzero(surface.fixed[loop])
    rope = np.full(len(topo.edges), -1)
    for number, cable in enumerate(surface.cables):
        rope[topo.edge_numbers(cable.edges)] = number if cable.tension > 0.0 else -1
    along = rope[topo.edge_numbers(np.stack([loop, np.roll(loop, -1)], axis=1))]
    names, pulls = [], []
    for first, last in pairwise([*held, *(held[:1] + len(loop))]):
        ropes = np.unique(np.take(along, np.arange(first, last), mode="wrap"))
        known = len(ropes) == 1 and ropes[0] >= 0
        names.append(surface.cables[ropes[0]].name if known else "")
        tension = surface.cables[ropes[0]].tension if known else math.nan
        pulls.append(math.inf if last == first + 1 else tension)
    return names, np.array(pulls)


def _least_factor(small: float, large: float, angle: float) -> float:
    """The least f with asin(small/2f) + asin(large/2f) ≤ angle, and large/2f ≤ 1."""
    least = 0.5 * large

    def excess(factor: float) -> float:
        return math.asin(0.5 * small / factor) + math.asin(min(1.0, 0.5 * large / factor)) - angle

    if least == 0.0 or excess(least) <= 0.0 or angle < ON:
        return least
    return float(brentq(excess, least, 2.0 * (small + large) / min(1.0, angle)))
