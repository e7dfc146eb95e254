"""The search for an equilibrium after the first start has led to none, and for the proof that none exists."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ..base.tolerances import AT_REST
from ..certificate.balance import growing_part, overload
from ..certificate.diagnosis import pinched_neck
from ..certificate.proof import Attempt
from ..certificate.verdict import theorems
from ..forces.pinching import standing_part
from ..forces.rooms import room_volumes
from ..surface import Surface
from .homotopy import Homotopy, LimitReached, Solves, attempt, further_ways
from .result import Callback, Result, Status

FAR = 10.0  # times a volume
FAILED = (Status.DIVERGED, Status.DEGENERATE, Status.STALLED, Status.ITERATION_LIMIT, Status.VANISHED)


def search(surface: Surface, first: Result, callback: Callback | None, options: Mapping[str, Any]) -> Result:
    """An equilibrium from a further start, or the first result with what was tried, and proved.

    ``first`` : what the solver made of ``surface`` with the same ``options``. Where it or a further solve
    reaches the limit of iterations in ``options``, the search ends.
    """
    limited = first.status is Status.ITERATION_LIMIT and "iterations" in options
    if first.status not in FAILED or limited or not first.rows:
        return first
    level = first.rows[-1]["level"]
    start = first.surface if level else surface
    remaining = {**options, "levels": options.get("levels", 0) - level}
    solves = Solves(callback, remaining, first.rows, first.iterations + 1, first.evaluations)
    try:
        return _search(start, first, solves)
    except LimitReached as reached:
        return reached.result
    except KeyboardInterrupt:
        return replace(first, status=Status.STOPPED, evaluations=solves.evaluations)


def _search(start: Surface, first: Result, solves: Solves) -> Result:
    """The result of a homotopy that leads to rest, or else the first one with what was proved and tried."""
    minimum = solves.options.get("target", "minimum") == "minimum"
    pinchable = standing_part(start).walls.pinchable
    load = overload(start) if first.status in (Status.DIVERGED, Status.DEGENERATE) else None
    proofs = theorems(start, pinchable)
    growing = growing_part(start) if minimum and not proofs else ""
    tried, given = [Attempt("given start", _name(first))], _name(first).replace("_", " ")
    ways = further_ways(start, pinchable) if not (growing or proofs) else ()
    if growing:
        result = solves.solve(start, target="stationary")
        if result.converged:
            return replace(result, status=Status.SADDLE, note=growing)
        tried.append(Attempt("stationary point", _name(result)))
    for way in ways:
        end = attempt(way, solves) if isinstance(way, Homotopy) else (way, "from a lower start")
        if not isinstance(end, Attempt):
            surface, how = end
            result = solves.solve(surface)
            if result.converged:
                note = f"found {how}, as the given start led to none ({given})"
                return replace(result, note="; ".join(filter(None, (note, result.note))))
            end = Attempt(way.way if isinstance(way, Homotopy) else "low start", _name(result))
        tried.append(end)
        if end.folds:
            break
    neck = pinched_neck(first.surface) if first.status is Status.DEGENERATE else None
    coarse = first.rows[-1]["residual"] <= AT_REST  # a coarse mesh may rest where no smooth surface does
    proofs = () if coarse else (*filter(None, [load]), *proofs)
    status, folds = first.status, [attempt for attempt in tried if attempt.folds]
    if proofs:
        status = Status.NO_EQUILIBRIUM
    elif folds or neck is not None or status in (Status.DIVERGED, Status.VANISHED):
        status = Status.NONE_FOUND
    growing = growing_part(first.surface) if status is Status.NONE_FOUND else ""
    reasons = (*proofs, *(folds if proofs else tried), first.note, neck or "")
    note = "; ".join(filter(None, [growing, *map(str, reasons), _far_volume(start)]))
    failed = replace(first, status=status, note=note, proofs=proofs, tried=tuple(tried))
    return replace(failed, evaluations=solves.evaluations)


def _far_volume(start: Surface) -> str:
    """What to do where a room is asked for many times its volume at the start, or a small part of it."""
    for room, volume in zip(start.rooms, room_volumes(start).tolist(), strict=True):
        if volume and room.volume and not 1.0 / FAR < abs(volume / room.volume) < FAR:
            text = f"room {room.name!r} is to have {room.volume:.4g} and has {volume:.4g} at the start:"
            return f"{text} go there in steps of 3 times the volume or so, each from the surface before"
    return ""


def _name(result: Result) -> str:
    """The status as in Attempt."""
    return result.status.name.lower()
