"""A mesh with a label for each triangle becomes a roof: a wall is hung below the line where labels change."""

import numpy as np

import pcmc
from pcmc.plan import surface_from_labels
from pcmc.plot import panel

n = 14
x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 12, n + 1), np.linspace(0, 8, n + 1)))
z = 1.2 * (1 - (x / 6 - 1) ** 2) * (1 - (y / 4 - 1) ** 2)
corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
faces = np.concatenate([corner[:, None] + [0, 1, n + 2], corner[:, None] + [0, n + 2, n + 1]])
labels = np.where(x[faces].mean(axis=1) < 6, "west", "east")
start = surface_from_labels(np.stack([x, y, z], axis=1), faces, labels, tension=5.0, walls=1.5)
roof = pcmc.solve(start).surface
panel([start, roof], "own_mesh.png", titles=["the mesh", "the roof"], width=900)
