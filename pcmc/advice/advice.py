"""What was chosen for a project, and what to type where its roof has no equilibrium."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from ..base.errors import PcmcError
from ..base.units import Units
from ..certificate.balance import strained_junction
from ..certificate.certificate import Certificate
from ..certificate.proof import Overload
from ..certificate.verdict import Verdict
from ..contact.pinching import standing_part
from ..existence import solve
from ..plan import Divider, Plan
from ..plan.parts import BALANCED
from ..solvers.result import Result, Status
from ..surface import Surface
from .masts import SHARES, point_masts, ring_lines, with_rings
from .rises import Rise, net_pressures
from .sails import as_sail, sail_lines

if TYPE_CHECKING:
    from ..design import Design, Parameter, Target

BEYOND_FOLD = 1.15  # times the tensions at a fold: a roof well on this side of it
FARTHEST = 20.0  # times the tensions: a fold beyond has another reason, such as an end that slips
TRIES = 3  # plans tried
TRIANGLES = 5000  # of the meshes that these are tried on, at most about


class Ended(Protocol):
    """How a project was solved, by its outcome."""

    @property
    def certificate(self) -> Certificate: ...
    @property
    def design(self) -> Design | None: ...
    @property
    def solved(self) -> Result: ...
    @property
    def good(self) -> bool: ...


Trial = Callable[[Plan, Surface, Sequence["Target"]], Ended]  # solves a plan from a surface, with targets


@dataclass(frozen=True)
class Task:
    """What a project asks for.

    Attributes
    ----------
    plan : of its roof; None for a mesh.
    file, drawing : the names of its file and of the drawing of its plan; ``drawing`` is empty without one.
    rises, targets, vary : heights instead of tensions, which are the last targets; all targets; what varies.
    method, options : of the solver.
    units : of its numbers.
    """

    plan: Plan | None
    file: str
    drawing: str
    rises: Sequence[Rise]
    targets: Sequence[Target]
    vary: Sequence[Parameter]
    method: str
    options: Mapping[str, Any]
    units: Units


def chosen_values(plan: Plan | None, drawn: str, surface: Surface) -> list[str]:
    """The tensions and walls that a project leaves open, a line each for the drawing's and the plan's."""
    if plan is None:
        return []
    left_open = [divider for divider in plan.dividers if divider.wall == BALANCED]
    chosen = [p for p in surface.patches if any(_is_wall_of(divider, p.name) for divider in left_open)]
    values = ", ".join(f"{patch.name!r} {patch.tension:g}" for patch in chosen)
    balanced = (
        f"walls balanced with their neighbours: {values} (to choose one, type wall = under its divider)"
    )
    return [*filter(None, [drawn]), *([balanced] if chosen else [])]


def advice(task: Task, given: Surface, start: Surface, ended: Ended, try_plan: Trial) -> list[str]:
    """What to type so that a project, or a surface, comes to rest and meets its targets: a heading, and a
    line for each change.

    Parameters
    ----------
    given, start : the start shape of the project, and the one that was solved, with the command's tensions.
    ended : how that ended.
    try_plan : solves another plan from a surface, with targets.
    """
    plan, certificate = task.plan, ended.certificate
    if certificate.certified and (plan is None or ended.design is None or ended.design.met):
        return []
    if plan is None or start is not given:
        strained = strained_junction(start, standing_part(start).walls.pinchable)
        if strained is None or strained.remedy is None:
            return []
        return ["add to the command:", f"--tension {strained.remedy[0]!r}={strained.remedy[1]:g}"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the project's own warnings were shown
        result, reshaping = ended.solved, Reshaping()
        if certificate.certified:
            base, better, rests = plan, plan, True
        else:
            base, reshaping, result = _reshaped(task, plan, result)
            better, rests = _tried(task, base, result)
        targets = task.targets[: -len(task.rises)] if reshaping.sail and task.rises else task.targets
        met, reached = False, ""
        if rests and targets:
            better, met, reached = _with_targets(task, better, result, targets, try_plan)
        lines = _lines(base, better)
    if not (lines or reshaping.lines):
        return []
    tried = "which was tried and comes to rest" if rests else "as a first step"
    if met:
        tried = "which was tried, comes to rest and meets the targets"
    elif rests and targets:
        tried = "which was tried without the targets and comes to rest"
    ending = [f"with them, the targets are {reached}"] if reached else []
    return [
        f"{reshaping.cause}{_where(task, reshaping, lines)}, {tried}:",
        *reshaping.lines,
        *lines,
        *ending,
    ]


@dataclass(frozen=True)
class Reshaping:
    """Changes of what holds a roof: a sail instead of free edges, rings instead of points."""

    sail: Sequence[str] = ()
    rings: Sequence[str] = ()

    @property
    def lines(self) -> list[str]:
        """What to type or draw."""
        return [*self.sail, *self.rings]

    @property
    def cause(self) -> str:
        """Why, before a heading; empty without changes."""
        causes = ["edges that nothing holds"] if self.sail else []
        causes += ["a roof held at a single point"] if self.rings else []
        return f"the cause is {' and '.join(causes)}; " if causes else ""


def _where(task: Task, reshaping: Reshaping, lines: Sequence[str]) -> str:
    """Where to make the changes: in the project, or in its drawing."""
    toml = Path(task.file).with_suffix(".toml").name
    if not task.drawing or not reshaping.rings:
        return f"type in {toml}"
    typed = lines or reshaping.sail
    drawn = f"draw in {task.drawing}"
    return f"{drawn} and type in {toml}" if typed else drawn


def _reshaped(task: Task, plan: Plan, result: Result) -> tuple[Plan, Reshaping, Result]:
    """The plan as a sail, if edges are free, with rings instead of single points, and its result.

    The rings are the smallest with which the roof comes to rest; the plan itself where nothing does.
    """
    sail, masts = as_sail(plan, task.rises), point_masts(plan)
    base = plan if sail is None else sail
    shares = SHARES if masts else () if sail is None else (0.0,)
    for share in shares:
        changed = with_rings(base, masts, share) if masts else base
        try:
            other = solve(_coarse(changed, result).surface(), task.method, **task.options)
        except PcmcError:  # such as a patch whose point is in the ring
            continue
        if other.certificate.certified:
            typed = [] if sail is None else sail_lines(plan, sail, task.rises)
            rings = ring_lines(masts, share, drawn=bool(task.drawing))
            return changed, Reshaping(typed, rings), other
    return plan, Reshaping(), result


def _tried(task: Task, plan: Plan, result: Result) -> tuple[Plan, bool]:
    """The plan mended until it comes to rest, on a mesh that is not fine; and whether it does."""
    if result.certificate.certified:
        return plan, True
    for _ in range(TRIES):
        better = mended(plan, result)
        if not _lines(plan, better):
            break
        plan = better
        try:
            result = solve(_coarse(plan, result).surface(), task.method, **task.options)
        except PcmcError:  # too coarse for this plan
            break
        if result.certificate.certified:
            return plan, True
        if result.status is Status.STOPPED:  # by Ctrl-C, which ends the command
            raise KeyboardInterrupt
    return plan, False


def _coarse(plan: Plan, result: Result) -> Plan:
    """The plan with a mesh that is not fine."""
    return replace(plan, edge_length=plan.edge_length * max(1.0, math.sqrt(result.surface.m / TRIANGLES)))


def _with_targets(
    task: Task, plan: Plan, result: Result, targets: Sequence[Target], try_plan: Trial
) -> tuple[Plan, bool, str]:
    """The first plan that meets the targets, and whether one does; else the plan, and what it reaches."""
    looser, reached = _loosened(plan, task.vary), ""
    for candidate in (plan, looser):
        if candidate is task.plan or candidate is None:  # tried already, or nothing to loosen
            continue
        try:
            trial = try_plan(candidate, _coarse(candidate, result).surface(), targets)
        except PcmcError:  # such as a target that the coarse mesh cannot measure
            continue
        if trial.good:
            return candidate, True, ""
        if trial.design is not None:
            reached = reached or trial.design.text(task.units)
    return plan, False, reached


def _loosened(plan: Plan, vary: Sequence[Parameter]) -> Plan | None:
    """The plan with all walls balanced, and the tensions that vary at the mean of the others; or None.

    A wall that was chosen for far tensions holds those that vary near them.
    """
    names = {name for parameter in vary if parameter.kind == "tension" for name in parameter.names}
    others = [area.tension for area in plan.patches if area.name not in names]
    if not others or len(others) == len(plan.patches):
        return None
    mean = float(f"{sum(others) / len(others):.3g}")
    areas = [replace(area, tension=mean) if area.name in names else area for area in plan.patches]
    walls = {divider.name for divider in plan.dividers if divider.wall is not None} - names
    return replace(_with_dividers(plan, walls, wall=BALANCED), patches=areas)


def mended(plan: Plan, result: Result) -> Plan:
    """The plan with the tensions and supports that remove what its certificate complains of."""
    certificate = result.certificate
    grew = any(isinstance(proof, Overload) for proof in certificate.proofs)
    if grew or certificate.verdict in (Verdict.RAN_AWAY, Verdict.NONE_FOUND):
        plan = _stiffer(plan, result)
    sliding = {divider.name for divider in plan.dividers if divider.bottom == "sliding"}
    plan = _with_dividers(plan, sliding, bottom="held")  # only the mesh holds the ends of their junctions
    if certificate.verdict is Verdict.WALL_DOWN:
        plan = _with_dividers(plan, {d.name for d in plan.dividers}, wall=BALANCED)
    return _balanced(plan)


def _stiffer(plan: Plan, result: Result) -> Plan:
    """All tensions at least at those with which a first roof succeeds, and well beyond a fold."""
    from ..plan.proposal import ROOM, least_tension, plan_area  # needs shapely

    pressures = [abs(p) for p in net_pressures(plan).values()] or [abs(plan.pressure - plan.snow)]
    least = ROOM * least_tension(plan_area(plan), max(pressures))
    folds = [1.0 / attempt.value for attempt in result.certificate.tried if attempt.folds and attempt.value]
    factor = BEYOND_FOLD * max((fold for fold in folds if fold < FARTHEST), default=0.0)

    def raised(tension: float) -> float:
        return float(f"{max(least, factor * tension, tension):.2g}")

    if plan.tension is not None:
        return replace(plan, tension=raised(plan.tension))
    return replace(plan, patches=[replace(area, tension=raised(area.tension)) for area in plan.patches])


def _balanced(plan: Plan) -> Plan:
    """The plan with those walls balanced at which tensions do not, or hardly, balance."""
    for _ in range(len(plan.dividers) + len(plan.patches)):
        surface = plan.surface()
        strained = strained_junction(surface, standing_part(surface).walls.pinchable)
        if strained is None or strained.remedy is None:
            break
        name, tension, _ = strained.remedy
        own = {divider.name for divider in plan.dividers if _is_wall_of(divider, name)}
        areas = [replace(area, tension=tension) if area.name == name else area for area in plan.patches]
        plan = replace(_with_dividers(plan, own, wall=BALANCED), patches=areas)
    return plan


def _with_dividers(plan: Plan, names: set[str], **changes: Any) -> Plan:
    dividers = [replace(d, **changes) if d.name in names else d for d in plan.dividers]
    return replace(plan, dividers=dividers)


def _lines(plan: Plan, other: Plan) -> list[str]:
    """The lines to type that make the one plan the other: tensions, walls and bottoms."""
    lines = [("[plan]", "tension", plan.tension, other.tension)]
    for before, after in zip(plan.patches, other.patches, strict=True):
        lines.append((f"[plan.patches] {before.name}:", "tension", before.tension, after.tension))
    made = other.surface().patches
    for number, (was, new) in enumerate(zip(plan.dividers, other.dividers, strict=True), 1):
        place = f"[[plan.dividers]] number {number} ({was.name!r}):"
        wall = next((p.tension for p in made if _is_wall_of(new, p.name)), None)
        lines.append((place, "wall", was.wall, was.wall if new.wall == was.wall else wall))
        lines.append((place, "bottom", was.bottom, new.bottom))
    return [f"{a} {key} = {_toml(new)}  (now {_toml(old)})" for a, key, old, new in lines if new != old]


def _toml(value: Any) -> str:
    return f"{value:g}" if isinstance(value, int | float) else f'"{value}"'


def _is_wall_of(divider: Divider, name: str) -> bool:
    """Whether a patch is the wall of a divider, or a part of it."""
    stem, dash, number = name.rpartition("-")
    return name == divider.name or (bool(dash) and stem == divider.name and number.isdigit())
