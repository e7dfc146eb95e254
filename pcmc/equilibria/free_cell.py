"""Cells whose size is free: the stress of a periodic surface, and the cell at which it balances a pressure.

A strain ε (3,3) of the cell moves every vertex x to (1 + ε) x, and the translations along. With the volumes
of the rooms prescribed and δ their pressures, the energy of the surface at rest in the cell changes by

    dE = V_cell σ : ε,    σ = (1/V_cell) [ Σ_T α a (1 - n nᵀ) - Σ_r δ_r V_r 1 ]

with area a and normal n of each triangle: forces in balance do no work in what vertices do besides. A
pressure p on the cell adds p V_cell, so E + p V_cell is stationary where σ = -p 1. Where bubbles fill the
cell p counts from the air in the last one, whose volume is not prescribed and changes with the cell.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import expm

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import OptionError, SurfaceError
from ..base.tolerances import AT_REST
from ..certificate import Certificate
from ..forces.functional import patch_areas
from ..forces.pinching import standing_part
from ..forces.rooms import room_pressures, room_volumes
from ..solvers import solve
from ..solvers.result import unless_stopped
from ..stability.equilibrium import Equilibrium
from ..surface import Surface, expect_surface
from ..surface.geometry import area_vectors
from ..surface.images import lattice_of

FREE = ("size", "lengths", "shape")
PROBE = 1e-5  # strain of the difference quotients
LONGEST, STEPS, HALVINGS = 0.2, 60, 6  # largest strain of a step; steps; of each
RANGE = 1e3  # largest change of a volume on the way


@dataclass(frozen=True, eq=False)
class FreeCell:
    """A surface at rest in a cell that balances a pressure.

    Attributes
    ----------
    surface, certificate : at rest in the cell found.
    lattice : (3,3) the translations, length.
    stretch : (3,3) from the given cell to this one: x became x @ stretch, but for what moves at rest.
    stress : (3,3) σ, force/length².
    pressure : p on the cell, force/length²; minus the mean of σ where the volume was kept.
    ways_down : of the free changes of the cell, in how many directions E + p V_cell falls. With 0, and the
        index of the certificate 0, it is a minimum.
    solves : how many surfaces were solved on the way.
    """

    surface: Surface = field(repr=False)
    certificate: Certificate = field(repr=False)
    lattice: Floats
    stretch: Floats = field(repr=False)
    stress: Floats = field(repr=False)
    pressure: float
    ways_down: int
    solves: int


def cell_stress(surface: Surface) -> Floats:
    """(3,3) the stress σ of a periodic surface at rest, force/length².

    σ : ε is the change of its energy per volume of the cell with the strain ε. It is positive along what the
    surface pulls together. The formula is above.

    Raises
    ------
    SurfaceError : the surface is not at rest, not periodic in three directions, is held or heavy, or has a
        pressure that is not that of a room.

    >>> from pcmc import Patch, Surface, images_in
    >>> u, v = np.indices((4, 4)).reshape(2, 16) / 3.0
    >>> wall = np.stack([u, v, 0.0 * u], axis=1)  # and along the two other planes: films around a cube
    >>> X, number = np.unique(np.concatenate([np.roll(wall, k, axis=1) for k in range(3)]), axis=0,
    ...                       return_inverse=True)
    >>> a = np.array([k for k in range(12) if k % 4 < 3])
    >>> side = np.concatenate([np.stack([a, a + 4, a + 5], axis=1), np.stack([a, a + 5, a + 1], axis=1)])
    >>> F = number.reshape(3, 16)[:, side].reshape(-1, 3)
    >>> films = Surface(X, F, np.arange(54) // 18, [Patch(name, 2.0, 0.0) for name in "zxy"],
    ...                 images=images_in(X, np.eye(3)))
    >>> cell_stress(films).round(12).tolist()
    [[4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]]
    """
    _expect_free(surface, "cell_stress")
    if (left := Equilibrium(standing_part(surface), surface.vertices).residual) > AT_REST:
        raise SurfaceError(f"cell_stress: not at rest (residual {left:.1e}); solve it first", what="surface")
    pulls = area_vectors(surface.vertices[surface.faces])
    area = np.linalg.norm(pulls, axis=1)
    tension = surface.tensions[surface.patch_of_face]
    all_around = (tension * area).sum() - room_pressures(surface) @ room_volumes(surface)
    total = all_around * np.eye(3) - np.einsum("f,fi,fj->ij", tension / area, pulls, pulls)
    return np.asarray(total / _volume(surface))


def free_cell(
    surface: Surface, pressure: float | None = None, *, free: str = "lengths", tolerance: float = 1e-8
) -> FreeCell:
    """The cell in which a periodic surface at rest balances a pressure, by Newton's method for the cell.

    Each step solves the surface anew, at rest or a saddle, from where it was; the derivative of the stress is
    by difference quotients. A stationary E + p V_cell can be a saddle: see ``ways_down``. The energy of a
    minimal surface in a cube of side s, c s², has a maximum with p s³ at s = -2c / (3p), p < 0.

    Parameters
    ----------
    surface : periodic in three directions, not held; a start for both.
    pressure : p on the cell, force/length²; None keeps the cell's volume instead.
    free : "size", all lengths in one proportion; "lengths", along x, y and z each; "shape", angles, too.
    tolerance : of the stress left times the cell's volume, over Σ α A.

    Raises
    ------
    OptionError : nothing is free; or no cell was found that balances the pressure.
    SurfaceError : as of ``cell_stress``; or a surface on the way does not come to rest.
    """
    _expect_free(surface, "free_cell")
    basis = _strains(validate.choice("free", free, FREE), pressure is None)
    given = None if pressure is None else validate.number("pressure", pressure)
    tolerance = validate.positive("tolerance", tolerance)

    def left(at: Surface) -> Floats:
        stress = cell_stress(at) + (given or 0.0) * np.eye(3)
        return np.einsum("kij,ij->k", basis, stress) * _volume(at) / float(at.tensions @ patch_areas(at))

    (at, certificate), first, solves, stretch = _at_rest(surface), _volume(surface), 1, np.eye(3)
    for _ in range(STEPS):
        g = left(at)
        probes = [left(_at_rest(at, expm(PROBE * each))[0]) for each in basis]
        slope = (np.stack(probes, axis=1) - g[:, None]) / PROBE
        solves += len(basis)
        if np.linalg.norm(g) <= tolerance:
            stress, down = cell_stress(at), np.linalg.eigvalsh(0.5 * (slope + slope.T)) < 0.0
            p = -float(np.trace(stress)) / 3.0 if given is None else given
            return FreeCell(at, certificate, lattice_of(at), stretch, stress, p, int(down.sum()), solves)
        step = np.linalg.lstsq(slope, -g)[0]
        step *= min(1.0, LONGEST / max(float(np.abs(step).max()), 1e-300))
        for _ in range(HALVINGS):
            further = expm(np.tensordot(step, basis, axes=1))
            solves += 1
            with suppress(SurfaceError):
                following = _at_rest(at, further)
                if np.linalg.norm(left(following[0])) < np.linalg.norm(g):
                    (at, certificate), stretch = following, stretch @ further
                    break
            step *= 0.5
        else:
            break
        if not 1.0 / RANGE < _volume(at) / first < RANGE:
            break
    balanced = -float(np.trace(cell_stress(_at_rest(surface)[0]))) / 3.0
    text = f"free_cell: found no cell {'of this volume' if given is None else f'for a pressure of {given:g}'}"
    text += f" that is in balance; the last had {_volume(at) / first:.3g} times the volume of the given one,"
    text += f" which balances {balanced:.4g} with free='size': pass pressure={balanced:.4g}, or one near it"
    raise OptionError(text, what="pressure", found=given, expected=balanced)


def _strains(free: str, volume_kept: bool) -> Floats:
    """(k,3,3) an orthonormal basis of the strains that are free."""
    x, y, z = (np.diag(row) for row in np.eye(3))
    size, root = (x + y + z) / np.sqrt(3.0), np.sqrt(2.0)
    basis = [] if volume_kept else [size]
    if free != "size":
        basis += [(x - y) / root, (x + y - 2.0 * z) / np.sqrt(6.0)]
    if free == "shape":
        e = np.eye(3)
        basis += [(np.outer(e[i], e[j]) + np.outer(e[j], e[i])) / root for i, j in ((0, 1), (1, 2), (2, 0))]
    if not basis:
        text = "free_cell: a cell of one size and one volume has nothing free; give pressure=, or"
        raise OptionError(f"{text} free='lengths'", what="free", found=free, expected="lengths")
    return np.array(basis)


def _volume(surface: Surface) -> float:
    return abs(float(np.linalg.det(lattice_of(surface))))


def _at_rest(surface: Surface, stretch: Floats | None = None) -> tuple[Surface, Certificate]:
    """The surface at rest, in the cell stretched by a matrix if one is given; and its certificate."""
    if stretch is not None:
        surface = surface.rebuilt(vertices=surface.vertices @ stretch)
    result = unless_stopped(solve(surface, target="stationary"))
    if not result.converged:
        where = lattice_of(surface).round(6).tolist()
        text = f"free_cell: in the cell {where} the surface does not come to rest: {result.message}"
        raise SurfaceError(text, what="surface", where=str(where))
    return result.surface, result.certificate


def _expect_free(surface: Surface, what: str) -> None:
    """Refuse surfaces that a strain of the cell does more to than move along."""
    expect_surface(surface)
    found = len(lattice_of(surface)) if surface.periodic else 0
    if found != 3:
        text = f"{what}: for surfaces periodic in three directions, found {found}; give images= of three"
        raise SurfaceError(text, what="images", found=found, expected=3)
    if surface.held.any() or surface.heavy:
        which = "is held" if surface.held.any() else "has a weight"
        raise SurfaceError(f"{what}: for a surface without supports and weights; this one {which}")
    pressures = surface.net_pressures
    other = np.abs(pressures - room_pressures(surface) @ surface.room_signs)
    if other.max() > AT_REST * max(np.abs(pressures).max(), surface.tensions.max() / surface.size):
        name = surface.patches[int(other.argmax())].name
        text = f"{what}: patch {name!r} has a given pressure, whose volume in a cell is known up to a"
        text += " constant only; prescribe the volume with a room, or give it pressure 0"
        raise SurfaceError(text, what="patches", where=name)
