"""The search for an equilibrium after the first start has led to none, and for the proof that none exists."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from ..base.arrays import Bools
from ..base.interrupts import stop_requested
from ..certificate.balance import (
    describe_growing,
    growing_part,
    hardly_balanced,
    overload,
    unbalanced,
    unheld,
)
from ..certificate.cables import weak_cable
from ..certificate.certificate import TOLERANCE
from ..certificate.neck import pinched_neck
from ..certificate.proof import Attempt, Proof
from ..contact.pinching import standing_part
from ..solvers.result import Callback, Result, Status
from ..surface import Surface
from .apart import move_apart
from .attempts import Attempts, LimitReached
from .folding import Further
from .loads import raise_loads
from .starts import low_start
from .tensions import relax_tensions

RAN = (Status.DIVERGED, Status.DEGENERATE, Status.STALLED, Status.ITERATION_LIMIT, Status.VANISHED)


def search(surface: Surface, first: Result, callback: Callback | None, options: Mapping[str, Any]) -> Result:
    """An equilibrium from a further start, or the first result with what was tried, and proved.

    ``first`` : what the solver made of ``surface`` with the same ``options``. Where it or a further solve
    reaches the limit of iterations in ``options``, the search ends.
    """
    limited = first.status is Status.ITERATION_LIMIT and "iterations" in options
    if first.status not in RAN or limited or not first.rows:
        return first
    level = first.rows[-1]["level"]
    start = first.surface if level else surface
    remaining = {**options, "levels": options.get("levels", 0) - level}
    attempts = Attempts(callback, remaining, first.iterations + 1, first.evaluations)
    try:
        return _search(start, first, attempts)
    except LimitReached as reached:
        return _counted(reached.result, first, attempts)
    except (StopIteration, KeyboardInterrupt) as error:
        stop_requested(error)
        return replace(first, status=Status.STOPPED, evaluations=attempts.evaluations)


def _search(start: Surface, first: Result, attempts: Attempts) -> Result:
    """The result of the first further way that leads to rest, or the first one with what was tried."""
    minimum = attempts.options.get("target", "minimum") == "minimum"
    pinchable = standing_part(start).walls.pinchable
    tried = [Attempt("given start", _name(first))]
    found = unbalanced(start, pinchable), unheld(start), weak_cable(start)
    proofs: list[Proof] = [proof for proof in found if proof is not None]
    growing = growing_part(start) if minimum and not proofs else None
    if growing is not None:
        result = attempts.solve(start, target="stationary")
        if result.converged:
            note = describe_growing(growing)
            return _counted(replace(result, status=Status.SADDLE, note=note), first, attempts)
        tried.append(Attempt("stationary point", _name(result)))
    for way in [] if proofs or growing is not None else _further_ways(start, attempts, pinchable):
        further = way()
        if further.surface is not None:
            result = attempts.solve(further.surface)
            if result.converged:
                reason = _name(first).replace("_", " ")
                note = f"found {further.how}, as the given start led to none ({reason})"
                return _counted(
                    replace(result, note="; ".join(filter(None, (note, result.note)))), first, attempts
                )
            tried.append(Attempt(further.way, _name(result)))
        elif further.attempt is not None:
            tried.append(further.attempt)
            if further.attempt.folds:
                break
    load = overload(start) if first.status in (Status.DIVERGED, Status.DEGENERATE) else None
    if load is not None:
        proofs.insert(0, load)
    return _ended(first, tuple(proofs), tuple(tried), attempts)


def _further_ways(start: Surface, attempts: Attempts, pinchable: Bools) -> list[Callable[[], Further]]:
    """Further ways to an equilibrium, in the order of their cost."""
    low = low_start(start)
    if low is None:
        return []
    from_low = partial(Further, low, "from a lower start", "low start")
    if low.rooms:  # their pressures are not given, and no way begins at others
        return [from_low]
    ways: list[Callable[[], Further]] = []
    if low.net_pressures.any() or low.weights.any():
        ways += [from_low, partial(raise_loads, low, attempts)]
        if low.net_pressures.any() and not hardly_balanced(start, pinchable):
            ways.append(partial(relax_tensions, low, attempts))
    return [*ways, partial(move_apart, start, attempts)]


def _name(result: Result) -> str:
    """The status in lower case, as in Attempt."""
    return result.status.name.lower()


def _counted(result: Result, first: Result, attempts: Attempts) -> Result:
    """The result of a further start, with the steps of the first before its own."""
    rows = [*first.rows, *result.rows]
    return replace(result, rows=rows, iterations=attempts.steps - 1, evaluations=attempts.evaluations)


def _ended(
    first: Result, proofs: tuple[Proof, ...], tried: tuple[Attempt, ...], attempts: Attempts
) -> Result:
    """The first result, with the proofs or what was tried."""
    neck = pinched_neck(first.surface) if first.status is Status.DEGENERATE else None
    if first.rows[-1]["residual"] <= TOLERANCE:  # a coarse mesh may rest where no smooth surface does
        proofs = ()
    status, folds = first.status, [attempt for attempt in tried if attempt.folds]
    if proofs:
        status = Status.NO_EQUILIBRIUM
    elif folds or neck is not None or status in (Status.DIVERGED, Status.VANISHED):
        status = Status.NONE_FOUND
    told = (*proofs, *(folds if proofs else tried), first.note, neck or "")
    growing = growing_part(first.surface) if status is Status.NONE_FOUND else None
    notes = ["" if growing is None else describe_growing(growing), *map(str, told)]
    return replace(
        first,
        status=status,
        evaluations=attempts.evaluations,
        note="; ".join(filter(None, notes)),
        proofs=proofs,
        tried=tried,
    )
