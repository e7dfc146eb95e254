"""Which of the walls' shapes are stable: Morse index and lowest modes against tension and refinement.

A wall on a diameter shortens when it moves sideways. What keeps it in place is its end on the fixed
outline: one vertex, whose hold on a surface fades, as every point's does, with the logarithm of the
refinement. So each of these shapes turns from a minimum into a saddle at a wall tension that falls with
the edge length. Example 2's crest has the same weak hold at its corners; there the cone that balances
(``cone.py``) is not what the surface comes to.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from generators import four_fans, three_patches, two_caps, two_squares
from generators.sphere_pair import intersection
from generators.two_caps import LARGE, SMALL
from pcmc import Certificate, Surface, certify, solve
from pcmc.base.arrays import Floats

from ..corners.cone import cone
from ..examples.flow import NOISE
from ..folder import MESH, Folder
from ..study import Study

MODES = 4
RINGS = (5, 7, 10, 14, 28)
WALLS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0)


@dataclass(frozen=True)
class Family:
    """A shape on finer and finer meshes.

    Attributes
    ----------
    build : from the number of edges along ``length`` to a surface.
    length : of a wall.
    roof : tension of what is not a wall.
    walls : the tensions that its walls are given.
    drawn : (size, tension) whose lowest mode is drawn.
    """

    name: str
    title: str
    build: Callable[[int], Surface]
    sizes: Sequence[int]
    length: float
    roof: float
    walls: Sequence[float]
    drawn: tuple[int, float] | None = None


FAMILIES = (
    Family("example3", "Example 3", four_fans, RINGS, 20.0, 10.0, WALLS, (10, 3.0)),
    Family("example3-rings", "Example 3, meshes of rings", partial(four_fans, mesh="rings"), RINGS,
           20.0, 10.0, WALLS),
    Family("fig4", "Fig. 4", three_patches, RINGS, 10.0, 6.0, WALLS, (10, 3.0)),
    Family("example1", "Example 1", two_squares, (4, 8, 16, 32, 64), 4.0, 2.0,
           (0.5, 1.0, 1.5, 2.0, 2.5, 3.0), (16, 2.0)),
)  # fmt: skip
CORNER_LENGTHS = (0.8, 0.6, 0.4, 0.3, 0.2)
CREST = 6  # edges of the crest, counted from the corner
# Example 2's outlines, circles of radius 6 and 4, by middle and radius; and their upper corner.
OUTLINES = {
    name: ((ball.centre[0], 0.0), ball.floor_radius) for name, ball in (("large", LARGE), ("small", SMALL))
}
CORNER = intersection(LARGE, SMALL).points(1)[-1, :2]


def data(folder: Folder, short: bool) -> None:
    """``records``: every family at every size and wall tension; ``crest``: Example 2's corner."""
    rows = []
    for family in FAMILIES:
        for size in family.sizes[: 2 if short else None]:
            rows += _along(folder, family, size)
    folder.write_table("records", pd.DataFrame(rows))
    crests = [_crest(length) for length in CORNER_LENGTHS[: 1 if short else None]]
    folder.write_table("crest", pd.concat(crests, ignore_index=True))


def _along(folder: Folder, family: Family, size: int) -> list[dict[str, Any]]:
    """One mesh at every wall tension, each from the initial shape."""
    surface, rows = family.build(size), []
    for wall in family.walls:
        start = _walled(surface, wall)
        result = solve(start, "newton", target="stationary")
        found = result.certify(modes=MODES)
        rows.append(
            {
                "family": family.name,
                "size": size,
                "edge_length": family.length / size,
                "triangles": surface.m,
                "wall": wall,
                **_findings(result.status.name, found),
            }
        )
        if (size, wall) == family.drawn:
            folder.write_mesh(family.name, {"initial": start, "at rest": result.surface})
    return rows


def _walled(surface: Surface, tension: float) -> Surface:
    names = [patch.name for patch in surface.patches if patch.pressure == 0.0]
    return surface.retensioned(dict.fromkeys(names, tension))


def _findings(status: str, found: Certificate) -> dict[str, Any]:
    values = np.full(MODES, np.nan)
    values[: len(found.eigenvalues)] = found.eigenvalues
    return {
        "status": status.lower(),
        "verdict": found.verdict.name.lower(),
        "index": -1 if found.index is None else found.index,
        **{f"eigenvalue_{k + 1}": value for k, value in enumerate(values)},
        "curvature_error": float(np.maximum(found.curvature_error, NOISE)),
        "quality": found.quality,
        "pinched": len(found.pinched),
    }


def _crest(edge_length: float) -> pd.DataFrame:
    """Example 2's crest from its upper corner: direction of each edge, in degrees.

    ``turned`` is the azimuth in plan from the larger patch's outline, through the inside;
    ``from_large`` and ``from_small`` are the angles in space to the two outlines.
    """
    result = solve(two_caps(edge_length), "newton", target="stationary")
    X = result.surface.vertices
    (curve,) = result.surface.topology.junctions
    points = X[curve.vertices if X[curve.vertices[0], 1] > 0 else curve.vertices[::-1]][: CREST + 1]
    edges = np.diff(points, axis=0)
    edges /= np.linalg.norm(edges, axis=1)[:, None]
    tangents = {name: np.append(tangent(name), 0.0) for name in OUTLINES}
    start = math.atan2(tangents["large"][1], tangents["large"][0])
    azimuth = np.arctan2(edges[:, 1], edges[:, 0]) - start
    middle = 0.5 * (points[1:] + points[:-1]) - points[0]
    return pd.DataFrame(
        {
            "edge_length": edge_length,
            "status": result.status.name.lower(),
            "edge": np.arange(1, len(edges) + 1),
            "distance": np.linalg.norm(middle, axis=1),
            "height": np.degrees(np.arcsin(edges[:, 2])),
            "turned": np.degrees(azimuth % (2.0 * math.pi)),
            **{
                f"from_{name}": np.degrees(np.arccos(np.clip(edges @ along, -1.0, 1.0)))
                for name, along in tangents.items()
            },
        }
    )


def tangent(patch: str) -> Floats:
    """(2,) direction in which a patch's outline leaves the upper corner."""
    centre, radius = OUTLINES[patch]
    x, y = (CORNER - centre) / radius
    return np.array([-y, x]) if patch == "large" else np.array([y, -x])


def opening() -> float:
    """Of Example 2's corner, through the inside, radians."""
    return float(2.0 * math.pi - math.acos(tangent("large") @ tangent("small")))


def table(folder: Folder) -> dict[str, float]:
    """``critical``: the wall tension from which a mesh is a saddle; ``cone``: Example 2's corner."""
    records = folder.read_table("records")
    critical = pd.DataFrame(
        [
            {"family": name, "size": size, "edge_length": mine.edge_length.iloc[0],
             "critical_wall": critical_wall(mine.wall.to_numpy(), mine.eigenvalue_1.to_numpy())}
            for (name, size), mine in records.groupby(["family", "size"], sort=False)
        ]
    )  # fmt: skip
    folder.write_table("critical", critical)
    found = {
        f"critical_{row['family']}_{row['size']}": row["critical_wall"] for row in critical.to_dict("records")
    }
    sound = records[records.pinched == 0]
    found["largest_curvature_error"] = float(sound.curvature_error.max())
    found["not_converged"] = float((records.status != "converged").sum())
    return found | _corner(folder)


def critical_wall(walls: Floats, lowest: Floats) -> float:
    """The least tension at which the lowest eigenvalue turns negative, linear in between.

    0 where it is negative at the weakest wall already, ∞ where it is negative at none. On a strong wall
    that rests on Π it may be positive again.

    >>> critical_wall(np.array([1.0, 2.0, 3.0]), np.array([3.0, 1.0, -1.0]))
    2.5
    """
    known = np.isfinite(lowest)
    walls, lowest = walls[known], lowest[known]
    below = np.flatnonzero(lowest < 0.0)
    if not len(below):
        return math.inf
    k = int(below[0])
    if k == 0:
        return 0.0
    share = lowest[k - 1] / (lowest[k - 1] - lowest[k])
    return float(walls[k - 1] + share * (walls[k] - walls[k - 1]))


def _corner(folder: Folder) -> dict[str, float]:
    """The balanced cone beside what the crest's first edge does as the mesh is refined."""
    crest = folder.read_table("crest")
    first = crest[crest.edge == 1]
    large, small, wall = two_caps(CORNER_LENGTHS[0]).tensions.tolist()
    balanced = cone((large, small, wall), opening())
    assert balanced is not None
    found = {
        "opening": math.degrees(opening()),
        "cone_height": math.degrees(balanced.height),
        "cone_turned": math.degrees(balanced.azimuths[0]),
        "cone_from_large": math.degrees(balanced.arcs[0]),
        "cone_length": balanced.length,
        "cone_length_slipped": balanced.slip[0],
        "cone_exponent": balanced.exponent,
    }
    folder.write_table("cone", pd.DataFrame([found]))
    ends = {"coarse": first.iloc[0], "fine": first.iloc[-1]}
    return found | {
        f"crest_{key}_{end}": float(row[key])
        for end, row in ends.items()
        for key in ("height", "turned", "from_large")
    }


def figure(folder: Folder) -> None:
    """Lowest eigenvalue against wall tension, the critical tension, the modes, the crest."""
    from pcmc.plot import lines, vectors

    records, critical = folder.read_table("records"), folder.read_table("critical")
    for family in FAMILIES:
        mine = records[records.family == family.name]
        curves = {
            f"edge length {length:.3g}": (one.wall, one.eigenvalue_1)
            for length, one in mine.groupby("edge_length", sort=False)
        }
        lines(
            curves, folder.figure(f"eigenvalues-{family.name}"), x="tension of the walls",
            y="lowest eigenvalue, force/length³", title=f"{family.title}: below 0 a saddle",
            markers=True,
        )  # fmt: skip
        if (folder.path / f"{family.name}{MESH}").is_file():
            surface = folder.read_mesh(family.name)["at rest"]
            found, wall = certify(surface, modes=1), surface.tensions[-1]
            vectors(
                surface, found.modes[0], folder.figure(f"mode-{family.name}"),
                title=f"{family.title}, walls {wall:g}: λ = {found.eigenvalues[0]:.3g},"
                      f" index {found.index}",
            )  # fmt: skip
    known = critical.assign(critical_wall=critical.critical_wall.replace([0.0, math.inf], np.nan))
    curves = {
        family.title: (one.edge_length / family.length, one.critical_wall / family.roof)
        for family in FAMILIES
        for one in [known[known.family == family.name]]
    }
    lines(
        curves, folder.figure("critical"), x="edge length / length of a wall", xscale="log",
        y="tension of the walls / tension of the roofs", markers=True,
        title="Where a shape turns into a saddle: finer meshes hold weaker walls only",
    )  # fmt: skip
    _draw_crest(folder)


def _draw_crest(folder: Folder) -> None:
    from pcmc.plot import lines

    crest, balanced = folder.read_table("crest"), folder.read_table("cone").iloc[0]
    curves: dict[str, Any] = {
        f"edge length {length:g}": (one.distance, one.from_large)
        for length, one in crest.groupby("edge_length", sort=False)
    }
    lines(
        curves, folder.figure("crest"), x="distance from the corner", markers=True,
        levels={"the balanced cone": balanced.cone_from_large},
        y="angle from the larger outline, degrees", title="Example 2: direction of the crest",
    )  # fmt: skip


def _parameters() -> Mapping[str, Any]:
    listed = {f.name: {"sizes": list(f.sizes), "walls": list(f.walls)} for f in FAMILIES}
    return {**listed, "corner_edge_lengths": CORNER_LENGTHS}


STUDY = Study(
    "stability",
    "which shapes with walls are minima and which saddles, by wall tension and refinement",
    data,
    table,
    figure,
    parameters=_parameters(),
    seconds=40,
    paper=False,
)
