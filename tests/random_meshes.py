"""Small random meshes: triangles glued at random, walls, supports, tensions and pressures at random."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.spatial import Delaunay

from pcmc import Patch, Plane, Surface

TENSIONS = (0.0, 0.1, 1.0, 1.0, 2.0, 5.0)
PRESSURES = (0.0, 0.0, 0.3, 1.0, 1.0, -0.5)


def random_surface(seed: int) -> Surface:
    """A surface of this seed, or the error of the house that refuses it."""
    rng = np.random.default_rng(seed)
    X, F, patch = (_soup, _sheet_with_walls)[seed % 2](rng)
    mild = rng.random() < 0.5
    patches = [_patch(rng, k, mild) for k in range(int(patch.max()) + 1)]
    used, F = np.unique(F, return_inverse=True)
    X, F = X[used], F.reshape(-1, 3)
    plane = Plane() if rng.random() < 0.8 else Plane((0, 0, 0), tuple(rng.standard_normal(3)))
    low = np.abs(plane.height(X)) < 1e-12
    share = rng.choice([0.3, 0.6, 1.0])
    fixed = rng.random(len(X)) < rng.choice([0.0, 0.2, 0.5])
    fixed[rng.integers(len(X))] = True
    return Surface(X, F, patch, patches, fixed, low & (rng.random(len(X)) < share), plane)


def _patch(rng: np.random.Generator, k: int, mild: bool) -> Patch:
    """Any tension and pressure; mild ones balance more often than not."""
    if mild:
        return Patch(f"p{k}", float(rng.uniform(0.8, 1.2)), float(rng.choice([0.0, 0.1, 0.1, -0.05])))
    tension, pressure = float(rng.choice(TENSIONS)), float(rng.choice(PRESSURES))
    return Patch(f"p{k}", tension, pressure if tension > 0.0 else 0.0, wall=bool(rng.random() < 0.2))


def _points(rng: np.random.Generator, count: int) -> np.ndarray:
    X = rng.standard_normal((count, 3))
    if rng.random() < 0.5:
        X = np.round(2.0 * X) / 2.0
    X[rng.random(count) < 0.4, 2] = 0.0
    return X


def _soup(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random triangles, each in a random patch that stays oriented."""
    count, kinds = int(rng.integers(4, 10)), int(rng.integers(1, 4))
    taken: set[tuple[int, int, int]] = set()
    faces, patch = [], []
    for _ in range(int(rng.integers(2, 40))):
        a, b, c = rng.permutation(count)[:3].tolist()
        k = int(rng.integers(kinds))
        sides = {(k, a, b), (k, b, c), (k, c, a)}
        if not taken & sides and frozenset((a, b, c)) not in map(frozenset, faces):
            taken |= sides
            faces.append((a, b, c))
            patch.append(k)
    names = np.unique(patch, return_inverse=True)[1]
    return _points(rng, count), np.array(faces), names


def _sheet_with_walls(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A triangulated sheet cut into patches at random, with walls below a path of its edges."""
    X = _points(rng, int(rng.integers(4, 14)))
    flat = X[:, :2] + 1e-3 * rng.standard_normal((len(X), 2))
    F = Delaunay(flat).simplices
    area = np.cross(
        np.append(flat[F[:, 1]] - flat[F[:, 0]], np.zeros((len(F), 1)), 1),
        np.append(flat[F[:, 2]] - flat[F[:, 0]], np.zeros((len(F), 1)), 1),
    )[:, 2]
    F = np.where(area[:, None] < 0.0, F[:, ::-1], F)
    side = flat[F].mean(axis=1) @ rng.standard_normal(2) > 0.0
    patch = side.astype(int) if 0 < side.sum() < len(side) else np.zeros(len(F), dtype=int)
    faces, owner, last = F.tolist(), patch.tolist(), int(patch.max()) + 1
    path = [int(rng.choice(F[rng.integers(len(F))]))]
    for _ in range(int(rng.integers(1, 5))):
        beside = np.setdiff1d(F[(path[-1] == F).any(axis=1)], path)
        if not len(beside):
            break
        path.append(int(rng.choice(beside)))
    feet = {}
    points = list(X)
    for v in path:
        if rng.random() < 0.8 and X[v, 2] != 0.0:
            feet[v] = len(points)
            points.append(np.array([*X[v, :2] + rng.choice([0.0, 0.2]) * rng.standard_normal(2), 0.0]))
        else:
            feet[v] = v
    for a, b in itertools.pairwise(path):
        for face in ((a, b, feet[b]), (a, feet[b], feet[a])):
            if len(set(face)) == 3:
                faces.append(list(face))
                owner.append(last)
    return np.array(points), np.array(faces), np.unique(owner, return_inverse=True)[1]
