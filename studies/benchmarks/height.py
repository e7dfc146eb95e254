"""How soon the height of the spherical cap is known to 1e-6 of its radius, with Surface Evolver beside it.

Ours solves nested meshes of flat triangles and extrapolates. The program climbs a ladder of meshes in the
same way, each cut 1→4 with the new rim on the circle, and stops on the first that is fine enough: with
linear, quadratic and Lagrange elements. Ours is wall time, the program's its own clock of processor time.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from generators import spherical_cap, spherical_cap_exact
from pcmc import Surface, solve
from pcmc.base.arrays import Floats
from pcmc.meshing.refinement import refine

from ..orders import richardson
from ..reference import evolver
from .timing import Row, median_seconds

ERROR = 1e-6  # of the height
LEAST = 10.0  # times as fast, extrapolated, as linear elements without extrapolation
PLAIN, EXTRAPOLATED = 1.0, 0.5  # times as fast as linear elements, each in the same way
RINGS, MESHES = 4, 3  # of the coarsest of our meshes; how many
ORDERS = 2, 3  # of the errors removed: the second is what is seen once the first is gone
# the program's elements: rings of the coarsest mesh, refinements; the cheapest found that are fine enough
LADDERS = {"linear": (5, 6), "quadratic": (4, 2), "lagrange 4": (9, 0), "lagrange 6": (7, 0)}
QUICK = {"linear": (4, 1), "quadratic": (4, 0)}
ALONE = 5, 7  # rings and meshes of ours that reach the same without extrapolation


def to_height(quick: bool) -> list[Row]:
    """Time to the height of the cap to 1e-6, ours and the program's."""
    heights = our_heights(RINGS, MESHES)
    seconds = median_seconds(lambda: richardson(our_heights(RINGS, MESHES), ORDERS), 1 if quick else 5)
    size = f"{MESHES} meshes up to {_triangles(RINGS, MESHES):,} triangles"
    rows = [_reached("height, extrapolated", seconds, float(richardson(heights, ORDERS)), size)]
    alone = None if quick else _without_extrapolation()
    rows += [alone] if alone else []
    if not evolver.available():
        return [*rows, Row(f"{evolver.PROGRAM} over ours", np.nan, "times", "evolver is not installed")]
    for elements, (rings, refinements) in (QUICK if quick else LADDERS).items():
        theirs, clock = ladder(elements, rings, refinements)
        size = f"{_triangles(rings, refinements + 1):,} triangles"
        rows.append(_reached(f"{evolver.PROGRAM}, {elements}", clock[-1], theirs[-1], size))
        least = LEAST if elements == "linear" and not quick else None
        rows.append(Row(f"its {elements} elements over ours", clock[-1] / seconds, "times", size, least))
        if alone and elements == "linear":
            fair = "its linear elements over ours, both of one mesh"
            rows.append(Row(fair, clock[-1] / alone.value, "times", size, PLAIN))
    theirs, clock = ladder("linear", RINGS, MESHES - 1, steps=2)
    limit = float(richardson(theirs, ORDERS))
    what = f"{evolver.PROGRAM}, linear, extrapolated by us"
    size = f"{_triangles(RINGS, MESHES):,} triangles"
    fair, least = "its linear elements over ours, both extrapolated", None if quick else EXTRAPOLATED
    rows.append(_reached(what, clock[-1], limit, size))
    return [*rows, Row(fair, clock[-1] / seconds, "times", size, least)]


HEIGHT: list[Callable[[bool], list[Row]]] = [to_height]


def our_heights(rings: int, meshes: int) -> Floats:
    """(meshes,) heights at rest of nested meshes; each goes on from the one before."""
    surface = solve(spherical_cap(1.0 / rings)).surface
    heights = [surface.vertices[0, 2]]
    for _ in range(meshes - 1):
        surface = solve(refine(surface, project=onto_rim)).surface
        heights.append(surface.vertices[0, 2])
    return np.array(heights)


def onto_rim(points: Floats) -> Floats:
    """(k,3) points of the rim's edges, put on the unit circle."""
    return points / np.linalg.norm(points[:, :2], axis=1)[:, None]


def _without_extrapolation() -> Row:
    rings, meshes = ALONE
    heights: list[Floats] = []
    seconds = median_seconds(lambda: heights.append(our_heights(rings, meshes)), 1)
    return _reached(
        "height of one mesh", seconds, heights[-1][-1], f"{_triangles(rings, meshes):,} triangles"
    )


def ladder(elements: str, rings: int, refinements: int, steps: int = 1) -> tuple[Floats, Floats]:
    """Heights on each mesh of the program's ladder, and its clock there since the file was read.

    One Newton step on each finer mesh is enough for the height of the last; ``steps`` brings all to rest.
    """
    show = 'printf "H %.17g %.17g\\n", vertex[1].z, clock - clock_was\n'
    model = "" if elements == "linear" else f"{elements}\nhessian\nhessian\n"
    start = "hessian_normal on\nclock_was := clock\ng 5\nhessian\nhessian\nhessian\n"
    commands = start + model + show + refinements * ("r\n" + steps * "hessian\n" + show)
    answers = evolver.numbers(evolver.run_datafile(datafile(spherical_cap(1.0 / rings)), commands), "H", 2)
    return answers[:, 0], answers[:, 1]


def datafile(cap: Surface) -> str:
    """A cap for the program, its rim on the unit circle: new vertices there are put on it, too."""
    X, topo = cap.vertices.tolist(), cap.topology
    on_rim = "fixed constraints 1 2"
    vertex_on_rim, edge_on_rim = (np.where(rim, on_rim, "") for rim in (cap.fixed, topo.boundary_edge))
    sides = topo.sense * (topo.edge_of_face + 1)  # side k is opposite corner k: 2, 0, 1 follow each other
    parts = {
        "constraint 1 formula: x^2 + y^2 = 1\nconstraint 2 formula: z = 0\nvertices": [
            f"{x} {y} {z} {rim}" for (x, y, z), rim in zip(X, vertex_on_rim, strict=True)
        ],
        "edges": [f"{a} {b} {rim}" for (a, b), rim in zip(topo.edges + 1, edge_on_rim, strict=True)],
        "faces": [f"{c} {a} {b} tension {cap.tensions[0]}" for a, b, c in sides],
        "bodies": [" ".join(map(str, range(1, cap.m + 1))) + " pressure 1"],
    }
    numbered = (
        line for head, rows in parts.items() for line in [head, *(f"{k} {r}" for k, r in enumerate(rows, 1))]
    )
    return "\n".join([*numbered, "read\n"])


def _triangles(rings: int, meshes: int) -> int:
    return int(6 * (rings * 2 ** (meshes - 1)) ** 2)


def _reached(what: str, seconds: float, height: float, size: str) -> Row:
    error = height - spherical_cap_exact().height
    enough = "" if abs(error) <= ERROR else f", more than {ERROR:g}"
    return Row(what, float(seconds), "s", f"{size}, error {error:.1e}{enough}")
