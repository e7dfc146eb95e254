"""Smooth motions: the energy gradient in the metric of the α-weighted cotangent Laplacian L_α.

    L_α d = - B Bᵀ ∇E

(Pinkall and Polthier 1993 minimise area this way). A step of length 1 along d lowers the residual by about
the same factor on every mesh, and moves neighbours together: the sheets around a junction follow it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array, triu

from ..base.arrays import Bools, Floats, Ints
from ..base.tolerances import PARALLEL
from ..forces.motion_space import MotionSpace, VertexClasses, perpendicular
from ..forces.pattern import Pattern, hessian_pattern
from ..forces.second_variation import assemble
from ..stability.factorisation import Factor, factoriser
from ..surface import Surface
from ..surface.supports import apply_supports
from ..surface.topology import SHEET

FLOOR = 1e-2  # of the largest tension it is connected with: the least tension of any patch in L_α
SHIFT = 1e-9  # of the diagonal, added so that L_α is regular without supports, too


class Smoother:
    """L_α at one shape, factorised.

    Fixed vertices hold all coordinates, sliding ones only that normal to their plane: ``factorisations``
    counts the different ones. On planes oblique to the coordinates the part along them is taken.
    """

    def __init__(self, surface: Surface, classes: VertexClasses, backend: str | None = None) -> None:
        part = surface.topology.components[surface.topology.faces[:, 0]]  # a patch may be in several
        of_part, of_patch = np.zeros(part.max() + 1), np.zeros(len(surface.patches))
        np.maximum.at(of_part, part, surface.tensions[surface.patch_of_face])
        np.maximum.at(of_patch, surface.patch_of_face, of_part[part])
        floor = FLOOR * of_patch
        tensions = {p.name: max(p.tension, least) for p, least in zip(surface.patches, floor, strict=True)}
        self._moderated = surface.retensioned(tensions, dict.fromkeys(tensions, 0.0))
        faces = {name: getattr(surface, name) for name in ("faces", "patch_of_face", "topology")}
        self._classes = replace(classes, active=np.ones(surface.m, dtype=bool), nodes=surface.nodes, **faces)
        used = np.bincount(surface.topology.faces.ravel(), minlength=surface.n) > 0
        self._surface, self._parts = surface, np.where(used, surface.topology.components, -1)
        self._axes, self._free, self._number = _free_along_axes(surface, used & ~surface.pinned)
        self._spaces = [_one_unknown_each(free) for free in self._free]
        self._patterns = [hessian_pattern(self._classes, space) for space in self._spaces]
        self._factorisers = [factoriser(pattern, backend) for pattern in self._patterns]
        self.factorisations = len(self._free)

    def refresh(self, X: Floats) -> None:
        """Compute L_α at the positions X (n,3) and factorise it."""
        self._factors = []
        for space, pattern, solver in zip(self._spaces, self._patterns, self._factorisers, strict=True):
            self._factors.append(solver.factor(_laplacian(self._moderated, self._classes, space, pattern, X)))

    def solve(self, forces: Floats) -> Floats:
        """L_α⁻¹ forces (n,3), zero where a support holds the coordinate.

        Of forces on a connected part that nothing holds along an axis the mean is left out: it would only
        shift that part, and far.
        """
        local = forces @ self._axes.T
        out = np.zeros_like(local)
        for number, (free, factor) in enumerate(zip(self._free, self._factors, strict=True)):
            place = np.ix_(free, self._number == number)
            part = self._parts[free]
            loose = ~np.isin(part, self._parts[~free])[:, None]
            count = np.maximum(np.bincount(part), 1)
            mean = np.stack([np.bincount(part, column) / count for column in local[place].T], axis=1)
            out[place] = factor.solve(local[place] - loose * mean[part])
        out = out @ self._axes
        return self._surface.spread(apply_supports(self._surface, out) if self._surface.on_planes else out)


def _free_along_axes(surface: Surface, movable: Bools) -> tuple[Floats, Bools, Ints]:
    """Axes (3,3), rows; the distinct masks (k,n) of movable vertices that no plane holds along an axis; and
    (3,) which of these masks each axis has.
    """
    axes, masks = _axes(surface), list[Bools]()
    planes = ((surface.plane, surface.on_plane | surface.given_supports.on_plane), *surface.on_planes)
    for axis in axes:
        free = [~on for plane, on in planes if np.linalg.norm(np.cross(axis, plane.normal)) <= PARALLEL]
        masks.append(np.logical_and.reduce([movable, *free]))
    return axes, *np.unique(masks, axis=0, return_inverse=True)


def _axes(surface: Surface) -> Floats:
    """(3,3) rows: Π's normal last, and across it the normals of other sliding planes where they can be."""
    normal = np.array(surface.plane.normal)
    for plane, _ in surface.on_planes:
        first = np.array(plane.normal)
        if abs(first @ normal) <= PARALLEL:
            first -= (first @ normal) * normal
            first /= np.linalg.norm(first)
            return np.stack([first, np.cross(normal, first), normal])
    first, second = perpendicular(normal[None])
    return np.stack([first[0], second[0], normal])


def _one_unknown_each(vertices: Bools) -> MotionSpace:
    basis = np.zeros((len(vertices), 3, 3))
    basis[:, 0, 0] = 1.0
    return MotionSpace.of(basis, vertices.astype(np.int64))


def _laplacian(
    surface: Surface, classes: VertexClasses, space: MotionSpace, pattern: Pattern, X: Floats
) -> Floats:
    """The values of L_α in the pattern."""
    data = assemble(surface, classes, space, pattern, X, hessian=0.0, stiffness=1.0)
    data[pattern.indptr[:-1]] *= 1.0 + SHIFT
    return data


class HarmonicExtension:
    """Lets the inside of the sheets follow the motion of their curves, or of ``prescribed`` (n,) vertices.

    The motion is extended harmonically into the sheets, L with equal tensions: with the inside i and the
    curves c,  L_ii w_i = -L_ic w_c. Vertices that slide on a plane stay on it, so that triangles beside a
    mirror plane move as in the whole, but for planes oblique to the axes as in ``Smoother``. Each sheet
    vertex takes the part of w along its sheet, which does not change the shape, as far as its support lets
    it.
    """

    def __init__(
        self,
        surface: Surface,
        classes: VertexClasses,
        X: Floats,
        backend: str | None = None,
        prescribed: Bools | None = None,
    ) -> None:
        used = ~classes.idle
        space = _one_unknown_each(used)
        names = [patch.name for patch in surface.patches]
        ones, none = dict.fromkeys(names, 1.0), dict.fromkeys(names, 0.0)
        equal = surface._with(cables=()).retensioned(ones, weights=none)
        pattern = hessian_pattern(classes, space)
        L = pattern.symmetric(_laplacian(equal, classes, space, pattern, X))
        curves = (classes.kind != SHEET) | surface.fixed
        self._surface, self._prescribed = surface, curves if prescribed is None else prescribed
        self._axes, free, self._number = _free_along_axes(surface, used & ~self._prescribed)
        self._parts = [(inside, used & ~inside, *_blocks(L, inside[used], backend)) for inside in free]

    def extend(self, space: MotionSpace, motion: Floats) -> Floats:
        """The motion (n,3) with the sheets' vertices following the curves."""
        w = self.harmonic(motion)
        w[self._prescribed] = 0.0
        w = self._surface.spread(apply_supports(self._surface, w))
        return motion + w - space.project(w)

    def harmonic(self, motion: Floats) -> Floats:
        """w (n,3), as ``motion`` where it is prescribed."""
        w = np.where(self._prescribed[:, None], motion, 0.0) @ self._axes.T
        for number, (inside, given, coupling, factor) in enumerate(self._parts):
            along = self._number == number
            w[np.ix_(inside, along)] = -factor.solve(coupling @ w[np.ix_(given, along)])
        return w @ self._axes


def _blocks(L: csr_array, inside: Bools, backend: str | None) -> tuple[csr_array, Factor]:
    """L_ic, and L_ii factorised."""
    upper = csr_array(triu(L[inside][:, inside]))
    upper.sort_indices()
    diagonal = upper.diagonal()  # in units of it no weak pivot looks like zero
    units = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    pattern = Pattern(upper.indptr, upper.indices, np.empty((0, 3), dtype=np.int32))
    return csr_array(L[inside][:, ~inside]), factoriser(pattern, backend, units).factor(upper.data)
