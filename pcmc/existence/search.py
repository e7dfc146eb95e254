"""The search for an equilibrium after the first start has led to none, and for the proof that none exists."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from ..base.arrays import Bools
from ..certificate.balance import hardly_balanced, load_is_given, load_name, load_ratio, unbalanced, unheld
from ..certificate.certificate import TOLERANCE
from ..certificate.neck import pinched_neck
from ..certificate.proof import Overload, Proof
from ..contact.pinching import standing_part
from ..solvers.result import Callback, Result, Status
from ..surface import Surface
from .apart import move_apart
from .attempts import Attempts
from .folding import Further
from .pressure import raise_pressure
from .starts import low_start
from .tensions import relax_tensions

RAN = (Status.DIVERGED, Status.DEGENERATE, Status.STALLED, Status.ITERATION_LIMIT, Status.VANISHED)


def search(surface: Surface, first: Result, callback: Callback | None, options: Mapping[str, Any]) -> Result:
    """An equilibrium from a further start, or the first result with the proof that there is none.

    ``first`` : what the solver made of ``surface`` with the same ``options``.
    """
    if first.status not in RAN or not first.rows:
        return first
    level = first.rows[-1]["level"]
    start = first.surface if level else surface
    remaining = {**options, "levels": options.get("levels", 0) - level}
    attempts = Attempts(callback, remaining, first.iterations + 1, first.evaluations)
    try:
        return _search(start, first, attempts)
    except (StopIteration, KeyboardInterrupt):
        return replace(first, status=Status.STOPPED, evaluations=attempts.evaluations)


def _search(start: Surface, first: Result, attempts: Attempts) -> Result:
    """The result of the first further way that leads to rest, or the proofs that there is none."""
    minimum = attempts.options.get("target", "minimum") == "minimum"
    pinchable = standing_part(start).walls.pinchable
    proofs: list[Proof] = []
    proofs += filter(None, (unbalanced(start, pinchable), unheld(start, stable=minimum)))
    for way in () if proofs else _further_ways(start, attempts, pinchable):
        further = way()
        if further.surface is not None:
            result = attempts.solve(further.surface)
            if result.converged:
                return _found(first, result, attempts, further.how)
        if further.fold is not None:
            proofs.append(further.fold)
            break
    lost = first.status in (Status.DIVERGED, Status.DEGENERATE)
    if lost and load_is_given(start) and load_ratio(start) > 1.0:
        proofs.insert(0, Overload(load_ratio(start), load_name(start)))
    return _proved(first, tuple(proofs), attempts)


def _further_ways(start: Surface, attempts: Attempts, pinchable: Bools) -> list[Callable[[], Further]]:
    """Further ways to an equilibrium, in the order of their cost."""
    low = low_start(start)
    if low is None:
        return []
    if low.rooms:  # their pressures are not given, and no way begins at others
        return [partial(Further, low, "from a lower start")]
    ways: list[Callable[[], Further]] = []
    if low.net_pressures.any():
        ways += [partial(Further, low, "from a lower start"), partial(raise_pressure, low, attempts)]
        if not hardly_balanced(start, pinchable):
            ways.append(partial(relax_tensions, low, attempts))
    return [*ways, partial(move_apart, start, attempts)]


def _found(first: Result, result: Result, attempts: Attempts, how: str) -> Result:
    """The result of a further start, with the steps of the first before its own."""
    reason = first.status.name.lower().replace("_", " ")
    note = f"found {how}, as the given start led to none ({reason})"
    rows = [*first.rows, *result.rows]
    return replace(
        result,
        rows=rows,
        iterations=attempts.steps - 1,
        evaluations=attempts.evaluations,
        note="; ".join(filter(None, (note, result.note))),
    )


def _proved(first: Result, proofs: tuple[Proof, ...], attempts: Attempts) -> Result:
    """The first result, with the proofs, or with the neck that has pinched off."""
    neck = pinched_neck(first.surface) if first.status is Status.DEGENERATE else None
    status, notes = first.status, [first.note]
    if first.rows[-1]["residual"] <= TOLERANCE:  # a coarse mesh may rest where no smooth surface does
        proofs = ()
    if proofs:
        if status is not Status.VANISHED:
            status = Status.NO_EQUILIBRIUM
        notes = [*map(str, proofs), *notes]
    elif neck is not None:
        status = Status.PINCHED
    if neck is not None:
        notes.append(str(neck))
    return replace(
        first,
        status=status,
        evaluations=attempts.evaluations,
        note="; ".join(filter(None, notes)),
        proofs=proofs,
    )
