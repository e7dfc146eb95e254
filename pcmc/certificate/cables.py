"""Cables: their balance with the sheets along them, the forces at their ends, and where they are too weak."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from ..base.arrays import Floats, Ints
from ..base.errors import OptionError, SurfaceError
from ..forces.cables import directions, pull_along
from ..surface import Surface
from ..surface.geometry import cross_2d, segment_lengths
from ..surface.parts import Cable
from ..surface.symmetry import mirrored
from ..surface.topology import EdgeCurve
from .proof import WeakCable
from .tables import conormal_sum, middle

FLAT = 1e-9  # of the size: fixed points this near to one plane lie in it; the least excess that counts


def cable_table(surface: Surface, left: Floats) -> pd.DataFrame:
    """A row per cable, or per part of it between supports, branches and ends.

    At rest a cable of tension τ and curvature vector κ balances the sheets along it: Σ α n + τ κ = 0 with
    their outward co-normals n; so along the free edge of a flat sheet α = τ κ. Of triangles this holds in
    the mean over a cable's edges up to what the mesh leaves.

    Columns: ``cable``, ``tension`` (its force, the largest where a weight g lets it vary) and ``length``; the
    middle of the part; ``sheet_pull``, the mean of |Σ α n|, with the weight across the cable, and
    ``cable_pull``, that of (τ + g z) |κ|, force/length; ``force_left`` per length in the motion space, of
    ``left`` (n,3).
    """
    rows = []
    for cable, curve in _parts(surface):
        lengths, t = segment_lengths(surface.vertices, curve.pairs), _tangents(surface, curve.pairs)
        total = float(lengths.sum())
        turns = np.linalg.norm(t - np.roll(t, 1, axis=0) if curve.closed else np.diff(t, axis=0), axis=1)
        weight = 0.5 * (lengths + np.roll(lengths, 1)) if curve.closed else 0.5 * (lengths[1:] + lengths[:-1])
        pulls = conormal_sum(surface, surface.topology.edge_numbers(curve.pairs))
        if cable.weight:  # along the cable its tension takes up the weight
            load = -cable.weight * np.array(surface.plane.normal)
            pulls = pulls + load - (t @ load)[:, None] * t
        sheets = np.linalg.norm(pulls, axis=1)
        inner = curve.vertices if curve.closed else curve.vertices[1:-1]
        along = pull_along(surface, cable, inner)
        most = float(np.linalg.norm(left[inner], axis=1).max(initial=0.0))
        rows.append(
            {
                "cable": cable.name,
                "tension": float(pull_along(surface, cable, curve.vertices).max()),
                "length": total,
                **middle(surface, curve),
                "sheet_pull": float(sheets @ lengths) / (total or 1.0),
                "cable_pull": float(along @ turns) / (float(weight.sum()) or 1.0),
                "force_left": most / (float(lengths.mean()) or 1.0),
            }
        )
    return pd.DataFrame(rows)


def cable_end_table(surface: Surface) -> pd.DataFrame:
    """A row per end of each part of a cable: where it is, whether a support holds it, and the force.

    ``force_x``, ``force_y``, ``force_z`` is what a support there exerts on the cable: -(τ + g z) t, t the
    direction from the end along the cable. Where several cables end, their support carries the sum.
    """
    rows = [
        [cable.name, vertex, *surface.vertices[vertex].tolist(), bool(surface.held[vertex]), *force.tolist()]
        for cable, vertex, force in cable_ends(surface)
    ]
    columns = ["cable", "vertex", *"xyz", "held", "force_x", "force_y", "force_z"]
    return pd.DataFrame(rows, columns=columns if rows else None)


def cable_ends(surface: Surface) -> list[tuple[Cable, int, Floats]]:
    """Each end of a part of a cable: the cable, the vertex, and the force -(τ + g z) t (3,) that holds it."""
    return [
        (cable, int(pair[0]), -pull_along(surface, cable, pair[:1]) * _tangents(surface, pair[None])[0])
        for cable, curve in _parts(surface)
        if not curve.closed
        for pair in (curve.vertices[:2], curve.vertices[:-3:-1])
    ]


def chord(surface: Surface, of: str) -> tuple[Ints, Floats, Floats]:
    """The vertices (k,) of a cable, its two ends last, which share of the chord between these they are at,
    and how far out from it (k,3).

    Raises
    ------
    OptionError : for a cable that is closed, branched or in several parts.
    """
    vertices, count = np.unique(surface.cables[surface.cable_index(of)].edges, return_counts=True)
    if (count > 2).any() or (count == 1).sum() != 2:
        message = f"sag of {of}: the cable is closed, branched or in several parts, so it has no chord"
        raise OptionError(f"{message}; give each span a cable of its own", what="of", found=of)
    order = np.asarray(vertices[np.argsort(count == 1, kind="stable")])
    X = surface.vertices[order]
    across = X[-1] - X[-2]
    share = (X - X[-2]) @ across / (across @ across)
    return order, share, X - X[-2] - share[:, None] * across


def too_long(surface: Surface) -> str:
    """Names a cable along a free edge whose chord is over 2 τ/α, the diameter of its arc; or empty.

    In a plane no arc is as wide, so a flat sheet is not at rest there; another one hardly.
    """
    for cable, curve in _parts(surface):
        if curve.closed or len(curve.sheets) != 1 or cable.weight:
            continue
        chord = float(np.linalg.norm(np.diff(surface.vertices[curve.vertices[[0, -1]]], axis=0)))
        tension, widest = float(surface.tensions[curve.sheets[0]]), 2.0 * cable.tension
        if chord * tension > widest:
            step = 10.0 ** (math.floor(math.log10(chord * tension)) - 1)  # two digits, rounded up
            enough = math.ceil(chord * tension / step) * step  # an arc of 60°, 0.13 of its chord high
            return (
                f"cable {cable.name!r} spans {chord:.4g}, more than 2 τ/α = {widest / tension:.4g}, the"
                f" diameter of the arc along a flat edge; raise its tension, well beyond"
                f" {0.5 * chord * tension:.3g} (in a plan, cable = {enough:g}), or put a support between"
            )
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
    if surface.on_planes and len(surface.cable_edges.ends) and all(p.mirror for p, _ in surface.on_planes):
        try:
            surface = mirrored(surface)
        except SurfaceError:  # its images never end, or overlap
            return None
    plane = _plane_of_sail(surface)
    if plane is None:
        return None
    topo, fixed = surface.topology, surface.fixed
    found: tuple[float, WeakCable | None] = 1.0 + FLAT, None
    alpha = float(surface.tensions[surface.patch_of_face[0]])
    inner = fixed[topo.edges].all(axis=1) & ~topo.boundary_edge
    disc = surface.n - len(topo.edges) + surface.m == 1 and not np.ptp(topo.components)
    disc = disc and bool(topo.on_boundary[fixed].all()) and not inner.any()
    for loop in topo.chains(topo.edges[topo.boundary_edge], np.zeros(surface.n, dtype=bool)):
        names, pulls = _sides(surface, loop.vertices)
        corners = surface.vertices[loop.vertices[fixed[loop.vertices]]] @ plane
        chords = np.roll(corners, -1, axis=0) - corners
        lengths = np.linalg.norm(chords, axis=1)
        arcs = np.nan_to_num(alpha * lengths / pulls)
        angles = _angles(chords) if disc and not np.isnan(pulls).any() else np.full(len(arcs), math.inf)
        for k, beta in enumerate(angles):
            beside, side = sorted((k - 1, k), key=lambda i: arcs[i])
            factor = _least_factor(arcs[beside], arcs[side], beta)
            if factor > found[0]:
                turn = 2.0 * math.asin(min(1.0, 0.5 * arcs[side] / factor))
                numbers = (float(x) for x in (pulls[side], factor * pulls[side], lengths[side], turn))
                found = factor, WeakCable(names[side], *numbers)
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
    flat = len(X) < 3 or sizes[2] <= FLAT * sizes[0]
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


def _angles(chords: Floats) -> Floats:
    """(k,) the angle β at the start of each side (k,2) of a polygon; infinite where it does not turn once."""
    before = np.roll(chords, 1, axis=0)
    turns = np.arctan2(cross_2d(before, chords), np.einsum("ij,ij->i", before, chords))
    once = abs(abs(turns.sum()) - 2.0 * math.pi) < FLAT
    return np.asarray(math.pi - np.sign(turns.sum()) * turns if once else np.full(len(turns), math.inf))


def _least_factor(small: float, large: float, angle: float) -> float:
    """The least f with asin(small/2f) + asin(large/2f) ≤ angle, and large/2f ≤ 1."""
    least = 0.5 * large

    def excess(factor: float) -> float:
        return math.asin(0.5 * small / factor) + math.asin(min(1.0, 0.5 * large / factor)) - angle

    if least == 0.0 or excess(least) <= 0.0 or angle < FLAT:
        return least
    return float(brentq(excess, least, 2.0 * (small + large) / min(1.0, angle)))


def _tangents(surface: Surface, pairs: Ints) -> Floats:
    return directions(surface.vertices, pairs)[0]


def _parts(surface: Surface) -> list[tuple[Cable, EdgeCurve]]:
    """The parts of each cable of tension > 0 between its ends, branches and the supports in between.

    A support in between is a mast that it runs over: a fixed vertex beside one that moves.
    """
    parts = []
    for cable in surface.cables:
        if cable.tension > 0.0:
            mast = np.zeros(surface.n, dtype=bool)
            leading = cable.edges[surface.fixed[cable.edges].sum(axis=1) == 1]
            mast[leading] = surface.fixed[leading]
            parts += [(cable, curve) for curve in surface.topology.chains(cable.edges, mast)]
    return parts
