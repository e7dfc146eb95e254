"""Surfaces with several kinds of supports."""

import numpy as np

from generators import spherical_cap
from pcmc import Patch, Plane, Surface, cut
from pcmc.plan import CableLine, Divider, Plan


def half_with_mirror():
    """Half a hall whose wall leans, cut at a mirror plane, under snow."""
    whole = Plan([[0, 0], [9, 0], [9, 4], [0, 4]], [Divider([[4, 0], [4, 4]])], edge_length=0.7, tension=4.0)
    return cut(whole.surface().with_snow(0.3), Plane((0, 2, 0), (0, 1, 0), "middle", mirror=True))


def cables_between_walls():
    """Three raised sides are held, a cable along the fourth ends on them; inside, a mast and a line."""
    inside = [[4, 3, 1.5], [[2, 2, 0.8], [2, 4, 0.8]]]
    sides = [[8, 0, 1], [8, 6, 0], [0, 6, 1], [0, 0, 0.5]]
    sail = {"roof": {"tension": 4.0, "pressure": 0.0, "weight": 0.2}}
    outline = [*sides[3:], *sides[:3]]
    free = [CableLine([[0, 0], [8, 0]], 30.0)]
    return Plan(outline, edge_length=1.0, patches=sail, supports=inside, cables=free).surface()


def lens(edge_length=0.3):
    """Two caps of tension 0.6 on one ring of radius 1, under a pressure of 1 between them."""
    cap = spherical_cap(edge_length, alpha=0.6)
    rim = cap.fixed
    low = np.where(rim, np.arange(cap.n), cap.n + np.cumsum(~rim) - 1)
    X = np.concatenate([cap.vertices, cap.vertices[~rim] * [1.0, 1.0, -1.0]])
    F, owner = np.concatenate([cap.faces, low[cap.faces]]), np.repeat([0, 1], cap.m)
    patches = [Patch("foil", 0.6, 1.0), Patch("foil below", 0.6, -1.0)]
    return Surface(X, F, owner, patches, fixed=np.append(rim, np.zeros((~rim).sum(), dtype=bool)))


def on_unit_circle(points):
    """Points (k,3) of the rim, moved out to it."""
    radius = np.linalg.norm(points[:, :2], axis=1)[:, None]
    return np.column_stack([points[:, :2] / radius, points[:, 2]])
