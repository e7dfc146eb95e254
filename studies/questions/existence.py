"""Where equilibria begin and end: branches followed through their folds.

- The cap over a disc, whose branch has a closed form: the sphere of radius 2α, α = (R² + h²) / 4h. It
  folds at the hemisphere, and the caps higher than that are saddles.
- Example 2 over the plane of its two tensions: rays from the paper's (4, 3), each followed to the fold
  where the branch ends, or to where the crest has run so far along an outline that triangles collapse.
  A fold is an end of the branch on the mesh as it was carried there. Started past it, the geometric
  solver spreads the triangles otherwise, and on some rays still finds minima and saddles farther on; and
  the index changes behind the fold, on the finer mesh far behind or not at all. A collapse decides
  nothing: it depends on the mesh, whose corners hold the crest less and less as it is refined, and on the
  finer one it comes before folds that the coarser one reaches.
- Example 3 as its walls pull harder: the tension at which the cross lets go of the middle. ``stability``
  seeks the same on meshes that start anew at each tension; their vertices lie otherwise along the shape,
  and its tensions are 4 to 13 % lower on as many rings of the same lattice. Both fall with the edge
  length, as the hold of the cross's ends on the outline does.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from generators import four_fans, spherical_cap, two_caps
from pcmc import Direction, Surface, certify, follow, solve
from pcmc.solvers.continuation import Branch, Ending

from ..folder import Folder
from ..study import Study

EDGES = (0.2, 0.1, 0.05)
HEIGHT = 1.5  # of the last cap, in heights of the hemisphere
LENGTHS = (1.2, 0.8)  # Example 2's edge lengths
START, WALL = (4.0, 3.0), 4.0
DEGREES = (10, 30, 40, 45, 50, 60, 80, 100, 130, 160, 190, 210, 220, 230, 240, 260, 290, 330)
FARTHEST = 3.0  # tension, as far as a ray is followed
DRAWN = (45, 100, 230, 290)
ENDS = {"folds": "fold", "degenerate": "mesh collapses", "lost": "lost", "reached": "goes on"}
MARKERS = {"folds": "o", "degenerate": "s", "lost": "X", "reached": "^"}
MEANINGS = {  # what an end says
    "folds": "fold",
    "degenerate": "the mesh collapses beside a corner: undecided",
    "lost": "the branch was lost: undecided",
    "reached": "goes on: as far as it was followed",
}
RINGS = (5, 7, 10, 14, 20)
WALLS = (0.5, 4.0)


def data(folder: Folder, short: bool) -> None:
    """Follow every branch."""
    _caps(folder, EDGES[:2] if short else EDGES)
    _rays(folder, LENGTHS[:1] if short else LENGTHS, DRAWN[2:] if short else DEGREES)
    _walls(folder, RINGS[:1] if short else RINGS)


def exact_tension(height: Any) -> Any:
    """Tension of the cap of a height over the unit disc: its sphere has radius 2α.

    >>> exact_tension(1.0)
    0.5
    """
    return (1.0 + height**2) / (4.0 * height)


def _caps(folder: Folder, edges: tuple[float, ...]) -> None:
    points, events = [], []
    for edge in edges:
        start = solve(spherical_cap(edge)).surface
        branch = follow(start, "cap", until={"height": HEIGHT}, step=-0.03, largest=0.03)
        exact = exact_tension(branch.points.height)
        error = branch.points.parameter - exact
        points.append(branch.points.assign(edge_length=edge, exact=exact, error=error))
        events.append(branch.events.assign(edge_length=edge))
    folder.write_table("cap_points", pd.concat(points))
    folder.write_table("cap_events", pd.concat(events))


def _rays(folder: Folder, lengths: tuple[float, ...], degrees: tuple[int, ...]) -> None:
    rows, points = [], []
    for length in lengths:
        start = solve(
            two_caps(length, alpha_large=START[0], alpha_small=START[1], alpha_aux=WALL), target="stationary"
        ).surface
        stages = {_tensions(start): start}
        for degree in degrees:
            angle = math.radians(degree)
            ray = Direction({"large": math.cos(angle), "small": math.sin(angle)}, relative=True)
            branch = follow(start, ray, FARTHEST, step=0.03, smallest=1e-4, folds=1)
            rows.append({"edge_length": length, "degrees": degree, **_end(branch)})
            points.append(branch.points.assign(edge_length=length, degrees=degree))
            if degree in DRAWN:
                stages[f"{_tensions(branch.last)}, {ENDS[rows[-1]['ending']]}"] = branch.last
        folder.write_mesh(f"two_caps-{length:g}", stages)
    folder.write_table("rays", pd.DataFrame(rows))
    folder.write_table("ray_points", pd.concat(points))


def _tensions(surface: Surface) -> str:
    return f"α = {surface.tensions[0]:.2f} and {surface.tensions[1]:.2f}"


def _end(branch: Branch) -> dict[str, Any]:
    """Where a ray ends and how: at its fold, or at its last point."""
    last = branch.points.iloc[-1]
    at = branch.folds.iloc[0] if branch.ending is Ending.FOLDS else last
    return {
        "ending": branch.ending.name.lower(),
        "alpha_large": at["tension large"],
        "alpha_small": at["tension small"],
        "distance": at.parameter,
        "height": at.height,
        "index": last["index"],
        "lowest_eigenvalue": last.lowest_eigenvalue,
        "quality": last.quality,
        "load_ratio": certify(branch.last).load_ratio,
        "points": len(branch.points),
    }


def _walls(folder: Folder, rings: tuple[int, ...]) -> None:
    points, events = [], []
    for number in rings:
        start = solve(four_fans(number, alpha_aux=WALLS[0]), target="stationary").surface
        names = [patch.name for patch in start.patches if patch.auxiliary]
        branch = follow(start, Direction(dict.fromkeys(names, 1.0)), WALLS[1], min_quality=0.3)
        points.append(branch.points.assign(rings=number, edge_length=20.0 / number))
        events.append(branch.events.assign(rings=number, edge_length=20.0 / number))
    folder.write_table("wall_points", pd.concat(points))
    folder.write_table("wall_events", pd.concat(events))


def table(folder: Folder) -> dict[str, float]:
    """``cap``: folds against the closed form, with orders; ``walls``: where stability is lost."""
    cap = _cap_table(folder)
    folder.write_table("cap", cap)
    finest = cap.iloc[-1]
    found = {key: float(finest[key]) for key in cap.columns}
    rays = folder.read_table("rays")
    for length, mine in rays.groupby("edge_length"):
        folds = mine[mine.ending == "folds"]
        found[f"rays_{length:g}"] = len(mine)
        found[f"folds_{length:g}"] = len(folds)
        found[f"load_ratio_{length:g}"] = float(mine.load_ratio.max())
    events = folder.read_table("wall_events")
    lost = events[(events.kind == "index") & (events.index_before == 0)]
    columns = ["rings", "edge_length", "parameter", "height", "index_before", "index_after"]
    folder.write_table("walls", lost[columns].rename(columns={"parameter": "critical_wall"}))
    return found | {f"critical_wall_{row['rings']}": row["parameter"] for row in lost.to_dict("records")}


def _cap_table(folder: Folder) -> pd.DataFrame:
    """A row an edge length: the fold, the change of index, the last cap, errors and orders."""
    points, events = folder.read_table("cap_points"), folder.read_table("cap_events")
    rows = []
    for edge, mine in points.groupby("edge_length", sort=False):
        at = events[events.edge_length == edge].set_index("kind")
        last = mine.iloc[-1]
        above = mine.arclength > at.arclength["fold"]
        rows.append(
            {
                "edge_length": edge,
                "fold": at.parameter["fold"],
                "fold_error": at.parameter["fold"] - 0.5,
                "fold_height_error": at.height["fold"] - 1.0,
                "index_change": at.parameter["index"],
                "last_height": last.height,
                "last_error": last.error,
                "index_below": int(mine["index"][~above].max()),
                "index_above": int(mine["index"][above].min()),
                "largest_residual": mine.residual.max(),
            }
        )
    cap = pd.DataFrame(rows)
    halvings = np.log2(cap.edge_length.shift() / cap.edge_length)
    for name in ("fold", "fold_height", "last"):
        error = cap[f"{name}_error"].abs()
        cap[f"{name}_order"] = np.log2(error.shift() / error) / halvings
    return cap


def figure(folder: Folder) -> None:
    """The cap's diagram and errors, where Example 2's rays end and shapes on it, Example 3's eigenvalues."""
    from pcmc.plot import convergence, diagram, lines, panel

    points, events = folder.read_table("cap_points"), folder.read_table("cap_events")
    branches = {"exact": _exact_caps()} | {
        f"edge length {edge:g}": Branch(
            Direction({"cap": 1.0}), mine, events[events.edge_length == edge], {}, Ending.REACHED
        )
        for edge, mine in points.groupby("edge_length", sort=False)
    }
    diagram(
        branches, folder.figure("cap"), xlabel="tension α / R", ylabel="height / R",
        title="Caps over a disc: stable up to the hemisphere, saddles (dashed) beyond",
    )  # fmt: skip
    cap = folder.read_table("cap")
    convergence(
        {
            name: (cap.edge_length, cap[column].abs())
            for name, column in (
                ("tension at the fold", "fold_error"), ("height at the fold", "fold_height_error"),
                (f"tension at height {HEIGHT:g}", "last_error"),
            )
        },
        folder.figure("cap-errors"), title="Errors against the sphere",
    )  # fmt: skip
    _draw_rays(folder)
    stages = folder.read_mesh(f"two_caps-{LENGTHS[0]:g}")
    panel(list(stages.values()), folder.figure("two_caps"), titles=list(stages), columns=3)
    walls = folder.read_table("wall_points")
    lines(
        {f"{rings} rings": (mine.parameter, 1e3 * mine.lowest_eigenvalue)
         for rings, mine in walls.groupby("rings")},
        folder.figure("walls"), x="tension of the walls", y="lowest eigenvalue × 1000, force/length³",
        title="Example 3: below 0 the cross lets go of the middle",
    )  # fmt: skip


def _exact_caps() -> Branch:
    """Caps of the sphere over the unit disc: α = (1 + h²) / (4 h) at height h, with the fold at h = 1."""
    heights = np.linspace(0.53, HEIGHT, 200)
    points = pd.DataFrame(
        {
            "arclength": heights,
            "parameter": (1.0 + heights**2) / (4.0 * heights),
            "height": heights,
            "index": np.where(heights < 1.0, 0, 1),
        }
    )
    fold = {"arclength": 1.0, "parameter": 0.5, "height": 1.0, "index_before": 0, "index_after": 1}
    events = pd.DataFrame([fold | {"kind": "fold"}])
    return Branch(Direction({"cap": 1.0}), points, events, {}, Ending.REACHED)


def _draw_rays(folder: Folder) -> None:
    """The ends of the rays in the plane of the tensions, joined in the order of their directions.

    Between two folds the line is whole: there the branch turns back. Next to an end that belongs
    to the mesh only, or that was not reached, it is dashed.
    """
    from pcmc.plot.figure import CURVES, INK, SMALL, TEXT, finish, new, style

    rays = folder.read_table("rays")
    figure = new(900, 820, pad=8.0)
    axes = style(figure.subplots())
    for color, (length, mine) in zip(CURVES, rays.groupby("edge_length", sort=False), strict=False):
        closed = pd.concat([mine, mine.iloc[:1]])
        for proved, x, y in _stretches(closed):
            axes.plot(x, y, color=color, linewidth=1.0, linestyle="-" if proved else (0, (4, 3)))
        axes.plot([], [], color=color, linewidth=1.0, label=f"edge length {length:g}")
        for ending, symbol in MARKERS.items():
            at = mine[mine.ending == ending]
            axes.plot(
                at.alpha_large, at.alpha_small, symbol, color=color, markersize=3.2,
                markerfacecolor=color if ending == "folds" else "white", markeredgewidth=0.8,
            )  # fmt: skip
    axes.plot(*START, "*", color=INK, markersize=5.0, linestyle="", label="the paper's tensions")
    axes.plot([], [], color=INK, linewidth=1.0, label="between folds: the branch of this mesh turns back")
    axes.plot([], [], color=INK, linewidth=1.0, linestyle=(0, (4, 3)), label="undecided")
    for ending, meaning in MEANINGS.items():
        if (rays.ending == ending).any():
            axes.plot(
                [], [], MARKERS[ending], color=INK, markersize=3.2, markeredgewidth=0.8,
                markerfacecolor=INK if ending == "folds" else "white", label=meaning,
            )  # fmt: skip
    axes.legend(fontsize=SMALL, frameon=False, labelcolor=INK, loc="upper left", handlelength=2.6)
    axes.set_xlim(*_widened(rays.alpha_large))
    axes.set_ylim(*_widened(rays.alpha_small, above=0.35))
    axes.set_xlabel("tension of the larger patch", fontsize=TEXT, color=INK)
    axes.set_ylabel("tension of the smaller patch", fontsize=TEXT, color=INK)
    axes.set_title(
        f"Example 2, wall of tension {WALL:g}: how far its equilibrium was followed",
        fontsize=TEXT, color=INK,
    )  # fmt: skip
    finish(figure, folder.figure("boundary"))


def _stretches(ends: pd.DataFrame) -> list[tuple[bool, list[float], list[float]]]:
    """From each ray's end to the next, x and y, and whether both are folds."""
    rows = list(ends[["ending", "alpha_large", "alpha_small"]].itertuples(index=False, name=None))
    return [(one[0] == two[0] == "folds", [one[1], two[1]], [one[2], two[2]]) for one, two in pairwise(rows)]


def _widened(values: pd.Series[float], above: float = 0.06) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    return low - 0.06 * (high - low), high + above * (high - low)


STUDY = Study(
    "existence",
    "where equilibria end: the cap's fold, how far Example 2's goes, Example 3's walls",
    data,
    table,
    figure,
    parameters={
        "edge_lengths": EDGES, "two_caps": LENGTHS, "start": START, "wall": WALL,
        "degrees": DEGREES, "farthest": FARTHEST, "rings": RINGS, "walls": WALLS,
    },
    seconds=60,
    paper=False,
)  # fmt: skip
