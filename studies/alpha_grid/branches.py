"""Why no equilibrium is found at some tensions of Example 2: balance, weak patches, folds.

Everything here is found on the mesh of the grid. Tensions are triples (wall, large, small).
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pandas as pd

from generators import two_caps
from pcmc import Surface, certify
from pcmc.base.arrays import Bools, Floats
from pcmc.base.errors import SurfaceError
from pcmc.base.tolerances import HOMOTOPY_END, SOUND
from pcmc.meshing.refinement import refine
from pcmc.solvers import solve_once
from pcmc.solvers.continuation import Branch, Direction, Ending, follow
from pcmc.solvers.continuation.branch import follow_until
from pcmc.solvers.homotopy import BACK, classify_end, has_turned
from pcmc.solvers.result import Progress, Result

PATCHES = ("wall", "large", "small")
STEPS, SHORTEST = 25, 3e-4
REACHED, FOLD, SLIP = "reached", "fold", "slip"
ENDINGS = {"reached": REACHED, "fold": FOLD, "lost": SLIP}
PAST = 1.03  # times its least tension: where a branch that weakens a patch has turned back


@cache
def initial(edge_length: float) -> Surface:
    """Example 2's initial shape: a worker builds it once for all its cases."""
    return two_caps(edge_length)


def equilibrium(triple: Floats, edge_length: float) -> Result:
    """What the geometric solver finds at three tensions."""
    named = dict(zip(PATCHES, np.asarray(triple, dtype=float).tolist(), strict=True))
    return solve_once(initial(edge_length).retensioned(named), "newton", target="stationary")


def balanced(triples: Floats) -> Bools:
    """(k,) whether tensions (wall, large, small) can balance (7), or the wall rests on Π and holds.

    Where the patches' tensions differ by just the wall's, the sheets would have to lie on each other,
    which a mesh may come near: such cases are not excluded.

    >>> balanced(np.array([[4.0, 4.0, 3.0], [1.0, 4.0, 2.0], [9.0, 4.0, 3.0]])).tolist()
    [True, False, True]
    """
    wall, large, small = np.asarray(triples, dtype=float).T
    return np.asarray(np.abs(large - small) <= wall)


def patch_fold(edge_length: float, name: str) -> float:
    """The least tension of a patch that is held all around, its junction on the chord, on Π."""
    whole = initial(edge_length)
    faces = whole.faces[whole.patch_faces([whole.patch_index(name)])]
    used, local = np.unique(faces, return_inverse=True)
    X, seam = whole.vertices[used].copy(), whole.topology.on_junction[used]
    X[seam] *= [0.0, 1.0, 0.0]
    X[seam, 0] = whole.vertices[whole.fixed & whole.topology.on_junction, 0].mean()
    patch = whole.patches[whole.patch_index(name)]
    held = whole.fixed[used] | seam
    part = Surface(X, local.reshape(-1, 3), np.zeros(len(faces), int), (patch,), fixed=held)
    branch = follow(solve_once(part).surface, name, 0.1 * patch.tension, folds=1)
    return float(branch.folds.parameter.iloc[0])


def weakening_case(start: list[float], patch: str, edge_length: float) -> dict[str, Any]:
    """How weak a patch may get along the branch from an equilibrium, all else the same.

    ``least``: the least tension reached; ``quality`` of the triangles there; ``ending``: ``"fold"``
    where the branch turns back and a way down opens, ``"slip"`` where it ends otherwise.
    """
    least = [np.inf]

    def watch(progress: Progress) -> None:
        least[0] = min(least[0], progress.row["parameter"])
        if progress.row["parameter"] > PAST * least[0] or progress.row["quality"] < HOMOTOPY_END:
            raise StopIteration

    at_rest = equilibrium(np.array(start), edge_length).surface
    branch = follow(at_rest, patch, 1.0, callback=watch, steps=STEPS, smallest=SHORTEST)
    if branch.ending is Ending.REACHED:
        return {"ending": REACHED, "least": 1.0, "quality": float(branch.points.quality.iloc[-1])}
    turn = int(branch.points.parameter.argmin())
    events = branch.events
    folds = events.parameter[events.kind == "fold"].min()
    opened = events.parameter[events.kind == "index"]
    quality = float(branch.points.quality.iloc[turn])
    folded = bool((opened - folds <= BACK * folds).any()) and quality > SOUND
    return {
        "ending": FOLD if folded else SLIP,
        "least": float(branch.points.parameter.min()) if np.isnan(folds) else float(folds),
        "quality": quality,
    }


def starts(target: Floats, sound: Floats) -> list[list[float]]:
    """Equilibria (wall, large, small) from which to seek a branch to the target, best first.

    First the nearest that shares the larger patch's tension, then the nearest that shares the smaller
    one's, then the others, no two with the same patches; nearest in ratio, where a wall stronger than
    both patches together counts as their sum: it lies on Π either way. Of those equally near, the one
    whose wall is nearest.
    """

    def ratios(triples: Floats) -> Floats:
        wall = np.minimum(triples[..., 0], triples[..., 1] + triples[..., 2])
        return np.log(np.stack([wall, triples[..., 1], triples[..., 2]], axis=-1))

    apart = np.linalg.norm(ratios(sound) - ratios(target), axis=-1).round(9)
    walls = np.abs(np.log(sound[:, 0] / target[0])).round(9)
    ordered = sound[np.lexsort((walls, apart))]
    shared = [ordered[ordered[:, k] == target[k]][:1] for k in (1, 2)]
    chosen: dict[tuple[float, float], list[float]] = {}
    for triple in np.concatenate([*shared, ordered]).tolist():
        chosen.setdefault((triple[1], triple[2]), triple)
    return list(chosen.values())


def branch_case(towards: list[Any], edge_length: float) -> dict[str, Any]:
    """How the branch ends that leads from one of some equilibria to the tensions asked for.

    ``towards``: the tensions asked for, then those to start from, each (wall, large, small). The
    answer is the first start's whose branch arrives or folds, or the last's: how it ends, how far
    along the line it comes (``share``), at which tensions (``at_wall``, ...) and with which triangles
    (``quality``). Where it arrives, also what it finds there.
    """
    target = np.array(towards[0], dtype=float)
    answer: dict[str, Any] = {}
    for start in towards[1:]:
        branch = _towards(target, np.array(start, dtype=float), edge_length)
        end = classify_end(branch, back=BACK)
        ending, share, quality = ENDINGS[end.kind], end.farthest, end.quality
        at = np.array(start) + share * (target - np.array(start))
        answer = {"ending": ending, "share": share, "quality": quality}
        answer |= {f"from_{name}": value for name, value in zip(PATCHES, start, strict=True)}
        answer |= {f"at_{name}": float(value) for name, value in zip(PATCHES, at, strict=True)}
        if ending == REACHED:
            answer |= _found(branch)
        if ending in (REACHED, FOLD):
            break
    return answer


def _towards(target: Floats, start: Floats, edge_length: float) -> Branch:
    """The branch from an equilibrium along the line to other tensions, λ from 0 to 1."""
    at_rest = equilibrium(start, edge_length).surface
    line = {name: v for name, v in zip(PATCHES, (target - start).tolist(), strict=True) if v}
    there = Direction(line, relative=True)
    return follow_until(has_turned(BACK), None, at_rest, there, 1.0, steps=STEPS, smallest=SHORTEST)


def _found(branch: Branch) -> dict[str, Any]:
    """What stands at the end of a branch, in the columns of the grid's records."""
    certificate = certify(branch.last, modes=0)
    index = int(branch.points["index"].iloc[-1])
    return {
        "verdict": "saddle" if index else "stable",
        "index": index,
        "pinched": len(certificate.pinched),
        "wall_area": float(certificate.patches.set_index("patch").area["wall"]),
    }


def finer_case(tensions: list[float], edge_length: float) -> dict[str, Any]:
    """Whether an equilibrium of a mesh is found on one of half the edge length as well.

    From the initial shape; failing that, from the equilibrium itself, its triangles cut in four.
    """
    coarse = equilibrium(np.array(tensions), edge_length)
    found = equilibrium(np.array(tensions), 0.5 * edge_length)
    if not found.converged and coarse.converged:
        try:
            again = solve_once(refine(coarse.surface), "newton", target="stationary")
        except SurfaceError:  # a wall that lies on Π has no triangles to cut
            again = found
        found = again if again.converged else found
    height, finer_height = (float(r.surface.plane.height(r.surface.vertices).max()) for r in (coarse, found))
    return {
        "status": found.status.name.lower(),
        "verdict": found.certificate.verdict.name.lower().replace("_", " "),
        "quality": found.certificate.quality,
        "height": height,
        "finer_height": finer_height if found.converged else float("nan"),
    }


def branches(records: pd.DataFrame, open_cases: Bools, tries: int) -> list[list[Any]]:
    """For each open case the tensions asked for and those to start from, as ``branch_case`` takes them.

    ``tries``: how many starts a case is given at most.
    """
    columns = [f"alpha_{name}" for name in PATCHES]
    sound = records[(records.status == "converged") & (records.quality > SOUND)]
    if not len(sound):
        return []
    places = sound[columns].to_numpy()
    targets = records.loc[open_cases, columns].to_numpy()
    return [[target.tolist(), *starts(target, places)[:tries]] for target in targets]
