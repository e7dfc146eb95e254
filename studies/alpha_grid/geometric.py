"""The grid of Fig. 16 by the geometric solver, and why the paper's flow diverges where it does.

Each case of ``alpha_grid`` is solved for a stationary point on the same mesh. Where none is found, the
reason is looked for in this order. Only the first is a theorem about every surface; the others tell what
was tried, and how it ended.

- *balance*: where the patches' tensions differ by more than the wall's, no angles at the junction are in
  balance (7), whether it stands free or rests on Π. The certificate has this proof, and no other here: as the
  wall's foot slides, vertical balance has no capacity that holds for every shape.
- *patch*: a patch over its part of the plan, held all around and along the chord between the corners too,
  folds at a tension a little below half its radius (``patch_folds``). ``weakening`` follows one patch's
  tension down from every equilibrium of weak patches: no branch comes below that patch's own fold.
- *fold*: from the equilibria of the grid that are nearest, those that share a patch's tension first, the
  branch is followed along a straight line in the tensions, and folds before it arrives: it turns back, and
  a way down opens (its index grows) as it does, on triangles that are sound. ``explained`` has the tensions
  at the fold.
- *slip*: the branch ends otherwise. The junction runs into a corner of the outline and the triangles there
  collapse, or the branch turns back a long way before any way down opens: that is the mesh, not the
  surface (``stability`` tells why corners do not hold a crest). No × of the grid is left with it; it is
  said only after ``TRIES`` equilibria, in case the branch from another one folds, or arrives.

An equilibrium of one mesh may be that mesh's own. ``finer`` seeks each on a mesh of half the edge length.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd

from pcmc.base.arrays import Bools, Floats
from pcmc.sweep import Sweep, solve_case

from ..cases import run_sweep
from ..figure_panels import category_panels
from ..folder import Folder
from ..study import Study
from .branches import (
    FOLD,
    PATCHES,
    REACHED,
    SLIP,
    SOUND,
    STEPS,
    balanced,
    branch_case,
    branches,
    finer_case,
    patch_fold,
    weakening_case,
)
from .grid import AXES, CONVERGED, EDGE_LENGTH, FAILED, TENSIONS, flow_grid
from .sentences import sentences

TRIES = 12  # equilibria from which a branch is sought
WEAK = 4.0  # tension of a patch up to which its equilibria are weakened further
THIN = 0.05  # triangle quality of an equilibrium that leans on its mesh
FOLD_LENGTHS = (EDGE_LENGTH, 0.6, 0.3)  # of the meshes on which the patches' folds are sought
_FOUND = ["verdict", "index", "quality", "pinched", "wall_area"]
_ENDS = [f"{where}_{name}" for where in ("from", "at") for name in PATCHES]
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
    "none: tensions cannot balance": "#E6E6E6",
    "none found: a patch below its fold": "#D6604D",
    "none found: a fold on the way": "#F4A582",
    "undecided: the junction slips": "#FFF2AE",
    "none found": "#BDBDBD",
}


def data(folder: Folder, short: bool) -> None:
    """``records``: the geometric solver's answers; then why there is none, or how good it is."""
    sweep = geometric_sweep(TENSIONS[::4] if short else TENSIONS)
    found = run_sweep(folder, "records", sweep)
    found = found.rename(columns={"alpha_aux": "alpha_wall"})
    records = found[[*AXES, "status", *NUMBERS]].rename(columns=NUMBERS)
    flow = _flow(folder, short).set_index(list(AXES))
    records = records.join(flow[["status", "gradient_squared"]].add_prefix("flow_"), on=list(AXES))
    folder.write_table("records", records)
    lengths = FOLD_LENGTHS[: 1 if short else None]
    rows = [{"edge_length": h, **{name: patch_fold(h, name) for name in PATCHES[1:]}} for h in lengths]
    folder.write_table("patch_folds", pd.DataFrame(rows))
    _search(folder, folder.read_table("records"))


def geometric_sweep(tensions: Sequence[float]) -> Sweep:
    """The geometric solver at each triple of some tensions."""
    grid = dict.fromkeys(("alpha_aux", "alpha_large", "alpha_small"), tensions)
    fixed = {"generator": "generators:two_caps", "edge_length": EDGE_LENGTH, "method": "newton",
             "target": "stationary"}  # fmt: skip
    return Sweep(solve_case, grid, fixed)


def _flow(folder: Folder, short: bool) -> pd.DataFrame:
    """What ``alpha_grid`` found beside this study; without it the flow is run here."""
    beside = Folder(folder.path.parent / "alpha_grid")
    if (beside.path / "records.csv").is_file():
        return beside.read_table("records")
    return flow_grid(folder, short)


def _search(folder: Folder, records: pd.DataFrame) -> None:
    """``branches`` towards the cases without an equilibrium; ``weakening`` and ``finer`` of those with."""
    triples = records[list(AXES)].to_numpy()
    at_rest = (records.status == "converged").to_numpy()
    open_cases = ~at_rest & balanced(triples) & ~_weak(folder, triples)
    columns = ["ending", "share", *_FOUND, *_ENDS]
    towards = branches(records, np.asarray(open_cases), TRIES)
    _table(folder, "branches", branch_case, {"towards": towards}, columns)
    weakest = triples[:, 1:].min(axis=1) <= WEAK
    sound = triples[at_rest & weakest & (records.quality > SOUND).to_numpy()]
    grid: dict[str, Any] = {"start": sound.tolist(), "patch": list(PATCHES[1:])}
    _table(folder, "weakening", weakening_case, grid, ["patch", "ending", "least", "quality"])
    ends = folder.read_table("branches")
    arrived = ends[list(AXES)].to_numpy()[(ends.ending == REACHED).to_numpy()]
    tensions = [*triples[at_rest].tolist(), *arrived.tolist()]
    columns = ["status", "verdict", "quality", "height", "finer_height"]
    _table(folder, "finer", finer_case, {"tensions": tensions}, columns)


def _table(
    folder: Folder, name: str, case: Callable[..., Any], grid: dict[str, Any], columns: list[str]
) -> None:
    """A sweep's answers beside the tensions of its cases, the first triple of its first axis."""
    first = next(iter(grid))
    if not grid[first]:
        folder.write_table(name, pd.DataFrame(columns=[*AXES, *columns]))
        return
    found = run_sweep(folder, name, Sweep(case, grid, {"edge_length": EDGE_LENGTH}))
    found = found.reindex(columns=[first, *columns])
    triples = [v[0] if isinstance(v[0], list) else v for v in found.pop(first)]
    places = pd.DataFrame(triples, columns=list(AXES), index=found.index)
    folder.write_table(name, pd.concat([places, found], axis=1))


def _weak(folder: Folder, triples: Floats) -> Bools:
    """(k,) whether a patch has less tension than where it folds on this mesh."""
    folds = folder.read_table("patch_folds").iloc[0]
    return np.asarray((triples[:, 1] < folds.large) | (triples[:, 2] < folds.small))


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
    least = folder.read_table("weakening").groupby("patch").least.min()
    slipped = crossed.category.isin(["undecided: the junction slips", "none found"])
    return found | {
        "cases": float(len(cases)),
        "crosses": float(len(crossed)),
        "crosses_with_equilibrium": float(crossed.equilibrium.sum()),
        "crosses_unexplained": float(slipped.sum()),
        "equilibria": float(cases.equilibrium.sum()),
        "proved": float((cases.proved & ~cases.equilibrium).sum()),
        "none_found": float((~cases.proved & ~cases.equilibrium).sum()),
        "proved_elsewhere": float((cases.proved & (cases.balanced | cases.equilibrium)).sum()),
        "equilibria_thin": float((cases.equilibrium & (cases.quality < THIN)).sum()),
        "equilibria_finer": float(cases.finer.sum()),
        "thin_finer": float((cases.finer & (cases.quality < THIN)).sum()),
        **{f"least_{k}": float(v) for k, v in least.items()},
        **{f"fold_{k}": float(v) for k, v in folder.read_table("patch_folds").iloc[-1].items()},
        "sentences_confirmed": float((said.verdict == "confirmed").sum()),
    }


def explained(folder: Folder) -> pd.DataFrame:
    """Each case with its category: what there is, and what the flow made of it."""
    cases = folder.read_table("records")
    branches = folder.read_table("branches").set_index(list(AXES))
    found = branches[_FOUND].add_prefix("found_")
    cases = cases.join(branches[["ending", "share", *_ENDS]].join(found), on=list(AXES))
    for name in _FOUND:
        cases[name] = cases[name].mask(cases.ending == REACHED, cases.pop(f"found_{name}"))
    finer = folder.read_table("finer").set_index(list(AXES))
    cases = cases.join(finer[["status", "height", "finer_height"]].add_prefix("half_"), on=list(AXES))
    cases["crossed"] = cases.flow_status.isin(FAILED)
    cases["near"] = ~cases.crossed & (cases.flow_gradient_squared < CONVERGED)
    cases["equilibrium"] = (cases.status == "converged") | (cases.ending == REACHED)
    triples = cases[list(AXES)].to_numpy()
    cases["balanced"], cases["weak"] = balanced(triples), _weak(folder, triples)
    cases["proved"] = cases.verdict == "no equilibrium"
    names = list(CATEGORIES)
    tests = [
        cases.equilibrium & (cases.verdict == "saddle"),
        cases.ending == REACHED,
        cases.equilibrium & cases.near,
        cases.equilibrium,
        ~cases.balanced,
        cases.weak,
        cases.ending == FOLD,
        cases.ending == SLIP,
    ]
    cases["category"] = np.select(tests, [names[k] for k in (2, 3, 0, 1, 4, 5, 6, 7)], names[8])
    cases["finer"] = cases.equilibrium & (cases.half_status == "converged")
    folds = folder.read_table("patch_folds").iloc[0]
    cases["reason"] = [_reason(case, folds) for _, case in cases.iterrows()]
    return cases[
        [*AXES, "crossed", "near", "equilibrium", "finer", "balanced", "weak", "proved", "category", "reason",
         "ending", "share", "verdict", "index", "quality", "pinched", "wall_area"]
    ]  # fmt: skip


def _reason(case: pd.Series[Any], folds: pd.Series[float]) -> str:
    """What a case's category rests on, in numbers."""
    wall, large, small = (case[name] for name in AXES)
    if case["equilibrium"] and case["finer"]:
        return f"{case['half_height']:.3f} high here, {case['half_finer_height']:.3f} at half the edge length"
    if case["equilibrium"]:
        status = case["half_status"]
        why = f": {status.replace('_', ' ')}" if isinstance(status, str) else ""
        return f"not found at half the edge length{why}"
    if not case["balanced"]:
        return f"|{large:g} - {small:g}| > {wall:g}"
    if case["weak"]:
        pairs = [("larger", large, folds.large), ("smaller", small, folds.small)]
        return ", ".join(f"the {n} patch folds at {f:.3f}" for n, alpha, f in pairs if alpha < f)
    if not isinstance(case["ending"], str):
        return ""
    start, end = (", ".join(f"{case[f'{where}_{name}']:.4g}" for name in PATCHES) for where in ("from", "at"))
    ends = "folds" if case["ending"] == FOLD else "ends"
    return f"the branch from ({start}) {ends} at ({end})"


def figure(folder: Folder) -> None:
    """What there is at each triple, × where the flow diverged; and how good the triangles are.

    An equilibrium that is not found at half the edge length has a dot.
    """
    from pcmc.plot import heatmap

    cases = folder.read_table("explained")
    tensions = sorted(cases.alpha_large.unique())
    tables, marks, dots, quality = {}, {}, {}, {}
    for wall, mine in cases.groupby("alpha_wall"):
        name = f"α of the wall = {wall:g}"
        square = mine.pivot(index="alpha_small", columns="alpha_large")
        tables[name] = square.category.to_numpy()
        marks[name] = square.crossed.to_numpy().astype(bool)
        dots[name] = (square.equilibrium & ~square.finer.astype(bool)).to_numpy().astype(bool)
        quality[name] = np.where(square.equilibrium, square.quality, np.nan).astype(float)
    large, small = "α of the larger patch", "α of the smaller patch"
    shown = {name: color for name, color in CATEGORIES.items() if (cases.category == name).any()}
    category_panels(
        tensions, tensions, tables, shown, folder.figure("existence"),
        marks={
            "the flow diverges": ("x", marks),
            "not found at half the edge length": (".", dots),
        },
        xlabel=large, ylabel=small, columns=5,
    )  # fmt: skip
    heatmap(
        tensions, tensions, quality, folder.figure("quality"), limits=(0.0, 0.9), xlabel=large,
        ylabel=small, columns=5, label="worst triangle quality at the equilibrium; grey: none found",
    )  # fmt: skip


STUDY = Study(
    "alpha_grid_geometric",
    "the same 1000 cases by the geometric solver, and why the flow diverges: × explained",
    data,
    table,
    figure,
    parameters={"tensions": TENSIONS, "edge_length": EDGE_LENGTH, "tries": TRIES, "steps": STEPS},
    seconds=520,
    paper=False,
)
