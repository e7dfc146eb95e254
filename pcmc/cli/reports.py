"""What the commands print about a designed roof."""

from __future__ import annotations

from ..project import Outcome


def report(outcome: Outcome, *, verdict: bool = True) -> None:
    """Print how the solver ended, the targets and parameters, the verdict, and the files written."""
    before = "solved before (--no-cache solves it again)"
    print(f"{outcome.surface.m} triangles; {before if outcome.cached else outcome.result.message}")
    if outcome.accurate is not None:
        print(outcome.accurate.message)
    if outcome.design is not None:
        print(f"targets {outcome.design.message}")
        if outcome.design.met:  # otherwise the message has the values
            tables = (outcome.design.targets, outcome.design.parameters)
            print(", with ".join(", ".join(f"{k} {v:.6g}" for k, v in t["value"].items()) for t in tables))
    if verdict and outcome.units:
        print(outcome.units.sentence)
    if verdict:
        print(outcome.certificate.verdict.value)
        if outcome.certificate.detail:
            print(outcome.certificate.detail)
    if outcome.files:
        print(f"written: {', '.join(map(str, outcome.files))}")
