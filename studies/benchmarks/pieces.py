"""How much faster a piece between mirror planes is solved than the whole, from the same start.

Processor time to a relative residual of 1e-10. The piece's shape, unfolded, is that of the whole at rest:
solved on from there, the whole keeps its vertices and its energy. Solved from its own start its vertices come
to lie elsewhere along the same shape, which changes its energy a little.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

from generators import four_fans, two_squares
from pcmc import Plane, Surface, certify, cut, energy, mirrored, solve

from .timing import Row, median

AT_REST, FINAL = 1e-10, 1e-12  # relative residuals
MIDDLE = (Plane(normal=(0.0, 1.0, 0.0)),)
DIAGONALS = (Plane(normal=(1.0, 1.0, 0.0)), Plane(normal=(1.0, -1.0, 0.0)))
Case = tuple[str, Callable[[bool], Surface], Sequence[Plane]]
CASES: tuple[Case, ...] = (
    ("half of Example 1", lambda quick: two_squares(16 if quick else 128, alpha_aux=1.0), MIDDLE),
    ("quarter of Example 3", lambda quick: four_fans(8 if quick else 40, mesh="double"), DIAGONALS),
)


def pieces(quick: bool) -> list[Row]:
    """The time of each piece over that of its whole, and what the whole changes on the unfolded piece."""
    rows = []
    for name, build, planes in CASES:
        whole = piece = build(quick)
        for plane in planes:
            piece = cut(piece, plane)
        result = solve(piece, target="stationary", tolerance=AT_REST)
        residual = certify(mirrored(result.surface), modes=0).residual
        share = _seconds(piece) / _seconds(whole)
        remark = f"{piece.m:,} of {whole.m:,} triangles; unfolded, its residual is {residual:.0e}"
        rows.append(Row(f"{name} over the whole", share, "times", remark, most=None if quick else 0.5))
        rows.append(_difference(name, mirrored(result.surface), whole))
    return rows


def _difference(name: str, unfolded: Surface, whole: Surface) -> Row:
    """The larger change, of vertices or energy, as the unfolded piece is solved on as a whole."""
    on, alone = (solve(start, target="stationary", tolerance=FINAL) for start in (unfolded, whole))
    moved = float(np.abs(on.surface.vertices - unfolded.vertices).max() / whole.size)
    change = max(moved, abs(on.energy / energy(unfolded) - 1.0))
    remark = f"of the whole, solved on; energy from its own start: {abs(alone.energy / on.energy - 1.0):.0e}"
    return Row(f"{name}, difference", change, "relative", remark, most=1e-10)


def _seconds(surface: Surface, repeats: int = 3) -> float:
    """Processor seconds from a start to rest, the median."""
    taken = []
    for _ in range(repeats):
        start = time.process_time()
        assert solve(surface, target="stationary", tolerance=AT_REST).converged
        taken.append(time.process_time() - start)
    return median(taken)
