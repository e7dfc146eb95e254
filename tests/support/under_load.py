"""Roofs under load whose deflections are known."""

from functools import cache

import numpy as np
from starts import spherical_cap
from structures import square

import pcmc
from pcmc import Patch, Plane, Surface

ALPHA, THICK = 0.6, 1e-3  # of the cap with the radius 1.2 under the pressure 1


@cache
def cap(edge=0.05):
    """A cap of a sphere of radius 1.2 over the unit circle, at rest under the pressure 1."""
    return pcmc.solve(spherical_cap(edge, alpha=ALPHA)).surface


def stiffness(young, poisson=0.3):
    """Δp / w of a sphere of radius R = 2α under an even pressure: 2 E t / ((1 - ν) R²) - 2 α / R²."""
    return (2.0 * young * THICK / (1.0 - poisson) - 2.0 * ALPHA) / (2.0 * ALPHA) ** 2


def strip(n=40):
    """A bay of a barrel between two mirror planes: an arc of 90° and radius 1 over y = 0 and 1/n."""
    angle = np.linspace(-np.pi / 4, np.pi / 4, n + 1)
    arc = np.column_stack([np.sin(angle), np.cos(angle) - np.cos(np.pi / 4)])
    width = 1.5 / n
    X = np.array([[x, y, z] for y in (0.0, width) for x, z in arc])
    low = np.arange(n)
    F = np.concatenate(
        [np.column_stack([low, low + 1, low + n + 2]), np.column_stack([low, low + n + 2, low + n + 1])]
    )
    planes = {Plane((0, y, 0), (0, 1, 0)): np.flatnonzero(X[:, 1] == y) for y in (0.0, width)}
    return Surface(
        X, F, np.zeros(2 * n, int), [Patch("bay", 1.0, 1.0)], fixed=[0, n, n + 1, 2 * n + 1], on_planes=planes
    )


def parts():
    """Two flat films side by side."""
    both = square(2)
    patches = [Patch("west", 2.0, 1.0), Patch("east", 2.0, 1.0)]
    half = (both.vertices[both.faces].mean(axis=1)[:, 0] > 0.5).astype(int)
    return Surface(both.vertices, both.faces, half, patches, fixed=both.fixed)
