"""The search for an equilibrium after the first start has led to none, and for the proof that none exists."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ..certificate.balance import hardly_balanced, load_ratio, unbalanced, unheld
from ..certificate.certificate import TOLERANCE
from ..certificate.neck import pinched_neck
from ..certificate.proof import Overload, Proof
from ..contact.pinching import standing_part
from ..solvers.result import Callback, Result, Status
from ..surface import Surface
from .apart import move_apart
from .attempts import Attempts
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
    """The steps of the search, in the order of their cost."""
    minimum = attempts.options.get("target", "minimum") == "minimum"
    pinchable = standing_part(start).walls.pinchable
    proofs: list[Proof | None] = [
        unbalanced(start, pinchable),
        unheld(start, stable=minimum),
    ]
    low = None if any(proofs) else low_start(start)
    if low is not None and low.pressures.any():
        result = attempts.solve(low)
        if result.converged:
            return _found(first, result, attempts, "from a lower start")
        raised = raise_pressure(low, attempts)
        if raised.surface is not None:
            result = attempts.solve(raised.surface)
            if result.converged:
                how = f"by raising the pressure from {raised.start:.3g} of it"
                return _found(first, result, attempts, how)
        proofs.append(raised.fold)
        if raised.fold is None and not hardly_balanced(start, pinchable):
            relaxed = relax_tensions(low, attempts)
            if relaxed.surface is not None:
                result = attempts.solve(relaxed.surface)
                if result.converged:
                    return _found(first, result, attempts, "along the branch from equal tensions")
            proofs.append(relaxed.fold)
    if low is not None and not any(proofs):
        apart = move_apart(start, attempts)
        if apart.surface is not None:
            result = attempts.solve(apart.surface)
            if result.converged:
                return _found(first, result, attempts, "by moving the held curves apart")
        proofs.append(apart.fold)
    if first.status in (Status.DIVERGED, Status.DEGENERATE) and load_ratio(start) > 1.0:
        proofs.insert(0, Overload(load_ratio(start)))
    return _proved(first, tuple(proof for proof in proofs if proof is not None), attempts)


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
