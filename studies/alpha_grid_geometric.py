"""The grid of Fig. 16 by the geometric solver, and why the paper's flow diverges where it does.

Each case of ``alpha_grid`` is solved for a stationary point on the same mesh. Where none is found, the
reason is looked for in this order:

- *patch*: a patch over its part of the plan, held all around and along the chord between the corners too,
  folds at a tension a little below half its radius (``patch_folds``). A patch that is weaker inflates even
  so, and a wall holds it less than that.
- *balance*: where the patches' tensions differ by no less than the wall's, no angles at the junction are
  in balance (7), whether it stands free or rests on Π.
- *fold*: from the nearest equilibria of the grid (no two of the same patches' tensions, nearest first) the
  branch is followed along a straight line in the tensions, and folds before it arrives: it turns back, and
  a way down opens (its index grows) as it does.
- *slip*: the branch ends otherwise. The junction runs into a corner of the outline and the triangles there
  collapse, or the branch turns back a long way before any way down opens: that is the mesh, not the
  surface (``stability`` tells why corners do not hold a crest).
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pandas as pd

from generators import two_caps
from pcmc import Surface, solve
from pcmc.arrays import Floats
from pcmc.continuation import Direction, Ending, follow
from pcmc.solvers.result import Progress
from pcmc.sweep import Sweep, solve_case

from .alpha_grid import AXES, CONVERGED, EDGE_LENGTH, FAILED, TENSIONS, flow_grid
from .cases import run_sweep
from .folder import Folder
from .panels import category_panels
from .study import Study

PATCHES = ("wall", "large", "small")
SOUND = 0.2  # triangle quality of an equilibrium from which a branch may start
TRIES, STEPS = 3, 25
BACK = 0.03  # of the way: how far behind its turn a branch may open a way down and still count as folded
REACHED, FOLD, SLIP = "reached", "fold", "slip"
FOLD_LENGTHS = (EDGE_LENGTH, 0.6, 0.3)  # of the meshes on which the patches' folds are sought
NUMBERS = {
    "verdict": "verdict", "index": "index", "curvature_error": "curvature_error",
    "curvature_error_cotangent": "curvature_error_cotangent", "quality": "quality",
    "walls_quality": "walls_quality", "pinched": "pinched", "wall.area": "wall_area",
    "load_ratio": "load_ratio", "residual": "residual", "iterations_taken": "steps",
}  # fmt: skip
CATEGORIES = {
    "a minimum; the flow comes near": "#08519C",
    "a minimum; the flow does not": "#9ECAE1",
    "a saddle": "#CC79A7",
    "one, found along a branch": "#41B6A4",
    "none: a patch below its fold": "#D6604D",
    "none: tensions cannot balance": "#E6E6E6",
    "none: a fold on the way": "#F4A582",
    "none: the junction slips": "#FFF2AE",
    "none found": "#BDBDBD",
}


def data(folder: Folder, short: bool) -> None:
    """``records``: the geometric solver's answers; ``branches``: of the cases where none is found."""
    tensions = TENSIONS[::3] if short else TENSIONS
    grid = {"alpha_aux": tensions, "alpha_large": tensions, "alpha_small": tensions}
    fixed = {"generator": "generators:two_caps", "edge_length": EDGE_LENGTH, "method": "newton",
             "target": "stationary"}  # fmt: skip
    found = run_sweep(folder, "records", Sweep(solve_case, grid, fixed))
    found = found.rename(columns={"alpha_aux": "alpha_wall"})
    records = found[[*AXES, "status", *NUMBERS]].rename(columns=NUMBERS)
    flow = _flow(folder, short).set_index(list(AXES))
    records = records.join(flow[["status", "gradient_squared"]].add_prefix("flow_"), on=list(AXES))
    folder.write_table("records", records)
    lengths = FOLD_LENGTHS[: 1 if short else None]
    rows = [
        {"edge_length": h, **{name: patch_fold(h, name) for name in PATCHES[1:]}} for h in lengths
    ]
    folder.write_table("patch_folds", pd.DataFrame(rows))
    folder.write_table("branches", _branches(folder, folder.read_table("records")))


def _flow(folder: Folder, short: bool) -> pd.DataFrame:
    """What ``alpha_grid`` found beside this study; without it the flow is run here."""
    beside = Folder(folder.path.parent / "alpha_grid")
    if (beside.path / "records.csv").is_file():
        return beside.read_table("records")
    return flow_grid(folder, short)


def _branches(folder: Folder, records: pd.DataFrame) -> pd.DataFrame:
    """Where branches towards the cases without an equilibrium end; for a × up to TRIES are followed."""
    triples = records[list(AXES)].to_numpy()
    at_rest = (records.status == "converged").to_numpy()
    sound = triples[at_rest & (records.quality > SOUND).to_numpy()]
    open_cases = ~at_rest & balanced(triples) & ~_weak(folder, triples)
    targets = triples[open_cases]
    tries = np.where(records.flow_status.isin(FAILED)[open_cases], TRIES, 1).tolist()
    columns = [*AXES, "ending", "share", "from_wall", "from_large", "from_small"]
    if not len(targets) or not len(sound):
        return pd.DataFrame(columns=columns)
    towards = [
        [target.tolist(), *nearest(target, sound)[:count]]
        for target, count in zip(targets, tries, strict=True)
    ]
    grid = {"towards": towards}
    found = run_sweep(folder, "branches", Sweep(branch_case, grid, {"edge_length": EDGE_LENGTH}))
    for k, name in enumerate(AXES):
        found[name] = targets[:, k]
    return found[columns]


def patch_fold(edge_length: float, name: str) -> float:
    """The least tension of a patch that is held all around, its junction on the chord, on Π."""
    whole = _initial(edge_length)
    faces = whole.faces[whole.patch_faces([whole.patch_index(name)])]
    used, local = np.unique(faces, return_inverse=True)
    X, seam = whole.vertices[used].copy(), whole.topology.on_junction[used]
    X[seam] *= [0.0, 1.0, 0.0]
    X[seam, 0] = whole.vertices[whole.fixed & whole.topology.on_junction, 0].mean()
    patch = whole.patches[whole.patch_index(name)]
    held = whole.fixed[used] | seam
    part = Surface(X, local.reshape(-1, 3), np.zeros(len(faces), int), (patch,), fixed=held)
    branch = follow(solve(part).surface, name, 0.1 * patch.tension, folds=1)
    return float(branch.folds.parameter.iloc[0])


def _weak(folder: Folder, triples: Floats) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """(k,) whether a patch has less tension than where it folds on this mesh."""
    folds = folder.read_table("patch_folds").iloc[0]
    return np.asarray((triples[:, 1] < folds.large) | (triples[:, 2] < folds.small))


def balanced(triples: Floats) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """(k,) whether tensions (wall, large, small) can balance, or the wall rests on Π and holds.

    >>> balanced(np.array([[4.0, 4.0, 3.0], [1.0, 4.0, 2.0], [9.0, 4.0, 3.0]])).tolist()
    [True, False, True]
    """
    wall, large, small = triples.T
    return np.asarray(np.abs(large - small) < wall)


def nearest(target: Floats, sound: Floats) -> list[list[float]]:
    """The triples from which a branch is followed: nearest in ratio, no two with the same patches.

    A wall stronger than both patches together counts as their sum: it lies on Π either way.
    """

    def ratios(triples: Floats) -> Floats:
        wall = np.minimum(triples[..., 0], triples[..., 1] + triples[..., 2])
        return np.log(np.stack([wall, triples[..., 1], triples[..., 2]], axis=-1))

    apart = np.linalg.norm(ratios(sound) - ratios(target), axis=-1).round(9)
    chosen: dict[tuple[float, float], list[float]] = {}
    for triple in sound[np.argsort(apart, kind="stable")].tolist():
        chosen.setdefault((triple[1], triple[2]), triple)
    return list(chosen.values())


def branch_case(towards: list[Any], edge_length: float) -> dict[str, Any]:
    """How the branch ends that leads from one of some equilibria to the tensions asked for.

    ``towards``: the tensions asked for, then those to start from, each (wall, large, small). The
    answer is the first start's whose branch arrives or folds, or the last's; ``share`` is how far
    along the line it comes.
    """
    target, starts = np.array(towards[0]), towards[1:]
    answer: dict[str, Any] = {}
    for start in starts:
        ending, share = _follow(target, np.array(start), edge_length)
        origin = {f"from_{name}": value for name, value in zip(PATCHES, start, strict=True)}
        answer = {"ending": ending, "share": share, **origin}
        if ending in (REACHED, FOLD):
            break
    return answer


def _follow(target: Floats, start: Floats, edge_length: float) -> tuple[str, float]:
    named = dict(zip(PATCHES, start.tolist(), strict=True))
    at_rest = solve(_initial(edge_length).retensioned(named), "newton", target="stationary").surface
    line = {name: v for name, v in zip(PATCHES, (target - start).tolist(), strict=True) if v}
    points: list[tuple[float, int]] = []

    def watch(progress: Progress) -> None:
        points.append((progress.row["parameter"], progress.row["index"]))
        if points[-1][1] > points[0][1] or points[-1][0] < max(points)[0] - BACK:
            raise StopIteration

    branch = follow(at_rest, Direction(line, relative=True), 1.0, callback=watch, steps=STEPS)
    if branch.ending is Ending.REACHED:
        return REACHED, 1.0
    opened = branch.events[(branch.events.kind == "index")]
    behind = branch.folds.parameter.max() - opened.parameter
    return FOLD if (behind <= BACK).any() else SLIP, max(points)[0]


@cache
def _initial(edge_length: float) -> Surface:
    return two_caps(edge_length)


def table(folder: Folder) -> dict[str, float]:
    """``explained``: a row per case; ``crosses``: how many × have which reason; ``sentences``."""
    cases = explained(folder)
    folder.write_table("explained", cases)
    crosses = cases[cases.crossed].groupby("category").size().rename("crosses").reset_index()
    folder.write_table("crosses", crosses)
    said = sentences(cases)
    folder.write_table("sentences", said)
    counts = cases.category.value_counts()
    found = {f"cases_{k}": float(counts.get(name, 0)) for k, name in enumerate(CATEGORIES)}
    crossed = cases[cases.crossed]
    return found | {
        "cases": float(len(cases)),
        "crosses": float(len(crossed)),
        "crosses_with_equilibrium": float(crossed.equilibrium.sum()),
        "crosses_unexplained": float((crossed.category == "none found").sum()),
        "equilibria": float(cases.equilibrium.sum()),
        **{f"fold_{k}": float(v) for k, v in folder.read_table("patch_folds").iloc[-1].items()},
        "sentences_confirmed": float((said.verdict == "confirmed").sum()),
    }


def explained(folder: Folder) -> pd.DataFrame:
    """Each case with its category: what there is, and what the flow made of it."""
    cases = folder.read_table("records")
    branches = folder.read_table("branches").set_index(list(AXES))
    cases = cases.join(branches[["ending", "share"]], on=list(AXES))
    cases["crossed"] = cases.flow_status.isin(FAILED)
    cases["near"] = ~cases.crossed & (cases.flow_gradient_squared < CONVERGED)
    cases["equilibrium"] = (cases.status == "converged") | (cases.ending == REACHED)
    triples = cases[list(AXES)].to_numpy()
    cases["balanced"], cases["weak"] = balanced(triples), _weak(folder, triples)
    names = list(CATEGORIES)
    tests = [
        cases.equilibrium & (cases.verdict == "saddle"),
        cases.ending == REACHED,
        cases.equilibrium & cases.near,
        cases.equilibrium,
        cases.weak,
        ~cases.balanced,
        cases.ending == FOLD,
        cases.ending == SLIP,
    ]
    cases["category"] = np.select(tests, [names[k] for k in (2, 3, 0, 1, 4, 5, 6, 7)], names[8])
    return cases[
        [*AXES, "crossed", "near", "equilibrium", "balanced", "weak", "category", "ending",
         "share", "verdict", "index", "pinched", "wall_area"]
    ]  # fmt: skip


def sentences(cases: pd.DataFrame) -> pd.DataFrame:
    """What Sec. 4.2 says of small and large α, each beside the table: confirmed or corrected.

    Every verdict is a comparison of two shares of cases.
    """
    wall, large, small = (cases[name] for name in AXES)
    ratio = (small / large).round(6)
    like = (ratio >= 0.6) & (ratio <= 1.7)
    low = (large <= 3.0) | (small <= 2.0)  # no more than half the radius of its disc
    patches = ~low & cases.balanced

    def share(of: pd.Series[bool], among: pd.Series[bool]) -> float:
        return float(of[among].mean()) if among.any() else math.nan

    rested = cases.equilibrium & (cases.pinched > 0)
    rows = [
        _sentence(
            "α of the auxiliary patch: no adverse effect on convergence if it is small",
            "share well converged, wall ≤ 2, equal patches above the fold",
            share(cases.near, (wall <= 2.0) & ~low & (ratio == 1.0)),
            "the same, unequal patches",
            share(cases.near, (wall <= 2.0) & ~low & (ratio != 1.0)),
            lambda a, b: b >= a,
            "it holds for equal patches; a wall weaker than the difference of their tensions leaves"
            " no equilibrium to converge to",
        ),
        _sentence(
            "if it is too large, the area of the auxiliary patch will approach 0",
            "share of the equilibria whose wall rests on the plane somewhere, wall ≥ 8",
            share(rested, (wall >= 8.0) & cases.equilibrium),
            "the same, wall ≤ 2",
            share(rested, (wall <= 2.0) & cases.equilibrium),
            lambda a, b: a > b,
            "",
        ),
        _sentence(
            "... causing instability in the analysis due to shape distortion",
            "share well converged of the equilibria, wall ≥ 8",
            share(cases.near, (wall >= 8.0) & cases.equilibrium),
            "the same, wall ≤ 4",
            share(cases.near, (wall <= 4.0) & cases.equilibrium),
            lambda a, b: a < b,
            "",
        ),
        _sentence(
            "well-converged solutions especially when α of the smaller patch is slightly smaller",
            "share well converged, α_small / α_large from 0.6 to below 1",
            share(cases.near, (ratio >= 0.6) & (ratio < 1.0)),
            "the same, equal α",
            share(cases.near, ratio == 1.0),
            lambda a, b: a > b,
            "equal tensions converge more often; slightly smaller ones only with a wall that is"
            " stronger than the difference",
        ),
        _sentence(
            "the convergence worsened when the α of the two patches were too different",
            "share well converged, ratio below 0.6 or above 1.7",
            share(cases.near, ~like),
            "the same, ratio between",
            share(cases.near, like),
            lambda a, b: a < b,
            "",
        ),
        _sentence(
            "... (and so does existence: share of cases with an equilibrium)",
            "ratio below 0.6 or above 1.7, above the fold and balanced",
            share(cases.equilibrium, patches & ~like),
            "the same, ratio between",
            share(cases.equilibrium, patches & like),
            lambda a, b: a < b,
            "",
        ),
        _sentence(
            "the process diverged due to over-inflation when too small α was assigned",
            "share of × where a patch has α ≤ half its radius",
            share(cases.crossed, low),
            "the same, elsewhere",
            share(cases.crossed, ~low),
            lambda a, b: a > b,
            "",
        ),
    ]
    return pd.DataFrame(rows)


def _sentence(
    says: str, what: str, ours: float, against: str, other: float, holds: Any, correction: str
) -> dict[str, Any]:
    """A sentence beside two numbers; where the relation fails, what is true instead."""
    true = bool(holds(ours, other))
    return {
        "paper": says, "measured": what, "value": ours, "against": against, "other": other,
        "verdict": "confirmed" if true else "corrected", "instead": "" if true else correction,
    }  # fmt: skip


def figure(folder: Folder) -> None:
    """What there is at each triple, × where the flow diverged; and how good the triangles are."""
    from pcmc.plot import heatmap

    cases, records = folder.read_table("explained"), folder.read_table("records")
    tensions = sorted(cases.alpha_large.unique())
    tables, marks, quality = {}, {}, {}
    for wall, mine in cases.groupby("alpha_wall"):
        name = f"α of the wall = {wall:g}"
        square = mine.pivot(index="alpha_small", columns="alpha_large")
        tables[name] = square.category.to_numpy()
        marks[name] = square.crossed.to_numpy().astype(bool)
        same = records[(records.alpha_wall == wall)].assign(
            shown=lambda frame: frame.quality.where(frame.status == "converged")
        )
        quality[name] = same.pivot(
            index="alpha_small", columns="alpha_large", values="shown"
        ).to_numpy()
    large, small = "α of the larger patch", "α of the smaller patch"
    category_panels(
        tensions, tensions, tables, CATEGORIES, folder.figure("existence"), marks=marks,
        xlabel=large, ylabel=small,
    )  # fmt: skip
    heatmap(
        tensions, tensions, quality, folder.figure("quality"), limits=(0.0, 0.9), xlabel=large,
        ylabel=small, label="worst triangle quality at the equilibrium; grey: none found",
    )  # fmt: skip


STUDY = Study(
    "alpha_grid_geometric",
    "the same 512 cases by the geometric solver, and why the flow diverges: × explained",
    data,
    table,
    figure,
    parameters={"tensions": TENSIONS, "edge_length": EDGE_LENGTH, "tries": TRIES, "steps": STEPS},
    seconds=150,
    paper=False,
)
