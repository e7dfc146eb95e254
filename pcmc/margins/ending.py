"""Where the stability of a branch of equilibria ends, and what ends it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from ..base.arrays import Floats
from ..certificate import Verdict
from ..continuation import Branch, Ending, follow
from ..continuation.branch_point import ALONG
from ..forces.triangles import compressed, effective_tensions
from ..meshing.quality import triangle_quality
from ..solvers import solve
from ..solvers.result import Callback, Progress
from ..surface import Surface
from .varied import Varied

FIRST, LARGEST = 0.05, 0.15  # the first and the longest step along the branch, as of ``follow``
SHORTER, FINEST = 0.25, 1e-4  # of a step on which contact and index change; where they count as one
BEYOND = 0.01  # of λ: how far beyond the last point of a lost branch the surface is solved once more


class MarginEnd(Enum):
    """What ends the stability. The value is a few words."""

    FOLD = "fold: beyond it this equilibrium is gone"
    BIFURCATION = "bifurcation: beyond it the equilibrium is a saddle"
    CONTACT = "contact: a ridge comes to rest or lifts off, and a saddle is left"
    WALL_DOWN = "wall down: a ridge comes down on the held bottom of its wall"
    COMPRESSION = "compression: the weight of a sheet is more than its tension holds"
    NONE = "no end found: it was followed no further"
    MESH = "the mesh gave out: it could not be followed further"


@dataclass(frozen=True, eq=False)
class End:
    """The end of stability on one mesh."""

    ends_by: MarginEnd
    factor: float  # λ there
    surface: Surface  # there
    motion: Floats  # (n,3) the change of the surface on the last step before; zeros where the mesh changed
    contacts: tuple[float, ...] = ()  # λ at which ridges come to rest or lift off before
    detail: str = ""  # the last difficulty of a branch that was lost


def find_end(
    surface: Surface, varied: Varied, index: int, most: float, callback: Callback | None = None
) -> End:
    """Follow the equilibria of a surface of this index until it rises, λ turns, or a part is compressed.

    Where the contact with Π changes on the last step, too, that is repeated in smaller ones, which tell the
    two apart. Raises KeyboardInterrupt where ``callback`` raises StopIteration, or for Ctrl-C.
    """
    sense, contacts = (1.0 if varied.more else -1.0), list[float]()
    branch, step = _follow(surface, varied, index, most, callback, LARGEST), LARGEST
    while True:
        events, end = branch.events, branch.points.arclength.iloc[-1]
        begin = branch.points.arclength.iloc[max(len(branch.points) - 2, 0)]
        touches = events.kind == "contact"
        contacts += events.parameter[touches & (events.arclength <= begin)].tolist()
        ended = events[(events.kind == "fold") | ((events.kind == "index") & (events.index_after > index))]
        unclear = (touches & (events.arclength > begin)).any() and len(ended)
        if not unclear or step <= FINEST:
            break
        step = SHORTER * min(end - begin, step)
        branch = _follow(branch.surfaces[len(branch.points) - 2], varied, index, most, callback, step)
    squeezed, there, detail = _compression(branch), branch.last, ""
    if squeezed is not None and (ended.empty or sense * (squeezed - ended.parameter.iloc[0]) <= 0.0):
        kind, factor = MarginEnd.COMPRESSION, squeezed
    elif len(ended):
        row = int(ended.index[0])
        event: Any = events.loc[row]
        factor, there = float(event.parameter), branch.event_surfaces[row]
        touched = (touches & (events.arclength == event.arclength)).any()
        kind = MarginEnd.CONTACT if touched else MarginEnd.BIFURCATION
        if event.kind == "fold" or event.along_branch >= ALONG:
            kind = MarginEnd.FOLD
    elif branch.ending is Ending.REACHED:
        kind, factor = MarginEnd.NONE, float(branch.points.parameter.iloc[-1])
    else:
        factor, detail = float(branch.points.parameter.iloc[-1]), branch.detail
        # a solve a little beyond its last point tells what a branch that was lost ends by
        beyond = varied.direction.line(there).surface_at(there, factor + sense * BEYOND * max(factor, 1.0))
        down = solve(beyond).certificate.verdict is Verdict.WALL_DOWN
        kind = MarginEnd.WALL_DOWN if down else MarginEnd.MESH
        if detail.startswith("triangles"):
            detail += f" near {_worst_place(there)}"
    last = branch.last.vertices
    before = branch.surfaces.get(len(branch.points) - 2, branch.last).vertices
    motion = last - before if before.shape == last.shape else np.zeros_like(last)
    return End(kind, factor, there, motion, tuple(contacts), detail)


def _follow(
    surface: Surface, varied: Varied, index: int, most: float, callback: Callback | None, largest: float
) -> Branch:
    """The branch as far as it is stable, and a point further."""
    sense, over = (1.0 if varied.more else -1.0), [False]

    def watch(progress: Progress) -> None:
        if callback is not None:
            callback(progress)
        row = progress.row
        left = row["index"] > index or sense * row["slope"] < 0.0
        over[0] = left or bool(compressed(progress.surface()).any())
        if over[0]:
            raise StopIteration

    goal, first = most if varied.more else 1.0 / most, min(FIRST, largest)
    branch = follow(surface, varied.direction, goal, callback=watch, step=first, largest=largest)
    if branch.ending is Ending.STOPPED and not over[0]:
        raise KeyboardInterrupt
    return branch


def _worst_place(surface: Surface) -> str:
    """Where the worst triangle of the roof is, walls left out as their triangles may vanish."""
    faces = surface.faces[surface.roof[surface.patch_of_face]]
    worst = faces[triangle_quality(surface.vertices, faces).argmin()]
    return f"({', '.join(f'{x:.3g}' for x in surface.vertices[worst].mean(axis=0))})"


def _compression(branch: Branch) -> float | None:
    """λ at which α + w z̄ of a triangle reaches 0, linear between the last two points; None if none does."""
    if len(branch.points) < 2 or not compressed(branch.last).any():
        return None
    parameters, surfaces = branch.points.parameter.tolist()[-2:], [*branch.surfaces.values()][-2:]
    least = [
        effective_tensions(s, s.vertices, s.faces, s.patch_of_face)[s.weights[s.patch_of_face] != 0.0].min()
        for s in surfaces
    ]
    return float(np.interp(0.0, least[::-1], parameters[::-1]))
