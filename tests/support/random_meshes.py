"""Small random meshes: triangles glued at random; walls, supports, tensions and other forces at random."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.spatial import Delaunay

from pcmc import Cable, Patch, Plane, Room, Surface

TENSIONS = (0.0, 0.1, 1.0, 1.0, 2.0, 5.0)
WEIGHTS = (0.0, 0.2, -0.3, 1.0)
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


def loaded_surface(seed: int) -> Surface:
    """The surface of this seed with cables, weights, a room, sliding planes and mirrors at random."""
    bare, rng = random_surface(seed), np.random.default_rng([seed, 7])
    edges, X = bare.topology.edges, bare.vertices
    at = np.split(rng.permutation(len(edges)), np.cumsum(rng.integers(1, 5, int(rng.integers(0, 4)))))[:-1]
    cables = [
        Cable(f"c{k}", float(rng.choice(TENSIONS)), edges[some]) for k, some in enumerate(at) if some.size
    ]
    heavy = {p.name: float(rng.choice(WEIGHTS)) for p in bare.patches if p.tension > 0.0}
    signs = {p.name: int(rng.choice([-1, 1, 1, 1])) for p in bare.patches if rng.random() < 0.7}
    rooms = [Room("r", signs, float(rng.choice([0.1, 1.0, -0.5])))] if signs and rng.random() < 0.5 else []
    fixed = bare.fixed.copy()
    if rooms and rng.random() < 0.7:
        fixed[np.unique(edges[bare.topology.boundary_edge])] = True
    planes = dict(_plane(rng, bare, k) for k in range(int(rng.integers(0, 3))))
    up = np.array(bare.plane.normal)
    if any(plane.mirror and abs(up @ plane.normal) > 1e-9 for plane in planes):
        heavy = {}  # behind a mirror plane that leans over Π weights pull the other way: they are refused
    mesh = X, bare.faces, bare.patch_of_face, bare.retensioned(weights=heavy).patches
    return Surface(*mesh, fixed, bare.on_plane, bare.plane, on_planes=planes, cables=cables, rooms=rooms)


def _plane(rng: np.random.Generator, surface: Surface, k: int) -> tuple[Plane, np.ndarray]:
    """A sliding plane through a vertex, or a mirror plane beside all, with the vertices that lie on it."""
    X, normal = surface.vertices, rng.standard_normal(3)
    if rng.random() < 0.5:
        normal = np.eye(3)[rng.integers(3)]
    mirror = bool(rng.random() < 0.4)
    vertex = int(np.argmin(X @ normal)) if mirror else int(rng.integers(len(X)))
    plane = Plane(tuple(X[vertex]), tuple(normal), f"plane {k}", mirror=mirror)
    return plane, np.flatnonzero(np.abs(plane.height(X)) < 1e-9)


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
