"""The energy of a Surface, its gradient with the supports applied, and their derivatives by its parameters.

    E = Σ α_i A_i - Σ p_i V_i + Σ τ L + Σ g ∫ z ds + Σ w ∫ z dA   (11), (20); the paper's p are 1 and 0
    A_i = Σ_T ½ |(q_j - p) × (q_{j+1} - p)|        (9a), (10a)
    V_i = (1/6) Σ_T ⟨p, q_j × q_{j+1}⟩             (10b), positions seen from the point of Π

τ L and g ∫ z ds are the cables and their weights, w ∫ z dA the patches' weights; the paper has neither.
``FORCES`` lists what acts on elements other than triangles.

V_i is the volume of the cone from the point of Π (or, far from it, ``Surface.origin``) to patch i. At a
junction the sides of the cones meet. Where the pressures there, each counted along its patch's normal,
cancel (equal patches and a wall of pressure 0; or patches of pressures p_1 and p_2 and a wall of
p_1 - p_2, its normal pointing from room 1 to room 2), so do the sides: Σ p V is the pressures of the
rooms times their volumes, wherever on Π the point is. Where they do not (p_1 ≠ p_2 and a wall of
pressure 0, as (11) admits), the difference acts on the side of the cones, the triangles between junction
and point, as it would on a wall there; E, and the shape at rest, then depend on the point.

Units: E force·length, ∇E force, with tension in force/length and pressure in force/length².
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ..base.arrays import Floats, read_only
from ..surface import Surface, expect_surface
from ..surface.supports import apply_supports
from . import cables, flat_pieces
from .elements import Elements, Mesh, add_values, energy_mesh
from .flat_pieces import add_plane_volumes
from .triangles import totals_and_gradient

FORCES = (cables.elements, flat_pieces.elements)
Rates = Mapping[str, Floats]
"""Of change, by the kinds of ``pcmc.surface.values.KINDS``: one for each patch or cable."""


def energy(surface: Surface) -> float:
    """E = Σ α A - Σ (p - s) V + Σ τ L + Σ g ∫ z ds + Σ w ∫ z dA, Eq. (20) with snow, cables, weights.

    >>> from pcmc import Patch, Surface
    >>> tent = Surface([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]],
    ...                [[0, 1, 2], [1, 3, 2], [3, 0, 2]], [0, 0, 0], [Patch("tent", 2.0)], fixed=[0, 1, 3])
    >>> round(energy(tent), 12) == round(2 * (3**0.5 / 2 + 1) - 1 / 6, 12)
    True
    """
    expect_surface(surface)
    return energy_at(surface, surface.vertices)


def energy_at(surface: Surface, X: Floats) -> float:
    """E of the surface with its vertices at X (n,3).

    >>> from pcmc import Patch
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    >>> flat = Surface(corners, [[0, 1, 2]], [0], [Patch("film", 3.0, 0.0)], fixed=[0])
    >>> energy_at(flat, 2.0 * flat.vertices)  # α A, of four times the area
    6.0
    """
    mesh = energy_mesh(surface)
    sums = totals_and_gradient(mesh, X, sums_alone=True)[0]
    return total(mesh, sums) + add_values(elements(surface, X))


def elements(surface: Surface, X: Floats) -> Iterator[Elements]:
    """The elements of all ``FORCES`` at X (n,3)."""
    return (each for force in FORCES for each in force(surface, X))


def total(mesh: Mesh, sums: Floats) -> float:
    """E of A, V and ∫ z dA (3,k) of patches. Sums: BLAS rounds dot products differently on each processor."""
    areas, volumes, moments = sums
    surfaces = (mesh.tension * areas).sum() - (mesh.pressure * volumes).sum()
    return float(surfaces + (mesh.weight * moments).sum())


def energy_and_gradient(
    surface: Surface, X: Floats | None = None, *, supports: bool = True, workers: int | None = None
) -> tuple[float, Floats]:
    """E and ∇E (n,3) in one pass over the triangles, at X or at the surface's own vertices.

    The forces on images of vertices are in those on the vertices, and zero at the images.

    ``supports=False`` keeps the forces at held vertices, which the supports must carry.

    >>> from pcmc import Patch
    >>> triangle = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    >>> film = Surface(triangle, [[0, 1, 2]], [0], [Patch("film", 2.0, 0.0)], fixed=[1, 2])
    >>> energy_and_gradient(film)[1].tolist()
    [[-1.0, -1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    >>> energy_and_gradient(film, supports=False)[1].sum(axis=0).tolist()  # the forces add up to nothing
    [0.0, 0.0, 0.0]
    """
    X = surface.vertices if X is None else X
    mesh = energy_mesh(surface)
    sums, gradient = totals_and_gradient(mesh, X, workers)
    further = add_values(elements(surface, X), gradient)
    surface.folded(gradient)
    if supports:
        apply_supports(surface, gradient, X)
    return total(mesh, sums) + further, gradient


def gradient(surface: Surface) -> Floats:
    """∇E (n,3), force; its squared sum is the paper's ‖∇E‖².

    The seven cases of Sec. 2.3 are one sum over the triangles around a vertex, Σ α ∇A - p ∇V with
    ∇A = ½ Σ ν × (q_{j+1} - q_j) (15a), (17a) and ∇V = (1/6) Σ q_j × q_{j+1}; the paper prints the
    negative of the latter in (15b), (17b). What the cases add is the support: sliding vertices keep
    the part along Π (19), fixed ones are zero.

    >>> from pcmc import Patch, Surface
    >>> pyramid = Surface([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]],
    ...     [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4, [Patch("roof", 1.0)], fixed=range(4))
    >>> gradient(pyramid)[4].round(6).tolist()
    [0.0, 0.0, 1.495094]
    """
    expect_surface(surface)
    return energy_and_gradient(surface)[1]


def weighted(
    surface: Surface,
    tensions: Floats | float = 0.0,
    pressures: Floats | float = 0.0,
    X: Floats | None = None,
    weights: Floats | float = 0.0,
) -> tuple[Floats, Floats]:
    """A, V and ∫ z dA (3,k), and Σ α ∇A - p ∇V + w ∇∫ z dA (n,3), supports not applied, with other α, p, w.

    ∫ z dA is 0 where all w are. Flat pieces are part of V.
    """
    laws = (np.full(len(surface.patches), each, dtype=float) for each in (tensions, pressures, weights))
    alpha, p, w = map(read_only, laws)
    X = surface.vertices if X is None else X
    sums, forces = totals_and_gradient(energy_mesh(surface)._replace(tension=alpha, pressure=p, weight=w), X)
    add_values(flat_pieces.elements(surface, X, p), forces)
    add_plane_volumes(surface, X, sums[1])
    return sums, surface.folded(forces)


def patch_areas(surface: Surface) -> Floats:
    """(k,) area A_i of each patch, length²."""
    return totals_and_gradient(energy_mesh(surface), surface.vertices, sums_alone=True)[0][0]


def patch_volumes(surface: Surface, X: Floats | None = None) -> Floats:
    """(k,) signed volume V_i of each patch's cone to ``surface.origin``, length³ (10b), with flat pieces."""
    X = surface.vertices if X is None else X
    sums = totals_and_gradient(energy_mesh(surface), X, sums_alone=True)[0]
    return add_plane_volumes(surface, X, sums[1])


def volume(surface: Surface) -> float:
    """Σ V_i of the energy over the patches that are no walls, length³; under a roof see ``volume_below``."""
    return float(patch_volumes(surface)[~surface.auxiliary].sum())


def by_rates(surface: Surface, rates: Rates, X: Floats | None = None) -> tuple[float, Floats]:
    """∂E/∂λ and ∂∇E/∂λ (n,3) at X or where the surface is, supports not applied.

    They are by the numbers that E is linear in, whatever their values are:

        ∂E/∂λ = Σ α̇ A - Σ (ṗ - ṡ) V + Σ ẇ ∫ z dA + Σ τ̇ L + Σ ġ ∫ z ds

    A prescribed volume is a condition beside E, and no part of it.
    """
    X, none = surface.vertices if X is None else X, np.zeros(len(surface.patches))
    net, tensions = rates.get("pressures", none) - rates.get("snows", none), rates.get("tensions", none)
    weights = rates.get("weights", none)
    sums, out = weighted(surface, tensions, net, X, weights)
    change = float((np.stack([tensions, -net, weights]) * sums).sum())
    none, elements = np.zeros(len(surface.cables)), list[Elements]()
    pulls, loads = rates.get("cables", none), rates.get("cable_weights", none)
    for cable, pull, weight in zip(surface.cables, pulls, loads, strict=True):
        if pull or weight:
            each = np.full((2, len(cable.edges)), [[pull], [weight]])
            elements.append(cables.line_integrals(surface, X, cable.edges, *each))
    return change + add_values(elements, out), surface.folded(out)
