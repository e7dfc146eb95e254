"""What the paper prints, what we measure, and the rules that compare them.

``paper.toml`` holds *claims*: a number or a sentence of the paper as a relation between something
we measure and a printed number, or something else we measure. A figure's label follows from its
claims.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd

from pcmc.errors import FileError

PAPER = Path(__file__).with_name("paper.toml")
HOLDS, NEAR, DIFFERS, MISSING = "reproduced", "near", "differs", "not measured"
REPRODUCED, CONDITIONAL, NOT = (
    "reproduced", "conditionally reproduced", "not reproduced",
)  # fmt: skip
RELATIONS = {
    "=": lambda ours, paper, tolerance: abs(ours - paper) <= tolerance,
    "<": lambda ours, paper, tolerance: ours < paper,
    ">": lambda ours, paper, tolerance: ours > paper,
}


@dataclass(frozen=True)
class Claim:
    """One thing the paper says.

    Attributes
    ----------
    says, where : what, in words, and the section or figure.
    ours : the name of our measured number, ``study.number``.
    relation : "=", "<" or ">": ours to the paper's.
    paper : the printed number, or the name of another measured number.
    tolerance : half a unit of the last printed digit, for "=".
    near : relative difference (to the paper's) up to which a number that differs is called near.
    figures : which figures rest on it.
    needed : whether a figure is not reproduced where this fails; otherwise it is a condition.
    given : an input of the paper's, which a study merely has to use.
    bound : whether ``paper`` is a number that we chose to stand for the paper's words.
    """

    says: str
    where: str
    ours: str
    paper: float | str
    relation: str = "="
    tolerance: float = 0.0
    near: float = 0.0
    figures: tuple[str, ...] = ()
    needed: bool = True
    given: bool = False
    bound: bool = False

    @property
    def kind(self) -> str:
        """ "input", "number" (printed) or "sentence" (words of the paper, turned into a relation)."""
        if self.given:
            return "input"
        return "sentence" if self.bound or isinstance(self.paper, str) else "number"


@dataclass(frozen=True)
class Figure:
    """A figure of the paper: its number, what it shows, and what of it the text does not tell."""

    number: str
    shows: str
    study: str
    unknown: str = ""


@dataclass(frozen=True)
class Finding:
    """A claim beside what we measure."""

    claim: Claim
    paper: float
    ours: float
    verdict: str

    @property
    def difference(self) -> float:
        """Ours less the paper's."""
        return self.ours - self.paper

    @property
    def sentence(self) -> str:
        """The claim without its example, and what we find, in words."""
        says = self.claim.says.partition(": ")[2] or self.claim.says
        bound = self.claim.relation if self.claim.relation != "=" else ""
        word = "printed" if self.claim.kind == "number" else "to hold"
        return f"{says}: {self.ours:.4g}, {word} {bound}{self.paper:.5g}"


@cache
def paper(path: Path = PAPER) -> tuple[list[Claim], list[Figure]]:
    """The claims and the figures of ``paper.toml``; FileError for an unknown key or relation."""
    with path.open("rb") as file:
        data = tomllib.load(file)
    claims = [_build(Claim, entry, path) for entry in data["claim"]]
    figures = [_build(Figure, entry, path) for entry in data["figure"]]
    for claim in claims:
        if claim.relation not in RELATIONS:
            raise FileError(f"{path}: {claim.says!r}: relation must be =, < or >")
        missing = set(claim.figures) - {figure.number for figure in figures}
        if missing:
            raise FileError(
                f"{path}: {claim.says!r} names figure {missing.pop()}, which is not there"
            )
    return claims, figures


def judge(claim: Claim, measured: Mapping[str, float]) -> Finding:
    """Put a claim beside the measured numbers.

    >>> claim = Claim("least", "Sec. 9", "study.x", 2.0, tolerance=0.5, near=0.5)
    >>> [judge(claim, {"study.x": x}).verdict for x in (2.4, 2.9, 4.0)]
    ['reproduced', 'near', 'differs']
    """
    printed = claim.paper
    value = measured.get(printed, math.nan) if isinstance(printed, str) else float(printed)
    ours = measured.get(claim.ours, math.nan)
    if math.isnan(ours) or math.isnan(value):
        verdict = MISSING
    elif RELATIONS[claim.relation](ours, value, claim.tolerance):
        verdict = HOLDS
    elif claim.near > 0.0 and abs(ours - value) <= claim.near * abs(value):
        verdict = NEAR
    else:
        verdict = DIFFERS
    return Finding(claim, value, ours, verdict)


def label(figure: Figure, findings: Sequence[Finding]) -> tuple[str, str]:
    """A figure's label and the reason for it, from the findings that it rests on.

    Not reproduced: a needed claim fails or nothing was measured. Conditionally: a claim is only
    near, one that is not needed fails, or the figure holds something that the text does not tell.
    """
    mine = [f for f in findings if figure.number in f.claim.figures]
    if all(f.verdict == MISSING for f in mine):
        return NOT, f"nothing is measured for it; run the study {figure.study}"
    failed = [f for f in mine if f.verdict in (DIFFERS, MISSING) and f.claim.needed]
    if failed:
        return NOT, _reason(failed)
    conditions = [f for f in mine if f.verdict != HOLDS]
    if conditions or figure.unknown:
        return CONDITIONAL, "; ".join(filter(None, (_reason(conditions), figure.unknown)))
    return REPRODUCED, ""


def compare(measured: Mapping[str, float]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The comparison (a row per claim) and the figures (a row per figure)."""
    claims, figures = paper()
    findings = [judge(claim, measured) for claim in claims]
    comparison = pd.DataFrame(
        [
            {
                "study": f.claim.ours.split(".")[0],
                "kind": f.claim.kind,
                "what": f.claim.says,
                "where": f.claim.where,
                "relation": f.claim.relation,
                "paper": f.paper,
                "ours": f.ours,
                "difference": f.difference,
                "verdict": f.verdict,
            }
            for f in findings
        ]
    )
    rows = [(f.number, f.shows, f.study, *label(f, findings)) for f in figures]
    return comparison, pd.DataFrame(rows, columns=["figure", "shows", "study", "label", "reason"])


def read_measured(results: Path) -> dict[str, float]:
    """Every study's measured numbers below ``results``."""
    frames = [pd.read_csv(path) for path in sorted(results.glob("*/measured.csv"))]
    return {
        key: value for frame in frames for key, value in zip(frame.key, frame.value, strict=True)
    }


def _reason(findings: Sequence[Finding]) -> str:
    return "; ".join(f.sentence for f in findings)


def _build(kind: type[Any], entry: Mapping[str, Any], path: Path) -> Any:
    values = dict(entry)
    if "figures" in values:
        values["figures"] = tuple(values["figures"])
    try:
        return kind(**values)
    except TypeError as error:
        raise FileError(f"{path}: {entry.get('says') or entry.get('number')!r}: {error}") from None
