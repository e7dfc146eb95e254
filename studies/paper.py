"""What the paper prints, what we measure, and the rules that compare them.

``paper.toml`` holds *claims*: a number or a sentence of the paper as a relation between something
we measure and a printed number, or something else we measure. A figure's label follows from its
claims.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd

from pcmc.base.errors import FileError

from .words import fill, keys

PAPER = Path(__file__).with_name("paper.toml")
HOLDS, NEAR, DIFFERS, MISSING = "reproduced", "near", "differs", "not measured"
REPRODUCED, CONDITIONAL, NOT = "reproduced", "conditionally reproduced", "not reproduced"
OWN = "; our addition"
OWN_FIELDS = {"ours", "paper", "instead"}
FIGURE_COLUMNS = ["figure", "shows", "study", "label", "claims", "reason"]
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
    own : an addition of ours beside the paper's claims, which no figure's label counts.
    given : an input of the paper's, which a study merely has to use.
    bound : whether ``paper`` is a number that we chose to stand for the paper's words.
    instead : ``ours`` of another claim that says the same of another reading of the paper, or of
        another mesh; where this one fails and that one holds, that reading is the condition.
    fails : how it reads where it does not hold, with {ours}, {paper} and {instead} in it.
    chosen : what we chose so that it holds, "the mesh" or "the iteration"; it is then no test of the method.

    ``says`` and ``fails`` may have other fields, ``{study.number}``: see ``words``.
    """

    says: str
    where: str
    ours: str
    paper: float | str
    relation: str = "="
    tolerance: float = 0.0
    near: float = 0.0
    figures: tuple[str, ...] = ()
    own: bool = False
    given: bool = False
    bound: bool = False
    instead: str = ""
    fails: str = ""
    chosen: str = ""

    @property
    def kind(self) -> str:
        """ "input", "number" (printed) or "sentence" (words of the paper, turned into a relation)."""
        if self.given:
            return "input"
        return "sentence" if self.bound or isinstance(self.paper, str) else "number"


@dataclass(frozen=True)
class Figure:
    """A figure of the paper: its number, what it shows, and what the text does not say about it."""

    number: str
    shows: str
    study: str
    unknown: str = ""


@dataclass(frozen=True)
class Finding:
    """A claim beside what we measure; ``says`` and ``fails`` are the claim's, their fields filled."""

    claim: Claim
    paper: float
    ours: float
    verdict: str
    says: str
    fails: str

    @property
    def difference(self) -> float:
        """Ours less the paper's."""
        return self.ours - self.paper

    def reason(self, instead: float = math.nan) -> str:
        """The claim without its example, and what we find, in words that stand alone."""
        digits = 4 if self.claim.kind == "sentence" else 5
        ours, target = f"{self.ours:.4g}", f"{self.paper:.{digits}g}"
        if self.fails:
            return self.fails.format(ours=ours, paper=target, instead=f"{instead:.4g}")
        says = self.says.partition(": ")[2] or self.says
        if self.claim.kind == "sentence":
            return f"{says}: ours {ours}, to hold it must be {self.claim.relation} {target}"
        if self.claim.relation != "=":
            return f"{says}: ours {ours}, printed {self.claim.relation} {target}"
        share = f" ({self.difference / self.paper:+.1%})" if self.paper else ""
        return f"{says}: ours {ours}, printed {target}{share}"


@cache
def paper(path: Path = PAPER) -> tuple[list[Claim], list[Figure]]:
    """The claims and the figures of ``paper.toml``; FileError for an unknown key or relation."""
    with path.open("rb") as file:
        data = tomllib.load(file)
    claims = [_build(Claim, entry, path) for entry in data["claim"]]
    figures = [_build(Figure, entry, path) for entry in data["figure"]]
    numbers = {figure.number for figure in figures}
    measured = {claim.ours for claim in claims}
    for claim in claims:
        if claim.relation not in RELATIONS:
            raise _wrong(path, claim, "relation", claim.relation, tuple(RELATIONS))
        if missing := set(claim.figures) - numbers:
            raise _wrong(path, claim, "figures", missing.pop(), tuple(sorted(numbers)))
        if claim.instead and claim.instead not in measured:
            raise _wrong(path, claim, "instead", claim.instead, "the key of another claim")
        if wrong := {key for key in keys(claim.fails) if "." not in key} - OWN_FIELDS:
            fields = "no fields but {ours}, {paper}, {instead} and {study.number}"
            raise _wrong(path, claim, "fails", claim.fails, f"{fields}, not {wrong}")
    return claims, figures


def printed(ours: str) -> float:
    """The number that the paper prints where we measure ``ours``; FileError if it prints none.

    >>> printed("example4.best_iteration")
    225.0
    """
    for claim in paper()[0]:
        if claim.ours == ours and not isinstance(claim.paper, str):
            return float(claim.paper)
    raise FileError(f"{PAPER}: no claim has a printed number for {ours!r}", what=str(PAPER), found=ours)


def judge(claim: Claim, measured: Mapping[str, float]) -> Finding:
    """Put a claim beside the measured numbers.

    >>> claim = Claim("least", "Sec. 9", "study.x", 2.0, tolerance=0.5, near=0.5)
    >>> [judge(claim, {"study.x": x}).verdict for x in (2.4, 2.9, 4.0)]
    ['reproduced', 'near', 'differs']
    """
    target = claim.paper
    value = measured.get(target, math.nan) if isinstance(target, str) else float(target)
    ours = measured.get(claim.ours, math.nan)
    if math.isnan(ours) or math.isnan(value):
        verdict = MISSING
    elif RELATIONS[claim.relation](ours, value, claim.tolerance):
        verdict = HOLDS
    elif claim.near > 0.0 and abs(ours - value) <= claim.near * abs(value):
        verdict = NEAR
    else:
        verdict = DIFFERS
    own = {key: f"{{{key}}}" for key in OWN_FIELDS}
    return Finding(claim, value, ours, verdict, fill(claim.says, measured), fill(claim.fails, measured, own))


def label(figure: Figure, findings: Sequence[Finding]) -> tuple[str, str, str]:
    """A figure's label, how many of the paper's claims about it hold, and the reason.

    What the paper says or prints about the figure decides: neither its inputs nor our own additions
    count. Not reproduced: a claim fails, and so does its other reading if it has one; or nothing was
    measured. Conditionally: a claim holds on its other reading only, or is only near, or what the
    figure holds is not in the text. Reproduced: every claim holds.
    """
    mine = [f for f in findings if figure.number in f.claim.figures]
    claims = [f for f in mine if not (f.claim.own or f.claim.given)]
    held = [f for f in claims if f.verdict == HOLDS]
    near = sum(f.verdict == NEAR for f in claims)
    count = f"{len(held)} of {len(claims)}" + (f", {near} near" if near else "")
    if all(f.verdict == MISSING for f in mine):
        return NOT, count, f"nothing is measured for it; run the study {figure.study}"
    other = {f.claim.ours: f for f in findings if f.verdict == HOLDS or f.verdict == NEAR}
    inputs = [f for f in mine if f.claim.given and f.verdict != HOLDS]
    failed = [f for f in claims if f.verdict in (DIFFERS, MISSING)]
    lost = [f for f in failed if f.claim.instead not in other]
    if not claims:
        count = "inputs only"
    if lost or inputs:
        return NOT, count, _reason([*inputs, *lost], other)
    if len(held) < len(claims) or figure.unknown:
        reason = _reason([f for f in claims if f.verdict != HOLDS], other)
        return CONDITIONAL, count, "; ".join(filter(None, (reason, figure.unknown)))
    return REPRODUCED, count, ""


def compare(measured: Mapping[str, float]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The comparison (a row per claim) and the figures (a row per figure)."""
    claims, figures = paper()
    findings = [judge(claim, measured) for claim in claims]
    comparison = pd.DataFrame(
        [
            {
                "study": f.claim.ours.split(".")[0],
                "kind": f.claim.kind,
                "what": f.says,
                "where": f.claim.where + (OWN if f.claim.own else ""),
                "relation": f.claim.relation,
                "paper": f.paper,
                "ours": f.ours,
                "difference": f.difference,
                "verdict": f.verdict,
                "chosen": f.claim.chosen,
                "threshold": "ours" if f.claim.bound else "",
            }
            for f in findings
        ]
    )
    figures = [replace(figure, unknown=fill(figure.unknown, measured)) for figure in figures]
    rows = [(f.number, f.shows, f.study, *label(f, findings)) for f in figures]
    return comparison, pd.DataFrame(rows, columns=FIGURE_COLUMNS)


def read_measured(results: Path) -> dict[str, float]:
    """Every study's measured numbers below ``results``."""
    frames = [pd.read_csv(path) for path in sorted(results.glob("*/measured.csv"))]
    return {key: value for frame in frames for key, value in zip(frame.key, frame.value, strict=True)}


def _reason(findings: Sequence[Finding], other: Mapping[str, Finding]) -> str:
    ours = {key: finding.ours for key, finding in other.items()}
    return "; ".join(f.reason(ours.get(f.claim.instead, math.nan)) for f in findings)


def _build(kind: type[Any], entry: Mapping[str, Any], path: Path) -> Any:
    values = dict(entry)
    if "figures" in values:
        values["figures"] = tuple(values["figures"])
    try:
        return kind(**values)
    except TypeError as error:
        name = entry.get("says") or entry.get("number")
        raise FileError(f"{path}: {name!r}: {error}", what=str(path), where=name) from None


def _wrong(path: Path, claim: Claim, key: str, found: object, expected: object) -> FileError:
    """The error for a wrong value of a claim's key."""
    return FileError(
        f"{path}: claim {claim.says!r}: {key} must be {expected}, found {found!r}",
        what=str(path),
        where=key,
        found=found,
        expected=expected,
    )
