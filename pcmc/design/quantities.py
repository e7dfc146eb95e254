"""What a design can aim at, with exact derivatives: heights, volumes, areas, curvatures, reactions.

A quantity q depends on the positions X and, some of them, on the tensions and pressures themselves:
dq = ⟨∂q/∂X, dX⟩ + Σ ∂q/∂α_i dα_i + Σ ∂q/∂p_i dp_i.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import OptionError, unknown
from ..certificate.balance import held_lengths, reactions
from ..energy import kernels
from ..plan.curves import frame
from ..surface import Surface
from ..surface.geometry import area_vectors, cross_2d, vertex_sums

KINDS = ("tension", "pressure")
FACTOR = 20.0  # a parameter without bounds may change by this factor, up or down


@dataclass(frozen=True)
class Target:
    """A quantity of a surface, and what it is to be.

    Parameters
    ----------
    quantity : ``"apex"``, greatest height over Π of a patch; ``"height"`` over a point of Π;
        ``"volume"`` (V_i of a patch, seen from the point of Π) and ``"area"``; ``"curvature"``,
        p / (2α), a patch's mean curvature at rest; ``"reaction"``, the greatest force per length
        that a patch's held boundary takes.
    of : name of the patch, or the point (x, y) in the coordinates of Π for ``"height"``. None: the
        patches under pressure together (the whole held boundary for ``"reaction"``); not for ``"curvature"``.
    value, at_most, at_least : what is wanted: a value, or a limit on one side or both. None of them
        where the quantity is only to be measured.

    Examples
    --------
    >>> Target("apex", "north", 2.5).label
    'apex of north'
    >>> Target("apx", "north")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: unknown quantity 'apx'; did you mean 'apex'? Known: apex, height, ...
    """

    quantity: str
    of: Any = None
    value: float | None = None
    at_most: float | None = None
    at_least: float | None = None

    def __post_init__(self) -> None:
        if self.quantity not in QUANTITIES:
            raise OptionError(unknown("quantity", self.quantity, QUANTITIES))
        if self.quantity == "height":
            object.__setattr__(self, "of", _point(self.of))
        elif not (isinstance(self.of, str) or (self.of is None and self.quantity != "curvature")):
            raise OptionError(f"{self.quantity}: expected the name of a patch, found {self.of!r}")
        for key in ("value", "at_most", "at_least"):
            _finite(getattr(self, key), f"{self.label}: {key}")
        if self.value is not None and (self.at_most, self.at_least) != (None, None):
            raise OptionError(f"{self.label}: give a value or limits, not both")
        least, most = self.at_least, self.at_most
        if least is not None and most is not None and most < least:
            raise OptionError(f"{self.label}: at_most {most} < at_least {least}")

    @property
    def label(self) -> str:
        """The quantity in words."""
        if self.quantity == "height":
            return f"height at ({self.of[0]:g}, {self.of[1]:g})"
        return self.quantity if self.of is None else f"{self.quantity} of {self.of}"

    @property
    def aimed(self) -> bool:
        """Whether a value or a limit is given."""
        return (self.value, self.at_most, self.at_least) != (None, None, None)

    def nearest(self, found: float) -> float:
        """The wanted value that is nearest to the one found."""
        if self.value is not None:
            return self.value
        low = -math.inf if self.at_least is None else self.at_least
        high = math.inf if self.at_most is None else self.at_most
        return min(max(found, low), high)


@dataclass(frozen=True)
class Parameter:
    """A tension or pressure that may vary.

    Parameters
    ----------
    patch : name of the patch.
    kind : ``"tension"`` or ``"pressure"``. With the pressure of a room that of its walls changes, which
        is the difference between the rooms, unless it is a parameter itself.
    low, high : bounds; by default a twentieth of the present value and twenty times it.

    >>> Parameter("wall", low=0.0, high=3.0).label
    'tension of wall'
    """

    patch: str
    kind: str = "tension"
    low: float | None = None
    high: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.patch, str):
            raise OptionError(f"Parameter: expected the name of a patch, found {self.patch!r}")
        if self.kind not in KINDS:
            raise OptionError(unknown("kind of parameter", self.kind, KINDS))
        _finite(self.low, f"{self.label}: low")
        _finite(self.high, f"{self.label}: high")

    @property
    def label(self) -> str:
        """The parameter in words."""
        return f"{self.kind} of {self.patch}"

    def of(self, surface: Surface) -> float:
        """Its value on a surface."""
        patch = surface.patches[surface.patch_index(self.patch)]
        return patch.tension if self.kind == "tension" else patch.pressure

    def bounds(self, surface: Surface) -> tuple[float, float]:
        """(low, high), with the defaults that follow from its present value."""
        present = self.of(surface)
        if present == 0.0 and None in (self.low, self.high):
            raise OptionError(f"{self.label} is 0 now; give low and high")
        ends = sorted((present / FACTOR, present * FACTOR))
        low = ends[0] if self.low is None else self.low
        high = ends[1] if self.high is None else self.high
        if not low < high:
            raise OptionError(f"{self.label}: low {low:g} must be less than high {high:g}")
        loaded = surface.patches[surface.patch_index(self.patch)].pressure != 0.0
        if self.kind == "tension" and (low < 0.0 or (loaded and low == 0.0)):
            least = "> 0" if loaded else "≥ 0"
            raise OptionError(f"{self.label}: low must be {least}, found {low:g}")
        return low, high


@dataclass(frozen=True, eq=False)
class Measure:
    """A quantity's value and derivatives: by positions (n,3), tensions (k,) and pressures (k,).

    None where it does not depend on tensions or pressures but by way of the positions.
    """

    value: float
    position: Floats
    tension: Floats | None = None
    pressure: Floats | None = None


def measure(surface: Surface, target: Target) -> Measure:
    """Value and derivatives of the target's quantity on a surface.

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> pyramid = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                   [Patch("roof", 1.0)], fixed=range(4))
    >>> found = measure(pyramid, Target("volume", "roof"))
    >>> round(found.value, 12), found.position[4].round(12).tolist()
    (1.333333333333, [0.0, 0.0, 1.333333333333])
    """
    return QUANTITIES[target.quantity](surface, target.of)


def _apex(surface: Surface, of: str | None) -> Measure:
    """The highest vertex; the triangles between are flat, so none of their points is higher."""
    height = surface.plane.height(surface.vertices)
    height[~_members(surface, _chosen(surface, of))] = -np.inf
    top = int(height.argmax())
    slope = np.zeros_like(surface.vertices)
    slope[top] = surface.plane.normal
    return Measure(float(height[top]), slope)


def _height(surface: Surface, point: tuple[float, float]) -> Measure:
    """Where the line through the point along Π's normal meets the highest triangle under pressure.

    A corner's displacement d raises the triangle's plane there by λ ⟨d, ν⟩ / ⟨ν, n⟩, with λ the
    corner's barycentric coordinate and ν, n the normals of triangle and Π.
    """
    axes = frame(surface.plane)
    F = surface.faces[_chosen(surface, None)]
    local = (surface.vertices - np.array(surface.plane.point)) @ axes.T
    corner = local[F]
    flat = corner[:, :, :2] - np.array(point)
    weight = cross_2d(flat[:, [1, 2, 0]], flat[:, [2, 0, 1]])
    twice = weight.sum(axis=1)
    upright = np.abs(twice) <= 1e-14 * surface.size**2
    weight /= np.where(upright, 1.0, twice)[:, None]
    over = np.flatnonzero((weight >= -1e-9).all(axis=1) & ~upright)
    if not len(over):
        raise OptionError(f"height at ({point[0]:g}, {point[1]:g}): no patch is over that point")
    heights = np.einsum("fc,fc->f", weight[over], corner[over, :, 2])
    face = over[heights.argmax()]
    normal = area_vectors(surface.vertices[F[face]])
    slope = np.zeros_like(surface.vertices)
    slope[F[face]] = weight[face][:, None] * (normal / (normal @ np.array(surface.plane.normal)))
    return Measure(float(heights.max()), slope)


def _area(surface: Surface, of: str | None) -> Measure:
    one = _indicator(surface, of)
    areas, _, slope = _measured(surface, one, np.zeros_like(one))
    return Measure(float(one @ areas), slope)


def _volume(surface: Surface, of: str | None) -> Measure:
    """Seen from the point p of Π, however far: V = V_o + ⅓ ⟨o - p, Σ A_T ν_T⟩, o the surface's origin."""
    one = _indicator(surface, of)
    _, volumes, slope = _measured(surface, np.zeros_like(one), -one)
    X, F = surface.vertices, surface.faces[_chosen(surface, of)]
    away = surface.origin - np.array(surface.plane.point)
    vector = area_vectors(X[F]).sum(axis=0)
    for c in range(3):
        np.add.at(slope, F[:, c], np.cross(X[F[:, c - 2]] - X[F[:, c - 1]], away) / 6.0)
    return Measure(float(one @ volumes + away @ vector / 3.0), slope)


def _curvature(surface: Surface, of: str) -> Measure:
    index = surface.patch_index(of)
    alpha, p = surface.tensions[index], surface.pressures[index]
    if alpha == 0.0:
        raise OptionError(f"curvature of {of}: a wall without tension has none")
    by_tension, by_pressure = np.zeros((2, len(surface.patches)))
    by_tension[index], by_pressure[index] = -p / (2.0 * alpha**2), 1.0 / (2.0 * alpha)
    return Measure(
        float(p / (2.0 * alpha)), np.zeros_like(surface.vertices), by_tension, by_pressure
    )


def _reaction(surface: Surface, of: str | None) -> Measure:
    """max |f_v| / ℓ_v over the patch's held boundary, ℓ_v half the length of the held edges at v.

    f_v = Σ α ∂A - ⅓ Σ p A_T ν_T over all triangles at v, as in the certificate: at a corner the
    patches' pulls along their junction cancel. Where vertices slide, only the force along Π's normal
    is held.
    """
    topo = surface.topology
    held = (surface.fixed | surface.on_plane)[topo.edges].all(axis=1)
    edge = np.flatnonzero(topo.boundary_edge & held)
    mine = edge
    if of is not None:
        touched = _touched(topo.edge_of_face[_chosen(surface, of)], len(topo.edges))
        mine = edge[touched[edge]]
    if not len(mine):
        raise OptionError(f"reaction of {of}: nothing holds that patch's boundary")
    ends, share = topo.edges[edge], held_lengths(surface)
    force = reactions(surface)
    vertices = np.unique(topo.edges[mine])
    size = np.linalg.norm(force[vertices], axis=1) / share[vertices]
    v, value = int(vertices[size.argmax()]), float(size.max())
    pull = force[v] / (float(np.linalg.norm(force[v])) or 1.0) / share[v]
    slope = _force_slope(surface, v, pull)
    ends = ends[(ends == v).any(axis=1)]
    side = surface.vertices[ends[:, 1]] - surface.vertices[ends[:, 0]]
    along = (0.5 * value / share[v] / np.linalg.norm(side, axis=1))[:, None] * side
    np.add.at(slope, ends[:, 0], along)
    np.add.at(slope, ends[:, 1], -along)
    by_tension, by_pressure = _by_patch(surface, v)
    return Measure(value, slope, by_tension @ pull, by_pressure @ pull)


def _pushes(surface: Surface, pressure: Floats) -> Floats:
    """(n,3) ⅓ Σ p A_T ν_T over the triangles at each vertex, with these pressures (k,).

    Not ∇(p V): at a boundary the side of the cone in which V is counted moves too, and it is no part
    of the surface.
    """
    third = area_vectors(surface.vertices[surface.faces]) / 3.0
    pushes = third * pressure[surface.patch_of_face, None]
    return vertex_sums(pushes, surface.faces, surface.n)


def _force_slope(surface: Surface, v: int, pull: Floats) -> Floats:
    """(n,3) derivative of ⟨pull, f_v⟩, f_v = Σ α ∂A - ⅓ Σ p A_T ν_T at v."""
    around = np.flatnonzero((surface.faces == v).any(axis=1))
    F, patch = surface.faces[around], surface.patch_of_face[around]
    blocks = np.empty((len(F), 3, 3, 3, 3))
    mesh = kernels.energy_mesh(surface, pressure=0.0 * surface.pressures)
    kernels.hessian_blocks(mesh._replace(faces=F, patch=patch), surface.vertices, blocks)
    slope = np.zeros_like(surface.vertices)
    row, corner = np.nonzero(np.equal(F, v))
    np.add.at(slope, F[row], np.einsum("fjab,a->fjb", blocks[row, corner], pull))
    # ⅓ A ν = (q - p) × (r - p) / 6, whose part along u changes by (q - r) × u / 6 as p moves
    X, sixth = surface.vertices, surface.pressures[surface.patch_of_face[around]] / 6.0
    for c in range(3):
        opposite = X[F[:, c - 2]] - X[F[:, c - 1]]
        np.add.at(slope, F[:, c], -sixth[:, None] * np.cross(opposite, pull))
    return slope


def _by_patch(surface: Surface, v: int) -> tuple[Floats, Floats]:
    """(k,3) derivatives of f_v by each patch's tension and pressure: ∇A_i and -⅓ Σ A_T ν_T at v."""
    by_tension, by_pressure = np.zeros((2, len(surface.patches), 3))
    for i in np.unique(surface.patch_of_face[(surface.faces == v).any(axis=1)]):
        one = np.zeros(len(surface.patches))
        one[i] = 1.0
        by_tension[i] = _measured(surface, one, 0.0 * one)[2][v]
        by_pressure[i] = -_pushes(surface, one)[v]
    return by_tension, by_pressure


def _measured(surface: Surface, tension: Floats, pressure: Floats) -> tuple[Floats, Floats, Floats]:
    """Areas, volumes (k,) and ∇(Σ αA - pV) (n,3) with these tensions and pressures."""
    return kernels.measure(kernels.energy_mesh(surface, tension, pressure), surface.vertices)


def _indicator(surface: Surface, of: str | None) -> Floats:
    """(k,) 1 for the chosen patches, 0 for the others."""
    if of is None:
        return (~surface.walls).astype(float)
    one = np.zeros(len(surface.patches))
    one[surface.patch_index(of)] = 1.0
    return one


def _chosen(surface: Surface, of: str | None) -> Bools:
    """(m,) faces of the patch, or of all patches under pressure."""
    return np.asarray(_indicator(surface, of)[surface.patch_of_face] != 0.0)


def _members(surface: Surface, faces: Bools) -> Bools:
    """(n,) vertices of the given faces."""
    return _touched(surface.faces[faces], surface.n)


def _touched(indices: Ints, count: int) -> Bools:
    mask = np.zeros(count, dtype=bool)
    mask[indices] = True
    return mask


def _point(of: Any) -> tuple[float, float]:
    try:
        x, y = (float(c) for c in of)
    except (TypeError, ValueError):
        raise OptionError(f"height: expected a point (x, y) of Π, found {of!r}") from None
    _finite(x, "height: x")
    _finite(y, "height: y")
    return x, y


def _finite(value: Any, what: str) -> None:
    number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    if value is not None and not (number and math.isfinite(value)):
        raise OptionError(f"{what} must be a finite number, found {value!r}")


QUANTITIES: dict[str, Callable[[Surface, Any], Measure]] = {
    "apex": _apex,
    "height": _height,
    "volume": _volume,
    "area": _area,
    "curvature": _curvature,
    "reaction": _reaction,
}
