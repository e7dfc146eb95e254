"""A long barrel vault, as a piece of it between two mirror planes."""

from __future__ import annotations

import numpy as np

from pcmc import Patch, Plane, Surface
from pcmc.base import validate

from .grid import cut_squares


def barrel(
    n: int = 8,
    *,
    span: float = 2.0,
    length: float = 1.0,
    rise: float = 0.2,
    alpha: float = 2.0,
    pressure: float = 1.0,
    weight: float = 0.0,
) -> Surface:
    """A vault over the strip |x| ≤ span/2 between two held edges, and mirror planes at y = 0 and y = length.

    Under pressure p it is the circular cylinder of radius α / p. Under its own weight w alone, hanging or
    standing, z + α/w is a catenary.

    Parameters
    ----------
    n : squares across the span; those along y are about as long.
    span, length : of the piece, lengths.
    rise : height of the start in its middle, a parabola; negative below Π.
    alpha, pressure, weight : of "vault".

    >>> vault = barrel()
    >>> vault.m, int(vault.fixed.sum()), [plane.mirror for plane, _ in vault.on_planes]
    (64, 10, [True, True])
    """
    n = validate.integer("n", n, least=2)
    span, length = validate.positive("span", span), validate.positive("length", length)
    rows = max(1, round(n * length / span))
    t, y = np.meshgrid(np.linspace(-1.0, 1.0, n + 1), np.linspace(0.0, length, rows + 1), indexing="ij")
    X = np.stack([0.5 * span * t, y, rise * (1.0 - t**2)], axis=-1).reshape(-1, 3)
    number = np.arange(len(X)).reshape(n + 1, rows + 1)
    faces = cut_squares(number, np.add.outer(np.arange(n), np.arange(rows)) % 2 == 0)
    ends = tuple(
        (Plane((0.0, place, 0.0), (0.0, 1.0, 0.0), name, mirror=True), X[:, 1] == place)
        for place, name in ((0.0, "front"), (length, "back"))
    )
    vault = Patch("vault", alpha, pressure, weight=weight)
    held = np.abs(X[:, 0]) == 0.5 * span
    return Surface(X, faces, np.zeros(len(faces), dtype=int), (vault,), fixed=held, on_planes=ends)
