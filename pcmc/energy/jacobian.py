"""How the forces in the motion space change with the shape: the frames turn along with it.

The forces that a P-CMC surface lacks are f = B Bᵀ ∇E, and along a motion d of the vertices

    Bᵀ Df[d] = Bᵀ (∂²E) d + Bᵀ D(B Bᵀ)[d] ∇E.

The second part counts off rest, and it is what makes Newton's method converge quadratically:

- inside a sheet, with the area vector a = |a| n:   (∇E - n n·∇E) · Da / |a|;
- on a curve, with the chord c = |c| t between its neighbours:   -(t·∇E) Bᵀ Dc / |c|;
- where a curve slides on Π the same, with the chord's part along Π; where a sheet does, its normal's.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.compiled import compiled
from ..surface import Surface
from ..surface.geometry import area_vectors
from ..surface.topology import SHEET
from .motion_space import MotionSpace, VertexClasses, curve_chords


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Bᵀ Df[·] at one shape; made by ``linearise``.

    Attributes
    ----------
    sheets : (n,3) what the change of a vertex's area vector is multiplied with, else zero; pressure.
    bends, pull : (b,) curve vertices, as numbers in ``classes.curve``, and -(t·∇E)/|c| there.
    """

    surface: Surface
    classes: VertexClasses
    space: MotionSpace
    X: Floats
    sheets: Floats
    bends: Ints
    pull: Floats

    def times(self, d: Floats) -> Floats:
        """Bᵀ Df[d] (size,), for a motion d (n,3) of the vertices."""
        surface, classes, space = self.surface, self.classes, self.space
        change = np.zeros_like(self.X)
        turn = np.zeros(len(self.X))
        _along(
            self.X, d, classes.faces, classes.patch_of_face, surface.origin,
            surface.tensions, surface.pressures, self.sheets, change, turn,
        )  # fmt: skip
        where = classes.curve[self.bends]
        change[where] += self.pull[:, None] * curve_chords(surface, classes, d)[self.bends]
        out = space.to_coordinates(change)
        single = (classes.kind == SHEET) & (space.dimension == 1)
        out[space.start[:-1][single]] += turn[single]
        return out


def linearise(
    surface: Surface, classes: VertexClasses, space: MotionSpace, X: Floats, gradient: Floats
) -> Linearisation:
    """The derivative of the forces of ``surface`` at X, where ∇E is ``gradient`` (n,3)."""
    bends, pull = _at_curves(surface, classes, space, X, gradient)
    sheets = _at_sheets(surface, classes, space, X, gradient)
    return Linearisation(surface, classes, space, X, sheets, bends, pull)


def _at_curves(
    surface: Surface, classes: VertexClasses, space: MotionSpace, X: Floats, gradient: Floats
) -> tuple[Ints, Floats]:
    slides = surface.on_plane[classes.curve]
    bends = np.flatnonzero(space.dimension[classes.curve] == np.where(slides, 1, 2))
    chord = curve_chords(surface, classes, X)[bends]
    chord[slides[bends]] = surface.plane.along(chord[slides[bends]])
    square = np.einsum("ij,ij->i", chord, chord)
    along = np.einsum("ij,ij->i", chord, gradient[classes.curve[bends]])
    return bends, -along / square


def _at_sheets(
    surface: Surface, classes: VertexClasses, space: MotionSpace, X: Floats, gradient: Floats
) -> Floats:
    single = (classes.kind == SHEET) & (space.dimension == 1)
    out = np.zeros_like(X)
    vector = area_vectors(X, classes.faces)[0]
    _across_normals(vector, single, space.basis, gradient, out)
    sliding = np.flatnonzero(single & surface.on_plane)
    if len(sliding):
        length = np.linalg.norm(vector[sliding], axis=1)
        normal = vector[sliding] / length[:, None]
        shadow = np.linalg.norm(surface.plane.along(normal), axis=1)
        b, g = space.basis[sliding, 0], gradient[sliding]
        rest = surface.plane.along(g - np.einsum("ij,ij->i", g, b)[:, None] * b)
        rest -= np.einsum("ij,ij->i", rest, normal)[:, None] * normal
        out[sliding] = rest / (shadow * length)[:, None]
    return out


@compiled
def _across_normals(
    vector: Floats, chosen: Floats, basis: Floats, gradient: Floats, out: Floats
) -> None:
    for v in range(len(vector)):
        if not chosen[v]:
            continue
        n, g = basis[v, 0], gradient[v]
        length = sqrt(vector[v, 0] ** 2 + vector[v, 1] ** 2 + vector[v, 2] ** 2)
        along = n[0] * g[0] + n[1] * g[1] + n[2] * g[2]
        for d in range(3):
            out[v, d] = (g[d] - along * n[d]) / length


@compiled
def _along(
    X: Floats, D: Floats, F: Ints, patch: Ints, origin: Floats, tension: Floats, pressure: Floats,
    sheets: Floats, change: Floats, turn: Floats,
) -> None:  # fmt: skip
    """Add (∂²E) D to change (n,3), and the sheets' share of the turning to turn (n,)."""
    ox, oy, oz = origin[0], origin[1], origin[2]
    for f in range(len(F)):
        alpha, sixth = tension[patch[f]], pressure[patch[f]] / 6.0
        i, j, k = F[f, 0], F[f, 1], F[f, 2]
        # edges from corner a, and how they change
        ux, uy, uz = X[j, 0] - X[i, 0], X[j, 1] - X[i, 1], X[j, 2] - X[i, 2]
        wx, wy, wz = X[k, 0] - X[i, 0], X[k, 1] - X[i, 1], X[k, 2] - X[i, 2]
        vx, vy, vz = D[j, 0] - D[i, 0], D[j, 1] - D[i, 1], D[j, 2] - D[i, 2]
        zx, zy, zz = D[k, 0] - D[i, 0], D[k, 1] - D[i, 1], D[k, 2] - D[i, 2]
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        mx = vy * wz - vz * wy + uy * zz - uz * zy
        my = vz * wx - vx * wz + uz * zx - ux * zz
        mz = vx * wy - vy * wx + ux * zy - uy * zx
        for c in range(3):
            v = F[f, c]
            turn[v] += 0.5 * (sheets[v, 0] * mx + sheets[v, 1] * my + sheets[v, 2] * mz)
        twice = sqrt(nx * nx + ny * ny + nz * nz)
        s = 1.0 / twice if twice > 0.0 else 0.0
        nx, ny, nz = s * nx, s * ny, s * nz
        along = nx * mx + ny * my + nz * mz
        s *= 0.5 * alpha
        mx, my, mz = s * (mx - along * nx), s * (my - along * ny), s * (mz - along * nz)
        h = 0.5 * alpha
        nx, ny, nz = h * nx, h * ny, h * nz
        # the corners seen from the point of Π, and how they move
        ax, ay, az = X[i, 0] - ox, X[i, 1] - oy, X[i, 2] - oz
        bx, by, bz = ax + ux, ay + uy, az + uz
        cx, cy, cz = ax + wx, ay + wy, az + wz
        px, py, pz = D[i, 0], D[i, 1], D[i, 2]
        qx, qy, qz = D[j, 0], D[j, 1], D[j, 2]
        rx, ry, rz = D[k, 0], D[k, 1], D[k, 2]
        # edges opposite b and c, as a tension pulls them; the one opposite a balances these
        jx, jy, jz = _sum_of_crosses(mx, my, mz, -wx, -wy, -wz, nx, ny, nz, -zx, -zy, -zz)
        kx, ky, kz = _sum_of_crosses(mx, my, mz, ux, uy, uz, nx, ny, nz, vx, vy, vz)
        lx, ly, lz = _sum_of_crosses(qx, qy, qz, cx, cy, cz, bx, by, bz, rx, ry, rz)
        change[i, 0] -= jx + kx + sixth * lx
        change[i, 1] -= jy + ky + sixth * ly
        change[i, 2] -= jz + kz + sixth * lz
        lx, ly, lz = _sum_of_crosses(rx, ry, rz, ax, ay, az, cx, cy, cz, px, py, pz)
        change[j, 0] += jx - sixth * lx
        change[j, 1] += jy - sixth * ly
        change[j, 2] += jz - sixth * lz
        lx, ly, lz = _sum_of_crosses(px, py, pz, bx, by, bz, ax, ay, az, qx, qy, qz)
        change[k, 0] += kx - sixth * lx
        change[k, 1] += ky - sixth * ly
        change[k, 2] += kz - sixth * lz


@compiled
def _sum_of_crosses(
    ax: float, ay: float, az: float, bx: float, by: float, bz: float,
    cx: float, cy: float, cz: float, dx: float, dy: float, dz: float,
) -> tuple[float, float, float]:  # fmt: skip
    """a × b + c × d."""
    return (
        ay * bz - az * by + cy * dz - cz * dy,
        az * bx - ax * bz + cz * dx - cx * dz,
        ax * by - ay * bx + cx * dy - cy * dx,
    )
